//! Correction of the round-off that earlier steps have accumulated in the laws, as in [`crate::round_off::drift`], whose formulas it
//! has.

use metriplectic_equations::{Part, Path};

use super::algebra::{add, dot};
use super::parts::{PartJet, Parts};
use super::start::Start;
use crate::numbers::{Lengths, List};
use crate::round_off::bound::ROUNDED;
use crate::step::Laws;

/// Laws that are zero, as many as these.
pub(super) fn nothing<L: Lengths>(laws: &Laws<L::Invariants>) -> Laws<L::Invariants> {
    let mut invariants = laws.invariants.clone();
    (0..laws.invariants.as_ref().len()).for_each(|k| invariants[k] = 0.0);
    Laws { energy: 0.0, entropy: 0.0, invariants }
}

/// The fractions of the accumulated errors that a step with about the displacement `d` takes back.
pub(super) fn target<L: Lengths>(start: &Start<'_, L>, d: &L::Vector) -> Laws<L::Invariants> {
    let Start { parts, x, values, .. } = start;
    let Laws { energy, entropy, invariants } = &start.accumulated_error;
    let count = parts.kinds.len();
    let far = |e: f64, size: f64| e.abs() > ROUNDED * size;
    let errors = invariants.as_ref();
    let sizes = values.invariants.as_ref();
    let is_off = far(*energy, values.energy.abs())
        || far(*entropy, values.entropy.abs())
        || (0..count).any(|k| far(errors[k], sizes[k].abs()));
    if !is_off {
        return nothing::<L>(values);
    }
    let w = parts.differentials(x);
    let zero = || Some(None);
    let linearised = |part: Part, is_there: bool, alpha: &L::Vector| {
        if is_there {
            parts.linearise(part, x, [&w.energy, &w.entropy, alpha]).map(Some)
        } else {
            zero()
        }
    };
    let pi = linearised(Part::Reversible, parts.moves, &w.energy);
    let k = linearised(Part::Irreversible, parts.rubs, &w.entropy);
    let (Some(pi), Some(k), Some(metric)) = (pi, k, parts.metric(x)) else {
        return nothing::<L>(values);
    };
    let flat = metric.units().flat(d);
    let sizes_of_flat = parts.vector(|i| flat[i].abs());
    let mut sensitivity = pi.map_or_else(|| parts.zeros(), |pi| pi.tensor.abs());
    let by_friction = k.map(|PartJet { along_w, tensor, .. }| {
        sensitivity.add(1.0, &along_w.abs());
        tensor.abs_times(&sizes_of_flat)
    });
    if let Some(Some(force)) = linearised(Part::Gyroscopic, parts.is_forced, &w.energy) {
        sensitivity.add(1.0, &force.tensor.abs());
    }
    let length = parts.vector(|i| d[i].abs());
    let size = |df: &L::Vector| parts.vector(|i| df[i].abs());
    // Σ|∂_iF δ_i|/|e| for a δ by a tensor.
    let moved = |df: &L::Vector, by: &L::Vector| dot(&size(df), by) * start.h.abs() / dot(&flat, d);
    let fraction = |e: f64, law: f64, df: &L::Vector, sensitivity: f64| {
        let r = dot(&size(df), &length) / (1e2 * sensitivity * e.abs());
        if far(e, law) && r.is_finite() { e / (1.0 + r.powi(-2)) } else { 0.0 }
    };
    let of_energy = moved(&w.energy, &sensitivity.times(&sizes_of_flat));
    let by_friction = by_friction.unwrap_or_else(|| parts.zero());
    let of_entropy = 1.0 + moved(&w.entropy, &by_friction);
    let mut drift = nothing::<L>(values);
    drift.energy = fraction(*energy, values.energy.abs(), &w.energy, of_energy);
    // An entropy that has risen by round-off comes back by less than a fall in each step.
    drift.entropy = fraction(*entropy, values.entropy.abs(), &w.entropy, of_entropy)
        .min(2.0 * f64::EPSILON * values.entropy.abs());
    for k in 0..count {
        drift.invariants[k] = fraction(errors[k], sizes[k].abs(), &w.invariants[k], 1e6);
    }
    drift
}

/// The digits that rounding has lost of the position in the steps so far, as in
/// [`crate::round_off::compensation`].
#[derive(Debug)]
pub(super) struct Compensation<L: Lengths>(pub(super) Option<L::Vector>);

// By hand, because lengths have none.
impl<L: Lengths> Clone for Compensation<L> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<L: Lengths> Compensation<L> {
    /// The digits that are not zero.
    fn before(&self) -> Option<&L::Vector> {
        self.0.as_ref().filter(|before| before.numbers().iter().any(|lost| lost.abs() > 0.0))
    }

    /// The end of a step, moved by what earlier steps have lost; `None` if it does not move.
    pub(super) fn shifted(&self, parts: &Parts<'_, L>, end: &L::State) -> Option<L::State> {
        Some(parts.moved(end, self.before()?))
    }

    /// The end of the step by `d` from `x`, moved by what earlier steps have lost; `None` if it does not move.
    pub(super) fn add(
        &mut self,
        parts: &Parts<'_, L>,
        path: Path,
        [x, end]: [&L::State; 2],
        d: &L::Vector,
    ) -> Option<L::State> {
        let mut lost = parts.lost_digits(path, [x, end], d);
        let compensated = self.before().map(|before| {
            let compensated = parts.moved(end, before);
            let more = parts.lost_digits(path, [end, &compensated], before);
            add(&mut lost, 1.0, &more);
            compensated
        });
        self.0 = Some(lost);
        compensated
    }
}
