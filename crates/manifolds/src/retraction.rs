//! Retractions, which map a tangent vector to a pair of points.

use approx::{AbsDiffEq, RelativeEq};
use metriplectic_equations::Path;
use metriplectic_fields::{Column, Real, Scalar, Space, Vector};

use crate::{Manifold, MetricError, Riemannian};

pub use crate::step_path::{StepPath, StepPathJet};

/// A discrete derivative `R_h: TM → M × M` (Bloch, Farré Puiggalí, Martín de Diego 2024, §4.4):
/// a base point `z` and a vector `v ∈ T_zM` stand for a pair `(x, x')`.
///
/// The methods use the displacement `d = hv`, so no step size appears.
///
/// Laws ([`laws::retraction`](crate::laws::retraction)): 1. `R_h⁻¹ R_h = 1`; 2. the path from `x`
/// ends where the pair does; 3. `real_step_path` is `path`, and `step_path_jet` its derivative; 4. a symmetric retraction
/// returns the same base and the opposite vector for the swapped pair.
pub trait Retraction<M: Manifold, G: Riemannian<M>> {
    /// Names it, if it is one of this library.
    #[doc(hidden)]
    const PATH: Option<Path> = None;

    /// Follows the path that leaves `x` with initial displacement `u ∈ T_xM`, the unknown of a step.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the geodesic cannot be followed.
    fn step_path<D: Scalar>(
        &self,
        metric: &G,
        x: &M::Point<f64>,
        u: &Vector<M, D>,
    ) -> Result<StepPath<M, D>, MetricError>;

    /// Follows the same path at `f64`, in the charts at its points.
    ///
    /// # Errors
    ///
    /// The errors of [`step_path`](Self::step_path).
    #[inline]
    fn real_step_path(
        &self,
        metric: &G,
        x: &M::Point<f64>,
        u: &Vector<M>,
    ) -> Result<StepPath<M>, MetricError> {
        self.step_path(metric, x, u)
    }

    /// Computes the end of the path of `u`. By default it is the end of a geodesic.
    ///
    /// # Errors
    ///
    /// The errors of [`step_path`](Self::step_path).
    #[inline]
    fn end(
        &self,
        metric: &G,
        x: &M::Point<f64>,
        u: &Vector<M>,
    ) -> Result<M::Point<f64>, MetricError> {
        metric.end(x, u)
    }

    /// Computes a curve from the start of the path to its end. By default it is the geodesic.
    ///
    /// # Errors
    ///
    /// The errors of [`step_path`](Self::step_path).
    #[inline]
    fn along(&self, metric: &G, x: &M::Point<f64>, u: &Vector<M>) -> Result<Nodes<M>, MetricError> {
        Nodes::of(|t| metric.along(x, u, t))
    }

    /// Computes the rounding error of the displacement `u` on the way from `x` to the `end` of its path, which the
    /// next step compensates; zero where it is not known. By default it is the metric's.
    #[inline]
    fn lost_digits(
        &self,
        metric: &G,
        x: &M::Point<f64>,
        u: &Vector<M>,
        end: &M::Point<f64>,
    ) -> Vector<M> {
        metric.lost_digits(x, u, end)
    }

    /// The relative accuracy of the ends of paths. By default it is the accuracy of the metric's geodesics.
    fn accuracy(&self, metric: &G) -> f64 {
        metric.accuracy()
    }

    /// Follows the same path at `f64`, with its derivatives along `u`.
    ///
    /// # Errors
    ///
    /// The errors of [`step_path`](Self::step_path).
    fn step_path_jet(
        &self,
        metric: &G,
        x: &M::Point<f64>,
        u: &Vector<M>,
    ) -> Result<StepPathJet<M>, MetricError>;

    /// Computes `R_h(v)`, the pair `(x, x')` of the displacement `d = hv` at `z`.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the geodesic cannot be followed.
    fn pair(&self, metric: &G, tangent: &Tangent<M>) -> Result<PointPair<M>, MetricError>;

    /// Computes `R_h⁻¹(x, y)`, the base point and the displacement `d = hv`.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if no geodesic is found.
    fn inverse(
        &self,
        metric: &G,
        x: &M::Point<f64>,
        y: &M::Point<f64>,
    ) -> Result<Tangent<M>, MetricError>;
}

/// A pair of points `(x, x')`.
pub type PointPair<M> = (<M as Space>::Point<f64>, <M as Space>::Point<f64>);

/// A curve at its start, middle and end, with its first and second derivative: the points at
/// `t + ε₁ + ε₂` for the times `t = 0, ½, 1`.
#[derive(Clone, Debug)]
pub struct Nodes<M: Space> {
    /// Start and end.
    pub ends: [M::Point<Real>; 2],
    /// The middle; `None` where the curve passes the base point `z` with the displacement `d` as its
    /// velocity.
    pub middle: Option<M::Point<Real>>,
}

impl<M: Space> Nodes<M> {
    /// The nodes of the curve with the point `at(t)` at the time `t`.
    ///
    /// # Errors
    ///
    /// The errors of the curve.
    #[inline]
    pub fn of(
        at: impl Fn(f64) -> Result<M::Point<Real>, MetricError>,
    ) -> Result<Self, MetricError> {
        Ok(Self { ends: [at(0.0)?, at(1.0)?], middle: Some(at(0.5)?) })
    }
}

/// A tangent vector with its base point.
#[derive(Clone, Debug, PartialEq)]
pub struct Tangent<M: Space> {
    /// The base point.
    pub base: M::Point<f64>,
    /// The components in the frame of the chart at the base point.
    pub vector: Vector<M>,
}

impl<M: Manifold> AbsDiffEq for Tangent<M> {
    type Epsilon = f64;

    fn default_epsilon() -> f64 {
        f64::default_epsilon()
    }

    fn abs_diff_eq(&self, other: &Self, epsilon: f64) -> bool {
        M::entries(&self.base).abs_diff_eq(&M::entries(&other.base), epsilon)
            && self.vector.abs_diff_eq(&other.vector, epsilon)
    }
}

impl<M: Manifold> RelativeEq for Tangent<M> {
    fn default_max_relative() -> f64 {
        f64::default_max_relative()
    }

    fn relative_eq(&self, other: &Self, epsilon: f64, max_relative: f64) -> bool {
        M::entries(&self.base).relative_eq(&M::entries(&other.base), epsilon, max_relative)
            && self.vector.relative_eq(&other.vector, epsilon, max_relative)
    }
}

/// The middle of two vectors' components, for the inverse of a midpoint rule.
#[inline]
pub(crate) fn half<M: Space>(v: &Vector<M>) -> Vector<M> {
    Vector::<M>::from_index(|i| v[i] * 0.5)
}
