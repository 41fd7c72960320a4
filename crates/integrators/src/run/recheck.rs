//! The laws of the model at states on the way of a run.
//!
//! A model that was verified around the start may break its laws elsewhere. Then a method conserves the energy of a
//! motion that no longer exists. So a run [asks](Flow::recheck) for the laws again: after the steps whose number is
//! 1, 2, 3, 5, 8, … 55 or a multiple of 89, after the first, second, fourth, … step that leaves the state where it is,
//! at its end, and at a state from which a step fails.
//!
//! The numbers depend on nothing but the step, so a run that is resumed checks the same states. 89 has no factor in
//! common with the steps of a period that users choose, so the states lie at all phases of an oscillation.

use crate::method::{Flow, Method, Recheck};
use crate::run::steps::Steps;
use crate::step_error::StepError;

/// The first steps after which the model is checked.
const FIRST: [usize; 9] = [1, 2, 3, 5, 8, 13, 21, 34, 55];

/// The model is checked after each multiple of so many steps: a check costs as much as a step.
const EVERY: usize = 89;

/// Whether the model is checked after this step.
fn is_due(step: usize) -> bool {
    if step < EVERY { FIRST.contains(&step) } else { step.is_multiple_of(EVERY) }
}

/// The states at which a model has been checked after so many steps, the start among them.
pub(crate) fn checked_states(steps: usize) -> usize {
    1 + FIRST.iter().filter(|first| **first <= steps).count() + steps / EVERY
}

impl<F: Flow, M: Method<F>> Steps<'_, F, M> {
    /// Checks the model after a step, where it is due.
    ///
    /// # Errors
    ///
    /// [`StepError::Model`] or [`StepError::Flow`].
    #[inline]
    pub(super) fn recheck(&mut self, held: bool) -> Result<(), StepError> {
        if !self.flow.rechecks() {
            return Ok(());
        }
        let over = self.progress.ending.is_some();
        let stays = held && self.certificate.projected_steps.held.is_power_of_two();
        if over || stays || is_due(self.state.step) { self.verify_state(over, stays) } else { Ok(()) }
    }

    #[cold]
    #[inline(never)]
    fn verify_state(&mut self, over: bool, stays: bool) -> Result<(), StepError> {
        let occasion = if over || stays { Recheck::End } else { Recheck::OnTheWay };
        let step = self.state.step;
        let only_the_end = usize::from(over && !is_due(step));
        self.certificate.checked_states = checked_states(step) + only_the_end;
        let verdict = self.verdict(occasion);
        if verdict.is_err() {
            self.progress.ending = None;
        }
        verdict
    }

    /// The verdict on the model at the state of the run.
    fn verdict(&self, occasion: Recheck) -> Result<(), StepError> {
        let (x, time) = (&self.state.point, self.state.time);
        let broken = |law| StepError::Model { time, law: Box::new(law) };
        self.flow.recheck(x, occasion).map_err(broken)?;
        self.flow.reexamine(x, occasion).map_err(|law| StepError::Flow { time, law })
    }

    /// Explains why a step failed: by a law that the model breaks around the state, if there is one.
    #[cold]
    #[inline(never)]
    pub(super) fn explained(&self, error: StepError) -> StepError {
        match error.size() {
            Some(h) if self.flow.rechecks() => {
                let h = h.max(self.before.h);
                self.verdict(Recheck::Failure { h }).err().unwrap_or(error)
            }
            _ => error,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_states_that_are_checked_are_counted() {
        let mut checked = 1;
        for step in 0..1000 {
            checked += usize::from(step > 0 && is_due(step));
            assert_eq!(checked_states(step), checked, "step {step}");
        }
        // One per cent of the steps, beside the first ones.
        assert_eq!(checked_states(100_000), 1 + 9 + 1123);
    }
}
