//! A system with its noise.

use std::fmt;

use super::fluctuating::Noise;

/// A flow `F` with thermal noise, built by [`NoiseBuilder::noise`](super::NoiseBuilder::noise) or
/// [`Noisy::new`]. Methods without random numbers do not run on it.
pub struct Noisy<F, U> {
    flow: F,
    noise: Noise<U>,
}

impl<F: fmt::Debug, U> fmt::Debug for Noisy<F, U> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { flow, noise } = self;
        f.debug_struct("Noisy").field("flow", flow).field("k_b", &noise.k_b).finish_non_exhaustive()
    }
}

impl<F, U> Noisy<F, U> {
    /// Gives a flow noise of this strength.
    pub const fn new(flow: F, noise: Noise<U>) -> Self {
        Self { flow, noise }
    }

    /// Returns the flow without its noise.
    pub const fn flow(&self) -> &F {
        &self.flow
    }

    /// Returns the strength of the noise.
    pub const fn noise(&self) -> &Noise<U> {
        &self.noise
    }
}
