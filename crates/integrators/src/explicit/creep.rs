//! An energy whose derivative is lost.
//!
//! `⟨dH, v⟩ = 0` for every velocity, so along it the energy changes by `O(τ²)`. If it changes in proportion to `τ` on both
//! sides of a state, its differential is not the derivative of its values. The projection of a step then takes back
//! what the motion has done to the energy, and the state creeps in steps as small as that correction may be.

use super::flow::StageFlow;
use super::rest::sizes;
use crate::round_off::bound::ROUNDED;
use crate::step::{StepStart, Vector};

/// Steps between two looks at the energy.
pub(super) const PATIENCE: u32 = 64;
/// A displacement in a step, relative to the size of its entry, that may be creeping.
const CREEPING: f64 = 1e-3;
/// The longest displacement along the velocity, relative to the size of its entry.
const LENGTH: f64 = 1e-6;
/// The fractions of this displacement at which energies are compared.
const FRACTIONS: [f64; 3] = [1.0, 1.0 / 16.0, 1.0 / 256.0];
/// The change of the energy in units of its round-off that shows a power of `τ`.
const CLEAR: f64 = 256.0;

/// The rate at which the energy changes along the velocity, if a step has this short displacement and the energy
/// changes in proportion to time.
#[cold]
pub(super) fn energy_rate<F: StageFlow>(
    flow: &F,
    start: &StepStart<'_, F>,
    velocity: &F::Vector,
    displacement: &F::Vector,
) -> Option<f64> {
    let sizes = sizes(flow, start);
    let is_short =
        (0..displacement.len()).all(|i| displacement.get(i).abs() <= CREEPING * sizes.get(i));
    let speed = velocity.relative_to(&sizes);
    if !(is_short && speed > 0.0 && speed.is_finite()) {
        return None;
    }
    let clear = CLEAR * ROUNDED * flow.term_sizes(start.x).energy;
    // At an equilibrium the velocity is round-off and has any direction: the step itself has to change the energy.
    let whole = displacement.relative_to(&sizes) / LENGTH;
    let rates = [LENGTH / speed, -LENGTH / speed].map(|time| {
        let mut changes = [0.0; FRACTIONS.len()];
        for (change, fraction) in changes.iter_mut().zip(FRACTIONS) {
            let y = flow.stage(start.x, &velocity.map(|v| fraction * time * v))?;
            *change = (flow.laws(&y).energy - start.values.energy).abs();
        }
        let [first, second, third] = changes;
        let is_linear = |larger: f64, smaller: f64| (8.0..32.0).contains(&(larger / smaller));
        let linear = is_linear(first, second)
            && is_linear(second, third)
            && third > clear
            && first * whole > clear;
        linear.then(|| first / time.abs())
    });
    let [forward, backward] = rates;
    Some(forward?.min(backward?))
}
