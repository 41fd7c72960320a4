//! Room on the stack for large matrices.

use crate::Dimension;

/// The largest dimension whose matrices fit into the stack of every thread.
const SMALL: usize = 24;

/// Bytes for each entry of a matrix: the verification of a dissipation from a closure holds up to two hundred
/// matrices of hyper-dual numbers at once, in a program that is not optimised twice as many. Only the part that is
/// used takes memory.
const BYTES_PER_ENTRY: usize = 16384;

/// Calls `f` with enough stack for the matrices of a step in the dimension `N`.
///
/// Matrices have sizes that the compiler knows, so they live on the stack, and a step in dimension 65 takes more
/// than a thread has by default. Above dimension 24 the call gets a stack of `16384 n²` bytes, unless as much is left.
/// Nested calls find it, so a run allocates it once.
#[inline]
pub fn with_room<N: Dimension, T>(f: impl FnOnce() -> T) -> T {
    // A constant, so that small systems are compiled without what follows.
    if const { N::LEN <= SMALL } {
        return f();
    }
    let needed = BYTES_PER_ENTRY * N::LEN * N::LEN;
    stacker::maybe_grow(needed / 2, needed, || apart(f))
}

/// Calls `f` with a frame of its own: in place of the call, its matrices would stand in the frame of the caller, before there is
/// room.
#[inline(never)]
fn apart<T>(f: impl FnOnce() -> T) -> T {
    f()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Const, SMatrix};

    /// Two hundred matrices of 133 kB, which no optimisation removes.
    #[inline(never)]
    fn nested(depth: usize) -> f64 {
        let a = std::hint::black_box(SMatrix::<f64, 129, 129>::repeat(1.0));
        let below = if depth == 0 { 0.0 } else { nested(depth - 1) };
        a[(depth % 129, 0)] + below
    }

    #[test]
    fn two_hundred_large_matrices_have_room() {
        // A thread has 2 MB, fifteen of these matrices.
        let sum = std::thread::spawn(|| with_room::<Const<129>, f64>(|| nested(199)));
        assert_eq!(sum.join().unwrap().to_bits(), 200.0_f64.to_bits());
    }
}
