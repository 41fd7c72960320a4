//! Riemannian metrics: flat, sharp, norm, geodesics.
//!
//! A metric is the canonical one of its manifold ([`Canonical`]), a constant matrix
//! ([`Metric::constant`](crate::Metric::constant)), or a closure that returns the matrix `g(x)` in the
//! coordinate frame at each point ([`Metric::field`](crate::Metric::field)).

use metriplectic_fields::{
    ChartPoint, Column, Dimension, Matrix, Real, Scalar, Space, Square, Vector,
};

use crate::metric_at::{MetricJet, Slopes};
use crate::metric_error::finite;
use crate::step_path::{StepPath, StepPathJet};

pub use crate::inner_product::{Canonical, Factored, InnerProduct};
pub use crate::metric_error::MetricError;

/// A few roundings: the accuracy of a closed form.
pub(crate) const ROUNDED: f64 = 4.0 * f64::EPSILON;

/// The end of a geodesic: the point in the chart centred at its real part, and the velocity in this frame.
pub type GeodesicEnd<M, D> = (ChartPoint<M, D>, Vector<M, D>);

/// A Riemannian metric on `M`, and its geodesics.
///
/// Laws ([`laws::metric`](crate::laws::metric)): 1. `g` is symmetric; 2. and positive; 3. the laws
/// of its inner product; 4. `exp_x(0) = x`; 5. geodesics have constant speed; 6. `weyl_jet` is the
/// derivative of the midpoint path.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a metric on `{M}`",
    note = "a metric is `Metric::constant(matrix)?`, or `Metric::field(closure)` with a closure from a point over `Real` to the symmetric matrix g"
)]
pub trait Riemannian<M: Space> {
    /// Says whether this is the canonical metric.
    #[doc(hidden)]
    const IS_CANONICAL: bool = false;

    /// Says whether the metric is evaluated from a recording.
    const IS_RECORDED: bool = false;

    /// The metric at one point.
    type At<D: Scalar>: InnerProduct<Vector<M, D>>;

    /// Evaluates the metric at a point, in the frame of its chart.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the matrix is not symmetric and positive.
    fn at<D: Scalar>(&self, x: &ChartPoint<M, D>) -> Result<Self::At<D>, MetricError>;

    /// Evaluates the matrix `g`, without a check.
    fn matrix<D: Scalar>(&self, x: &ChartPoint<M, D>) -> Matrix<M, D>;

    /// Follows the geodesic with `γ(0) = x` and `γ'(0) = v` to time 1.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the geodesic cannot be followed.
    fn exp<D: Scalar>(
        &self,
        x: &ChartPoint<M, D>,
        v: &Vector<M, D>,
    ) -> Result<GeodesicEnd<M, D>, MetricError>;

    /// Computes the end `exp_x(v)` of a geodesic from a real point. It is faster where the chart is normal.
    ///
    /// # Errors
    ///
    /// The errors of [`exp`](Self::exp).
    fn end(&self, x: &M::Point<f64>, v: &Vector<M>) -> Result<M::Point<f64>, MetricError> {
        Ok(self.exp(&ChartPoint::centre(x), v)?.0.point())
    }

    /// Follows the geodesic from a real point with velocity `v` to time `t`, with its first and second
    /// derivative along `t`: the point `γ(t + ε₁ + ε₂)`.
    ///
    /// # Errors
    ///
    /// The errors of [`exp`](Self::exp).
    fn along(
        &self,
        x: &M::Point<f64>,
        v: &Vector<M>,
        t: f64,
    ) -> Result<M::Point<Real>, MetricError>;

    /// Finds the vector `v` at `x` with `exp_x(v) = y`. It does not know the domain of an open
    /// [`Chart`](crate::Chart), so the geodesic may leave the domain.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if no vector is found.
    fn log(&self, x: &M::Point<f64>, y: &M::Point<f64>) -> Result<Vector<M>, MetricError>;

    /// Follows the geodesic of time 1 from `x` with velocity `d`, to its middle and its end.
    ///
    /// # Errors
    ///
    /// The errors of [`exp`](Self::exp).
    #[inline]
    fn weyl_path(&self, x: &M::Point<f64>, d: &Vector<M>) -> Result<StepPath<M>, MetricError> {
        let StepPathJet { z, d, end, .. } = self.weyl_jet(x, d)?;
        Ok(StepPath { z: ChartPoint::centre(&z), d, end })
    }

    /// Follows the same path, with the derivatives along `d`.
    ///
    /// # Errors
    ///
    /// The errors of [`exp`](Self::exp).
    fn weyl_jet(&self, x: &M::Point<f64>, d: &Vector<M>) -> Result<StepPathJet<M>, MetricError>;

    /// Computes the length `√G(v, v)` of a tangent vector at a real point.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the matrix is not symmetric and positive.
    fn norm(&self, x: &M::Point<f64>, v: &Vector<M>) -> Result<f64, MetricError> {
        let at = self.at(&ChartPoint::centre(x))?;
        finite("the length of a vector", at.orthonormal(&at.flat(v)).magnitude())
    }

    /// Computes the length of the geodesic that [`log`](Self::log) finds between two points. It is their
    /// distance if the geodesic is the shortest.
    ///
    /// # Errors
    ///
    /// The errors of [`log`](Self::log).
    fn distance(&self, x: &M::Point<f64>, y: &M::Point<f64>) -> Result<f64, MetricError> {
        self.norm(x, &self.log(x, y)?)
    }

    /// Computes the Christoffel symbols at a real point in the chart centred there. The `k`-th matrix is
    /// `Γᵏ_ij = ½ g^{kl} (∂_i g_lj + ∂_j g_li − ∂_l g_ij)`. They vanish where the chart is normal.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the matrix is not symmetric and positive.
    fn christoffel(
        &self,
        x: &M::Point<f64>,
    ) -> Result<<M::Dim as Dimension>::Array<Matrix<M>>, MetricError> {
        let n = M::Dim::LEN;
        let mut symbols = M::Dim::array(|_| Matrix::<M>::zeros());
        let Some(g) = self.slopes(x) else { return Ok(symbols) };
        let at = self.at(&ChartPoint::centre(x))?;
        for i in 0..n {
            for j in 0..n {
                let first_kind =
                    Vector::<M>::from_index(|l| 0.5 * (g[i][(l, j)] + g[j][(l, i)] - g[l][(i, j)]));
                let raised = at.sharp(&first_kind);
                for k in 0..n {
                    symbols[k][(i, j)] = raised[k];
                }
            }
        }
        Ok(symbols)
    }

    /// The relative accuracy of the ends of geodesics.
    fn accuracy(&self) -> f64 {
        ROUNDED
    }

    /// Computes the rounding error of the displacement `v` on the way from `x` to `y = exp_x(v)`, which the next
    /// step compensates; zero where it is not known.
    #[inline]
    fn lost_digits(&self, _x: &M::Point<f64>, _v: &Vector<M>, _y: &M::Point<f64>) -> Vector<M> {
        Vector::<M>::zero()
    }

    /// Computes the density `√det g` of the volume form in the chart, from the metric at a point.
    ///
    /// # Errors
    ///
    /// [`MetricError::NotFinite`] if it is beyond the range of numbers.
    fn volume_density<D: Scalar>(at: &Self::At<D>) -> Result<D, MetricError>;

    /// The derivatives `∂g/∂qᵏ` at a real point; `None` for a metric that is constant by
    /// construction.
    fn slopes(&self, x: &M::Point<f64>) -> Slopes<M>;

    /// Evaluates the metric at a real point together with its derivatives.
    ///
    /// # Errors
    ///
    /// The errors of [`at`](Self::at).
    #[inline]
    fn jet(&self, x: &M::Point<f64>) -> Result<MetricJet<M, Self>, MetricError>
    where
        Self: Sized,
    {
        Ok(MetricJet { at: self.at(&ChartPoint::centre(x))?, slopes: self.slopes(x) })
    }
}

/// The vector `(t + ε₁ + ε₂) v`.
#[inline]
pub(crate) fn stretched<M: Space>(v: &Vector<M>, t: f64) -> Vector<M, Real> {
    Vector::<M, Real>::from_index(|i| Real::new(t * v[i], v[i], v[i], 0.0))
}
