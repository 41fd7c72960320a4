//! A state in plain numbers is moved onto its laws, by Newton's method along their differentials.
//!
//! It is the projection of [typed systems](crate::system), in a text that knows no type of a system.

use metriplectic_equations::{ENERGY, ENTROPY, Equations, SecondLaw};
use metriplectic_fields::{length, power_of_two};

use super::rows::Rows;
use crate::explicit::{Limit, ProjectionError};
use crate::round_off::bound::{INDEPENDENT, NO_DIGITS};
use crate::step::Laws;
use crate::system::{CONSERVED, CORRECTIONS, OFF, STAGNATED};

/// Where a state is to go, as [`Target`](crate::explicit::Target) says.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aim<'a> {
    pub(super) laws: &'a Laws<Vec<f64>>,
    pub(super) with_entropy: bool,
    pub(super) limit: Option<Limit<'a, Vec<f64>>>,
    pub(super) units: Option<&'a Vec<f64>>,
}

impl Aim<'_> {
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
pub(super) struct Landed {
    pub(super) x: Vec<f64>,
    pub(super) rows: Rows,
    pub(super) entropy: f64,
    pub(super) entropy_round_off: f64,
}

/// A law made independent of those before it: by Gram and Schmidt on their differentials, with the same
/// combination of their residuals.
#[derive(Clone, Debug)]
struct Normal {
    /// The components `s_i ∂_iF/f` of its differential, with the units `s` of the entries. The factor `f` is a power of
    /// two near their length, so that no square underflows.
    hat: Vec<f64>,
    square: f64,
    /// The target less the value, over `f`.
    residual: f64,
    /// The round-off of the residual.
    round_off: f64,
    factor: f64,
    /// Whether its differential depends on those before it.
    dependent: bool,
}

impl Normal {
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
struct Normals {
    conserved: Vec<Normal>,
    entropy: Option<Normal>,
    /// The residual of the entropy in units of its round-off, whatever it depends on.
    off: f64,
}

/// A projection along the differentials `s² dF`, where `s_i` is the unit of entry `i`.
pub(super) struct Projection<'a, S: ?Sized> {
    pub(super) system: &'a S,
    pub(super) target: Aim<'a>,
}

impl<S: Equations + ?Sized> Projection<'_, S> {
    pub(super) fn from(&self, mut y: Vec<f64>) -> Result<Landed, ProjectionError> {
        let Self { system, target } = self;
        let mut scales = vec![0.0; system.sizes().directions];
        let mut moved = 0.0;
        let mut best: Option<(f64, Landed)> = None;
        for _ in 0..=CORRECTIONS {
            let rows = Rows::of(*system, &y);
            if !rows.is_finite() || !system.defect(&y).is_finite() {
                return Err(ProjectionError::Outside);
            }
            system.scales(&y, &mut scales);
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
            moved += length(&correction);
            let limit = target.limit.map(|limit| length(&in_units(&limit.entries(), units)));
            if !moved.is_finite() || limit.is_some_and(|limit| moved > limit) {
                return Err(ProjectionError::Far);
            }
            let u: Vec<f64> = units.iter().zip(&correction).map(|(unit, c)| unit * c).collect();
            let unseen = u.iter().zip(&scales).all(|(u, s)| u.abs() <= f64::EPSILON * s);
            let mut next = vec![0.0; y.len()];
            system.chart(&y, &u, &mut next);
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
    fn stagnated(&self, excess: f64, best: Landed) -> Result<Landed, ProjectionError> {
        match self.target.with_entropy {
            _ if excess <= STAGNATED => Ok(best),
            true => Err(ProjectionError::NoEntropy),
            false if excess <= CONSERVED => Ok(best),
            false => Err(ProjectionError::Far),
        }
    }

    fn normals(&self, rows: &Rows, scales: &[f64], units: &[f64]) -> Normals {
        let normal = |law: usize| {
            let (w, value) = (rows.row(law), rows.values[law]);
            let target = self.target.of(law);
            let mut hat: Vec<f64> = units.iter().zip(w).map(|(unit, w)| unit * w).collect();
            let size = length(&hat);
            // No displacement of a unit changes a law whose differential has no digits.
            let factor = if size > NO_DIGITS { power_of_two(size) } else { 1.0 };
            let into = if size > NO_DIGITS { factor.recip() } else { 0.0 };
            hat.iter_mut().for_each(|hat| *hat *= into);
            let terms: f64 = w.iter().zip(scales).map(|(w, scale)| w.abs() * scale).sum();
            let terms = 2.0 * target.abs() + terms;
            Normal {
                square: dot(&hat, &hat),
                hat,
                residual: (target - value) / factor,
                round_off: f64::EPSILON * terms / factor + NO_DIGITS / factor,
                factor,
                dependent: false,
            }
        };
        let energy = normal(ENERGY);
        let energy = Normal { dependent: energy.square == 0.0, ..energy };
        let mut normals = Normals { conserved: vec![energy], entropy: None, off: 0.0 };
        for law in ENTROPY + 1..rows.values.len() {
            let independent = normals.independent(normal(law));
            normals.conserved.push(independent);
        }
        if self.system.second_law() == SecondLaw::Exact {
            let whole = normal(ENTROPY);
            normals.off = whole.excess();
            normals.entropy = Some(normals.independent(whole));
        }
        normals
    }
}

impl Normals {
    /// The laws so far that are independent of each other.
    fn independents(&self) -> impl Iterator<Item = &Normal> {
        self.conserved.iter().filter(|normal| !normal.dependent)
    }

    /// Removes the part of a law that depends on those before it.
    fn independent(&self, whole: Normal) -> Normal {
        let square = whole.square;
        let mut normal = whole;
        // The second pass removes the rounding error of the first.
        for _ in 0..2 {
            for before in self.independents() {
                let share = dot(&before.hat, &normal.hat) / before.square;
                for (hat, before) in normal.hat.iter_mut().zip(&before.hat) {
                    *hat -= before * share;
                }
                normal.residual -= share * before.residual;
                normal.round_off += share.abs() * before.round_off;
            }
        }
        normal.square = dot(&normal.hat, &normal.hat);
        let independent = normal.square > INDEPENDENT * INDEPENDENT * square;
        Normal { dependent: !independent, ..normal }
    }

    /// The largest residual in units of its round-off.
    fn excess(&self, with_entropy: bool) -> Result<f64, ProjectionError> {
        let conserved = self.independents().map(Normal::excess).fold(0.0, f64::max);
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
        let reach = |entropy: &Normal| entropy.round_off / entropy.square.sqrt();
        self.entropy.iter().any(|entropy| !entropy.dependent && reach(entropy) > 1.0)
    }

    /// The correction, in units of the entries. A residual below half its round-off is left, unless the last digits
    /// are asked for.
    fn correction(&self, with_entropy: bool, last_digits: bool) -> Vec<f64> {
        let least = if last_digits { 0.0 } else { 0.5 };
        let entropy = self.entropy.iter().filter(|entropy| with_entropy && !entropy.dependent);
        let mut sum = vec![0.0; self.conserved[0].hat.len()];
        for normal in self.independents().chain(entropy) {
            if normal.excess() > least {
                let factor = normal.residual / normal.square;
                sum.iter_mut().zip(&normal.hat).for_each(|(sum, hat)| *sum += hat * factor);
            }
        }
        sum
    }

    fn landed(&self, x: Vec<f64>, rows: Rows, target: &Aim<'_>) -> Landed {
        let (residual, entropy_round_off) = self.entropy.as_ref().map_or((0.0, 0.0), |entropy| {
            (entropy.residual * entropy.factor, entropy.round_off * entropy.factor)
        });
        Landed { x, rows, entropy: target.laws.entropy - residual, entropy_round_off }
    }
}

/// The components `v_i/s_i`; those of an entry without a unit vanish.
fn in_units(v: &[f64], units: &[f64]) -> Vec<f64> {
    v.iter().zip(units).map(|(v, unit)| if *v == 0.0 { 0.0 } else { v / unit }).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
