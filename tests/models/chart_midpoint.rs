//! The chart midpoint: the path of the canonical metric with the inner product of another one.

use metriplectic::fields::Vector;
use metriplectic::manifolds::{
    MetricError, Nodes, PointPair, Riemannian, StepPath, StepPathJet, Tangent,
};
use metriplectic::prelude::*;

/// The midpoint of the canonical metric with the inner product of another one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChartMidpoint;

impl<M: Manifold, G: Riemannian<M>> Retraction<M, G> for ChartMidpoint
where
    Canonical: Riemannian<M>,
{
    fn step_path<D: Scalar>(
        &self,
        _: &G,
        x: &M::Point<f64>,
        u: &Vector<M, D>,
    ) -> Result<StepPath<M, D>, MetricError> {
        WeylMidpoint.step_path(&Canonical, x, u)
    }

    fn end(&self, _: &G, x: &M::Point<f64>, u: &Vector<M>) -> Result<M::Point<f64>, MetricError> {
        Retraction::<M, Canonical>::end(&WeylMidpoint, &Canonical, x, u)
    }

    fn along(&self, _: &G, x: &M::Point<f64>, u: &Vector<M>) -> Result<Nodes<M>, MetricError> {
        Retraction::<M, Canonical>::along(&WeylMidpoint, &Canonical, x, u)
    }

    fn step_path_jet(
        &self,
        _: &G,
        x: &M::Point<f64>,
        u: &Vector<M>,
    ) -> Result<StepPathJet<M>, MetricError> {
        WeylMidpoint.step_path_jet(&Canonical, x, u)
    }

    fn pair(&self, _: &G, tangent: &Tangent<M>) -> Result<PointPair<M>, MetricError> {
        WeylMidpoint.pair(&Canonical, tangent)
    }

    fn inverse(
        &self,
        _: &G,
        x: &M::Point<f64>,
        y: &M::Point<f64>,
    ) -> Result<Tangent<M>, MetricError> {
        WeylMidpoint.inverse(&Canonical, x, y)
    }
}
