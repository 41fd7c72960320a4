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
//!   Casimirs out of a covector. It is skew and kills them, so `⟨w_H, Π̃w_H⟩ = 0` and
//!   `⟨w_S, Π̃w_H⟩ = 0` to round-off; and it differs from `Π` by `O(h²)`, *because* `Π` kills their
//!   differentials. A bracket that is built from the covector of its Casimir
//!   ([`Bracket::kills_its_entropy`]) needs no `P` for it.
//! - A momentum `J` must not enter `P`, which would change the flow: `Π dJ ≠ 0`. With
//!   `a = Π̃w_H`, the number `⟨w_J, a⟩` is `O(h²)`; it is taken out of `a` along the vector `♯n`, where
//!   `n` is the part of `w_J` orthogonal to all that `a` kills already. Near a relative equilibrium, where
//!   `n` vanishes, this fades out ([`Orthogonal::off_momenta`]).
//! - `K̃_w = Q K_w Qᵀ`, where `Q` takes out the parts of the further invariants orthogonal to `w_H`: it
//!   is symmetric and positive semidefinite, and kills `w_H` and all of them. For the dissipation of
//!   the metric this is `κ G*(Pα, Pβ)` with `κ = G*(w_H, w_H)` and `P = 1 − C^{ab} L_b ⊗ L_a` (Bloch,
//!   Farré Puiggalí, Martín de Diego 2024, remark in §2.2).

use std::fmt::Debug;

use metriplectic_fields::{
    ChartPoint, Column, Dimension, Matrix, Scalar, ScalarField, Space, Square, Vector,
    along_slopes, differential,
};
use metriplectic_manifolds::{InnerProduct, MetricError, Riemannian};

use crate::invariants::{Invariants, Kind, Visitor};
use crate::orthogonal::{Moving, Orthogonal, OrthogonalJet};
use crate::system::{Metriplectic, SecondLaw};
use crate::{Bracket, Dissipation};

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

/// Which covectors the bracket is made to kill.
struct Killed {
    /// The entropy's.
    entropy: bool,
    /// Whether the bracket has to be projected off them, and off those of the Casimirs.
    projected: bool,
    /// Whether there are momenta.
    momenta: bool,
}

impl Killed {
    #[inline]
    fn of<Y, V>(system: &Y, w: &Covectors<Dim<Y>, V>) -> Self
    where
        Y: Metriplectic + ?Sized,
        V: Copy + Debug + Send + Sync,
    {
        let entropy = system.second_law() == SecondLaw::Exact;
        let moves = !system.bracket().is_zero();
        let already = system.bracket().kills_its_entropy();
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
    let killed = Killed::of(system, w);
    let bracket = |alpha: &_| system.bracket().apply(&system.site(x, &w.entropy), alpha);
    if !killed.projected && !killed.momenta {
        return bracket(&w.energy);
    }
    let g = system.metric().at(x)?;
    if Y::Invariants::COUNT == 0 {
        // The entropy alone: the same projections, without a list.
        let w_hat = g.orthonormal(&w.entropy);
        let square = w_hat.dot(&w_hat);
        if square.re() > 0.0 {
            let (sharp, share) = (g.raise(&w_hat), square.recip());
            let alpha = w.energy - w.entropy * (sharp.dot(&w.energy) * share);
            let v = bracket(&alpha)?;
            return Ok(v - sharp * (w.entropy.dot(&v) * share));
        }
        return bracket(&w.energy);
    }
    let mut off = Orthogonal::<Dim<Y>, D>::default();
    if killed.entropy {
        off.push(&g, &w.entropy);
    }
    for c in w.of_kind(Kind::Casimir) {
        off.push(&g, c);
    }
    let mut a = if killed.projected {
        off.off_vector(0, &bracket(&off.off_covector(0, &w.energy))?)
    } else {
        bracket(&w.energy)?
    };
    if killed.momenta {
        off.push(&g, &w.energy);
        let first = off.len();
        for j in w.of_kind(Kind::Momentum) {
            off.push(&g, j);
        }
        a = off.off_momenta(first, &a);
    }
    Ok(a)
}

/// The vector `K̃ w_S`.
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
    let k = |alpha: &_| system.dissipation().apply(system.metric(), x, &w.energy, alpha);
    if Y::Invariants::COUNT == 0 {
        return k(&w.entropy);
    }
    let (off, first) = orthogonal_to_energy::<Y, D>(&system.metric().at(x)?, w);
    Ok(off.off_vector(first, &k(&off.off_covector(first, &w.entropy))?))
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

/// The smallest share of a further invariant's differential at `x` that is independent of those of
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

/// The velocity at a real point with its derivatives along the unknown of a step.
#[derive(Clone, Copy, Debug)]
pub struct VelocityJet<N: Dimension> {
    /// The velocity, and its derivatives.
    pub velocity: Moving<N>,
    /// The size of the terms that it is summed of.
    pub terms: f64,
    /// The size of its derivative along `w_H`.
    pub gain: f64,
    /// The size of `K̃ w_S`.
    pub irreversible: f64,
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
    w: &Covectors<Dim<Y>, Moving<Dim<Y>>>,
) -> Result<VelocityJet<Dim<Y>>, MetricError> {
    let (metric, centre) = (system.metric(), ChartPoint::<Y::Manifold>::centre(z));
    let slopes = if Y::Invariants::COUNT > 0 || Killed::of(system, w).projected {
        metric.slopes(z)
    } else {
        None
    };
    let turned = |v: &Vector<Y::Manifold>| match &slopes {
        Some(slopes) => along_slopes::<Y::Manifold>(slopes, v) * *dz,
        None => Matrix::<Y::Manifold>::zeros(),
    };
    let g = metric.at(&centre)?;
    let (pi, pi_size, pi_noise) = reversible_jet(system, &centre, (&g, &turned), dz, w)?;

    let mut off = OrthogonalJet::<Dim<Y>>::default();
    let mut first = 0;
    let mut alpha = w.entropy;
    if Y::Invariants::COUNT > 0 {
        off.push(&g, turned, &w.energy);
        first = off.len();
        w.invariants.as_ref().iter().flatten().for_each(|(_, l)| off.push(&g, turned, l));
        alpha = off.off_covector(first, &alpha);
    }
    let k = system.dissipation().linearise(metric, z, &w.energy.value, &alpha.value)?;
    let slope = k.along_z * *dz + k.along_w * w.energy.slope + k.tensor * alpha.slope;
    let k_s = off.off_vector(first, &Moving { value: k.value, slope });
    let velocity = Moving { value: pi.value + k_s.value, slope: pi.slope + k_s.slope };
    let terms = pi_size * Column::magnitude(&w.energy.value)
        + k.tensor.magnitude() * Column::magnitude(&alpha.value)
        + pi_noise
        + Column::magnitude(&k.value) * off.amplification();
    let (gain, irreversible) = (pi_size + k.along_w.magnitude(), Column::magnitude(&k_s.value));
    Ok(VelocityJet { velocity, terms, gain, irreversible })
}

/// [`reversible`] with its derivatives, the size of `Π`, and that of the terms of the projections.
#[inline]
fn reversible_jet<Y: Metriplectic + ?Sized>(
    system: &Y,
    z: &Place<Y, f64>,
    (g, turned): (
        &<Y::Metric as Riemannian<Y::Manifold>>::At<f64>,
        &impl Fn(&Vector<Y::Manifold>) -> Matrix<Y::Manifold>,
    ),
    dz: &Matrix<Y::Manifold>,
    w: &Covectors<Dim<Y>, Moving<Dim<Y>>>,
) -> Result<(Moving<Dim<Y>>, f64, f64), MetricError> {
    let killed = Killed::of(system, w);
    let bracket = |alpha: &Moving<Dim<Y>>| {
        let jet = system.bracket().linearise(&system.site(z, &w.entropy.value), &alpha.value)?;
        let slope = jet.along_z * *dz + jet.tensor * alpha.slope + jet.along_s * w.entropy.slope;
        Ok::<_, MetricError>((Moving { value: jet.value, slope }, jet.tensor.magnitude()))
    };
    if !killed.projected && !killed.momenta {
        let (a, size) = bracket(&w.energy)?;
        return Ok((a, size, 0.0));
    }
    let mut off = OrthogonalJet::<Dim<Y>>::default();
    if killed.entropy {
        off.push(g, turned, &w.entropy);
    }
    w.of_kind(Kind::Casimir).for_each(|c| off.push(g, turned, c));
    let alpha = if killed.projected { off.off_covector(0, &w.energy) } else { w.energy };
    let (mut a, size) = bracket(&alpha)?;
    if killed.projected {
        a = off.off_vector(0, &a);
    }
    if killed.momenta {
        off.push(g, turned, &w.energy);
        let first = off.len();
        w.of_kind(Kind::Momentum).for_each(|j| off.push(g, turned, j));
        a = off.off_momenta(first, &a);
    }
    let noise = Column::magnitude(&a.value) * off.amplification();
    Ok((a, size, noise))
}
