//! The derivative of one step of a model in plain numbers, on a vector space, along its start and the parameters that it knows.

pub(super) mod collocated;
mod explicit;
mod landing;
pub(super) mod schemes;
#[cfg(test)]
mod tests;
mod units;

pub(super) use explicit::propagate as explicit_propagate;
pub(super) use schemes::is_self_adjoint;

use metriplectic_equations::{Equations, Model};
use nalgebra::{DMatrix, DVector};

use crate::step::{EntropyStep, Laws};

/// A step of a model that was taken, or a part of one. Vectors and states have `n` numbers.
pub(super) struct StepOfModel<'a, S: ?Sized = dyn Model + 'a> {
    /// The system.
    pub(super) model: &'a S,
    /// The state at its start.
    pub(super) x: &'a [f64],
    /// The state at its end.
    pub(super) end: &'a [f64],
    /// Its size.
    pub(super) h: f64,
    /// How many parameters the model is differentiated along.
    pub(super) parameters: usize,
    /// The error that each entry was allowed, if the steps follow a tolerance.
    pub(super) allowed: Option<&'a [f64]>,
    /// The values of the laws that an explicit method moves its end onto, with the entropy at its start.
    pub(super) targets: &'a Laws<Vec<f64>>,
    /// How the entropy at the end was found, by a method that projects onto it.
    pub(super) entropy_step: Option<EntropyStep>,
    /// The number of stages, by a method that chooses it from step to step.
    pub(super) stage_count: Option<u32>,
    /// The velocities at its stages, one stage after the other, by a method that solves for them; none if they are not known.
    pub(super) stage_velocities: &'a [f64],
}

/// A step of a system whose parts need not be known apart.
pub(super) type StepOfSystem<'a> = StepOfModel<'a, dyn Equations + 'a>;

/// The derivatives of the end of a step.
#[derive(Clone, Debug)]
pub(super) struct Derivative {
    /// `∂x'/∂x`, `n × n`.
    pub(super) along_x: DMatrix<f64>,
    /// `∂x'/∂θ`, a column for each parameter.
    pub(super) along_parameters: DMatrix<f64>,
    /// `∂x'/∂h`.
    pub(super) along_h: DVector<f64>,
}

/// The derivatives of a loss along the start of a step, and along the parameters.
pub(super) type Pulled = (DVector<f64>, DVector<f64>);
