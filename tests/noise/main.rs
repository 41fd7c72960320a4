//! Thermal noise: the law that is sampled, by the operator of one step and without samples, so that no test is a matter of
//! luck.
//!
//! The operator of a step takes a function to its mean after a step. It is built from all values of three-point noise, with
//! their probabilities, in a finite basis on the energy shell. Its powers give the means of all paths at a time, and its
//! left eigenvector the law that is sampled.

mod baths;
mod body;
mod curve;
mod half_line;
mod heat;
mod lattice;
mod operator;
mod paths;
mod refusals;
mod shell;
mod sphere;
#[path = "../models/tables.rs"]
mod tables;
mod terms;
