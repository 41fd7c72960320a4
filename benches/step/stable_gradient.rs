//! What the steps by hand fraction: the guess, and Newton's method with one Jacobian.

use metriplectic::prelude::{SMatrix, SVector};

/// The last three displacements.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Displacements<const N: usize>([Option<SVector<f64, N>>; 3]);

impl<const N: usize> Displacements<N> {
    pub(crate) const fn new() -> Self {
        Self([None; 3])
    }

    /// The parabola through them, continued by one step.
    pub(crate) fn extrapolate(&self) -> Option<SVector<f64, N>> {
        match self.0 {
            [Some(a), Some(b), Some(c)] => Some((a - b) * 3.0 + c),
            [Some(a), Some(b), None] => Some(a * 2.0 - b),
            _ => None,
        }
    }

    pub(crate) fn note(&mut self, displacement: SVector<f64, N>) {
        self.0 = [Some(displacement), self.0[0], self.0[1]];
    }
}

/// A residual with the inverse of its Jacobian and its round-off.
pub(crate) struct Linearised<const N: usize> {
    pub(crate) residual: SVector<f64, N>,
    pub(crate) inverse: SMatrix<f64, N, N>,
    pub(crate) floor: f64,
}

/// The root near `u`, by corrections with the Jacobian there, and their number. It ends as the library's
/// iteration does: the last correction is not checked if it promises a hundredth of the floor.
pub(crate) fn solve<const N: usize>(
    mut u: SVector<f64, N>,
    here: &Linearised<N>,
    residual: impl Fn(&SVector<f64, N>) -> SVector<f64, N>,
) -> (SVector<f64, N>, usize) {
    let (mut r, mut size, mut contraction) = (here.residual, here.residual.norm(), f64::INFINITY);
    let mut iterations = 0;
    while size > 0.1 * here.floor && iterations < 30 {
        u -= here.inverse * r;
        iterations += 1;
        if size <= here.floor || contraction * size <= 0.01 * here.floor {
            break;
        }
        r = residual(&u);
        (contraction, size) = (r.norm() / size, r.norm());
    }
    (u, iterations)
}
