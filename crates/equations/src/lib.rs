//! A metriplectic system in plain numbers: the one interface between systems and all that is done with them.
//!
//! ```math
//! \dot x = \Pi\, dH + f(dH) + K\, dS .
//! ```
//!
//! On one side stand systems: closures on spaces with brackets, frictions, clocks and surroundings, lattices of sites, a program
//! of one's own. Each answers the questions of [`Equations`] about slices of numbers, and of [`Model`] if its parts are known
//! apart. On the other side stands what is done with a system, which knows no kind of it and is compiled once. Nothing
//! else crosses: no type of a space, a metric, a tensor or a closure, and no type parameter.
//!
//! A state `x` is a slice of [`entries`](Sizes::entries) numbers. Around it there is a chart `φ_x` of `n`
//! [`directions`](Sizes::directions), and displacements `q`, velocities `v` and covectors `w` have `n` numbers in its frame. The
//! *laws* are numbered: the [energy](ENERGY) `H`, the [entropy](ENTROPY) `S`, and from 2 on the further invariants `L_a`. Rows
//! of covectors are one law after another. Matrices are row by row.
//!
//! | module | what it holds |
//! |---|---|
//! | [`equations`] | [`Equations`]: laws, differentials, velocity and space of a system; [`Sizes`] |
//! | [`model`] | [`Model`]: the bracket, the force, the dissipation and the metric apart, with their derivatives |
//! | [`paths`] | [`Paths`]: the paths of steps on spaces that are not flat |
//! | [`differences`] | [`Differences`]: a model whose derivatives are formed by differences of its parts |
//! | [`terms`] | [`FrictionTerms`]: a friction as a sum of terms, of which thermal noise is made |
//! | [`evaluated`] | [`Evaluated`]: which fields are evaluated from a recording |
//! | [`judge`] | the laws of a model at a start, around it, and at the states of a run |
//! | [`report`] | [`Report`]: the residual of every law |
//! | [`model_error`] | [`ModelError`]: the law that a model violates, with the numbers |
//! | [`metric_error`], [`point_error`] | [`MetricError`], [`PointError`]: a metric that cannot be used, entries that are not a state |
//! | [`room`] | slices of numbers that cost no allocation where they are short |
//! | [`laws`] | the laws of an implementation of [`Equations`] and [`Model`], as functions for its tests |

pub mod broken_law;
pub mod differences;
pub mod equations;
pub mod evaluated;
pub mod judge;
pub mod kind;
pub mod laws;
pub mod metric_error;
pub mod model;
pub mod model_error;
pub mod paths;
pub mod point_error;
mod pointers;
pub mod report;
pub mod room;
pub mod second_law;
mod sentence;
pub mod terms;

pub use broken_law::BrokenLaw;
pub use differences::{Apart, Differences, Slopes, slopes};
pub use equations::{ENERGY, ENTROPY, Equations, Sizes};
pub use evaluated::{Evaluated, Evaluation};
pub use kind::Kind;
pub use metric_error::{MetricError, NotPositive};
pub use model::{Covectors, Jet, Model, Part};
pub use model_error::ModelError;
pub use paths::{ByCharts, Path, PathAt, PathSlopes, Paths};
pub use point_error::PointError;
pub use pointers::VerifiedEquations;
pub use report::{LawResidual, Report};
pub use second_law::SecondLaw;
pub use terms::{FrictionTerms, Terms};
