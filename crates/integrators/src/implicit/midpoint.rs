//! The scheme of the paper for a model in plain numbers.

mod equation;
mod fallbacks;
mod gradient;
mod level;
mod memory;
mod newton;
mod restored;
mod root;
mod step;

pub(crate) use equation::FromEnd;
pub(crate) use memory::MidpointNumbers;
pub(crate) use root::{along_parameters, from_end};
pub(crate) use step::Midpoint;
pub(super) use step::Solution;
