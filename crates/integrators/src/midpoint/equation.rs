//! The implicit equation of one step.

mod both_ends;
mod providers;

use std::fmt::Debug;

use metriplectic_dynamics::orthogonal::WithJacobian;
use metriplectic_dynamics::velocity::{Covectors, Gradient};
use metriplectic_dynamics::{Metriplectic, SecondLaw, system::Point};
use metriplectic_fields::{ChartPoint, Column, Scalar, ScalarField, Space, Square, Vector};
use metriplectic_manifolds::{Manifold, MetricError, Retraction};

pub(crate) use both_ends::BothEnds;
use providers::{Along, Defined, Jets, Values};

use super::scheme::Scheme;
use crate::discrete_gradient::DiscreteGradient;
use crate::newton::{Equation, Evaluated, Linearised, Rounding, Stiffness};
use crate::round_off::bound::{ROUNDED, is_dissipated};
use crate::round_off::drift;
use crate::round_off::stable_gradient::Segment;
use crate::step::{CountOf, DriftCorrection, Flow as _, Laws, Numbers, Start};

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
    /// The correction of the errors of earlier steps.
    pub(crate) drift: DriftCorrection<Y>,
}

/// The entropy in an evaluation of the equation.
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

/// A provider of covectors and velocities along the path of a step: by definition at any scalar, safely at real
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
type CovectorsOf<P> = Covectors<CountOf<<P as Provider>::System>, <P as Provider>::Components>;

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
    pub fn new(system: &'a Y, scheme: &'a Scheme<R, W>, x: &'a Point<Y>, h: f64) -> Self {
        let Scheme { retraction, gradient, .. } = scheme;
        let (values, drift) = (system.laws(x), drift::nothing::<Y>());
        Self { system, retraction, gradient, x, h, values, drift }
    }

    /// The equation of a step of size `h` from `x`, to be linearised from both ends, for which it needs no laws at `x`.
    pub(crate) fn between(
        system: &'a Y,
        scheme: &'a Scheme<R, W>,
        x: &'a Point<Y>,
        h: f64,
    ) -> Self {
        let Scheme { retraction, gradient, .. } = scheme;
        let nothing = drift::nothing::<Y>;
        Self { system, retraction, gradient, x, h, values: nothing(), drift: nothing() }
    }

    /// Makes the equation of a start with known laws, and with errors of earlier steps to correct.
    #[inline]
    pub(crate) fn of_start(
        system: &'a Y,
        scheme: &'a Scheme<R, W>,
        start: &Start<'a, Y>,
        drift: DriftCorrection<Y>,
    ) -> Self {
        let Scheme { retraction, gradient, .. } = scheme;
        let &Start { x, h, values, .. } = start;
        Self { system, retraction, gradient, x, h, values, drift }
    }

    /// The equation of a step of a fraction of the size, which takes nothing back.
    pub(crate) fn of_fraction(&self, fraction: f64) -> Self {
        let &Self { system, retraction, gradient, x, h, values, .. } = self;
        let drift = drift::nothing::<Y>();
        Self { system, retraction, gradient, x, h: h * fraction, values, drift }
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
        Ok(self.defined(u)?.0)
    }

    /// The residual, and the growth `h ⟨w_S, K̃ w_S⟩` of the entropy, by their definitions.
    pub(crate) fn defined<D: Scalar>(
        &self,
        u: &Vector<Y::Manifold, D>,
    ) -> Result<(Vector<Y::Manifold, D>, D), MetricError> {
        let metric = self.system.metric();
        let path = self.retraction.step_path(metric, self.x, u)?;
        let g = self.system.metric_at(&path.z);
        let (inner, production) = (g.inner()?, D::from(0.0));
        let mut defined = Defined { step: self, inner, g: &g, path: &path, production };
        let residual = equation(self.system, self.h, &mut defined)?.residual;
        Ok((residual, defined.production * D::from(self.h)))
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

    /// Returns the slope of the entropy in an evaluation, and whether its production is above round-off.
    fn dissipated(&self, w: &Vector<Y::Manifold>, production: f64) -> Dissipated {
        Dissipated {
            slope_squared: if self.is_exact() { w.dot(w) } else { f64::INFINITY },
            dissipates: is_dissipated(self.h.abs() * production, self.values.entropy),
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
        let path = self.retraction.real_step_path(metric, self.x, u).ok()?;
        let g = self.system.metric_at(&path.z);
        let segment = Segment::new(&path.d, &path.end);
        let along = Along::new(self, u, g.inner().ok()?, segment);
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
