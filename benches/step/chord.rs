//! What the steps by hand share: the guess, and Newton's method with one Jacobian.

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

/// The root near `u`, by corrections with the Jacobian there.
pub(crate) fn solve<const N: usize>(
    mut u: SVector<f64, N>,
    here: &Linearised<N>,
    residual: impl Fn(&SVector<f64, N>) -> SVector<f64, N>,
) -> SVector<f64, N> {
    let mut r = here.residual;
    for _ in 0..30 {
        if r.norm_squared() <= here.floor * here.floor {
            break;
        }
        u -= here.inverse * r;
        r = residual(&u);
    }
    u
}
