//! The further invariants at the end of a step in which a projection has faded out, as in [`crate::midpoint`], whose file of this
//! name has the reasons.

use crate::implicit::algebra::{add, dot};
use crate::implicit::orthogonal::Orthogonal;
use crate::implicit::start::Start;
use crate::midpoint::restored::{CORRECTIONS, EXACT, KEPT, NEAR};
use crate::numbers::{Lengths, List};
use crate::round_off::bound::{ROUNDED, of_a_law};
use crate::step::Laws;

/// A state and the laws there.
type Restored<L> = (<L as Lengths>::State, Laws<<L as Lengths>::Invariants>);

/// The end of a step with the further invariants of the run; `None` if they are kept to round-off, or no state nearby has them.
pub(super) fn restored<L: Lengths>(
    start: &Start<'_, L>,
    end: &L::State,
    values: &Laws<L::Invariants>,
) -> Option<Restored<L>> {
    let listed = |laws: &Laws<L::Invariants>, k: usize| laws.invariants.as_ref()[k];
    let is_off = |k: usize| {
        let value = listed(&start.values, k);
        let error = listed(values, k) - value + listed(&start.accumulated_error, k);
        error.abs() > KEPT * of_a_law(value.abs())
    };
    if !(0..start.parts.kinds.len()).any(is_off) {
        return None;
    }
    Wanted::at(start, end).of(end, values.clone())
}

/// The laws that the end of a step should have.
struct Wanted<'a, L: Lengths> {
    start: &'a Start<'a, L>,
    laws: Laws<L::Invariants>,
    /// The further invariants of the run.
    reference: L::Invariants,
    /// The entropy that the end has at least.
    floor: Option<f64>,
    /// The round-off of the laws.
    round_off: Laws<L::Invariants>,
    /// The size of each coordinate, and of the step in these units.
    units: L::Vector,
    length: f64,
}

impl<'a, L: Lengths> Wanted<'a, L> {
    #[cold]
    fn at(start: &'a Start<'a, L>, end: &L::State) -> Self {
        let parts = start.parts;
        let (mut laws, mut round_off) = (start.values.clone(), parts.term_sizes(end));
        laws.energy -= start.accumulated_error.energy;
        round_off.energy = of_a_law(round_off.energy);
        // Half of the round-off of an increment.
        round_off.entropy *= 0.5 * ROUNDED;
        let mut reference = laws.invariants.clone();
        for k in 0..parts.kinds.len() {
            let error = start.accumulated_error.invariants.as_ref()[k];
            let allowed = KEPT * of_a_law(round_off.invariants.as_ref()[k]);
            round_off.invariants[k] = allowed;
            reference[k] -= error;
            // The entropy of the start may need the round-off of the invariants there.
            laws.invariants[k] = reference.as_ref()[k] + error.clamp(-allowed, allowed);
        }
        let (d, sizes) = (parts.between(start.x, end), parts.scales(start.x));
        let units = parts.vector(|i| sizes[i] + d[i].abs());
        let length = relative(&d, &units);
        let floor = parts.is_exact.then_some(start.values.entropy);
        Self { start, laws, reference, floor, round_off, units, length }
    }

    /// The state near the end of a step that has the laws.
    #[cold]
    fn of(&self, end: &L::State, mut there: Laws<L::Invariants>) -> Option<Restored<L>> {
        if self.has_invariants(&there, &self.reference, 1.0) {
            return None;
        }
        let (parts, mut y) = (self.start.parts, end.clone());
        for _ in 0..CORRECTIONS {
            y = parts.moved(&y, &self.correction(&y, &there)?);
            there = parts.laws(&y);
            let moved = relative(&parts.between(end, &y), &self.units);
            if moved > NEAR * self.length || moved.is_nan() {
                return None;
            }
            let is_balanced = (there.energy - self.laws.energy).abs() <= self.round_off.energy;
            if is_balanced
                && self.has_invariants(&there, &self.laws.invariants, EXACT)
                && self.fall(there.entropy) <= self.round_off.entropy
            {
                return Some((y, there));
            }
        }
        None
    }

    /// Returns whether the further invariants differ from the `wanted` ones by at most this fraction of their round-off.
    fn has_invariants(
        &self,
        there: &Laws<L::Invariants>,
        wanted: &L::Invariants,
        fraction: f64,
    ) -> bool {
        let numbers = [&there.invariants, wanted, &self.round_off.invariants].map(AsRef::as_ref);
        let [there, wanted, allowed] = numbers;
        (0..there.len()).all(|k| (there[k] - wanted[k]).abs() <= fraction * allowed[k])
    }

    /// By how much the entropy is below the least one.
    fn fall(&self, entropy: f64) -> f64 {
        self.floor.map_or(0.0, |floor| (floor - entropy).max(0.0))
    }

    /// The shortest displacement that has the missing parts of the laws, one law after the other.
    fn correction(&self, y: &L::State, there: &Laws<L::Invariants>) -> Option<L::Vector> {
        let parts = self.start.parts;
        let metric = parts.metric(y)?;
        let g = metric.units();
        let w = parts.differentials(y);
        let (mut normals, mut d) = (Orthogonal::none(), parts.zero());
        let further =
            w.invariants.iter().enumerate().map(|(k, dl)| {
                (dl, self.laws.invariants.as_ref()[k] - there.invariants.as_ref()[k])
            });
        let fall = self.fall(there.entropy);
        let of_energy = std::iter::once((&w.energy, self.laws.energy - there.energy));
        let of_entropy = (fall > 0.0).then_some((&w.entropy, fall));
        for (dl, missing) in of_energy.chain(further).chain(of_entropy) {
            let sharp = g.sharp(&normals.project_covector(0, dl));
            let known = normals.len();
            normals.push(g, dl);
            if normals.len() > known {
                let c = (missing - dot(dl, &d)) / dot(dl, &sharp);
                add(&mut d, c, &sharp);
            }
        }
        Some(d)
    }
}

/// The size of a displacement in these units.
fn relative<V: List>(d: &V, units: &V) -> f64 {
    d.numbers().iter().zip(units.numbers()).fold(0.0, |most, (d, unit)| {
        let size = (d / unit).abs();
        if size > most || size.is_nan() { size } else { most }
    })
}
