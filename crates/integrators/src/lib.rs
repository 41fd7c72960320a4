//! How a metriplectic system moves in discrete time, with the first law kept to round-off.
//!
//! | module | what it holds |
//! |---|---|
//! | [`discrete_gradient`] | [`DiscreteGradient`]: [`Gonzalez`], [`MeanValue`], [`ItohAbe`], [`SymmetricItohAbe`], safe against round-off |
//! | [`residual`] | the implicit equation of one step, and its Jacobian |
//! | [`root_finder`] | [`RootFinder`]: what solves an equation |
//! | [`newton`] | [`Newton`]: the solver of every step |
//! | `globaliser` | L-BFGS from argmin, which brings a lost Newton back (feature `argmin`) |
//! | [`span`](mod@span) | [`Span`]: step size, number of steps, what is recorded |
//! | [`adaptive`] | [`Until`]: steps of a size that follows the motion, and the estimate of their error |
//! | `scales` | the sizes of the entries in the course of a run, which their errors are relative to |
//! | [`step`] | [`Scheme`] and one step of it |
//! | [`trajectory`] | [`Steps`], the endless iterator, and [`Trajectory`], the record |
//! | [`observables`] | [`Observables`]: named numbers of a state, streamed to CSV or NPY |
//! | [`checkpoint`] | [`Checkpoint`]: a run that is put down and taken up again, bit for bit |
//! | [`attitude`] | [`Attitude`]: where a body points along a run of its angular momentum |
//! | [`certificate`] | [`Certificate`]: what a run did to its laws |
//! | [`error`](mod@error) | [`Error`], [`RunError`], [`StepError`] |
//! | [`laws`] | what a step promises, and the function that checks it |
//!
//! # What a later version may add
//!
//! Results are `#[non_exhaustive]`: [`Certificate`], [`InvariantBalance`], [`State`], [`Attempts`], [`Effort`], and the report of a
//! model. A later version may add a field to them; a pattern ends in `..`, and a changed copy is a clone whose
//! fields are assigned. So are errors and the other enums that may grow. Options are not, because
//! `Newton { iterations: 50, ..Newton::default() }` and `Scheme { splits: 4, ..Scheme::new(WeylMidpoint) }` are
//! how they are written: write the last part, and a new option has its default. What you pass to an equation
//! or return from one ([`Linearised`], [`Root`], [`Iterate`]) has all of its fields.

pub mod adaptive;
pub mod attitude;
pub mod certificate;
pub mod checkpoint;
mod digits;
pub mod discrete_gradient;
pub mod error;
#[cfg(feature = "argmin")]
mod globaliser;
pub mod laws;
pub mod newton;
pub mod observables;
pub mod residual;
pub mod root_finder;
mod scales;
pub mod span;
pub mod step;
pub mod trajectory;

pub use adaptive::Until;
pub use attitude::{Attitude, AttitudeError};
pub use certificate::{Certificate, InvariantBalance};
pub use checkpoint::{Checkpoint, ResumeError};
pub use discrete_gradient::{
    DiscreteGradient, Gonzalez, ItohAbe, MeanValue, StableGradient, SymmetricItohAbe,
};
pub use error::{Attempts, Error, RunError, StepError};
pub use newton::Newton;
pub use observables::{Csv, Npy, Observables, TableError};
pub use residual::Residual;
pub use root_finder::{Equation, Iterate, Linearised, Root, RootFinder, Rounding};
pub use span::{Schedule, Span, SpanError};
pub use step::{Effort, Scheme};
pub use trajectory::{Ending, Run, State, Steps, Trajectory};
