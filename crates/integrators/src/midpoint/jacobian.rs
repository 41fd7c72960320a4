//! The Jacobian of an earlier step.

use metriplectic_fields::{Column, Dimension};

use crate::newton::Inverse;

/// The Jacobian of an earlier step, and what it was formed for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct KeptJacobian<N: Dimension> {
    pub(crate) inverse: Inverse<N>,
    /// The size of the step.
    pub(crate) h: f64,
    /// The length of its displacement.
    pub(crate) length: f64,
}

/// Steps after which a Jacobian is formed again, because the sizes of the terms may have changed.
const STEPS: u32 = 100;

impl<N: Dimension> KeptJacobian<N> {
    /// The one of a step of size `h` with the displacement `u`; or the one `before`, if that has solved the
    /// step.
    #[inline]
    pub(super) fn after(
        before: Option<Self>,
        inverse: Inverse<N>,
        h: f64,
        u: &N::Vector<f64>,
    ) -> Self {
        match before {
            Some(before) if inverse.age > 0 => Self { inverse, ..before },
            _ => Self { inverse, h, length: u.magnitude() },
        }
    }

    /// Whether it may be tried for a step of size `h` with this guess of the displacement: the sizes
    /// that the round-off is judged by are those of steps that are about as long.
    #[inline]
    pub(super) fn serves(&self, h: f64, guess: &N::Vector<f64>) -> bool {
        let fraction = guess.magnitude() / self.length;
        let same_size = self.h.to_bits() == h.to_bits();
        same_size && self.inverse.age < STEPS && (0.7..1.5).contains(&fraction)
    }
}
