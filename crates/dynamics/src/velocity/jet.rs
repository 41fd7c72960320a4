//! The velocity with its derivatives along the unknown of a step.

use metriplectic_fields::{
    ChartPoint, Column, Dimension, Matrix, Space, Square, Vector, along_slopes,
};
use metriplectic_manifolds::{MetricError, Riemannian};

use super::covectors::{Covectors, Place};
use super::plan::{CASIMIR, MOMENTUM, ProjectionPlan};
use crate::bracket::Bracket;
use crate::dissipation::Dissipation;
use crate::invariants::{Invariants, Kind};
use crate::metriplectic::{Dim, Metriplectic, SecondLaw};
use crate::orthogonal::{OrthogonalJet, WithJacobian};

/// The velocity at a real point with its derivatives along the unknown of a step.
#[derive(Clone, Copy, Debug)]
pub struct VelocityJet<N: Dimension> {
    /// The velocity, and its derivatives.
    pub velocity: WithJacobian<N>,
    /// For each component the sum of the absolute terms that it is made of,
    /// `Σ_j |Π_ij||w_j| + |K_ij||s_j|` and those of the projections: what its round-off is relative to.
    pub terms: N::Vector<f64>,
    /// Its derivative along `w_H`, without that of the projections.
    pub gain: N::Matrix<f64>,
    /// The entropy production `⟨w_S, K̃ w_S⟩`.
    pub production: f64,
    /// The rate of the friction, `√|tr A²|` with `A` the derivative of `K̃ w_S` along the unknown: the
    /// root of the sum of its squared eigenvalues, the same number in all units.
    pub friction: f64,
    /// The same for the derivative of `Π̃ w_H`.
    pub rotation: f64,
}

/// The velocity `Π̃ w_H + K̃ w_S` at a real point `z` with its derivatives along the unknown of a step,
/// from those of the covectors and of the point: `∂z` in the chart at `z`.
///
/// # Errors
///
/// [`MetricError`] if the metric cannot be used at `z`.
#[inline]
pub fn velocity_jet<Y: Metriplectic + ?Sized>(
    system: &Y,
    z: &<Y::Manifold as Space>::Point<f64>,
    dz: &Matrix<Y::Manifold>,
    w: &Covectors<Dim<Y>, WithJacobian<Dim<Y>>>,
) -> Result<VelocityJet<Dim<Y>>, MetricError> {
    let (metric, centre) = (system.metric(), ChartPoint::<Y::Manifold>::centre(z));
    let slopes = if Y::Invariants::COUNT > 0 || ProjectionPlan::of(system, w).projected {
        metric.slopes(z)
    } else {
        None
    };
    let dg_v = |v: &Vector<Y::Manifold>| match &slopes {
        Some(slopes) => along_slopes::<Y::Manifold>(slopes, v) * *dz,
        None => Matrix::<Y::Manifold>::zeros(),
    };
    let g = metric.at(&centre)?;
    let pi = reversible_jet(system, &centre, (&g, &dg_v), dz, w)?;

    let mut off = OrthogonalJet::<Dim<Y>>::default();
    let mut first = 0;
    let mut alpha = w.entropy;
    if Y::Invariants::COUNT > 0 {
        off.push(&g, dg_v, &w.energy);
        first = off.len();
        w.invariants.as_ref().iter().flatten().for_each(|(_, l)| off.push(&g, dg_v, l));
        alpha = off.project_covector(first, &alpha);
    }
    let k = system.dissipation().linearise(metric, z, &w.energy.value, &alpha.value)?;
    let slope = k.along_z * *dz + k.along_w * w.energy.slope + k.tensor * alpha.slope;
    let k_s = off.project_vector(first, &WithJacobian { value: k.value, slope });
    let projection = off.terms_of_vector(first, &k.value, MOMENTUM);
    let mut terms = pi.terms
        + k.tensor.abs() * alpha.value.abs()
        + projection * (1.0 + off.amplification(first, MOMENTUM));
    let mut gain = pi.tensor + k.along_w;
    let mut irreversible = k_s;
    if system.bracket().is_forced() {
        let (force, tensor, rounded) = force_jet(system, &centre, (&g, &dg_v), dz, w)?;
        irreversible =
            WithJacobian { value: k_s.value + force.value, slope: k_s.slope + force.slope };
        terms += tensor.abs() * w.energy.value.abs() + rounded;
        gain += tensor;
    }
    let velocity = WithJacobian {
        value: pi.a.value + irreversible.value,
        slope: pi.a.slope + irreversible.slope,
    };
    let production = w.entropy.value.dot(&irreversible.value);
    let friction = trace_of_square::<Dim<Y>>(&irreversible.slope).abs().sqrt();
    let rotation = trace_of_square::<Dim<Y>>(&pi.a.slope).abs().sqrt();
    Ok(VelocityJet { velocity, terms, gain, production, friction, rotation })
}

/// [`force`] with its derivatives, its derivative along `w_H`, and the absolute terms of the projections.
fn force_jet<Y: Metriplectic + ?Sized>(
    system: &Y,
    z: &Place<Y, f64>,
    (g, dg_v): (
        &<Y::Metric as Riemannian<Y::Manifold>>::At<f64>,
        &impl Fn(&Vector<Y::Manifold>) -> Matrix<Y::Manifold>,
    ),
    dz: &Matrix<Y::Manifold>,
    w: &Covectors<Dim<Y>, WithJacobian<Dim<Y>>>,
) -> Result<ForceJet<Y>, MetricError> {
    let args = system.bracket_args(z, &w.entropy.value);
    let jet = system.bracket().linearise_force(&args, &w.energy.value)?;
    let slope = jet.along_z * *dz + jet.tensor * w.energy.slope + jet.along_s * w.entropy.slope;
    let force = WithJacobian { value: jet.value, slope };
    if Y::Invariants::COUNT == 0 {
        return Ok((force, jet.tensor, Vector::<Y::Manifold>::zero()));
    }
    let mut off = OrthogonalJet::<Dim<Y>>::default();
    off.push(g, dg_v, &w.energy);
    if system.second_law() == SecondLaw::Exact {
        off.push(g, dg_v, &w.entropy);
    }
    let first = off.len();
    let listed = w.invariants.as_ref().iter().flatten();
    let force = listed.fold(force, |force, (_, l)| off.without(g, dg_v, l, &force, MOMENTUM));
    let amplification = 1.0 + off.amplification(first, MOMENTUM);
    let rounded = off.terms_of_vector(first, &jet.value, MOMENTUM) * amplification;
    Ok((force, jet.tensor, rounded))
}

/// A force with its derivatives, its derivative along `w_H`, and absolute terms.
type ForceJet<Y> = (
    WithJacobian<Dim<Y>>,
    Matrix<<Y as Metriplectic>::Manifold>,
    Vector<<Y as Metriplectic>::Manifold>,
);

/// `tr A²`.
fn trace_of_square<N: Dimension>(a: &N::Matrix<f64>) -> f64 {
    (0..N::LEN).map(|i| (0..N::LEN).map(|j| a[(i, j)] * a[(j, i)]).sum::<f64>()).sum()
}

/// [`reversible`] with its derivatives, the tensor `Π`, and the terms that the vector is summed of.
struct ReversibleJet<N: Dimension> {
    a: WithJacobian<N>,
    tensor: N::Matrix<f64>,
    terms: N::Vector<f64>,
}

/// [`reversible`] at a real point, with its derivatives.
#[inline]
fn reversible_jet<Y: Metriplectic + ?Sized>(
    system: &Y,
    z: &Place<Y, f64>,
    (g, dg_v): (
        &<Y::Metric as Riemannian<Y::Manifold>>::At<f64>,
        &impl Fn(&Vector<Y::Manifold>) -> Matrix<Y::Manifold>,
    ),
    dz: &Matrix<Y::Manifold>,
    w: &Covectors<Dim<Y>, WithJacobian<Dim<Y>>>,
) -> Result<ReversibleJet<Dim<Y>>, MetricError> {
    let annihilated = ProjectionPlan::of(system, w);
    let bracket = |alpha: &WithJacobian<Dim<Y>>| {
        let jet =
            system.bracket().linearise(&system.bracket_args(z, &w.entropy.value), &alpha.value)?;
        let slope = jet.along_z * *dz + jet.tensor * alpha.slope + jet.along_s * w.entropy.slope;
        let terms = jet.tensor.abs() * alpha.value.abs();
        let a = WithJacobian { value: jet.value, slope };
        Ok::<_, MetricError>(ReversibleJet { a, tensor: jet.tensor, terms })
    };
    if !annihilated.projected && !annihilated.momenta {
        return bracket(&w.energy);
    }
    let mut off = OrthogonalJet::<Dim<Y>>::default();
    if annihilated.entropy {
        off.push(g, dg_v, &w.entropy);
    }
    w.of_kind(Kind::Casimir).for_each(|c| off.push(g, dg_v, c));
    let alpha =
        if annihilated.projected { off.faded_covector(0, &w.energy, CASIMIR) } else { w.energy };
    let mut pi = bracket(&alpha)?;
    if annihilated.projected {
        // The covector has been projected by terms of its own. Those of a Casimir that fades out are not
        // amplified: such a bound would stop Newton's method where energy and entropy still gain digits.
        pi.terms += pi.tensor.abs() * off.terms_of_covector(0, &w.energy.value, CASIMIR);
        pi.terms += off.terms_of_vector(0, &pi.a.value, CASIMIR);
        pi.a = off.faded_vector(0, &pi.a, CASIMIR);
    }
    if annihilated.momenta {
        off.push(g, dg_v, &w.energy);
        let first = off.len();
        w.of_kind(Kind::Momentum).for_each(|j| off.push(g, dg_v, j));
        let amplification = 1.0 + off.amplification(first, MOMENTUM);
        pi.terms += off.terms_of_vector(first, &pi.a.value, MOMENTUM) * amplification;
        pi.a = off.faded_vector(first, &pi.a, MOMENTUM);
    }
    Ok(pi)
}
