//! The Jacobian of an earlier step.

use metriplectic_fields::{Column, Dimension};

use crate::newton::Inverse;

/// The Jacobian of an earlier step, and what it was formed for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct KeptJacobian<N: Dimension> {
    /// Its inverse, if there is one.
    pub(crate) inverse: Option<Inverse<N>>,
    /// The size of the step.
    pub(crate) h: f64,
    /// The length of its displacement.
    pub(crate) length: f64,
}

impl<N: Dimension> Default for KeptJacobian<N> {
    fn default() -> Self {
        Self { inverse: None, h: 0.0, length: 0.0 }
    }
}

/// Steps after which a Jacobian is formed again, because the sizes of the terms may have changed.
/// A factor of four fails `tests/mutations.rs::the_friction_of_a_certificate_is_that_of_the_steps_however_long_a_jacobian_is_kept`.
pub(crate) const STEPS: u32 = 100;

impl<N: Dimension> KeptJacobian<N> {
    /// Forgets a Jacobian that may not be tried for a step of size `h` with this guess of the displacement: the
    /// sizes that the round-off is judged by are those of steps that are about as long.
    #[inline]
    pub(super) fn prepare(&mut self, h: f64, guess: &N::Vector<f64>) {
        if let Some(inverse) = &self.inverse {
            let fraction = guess.magnitude() / self.length;
            let same_size = self.h.to_bits() == h.to_bits();
            if !(same_size && inverse.age < STEPS && (0.7..1.5).contains(&fraction)) {
                self.inverse = None;
            }
        }
    }

    /// Notes the step of size `h` with the displacement `u` that a new inverse has solved.
    #[inline]
    pub(super) fn note(&mut self, h: f64, u: &N::Vector<f64>) {
        (self.h, self.length) = (h, u.magnitude());
    }
}
