//! The further invariants at the end of a step in which a projection has faded out.
//!
//! Where the differential of a Casimir depends on that of the entropy, its projection fades out of `Π̃`, because a
//! discrete gradient does not resolve the direction of the rest. A step then changes the Casimir by up to `10⁻⁴h²`, and
//! the entropy may rise above the largest value that the Casimir allows. So the end is moved onto the laws of
//! the run, by less than a hundredth of the step: with the entropy of the end; with any entropy that has not fallen; or
//! with that of the start, because the start has these laws.

use metriplectic_dynamics::{Invariants, Metriplectic, system::Point};
use metriplectic_fields::{Column, Space as _, Vector};
use metriplectic_manifolds::Manifold;

use super::{Numbers, Start};
use crate::method::{Flow as _, Laws};
use crate::round_off::bound::{ROUNDED, of_a_law};

/// The largest distance by which an end is moved, relative to the step.
const NEAR: f64 = 1e-2;

/// A state and the laws there.
type Restored<Y> = (Point<Y>, Laws<Numbers<Y>>);

/// The end of a step with the further invariants of the run; `None` if they are kept to round-off, or no state nearby has
/// them.
#[inline]
pub(super) fn restored<Y: Metriplectic>(
    system: &Y,
    start: &Start<'_, Y>,
    end: &Point<Y>,
    values: &Laws<Numbers<Y>>,
    exact: bool,
) -> Option<Restored<Y>> {
    let off = |k: usize| {
        let value = start.values.invariants[k];
        let error = values.invariants[k] - value + start.accumulated_error.invariants[k];
        error.abs() > of_a_law(value.abs())
    };
    if (0..Y::Invariants::COUNT).any(off) { moved(system, start, end, values, exact) } else { None }
}

#[cold]
#[inline(never)]
fn moved<Y: Metriplectic>(
    system: &Y,
    start: &Start<'_, Y>,
    end: &Point<Y>,
    values: &Laws<Numbers<Y>>,
    exact: bool,
) -> Option<Restored<Y>> {
    let sizes = system.term_sizes(end);
    let mut laws = *values;
    laws.energy = start.values.energy - start.accumulated_error.energy;
    let mut worst = 0.0_f64;
    for k in 0..Y::Invariants::COUNT {
        laws.invariants[k] = start.values.invariants[k] - start.accumulated_error.invariants[k];
        let error = (values.invariants[k] - laws.invariants[k]).abs();
        worst = worst.max(error / of_a_law(sizes.invariants[k]));
    }
    if worst <= 1.0 {
        return None;
    }
    let d = Y::Manifold::coordinates(start.x, end);
    let units = Y::Manifold::scales(start.x) + d.abs();
    let length = |q: &Vector<Y::Manifold>| {
        (0..Vector::<Y::Manifold>::LEN).map(|i| (q[i] / units[i]).abs()).fold(0.0, f64::max)
    };
    let holds = |y: &Point<Y>, there: &Laws<Numbers<Y>>| {
        let kept = |k: usize| {
            (there.invariants[k] - laws.invariants[k]).abs() <= of_a_law(sizes.invariants[k])
        };
        let fall = start.values.entropy - there.entropy;
        length(&Y::Manifold::coordinates(end, y)) <= NEAR * length(&d)
            && (there.energy - laws.energy).abs() <= of_a_law(sizes.energy)
            && (0..Y::Invariants::COUNT).all(kept)
            && (!exact || fall <= ROUNDED * start.values.entropy.abs())
    };
    let entropies = [Some(values.entropy), None, Some(start.values.entropy)];
    let asked = if exact { 0..3 } else { 1..2 };
    entropies[asked].iter().find_map(|entropy| {
        let y = system.onto(end, &laws, *entropy)?;
        let there = system.laws(&y);
        holds(&y, &there).then_some((y, there))
    })
}
