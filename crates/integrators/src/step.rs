//! The interfaces between runs, systems and methods.
//!
//! A run needs little of a system: its laws, and how large things are. This is a [`Flow`]; every
//! [`Metriplectic`](metriplectic_dynamics::Metriplectic) system is one. It knows of a method that it takes
//! steps, what these promise, and what has to be saved between two of them: a [`Stepper`]. Everything that a
//! user does with a run, from [`Span`](crate::Span) to [`Checkpoint`](crate::Checkpoint), works with any flow
//! and any method, by the trait [`Method`](crate::Method) that every stepper has.
//!
//! This module knows of no method and of no run.

mod both;
pub(crate) mod compiled;
mod control;
pub mod dense;
pub(crate) mod digits;
mod error;
pub(crate) mod evidence;
pub(crate) mod exact;
pub(crate) mod failure;
mod flow;
pub(crate) mod in_plain;
mod initial_scales;
mod inlined;
mod jump_error;
mod ledger;
mod memory;
mod noise;
mod own_error;
pub(crate) mod panicked;
pub(crate) mod passed_on;
pub(crate) mod plain;
mod plain_method;
mod result;
pub mod scales;
mod start;
mod start_error;
mod stepper;
pub(crate) mod type_names;
mod vector;

pub(crate) use both::both;
#[doc(hidden)]
pub use compiled::{Compiled, GradientKind, PathOfStep};
pub use control::Control;
pub use error::StepError;
pub use evidence::{Effort, EntropyStep, Evidence, LimitingSites, Promises, StageLaws};
pub(crate) use flow::AnyFlow;
pub use flow::{
    Element, Flow, FlowVisitor, HasFlow, Laws, Listed, PlainFlow, PlainNumbers, Recheck,
    StateSpace, Written, in_room,
};
pub(crate) use initial_scales::{CUT, CUTS, SAME, classical_step, initial_scales};
pub use inlined::Inlined;
pub use jump_error::JumpError;
pub use ledger::{EventExchange, LedgerErrors, LedgerSummary};
pub(crate) use memory::FARTHEST;
pub use memory::{Memory, RestoreError, Saved};
pub use noise::NoiseSummary;
pub use own_error::{FlowError, MethodError};
pub use panicked::Panicked;
pub(crate) use plain::Few;
pub use plain::{Directions, Entries, Values};
pub(crate) use plain_method::PlainMethod;
pub use result::{Excursion, Refusal, StepEnds, StepStart, Taken};
pub use scales::Scales;
pub use start::Numbers;
pub(crate) use start::{CountOf, Dim, DriftCorrection, Start};
pub use start_error::StartError;
pub use stepper::Stepper;
pub(crate) use type_names::name_of;
pub(crate) use vector::norm;
pub use vector::{Components, Vector};
