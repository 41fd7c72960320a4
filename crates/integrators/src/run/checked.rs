//! The steps after which the model is checked.

use crate::step::{Flow, Recheck};

/// The first steps after which the model is checked.
const FIRST: [usize; 9] = [1, 2, 3, 5, 8, 13, 21, 34, 55];

/// The model is checked after each multiple of so many steps: a check costs as much as a step, and at most a hundredth of
/// a run (`tests/verification.rs::checks_on_the_way_cost_a_hundredth_of_a_long_run`).
/// A factor of four fails `run/checked.rs::the_states_that_are_checked_are_counted`.
const EVERY: usize = 149;

/// Returns whether the model is checked after this step.
pub(super) fn is_due(step: usize, verified: bool) -> bool {
    if step < EVERY { !verified && FIRST.contains(&step) } else { step.is_multiple_of(EVERY) }
}

/// The steps up to this one after which the model is checked.
fn due_steps(steps: usize, verified: bool) -> usize {
    let first = FIRST.iter().filter(|first| !verified && **first <= steps).count();
    first + steps / EVERY
}

/// The states at which the model of a flow has been checked after so many steps, the start among them.
pub(crate) fn checked_states<F: Flow + ?Sized>(flow: &F, steps: usize) -> usize {
    if !flow.rechecks(Recheck::End) {
        return 0;
    }
    let on_the_way = flow.rechecks(Recheck::OnTheWay { step: steps });
    1 + if on_the_way { due_steps(steps, flow.is_verified()) } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_states_that_are_checked_are_counted() {
        for verified in [false, true] {
            let mut checked = 1;
            for step in 0..1000 {
                checked += usize::from(step > 0 && is_due(step, verified));
                assert_eq!(1 + due_steps(step, verified), checked, "step {step}");
            }
        }
        // Less than one per cent of the steps, beside the first ones.
        assert_eq!([false, true].map(|verified| due_steps(100_000, verified)), [9 + 671, 671]);
    }
}
