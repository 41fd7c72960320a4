//! Spaces to test on: Rⁿ, whose chart is a translation, and two whose charts are not.

use metriplectic_fields::{ChartPoint, Column, Scalar, Space};
use nalgebra::{Const, SVector, vector};

/// A space whose points are columns, with a point for every six numbers in `−1.5 … 1.5`.
pub(crate) trait TestSpace: Space<Velocity = <Self as Space>::Dim> {
    /// The entries of a point.
    fn entries<D: Scalar>(x: &Self::Point<D>) -> &[D];

    /// A point, spread over the space.
    fn point(numbers: &[f64; 6]) -> Self::Point<f64>;
}

/// Rⁿ with the chart `φ_x(q) = x + q`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Plain<const N: usize>;

impl<const N: usize> Space for Plain<N> {
    type Dim = Const<N>;
    type Velocity = Const<N>;
    type Point<D: Scalar> = SVector<D, N>;

    fn constant<D: Scalar>(x: &SVector<f64, N>) -> SVector<D, N> {
        Column::embed(x)
    }

    fn real<D: Scalar>(x: &SVector<D, N>) -> SVector<f64, N> {
        Column::real(x)
    }

    fn chart<D: Scalar>(x: &SVector<f64, N>, q: &SVector<D, N>) -> SVector<D, N> {
        SVector::from_fn(|i, _| q[i] + x[i])
    }

    fn coordinates<D: Scalar>(x: &SVector<f64, N>, y: &SVector<D, N>) -> SVector<D, N> {
        SVector::from_fn(|i, _| y[i] - x[i])
    }

    fn embed<D: Scalar>(_: &ChartPoint<Self, D>, v: &SVector<D, N>) -> SVector<D, N> {
        *v
    }
}

impl<const N: usize> TestSpace for Plain<N> {
    fn entries<D: Scalar>(x: &SVector<D, N>) -> &[D] {
        x.as_slice()
    }

    fn point(numbers: &[f64; 6]) -> SVector<f64, N> {
        SVector::from_fn(|i, _| numbers[i])
    }
}

/// The unit circle in the plane: the chart at `x` turns it by the angle `q`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Circle;

impl Space for Circle {
    type Dim = Const<1>;
    type Velocity = Const<1>;
    type Point<D: Scalar> = SVector<D, 2>;

    fn constant<D: Scalar>(x: &SVector<f64, 2>) -> SVector<D, 2> {
        Column::embed(x)
    }

    fn real<D: Scalar>(x: &SVector<D, 2>) -> SVector<f64, 2> {
        Column::real(x)
    }

    fn chart<D: Scalar>(x: &SVector<f64, 2>, q: &SVector<D, 1>) -> SVector<D, 2> {
        let (sin, cos) = q[0].sin_cos();
        vector![cos * x[0] - sin * x[1], sin * x[0] + cos * x[1]]
    }

    fn coordinates<D: Scalar>(x: &SVector<f64, 2>, y: &SVector<D, 2>) -> SVector<D, 1> {
        vector![(y[1] * x[0] - y[0] * x[1]).atan2(y[0] * x[0] + y[1] * x[1])]
    }

    fn embed<D: Scalar>(_: &ChartPoint<Self, D>, v: &SVector<D, 1>) -> SVector<D, 1> {
        *v
    }
}

impl TestSpace for Circle {
    fn entries<D: Scalar>(x: &SVector<D, 2>) -> &[D] {
        x.as_slice()
    }

    fn point(numbers: &[f64; 6]) -> SVector<f64, 2> {
        let (sin, cos) = (2.0 * numbers[0]).sin_cos();
        vector![cos, sin]
    }
}

/// The affine maps `t ↦ at + b` of the line, `a > 0`: the chart at `(a, b)` is
/// `φ(q) = (a e^{q₁}, b + a e^{q₁} q₂)`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Affine;

impl Space for Affine {
    type Dim = Const<2>;
    type Velocity = Const<2>;
    type Point<D: Scalar> = SVector<D, 2>;

    fn constant<D: Scalar>(x: &SVector<f64, 2>) -> SVector<D, 2> {
        Column::embed(x)
    }

    fn real<D: Scalar>(x: &SVector<D, 2>) -> SVector<f64, 2> {
        Column::real(x)
    }

    fn chart<D: Scalar>(x: &SVector<f64, 2>, q: &SVector<D, 2>) -> SVector<D, 2> {
        let scale = q[0].exp() * x[0];
        vector![scale, scale * q[1] + x[1]]
    }

    fn coordinates<D: Scalar>(x: &SVector<f64, 2>, y: &SVector<D, 2>) -> SVector<D, 2> {
        vector![(y[0] / x[0]).ln(), (y[1] - x[1]) / y[0]]
    }

    fn embed<D: Scalar>(_: &ChartPoint<Self, D>, v: &SVector<D, 2>) -> SVector<D, 2> {
        *v
    }
}

impl TestSpace for Affine {
    fn entries<D: Scalar>(x: &SVector<D, 2>) -> &[D] {
        x.as_slice()
    }

    fn point(numbers: &[f64; 6]) -> SVector<f64, 2> {
        vector![(0.5 * numbers[0]).exp(), numbers[1]]
    }
}

/// Calls `$check::<M, ..>($argument)?` for every test space `M`.
macro_rules! on_every_space {
    ($check:ident $(::<$scalar:ty>)? ($argument:expr)) => {
        $check::<$crate::spaces::Plain<1> $(, $scalar)?>($argument)?;
        $check::<$crate::spaces::Plain<2> $(, $scalar)?>($argument)?;
        $check::<$crate::spaces::Plain<3> $(, $scalar)?>($argument)?;
        $check::<$crate::spaces::Plain<4> $(, $scalar)?>($argument)?;
        $check::<$crate::spaces::Plain<5> $(, $scalar)?>($argument)?;
        $check::<$crate::spaces::Plain<6> $(, $scalar)?>($argument)?;
        $check::<$crate::spaces::Circle $(, $scalar)?>($argument)?;
        $check::<$crate::spaces::Affine $(, $scalar)?>($argument)?;
    };
}
pub(crate) use on_every_space;
