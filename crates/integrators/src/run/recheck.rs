//! The laws of the model at states on the way of a run.
//!
//! A model that was verified around the start may break its laws elsewhere. Then a method conserves the energy of a
//! motion that no longer exists. So a run [asks](Flow::recheck) for the laws again: after steps 1, 2, 3, 5, 8, … 55 and
//! each multiple of 149. It asks at its end and at a state from which a step fails, too. It also asks after the first,
//! second, fourth, … step that leaves the state where it is. A run of a system that was
//! [verified before](Flow::is_verified) leaves out the first steps up to 55, so that many short runs are cheap.
//! A state on the way is checked at less than a hundredth of the cost of the steps before it.
//!
//! The numbers depend on nothing but the step, so a run that is resumed checks the same states. 149 has no factor in
//! common with the steps of a period that users choose, so the states lie at all phases of an oscillation.

use crate::run::checked::{checked_states, is_due};
use crate::run::controller::StepSize;
use crate::run::course::Course;
use crate::step::{Flow, Recheck, StepError};

/// The size of a step, relative to the largest one of the run, below which the derivatives are compared with the values
/// along every axis: where a derivative is lost, the energy and its differential contradict each other, and steps become tiny.
const CREEPS: f64 = 1e-2;

impl<F: Flow + ?Sized> Course<'_, F> {
    /// Checks the model after a step, where it is due.
    ///
    /// # Errors
    ///
    /// [`StepError::Model`] or [`StepError::Flow`].
    #[inline]
    pub(super) fn recheck(&mut self, held: bool) -> Result<(), StepError> {
        let over = self.progress.ending.is_some();
        let stays = held && self.certificate.projected_steps.held.is_power_of_two();
        if over || stays || is_due(self.state.step, self.flow.is_verified()) {
            self.verify_state(over, stays)
        } else {
            Ok(())
        }
    }

    #[cold]
    #[inline(never)]
    fn verify_state(&mut self, over: bool, stays: bool) -> Result<(), StepError> {
        let creeps = self.before.h < CREEPS * self.certificate.largest_step;
        let all = stays || creeps || (over && !self.flow.is_verified());
        let step = self.state.step;
        let on_the_way = Recheck::OnTheWay { step };
        let occasion = if all { Recheck::End } else { on_the_way };
        if !self.flow.rechecks(occasion) {
            return Ok(());
        }
        let due = is_due(step, self.flow.is_verified());
        let counted = due && self.flow.rechecks(on_the_way);
        self.certificate.checked_states =
            checked_states(self.flow, step) + usize::from(over && !counted);
        let mut verdict = self.verdict(occasion);
        if over && !all && verdict.is_ok() {
            let time = self.state.time;
            let ended = self.flow.examine_end(&self.state.point);
            verdict = ended.map_err(|law| StepError::Flow { time, law });
        }
        if verdict.is_err() {
            self.progress.ending = None;
        }
        verdict
    }

    /// The verdict on the model at the state of the run.
    fn verdict(&self, occasion: Recheck) -> Result<(), StepError> {
        self.flow.verdict(&self.state.point, self.state.time, occasion)
    }

    /// Finds a jump of the protocol along a step of one size that was not taken, at the frozen state.
    fn jump_inside(&self, h: f64) -> Option<StepError> {
        let is_fixed = matches!(self.progress.step_size, StepSize::Fixed(_));
        if !is_fixed || !self.progress.corners.is_empty() {
            return None;
        }
        let x = &self.state.point;
        let end = self.flow.clocked(x, self.state.time + h)?;
        self.flow.inspect([x, &end], true).err()
    }

    /// Explains why a step failed: by a protocol that jumps inside it, or by a law that the model breaks around the state, if there
    /// is one.
    #[cold]
    #[inline(never)]
    pub(super) fn explained(&self, error: StepError) -> StepError {
        match error.size() {
            Some(h) => {
                if let Some(jump) = self.jump_inside(h) {
                    return jump;
                }
                let occasion = Recheck::Failure { h: h.max(self.before.h) };
                let asked = self.flow.rechecks(occasion);
                asked.then(|| self.verdict(occasion).err()).flatten().unwrap_or(error)
            }
            None => error,
        }
    }
}
