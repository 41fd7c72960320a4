//! Everything that a user does with a run of any method.

pub mod certificate;
pub mod checkpoint;
pub mod controller;
pub mod observables;
pub mod scales;
pub mod span;
pub mod steps;
pub mod trajectory;
