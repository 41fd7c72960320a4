//! The velocity of a system for given covectors.
//!
//! ```math
//! v = \tilde\Pi\, w_H + \tilde K_{w_H} w_S
//! ```
//!
//! With the differentials of the fields it is the equation of motion; with their discrete gradients
//! along a step it is the scheme, which then keeps what the equation keeps:
//!
//! - `Π̃ = P Π Pᵀ`, where `Pᵀ` takes the discrete gradients of the entropy and of the further
//!   Casimirs out of a covector. It is skew and annihilates them, so `⟨w_H, Π̃w_H⟩ = 0` and
//!   `⟨w_S, Π̃w_H⟩ = 0` to round-off; and it differs from `Π` by `O(h²)`, *because* `Π` annihilates their
//!   differentials. A bracket that is built from the covector of its Casimir
//!   ([`Bracket::annihilates_entropy`]) needs no `P` for it. Where a Casimir's covector depends on those
//!   before it, its projection fades out of `P` and of `Pᵀ` with the same weight. So `Π̃` stays skew and
//!   conserves the energy. The entropy comes first and has full weight.
//! - A momentum `J` must not enter `P`, which would change the flow: `Π dJ ≠ 0`. With
//!   `a = Π̃w_H`, the number `⟨w_J, a⟩` is `O(h²)`; it is taken out of `a` along the vector `♯n`, where
//!   `n` is the part of `w_J` orthogonal to all that `a` annihilates already. Near a relative equilibrium, where
//!   `n` vanishes, this fades out ([`Orthogonal::faded_vector`]).
//! - `K̃_w = Q K_w Qᵀ`, where `Q` takes out the parts of the further invariants orthogonal to `w_H`: it
//!   is symmetric and positive semidefinite, and annihilates `w_H` and all of them. For the dissipation of
//!   the metric this is `κ G*(Pα, Pβ)` with `κ = G*(w_H, w_H)` and `P = 1 − C^{ab} L_b ⊗ L_a` (Bloch,
//!   Farré Puiggalí, Martín de Diego 2024, remark in §2.2).
//! - A force adds `f = ad*_{w_H} 𝓕(w_H)`, with `⟨w_H, f⟩ = 0` and `⟨w_S, f⟩ = ⟨𝓕(w_H), [w_H, w_S]⟩`. Where it
//!   conserves a further invariant, `⟨w_L, f⟩` is `O(h²)`, and is taken out of `f` as out of `a` above,
//!   without a change of the two numbers.

use std::fmt::Debug;

use metriplectic_fields::{
    ChartPoint, Column, Dimension, Matrix, Scalar, ScalarField, Space, Square, Vector,
    along_slopes, differential,
};
use metriplectic_manifolds::{InnerProduct, MetricError, Riemannian};

use crate::invariants::{Invariants, Kind, Visitor};
use crate::orthogonal::{Orthogonal, OrthogonalJet, WithJacobian};
use crate::system::{Metriplectic, SecondLaw};
use crate::{Bracket, Dissipation};

/// The independent fraction `σ = μ` of a Casimir's covector at which its projection in `Π̃` has half its weight,
/// `1/(1 + (μ/σ)⁴)`.
///
/// Where the Casimir depends on the entropy or on the Casimirs before it, `σ = 0`, the projection jumps. A
/// discrete gradient differs from a differential by `O(h²)`, so a fraction below that is an error of the
/// discretisation: its direction is arbitrary, and the equation of a step is then stiff in it. `μ = 10⁻⁶` is
/// too small for the quartic Casimir of so(5)* at `h = 0.2`. Without its projection a Casimir changes by
/// less than `μ|dC||v|` per unit of time.
const CASIMIR: f64 = 1e-4;

/// The same for a momentum. Near a relative equilibrium it is a function of the other fields to first order,
/// so a step that conserves these changes it by no more than the order of `h³σ`.
const MOMENTUM: f64 = 1e-6;

/// The dimension of the manifold of a system.
type Dim<Y> = <<Y as Metriplectic>::Manifold as Space>::Dim;

/// A point of a system in a chart, at a scalar.
type Place<Y, D> = ChartPoint<<Y as Metriplectic>::Manifold, D>;

/// Components of a vector or covector of a system, at a scalar.
type Components<Y, D> = Vector<<Y as Metriplectic>::Manifold, D>;

/// A way to make a covector of a field: its differential at a point, or a discrete gradient.
pub trait Gradient<M: Space> {
    /// Components, with their derivatives or without.
    type Covector: Copy + Debug + Send + Sync;

    /// The covector of one field.
    fn of(&mut self, f: &impl ScalarField<M>) -> Self::Covector;
}

/// One covector for each field of a system.
#[derive(Clone, Copy, Debug)]
pub struct Covectors<N: Dimension, V: Copy + Debug + Send + Sync> {
    /// That of the energy, `w_H`.
    pub energy: V,
    /// That of the entropy, `w_S`; zero without one.
    pub entropy: V,
    /// Those of the further invariants, in their order.
    pub invariants: N::Array<Option<(Kind, V)>>,
}

impl<N: Dimension, V: Copy + Debug + Send + Sync> Covectors<N, V> {
    /// Those of energy and entropy, and the ones that `gradient` makes of the further `invariants`.
    #[inline]
    pub fn new<M: Space<Dim = N>, W: Gradient<M, Covector = V>>(
        [energy, entropy]: [V; 2],
        invariants: &impl Invariants<M>,
        gradient: &mut W,
    ) -> Self {
        let mut collected = Collected { gradient, covectors: N::array(|_| None), len: 0 };
        invariants.each(&mut collected);
        Self { energy, entropy, invariants: collected.covectors }
    }

    /// Those of the further invariants of one kind.
    #[inline]
    pub fn of_kind(&self, kind: Kind) -> impl Iterator<Item = &V> {
        let listed = self.invariants.as_ref().iter().flatten();
        listed.filter_map(move |(k, w)| (*k == kind).then_some(w))
    }

    /// Whether there are further invariants of one kind.
    #[inline]
    pub fn has(&self, kind: Kind) -> bool {
        self.of_kind(kind).next().is_some()
    }
}

/// The covectors of the invariants seen so far.
struct Collected<'a, M: Space, W: Gradient<M>> {
    gradient: &'a mut W,
    covectors: <M::Dim as Dimension>::Array<Option<(Kind, W::Covector)>>,
    len: usize,
}

impl<M: Space, W: Gradient<M>> Visitor<M> for Collected<'_, M, W> {
    #[inline]
    fn visit(&mut self, kind: Kind, f: &impl ScalarField<M>) {
        self.covectors[self.len] = Some((kind, self.gradient.of(f)));
        self.len += 1;
    }
}

/// Differentials at a point.
#[derive(Debug)]
pub struct Differentials<'a, M: Space, D: Scalar>(pub &'a ChartPoint<M, D>);

impl<M: Space, D: Scalar> Gradient<M> for Differentials<'_, M, D> {
    type Covector = Vector<M, D>;

    fn of(&mut self, f: &impl ScalarField<M>) -> Vector<M, D> {
        differential(f, self.0)
    }
}

/// The differentials of all fields of a system at a point.
pub fn differentials<Y: Metriplectic + ?Sized, D: Scalar>(
    system: &Y,
    x: &Place<Y, D>,
) -> Covectors<Dim<Y>, Components<Y, D>> {
    let mut d = Differentials(x);
    let laws = [d.of(system.energy()), d.of(system.entropy())];
    Covectors::new(laws, system.invariants(), &mut d)
}

/// Which covectors the bracket is made to annihilate.
struct ProjectionPlan {
    /// The entropy's.
    entropy: bool,
    /// Whether the bracket has to be projected off them, and off those of the Casimirs.
    projected: bool,
    /// Whether there are momenta.
    momenta: bool,
}

impl ProjectionPlan {
    #[inline]
    fn of<Y, V>(system: &Y, w: &Covectors<Dim<Y>, V>) -> Self
    where
        Y: Metriplectic + ?Sized,
        V: Copy + Debug + Send + Sync,
    {
        let entropy = system.second_law() == SecondLaw::Exact;
        let moves = !system.bracket().is_zero();
        let already = system.bracket().annihilates_entropy();
        let projected = moves && (entropy && !already || w.has(Kind::Casimir));
        Self { entropy, projected, momenta: moves && w.has(Kind::Momentum) }
    }
}

/// The vector `Π̃ w_H`.
///
/// # Errors
///
/// [`MetricError`] if the metric cannot be used at `x`.
#[inline]
pub fn reversible<Y: Metriplectic + ?Sized, D: Scalar>(
    system: &Y,
    x: &Place<Y, D>,
    w: &Covectors<Dim<Y>, Components<Y, D>>,
) -> Result<Components<Y, D>, MetricError> {
    let annihilated = ProjectionPlan::of(system, w);
    let bracket = |alpha: &_| system.bracket().apply(&system.bracket_args(x, &w.entropy), alpha);
    if !annihilated.projected && !annihilated.momenta {
        return bracket(&w.energy);
    }
    let g = system.metric().at(x)?;
    if Y::Invariants::COUNT == 0 {
        // The entropy alone: the same projections, without a list.
        let w_hat = g.orthonormal(&w.entropy);
        let square = w_hat.dot(&w_hat);
        if square.re() > 0.0 {
            let (sharp, fraction) = (g.from_orthonormal(&w_hat), square.recip());
            let alpha = w.energy - w.entropy * (sharp.dot(&w.energy) * fraction);
            let v = bracket(&alpha)?;
            return Ok(v - sharp * (w.entropy.dot(&v) * fraction));
        }
        return bracket(&w.energy);
    }
    let mut off = Orthogonal::<Dim<Y>, D>::default();
    if annihilated.entropy {
        off.push(&g, &w.entropy);
    }
    for c in w.of_kind(Kind::Casimir) {
        off.push(&g, c);
    }
    let mut a = if annihilated.projected {
        let alpha = off.faded_covector(0, &w.energy, CASIMIR);
        off.faded_vector(0, &bracket(&alpha)?, CASIMIR)
    } else {
        bracket(&w.energy)?
    };
    if annihilated.momenta {
        off.push(&g, &w.energy);
        let first = off.len();
        for j in w.of_kind(Kind::Momentum) {
            off.push(&g, j);
        }
        a = off.faded_vector(first, &a, MOMENTUM);
    }
    Ok(a)
}

/// The vector `K̃ w_S`, and that of a force.
///
/// # Errors
///
/// [`MetricError`] if the metric cannot be used at `x`.
#[inline]
pub fn irreversible<Y: Metriplectic + ?Sized, D: Scalar>(
    system: &Y,
    x: &Place<Y, D>,
    w: &Covectors<Dim<Y>, Components<Y, D>>,
) -> Result<Components<Y, D>, MetricError> {
    let friction = friction(system, x, w)?;
    if system.bracket().is_forced() { Ok(friction + force(system, x, w)?) } else { Ok(friction) }
}

/// The vector of the force, which conserves the further invariants.
fn force<Y: Metriplectic + ?Sized, D: Scalar>(
    system: &Y,
    x: &Place<Y, D>,
    w: &Covectors<Dim<Y>, Components<Y, D>>,
) -> Result<Components<Y, D>, MetricError> {
    let force = system.bracket().force(&system.bracket_args(x, &w.entropy), &w.energy)?;
    if Y::Invariants::COUNT == 0 {
        return Ok(force);
    }
    let (g, mut off) = (system.metric().at(x)?, Orthogonal::<Dim<Y>, D>::default());
    off.push(&g, &w.energy);
    if system.second_law() == SecondLaw::Exact {
        off.push(&g, &w.entropy);
    }
    let listed = w.invariants.as_ref().iter().flatten();
    Ok(listed.fold(force, |force, (_, l)| off.without(&g, l, &force, MOMENTUM)))
}

/// The vector `K̃ w_S`.
#[inline]
fn friction<Y: Metriplectic + ?Sized, D: Scalar>(
    system: &Y,
    x: &Place<Y, D>,
    w: &Covectors<Dim<Y>, Components<Y, D>>,
) -> Result<Components<Y, D>, MetricError> {
    let k = |alpha: &_| system.dissipation().apply(system.metric(), x, &w.energy, alpha);
    if Y::Invariants::COUNT == 0 {
        return k(&w.entropy);
    }
    let (off, first) = orthogonal_to_energy::<Y, D>(&system.metric().at(x)?, w);
    Ok(off.project_vector(first, &k(&off.project_covector(first, &w.entropy))?))
}

/// The covector of the energy and the parts of the further invariants orthogonal to it, which start
/// at the index.
fn orthogonal_to_energy<Y: Metriplectic + ?Sized, D: Scalar>(
    g: &<Y::Metric as Riemannian<Y::Manifold>>::At<D>,
    w: &Covectors<Dim<Y>, Components<Y, D>>,
) -> (Orthogonal<Dim<Y>, D>, usize) {
    let mut off = Orthogonal::default();
    off.push(g, &w.energy);
    let first = off.len();
    for (_, l) in w.invariants.as_ref().iter().flatten() {
        off.push(g, l);
    }
    (off, first)
}

/// The smallest fraction of a further invariant's differential at `x` that is independent of those of
/// the other fields with which it is projected out; 1 without further invariants.
///
/// # Errors
///
/// [`MetricError`] if the metric cannot be used at `x`.
pub fn independence<Y: Metriplectic + ?Sized>(
    system: &Y,
    x: &Place<Y, f64>,
) -> Result<Vec<f64>, MetricError> {
    let (w, g) = (differentials(system, x), system.metric().at(x)?);
    let (mut casimirs, mut all) =
        (Orthogonal::<Dim<Y>>::default(), Orthogonal::<Dim<Y>>::default());
    if system.second_law() == SecondLaw::Exact && !system.bracket().is_zero() {
        casimirs.push(&g, &w.entropy);
    }
    if system.second_law() == SecondLaw::Exact {
        all.push(&g, &w.entropy);
    }
    all.push(&g, &w.energy);
    let listed = w.invariants.as_ref().iter().flatten();
    Ok(listed
        .map(|(kind, l)| {
            let among_all = all.push(&g, l);
            match kind {
                Kind::Casimir => casimirs.push(&g, l).min(among_all),
                Kind::Momentum => among_all,
            }
        })
        .collect())
}

/// For each further invariant, the smallest independent fraction of its differential at `x` in a projection
/// that a step makes: of a Casimir beside the entropy and the Casimirs before it, of a momentum beside
/// these, the energy and the momenta before it, of either beside the energy and the list before it.
///
/// [`independence`] also asks for fractions beside the entropy *and* the energy. These vanish at every
/// equilibrium and disturb no step.
///
/// # Errors
///
/// [`MetricError`] if the metric cannot be used at `x`.
pub fn projected_fractions<Y: Metriplectic + ?Sized>(
    system: &Y,
    x: &Place<Y, f64>,
) -> Result<Vec<f64>, MetricError> {
    let (w, g) = (differentials(system, x), system.metric().at(x)?);
    let mut bracket = Orthogonal::<Dim<Y>>::default();
    if ProjectionPlan::of(system, &w).entropy {
        bracket.push(&g, &w.entropy);
    }
    let casimirs: Vec<f64> = w.of_kind(Kind::Casimir).map(|c| bracket.push(&g, c)).collect();
    bracket.push(&g, &w.energy);
    let momenta: Vec<f64> = w.of_kind(Kind::Momentum).map(|j| bracket.push(&g, j)).collect();
    let (mut casimirs, mut momenta) = (casimirs.into_iter(), momenta.into_iter());

    let mut friction = Orthogonal::<Dim<Y>>::default();
    friction.push(&g, &w.energy);
    let listed = w.invariants.as_ref().iter().flatten();
    Ok(listed
        .map(|(kind, l)| {
            let in_bracket = match kind {
                Kind::Casimir => casimirs.next(),
                Kind::Momentum => momenta.next(),
            };
            let in_friction = friction.push(&g, l);
            in_bracket.map_or(in_friction, |fraction| fraction.min(in_friction))
        })
        .collect())
}

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
