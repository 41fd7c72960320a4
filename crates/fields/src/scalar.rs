//! The numbers at which a field is evaluated.

use approx::RelativeEq;
use num_dual::{DualNum, HyperDual64};
use simba::scalar::SupersetOf;

/// `f64`, or a dual number over it of any order and nesting.
///
/// Generic code may use arithmetic with itself and with `f64` on the *right*
/// (`x * 0.5` compiles, `0.5 * x` does not), the elementary functions of [`DualNum`], and
/// [`cast`](nalgebra::Matrix::cast) of constant vectors and matrices into it.
///
/// Avoid the remainder `%`, which panics inside `num_dual`.
pub trait Scalar:
    DualNum<Primitive = f64> + Copy + Send + Sync + SupersetOf<f64> + RelativeEq<Epsilon = Self>
{
}

impl<T> Scalar for T where
    T: DualNum<Primitive = f64> + Copy + Send + Sync + SupersetOf<f64> + RelativeEq<Epsilon = T>
{
}

/// The scalar of a closure: a hyper-dual number `a + b ε₁ + c ε₂ + d ε₁ε₂` with `ε₁² = ε₂² = 0`,
/// which contains a value, two first derivatives and their mixed second derivative
/// (Fike and Alonso 2011).
///
/// Use it as you would use `f64`. Three habits keep its derivatives finite and the compiler content:
/// write `x * 0.5`, not `0.5 * x`; write `v.norm_squared()`, not `v.norm() * v.norm()`, because the
/// derivative of a square root at zero is not a number; bring in constant vectors by `.cast()`.
pub type Real = HyperDual64;
