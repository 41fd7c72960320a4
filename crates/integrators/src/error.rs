//! What can go wrong in a run.
//!
//! A `main` that returns an error prints its `Debug` form. For the errors of this module that is
//! the sentence of their `Display` form.

use std::fmt;
use std::sync::Arc;

use metriplectic_dynamics::{BuildError, FormError, LegendreError, ModelError, PoissonError};
use metriplectic_manifolds::{AlgebraError, MetricError, PointError};

use crate::attitude::AttitudeError;
use crate::method::StateSpace;
use crate::run::checkpoint::ResumeError;
use crate::run::span::SpanError;
use crate::run::trajectory::Trajectory;
use crate::step_error::StepError;

/// A run that did not finish.
#[derive(Clone, thiserror::Error)]
#[non_exhaustive]
pub enum RunError<M: StateSpace> {
    /// The model breaks one of its laws.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The flow has found a fault of its own.
    #[error(transparent)]
    Flow(#[from] FlowError),
    /// The span cannot be run.
    #[error(transparent)]
    Span(#[from] SpanError),
    /// A step failed; what was computed until then is kept.
    #[error("{cause} ({} steps were taken and are kept in this error)", trajectory.certificate().steps)]
    Step {
        /// The step that failed.
        cause: StepError,
        /// The trajectory so far.
        trajectory: Box<Trajectory<M>>,
    },
}

impl<M: StateSpace> RunError<M> {
    /// The trajectory up to the step that failed, if the run had started.
    pub fn trajectory(&self) -> Option<&Trajectory<M>> {
        match self {
            Self::Step { trajectory, .. } => Some(trajectory),
            Self::Model(_) | Self::Flow(_) | Self::Span(_) => None,
        }
    }
}

/// A fault that a [`Flow`](crate::Flow) which is no metriplectic system has found at the start of a run. It is the
/// flow's own error, which can be downcast from it.
///
/// ```
/// use metriplectic_integrators::FlowError;
/// let error = FlowError::new("7a".parse::<i32>().unwrap_err());
/// assert!(error.downcast_ref::<std::num::ParseIntError>().is_some());
/// ```
#[derive(Clone, thiserror::Error)]
#[error("{0}")]
pub struct FlowError(#[source] Arc<dyn std::error::Error + Send + Sync>);

/// Compares by identity: two errors with the same text differ.
impl PartialEq for FlowError {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl FlowError {
    /// Wraps the error of a flow.
    pub fn new(error: impl std::error::Error + Send + Sync + 'static) -> Self {
        Self(Arc::new(error))
    }

    /// The flow's own error, if it is of this type.
    pub fn downcast_ref<E: std::error::Error + 'static>(&self) -> Option<&E> {
        self.0.downcast_ref()
    }
}

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
    /// A span that cannot be run.
    #[error(transparent)]
    Span(#[from] SpanError),
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
            RunError::Span(error) => Self::Span(error),
            error @ RunError::Step { .. } => Self::Run(Box::new(error)),
        }
    }
}

impl<M: StateSpace> fmt::Debug for RunError<M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl fmt::Debug for FlowError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl fmt::Debug for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}
