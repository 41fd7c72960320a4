//! The Riemannian exponential as a retraction: base point at the start.

use metriplectic_fields::{ChartPoint, Matrix, Scalar, Square, Vector};

use crate::{Arc, ArcJet, Manifold, MetricError, PointPair, Retraction, Riemannian, Tangent};

/// The Riemannian exponential based at the start of the step,
///
/// ```math
/// R_h(v_x) = \bigl(x,\ \exp_x(hv)\bigr).
/// ```
///
/// Schemes built on it have order 1; [`WeylMidpoint`](crate::WeylMidpoint) has order 2 at the same
/// price.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Exponential;

impl<M: Manifold, G: Riemannian<M>> Retraction<M, G> for Exponential {
    #[inline]
    fn arc<D: Scalar>(
        &self,
        metric: &G,
        x: &M::Point<f64>,
        u: &Vector<M, D>,
    ) -> Result<Arc<M, D>, MetricError> {
        let z = ChartPoint::centre(x);
        let (end, _) = metric.exp(&z, u)?;
        Ok(Arc { z, d: *u, end: end.point() })
    }

    #[inline]
    fn real_arc(
        &self,
        metric: &G,
        x: &M::Point<f64>,
        u: &Vector<M>,
    ) -> Result<Arc<M>, MetricError> {
        // The midpoint arc ends at the same point.
        let Arc { end, .. } = metric.weyl_arc(x, u)?;
        Ok(Arc { z: ChartPoint::centre(x), d: *u, end })
    }

    fn arc_jet(
        &self,
        metric: &G,
        x: &M::Point<f64>,
        u: &Vector<M>,
    ) -> Result<ArcJet<M>, MetricError> {
        let ArcJet { end, dend, .. } = metric.weyl_jet(x, u)?;
        let (zero, one) = (Matrix::<M>::zeros(), Matrix::<M>::one());
        Ok(ArcJet { z: x.clone(), dz: zero, d: *u, dd: one, end, dend })
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
