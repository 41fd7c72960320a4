//! Methods with stages for a model in plain numbers.

#![allow(
    clippy::needless_range_loop,
    reason = "a stage is an index of several lists and of the tableau"
)]

mod chart;
mod clock;
mod covectors;
mod dense;
mod equation;
mod fallbacks;
mod full;
mod heat;
mod kept;
mod linear;
mod memory;
mod parts;
mod root;
mod solve;
mod step;
mod timed;

pub(super) use clock::Clock;
pub(crate) use clock::{TimeOfStep, WorkOfTime};
pub(crate) use memory::StageNumbers;
pub(crate) use root::StageRoot;
pub(crate) use step::Collocation;
pub(super) use timed::{Frozen, Stage, StageSolution, TimedStep};
