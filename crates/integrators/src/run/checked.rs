//! The steps after which the model is checked.

use crate::step::{Flow, Recheck};

/// The first steps after which the model is checked.
const FIRST: [usize; 9] = [1, 2, 3, 5, 8, 13, 21, 34, 55];

/// The model is checked after each multiple of so many steps: a check costs as much as a step.
const EVERY: usize = 89;

/// Returns whether the model is checked after this step.
pub(super) fn is_due(step: usize) -> bool {
    if step < EVERY { FIRST.contains(&step) } else { step.is_multiple_of(EVERY) }
}

/// The steps up to this one after which the model is checked.
fn due_steps(steps: usize) -> usize {
    FIRST.iter().filter(|first| **first <= steps).count() + steps / EVERY
}

/// The states at which the model of a flow has been checked after so many steps, the start among them.
pub(crate) fn checked_states<F: Flow>(flow: &F, steps: usize) -> usize {
    if !flow.rechecks(Recheck::End) {
        return 0;
    }
    1 + if flow.rechecks(Recheck::OnTheWay) { due_steps(steps) } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_states_that_are_checked_are_counted() {
        let mut checked = 1;
        for step in 0..1000 {
            checked += usize::from(step > 0 && is_due(step));
            assert_eq!(1 + due_steps(step), checked, "step {step}");
        }
        // One per cent of the steps, beside the first ones.
        assert_eq!(due_steps(100_000), 9 + 1123);
    }
}
