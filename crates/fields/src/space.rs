//! How a point looks at each scalar, and the chart around it.

use std::fmt::Debug;

use approx::RelativeEq;

use crate::{Column, Dimension, Real, Scalar};

/// Components of a vector or covector on `M`.
pub type Vector<M, D = f64> = <<M as Space>::Dim as Dimension>::Vector<D>;

/// Components of a bilinear form or linear map on `M`.
pub type Matrix<M, D = f64> = <<M as Space>::Dim as Dimension>::Matrix<D>;

/// The points of a manifold at every scalar, and around each real point `x` a chart
/// `φ_x: Rⁿ → M` with `φ_x(0) = x`.
///
/// Derivatives of fields are taken along the `n` directions of this chart, never along the ambient
/// entries of a point, and components of tangent vectors and covectors refer to its coordinate
/// frame `∂φ_x/∂qⁱ`.
///
/// Laws: 1. `φ_x(0) = x`; 2. `φ_x⁻¹(φ_x(q)) = q` near `q = 0`; 3. both at dual numbers too;
/// 4. `real` undoes `constant`; 5. `seeded` is the chart at its seeds.
pub trait Space: Clone + Debug + PartialEq + Send + Sync + 'static {
    /// The dimension `n`.
    type Dim: Dimension;
    /// A point with entries in `D`: a vector in Rⁿ, a matrix on a group.
    type Point<D: Scalar>: Clone + Debug + Send + Sync + 'static + RelativeEq<Epsilon = D>;

    /// The real point, embedded in the scalar `D`.
    fn constant<D: Scalar>(x: &Self::Point<f64>) -> Self::Point<D>;

    /// The real part of a point.
    fn real<D: Scalar>(x: &Self::Point<D>) -> Self::Point<f64>;

    /// The point `φ_x(q)`.
    fn chart<D: Scalar>(x: &Self::Point<f64>, q: &Vector<Self, D>) -> Self::Point<D>;

    /// The point `φ_x(ε₁ e_i + ε₂ e_j)` that a derivative is read off; an index beyond the dimension
    /// seeds nothing.
    #[inline]
    fn seeded(x: &Self::Point<f64>, i: usize, j: usize) -> Self::Point<Real> {
        let part = |k, direction| if k == direction { 1.0 } else { 0.0 };
        let q = Vector::<Self, Real>::from_index(|k| Real::new(0.0, part(k, i), part(k, j), 0.0));
        Self::chart(x, &q)
    }

    /// The coordinates `φ_x⁻¹(y)`, for `y` near `x`.
    fn coordinates<D: Scalar>(x: &Self::Point<f64>, y: &Self::Point<D>) -> Vector<Self, D>;
}

/// A point `φ_x(q)` written in the chart at the real point `x`: the place where a tensor is
/// evaluated, and the frame that its components refer to.
#[derive(Clone, Debug)]
pub struct ChartPoint<M: Space, D: Scalar = f64> {
    /// The centre `x` of the chart.
    pub base: M::Point<f64>,
    /// The coordinates `q`.
    pub q: Vector<M, D>,
}

impl<M: Space, D: Scalar> ChartPoint<M, D> {
    /// The centre of its own chart, `q = 0`.
    pub fn centre(x: &M::Point<f64>) -> Self {
        Self { base: x.clone(), q: Vector::<M, D>::zero() }
    }

    /// A point in the chart centred at its own real part.
    pub fn around(x: &M::Point<D>) -> Self {
        let base = M::real(x);
        let q = M::coordinates(&base, x);
        Self { base, q }
    }

    /// The point `φ_x(q)` itself.
    pub fn point(&self) -> M::Point<D> {
        M::chart(&self.base, &self.q)
    }
}
