//! A run that did not finish.

use metriplectic_dynamics::ModelError;

use crate::run::span_error::SpanError;
use crate::run::trajectory::Trajectory;
use crate::step::{FlowError, MethodError, StartError, StateSpace, StepError};

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
    /// The method has found a fault of its own.
    #[error(transparent)]
    Method(#[from] MethodError),
    /// The span cannot be run.
    #[error(transparent)]
    Span(#[from] SpanError),
    /// The state contradicts the run that is to start in it.
    #[error(transparent)]
    Start(#[from] StartError),
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
            Self::Model(_) | Self::Flow(_) | Self::Method(_) | Self::Span(_) | Self::Start(_) => {
                None
            }
        }
    }
}

metriplectic_equations::debug_is_the_sentence!([M: StateSpace] RunError<M>);
