//! A state in plain numbers is moved onto its laws, by Newton's method along their differentials.
//!
//! It is the projection of [typed systems](crate::system), in a text that knows no type of a system.

use metriplectic_equations::{ENERGY, ENTROPY, Equations, SecondLaw};
use metriplectic_fields::{length, power_of_two};

use smallvec::SmallVec;

use super::lengths::{Lengths, List};
use super::rows::Rows;
use crate::explicit::{Limit, ProjectionError};
use crate::round_off::bound::{INDEPENDENT, NO_DIGITS};
use crate::step::{Laws, Vector};
use crate::system::{CONSERVED, CORRECTIONS, OFF, STAGNATED};

/// Where a state is to go, as [`Target`](crate::explicit::Target) says.
pub(super) struct Aim<'a, L: Lengths> {
    pub(super) laws: &'a Laws<L::Invariants>,
    pub(super) with_entropy: bool,
    pub(super) limit: Option<Limit<'a, L::Vector>>,
    pub(super) units: Option<&'a L::Vector>,
}

impl<L: Lengths> Aim<'_, L> {
    /// The value of a law.
    fn of(&self, law: usize) -> f64 {
        match law {
            ENERGY => self.laws.energy,
            ENTROPY => self.laws.entropy,
            _ => self.laws.invariants[law - ENTROPY - 1],
        }
    }
}

/// A state on its laws.
#[derive(Clone, Debug)]
pub(super) struct Landed<L: Lengths> {
    pub(super) x: L::State,
    pub(super) rows: Rows<L>,
    pub(super) entropy: f64,
    pub(super) entropy_round_off: f64,
}

/// A law made independent of those before it: by Gram and Schmidt on their differentials, with the same
/// combination of their residuals.
#[derive(Clone, Debug)]
struct Normal<V> {
    /// The components `s_i ∂_iF/f` of its differential, with the units `s` of the entries. The factor `f` is a power of
    /// two near their length, so that no square underflows.
    hat: V,
    square: f64,
    /// The target less the value, over `f`.
    residual: f64,
    /// The round-off of the residual.
    round_off: f64,
    factor: f64,
    /// Whether its differential depends on those before it.
    dependent: bool,
}

impl<V> Normal<V> {
    /// The residual in units of its round-off. What depends on other laws has their residual.
    fn excess(&self) -> f64 {
        if self.dependent || self.residual == 0.0 {
            0.0
        } else {
            self.residual.abs() / self.round_off
        }
    }
}

/// The laws at a state, made independent of each other: energy, further invariants, entropy.
struct Normals<L: Lengths> {
    energy: Normal<L::Vector>,
    invariants: SmallVec<[Normal<L::Vector>; 1]>,
    entropy: Option<Normal<L::Vector>>,
    /// The residual of the entropy in units of its round-off, whatever it depends on.
    off: f64,
}

/// A projection along the differentials `s² dF`, where `s_i` is the unit of entry `i`.
pub(super) struct Projection<'a, E: ?Sized, L: Lengths> {
    pub(super) system: &'a E,
    pub(super) target: Aim<'a, L>,
}

impl<E: Equations + ?Sized, L: Lengths> Projection<'_, E, L> {
    pub(super) fn from(&self, mut y: L::State) -> Result<Landed<L>, ProjectionError> {
        let Self { system, target } = self;
        let mut scales = L::Vector::room(|| system.sizes().directions);
        let mut moved = 0.0;
        let mut best: Option<(f64, Landed<L>)> = None;
        for _ in 0..=CORRECTIONS {
            let rows = Rows::<L>::of(*system, y.numbers());
            if !rows.is_finite() || !system.defect(y.numbers()).is_finite() {
                return Err(ProjectionError::Outside);
            }
            system.scales(y.numbers(), scales.numbers_mut());
            let units = target.units.unwrap_or(&scales);
            let normals = self.normals(&rows, &scales, units);
            let excess = normals.excess(target.with_entropy)?;
            // Two ends whose entropies are each off by less cannot differ by a fall.
            let is_off = target.with_entropy && normals.off > OFF;
            if excess <= 1.0 && !is_off {
                return Ok(normals.landed(y, rows, target));
            }
            let excess = if is_off { excess.max(normals.off / OFF) } else { excess };
            if let Some((before, better)) = best.take()
                && before <= excess
            {
                // No correction improves it.
                return self.stagnated(before, better);
            }
            if target.with_entropy && normals.is_blurred() {
                return Err(ProjectionError::NoEntropy);
            }
            let correction = normals.correction(target.with_entropy, is_off);
            moved += length(correction.numbers());
            let limit =
                target.limit.map(|limit| length(in_units(&limit.entries(), units).numbers()));
            if !moved.is_finite() || limit.is_some_and(|limit| moved > limit) {
                return Err(ProjectionError::Far);
            }
            let u = L::Vector::zip([units, &correction], |[unit, c]| unit * c);
            let pairs = u.numbers().iter().zip(scales.numbers());
            let unseen = pairs.fold(true, |all, (u, s)| all & (u.abs() <= f64::EPSILON * s));
            let mut next = L::State::room(|| y.numbers().len());
            system.chart(y.numbers(), u.numbers(), next.numbers_mut());
            let here = normals.landed(std::mem::replace(&mut y, next), rows, target);
            if unseen && excess <= CONSERVED {
                return Ok(here);
            }
            best = Some((excess, here));
        }
        match best {
            Some((excess, here)) => self.stagnated(excess, here),
            None => Err(ProjectionError::Far),
        }
    }

    /// Decides on the best state, if no correction improves it.
    fn stagnated(&self, excess: f64, best: Landed<L>) -> Result<Landed<L>, ProjectionError> {
        match self.target.with_entropy {
            _ if excess <= STAGNATED => Ok(best),
            true => Err(ProjectionError::NoEntropy),
            false if excess <= CONSERVED => Ok(best),
            false => Err(ProjectionError::Far),
        }
    }

    /// A law at a state, whatever it depends on.
    #[inline(always)]
    fn normal(
        &self,
        rows: &Rows<L>,
        law: usize,
        [scales, units]: [&L::Vector; 2],
    ) -> Normal<L::Vector> {
        let (w, value) = (rows.row(law), rows.values()[law]);
        let target = self.target.of(law);
        let mut hat = L::Vector::zip([units, &w], |[unit, w]| unit * w);
        let size = length(hat.numbers());
        // No displacement of a unit changes a law whose differential has no digits.
        let factor = if size > NO_DIGITS { power_of_two(size) } else { 1.0 };
        let into = if size > NO_DIGITS { factor.recip() } else { 0.0 };
        hat.numbers_mut().iter_mut().for_each(|hat| *hat *= into);
        let terms = 2.0 * target.abs() + sum(&w, scales, |w, scale| w.abs() * scale);
        Normal {
            square: dot(&hat, &hat),
            hat,
            residual: (target - value) / factor,
            round_off: f64::EPSILON * terms / factor + NO_DIGITS / factor,
            factor,
            dependent: false,
        }
    }

    #[inline(always)]
    fn normals(&self, rows: &Rows<L>, scales: &L::Vector, units: &L::Vector) -> Normals<L> {
        let normal = |law| self.normal(rows, law, [scales, units]);
        let energy = normal(ENERGY);
        let energy = Normal { dependent: energy.square == 0.0, ..energy };
        let invariants = SmallVec::new();
        let mut normals = Normals { energy, invariants, entropy: None, off: 0.0 };
        // A constant, so that nothing is left of the list where it is empty.
        if const { L::HAS_INVARIANTS } {
            for law in ENTROPY + 1..rows.values().len() {
                let independent = normals.independent(normal(law));
                normals.invariants.push(independent);
            }
        }
        if self.system.second_law() == SecondLaw::Exact {
            let whole = normal(ENTROPY);
            normals.off = whole.excess();
            normals.entropy = Some(normals.independent(whole));
        }
        normals
    }
}

impl<L: Lengths> Normals<L> {
    /// Visits the laws so far that are independent of each other.
    #[inline(always)]
    fn each_before(&self, mut visit: impl FnMut(&Normal<L::Vector>)) {
        if !self.energy.dependent {
            visit(&self.energy);
        }
        if const { L::HAS_INVARIANTS } {
            self.invariants.iter().filter(|normal| !normal.dependent).for_each(visit);
        }
    }

    /// Removes the part of a law that depends on those before it.
    #[inline]
    fn independent(&self, whole: Normal<L::Vector>) -> Normal<L::Vector> {
        let square = whole.square;
        let mut normal = whole;
        // The second pass removes the rounding error of the first.
        for _ in 0..2 {
            self.each_before(|before| {
                let share = dot(&before.hat, &normal.hat) / before.square;
                let pairs = normal.hat.numbers_mut().iter_mut().zip(before.hat.numbers());
                pairs.for_each(|(hat, before)| *hat -= before * share);
                normal.residual -= share * before.residual;
                normal.round_off += share.abs() * before.round_off;
            });
        }
        normal.square = dot(&normal.hat, &normal.hat);
        let independent = normal.square > INDEPENDENT * INDEPENDENT * square;
        Normal { dependent: !independent, ..normal }
    }

    /// The largest residual in units of its round-off.
    fn excess(&self, with_entropy: bool) -> Result<f64, ProjectionError> {
        let mut conserved = 0.0_f64;
        self.each_before(|normal| conserved = conserved.max(normal.excess()));
        match &self.entropy {
            Some(entropy) if with_entropy => {
                if entropy.dependent && entropy.residual.abs() > entropy.round_off {
                    return Err(ProjectionError::NoEntropy);
                }
                Ok(conserved.max(entropy.excess()))
            }
            _ => Ok(conserved),
        }
    }

    /// Returns whether the round-off of the entropy is as long as a unit.
    fn is_blurred(&self) -> bool {
        let reach = |entropy: &Normal<L::Vector>| entropy.round_off / entropy.square.sqrt();
        self.entropy.iter().any(|entropy| !entropy.dependent && reach(entropy) > 1.0)
    }

    /// The correction, in units of the entries. A residual below half its round-off is left, unless the last digits
    /// are asked for.
    fn correction(&self, with_entropy: bool, last_digits: bool) -> L::Vector {
        let least = if last_digits { 0.0 } else { 0.5 };
        let mut sum = self.energy.hat.zero();
        let mut add = |normal: &Normal<L::Vector>| {
            if normal.excess() > least {
                let factor = normal.residual / normal.square;
                let pairs = sum.numbers_mut().iter_mut().zip(normal.hat.numbers());
                pairs.for_each(|(sum, hat)| *sum += hat * factor);
            }
        };
        self.each_before(&mut add);
        match &self.entropy {
            Some(entropy) if with_entropy && !entropy.dependent => add(entropy),
            _ => {}
        }
        sum
    }

    fn landed(&self, x: L::State, rows: Rows<L>, target: &Aim<'_, L>) -> Landed<L> {
        let (residual, entropy_round_off) = self.entropy.as_ref().map_or((0.0, 0.0), |entropy| {
            (entropy.residual * entropy.factor, entropy.round_off * entropy.factor)
        });
        Landed { x, rows, entropy: target.laws.entropy - residual, entropy_round_off }
    }
}

/// The components `v_i/s_i`; those of an entry without a unit vanish.
#[inline]
fn in_units<V: Vector>(v: &V, units: &V) -> V {
    V::zip([v, units], |[v, unit]| if v == 0.0 { 0.0 } else { v / unit })
}

/// A sum over the numbers of two vectors at the same place.
#[inline]
pub(super) fn sum<V: List>(a: &V, b: &V, term: impl Fn(f64, f64) -> f64) -> f64 {
    a.numbers().iter().zip(b.numbers()).fold(0.0, |sum, (a, b)| sum + term(*a, *b))
}

#[inline]
pub(super) fn dot<V: List>(a: &V, b: &V) -> f64 {
    sum(a, b, |a, b| a * b)
}
