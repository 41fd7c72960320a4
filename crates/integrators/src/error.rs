//! Errors of runs.
//!
//! A `main` that returns an error prints its `Debug` form. For the errors of this module that is
//! the sentence of their `Display` form.

use std::fmt;

use metriplectic_dynamics::{BuildError, FormError, LegendreError, ModelError, PoissonError};
use metriplectic_manifolds::{AlgebraError, MetricError, PointError};

use crate::attitude::AttitudeError;
use crate::noise::NoisyError;
use crate::run::checkpoint::ResumeError;
use crate::run::span_error::SpanError;
use crate::step::{MethodError, StartError, StateSpace, StepError};

pub use crate::run::error::RunError;
pub use crate::step::FlowError;

/// Everything that can go wrong between three closures and a trajectory, for programs that pass all
/// of it on with `?`.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Structure constants that do not make a Lie algebra.
    #[error(transparent)]
    Algebra(#[from] AlgebraError),
    /// A metric that cannot be used.
    #[error(transparent)]
    Metric(#[from] MetricError),
    /// A matrix that is not a Poisson tensor.
    #[error(transparent)]
    Poisson(#[from] PoissonError),
    /// A point that is not on its manifold.
    #[error(transparent)]
    Point(#[from] PointError),
    /// A form that is not symmetric and positive.
    #[error(transparent)]
    Form(#[from] FormError),
    /// A Lagrangian without a Legendre transform.
    #[error(transparent)]
    Legendre(#[from] LegendreError),
    /// Parts that do not make a system.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// A model that breaks one of its laws.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A flow that has found a fault of its own.
    #[error(transparent)]
    Flow(#[from] FlowError),
    /// A method that has found a fault of its own.
    #[error(transparent)]
    Method(#[from] MethodError),
    /// A span that cannot be run.
    #[error(transparent)]
    Span(#[from] SpanError),
    /// A state that contradicts the run that is to start in it.
    #[error(transparent)]
    Start(#[from] StartError),
    /// A checkpoint that cannot be resumed.
    #[error(transparent)]
    Resume(#[from] ResumeError),
    /// A step that could not be taken.
    #[error(transparent)]
    Step(#[from] StepError),
    /// A run along which there is no attitude.
    #[error(transparent)]
    Attitude(#[from] AttitudeError),
    /// A run that stopped; the [`RunError`] with the trajectory so far can be downcast from it.
    #[error("{0}")]
    Run(#[source] Box<dyn std::error::Error + Send + Sync>),
}

impl<M: StateSpace> From<RunError<M>> for Error {
    fn from(error: RunError<M>) -> Self {
        match error {
            RunError::Model(error) => Self::Model(error),
            RunError::Flow(error) => Self::Flow(error),
            RunError::Method(error) => Self::Method(error),
            RunError::Span(error) => Self::Span(error),
            RunError::Start(error) => Self::Start(error),
            error @ RunError::Step { .. } => Self::Run(Box::new(error)),
        }
    }
}

impl From<NoisyError> for Error {
    fn from(error: NoisyError) -> Self {
        match error {
            NoisyError::Model(error) => Self::Model(error),
            NoisyError::Noise(error) => Self::Flow(FlowError::new(error)),
        }
    }
}

impl fmt::Debug for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}
