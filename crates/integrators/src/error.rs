//! The errors of the library in one.
//!
//! A `main` that returns an error prints its `Debug` form. That is the sentence of the `Display` form, for each error of the
//! library.

use metriplectic_dynamics::{BuildError, FormError, LegendreError, ModelError, PoissonError};
use metriplectic_equations::{BrokenLaw, NotPositive};
use metriplectic_manifolds::{AlgebraError, MetricError, PointError};
use metriplectic_recording::{RecordingError, TapeError};

use crate::attitude::AttitudeError;
use crate::explicit::TableauError;
use crate::implicit::NoImplicitSteps;
use crate::noise::{NoiseError, NoisyError};
use crate::open::NotDamped;
use crate::run::checkpoint::ResumeError;
use crate::run::observables::ObservablesError;
use crate::run::paired::Unpaired;
use crate::run::span_error::SpanError;
use crate::step::{
    JumpError, MethodError, Panicked, RestoreError, StartError, StateSpace, StepError,
};
use crate::tangent::{TangentError, Unlinearised};

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
    /// An error of another part of the library, or of the program: see [`Error::other`].
    #[error("{0}")]
    Other(#[source] Box<dyn std::error::Error + Send + Sync>),
}

impl Error {
    /// Wraps an error of another type, which can be downcast from the [source](std::error::Error::source). `?` does it for each error
    /// of the library.
    ///
    /// ```
    /// use metriplectic_integrators::Error;
    ///
    /// fn start(line: &str) -> Result<f64, Error> {
    ///     line.parse().map_err(Error::other)
    /// }
    /// assert_eq!(format!("{:?}", start("fast").unwrap_err()), "invalid float literal");
    /// ```
    pub fn other(error: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Self {
        Self::Other(error.into())
    }
}

/// Lets `?` pass errors on as [`Error`], by [`Error::other`].
#[doc(hidden)]
#[macro_export]
macro_rules! passed_on_as_error {
    ($($error:ty),* $(,)?) => {$(
        impl From<$error> for $crate::Error {
            fn from(error: $error) -> Self {
                Self::other(error)
            }
        }
    )*};
}

passed_on_as_error!(
    BrokenLaw,
    JumpError,
    NoImplicitSteps,
    NoiseError,
    NotDamped,
    NotPositive,
    Panicked,
    ObservablesError,
    RecordingError,
    RestoreError,
    TableauError,
    TapeError,
    Unlinearised,
    Unpaired,
    std::io::Error,
);

impl<M: StateSpace> From<TangentError<M>> for Error {
    fn from(error: TangentError<M>) -> Self {
        Self::other(error)
    }
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

impl<E: std::error::Error + Into<Self> + 'static> From<NoisyError<E>> for Error {
    fn from(error: NoisyError<E>) -> Self {
        match error {
            NoisyError::Model(error) => error.into(),
            NoisyError::Noise(error) => Self::Flow(FlowError::new(error)),
        }
    }
}

metriplectic_equations::debug_is_the_sentence!(Error);
