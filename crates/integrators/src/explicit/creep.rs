//! An energy whose derivative is lost.
//!
//! `⟨dH, v⟩ = 0` for every velocity, so along it the energy changes by `O(τ²)`. If it changes in proportion to `τ` on both
//! sides of a state, its differential is not the derivative of its values. The projection of a step then takes back
//! what the motion has done to the energy, and the state creeps in steps as small as that correction may be.

use super::flow::StageFlow;
use super::rest::sizes;
use crate::round_off::bound::ROUNDED;
use crate::step::{StepStart, Vector, both};

/// Steps between two looks at the energy.
pub(super) const PATIENCE: u32 = 64;
/// A displacement in a step, relative to the size of its entry, that may be creeping.
/// A factor of four fails `explicit/creep.rs::an_energy_with_a_lost_slope_is_found_where_a_state_creeps`.
const CREEPING: f64 = 1e-3;
/// The longest displacement along the velocity, relative to the size of its entry.
/// A factor of four fails `explicit/creep.rs::an_energy_with_a_lost_slope_is_found_where_a_state_creeps`.
const LENGTH: f64 = 1e-6;
/// The fractions of this displacement at which energies are compared.
/// A factor of four fails `explicit/creep.rs::an_energy_with_a_lost_slope_is_found_where_a_state_creeps`.
const FRACTIONS: [f64; 3] = [1.0, 1.0 / 16.0, 1.0 / 256.0];
/// The change of the energy in units of its round-off that shows a power of `τ`.
/// A factor of four fails `explicit/creep.rs::an_energy_with_a_lost_slope_is_found_where_a_state_creeps`.
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
    let rates = both([LENGTH / speed, -LENGTH / speed], |time| {
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

#[cfg(test)]
mod tests {
    use metriplectic_dynamics::{Symplectic, System};
    use metriplectic_fields::Real;
    use metriplectic_manifolds::Euclidean;
    use nalgebra::{Vector2, vector};

    use super::*;
    use crate::step::{Components, Flow as _};

    #[test]
    fn an_energy_with_a_lost_slope_is_found_where_a_state_creeps() {
        let found = |lost: f64, moved: f64| {
            let system = System::on(Euclidean::<2>)
                .bracket(Symplectic)
                .energy(move |x: &Vector2<Real>| x.y * x.y * 0.5 + Real::from(lost * x.x.re))
                .build()
                .unwrap();
            let x = vector![1.0, 1.0];
            let v = system.rates(&x, &Components(vector![0.0, 0.0])).unwrap();
            let start = StepStart::first(&system, &x);
            energy_rate(&system, &start, &v, &Components(vector![moved, 0.0]))
        };
        let rate = found(0.1, 5e-4).expect("a lost slope");
        assert!((rate - 0.1).abs() < 1e-6, "{rate}");
        // A longer step does not creep.
        assert_eq!(found(0.1, 2e-3), None);
        // A change of the energy that may be round-off shows nothing.
        assert!(found(2e-4, 5e-4).is_some() && found(4e-5, 5e-4).is_none());
    }
}
