//! What is done where the iteration does not solve a step from its guess; in the order of the
//! [module](super).

use metriplectic_dynamics::Metriplectic;
use metriplectic_fields::{Column, Vector};

use super::equation::{StageEquation, Unknowns};
use super::linear::Linear;
use super::memory::StageMemory;
use super::solve::{Budget, Derivatives, Solved, Unsolved};
use super::step::try_step;
use super::tableau::{STAGES, Tableau};
use crate::method::{Effort, Laws, Taken};
use crate::midpoint::{Dim, Start, dependent_invariant};
use crate::step_error::StepError;
use crate::step_failure::{Cause, Fallbacks};

/// A step that was not taken.
#[derive(Clone, Copy, Debug)]
pub(super) struct StepFailure {
    /// Why it was not taken.
    pub(super) cause: Cause,
    /// What was done.
    pub(super) effort: Effort,
}

/// Corrections from the guess.
const WHOLE: Budget =
    Budget { corrections: 30, tolerance: 1.0, derivatives: Derivatives::InTheMiddle };
/// Corrections from rest.
const FROM_REST: Budget = Budget { corrections: 20, ..WHOLE };
/// The same with the derivatives of all stages.
const FULL: Budget = Budget { derivatives: Derivatives::OfAllStages, ..WHOLE };
/// Those of a step on the way to a larger one, which need not be solved to round-off.
const ON_THE_WAY: Budget = Budget { corrections: 8, tolerance: 1e6, ..FULL };
/// Steps of growing sizes that may be tried to get to the size that is asked for.
const INCREMENTS: usize = 200;
/// The fraction of what has been reached below which an increment of the size means that the branch of solutions
/// ends there.
const LEAST: f64 = 1e-4;

/// Solves the equation of a step from a guess, from rest, or by continuation in its size.
pub(super) fn solve<Y: Metriplectic>(
    equation: &StageEquation<'_, Y>,
    guess: Option<Unknowns<Y>>,
    fallbacks: Fallbacks,
    effort: &mut Effort,
) -> Result<Solved<Y>, StepFailure> {
    let mut best = Unsolved { residual: f64::INFINITY, edge: false, evaluations: 0 };
    let mut attempt = |guess: Unknowns<Y>, budget, effort: &mut Effort| {
        let solved = equation.solve(guess, budget);
        effort.iterations += match &solved {
            Ok(solved) => solved.evaluations,
            Err(unsolved) => unsolved.evaluations,
        };
        solved.map_err(|unsolved| {
            if unsolved.residual < best.residual || best.evaluations == 0 {
                best = unsolved;
            }
        })
    };
    if let Some(guess) = guess
        && let Ok(solved) = attempt(guess, WHOLE, effort)
    {
        return Ok(solved);
    }
    let rest = [Vector::<Y::Manifold>::zero(); STAGES];
    if let Ok(solved) = attempt(rest, FROM_REST, effort) {
        return Ok(solved);
    }
    if let Ok(solved) = attempt(guess.unwrap_or(rest), FULL, effort) {
        return Ok(solved);
    }
    if fallbacks == Fallbacks::All
        && let Some(near) = continue_in_step_size(equation, effort)
        && let Ok(solved) = attempt(near, FULL, effort)
    {
        return Ok(solved);
    }
    let cause = if best.edge { Cause::Edge } else { Cause::Unsolved };
    Err(StepFailure { cause, effort: *effort })
}

/// The velocities of the last of a row of steps of growing sizes from the same start, up to the size of the
/// equation: each begins on the polynomial of the one before.
fn continue_in_step_size<Y: Metriplectic>(
    equation: &StageEquation<'_, Y>,
    effort: &mut Effort,
) -> Option<Unknowns<Y>> {
    effort.continued += 1;
    let mut k = [Vector::<Y::Manifold>::zero(); STAGES];
    let (mut fraction, mut increment) = (0.0, 0.125);
    for _ in 0..INCREMENTS {
        let next = f64::min(fraction + increment, 1.0);
        // The same displacements: once a step is long for friction they hardly change with its size.
        let guess = if fraction > 0.0 { k.map(|k| k * (fraction / next)) } else { k };
        let part = equation.of_fraction(next);
        let solved = part.solve(guess, ON_THE_WAY);
        effort.iterations += match &solved {
            Ok(solved) => solved.evaluations,
            Err(unsolved) => unsolved.evaluations,
        };
        match solved {
            Ok(solved) if next >= 1.0 => return Some(solved.k),
            Ok(solved) => (k, fraction, increment) = (solved.k, next, 2.0 * increment),
            Err(_) => increment *= 0.25,
        }
        if increment <= LEAST * fraction {
            return None;
        }
    }
    None
}

/// The step, whole or in parts.
pub(super) fn with_halves<Y: Metriplectic>(
    tableau: &'static Tableau,
    splits: usize,
    system: &Y,
    start: &Start<'_, Y>,
    memory: &mut StageMemory<Dim<Y>>,
) -> Result<Taken<Y>, StepError> {
    let failure = match try_step(tableau, system, start, memory, Fallbacks::All) {
        Ok(taken) => return Ok(taken),
        Err(failure) => failure,
    };
    let kept = *memory;
    *memory = StageMemory::default();
    let mut halves = Halves { tableau, splits, system, effort: failure.effort };
    let parts =
        if splits == 0 { Err((failure, start.x.clone())) } else { halves.of(start, memory, 1) };
    let effort = halves.effort;
    match parts {
        Ok(taken) => {
            memory.last = None;
            Ok(Taken { effort, ..taken })
        }
        Err((failure, x)) => {
            *memory = kept;
            Err(halves.error(start, failure, &x))
        }
    }
}

/// The parts of a step that was not solved whole.
struct Halves<'a, Y: Metriplectic> {
    tableau: &'static Tableau,
    splits: usize,
    system: &'a Y,
    /// What all of the parts took.
    effort: Effort,
}

/// A part that failed, and where it starts.
type Failed<Y> = (StepFailure, metriplectic_dynamics::system::Point<Y>);

impl<Y: Metriplectic> Halves<'_, Y> {
    /// The two halves of a step that was not solved whole.
    fn of(
        &mut self,
        start: &Start<'_, Y>,
        memory: &mut StageMemory<Dim<Y>>,
        depth: usize,
    ) -> Result<Taken<Y>, Failed<Y>> {
        self.effort.splits += 1;
        let h = 0.5 * start.h;
        let first = self.part(&Start { h, ..*start }, memory, depth)?;
        let laws = first.values;
        let change = |after: f64, before: f64| after - before;
        let accumulated_error = Laws {
            energy: start.accumulated_error.energy + change(laws.energy, start.values.energy),
            ..start.accumulated_error
        };
        let next = Start { x: &first.x, h, values: laws, accumulated_error, ..*start };
        let second = self.part(&next, memory, depth)?;
        let evidence = first.evidence.and(second.evidence);
        Ok(Taken { evidence, ..second })
    }

    /// One half.
    fn part(
        &mut self,
        start: &Start<'_, Y>,
        memory: &mut StageMemory<Dim<Y>>,
        depth: usize,
    ) -> Result<Taken<Y>, Failed<Y>> {
        match try_step(self.tableau, self.system, start, memory, Fallbacks::FirstTries) {
            Ok(taken) => {
                self.effort += taken.effort;
                Ok(taken)
            }
            Err(failure) => {
                self.effort += failure.effort;
                if depth >= self.splits {
                    return Err((failure, start.x.clone()));
                }
                self.of(start, memory, depth + 1)
            }
        }
    }

    /// What a user is told of a step that was not solved, by what became of its smallest part.
    #[cold]
    fn error(
        &self,
        start: &Start<'_, Y>,
        failure: StepFailure,
        x: &super::PointOf<Y>,
    ) -> StepError {
        let &Start { time, h, values, .. } = start;
        let tried = self.effort;
        if let Some(error) = failure.cause.first_law(time, h) {
            return error;
        }
        let suggested = (0..self.splits).fold(h, |part, _| 0.5 * part);
        let part = StageEquation::new(self.tableau, self.system, start.x, values, suggested);
        let rest = [Vector::<Y::Manifold>::zero(); STAGES];
        let residual = part.evaluate(&rest).map_or(f64::INFINITY, |at| {
            at.residual.iter().map(Column::magnitude).fold(0.0, f64::max)
        });
        if let Some(linear) = Linear::of(&part, &rest)
            && linear.friction > f64::max(1.0, linear.rotation)
        {
            let stiffness = linear.friction * (h / suggested);
            return StepError::StiffFriction { time, h, stiffness, residual, tried };
        }
        match (failure.cause, dependent_invariant(self.system, x)) {
            (Cause::Edge, _) => StepError::OutOfDomain { time, h, tried },
            (_, Some((index, fraction))) => {
                let change = start.accumulated_error.invariants[index].abs();
                StepError::DependentInvariants { time, index, change, fraction }
            }
            _ => StepError::NotConverged { time, h, residual, tried, suggested },
        }
    }
}
