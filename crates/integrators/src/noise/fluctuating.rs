//! The interface between noise and systems.

use std::ops::Range;

use metriplectic_dynamics::ModelError;
use metriplectic_dynamics::noise::Fluctuation;

use crate::explicit::StageFlow;
use crate::noise::error::NoiseError;
use crate::step::{Element, FlowError, Laws};

/// The strength of the noise of a system, and the measure of its law.
#[derive(Clone, Copy, Debug)]
pub struct Noise<U> {
    /// Boltzmann's constant.
    pub k_b: f64,
    /// The logarithm of the density of the measure.
    pub measure: U,
    /// Whether this density is 1.
    pub is_uniform: bool,
}

impl<U> Noise<U> {
    /// The noise that a builder is given.
    pub fn of<N: Fluctuation<Measure = U>>(fluctuation: N) -> Self {
        let (k_b, is_uniform) = (fluctuation.k_b(), N::IS_UNIFORM);
        Self { k_b, measure: fluctuation.into_measure(), is_uniform }
    }
}

/// A flow with noise fields `X_r`, in groups: those of the system, which keep its energy, and those of each bath.
///
/// `U` is the type of the measure.
pub trait Fluctuating<U>: StageFlow {
    /// The terms of each group.
    fn groups(&self) -> Vec<Range<usize>>;

    /// Computes `Σ_r a_r √(κ ρ_r) b_r` over terms of one group at a state, with the strength `κ` and the number `a_r` of each;
    /// `None` where it has no value. In a bath the strength has the factor `T`.
    fn noise(
        &self,
        x: &Element<Self>,
        terms: Range<usize>,
        drawn: Drawn<'_>,
    ) -> Option<Self::Vector>;

    /// Computes the kinetic drift `Σ_r c_r b_r` of a group, without the factor `k_B`; `None` where it has no value. In a bath
    /// it has the factor `T`.
    fn drift(&self, x: &Element<Self>, group: usize, noise: &Noise<U>) -> Option<Self::Vector>;

    /// Computes the velocity `K dS` of the friction at a state, with that of all baths; `None` where it has no value.
    fn friction(&self, x: &Element<Self>) -> Option<Self::Vector>;

    /// Returns whether the kinetic drift of a group may differ from zero.
    fn has_drift(&self, group: usize, noise: &Noise<U>) -> bool;

    /// The state after a flow of a group, with its laws: the energy of the run, or the heat that it has changed by. `None`
    /// if no state near by has them.
    fn landed(&self, landing: Landing<'_, Self>) -> Option<Element<Self>>;

    /// Verifies at the start of a run that the law of the noise is `exp(S/k_B) μ`.
    ///
    /// # Errors
    ///
    /// The first condition that is not met.
    fn examine_noise(&self, x: &Element<Self>, noise: &Noise<U>) -> Result<(), NoiseError>;

    /// Verifies the laws of the model at the start of a run of a [verified](super::Noisy::verified) system, without samples
    /// around it. By default the model is [checked](crate::Flow::check) as at any start.
    ///
    /// # Errors
    ///
    /// The first law of the model that is broken.
    fn check_start_alone(&self, x0: &Element<Self>) -> Result<(), ModelError> {
        self.check(x0)
    }

    /// Verifies what only the flow knows of at the start of a run of a [verified](super::Noisy::verified) system, at that
    /// state alone. By default the start is [examined](crate::Flow::examine) as any is.
    ///
    /// # Errors
    ///
    /// The flow's own error.
    fn examine_start_alone(&self, x0: &Element<Self>) -> Result<(), FlowError> {
        self.examine(x0)
    }
}

/// The strength `κ = 2 k_B h` of the noise of a step, and the number of each term.
pub type Drawn<'a> = (f64, &'a (dyn Fn(usize) -> f64 + Sync));

/// The two ends of a flow of a group.
#[derive(Debug)]
pub struct Landing<'a, F: StageFlow + ?Sized> {
    /// The group.
    pub group: usize,
    /// The state before.
    pub from: &'a Element<F>,
    /// The state after, which has not been moved onto the laws.
    pub to: Element<F>,
    /// The laws of the run.
    pub laws: &'a Laws<F::Numbers>,
}
