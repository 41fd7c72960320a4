//! The implicit equation of one step.

use std::cell::OnceCell;
use std::fmt::Debug;

use metriplectic_dynamics::orthogonal::WithJacobian;
use metriplectic_dynamics::velocity::{
    Covectors, Gradient, VelocityJet, irreversible, reversible, velocity_jet,
};
use metriplectic_dynamics::{Metriplectic, SecondLaw, system::Point};
use metriplectic_fields::{
    ChartPoint, Column, Scalar, ScalarField, Space, Square, Vector, differential,
};
use metriplectic_manifolds::{
    GeodesicEnds, InnerProduct, Manifold, MetricAt, MetricError, MetricSlopes, Nodes, Retraction,
    Riemannian, StepPath, StepPathJet, WeylPath,
};

use super::{Dim, Numbers};
use crate::discrete_gradient::DiscreteGradient;
use crate::method::{Flow as _, Laws};
use crate::newton::{Equation, Evaluated, Linearised, Rounding, Stiffness};
use crate::round_off::bound::ROUNDED;
use crate::round_off::drift::{self, DriftCorrection};
use crate::round_off::stable_gradient::{Segment, StableGradient};

/// The equation of one step (Bloch, Farré Puiggalí, Martín de Diego 2024, §4.4), as a function of
/// the initial displacement `u ∈ T_xM` of the path:
///
/// ```math
/// F(u) = d - h \bigl( \tilde\Pi\, w_H + \tilde K_{w_H} w_S \bigr) = 0 ,
/// ```
///
/// with `(z, d) = R_h⁻¹(x, x')` the base point and displacement of the path, and `w_H` a discrete
/// gradient of `H` along it. Both tensors annihilate `w_H`, so a root keeps `H`. In the scheme as published
/// `w_S` is `dS(z)` and `Π̃ = Π(z)`; in the exact one `w_S` is a discrete gradient of `S`, which `Π̃`
/// annihilates, so that `ΔS = h K̃(w_S, w_S) ≥ 0` ([`velocity`](metriplectic_dynamics::velocity)). No logarithm is
/// taken: the path is shot from `x`.
#[derive(Debug)]
pub struct Residual<'a, Y: Metriplectic, R, W> {
    pub(crate) system: &'a Y,
    pub(crate) retraction: &'a R,
    gradient: &'a W,
    pub(crate) x: &'a Point<Y>,
    h: f64,
    /// The laws at `x`.
    pub(crate) values: Laws<Numbers<Y>>,
    /// What is taken back of the errors of earlier steps.
    pub(crate) drift: DriftCorrection<Y>,
}

/// What an evaluation tells of the entropy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dissipated {
    /// `|w_S|²`; infinite if the entropy has no discrete gradient.
    pub slope_squared: f64,
    /// Whether anything is dissipated.
    pub dissipates: bool,
}

/// The residual with its Jacobian, and what is in it: the discrete gradients `w_H` and `w_S`, the displacement,
/// and the growth of the entropy by friction, `h⟨w_S, K̃ w_S⟩`.
pub(crate) struct Jet<M: Space> {
    pub(crate) at: Linearised<M, Dissipated>,
    pub(crate) energy: Vector<M>,
    pub(crate) entropy: Vector<M>,
    pub(crate) d: Vector<M>,
    pub(crate) growth: f64,
}

/// One law of a system.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Law {
    Energy,
    Entropy,
    Invariant(usize),
}

/// What makes covectors and velocities along the path of a step: by definition at any scalar, safely at real
/// points, or there with the derivatives along the unknown of the step.
trait Provider {
    type System: Metriplectic;
    /// Components of covectors and vectors.
    type Components: Copy + Debug + Send + Sync;

    /// The discrete gradient of the function `f` of a law.
    fn discrete(
        &mut self,
        law: Law,
        f: &impl ScalarField<<Self::System as Metriplectic>::Manifold>,
    ) -> Self::Components;

    /// The differential of a function at the base point.
    fn differential(
        &self,
        f: &impl ScalarField<<Self::System as Metriplectic>::Manifold>,
    ) -> Self::Components;

    /// The displacement `d` of the path, less `h` times a velocity.
    fn displacement_less(&self, h: f64, velocity: Self::Components) -> Self::Components;

    /// The vector `Π̃ w_H + K̃ w_S`, and the entropy production `⟨w_S, K̃ w_S⟩`.
    fn velocity(
        &mut self,
        system: &Self::System,
        w: &CovectorsOf<Self>,
    ) -> Result<(Self::Components, f64), MetricError>;
}

/// The covectors of a provider.
type CovectorsOf<P> = Covectors<Dim<<P as Provider>::System>, <P as Provider>::Components>;

/// The terms of the equation along one path.
struct Terms<P: Provider> {
    w: CovectorsOf<P>,
    residual: P::Components,
    production: f64,
}

/// The equation `d − h (Π̃ w_H + K̃ w_S)` with the covectors and velocities of a provider.
#[inline]
fn equation<P: Provider>(system: &P::System, h: f64, p: &mut P) -> Result<Terms<P>, MetricError> {
    let energy = p.discrete(Law::Energy, system.energy());
    let entropy = if is_exact(system) {
        p.discrete(Law::Entropy, system.entropy())
    } else {
        p.differential(system.entropy())
    };
    let mut invariants = OfInvariants { provider: p, seen: 0 };
    let w = Covectors::new([energy, entropy], system.invariants(), &mut invariants);
    let (velocity, production) = p.velocity(system, &w)?;
    Ok(Terms { w, residual: p.displacement_less(h, velocity), production })
}

/// Whether the entropy has a discrete gradient.
fn is_exact<Y: Metriplectic>(system: &Y) -> bool {
    system.second_law() == SecondLaw::Exact
}

/// The discrete gradients of the further invariants, one after the other.
struct OfInvariants<'a, P> {
    provider: &'a mut P,
    seen: usize,
}

impl<P: Provider> Gradient<<P::System as Metriplectic>::Manifold> for OfInvariants<'_, P> {
    type Covector = P::Components;

    #[inline]
    fn of(&mut self, f: &impl ScalarField<<P::System as Metriplectic>::Manifold>) -> P::Components {
        self.seen += 1;
        self.provider.discrete(Law::Invariant(self.seen - 1), f)
    }
}

impl<'a, Y, R, W> Residual<'a, Y, R, W>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    /// The equation of a step of size `h` from `x`.
    pub fn new(system: &'a Y, parts: (&'a R, &'a W), x: &'a Point<Y>, h: f64) -> Self {
        Self::towards(system, parts, (x, system.laws(x)), h, drift::nothing::<Y>())
    }

    /// The same for a point with known laws, and errors of earlier steps to take back.
    #[inline]
    pub(crate) fn towards(
        system: &'a Y,
        (retraction, gradient): (&'a R, &'a W),
        (x, values): (&'a Point<Y>, Laws<Numbers<Y>>),
        h: f64,
        drift: DriftCorrection<Y>,
    ) -> Self {
        Self { system, retraction, gradient, x, h, values, drift }
    }

    /// The equation of a step of a fraction of the size, which takes nothing back.
    pub(crate) fn of_fraction(&self, fraction: f64) -> Self {
        let parts = (self.retraction, self.gradient);
        let start = (self.x, self.values);
        Self::towards(self.system, parts, start, self.h * fraction, drift::nothing::<Y>())
    }

    /// The size of the step.
    pub(crate) const fn step_size(&self) -> f64 {
        self.h
    }

    /// Whether the entropy has a discrete gradient.
    pub(crate) fn is_exact(&self) -> bool {
        is_exact(self.system)
    }

    /// The residual by its definition, at any scalar.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the path cannot be followed.
    pub fn at<D: Scalar>(
        &self,
        u: &Vector<Y::Manifold, D>,
    ) -> Result<Vector<Y::Manifold, D>, MetricError> {
        let metric = self.system.metric();
        let path = self.retraction.step_path(metric, self.x, u)?;
        let g = self.system.metric_at(&path.z);
        let mut defined = Defined { step: self, inner: g.inner()?, g: &g, path: &path };
        Ok(equation(self.system, self.h, &mut defined)?.residual)
    }

    /// The residual with its Jacobian, and the covectors in it, from the jets `(f, df, Hf)` of the fields: no
    /// nested dual number is formed.
    #[inline]
    pub(crate) fn jet(&self, u: &Vector<Y::Manifold>) -> Option<Jet<Y::Manifold>> {
        let (system, metric, h) = (self.system, self.system.metric(), self.h);
        let path = self.retraction.step_path_jet(metric, self.x, u).ok()?;
        let z = ChartPoint::<Y::Manifold>::centre(&path.z);
        let g = system.metric_at(&z);
        // The derivatives first, so that the metric is evaluated once.
        let slopes = g.slopes().ok()?.as_ref();
        let along = Along::new(self, u, g.inner().ok()?, Segment::new(&path.d, &path.end));
        let mut jets = Jets::new(&along, &path, &g, slopes);
        let Terms { w, residual, production } = equation(system, h, &mut jets).ok()?;
        let (noise, velocity) = (jets.noise, jets.velocity?);

        let rounding = Rounding {
            // What underflows is no larger than the least normal number.
            terms: Vector::<Y::Manifold>::from_index(|i| {
                ROUNDED * h.abs() * velocity.terms[i] + f64::MIN_POSITIVE * (1.0 + h.abs())
            }),
            sensitivity: velocity.sensitivity * h,
            covector: noise,
            argument: (Y::Manifold::scales(self.x) + path.d.abs()) * f64::EPSILON,
        };
        // Half of a displacement reaches z.
        let stiffness = Stiffness {
            friction: 2.0 * h.abs() * velocity.friction,
            rotation: 2.0 * h.abs() * velocity.rotation,
        };
        let evidence = self.dissipated(&w.entropy.value, production);
        let WithJacobian { value: residual, slope: jacobian } = residual;
        let usable = residual.is_finite() && jacobian.magnitude().is_finite();
        let at = Linearised { residual, jacobian, rounding, stiffness, evidence };
        usable.then_some(Jet {
            at,
            energy: w.energy.value,
            entropy: w.entropy.value,
            d: path.d,
            growth: h * production,
        })
    }

    /// Whether the entropy production is more than the square of its round-off: a million steps of it change
    /// the entropy by more than a rounding.
    fn dissipated(&self, w: &Vector<Y::Manifold>, production: f64) -> Dissipated {
        Dissipated {
            slope_squared: if self.is_exact() { w.dot(w) } else { f64::INFINITY },
            dissipates: self.h.abs() * production > 1e-6 * f64::EPSILON * self.values.entropy.abs(),
        }
    }

    /// The value of a law at `x`, and what is taken back of its error.
    #[inline]
    fn start_of(&self, law: Law) -> (f64, f64) {
        let Self { values, drift, .. } = self;
        match law {
            Law::Energy => (values.energy, drift.energy),
            Law::Entropy => (values.entropy, drift.entropy),
            Law::Invariant(k) => (values.invariants[k], drift.invariants[k]),
        }
    }
}

impl<Y, R, W> Equation<Y::Manifold> for Residual<'_, Y, R, W>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    type Evidence = Dissipated;

    /// The residual, safe against round-off.
    #[inline]
    fn evaluate(&self, u: &Vector<Y::Manifold>) -> Option<Evaluated<Y::Manifold, Dissipated>> {
        let metric = self.system.metric();
        let WeylPath { path, ends } = self.retraction.path_with_ends(metric, self.x, u).ok()?;
        let g = self.system.metric_at(&path.z);
        let segment = Segment::new(&path.d, &path.end);
        let along = Along { ends, ..Along::new(self, u, g.inner().ok()?, segment) };
        let mut values = Values { along: &along, path: &path, g: &g };
        let Terms { w, residual, production } = equation(self.system, self.h, &mut values).ok()?;
        let evidence = self.dissipated(&w.entropy, production);
        residual.is_finite().then_some(Evaluated { residual, evidence })
    }

    #[inline]
    fn linearise(&self, u: &Vector<Y::Manifold>) -> Option<Linearised<Y::Manifold, Dissipated>> {
        self.jet(u).map(|jet| jet.at)
    }
}

/// Discrete gradients along one path by their definition.
struct Defined<'a, 'b, Y: Metriplectic, R, W, D: Scalar> {
    step: &'a Residual<'b, Y, R, W>,
    inner: &'a <Y::Metric as Riemannian<Y::Manifold>>::At<D>,
    g: &'a MetricAt<'a, Y::Manifold, Y::Metric, D>,
    path: &'a StepPath<Y::Manifold, D>,
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
        let production = w.entropy.dot(&friction).re();
        Ok((reversible(system, self.g, w)? + friction, production))
    }
}

/// One path at real points, along which fields get discrete gradients that are safe against
/// round-off.
struct Along<'a, 'b, Y: Metriplectic, R, W, G> {
    step: &'a Residual<'b, Y, R, W>,
    u: &'a Vector<Y::Manifold>,
    g: &'a G,
    segment: Segment<'a, Y::Manifold>,
    /// The motion at the ends of a geodesic, where it is known.
    ends: Option<GeodesicEnds<Y::Manifold>>,
    nodes: OnceCell<Nodes<Y::Manifold>>,
}

impl<'a, 'b, Y, R, W, G> Along<'a, 'b, Y, R, W, G>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
    G: InnerProduct<Vector<Y::Manifold>>,
{
    const fn new(
        step: &'a Residual<'b, Y, R, W>,
        u: &'a Vector<Y::Manifold>,
        g: &'a G,
        segment: Segment<'a, Y::Manifold>,
    ) -> Self {
        Self { step, u, g, segment, ends: None, nodes: OnceCell::new() }
    }

    /// The data of the discrete gradient of `f` on the path with the base `z` and the end `x'`, from its
    /// values at `x` and `x'`.
    #[inline]
    fn stable_gradient(
        &self,
        f: &impl ScalarField<Y::Manifold>,
        mean: &Vector<Y::Manifold>,
        [z, end]: [&Point<Y>; 2],
        values: [f64; 2],
    ) -> StableGradient<Y::Manifold> {
        let base = || self.step.gradient.slope_at_base(f, z, self.segment.d, mean);
        let nodes = || {
            let (Residual { retraction, x, .. }, metric) = (self.step, self.step.system.metric());
            let nodes = match &self.ends {
                Some(ends) => ends.nodes(metric, x, self.u, end),
                None => retraction.along(metric, x, self.u),
            };
            // The same path has been followed to its end, so the alternative is not reached.
            nodes.unwrap_or_else(|_| Nodes {
                ends: [*x, end].map(Y::Manifold::constant),
                middle: None,
            })
        };
        let nodes = || self.nodes.get_or_init(nodes);
        StableGradient::new(f, mean, &self.segment, values, base, nodes)
    }
}

/// Discrete gradients at real points, with `⟨w, d⟩ = F(x') − F(x) + φe`.
struct Values<'a, 'b, Y: Metriplectic, R, W, G> {
    along: &'a Along<'a, 'b, Y, R, W, G>,
    path: &'a StepPath<Y::Manifold>,
    g: &'a MetricAt<'a, Y::Manifold, Y::Metric>,
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

/// The same with the derivatives along the unknown of the step, and what the round-off of the equation is
/// made of.
struct Jets<'a, 'b, Y: Metriplectic, R, W, G> {
    along: &'a Along<'a, 'b, Y, R, W, G>,
    path: &'a StepPathJet<Y::Manifold>,
    metric: &'a MetricAt<'a, Y::Manifold, Y::Metric>,
    slopes: Option<&'a MetricSlopes<Y::Manifold>>,
    /// The round-off of `w_H`.
    noise: Vector<Y::Manifold>,
    velocity: Option<VelocityJet<Dim<Y>>>,
}

impl<'a, 'b, Y: Metriplectic, R, W, G> Jets<'a, 'b, Y, R, W, G> {
    fn new(
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
        let slope = w.slope(drift, (*g, self.slopes), path, &dmean, &end.df);
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
