//! The path of a step: its base point, its displacement and its end.

use metriplectic_fields::{ChartPoint, Column, Matrix, Real, Scalar, Space, Square, Vector};

use crate::retraction::Nodes;
use crate::{MetricError, Riemannian};

/// The path of a step: its base point, its displacement there, and its end.
#[derive(Clone, Debug)]
pub struct StepPath<M: Space, D: Scalar = f64> {
    /// The base point `z`.
    pub z: ChartPoint<M, D>,
    /// The displacement `d = hv ∈ T_zM`.
    pub d: Vector<M, D>,
    /// The end `x'`.
    pub end: M::Point<D>,
}

impl<M: Space> StepPath<M> {
    /// Makes the straight line of a flat space, with its middle as the base: `z = x + u/2`, `d = u`,
    /// `x' = x + u`.
    #[inline]
    pub fn straight(x: &M::Point<f64>, u: &Vector<M>) -> Self {
        let z = ChartPoint::centre(&M::chart(x, &(*u * 0.5)));
        Self { z, d: *u, end: M::chart(x, u) }
    }
}

/// The path of a step at `f64`, with what is known of the geodesic that it is.
#[derive(Clone, Debug)]
pub struct WeylPath<M: Space> {
    /// The path.
    pub path: StepPath<M>,
    /// The motion at its ends; `None` where [`along`](crate::Retraction::along) takes no integration.
    pub ends: Option<GeodesicEnds<M>>,
}

impl<M: Space> From<StepPath<M>> for WeylPath<M> {
    #[inline]
    fn from(path: StepPath<M>) -> Self {
        Self { path, ends: None }
    }
}

/// The motion at the ends of a geodesic of time 1.
#[derive(Clone, Copy, Debug)]
pub struct GeodesicEnds<M: Space> {
    /// The acceleration at the start, in the chart there.
    pub bend: Vector<M>,
    /// The velocity at the end, in the frame of the chart there.
    pub velocity: Vector<M>,
}

impl<M: Space> GeodesicEnds<M> {
    /// Computes the nodes of the geodesic that leaves `x` with the velocity `u` and comes to `end`.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the metric cannot be used at the end.
    pub fn nodes(
        &self,
        metric: &impl Riemannian<M>,
        x: &M::Point<f64>,
        u: &Vector<M>,
        end: &M::Point<f64>,
    ) -> Result<Nodes<M>, MetricError> {
        let start = Vector::<M, Real>::from_index(|i| Real::new(0.0, u[i], u[i], self.bend[i]));
        let ends = [M::chart(x, &start), metric.along(end, &self.velocity, 0.0)?];
        Ok(Nodes { ends, middle: None })
    }
}

/// The path of a step at `f64`, with its derivatives along the unknown `u`.
#[derive(Clone, Debug)]
pub struct StepPathJet<M: Space> {
    /// The base point `z`.
    pub z: M::Point<f64>,
    /// `∂z/∂u` in the chart at `z`.
    pub dz: Matrix<M>,
    /// The displacement `d = hv ∈ T_zM`.
    pub d: Vector<M>,
    /// `∂d/∂u` in the chart at `z`.
    pub dd: Matrix<M>,
    /// The end `x'`.
    pub end: M::Point<f64>,
    /// `∂x'/∂u` in the chart at `x'`.
    pub dend: Matrix<M>,
}

impl<M: Space> StepPathJet<M> {
    /// Makes the same straight line as [`StepPath::straight`].
    #[inline]
    pub fn straight(x: &M::Point<f64>, u: &Vector<M>) -> Self {
        let one = Matrix::<M>::one();
        Self {
            z: M::chart(x, &(*u * 0.5)),
            dz: one * 0.5,
            d: *u,
            dd: one,
            end: M::chart(x, u),
            dend: one,
        }
    }
}
