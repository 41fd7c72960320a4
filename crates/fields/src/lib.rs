//! Smooth functions, which the user writes as closures, and their derivatives.
//!
//! | module | what it holds |
//! |---|---|
//! | [`scalar`] | [`Scalar`]: `f64` or a dual number over it; [`Real`], the one a closure uses |
//! | [`column`](mod@column), [`square`] | [`Column`], [`Square`]: vectors and matrices of a size that the compiler knows |
//! | [`triangular`] | Cholesky factors of matrices, of a size that is known at run time too |
//! | [`dimension`] | [`Dimension`]: the size, and the types that have it |
//! | [`piecewise`] | [`Piecewise`]: the functions with a kink that an `f64` has |
//! | [`space`] | [`Space`]: points at each scalar, and the chart around a point |
//! | [`field`](mod@field) | [`ScalarField`] (`H`, `S`) and [`MatrixField`] (`g`, `Π`) |
//! | [`closure`](mod@closure) | ordinary closures are fields, lifted to every scalar of order ≤ 2 |
//! | [`differential`](mod@differential) | differential, Hessian and Jacobian at any scalar |
//! | [`newton`] | damped Newton iterations, for unknowns of any kind |
//! | [`series`] | functions of a small angle, right under dual numbers |
//! | [`logarithmic_mean`] | the conductance of a reaction by mass action |
//! | [`stack`] | room on the stack for large matrices |
//! | [`laws`] | the laws of a field, and the function that checks them |
//!
//! # Two ways to write a field
//!
//! A field is evaluated at several scalars: `f64` for its value, dual numbers for its derivatives.
//! Rust closures cannot be generic, so there are two ways in:
//!
//! 1. **A closure over [`Real`]**. Write `|p: &Vector3<Real>| p.norm_squared() * 0.5`. It is lifted
//!    to every scalar of derivative order ≤ 2 by its exact second-order Taylor expansion.
//! 2. **A type of your own** with the one generic method [`ScalarField::at`]. It is evaluated at
//!    each scalar directly, of any order.
//!
//! Both are accepted wherever a field is asked for; so are captured parameters, boxed closures,
//! returned closures and plain functions.

pub mod closure;
pub mod column;
pub mod differential;
pub mod dimension;
pub mod erased;
pub mod field;
pub mod laws;
mod logarithmic_mean;
pub mod newton;
pub mod piecewise;
pub mod scalar;
pub mod series;
pub mod space;
pub mod square;
pub mod stack;
pub mod triangular;

pub use column::{Column, dot, length, power_of_two};
pub use differential::{differential, hessian, jacobian};
pub use dimension::{Dimension, Plus};
pub use erased::ErasedField;
pub use field::{Jet1, Jet2, MatrixField, MatrixJet, ScalarField, along_slopes, seeded};
pub use logarithmic_mean::logarithmic_mean;
pub use metriplectic_equations::{BrokenLaw, Evaluation, NotPositive};
pub use piecewise::Piecewise;
pub use scalar::{Real, Scalar};
pub use space::{ChartPoint, Form, Matrix, Space, Vector, Velocity, product_rule};
pub use square::{Factors, Square};
