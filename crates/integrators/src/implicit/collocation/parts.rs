//! A step that is not solved whole, in parts. Both laws hold for each part, and so for the step. As in [`crate::collocation`]: a Gauss
//! step is split in halves, and these again; the parts of a Radau step grow from its start.

use super::covectors::zeros;
use super::equation::StageEquation;
use super::linear::Linear;
use super::memory::StageNumbers;
use super::step::{Collocation, breaks_another_law};
use crate::collocation::fallbacks::StepFailure;
use crate::collocation::parts::{FIRST, RATIOS, TRIALS};
use crate::implicit::algebra::magnitude;
use crate::implicit::start::{Around, Start, Step};
use crate::numbers::Lengths;
use crate::step::failure::{Cause, Fallbacks, smallest_part};
use crate::step::{Effort, Evidence, StepError};

impl Collocation {
    /// The step, whole or in parts.
    pub(in crate::implicit) fn take<L: Lengths>(
        &self,
        start: &Start<'_, L>,
        memory: &mut StageNumbers<L>,
        around: &dyn Around<L>,
    ) -> Result<Step<L>, StepError> {
        let failure = match self.try_step(start, memory, around, Fallbacks::All) {
            Ok(taken) => return Ok(taken),
            Err(failure) => failure,
        };
        let kept = std::mem::take(memory);
        let mut divided = Divided { method: self, around, effort: failure.effort };
        let taken = if self.tableau.one_sided {
            divided.graded(start, memory)
        } else {
            divided.halves(start, memory, 1)
        };
        let failed = match taken {
            // Many parts add up what each of them may leave of a law.
            Ok(taken) if breaks_another_law(start, &taken.x, &taken.values, around) => {
                let failure = StepFailure { cause: Cause::Unsolved, effort: divided.effort };
                Failed { failure, x: taken.x, h: start.h }
            }
            Ok(taken) => {
                memory.last = None;
                return Ok(Step { effort: divided.effort, ..taken });
            }
            Err(failed) => failed,
        };
        *memory = kept;
        Err(divided.error(start, &failed))
    }
}

/// A step that was not solved whole, in its parts.
struct Divided<'a, L: Lengths> {
    method: &'a Collocation,
    around: &'a dyn Around<L>,
    /// The effort of all parts.
    effort: Effort,
}

/// A part that was not taken.
struct Failed<L: Lengths> {
    failure: StepFailure,
    /// Where it starts.
    x: L::State,
    /// Its size.
    h: f64,
}

/// The start of a part of this size, at the start of the step.
fn first<'a, L: Lengths>(start: &Start<'a, L>, h: f64) -> Start<'a, L> {
    Start { h, ..start.clone() }
}

/// The start of a part of this size, after another one.
fn after<'a, L: Lengths>(start: &Start<'a, L>, before: &'a Step<L>, h: f64) -> Start<'a, L> {
    let Step { x, values, .. } = before;
    let mut accumulated_error = start.accumulated_error.clone();
    accumulated_error.energy += values.energy - start.values.energy;
    Start { x, h, values: values.clone(), accumulated_error, ..*start }
}

/// Adds the evidence of two parts of a step that damps: friction that the first one has not damped the second one may damp.
fn together<L: Lengths>(first: &Step<L>, second: &Step<L>) -> Evidence {
    let friction = second.evidence.friction;
    Evidence { friction, ..first.evidence.and(second.evidence) }
}

impl<L: Lengths> Divided<'_, L> {
    /// The two halves of a step that was not solved whole.
    fn halves(
        &mut self,
        start: &Start<'_, L>,
        memory: &mut StageNumbers<L>,
        depth: usize,
    ) -> Result<Step<L>, Failed<L>> {
        self.effort.splits += 1;
        let h = 0.5 * start.h;
        let before = self.half(&first(start, h), memory, depth)?;
        let second = self.half(&after(start, &before, h), memory, depth)?;
        let evidence = before.evidence.and(second.evidence);
        Ok(Step { evidence, ..second })
    }

    /// One half.
    fn half(
        &mut self,
        start: &Start<'_, L>,
        memory: &mut StageNumbers<L>,
        depth: usize,
    ) -> Result<Step<L>, Failed<L>> {
        match self.part(start, memory, Fallbacks::FirstTries) {
            Err(failed) if depth >= self.method.splits => Err(failed),
            Err(_) => self.halves(start, memory, depth + 1),
            taken => taken,
        }
    }

    /// The parts of a step that damps, each twice as long as the one before it.
    fn graded(
        &mut self,
        start: &Start<'_, L>,
        memory: &mut StageNumbers<L>,
    ) -> Result<Step<L>, Failed<L>> {
        let least = smallest_part(1.0, self.method.splits);
        let (mut done, mut fraction) = (0.0, self.first_part(start).max(least));
        // What has to be done before the rest is tried again.
        let mut enough = 0.0;
        let mut reached: Option<Step<L>> = None;
        for _ in 0..TRIALS {
            let rest = 1.0 - done;
            let is_last = fraction >= rest;
            let size = start.h * if is_last { rest } else { fraction };
            self.effort.splits += usize::from(!is_last);
            let part = match &reached {
                Some(before) => after(start, before, size),
                None => first(start, size),
            };
            match self.part(&part, memory, Fallbacks::FirstTries) {
                Ok(next) => {
                    let before = reached.as_ref();
                    let evidence = before.map_or(next.evidence, |before| together(before, &next));
                    let next = Step { evidence, ..next };
                    if is_last {
                        return Ok(next);
                    }
                    (done, fraction) = (done + fraction, fraction * RATIOS[0]);
                    reached = Some(next);
                }
                Err(failed) => {
                    if done > enough
                        && let Some(before) = &reached
                    {
                        enough = 2.0 * done;
                        let rest = after(start, before, start.h * rest);
                        if let Ok(next) = self.part(&rest, memory, Fallbacks::All) {
                            return Ok(Step { evidence: together(before, &next), ..next });
                        }
                    }
                    fraction = fraction.min(rest) * RATIOS[1];
                    if fraction < least {
                        return Err(failed);
                    }
                }
            }
        }
        let (x, h) = (reached.map_or_else(|| start.x.clone(), |part| part.x), start.h * fraction);
        let failure = StepFailure { cause: Cause::Unsolved, effort: self.effort };
        Err(Failed { failure, x, h })
    }

    /// The fraction of a step that the first part is: the time in which friction acts, as a power of two.
    fn first_part(&self, start: &Start<'_, L>) -> f64 {
        let equation = StageEquation::new(self.method.tableau, start);
        let here = Linear::of(&equation, &zeros(start.parts));
        let friction = here.map_or(0.0, |linear| linear.friction);
        let mut fraction = 0.5;
        while fraction * friction > FIRST && fraction > f64::MIN_POSITIVE {
            fraction *= 0.5;
        }
        fraction
    }

    /// One part.
    fn part(
        &mut self,
        start: &Start<'_, L>,
        memory: &mut StageNumbers<L>,
        fallbacks: Fallbacks,
    ) -> Result<Step<L>, Failed<L>> {
        match self.method.try_step(start, memory, self.around, fallbacks) {
            Ok(taken) => {
                self.effort += taken.effort;
                Ok(taken)
            }
            Err(failure) => {
                self.effort += failure.effort;
                Err(Failed { failure, x: start.x.clone(), h: start.h })
            }
        }
    }

    /// Explains a step that was not solved by the failure of its smallest part.
    #[cold]
    fn error(&self, start: &Start<'_, L>, failed: &Failed<L>) -> StepError {
        let &Start { parts, time, h, .. } = start;
        let (Collocation { tableau, splits }, tried) = (self.method, self.effort);
        if let Some(error) = failed.failure.cause.first_law(time, h) {
            return error;
        }
        let suggested = smallest_part(h, *splits);
        let part = StageEquation::new(tableau, &first(start, suggested));
        let rest = zeros(parts);
        let residual = part
            .evaluate(&rest)
            .map_or(f64::INFINITY, |at| at.residual.iter().map(magnitude).fold(0.0, f64::max));
        if let Some(linear) = Linear::of(&StageEquation { h: failed.h, ..part }, &rest)
            && linear.friction > f64::max(1.0, linear.rotation)
        {
            let stiffness = linear.friction * (h / failed.h);
            let damps = tableau.one_sided;
            return StepError::StiffFriction { time, h, stiffness, residual, tried, damps };
        }
        match (failed.failure.cause, self.around.dependent_invariant(&failed.x)) {
            (Cause::Edge, _) => StepError::OutOfDomain { time, h, tried },
            (_, Some((index, fraction))) => {
                let change = start.accumulated_error.invariants.as_ref()[index].abs();
                StepError::DependentInvariants { time, index, change, fraction }
            }
            _ => StepError::NotConverged { time, h, residual, tried, suggested },
        }
    }
}
