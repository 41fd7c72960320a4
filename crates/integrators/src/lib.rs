//! How a metriplectic system moves in discrete time, with the first law kept to round-off.
//!
//! | module | what it holds | knows |
//! |---|---|---|
//! | [`step_error`] | [`StepError`]: what can go wrong in a step | |
//! | [`run`] | [`Span`], [`Until`], [`Watch`], [`Steps`], [`Trajectory`], [`Event`], [`Certificate`], [`Checkpoint`], [`Observables`]: what a user does with a run of any method | [`method`] |
//! | [`method`] | [`Flow`] and [`Method`]: what a run knows of a system and of a method | |
//! | [`newton`] | [`Newton`]: the solver of every implicit step | |
//! | [`discrete_gradient`] | [`DiscreteGradient`]: [`Gonzalez`], [`MeanValue`], [`ItohAbe`], [`SymmetricItohAbe`] | |
//! | [`round_off`] | covectors, laws and positions that are safe against round-off | |
//! | [`midpoint`] | [`Scheme`]: the method of the paper, its equation and its fallbacks | [`newton`], [`discrete_gradient`], [`round_off`] |
//! | [`explicit`] | [`DormandPrince8`], [`DormandPrince5`], [`RungeKuttaChebyshev`]: explicit methods, and then back onto the laws | [`method`] |
//! | [`collocation`] | [`Gauss`], [`Radau`]: methods with stages, of order `2s` and `2s − 1` | [`method`], [`round_off`] |
//! | [`attitude`] | [`Attitude`]: where a body points along a run of its angular momentum | [`run`] |
//! | [`laws`] | what a step and a method promise, and the functions that check it | |
//! | [`error`](mod@error) | [`Error`], [`RunError`], [`FlowError`] | |
//!
//! # What a later version may add
//!
//! Results are `#[non_exhaustive]`: [`Certificate`], [`InvariantBalance`], [`State`], [`Effort`], [`Evidence`], and the report of a
//! model. A later version may add a field to them; a pattern ends in `..`, and a changed copy is a clone whose
//! fields are assigned. So are errors and the other enums that may grow. Options are not, because
//! `Newton { iterations: 50, ..Newton::default() }` and `Scheme { splits: 4, ..Scheme::new(WeylMidpoint) }` are
//! how they are written: write the last part, and a new option has its default. What you pass to an equation
//! or return from one ([`Linearised`], [`Root`], [`Iterate`]) has all of its fields.

pub mod attitude;
pub mod collocation;
mod digits;
pub mod discrete_gradient;
pub mod error;
pub mod explicit;
pub mod laws;
pub mod method;
pub mod midpoint;
pub mod newton;
pub mod round_off;
pub mod run;
pub mod step_error;
mod step_failure;

pub use attitude::{Attitude, AttitudeError};
pub use collocation::{Gauss, Radau, StageMemory};
pub use discrete_gradient::{DiscreteGradient, Gonzalez, ItohAbe, MeanValue, SymmetricItohAbe};
pub use error::{Error, FlowError, RunError};
pub use explicit::{DormandPrince5, DormandPrince8, RungeKuttaChebyshev, StageFlow};
pub use method::{
    Components, Control, Effort, Element, EntropyStep, Evidence, Flow, Laws, LimitingSites, Memory,
    Method, Promises, Recheck, Refusal, StageLaws, StateSpace, StepEnds, StepStart, Taken, Vector,
};
pub use midpoint::{Residual, Run, Scheme};
pub use newton::{Equation, Iterate, Linearised, Newton, Root, Rounding};
pub use round_off::stable_gradient::StableGradient;
pub use run::certificate::{
    Certificate, InvariantBalance, MisjudgedSize, ProjectedSteps, StageBalance,
};
pub use run::checkpoint::{Checkpoint, ResumeError, Saved};
pub use run::event::Event;
pub use run::observables::{Csv, Npy, Observables, TableError};
pub use run::scales::Scales;
pub use run::span::{Schedule, Span, SpanError};
pub use run::steps::Steps;
pub use run::trajectory::{Ending, State, Trajectory};
pub use run::until::Until;
pub use run::watch::{Watch, Watched};
pub use step_error::StepError;
