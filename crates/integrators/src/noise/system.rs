//! A system with its noise.

use std::fmt;

use metriplectic_dynamics::Erase;

use super::error::NoiseError;
use super::fluctuating::{Fluctuating, Noise};
use crate::step::Element;

/// A flow `F` with thermal noise, built by [`NoiseBuilder::noise`](super::NoiseBuilder::noise) or
/// [`Noisy::new`]. Methods without random numbers do not run on it.
pub struct Noisy<F, U> {
    flow: F,
    noise: Noise<U>,
    verified: bool,
}

impl<F: fmt::Debug, U> fmt::Debug for Noisy<F, U> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { flow, noise, .. } = self;
        f.debug_struct("Noisy").field("flow", flow).field("k_b", &noise.k_b).finish_non_exhaustive()
    }
}

impl<F, U> Noisy<F, U> {
    /// Gives a flow noise of this strength.
    pub const fn new(flow: F, noise: Noise<U>) -> Self {
        Self { flow, noise, verified: false }
    }

    /// Returns the flow without its noise.
    pub const fn flow(&self) -> &F {
        &self.flow
    }

    /// Returns the strength of the noise.
    pub const fn noise(&self) -> &Noise<U> {
        &self.noise
    }

    /// Returns the noise around another flow, which is not verified.
    #[must_use]
    pub fn map<G>(self, f: impl FnOnce(F) -> G) -> Noisy<G, U> {
        Noisy { flow: f(self.flow), noise: self.noise, verified: false }
    }

    /// Marks the system as one whose model was verified.
    pub(super) fn with_certificate(self) -> Self {
        Self { verified: true, ..self }
    }

    /// Returns whether the model was verified before the run, with this noise.
    pub(super) const fn has_certificate(&self) -> bool {
        self.verified
    }
}

impl<F: Erase, U> Erase for Noisy<F, U> {
    type Erased = Noisy<F::Erased, U>;

    /// Moves energy and entropy behind pointers. The system is not verified then.
    fn erased(self) -> Self::Erased {
        self.map(F::erased)
    }
}

impl<F: Fluctuating<U>, U> Noisy<F, U> {
    /// Verifies at a state that `exp(S/k_B) μ` is the law of the noise.
    ///
    /// # Errors
    ///
    /// [`NoiseError::BoltzmannNotPositive`], and those of [`Fluctuating::examine_noise`].
    pub(super) fn examine_law(&self, x: &Element<F>) -> Result<(), NoiseError> {
        let k_b = self.noise.k_b;
        if !(k_b > 0.0 && k_b.is_finite()) {
            return Err(NoiseError::BoltzmannNotPositive { k_b });
        }
        self.flow.examine_noise(x, &self.noise)
    }
}
