//! Room for numbers with derivatives.

use metriplectic_fields::Real;

/// Calls `f` with so many zeros, without an allocation where they are few.
pub(super) fn with_reals<T>(count: usize, f: impl FnOnce(&mut [Real]) -> T) -> T {
    let zero = Real::new(0.0, 0.0, 0.0, 0.0);
    match count {
        0..=16 => f(&mut [zero; 16][..count]),
        17..=128 => f(&mut [zero; 128][..count]),
        _ => f(&mut vec![zero; count]),
    }
}
