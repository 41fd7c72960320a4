//! Everything that a user does with a run of any method.

pub mod certificate;
pub mod checkpoint;
pub mod controller;
pub mod dense;
pub mod event;
pub mod observables;
mod output;
mod progress;
mod recheck;
mod record;
mod root;
pub mod scales;
pub mod span;
pub mod steps;
pub mod trajectory;
mod type_names;
pub mod until;
pub mod watch;
