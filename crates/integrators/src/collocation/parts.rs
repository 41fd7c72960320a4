//! A step that is not solved whole, in parts. Both laws hold for each part, and so for the step.
//!
//! A Gauss step is split in halves, and these again. A Radau step damps whatever is faster than itself, so only its
//! start has to be divided: a transient of the rate `λ` is over after a few parts of the size `1/λ`, and then each part
//! may be as long as all before it. There are about `log₂ hλ` of them.

use metriplectic_dynamics::{Metriplectic, system::Point};
use metriplectic_fields::{Column, Vector};

use super::equation::StageEquation;
use super::fallbacks::StepFailure;
use super::linear::Linear;
use super::memory::StageMemory;
use super::step::{breaks_another_law, try_step};
use super::tableau::{STAGES, Tableau};
use crate::step::failure::{Cause, Fallbacks, smallest_part};
use crate::step::{Dim, Effort, Evidence, Flow as _, Laws, Start, StepError, Taken};

/// The rate `|K'|` times the size of the first part, where friction is stiff.
/// A factor of four fails `collocation/parts.rs::the_first_part_is_some_times_of_the_friction`.
pub(crate) const FIRST: f64 = 4.0;
/// The ratio of a part to the one before it, and to one that was not solved.
/// A factor of four fails `tests/tangent/collocated.rs::parameters_of_a_metric_are_columns_of_stages`.
pub(crate) const RATIOS: [f64; 2] = [2.0, 0.25];
/// Parts of a Radau step that are tried.
pub(crate) const TRIALS: usize = 400;

/// The step, whole or in parts.
pub(crate) fn take<Y: Metriplectic>(
    tableau: &'static Tableau,
    splits: usize,
    start: &Start<'_, Y>,
    memory: &mut StageMemory<Dim<Y>>,
) -> Result<Taken<Y>, StepError> {
    let failure = match try_step(tableau, start, memory, Fallbacks::All) {
        Ok(taken) => return Ok(taken),
        Err(failure) => failure,
    };
    let kept = *memory;
    *memory = StageMemory::default();
    let mut parts = Parts { tableau, splits, effort: failure.effort };
    let taken = if tableau.one_sided {
        parts.graded(start, memory)
    } else {
        parts.halves(start, memory, 1)
    };
    match taken {
        // Many parts add up what each of them may leave of a law.
        Ok(taken) if breaks_another_law(start, &taken.x, &taken.values) => {
            *memory = kept;
            let failure = StepFailure { cause: Cause::Unsolved, effort: parts.effort };
            Err(parts.error(start, &Failed { failure, x: taken.x, h: start.h }))
        }
        Ok(taken) => {
            memory.last = None;
            Ok(Taken { effort: parts.effort, ..taken })
        }
        Err(failed) => {
            *memory = kept;
            Err(parts.error(start, &failed))
        }
    }
}

/// The parts of a step that was not solved whole.
struct Parts {
    tableau: &'static Tableau,
    splits: usize,
    /// The effort of all parts.
    effort: Effort,
}

/// A part that was not taken.
struct Failed<Y: Metriplectic> {
    failure: StepFailure,
    /// Where it starts.
    x: Point<Y>,
    /// Its size.
    h: f64,
}

/// The start of a part of this size, after another one.
fn after<'a, Y: Metriplectic>(start: &Start<'a, Y>, before: &'a Taken<Y>, h: f64) -> Start<'a, Y> {
    let laws = before.values;
    let energy = start.accumulated_error.energy + (laws.energy - start.values.energy);
    let accumulated_error = Laws { energy, ..start.accumulated_error };
    Start { x: &before.x, h, values: laws, accumulated_error, ..*start }
}

/// Adds the evidence of two parts of a step that damps: friction that the first one has not damped the second one may damp.
fn together<Y: Metriplectic>(first: &Taken<Y>, second: &Taken<Y>) -> Evidence {
    let friction = second.evidence.friction;
    Evidence { friction, ..first.evidence.and(second.evidence) }
}

impl Parts {
    /// The two halves of a step that was not solved whole.
    fn halves<Y: Metriplectic>(
        &mut self,
        start: &Start<'_, Y>,
        memory: &mut StageMemory<Dim<Y>>,
        depth: usize,
    ) -> Result<Taken<Y>, Failed<Y>> {
        self.effort.splits += 1;
        let h = 0.5 * start.h;
        let first = self.half(&Start { h, ..*start }, memory, depth)?;
        let second = self.half(&after(start, &first, h), memory, depth)?;
        let evidence = first.evidence.and(second.evidence);
        Ok(Taken { evidence, ..second })
    }

    /// One half.
    fn half<Y: Metriplectic>(
        &mut self,
        start: &Start<'_, Y>,
        memory: &mut StageMemory<Dim<Y>>,
        depth: usize,
    ) -> Result<Taken<Y>, Failed<Y>> {
        match self.part(start, memory, Fallbacks::FirstTries) {
            Err(failed) if depth >= self.splits => Err(failed),
            Err(_) => self.halves(start, memory, depth + 1),
            taken => taken,
        }
    }

    /// The parts of a step that damps, each twice as long as the one before it.
    fn graded<Y: Metriplectic>(
        &mut self,
        start: &Start<'_, Y>,
        memory: &mut StageMemory<Dim<Y>>,
    ) -> Result<Taken<Y>, Failed<Y>> {
        let least = smallest_part(1.0, self.splits);
        let (mut done, mut fraction) = (0.0, self.first_part(start).max(least));
        // What has to be done before the rest is tried again.
        let mut enough = 0.0;
        let mut reached: Option<Taken<Y>> = None;
        for _ in 0..TRIALS {
            let rest = 1.0 - done;
            let is_last = fraction >= rest;
            let size = start.h * if is_last { rest } else { fraction };
            self.effort.splits += usize::from(!is_last);
            let part = match &reached {
                Some(before) => {
                    self.part(&after(start, before, size), memory, Fallbacks::FirstTries)
                }
                None => self.part(&Start { h: size, ..*start }, memory, Fallbacks::FirstTries),
            };
            match part {
                Ok(next) => {
                    let evidence =
                        reached.as_ref().map_or(next.evidence, |before| together(before, &next));
                    let next = Taken { evidence, ..next };
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
                            return Ok(Taken { evidence: together(before, &next), ..next });
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
    fn first_part<Y: Metriplectic>(&self, start: &Start<'_, Y>) -> f64 {
        let &Start { system, x, h, values, .. } = start;
        let equation = StageEquation::new(self.tableau, system, x, values, h);
        let rest = [Vector::<Y::Manifold>::zero(); STAGES];
        let friction = Linear::of(&equation, &rest).map_or(0.0, |linear| linear.friction);
        let mut fraction = 0.5;
        while fraction * friction > FIRST && fraction > f64::MIN_POSITIVE {
            fraction *= 0.5;
        }
        fraction
    }

    /// One part.
    fn part<Y: Metriplectic>(
        &mut self,
        start: &Start<'_, Y>,
        memory: &mut StageMemory<Dim<Y>>,
        fallbacks: Fallbacks,
    ) -> Result<Taken<Y>, Failed<Y>> {
        match try_step(self.tableau, start, memory, fallbacks) {
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
    fn error<Y: Metriplectic>(&self, start: &Start<'_, Y>, failed: &Failed<Y>) -> StepError {
        let &Start { system, time, h, values, .. } = start;
        let tried = self.effort;
        if let Some(error) = failed.failure.cause.first_law(time, h) {
            return error;
        }
        let suggested = smallest_part(h, self.splits);
        let part = StageEquation::new(self.tableau, system, start.x, values, suggested);
        let rest = [Vector::<Y::Manifold>::zero(); STAGES];
        let residual = part.evaluate(&rest).map_or(f64::INFINITY, |at| {
            at.residual.iter().map(Column::magnitude).fold(0.0, f64::max)
        });
        if let Some(linear) = Linear::of(&StageEquation { h: failed.h, ..part }, &rest)
            && linear.friction > f64::max(1.0, linear.rotation)
        {
            let stiffness = linear.friction * (h / failed.h);
            let damps = self.tableau.one_sided;
            return StepError::StiffFriction { time, h, stiffness, residual, tried, damps };
        }
        match (failed.failure.cause, system.dependent_invariant(&failed.x)) {
            (Cause::Edge, _) => StepError::OutOfDomain { time, h, tried },
            (_, Some((index, fraction))) => {
                let change = start.accumulated_error.invariants[index].abs();
                StepError::DependentInvariants { time, index, change, fraction }
            }
            _ => StepError::NotConverged { time, h, residual, tried, suggested },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collocation::tableau::RADAU;
    use crate::step::StepStart;
    use metriplectic_dynamics::{FieldDissipation, Poisson, System};
    use metriplectic_fields::Real;
    use metriplectic_manifolds::Euclidean;
    use nalgebra::{Vector3, matrix, vector};

    #[test]
    fn the_first_part_is_some_times_of_the_friction() {
        // p' = −p γ beside a bath: h|K'| = γ h.
        let structure = matrix![0.0, 1.0, 0.0; -1.0, 0.0, 0.0; 0.0, 0.0, 0.0];
        let system = System::on(Euclidean::<3>)
            .bracket(Poisson::constant(structure).unwrap())
            .energy(|x: &Vector3<Real>| (x.x * x.x + x.y * x.y) * 0.5 + x.z)
            .entropy(|x: &Vector3<Real>| x.z)
            .dissipation(FieldDissipation(|_: &Vector3<Real>, w: &Vector3<Real>| {
                let b = Vector3::new(0.0.into(), w.z, -w.y);
                b * b.transpose() * (Real::from(1.0) / w.z)
            }))
            .build()
            .unwrap();
        let x = vector![1.0, 0.0, 0.0];
        for h in [1e3, 1e5, 1e7] {
            let start = Start::of(&StepStart::first(&system, &x), h);
            let parts = Parts { tableau: &RADAU[1], splits: 60, effort: Effort::default() };
            let first = h * parts.first_part(&start);
            assert!((2.0..=4.0).contains(&first), "{first}");
        }
    }
}
