//! The Riemannian exponential as a retraction: base point at the start.

use metriplectic_equations::Path;
use metriplectic_fields::{ChartPoint, Matrix, Scalar, Square, Vector};

use crate::{
    Manifold, MetricError, PointPair, Retraction, Riemannian, StepPath, StepPathJet, Tangent,
};

/// The Riemannian exponential based at the start of the step,
///
/// ```math
/// R_h(v_x) = \bigl(x,\ \exp_x(hv)\bigr).
/// ```
///
/// Schemes built on it have order 1. [`WeylMidpoint`](crate::WeylMidpoint) has order 2 at the same
/// cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Exponential;

impl<M: Manifold, G: Riemannian<M>> Retraction<M, G> for Exponential {
    const PATH: Option<Path> = Some(Path::Exponential);

    #[inline]
    fn step_path<D: Scalar>(
        &self,
        metric: &G,
        x: &M::Point<f64>,
        u: &Vector<M, D>,
    ) -> Result<StepPath<M, D>, MetricError> {
        let z = ChartPoint::centre(x);
        let (end, _) = metric.exp(&z, u)?;
        Ok(StepPath { z, d: *u, end: end.point() })
    }

    #[inline]
    fn real_step_path(
        &self,
        metric: &G,
        x: &M::Point<f64>,
        u: &Vector<M>,
    ) -> Result<StepPath<M>, MetricError> {
        // The midpoint path ends at the same point.
        let StepPath { end, .. } = metric.weyl_path(x, u)?;
        Ok(StepPath { z: ChartPoint::centre(x), d: *u, end })
    }

    fn step_path_jet(
        &self,
        metric: &G,
        x: &M::Point<f64>,
        u: &Vector<M>,
    ) -> Result<StepPathJet<M>, MetricError> {
        let StepPathJet { end, dend, .. } = metric.weyl_jet(x, u)?;
        let (zero, one) = (Matrix::<M>::zeros(), Matrix::<M>::one());
        Ok(StepPathJet { z: x.clone(), dz: zero, d: *u, dd: one, end, dend })
    }

    fn pair(&self, metric: &G, tangent: &Tangent<M>) -> Result<PointPair<M>, MetricError> {
        let (y, _) = metric.exp(&ChartPoint::centre(&tangent.base), &tangent.vector)?;
        Ok((tangent.base.clone(), y.point()))
    }

    fn inverse(
        &self,
        metric: &G,
        x: &M::Point<f64>,
        y: &M::Point<f64>,
    ) -> Result<Tangent<M>, MetricError> {
        Ok(Tangent { base: x.clone(), vector: metric.log(x, y)? })
    }
}
