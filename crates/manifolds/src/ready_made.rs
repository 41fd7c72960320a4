//! Ready-made metrics: a constant matrix, or a closure.

use nalgebra::SMatrix;

use crate::field_metric::FieldMetric;
use crate::flat::Constant;
use crate::metric_error::MetricError;

/// Ready-made metrics.
#[derive(Clone, Copy, Debug)]
pub enum Metric {}

impl Metric {
    /// Makes the metric with the same matrix everywhere on a flat space.
    ///
    /// ```
    /// use metriplectic_manifolds::Metric;
    /// use nalgebra::Matrix2;
    /// assert!(Metric::constant(Matrix2::new(2.0, 0.5, 0.5, 1.0)).is_ok());
    /// assert!(Metric::constant(Matrix2::new(1.0, 2.0, 2.0, 1.0)).is_err());
    /// ```
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the matrix is not finite, symmetric and positive.
    pub fn constant<const N: usize>(g: SMatrix<f64, N, N>) -> Result<Constant<N>, MetricError> {
        Constant::new(g)
    }

    /// Makes the metric `G(u, v) = θ(u)·A(x) θ(v)` from a closure `A` or any other
    /// [`MatrixField`](metriplectic_fields::MatrixField), with `θ` the
    /// [`velocity`](metriplectic_fields::Space::embed) of a tangent vector:
    ///
    /// | on | a velocity is | the closure returns |
    /// |---|---|---|
    /// | a vector space, a chart | `x'` | `g`, `n × n` |
    /// | Sⁿ | `x'` in Rⁿ⁺¹ | a form on Rⁿ⁺¹, `(n+1) × (n+1)`; only its part along the sphere is used |
    /// | SO(3) | the body angular velocity `Ω` | the inner product on so(3), `3 × 3` |
    /// | R₊ | `s'` | `1 × 1` |
    /// | a product | both, one below the other | the full matrix |
    ///
    /// Every use of the matrix checks that it is symmetric and positive. Geodesics are integrated with an
    /// estimated error of 10⁻¹³ in each piece. Their derivatives come from dual numbers.
    ///
    /// ```
    /// use metriplectic_fields::Real;
    /// use num_dual::DualNum;
    /// use metriplectic_manifolds::Metric;
    /// use nalgebra::{Matrix2, Vector2};
    /// let _half_plane =
    ///     Metric::field(|q: &Vector2<Real>| Matrix2::from_diagonal_element(q.y.powi(-2)));
    /// ```
    pub const fn field<F>(field: F) -> FieldMetric<F> {
        FieldMetric::new(field)
    }
}
