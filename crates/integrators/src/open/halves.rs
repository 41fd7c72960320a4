//! A step of an implicit method that is not solved whole, in halves.

use crate::step::failure::{Cause, Fallbacks};
use crate::step::{Effort, Element, Flow, Refusal, StepError, StepStart, Taken};

/// A step that was not taken.
#[derive(Debug)]
pub(super) struct Failure {
    pub(super) cause: Cause,
    pub(super) residual: f64,
    pub(super) effort: Effort,
}

impl Failure {
    /// Makes the refusal of a step of adaptive size.
    pub(super) fn into_refusal(self, time: f64, h: f64) -> Refusal {
        let error = self.cause.first_law(time, h);
        Refusal { effort: self.effort, error, second_law: false }
    }
}

/// Tries a step of a size from a start.
pub(super) type Try<'a, F> =
    dyn FnMut(&StepStart<'_, F>, f64, Fallbacks) -> Result<Taken<F>, Failure> + 'a;

/// The parts of a step that was not solved whole.
struct Halves<'a, 'b, F: Flow> {
    try_step: &'a mut Try<'b, F>,
    /// The effort of all parts.
    effort: Effort,
}

/// The step, whole or in halves, each of which is halved again up to `splits` times.
pub(super) fn take<F: Flow>(
    start: &StepStart<'_, F>,
    h: f64,
    splits: usize,
    try_step: &mut Try<'_, F>,
) -> Result<Taken<F>, StepError> {
    let failure = match try_step(start, h, Fallbacks::All) {
        Ok(taken) => return Ok(taken),
        Err(failure) => failure,
    };
    let mut halves = Halves { try_step, effort: failure.effort };
    let parts = if splits == 0 { Err(failure) } else { halves.of(start, h, splits) };
    let effort = halves.effort;
    match parts {
        Ok(taken) => Ok(Taken { effort, ..taken }),
        Err(Failure { cause, residual, .. }) => {
            let (time, tried) = (start.time, effort);
            let suggested = (0..splits).fold(h, |part, _| 0.5 * part);
            Err(cause.first_law(time, h).unwrap_or(match cause {
                Cause::Edge => StepError::OutOfDomain { time, h, tried },
                _ => StepError::NotConverged { time, h, residual, tried, suggested },
            }))
        }
    }
}

impl<F: Flow> Halves<'_, '_, F> {
    /// The two halves of a step that was not solved whole.
    fn of(&mut self, start: &StepStart<'_, F>, h: f64, left: usize) -> Result<Taken<F>, Failure> {
        self.effort.splits += 1;
        let half = 0.5 * h;
        let first = self.part(start, half, left)?;
        let middle = after(start, &first, half);
        let second = self.part(&middle, half, left)?;
        let evidence = first.evidence.and(second.evidence);
        Ok(Taken { evidence, ..second })
    }

    /// One half.
    fn part(&mut self, start: &StepStart<'_, F>, h: f64, left: usize) -> Result<Taken<F>, Failure> {
        match (self.try_step)(start, h, Fallbacks::FirstTries) {
            Ok(taken) => {
                self.effort += taken.effort;
                Ok(taken)
            }
            Err(failure) => {
                self.effort += failure.effort;
                if left <= 1 { Err(failure) } else { self.of(start, h, left - 1) }
            }
        }
    }
}

/// Where a part of a step starts that follows another one.
pub(super) fn after<'a, F: Flow>(
    start: &StepStart<'a, F>,
    before: &'a Taken<F>,
    h: f64,
) -> StepStart<'a, F> {
    let mut reference = start.reference.clone();
    if before.evidence.dissipates {
        reference.entropy = before.values.entropy;
    }
    let x: &'a Element<F> = &before.x;
    StepStart {
        flow: start.flow,
        x,
        time: start.time + h,
        values: before.values.clone(),
        reference,
        allowed: start.allowed.clone(),
    }
}
