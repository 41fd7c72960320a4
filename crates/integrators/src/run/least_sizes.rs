//! The least sizes that errors are relative to, in a run of a system that takes the time.
//!
//! A force may grow from nothing, as `exp(−t²)` does. An entry that it moves would have to be followed from its first digits,
//! over hundreds of powers of ten. So errors are relative to a small part `10⁻¹² T max_t |f_i(t, x₀)|` of what the rates make of
//! the run, with the time `T` of the run and the rates at the frozen start. An entry without rates there, such as a position
//! at rest, has the rates to which the motion of the others leads.

use crate::step::scales::larger;
use crate::step::{Element, Flow, Scales, Vector as _};

/// How often the rates are looked at along the time of a run.
const LOOKS: u32 = 100;
/// The least size of an entry, relative to what its largest rate would make of the run. A run of so many turns has no digits.
/// A factor of four fails `run/least_sizes.rs::the_least_size_is_a_trillionth_of_what_the_rates_make_of_a_run`.
const LEAST: f64 = 1e-12;
/// The displacement, relative to what the rates make of the run, at which entries without rates are looked at.
const AHEAD: f64 = 1e-6;
/// How often the entries without rates are looked at again: a position that a force moves is the second of a row.
const ROWS: u32 = 4;

/// The least sizes of the entries in a run from `start` to `end`.
#[cold]
pub(super) fn least_sizes<F: Flow + ?Sized>(
    flow: &F,
    x: &Element<F>,
    [start, end]: [f64; 2],
) -> F::Vector {
    let (zero, span) = (flow.sizes(x).zero(), end - start);
    let at = |time: f64, d: &F::Vector| match flow.clocked(x, time) {
        Some(later) => flow.rates(&later, d),
        None => flow.rates(x, d),
    };
    let (mut largest, mut strongest) = (zero.clone(), (0.0, start));
    for k in 0..=LOOKS {
        let time = start + span * (f64::from(k) / f64::from(LOOKS));
        let Some(rates) = at(time, &zero) else { continue };
        let rates = rates.map(f64::abs).by_kind();
        // Rates that are finite have a sum that is, or none is used.
        let size = (0..rates.len()).fold(0.0, |sum, i| sum + rates.get(i));
        if size.is_finite() {
            largest = larger(&largest, &rates);
            strongest = if size > strongest.0 { (size, time) } else { strongest };
        }
    }
    let is_still = |largest: &F::Vector| (0..largest.len()).any(|i| largest.get(i) == 0.0);
    for _ in 0..ROWS {
        if strongest.0 == 0.0 || !is_still(&largest) {
            break;
        }
        let ahead = largest.map(|rate| AHEAD * span * rate);
        let Some(there) = at(strongest.1, &ahead) else { break };
        let there = there.map(|rate| rate.abs() / AHEAD).by_kind();
        let joined = F::Vector::zip([&largest, &there], |[rate, there]| {
            if rate == 0.0 && there.is_finite() { there } else { rate }
        });
        largest = joined;
    }
    // Work and heat have the size of the energy to which the rates lead.
    let reached = Scales { sizes: largest.map(|rate| span.abs() * rate), terms: zero };
    flow.with_ledger_sizes(x, reached).sizes.map(|size| LEAST * size)
}

#[cfg(test)]
mod tests {
    use metriplectic_dynamics::{Symplectic, System};
    use metriplectic_fields::Real;
    use metriplectic_manifolds::Euclidean;
    use nalgebra::{Vector2, vector};

    use super::least_sizes;

    #[test]
    fn the_least_size_is_a_trillionth_of_what_the_rates_make_of_a_run() {
        // A body falls from rest for 10 units of time: the momentum becomes 10, and the position at most 100.
        let system = System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| x.y * x.y * 0.5 + x.x)
            .build()
            .unwrap();
        let [q, p] = least_sizes(&system, &vector![0.0, 0.0], [5.0, 15.0]).0.into();
        assert!((5e-12..2e-11).contains(&p) && (5e-11..2e-10).contains(&q), "{q} {p}");
    }
}
