//! The velocity with its derivatives along the unknown of a step.

use metriplectic_fields::{Column, Dimension, Matrix, Square, Vector, along_slopes};
use metriplectic_manifolds::{MetricAt, MetricError, Riemannian};

use super::covectors::Covectors;
use super::plan::{CASIMIR, MOMENTUM, ProjectionPlan};
use crate::bracket::Bracket;
use crate::dissipation::Dissipation;
use crate::invariants::{Invariants, Kind};
use crate::metriplectic::{CountOf, Dim, Metriplectic, SecondLaw};
use crate::orthogonal::{OrthogonalJet, WithJacobian};

/// The velocity at a real point with its derivatives along the unknown of a step.
#[derive(Clone, Copy, Debug)]
pub struct VelocityJet<N: Dimension> {
    /// The velocity, and its derivatives.
    pub velocity: WithJacobian<N>,
    /// The sum of the absolute terms of each component, `Σ_j |Π_ij||w_j| + |K_ij||s_j|` and those of the
    /// projections. Its round-off is relative to this sum.
    pub terms: N::Vector<f64>,
    /// The derivative of the velocity along `w_H`, without the derivative of the projections.
    pub sensitivity: N::Matrix<f64>,
    /// The entropy production `⟨w_S, K̃ w_S⟩`.
    pub production: f64,
    /// The rate of the friction, `√|tr A²|` with `A` the derivative of `K̃ w_S` along the unknown. It is the
    /// root of the sum of the squared eigenvalues, the same number in all units.
    pub friction: f64,
    /// The terms of the derivative of `Π̃ w_H`.
    pub rotation: f64,
}

/// Computes the velocity `Π̃ w_H + K̃ w_S` at the real point `z` of the metric, the centre of its chart, with the
/// derivatives along the unknown of a step, from those of the covectors and of the point, `∂z` in the chart at `z`.
///
/// # Errors
///
/// [`MetricError`] if the metric cannot be used at `z`.
#[inline]
pub fn velocity_jet<Y: Metriplectic + ?Sized>(
    system: &Y,
    metric: &MetricAt<'_, Y::Manifold, Y::Metric>,
    dz: &Matrix<Y::Manifold>,
    w: &Covectors<CountOf<Y>, WithJacobian<Dim<Y>>>,
) -> Result<VelocityJet<Dim<Y>>, MetricError> {
    let slopes = if Y::Invariants::COUNT > 0 || ProjectionPlan::of(system, w).projected {
        metric.slopes()?.as_ref()
    } else {
        None
    };
    let dg_v = |v: &Vector<Y::Manifold>| match slopes {
        Some(slopes) => along_slopes::<Y::Manifold>(slopes, v) * *dz,
        None => Matrix::<Y::Manifold>::zeros(),
    };
    let g = metric.inner()?;
    let at = Linearisation { system, metric, dz, g, dg_v: &dg_v, w };
    let pi = at.reversible()?;

    let mut normals = OrthogonalJet::<Dim<Y>>::default();
    let mut first = 0;
    let mut alpha = w.entropy;
    if const { Y::Invariants::COUNT > 0 } {
        normals.push(g, dg_v, &w.energy);
        first = normals.len();
        w.invariants.as_ref().iter().flatten().for_each(|(_, l)| normals.push(g, dg_v, l));
        alpha = normals.project_covector(first, &alpha);
    }
    let k = system.dissipation().linearise(metric, &w.energy.value, &alpha.value)?;
    let slope = k.along_z * *dz + k.along_w * w.energy.slope + k.tensor * alpha.slope;
    let k_s = normals.project_vector(first, &WithJacobian { value: k.value, slope });
    let projection = normals.terms_of_vector(first, &k.value, MOMENTUM);
    let mut terms = pi.terms
        + k.tensor.abs() * alpha.value.abs()
        + projection * (1.0 + normals.amplification(first, MOMENTUM));
    let mut sensitivity = pi.tensor + k.along_w;
    let mut irreversible = k_s;
    if system.bracket().is_forced() {
        let force = at.force()?;
        irreversible = WithJacobian {
            value: k_s.value + force.vector.value,
            slope: k_s.slope + force.vector.slope,
        };
        terms += force.terms;
        sensitivity += force.tensor;
    }
    let velocity = WithJacobian {
        value: pi.vector.value + irreversible.value,
        slope: pi.vector.slope + irreversible.slope,
    };
    let production = w.entropy.value.dot(&irreversible.value);
    let friction = trace_of_square::<Dim<Y>>(&irreversible.slope).abs().sqrt();
    let rotation = trace_of_square::<Dim<Y>>(&pi.vector.slope).abs().sqrt();
    Ok(VelocityJet { velocity, terms, sensitivity, production, friction, rotation })
}

/// `tr A²`.
fn trace_of_square<N: Dimension>(a: &N::Matrix<f64>) -> f64 {
    (0..N::LEN).map(|i| (0..N::LEN).map(|j| a[(i, j)] * a[(j, i)]).sum::<f64>()).sum()
}

/// A part of the velocity.
struct Part<N: Dimension> {
    /// The part, and its derivatives.
    vector: WithJacobian<N>,
    /// Its derivative along `w_H`.
    tensor: N::Matrix<f64>,
    /// The absolute terms that it is summed of.
    terms: N::Vector<f64>,
}

/// Where the velocity of a system is linearised, along the unknown of a step.
struct Linearisation<'a, Y: Metriplectic + ?Sized, F> {
    system: &'a Y,
    /// The real point with the metric there.
    metric: &'a MetricAt<'a, Y::Manifold, Y::Metric>,
    /// The derivative of the point.
    dz: &'a Matrix<Y::Manifold>,
    /// The inner product there.
    g: &'a <Y::Metric as Riemannian<Y::Manifold>>::At<f64>,
    /// The derivative of `g v`, for a fixed `v`.
    dg_v: &'a F,
    /// The covectors of the fields.
    w: &'a Covectors<CountOf<Y>, WithJacobian<Dim<Y>>>,
}

impl<Y, F> Linearisation<'_, Y, F>
where
    Y: Metriplectic + ?Sized,
    F: Fn(&Vector<Y::Manifold>) -> Matrix<Y::Manifold>,
{
    /// Linearises `Π̃ w_H`.
    #[inline]
    fn reversible(&self) -> Result<Part<Dim<Y>>, MetricError> {
        let &Self { system, metric, dz, g, dg_v, w } = self;
        let annihilated = ProjectionPlan::of(system, w);
        let bracket = |alpha: &WithJacobian<Dim<Y>>| {
            let args = system.bracket_args(metric, &w.entropy.value);
            let jet = system.bracket().linearise(&args, &alpha.value)?;
            let slope =
                jet.along_z * *dz + jet.tensor * alpha.slope + jet.along_s * w.entropy.slope;
            let terms = jet.tensor.abs() * alpha.value.abs();
            let vector = WithJacobian { value: jet.value, slope };
            Ok::<_, MetricError>(Part { vector, tensor: jet.tensor, terms })
        };
        if !annihilated.projected && !annihilated.momenta {
            return bracket(&w.energy);
        }
        let mut normals = OrthogonalJet::<Dim<Y>>::default();
        if annihilated.entropy {
            normals.push(g, dg_v, &w.entropy);
        }
        w.of_kind(Kind::Casimir).for_each(|c| normals.push(g, dg_v, c));
        let alpha = if annihilated.projected {
            normals.faded_covector(0, &w.energy, CASIMIR)
        } else {
            w.energy
        };
        let mut pi = bracket(&alpha)?;
        if annihilated.projected {
            // The projection of the covector has its own terms. Those of a Casimir that fades out are not
            // amplified: such a bound would stop Newton's method where energy and entropy still gain digits.
            pi.terms += pi.tensor.abs() * normals.terms_of_covector(0, &w.energy.value, CASIMIR);
            pi.terms += normals.terms_of_vector(0, &pi.vector.value, CASIMIR);
            pi.vector = normals.faded_vector(0, &pi.vector, CASIMIR);
        }
        if annihilated.momenta {
            normals.push(g, dg_v, &w.energy);
            let first = normals.len();
            w.of_kind(Kind::Momentum).for_each(|j| normals.push(g, dg_v, j));
            let amplification = 1.0 + normals.amplification(first, MOMENTUM);
            pi.terms += normals.terms_of_vector(first, &pi.vector.value, MOMENTUM) * amplification;
            pi.vector = normals.faded_vector(first, &pi.vector, MOMENTUM);
        }
        Ok(pi)
    }

    /// Linearises the vector of a force.
    fn force(&self) -> Result<Part<Dim<Y>>, MetricError> {
        let &Self { system, metric, dz, g, dg_v, w } = self;
        let args = system.bracket_args(metric, &w.entropy.value);
        let jet = system.bracket().linearise_force(&args, &w.energy.value)?;
        let slope = jet.along_z * *dz + jet.tensor * w.energy.slope + jet.along_s * w.entropy.slope;
        let vector = WithJacobian { value: jet.value, slope };
        let terms = jet.tensor.abs() * w.energy.value.abs();
        if const { Y::Invariants::COUNT == 0 } {
            return Ok(Part { vector, tensor: jet.tensor, terms });
        }
        let mut normals = OrthogonalJet::<Dim<Y>>::default();
        normals.push(g, dg_v, &w.energy);
        if system.second_law() == SecondLaw::Exact {
            normals.push(g, dg_v, &w.entropy);
        }
        let first = normals.len();
        let listed = w.invariants.as_ref().iter().flatten();
        let vector = listed.fold(vector, |v, (_, l)| normals.without(g, dg_v, l, &v, MOMENTUM));
        let amplification = 1.0 + normals.amplification(first, MOMENTUM);
        let rounded = normals.terms_of_vector(first, &jet.value, MOMENTUM) * amplification;
        Ok(Part { vector, tensor: jet.tensor, terms: terms + rounded })
    }
}
