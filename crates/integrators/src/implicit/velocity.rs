//! The velocity `Π̃ w_H + K̃ w_S` of a model for given covectors, as in [`metriplectic_dynamics::velocity`], whose formulas they are,
//! with its derivatives along the unknown of a step.

use std::ops::Range;

use metriplectic_dynamics::invariants::Kind;
use metriplectic_dynamics::velocity::{CASIMIR, MOMENTUM};
use metriplectic_equations::Part;

use super::algebra::{FEW, Matrix, add, dot, vector};
use super::metric::{MetricAlong, Units};
use super::orthogonal::{Of, Orthogonal, OrthogonalJet, scaled};
use super::parts::{OfLaws, PartJet, Parts, WithJacobian};
use crate::numbers::{Lengths, List};

impl<L: Lengths> Parts<'_, L> {
    fn has(&self, kind: Kind) -> bool {
        self.kinds.contains(&kind)
    }

    /// Returns whether the bracket is projected off the entropy and the Casimirs.
    fn is_projected(&self) -> bool {
        self.moves && (self.is_exact && !self.annihilates_entropy || self.has(Kind::Casimir))
    }

    /// The covectors of one kind.
    fn of_kind<'b, V>(&'b self, kind: Kind, w: &'b OfLaws<V>) -> impl Iterator<Item = &'b V> {
        let listed = self.kinds.iter().zip(&w.invariants);
        listed.filter_map(move |(k, w)| (*k == kind).then_some(w))
    }

    /// Computes the vector `Π̃ w_H`; `None` where it has no value.
    #[inline]
    pub(super) fn reversible(
        &self,
        (z, g): (&L::State, Units<'_, L>),
        w: &OfLaws<L::Vector>,
    ) -> Option<L::Vector> {
        if !self.moves {
            return Some(self.zero());
        }
        let OfLaws { energy, entropy, .. } = w;
        let bracket = |alpha: &L::Vector| self.apply(Part::Reversible, z, [alpha, entropy, alpha]);
        let (is_projected, has_momenta) = (self.is_projected(), self.has(Kind::Momentum));
        if !is_projected && !has_momenta {
            return bracket(energy);
        }
        if self.kinds.is_empty() && matches!(g, Units::Canonical) {
            // With the entropy alone, the same projections need no list.
            let square = dot(entropy, entropy);
            if square > 0.0 {
                let fraction = square.recip();
                let mut alpha = energy.clone();
                add(&mut alpha, -(dot(entropy, energy) * fraction), entropy);
                let mut v = bracket(&alpha)?;
                let along = dot(entropy, &v) * fraction;
                add(&mut v, -along, entropy);
                return Some(v);
            }
            return bracket(energy);
        }
        let mut normals = Orthogonal::none();
        if self.is_exact {
            normals.push(g, entropy);
        }
        self.of_kind(Kind::Casimir, w).for_each(|c| normals.push(g, c));
        let mut a = if is_projected {
            let alpha = normals.faded_covector(0, energy, CASIMIR);
            normals.faded_vector(0, &bracket(&alpha)?, CASIMIR)
        } else {
            bracket(energy)?
        };
        if has_momenta {
            normals.push(g, energy);
            let first = normals.len();
            self.of_kind(Kind::Momentum, w).for_each(|j| normals.push(g, j));
            a = normals.faded_vector(first, &a, MOMENTUM);
        }
        Some(a)
    }

    /// Computes the vector `K̃ w_S`, and adds the vector of a force; `None` where it has no value.
    #[inline]
    pub(super) fn irreversible(
        &self,
        at: (&L::State, Units<'_, L>),
        w: &OfLaws<L::Vector>,
    ) -> Option<L::Vector> {
        let mut v = self.friction(at, w)?;
        if self.is_forced {
            add(&mut v, 1.0, &self.force(at, w)?);
        }
        Some(v)
    }

    fn force(&self, (z, g): (&L::State, Units<'_, L>), w: &OfLaws<L::Vector>) -> Option<L::Vector> {
        let force = self.apply(Part::Gyroscopic, z, [&w.energy, &w.entropy, &w.energy])?;
        if self.kinds.is_empty() {
            return Some(force);
        }
        let mut normals = Orthogonal::none();
        normals.push(g, &w.energy);
        if self.is_exact {
            normals.push(g, &w.entropy);
        }
        let listed = w.invariants.iter();
        Some(listed.fold(force, |force, l| normals.without(g, l, force, MOMENTUM)))
    }

    #[inline]
    fn friction(
        &self,
        (z, g): (&L::State, Units<'_, L>),
        w: &OfLaws<L::Vector>,
    ) -> Option<L::Vector> {
        if !self.rubs {
            return Some(self.zero());
        }
        let OfLaws { energy, entropy, .. } = w;
        let k = |alpha: &L::Vector| self.apply(Part::Irreversible, z, [energy, entropy, alpha]);
        if self.kinds.is_empty() {
            return k(entropy);
        }
        let mut normals = Orthogonal::none();
        normals.push(g, energy);
        let first = normals.len();
        w.invariants.iter().for_each(|l| normals.push(g, l));
        Some(normals.project_vector(first, &k(&normals.project_covector(first, entropy))?))
    }
}

/// The velocity with its derivatives along the unknown of a step.
pub(crate) struct VelocityJet<L: Lengths> {
    /// The velocity, and its derivatives.
    pub(crate) velocity: WithJacobian<L>,
    /// The sum of the absolute terms of each component. Its round-off is relative to this sum.
    pub(crate) terms: L::Vector,
    /// The derivative of the velocity along `w_H`, without the derivative of the projections.
    pub(crate) sensitivity: Matrix<L>,
    /// The entropy production `⟨w_S, K̃ w_S⟩`.
    pub(crate) production: f64,
    /// The rate of the friction, `√|tr A²|` with `A` the derivative of `K̃ w_S` along the unknown.
    pub(crate) friction: f64,
    /// The rate of `Π̃ w_H`.
    pub(crate) rotation: f64,
    /// The part `K̃ w_S` with the vector of a force, if there is one.
    pub(crate) irreversible: Option<WithJacobian<L>>,
}

/// A part of the velocity.
struct OfPart<L: Lengths> {
    /// The part, and its derivatives.
    vector: WithJacobian<L>,
    /// Its derivative along the covector that it acts on.
    tensor: Matrix<L>,
    /// Its derivative along the other covector that it depends on.
    along_w: Matrix<L>,
    /// The absolute terms that it is summed of.
    terms: L::Vector,
}

/// `|A| |v|`.
fn terms<L: Lengths>(a: &Matrix<L>, v: &L::Vector) -> L::Vector {
    let n = v.numbers().len();
    if n > FEW {
        return a.abs_times(&vector(n, |j| v[j].abs()));
    }
    let mut sum = L::Vector::room(|| n);
    for i in 0..n {
        sum[i] = (0..n).fold(0.0, |sum, j| sum + a[(i, j)].abs() * v[j].abs());
    }
    sum
}

/// The derivative of a point along the unknown of a step.
pub(crate) enum Turn<'a, L: Lengths> {
    /// A multiple of the identity.
    Scaled(f64),
    /// This matrix.
    By(&'a Matrix<L>),
}

// By hand, because lengths have none.
impl<L: Lengths> Clone for Turn<'_, L> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<L: Lengths> Copy for Turn<'_, L> {}

impl<L: Lengths> Turn<'_, L> {
    /// The derivatives `A ∂z` of a function with the derivatives `A`.
    #[inline]
    pub(super) fn after(self, a: Matrix<L>) -> Matrix<L> {
        match self {
            Self::Scaled(c) => scaled(a, c),
            Self::By(dz) => a.product(dz),
        }
    }
}

/// Where the velocity of a system is linearised, along the unknown of a step.
struct Linearisation<'a, L: Lengths> {
    parts: &'a Parts<'a, L>,
    z: &'a L::State,
    /// The derivative of the point.
    dz: Turn<'a, L>,
    /// The metric there, if it is not the canonical one.
    metric: Option<&'a MetricAlong<'a, L>>,
    w: &'a OfLaws<WithJacobian<L>>,
    /// Says whether the derivatives of a friction along the covector of the entropy are asked for, which Newton's method leaves out.
    is_whole: bool,
    /// The parameters that the columns stand for, if they are no directions.
    parameters: Range<usize>,
}

impl<L: Lengths> Linearisation<'_, L> {
    /// A part with its derivatives along the unknown, for the covector `alpha`, and the `other` one that it depends on.
    fn part(
        &self,
        part: Part,
        alpha: &WithJacobian<L>,
        other: &WithJacobian<L>,
    ) -> Option<OfPart<L>> {
        let OfLaws { energy, entropy, .. } = self.w;
        let w = [&energy.value, &entropy.value, &alpha.value];
        let PartJet { value, along_x, along_w, tensor } = self.parts.linearise(part, self.z, w)?;
        let mut slope = self.dz.after(along_x);
        slope.add(1.0, &other.before(&along_w));
        slope.add(1.0, &alpha.before(&tensor));
        if self.is_whole
            && part == Part::Irreversible
            && let Some(along_entropy) = self.parts.friction_along_entropy(self.z, w)?
        {
            slope.add(1.0, &along_entropy.product(&entropy.slope));
        }
        if !self.parameters.is_empty() {
            slope.add(1.0, &self.parts.along_parameters(part, self.z, w, &self.parameters)?);
        }
        let terms = terms(&tensor, &alpha.value);
        let vector = WithJacobian::new(value, slope);
        Some(OfPart { vector, tensor, along_w, terms })
    }

    /// A part that is zero.
    fn none(&self) -> OfPart<L> {
        let zeros = || self.parts.zeros();
        let vector = WithJacobian::new(self.parts.zero(), zeros());
        OfPart { vector, tensor: zeros(), along_w: zeros(), terms: self.parts.zero() }
    }

    /// `Π w_H` without a projection, as it is written by hand.
    fn written(&self) -> Option<OfPart<L>> {
        let &Self { parts, w, .. } = self;
        if !parts.moves {
            return Some(self.none());
        }
        self.part(Part::Reversible, &w.energy, &w.entropy)
    }

    fn reversible(&self) -> Option<OfPart<L>> {
        let &Self { parts, w, metric, .. } = self;
        if !parts.moves {
            return Some(self.none());
        }
        let bracket = |alpha: &WithJacobian<L>| self.part(Part::Reversible, alpha, &w.entropy);
        let (is_projected, has_momenta) = (parts.is_projected(), parts.has(Kind::Momentum));
        if !is_projected && !has_momenta {
            return bracket(&w.energy);
        }
        let mut normals = OrthogonalJet::none();
        if parts.is_exact {
            normals.push_in(metric, &w.entropy);
        }
        parts.of_kind(Kind::Casimir, w).for_each(|c| normals.push_in(metric, c));
        let mut pi = if is_projected {
            bracket(&normals.faded(0, (w.energy.clone(), Of::Covector), CASIMIR))?
        } else {
            bracket(&w.energy)?
        };
        if is_projected {
            // The projection of the covector has its own terms. Those of a Casimir that fades out are not amplified: such a
            // bound would stop Newton's method where energy and entropy still gain digits.
            let mut of_covector = parts.zero();
            let energy = (&w.energy.value, Of::Covector);
            normals.add_terms(0, energy, CASIMIR, (&mut of_covector, 1.0));
            add(&mut pi.terms, 1.0, &terms(&pi.tensor, &of_covector));
            let v = (&pi.vector.value, Of::Vector);
            normals.add_terms(0, v, CASIMIR, (&mut pi.terms, 1.0));
            pi.vector = normals.faded(0, (pi.vector, Of::Vector), CASIMIR);
        }
        if has_momenta {
            normals.push_in(metric, &w.energy);
            let first = normals.len();
            parts.of_kind(Kind::Momentum, w).for_each(|j| normals.push_in(metric, j));
            let amplification = 1.0 + normals.amplification(first, MOMENTUM);
            let v = (&pi.vector.value, Of::Vector);
            normals.add_terms(first, v, MOMENTUM, (&mut pi.terms, amplification));
            pi.vector = normals.faded(first, (pi.vector, Of::Vector), MOMENTUM);
        }
        Some(pi)
    }

    fn force(&self) -> Option<OfPart<L>> {
        let &Self { parts, w, metric, .. } = self;
        let mut force = self.part(Part::Gyroscopic, &w.energy, &w.entropy)?;
        if parts.kinds.is_empty() {
            return Some(force);
        }
        let mut normals = OrthogonalJet::none();
        normals.push_in(metric, &w.energy);
        if parts.is_exact {
            normals.push_in(metric, &w.entropy);
        }
        let (first, value) = (normals.len(), force.vector.value.clone());
        let listed = w.invariants.iter();
        force.vector = listed.fold(force.vector, |v, l| normals.without(metric, l, v, MOMENTUM));
        let amplification = 1.0 + normals.amplification(first, MOMENTUM);
        let v = (&value, Of::Vector);
        normals.add_terms(first, v, MOMENTUM, (&mut force.terms, amplification));
        Some(force)
    }
}

/// Computes the velocity at a point, with the derivatives along the unknown of a step, from those of the covectors and of the point;
/// `None` where it has no value. They are those of Newton's method, which leaves out that of a
/// friction along the covector of the entropy.
pub(super) fn velocity_jet<L: Lengths>(
    parts: &Parts<'_, L>,
    (z, dz, metric): (&L::State, Turn<'_, L>, Option<&MetricAlong<'_, L>>),
    w: &OfLaws<WithJacobian<L>>,
) -> Option<VelocityJet<L>> {
    Linearisation { parts, z, dz, metric, w, is_whole: false, parameters: 0..0 }.velocity()
}

/// The columns of whole derivatives on a vector space with the canonical metric.
#[derive(Clone, Debug)]
pub(crate) enum Columns {
    /// The directions of an unknown, along which the point moves by this multiple of it.
    Directions(f64),
    /// These parameters, no more of them than directions. The point stays where it is.
    Parameters(Range<usize>),
}

/// A linearisation with all derivatives, on a vector space with the canonical metric.
fn whole<'a, L: Lengths>(
    parts: &'a Parts<'_, L>,
    z: &'a L::State,
    columns: Columns,
    w: &'a OfLaws<WithJacobian<L>>,
) -> Linearisation<'a, L> {
    let (dz, parameters) = match columns {
        Columns::Directions(dz) => (dz, 0..0),
        Columns::Parameters(parameters) => (0.0, parameters),
    };
    let dz = Turn::Scaled(dz);
    Linearisation { parts, z, dz, metric: None, w, is_whole: true, parameters }
}

/// Computes [`velocity_jet`] with all derivatives, on a vector space with the canonical metric.
pub(crate) fn whole_velocity_jet<L: Lengths>(
    parts: &Parts<'_, L>,
    z: &L::State,
    columns: Columns,
    w: &OfLaws<WithJacobian<L>>,
) -> Option<VelocityJet<L>> {
    whole(parts, z, columns, w).velocity()
}

/// Computes the velocity `Π dH + f(dH) + K dS` at a state, as it is written by hand, with all derivatives.
pub(super) fn written_velocity_jet<L: Lengths>(
    parts: &Parts<'_, L>,
    z: &L::State,
    columns: Columns,
    w: &OfLaws<WithJacobian<L>>,
) -> Option<VelocityJet<L>> {
    let at = whole(parts, z, columns, w);
    at.with_reversible(at.written()?)
}

/// Computes the part `Π̃ w_H` of a [velocity](whole_velocity_jet).
pub(crate) fn reversible_jet<L: Lengths>(
    parts: &Parts<'_, L>,
    z: &L::State,
    columns: Columns,
    w: &OfLaws<WithJacobian<L>>,
) -> Option<WithJacobian<L>> {
    Some(whole(parts, z, columns, w).reversible()?.vector)
}

impl<L: Lengths> Linearisation<'_, L> {
    fn velocity(&self) -> Option<VelocityJet<L>> {
        self.with_reversible(self.reversible()?)
    }

    /// The velocity with this reversible part.
    fn with_reversible(&self, pi: OfPart<L>) -> Option<VelocityJet<L>> {
        let &Self { parts, w, metric, .. } = self;
        let mut normals = OrthogonalJet::none();
        let (mut first, mut alpha) = (0, None);
        if !parts.kinds.is_empty() {
            normals.push_in(metric, &w.energy);
            first = normals.len();
            w.invariants.iter().for_each(|l| normals.push_in(metric, l));
            alpha = Some(normals.covector(first, w.entropy.clone()));
        }
        let alpha = alpha.as_ref().unwrap_or(&w.entropy);
        let rotation = pi.vector.slope.trace_of_square().abs().sqrt();
        let (mut sum, mut terms, mut sensitivity) = (pi.vector, pi.terms, pi.tensor);
        let mut irreversible = None;
        if parts.rubs {
            let k = self.part(Part::Irreversible, alpha, &w.energy)?;
            let amplified = 1.0 + normals.amplification(first, MOMENTUM);
            add(&mut terms, 1.0, &k.terms);
            let v = (&k.vector.value, Of::Vector);
            normals.add_terms(first, v, MOMENTUM, (&mut terms, amplified));
            sensitivity.add(1.0, &k.along_w);
            irreversible = Some(normals.vector(first, k.vector));
        }
        if parts.is_forced {
            let force = self.force()?;
            add(&mut terms, 1.0, &force.terms);
            sensitivity.add(1.0, &force.tensor);
            irreversible = Some(match irreversible {
                Some(mut sum) => {
                    add(&mut sum.value, 1.0, &force.vector.value);
                    sum.slope.add(1.0, &force.vector.slope);
                    sum
                }
                None => force.vector,
            });
        }
        let (mut production, mut friction) = (0.0, 0.0);
        if let Some(irreversible) = &irreversible {
            production = dot(&w.entropy.value, &irreversible.value);
            friction = irreversible.slope.trace_of_square().abs().sqrt();
            add(&mut sum.value, 1.0, &irreversible.value);
            sum.slope.add(1.0, &irreversible.slope);
        }
        Some(VelocityJet {
            velocity: sum,
            terms,
            sensitivity,
            production,
            friction,
            rotation,
            irreversible,
        })
    }
}
