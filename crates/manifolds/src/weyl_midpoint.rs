//! The symmetric retraction: base point in the middle of the geodesic.

use metriplectic_equations::Path;
use metriplectic_fields::{ChartPoint, Scalar, Vector};

use crate::retraction::half;
use crate::{
    Manifold, MetricError, Nodes, PointPair, Retraction, Riemannian, StepPath, StepPathJet, Tangent,
};

/// Weyl's midpoint retraction (Bloch, Farré Puiggalí, Martín de Diego 2024, eq. "weyl"):
///
/// ```math
/// R_h(v_z) = \bigl(\exp_z(-hv/2),\ \exp_z(hv/2)\bigr).
/// ```
///
/// `z` is the geodesic midpoint of the pair, and schemes built on it have order 2.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WeylMidpoint;

impl<M: Manifold, G: Riemannian<M>> Retraction<M, G> for WeylMidpoint {
    const PATH: Option<Path> = Some(Path::Weyl);

    #[inline]
    fn step_path<D: Scalar>(
        &self,
        metric: &G,
        x: &M::Point<f64>,
        u: &Vector<M, D>,
    ) -> Result<StepPath<M, D>, MetricError> {
        let half = *u * D::from(0.5);
        let (z, velocity) = metric.exp(&ChartPoint::centre(x), &half)?;
        let (end, _) = metric.exp(&z, &velocity)?;
        Ok(StepPath { z, d: velocity * D::from(2.0), end: end.point() })
    }

    #[inline]
    fn real_step_path(
        &self,
        metric: &G,
        x: &M::Point<f64>,
        u: &Vector<M>,
    ) -> Result<StepPath<M>, MetricError> {
        metric.weyl_path(x, u)
    }

    #[inline]
    fn along(&self, metric: &G, x: &M::Point<f64>, u: &Vector<M>) -> Result<Nodes<M>, MetricError> {
        Ok(Nodes { ends: [metric.along(x, u, 0.0)?, metric.along(x, u, 1.0)?], middle: None })
    }

    #[inline]
    fn step_path_jet(
        &self,
        metric: &G,
        x: &M::Point<f64>,
        u: &Vector<M>,
    ) -> Result<StepPathJet<M>, MetricError> {
        metric.weyl_jet(x, u)
    }

    fn pair(&self, metric: &G, tangent: &Tangent<M>) -> Result<PointPair<M>, MetricError> {
        let z = ChartPoint::centre(&tangent.base);
        let forward = half::<M>(&tangent.vector);
        let (x, _) = metric.exp(&z, &-forward)?;
        let (y, _) = metric.exp(&z, &forward)?;
        Ok((x.point(), y.point()))
    }

    fn inverse(
        &self,
        metric: &G,
        x: &M::Point<f64>,
        y: &M::Point<f64>,
    ) -> Result<Tangent<M>, MetricError> {
        let u = metric.log(x, y)?;
        let (z, velocity) = metric.exp(&ChartPoint::centre(x), &half::<M>(&u))?;
        Ok(Tangent { base: z.point(), vector: velocity * 2.0 })
    }
}
