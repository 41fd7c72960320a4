//! The lines of a certificate on noise.

/// The noise of a run.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct NoiseSummary {
    /// Boltzmann's constant.
    pub k_b: f64,
    /// The number of terms of the friction.
    pub terms: usize,
    /// The weak order of the method.
    pub weak_order: u32,
    /// The random numbers: seed, path and their law.
    pub numbers: String,
}
