//! The laws of a model at one state that a run has reached.
//!
//! A model that keeps its laws around the start may break them elsewhere: behind a branch, or where a fit has no data.
//! So a run asks for them on its way. A first pass compares each law with its own terms. It evaluates each part of the
//! model once, forms no Hessian and, up to thirty directions, allocates nothing.
//!
//! A run chooses its states, and ends at equilibria, where a differential may be all round-off. So a law that seems
//! broken is judged again. The round-off of a differential `F_i` is then `ε Σ_j |F_ij| ℓ_j` in units `ℓ` of the
//! coordinates. A law must also be broken at each of a few states at a distance of `10⁻⁶ ℓ`: at this
//! distance from an equilibrium the differentials have ten digits, and a model is wrong in a region.
//!
//! Derivatives are compared with values along two directions: a generic one that moves every entry, and one axis,
//! another one at each state. Where a difference of values is far from the differential, all axes are judged as at the
//! start.

use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;

use super::at::{At, Place, all_finite, dot, max_abs, name};
use super::domain::value_not_finite;
use super::fields::compare_scalars;
use super::sampling::CoordinateScales;
use super::sums::Rounded;
use super::table::{Table, zeros};
use super::{RADIUS, SAMPLES, dissipation, sums};
use crate::room::with_numbers;
use crate::{Covectors, ENERGY, ENTROPY, Kind, ModelError, Part, SecondLaw};

/// The distance of the states at which a broken law must be broken too, relative to the size of each coordinate.
const NEAR: f64 = 1e-6;

/// The number of these states.
const NEIGHBOURS: usize = 4;

/// A seed, so that a model fails in the same way each time.
const SEED: u64 = 0x5265_6163_6865_6421;

/// Checks the laws at a state, and again around it where one seems broken.
pub(super) fn examine(at: At<'_>) -> Result<(), ModelError> {
    let first = Reached { at, precise: None }.judge();
    if first.is_ok() { Ok(()) } else { again(at) }
}

/// Judges a state with the round-off of its differentials, and then states near it.
#[cold]
#[inline(never)]
fn again(at: At<'_>) -> Result<(), ModelError> {
    let sizes = CoordinateScales::at(at);
    if !all_finite(&sizes.units) {
        return Reached { at, precise: None }.values();
    }
    let judge = |at: At<'_>| Reached { at, precise: Some(&sizes.units) }.judge();
    let Err(found) = judge(at) else { return Ok(()) };
    if all_around(at, &sizes, |at| judge(at).is_err()) { Err(found) } else { Ok(()) }
}

/// Compares the derivatives of the scalar fields with their values at a state, and around it where one seems wrong.
pub(super) fn compare(at: At<'_>) -> Result<(), ModelError> {
    let sizes = CoordinateScales::at(at);
    let judge = |at: At<'_>| {
        let (energy, entropy) = (at.jet2(ENERGY), at.jet2(ENTROPY));
        if !(all_finite(&sizes.units) && energy.is_finite() && entropy.is_finite()) {
            return Ok(());
        }
        let place = Place { at, units: &sizes.units, energy, entropy };
        (0..at.n()).try_for_each(|axis| compare_scalars(&place, axis))
    };
    let Err(found) = judge(at) else { return Ok(()) };
    if all_around(at, &sizes, |at| judge(at).is_err()) { Err(found) } else { Ok(()) }
}

/// The displacements, relative to the sizes of the entries, over which a first look takes differences.
const ACROSS: [f64; 2] = [1e-4, 1e-7];

/// The part of a difference, relative to its terms, that is worth a closer look.
const CONTRADICTS: f64 = 1e-4;

/// The round-off of a difference of values, relative to them.
const ROUNDED: f64 = 64.0 * f64::EPSILON;

/// Compares the derivatives of the scalar fields with their values along two directions, and along each axis if they
/// contradict each other. `turn` chooses the directions.
pub(super) fn look(at: At<'_>, turn: usize) -> Result<(), ModelError> {
    let (n, entries) = (at.n(), at.x.len());
    let contradicts = with_numbers(5 * n + entries, |room| {
        let (scales, room) = room.split_at_mut(n);
        let (generic, room) = room.split_at_mut(n);
        let (along, room) = room.split_at_mut(n);
        let (df, room) = room.split_at_mut(n);
        let (q, y) = room.split_at_mut(n);
        at.model.scales(at.x, scales);
        // The fractional parts of the multiples of the golden ratio, between ½ and 1, with either sign.
        for (i, generic) in generic.iter_mut().enumerate() {
            let turns = ((turn * n + i) as f64 * GOLDEN).fract() - 0.5;
            *generic = scales[i] * (turns + 0.5_f64.copysign(turns));
        }
        along[turn % n] = scales[turn % n];
        at.laws().any(|law| {
            at.model.jet(law, at.t, at.x, df);
            [&*generic, along].into_iter().any(|d| {
                ACROSS.into_iter().all(|size| {
                    let mut value = |t: f64| {
                        (0..n).for_each(|i| q[i] = d[i] * t);
                        at.model.chart(at.x, q, y);
                        at.model.value(law, at.t, y)
                    };
                    let (ahead, behind) = (value(size), value(-size));
                    let terms: f64 = df.iter().zip(d).map(|(w, d)| w.abs() * d.abs()).sum();
                    let (slope, terms) = (dot(df, d) * size, terms * size);
                    let rest = (0.5 * (ahead - behind) - slope).abs();
                    let rounded = ROUNDED * (ahead.abs() + behind.abs());
                    // A difference that is not a number says nothing.
                    rest > CONTRADICTS * terms + rounded && rest.is_finite()
                })
            })
        })
    });
    if contradicts { compare(at) } else { Ok(()) }
}

/// The golden ratio without its whole part.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Looks for a broken law at a state from which a step fails, at samples around it, and at the states `ahead`.
pub(super) fn around(at: At<'_>, ahead: &[Vec<f64>]) -> Result<(), ModelError> {
    let judge = |at: At<'_>| examine(at).and_then(|()| compare(at));
    judge(at)?;
    let has_values =
        |at: At<'_>| at.model.defect(at.x).is_finite() && value_not_finite(at).is_none();
    let ahead = ahead.iter().map(|y| at.moved_to(y));
    ahead.filter(|&there| has_values(there)).try_for_each(judge)?;
    let sizes = CoordinateScales::at(at);
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    (0..SAMPLES).try_for_each(|_| {
        let drawn = sizes.draw(at, RADIUS, &mut rng, &mut 0, has_values);
        drawn.map_or(Ok(()), |(y, _)| judge(at.moved_to(&y)))
    })
}

/// Returns whether the model is `broken` at each of a few states near `x`.
fn all_around(at: At<'_>, sizes: &CoordinateScales, broken: impl Fn(At<'_>) -> bool) -> bool {
    let inside = |at: At<'_>| {
        let values = [ENERGY, ENTROPY].map(|law| at.value(law));
        at.model.defect(at.x).is_finite() && all_finite(&values)
    };
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    (0..NEIGHBOURS).all(|_| {
        let drawn = sizes.draw(at, NEAR, &mut rng, &mut 0, inside);
        drawn.is_some_and(|(y, _)| broken(at.moved_to(&y)))
    })
}

/// A state that a run has reached.
#[derive(Clone, Copy)]
struct Reached<'a> {
    at: At<'a>,
    /// The sizes of the coordinates, where the round-off of differentials counts.
    precise: Option<&'a [f64]>,
}

/// The slices in which a state is judged.
struct Room<'a> {
    units: &'a mut [f64],
    energy: [&'a mut [f64]; 2],
    entropy: [&'a mut [f64]; 2],
    law: [&'a mut [f64]; 2],
    force: &'a mut [f64],
    bracket: &'a mut [f64],
    friction: &'a mut [f64],
    /// The Hessian, or what a decomposition works in.
    work: &'a mut [f64],
}

impl<'a> Room<'a> {
    /// The numbers that it takes.
    const fn numbers(n: usize) -> usize {
        3 * n * n + 9 * n
    }

    fn split(n: usize, mut room: &'a mut [f64]) -> Self {
        let mut take = |count| {
            let (first, rest) = std::mem::take(&mut room).split_at_mut(count);
            room = rest;
            first
        };
        Self {
            units: take(n),
            energy: [take(n), take(n)],
            entropy: [take(n), take(n)],
            law: [take(n), take(n)],
            force: take(n),
            bracket: take(n * n),
            friction: take(n * n),
            work: take(n * n + n),
        }
    }
}

/// A differential beside its round-off.
fn rounded<'a>([value, rounding]: &'a [&mut [f64]; 2]) -> Rounded<'a> {
    [value, rounding]
}

impl Reached<'_> {
    fn point(&self) -> Vec<f64> {
        self.at.point()
    }

    /// The differential of a field, which must be finite, and the size of its round-off.
    fn differential(
        &self,
        law: usize,
        [value, rounding]: &mut [&mut [f64]; 2],
        work: &mut [f64],
    ) -> Result<(), ModelError> {
        let (field, At { model, t, x }) = (name(law), self.at);
        let of_state = model.jet(law, t, x, value);
        if !of_state.is_finite() {
            return Err(ModelError::ValueNotFinite { field, value: of_state, point: self.point() });
        }
        if !all_finite(value) {
            return Err(ModelError::DerivativeNotFinite { field, point: self.point() });
        }
        rounding.fill(0.0);
        if let Some(units) = self.precise {
            let n = units.len();
            let hessian = &mut work[..n * n];
            model.hessian(law, t, x, rounding, hessian);
            for (size, row) in rounding.iter_mut().zip(hessian.chunks_exact(n)) {
                *size = row.iter().zip(units).map(|(entry, unit)| entry.abs() * unit.abs()).sum();
            }
            if !all_finite(rounding) {
                rounding.fill(0.0);
            }
        }
        Ok(())
    }

    /// Returns whether the differentials are finite, where nothing else can be judged.
    fn values(&self) -> Result<(), ModelError> {
        let n = self.at.n();
        let (mut numbers, mut work) = (zeros(2 * n), zeros(n * n));
        let (value, rounding) = numbers.split_at_mut(n);
        let mut room = [value, rounding];
        [ENERGY, ENTROPY]
            .into_iter()
            .try_for_each(|law| self.differential(law, &mut room, &mut work))
    }

    fn finite(&self, field: &'static str, value: f64) -> Result<(), ModelError> {
        if value.is_finite() {
            Ok(())
        } else {
            Err(ModelError::ValueNotFinite { field, value, point: self.point() })
        }
    }

    fn law(&self, size: f64, error: fn(Vec<f64>, f64) -> ModelError) -> Result<(), ModelError> {
        // A sum that is not a number has terms that overflow, and says nothing.
        if size > sums::TOLERANCE && size.is_finite() {
            Err(error(self.point(), size))
        } else {
            Ok(())
        }
    }

    /// The largest relative size of a row of `K α`, beside the round-off of `K` where it counts.
    fn annihilated(&self, k: &[f64], alpha: Rounded<'_>, units: &[f64]) -> f64 {
        let size = sums::product(k, alpha, units);
        match self.precise {
            Some(units) if size > sums::TOLERANCE => {
                let n = units.len();
                let table = Table::from_entries(n, |i, j| k[i * n + j]);
                dissipation::beside_round_off(self.at, units, &table, alpha[0]).min(size)
            }
            _ => size,
        }
    }

    /// Judges every law.
    fn judge(&self) -> Result<(), ModelError> {
        let n = self.at.n();
        with_numbers(Room::numbers(n), |room| self.judge_in(Room::split(n, room)))
    }

    fn judge_in(&self, mut room: Room<'_>) -> Result<(), ModelError> {
        let &Self { at, .. } = self;
        let At { model, t, x } = at;
        let metric = |source| at.unusable(source);
        self.differential(ENERGY, &mut room.energy, room.work)?;
        self.differential(ENTROPY, &mut room.entropy, room.work)?;
        match self.precise {
            Some(units) => room.units.copy_from_slice(units),
            None => {
                model.scales(x, room.units);
                sums::make_positive(room.units);
            }
        }
        let units = &*room.units;
        model.check_metric(x, false).map_err(metric)?;
        let w = Covectors { energy: &*room.energy[0], entropy: &*room.entropy[0] };
        let exact = model.second_law() == SecondLaw::Exact;
        if !model.is_zero(Part::Reversible) {
            let pi = &mut *room.bracket;
            model.tensor(Part::Reversible, t, x, w, pi).map_err(metric)?;
            self.finite("bracket", max_abs(pi))?;
            self.law(sums::asymmetry(pi, -1.0, units), |point, size| ModelError::BracketNotSkew {
                point,
                size,
            })?;
            if exact {
                let size = sums::product(pi, rounded(&room.entropy), units);
                self.law(size, |point, size| ModelError::EntropyNotCasimir { point, size })?;
            }
        }
        if !model.is_zero(Part::Gyroscopic) {
            // The room of a law is empty as yet.
            room.law[0].fill(0.0);
            let force = &mut *room.force;
            let there = (x, &*room.law[0]);
            model.apply(Part::Gyroscopic, t, there, w, w.energy, force).map_err(metric)?;
            self.finite("force", max_abs(force))?;
            let size = sums::pairing(rounded(&room.energy), force, units).abs();
            self.law(size, |point, size| ModelError::ForceDoesWork { point, size })?;
            if exact {
                let rate = sums::pairing(rounded(&room.entropy), force, units);
                self.law(-rate, |point, size| ModelError::ForceDestroysEntropy { point, size })?;
            }
        }
        let has_friction = !model.is_zero(Part::Irreversible);
        if has_friction {
            let k = &mut *room.friction;
            model.tensor(Part::Irreversible, t, x, w, k).map_err(metric)?;
            self.finite("dissipation", max_abs(k))?;
            self.law(sums::asymmetry(k, 1.0, units), |point, size| {
                ModelError::DissipationNotSymmetric { point, size }
            })?;
            self.law(sums::indefiniteness(k, units, room.work), |point, size| {
                ModelError::DissipationNotPositive { point, size }
            })?;
            let size = self.annihilated(k, rounded(&room.energy), units);
            self.law(size, |point, size| ModelError::EnergyNotKept { point, size })?;
        }
        let by_itself = has_friction && !model.adapts();
        at.invariants().try_for_each(|law| {
            self.differential(law, &mut room.law, room.work)?;
            let room = Room {
                units: room.units,
                energy: room.energy.each_mut().map(|w| &mut **w),
                entropy: room.entropy.each_mut().map(|w| &mut **w),
                law: room.law.each_mut().map(|w| &mut **w),
                force: room.force,
                bracket: room.bracket,
                friction: room.friction,
                work: room.work,
            };
            self.conserved(model.kind(law - ENTROPY - 1), &room, by_itself)
        })
    }

    /// Judges the law in the room: the bracket, the force and a dissipation that is not projected conserve it.
    fn conserved(&self, kind: Kind, room: &Room<'_>, by_itself: bool) -> Result<(), ModelError> {
        let (units, l) = (&*room.units, rounded(&room.law));
        match kind {
            Kind::Casimir => self.law(sums::product(room.bracket, l, units), |point, size| {
                ModelError::NotCasimir { point, size }
            }),
            Kind::Momentum => {
                let size = sums::form(room.bracket, [l, rounded(&room.energy)], units);
                self.law(size, |point, size| ModelError::NotMomentum { point, size })
            }
        }?;
        self.law(sums::pairing(l, room.force, units).abs(), |point, size| {
            ModelError::ForceChangesInvariant { point, size }
        })?;
        if !by_itself {
            return Ok(());
        }
        self.law(self.annihilated(room.friction, l, units), |point, size| {
            ModelError::InvariantNotKept { point, size }
        })
    }
}
