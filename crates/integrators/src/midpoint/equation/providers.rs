//! The covectors and velocities along the path of a step: by definition at any scalar, safely at real points, and there
//! with derivatives.

use std::cell::OnceCell;

use metriplectic_dynamics::Metriplectic;
use metriplectic_dynamics::orthogonal::WithJacobian;
use metriplectic_dynamics::system::Point;
use metriplectic_dynamics::velocity::{VelocityJet, irreversible, reversible, velocity_jet};
use metriplectic_fields::{Column, Scalar, ScalarField, Space as _, Vector, differential};
use metriplectic_manifolds::{
    InnerProduct, MetricAt, MetricError, MetricSlopes, Nodes, Retraction, Riemannian, StepPath,
    StepPathJet,
};

use super::{CovectorsOf, Law, Provider, Residual};
use crate::discrete_gradient::DiscreteGradient;
use crate::round_off::stable_gradient::{Segment, StableGradient};
use crate::step::{Dim, both};

/// Discrete gradients along one path by their definition.
pub(super) struct Defined<'a, 'b, Y: Metriplectic, R, W, D: Scalar> {
    pub(super) step: &'a Residual<'b, Y, R, W>,
    pub(super) inner: &'a <Y::Metric as Riemannian<Y::Manifold>>::At<D>,
    pub(super) g: &'a MetricAt<'a, Y::Manifold, Y::Metric, D>,
    pub(super) path: &'a StepPath<Y::Manifold, D>,
    /// The entropy production `⟨w_S, K̃ w_S⟩` of the last velocity.
    pub(super) production: D,
}

impl<Y, R, W, D> Provider for Defined<'_, '_, Y, R, W, D>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
    D: Scalar,
{
    type System = Y;
    type Components = Vector<Y::Manifold, D>;

    fn discrete(&mut self, _: Law, f: &impl ScalarField<Y::Manifold>) -> Vector<Y::Manifold, D> {
        let Residual { gradient, x, .. } = self.step;
        gradient.covector(f, self.inner, (x, f.at(x)), self.path)
    }

    fn differential(&self, f: &impl ScalarField<Y::Manifold>) -> Vector<Y::Manifold, D> {
        differential(f, &self.path.z)
    }

    fn displacement_less(&self, h: f64, v: Vector<Y::Manifold, D>) -> Vector<Y::Manifold, D> {
        self.path.d - v * D::from(h)
    }

    fn velocity(
        &mut self,
        system: &Y,
        w: &CovectorsOf<Self>,
    ) -> Result<(Vector<Y::Manifold, D>, f64), MetricError> {
        let friction = irreversible(system, self.g, w)?;
        self.production = w.entropy.dot(&friction);
        Ok((reversible(system, self.g, w)? + friction, self.production.re()))
    }
}

/// One path at real points, along which fields get discrete gradients that are safe against
/// round-off.
pub(super) struct Along<'a, 'b, Y: Metriplectic, R, W, G> {
    pub(super) step: &'a Residual<'b, Y, R, W>,
    pub(super) u: &'a Vector<Y::Manifold>,
    pub(super) g: &'a G,
    pub(super) segment: Segment<'a, Y::Manifold>,
    pub(super) nodes: OnceCell<Nodes<Y::Manifold>>,
}

impl<'a, 'b, Y, R, W, G> Along<'a, 'b, Y, R, W, G>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
    G: InnerProduct<Vector<Y::Manifold>>,
{
    pub(super) const fn new(
        step: &'a Residual<'b, Y, R, W>,
        u: &'a Vector<Y::Manifold>,
        g: &'a G,
        segment: Segment<'a, Y::Manifold>,
    ) -> Self {
        Self { step, u, g, segment, nodes: OnceCell::new() }
    }

    /// The data of the discrete gradient of `f` on the path with the base `z` and the end `x'`, from its
    /// values at `x` and `x'`.
    #[inline]
    pub(super) fn stable_gradient(
        &self,
        f: &impl ScalarField<Y::Manifold>,
        mean: &Vector<Y::Manifold>,
        [z, end]: [&Point<Y>; 2],
        values: [f64; 2],
    ) -> StableGradient<Y::Manifold> {
        let base = || self.step.gradient.slope_at_base(f, z, self.segment.d, mean);
        let nodes = || {
            let (Residual { retraction, x, .. }, metric) = (self.step, self.step.system.metric());
            let nodes = retraction.along(metric, x, self.u);
            // The same path has been followed to its end, so the alternative is not reached.
            nodes.unwrap_or_else(|_| Nodes {
                ends: both([*x, end], Y::Manifold::constant),
                middle: None,
            })
        };
        let nodes = || self.nodes.get_or_init(nodes);
        StableGradient::new(f, mean, &self.segment, values, base, nodes)
    }
}

/// Discrete gradients at real points, with `⟨w, d⟩ = F(x') − F(x) + φe`.
pub(super) struct Values<'a, 'b, Y: Metriplectic, R, W, G> {
    pub(super) along: &'a Along<'a, 'b, Y, R, W, G>,
    pub(super) path: &'a StepPath<Y::Manifold>,
    pub(super) g: &'a MetricAt<'a, Y::Manifold, Y::Metric>,
}

impl<Y, R, W, G> Provider for Values<'_, '_, Y, R, W, G>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
    G: InnerProduct<Vector<Y::Manifold>>,
{
    type System = Y;
    type Components = Vector<Y::Manifold>;

    #[inline]
    fn discrete(&mut self, law: Law, f: &impl ScalarField<Y::Manifold>) -> Vector<Y::Manifold> {
        let (Along { step, g, .. }, path) = (self.along, self.path);
        let (start, drift) = step.start_of(law);
        let mean = step.gradient.real_mean(f, step.x, path);
        let values = [start, f.at(&path.end)];
        let w = self.along.stable_gradient(f, &mean, [&path.z.base, &path.end], values);
        w.covector(drift, *g, &path.d)
    }

    #[inline]
    fn differential(&self, f: &impl ScalarField<Y::Manifold>) -> Vector<Y::Manifold> {
        f.jet1(&self.path.z.base).df
    }

    #[inline]
    fn displacement_less(&self, h: f64, v: Vector<Y::Manifold>) -> Vector<Y::Manifold> {
        self.path.d - v * h
    }

    #[inline]
    fn velocity(
        &mut self,
        system: &Y,
        w: &CovectorsOf<Self>,
    ) -> Result<(Vector<Y::Manifold>, f64), MetricError> {
        let friction = irreversible(system, self.g, w)?;
        let production = w.entropy.dot(&friction);
        Ok((reversible(system, self.g, w)? + friction, production))
    }
}

/// Stable covectors with the derivatives along the unknown of the step, and the terms that the round-off of the equation is
/// made of.
pub(super) struct Jets<'a, 'b, Y: Metriplectic, R, W, G> {
    pub(super) along: &'a Along<'a, 'b, Y, R, W, G>,
    pub(super) path: &'a StepPathJet<Y::Manifold>,
    pub(super) metric: &'a MetricAt<'a, Y::Manifold, Y::Metric>,
    pub(super) slopes: Option<&'a MetricSlopes<Y::Manifold>>,
    /// The round-off of `w_H`.
    pub(super) noise: Vector<Y::Manifold>,
    pub(super) velocity: Option<VelocityJet<Dim<Y>>>,
}

impl<'a, 'b, Y: Metriplectic, R, W, G> Jets<'a, 'b, Y, R, W, G> {
    pub(super) fn new(
        along: &'a Along<'a, 'b, Y, R, W, G>,
        path: &'a StepPathJet<Y::Manifold>,
        metric: &'a MetricAt<'a, Y::Manifold, Y::Metric>,
        slopes: Option<&'a MetricSlopes<Y::Manifold>>,
    ) -> Self {
        Self { along, path, metric, slopes, noise: Column::zero(), velocity: None }
    }
}

impl<Y, R, W, G> Provider for Jets<'_, '_, Y, R, W, G>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
    G: InnerProduct<Vector<Y::Manifold>>,
{
    type System = Y;
    type Components = WithJacobian<Dim<Y>>;

    #[inline]
    fn discrete(&mut self, law: Law, f: &impl ScalarField<Y::Manifold>) -> WithJacobian<Dim<Y>> {
        let (Along { step, g, .. }, path) = (self.along, self.path);
        let (start, drift) = step.start_of(law);
        let (mean, dmean) = step.gradient.mean_jet(f, step.x, path);
        let end = f.jet1(&path.end);
        let ends = [&path.z, &path.end];
        let w = self.along.stable_gradient(f, &mean, ends, [start, end.value]);
        let value = w.covector(drift, *g, &path.d);
        let slope = w.slope(drift, (*g, self.slopes), path, (&dmean, &end.df));
        if law == Law::Energy {
            // Near the edge of a domain dH is far steeper at x' than at z, and the rounding of d counts
            // there.
            self.noise = w.noise(*g, &path.d) + end.df.abs() * f64::EPSILON;
        }
        WithJacobian { value, slope }
    }

    fn differential(&self, f: &impl ScalarField<Y::Manifold>) -> WithJacobian<Dim<Y>> {
        let jet = f.jet2(&self.path.z);
        WithJacobian { value: jet.df, slope: jet.hf * self.path.dz }
    }

    #[inline]
    fn displacement_less(&self, h: f64, v: WithJacobian<Dim<Y>>) -> WithJacobian<Dim<Y>> {
        WithJacobian { value: self.path.d - v.value * h, slope: self.path.dd - v.slope * h }
    }

    #[inline]
    fn velocity(
        &mut self,
        system: &Y,
        w: &CovectorsOf<Self>,
    ) -> Result<(WithJacobian<Dim<Y>>, f64), MetricError> {
        let jet = velocity_jet(system, self.metric, &self.path.dz, w)?;
        self.velocity = Some(jet);
        Ok((jet.velocity, jet.production))
    }
}
