//! The fallbacks where the iteration does not solve a step from its guess, in the order of the
//! [module](super).

use metriplectic_dynamics::Metriplectic;
use metriplectic_fields::{Column, Vector};

use super::equation::{StageEquation, Unknowns};
use super::solve::{Budget, Derivatives, Solved, Unsolved};
use super::tableau::STAGES;
use crate::round_off::drift;
use crate::step::Effort;
use crate::step::failure::{self, Cause, Fallbacks};

/// A step that was not taken.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepFailure {
    /// Why it was not taken.
    pub(crate) cause: Cause,
    /// The effort of the tries.
    pub(crate) effort: Effort,
}

/// Corrections from the guess.
pub(crate) const WHOLE: Budget =
    Budget { corrections: 30, tolerance: 1.0, derivatives: Derivatives::InTheMiddle };
/// Corrections from rest.
pub(crate) const FROM_REST: Budget = Budget { corrections: 20, ..WHOLE };
/// Corrections with the derivatives of all stages.
pub(crate) const FULL: Budget = Budget { derivatives: Derivatives::OfAllStages, ..WHOLE };
/// Corrections of a step on the way to a larger one, which need not be solved to round-off.
pub(crate) const ON_THE_WAY: Budget = Budget { corrections: 8, tolerance: 1e6, ..FULL };

/// Solves the equation of a step from a guess, from rest, or by continuation in its size.
pub(super) fn solve<Y: Metriplectic>(
    equation: &StageEquation<'_, Y>,
    guess: Option<Unknowns<Y>>,
    fallbacks: Fallbacks,
    effort: &mut Effort,
) -> Result<Solved<Y>, StepFailure> {
    let mut best = Unsolved { residual: f64::INFINITY, edge: false, evaluations: 0 };
    let mut attempt = |equation: &StageEquation<'_, Y>, guess, budget, effort: &mut Effort| {
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
        && let Ok(solved) = attempt(equation, guess, WHOLE, effort)
    {
        return Ok(solved);
    }
    // Where friction is stiff, to take back a rounding of the energy may ask for more than the motion gives.
    let drift = if equation.tableau.one_sided { drift::nothing::<Y>() } else { equation.drift };
    let equation = &StageEquation { drift, ..*equation };
    let rest = [Vector::<Y::Manifold>::zero(); STAGES];
    if let Ok(solved) = attempt(equation, rest, FROM_REST, effort) {
        return Ok(solved);
    }
    if let Ok(solved) = attempt(equation, guess.unwrap_or(rest), FULL, effort) {
        return Ok(solved);
    }
    if fallbacks == Fallbacks::All
        && let Some(near) = continue_in_step_size(equation, effort)
        && let Ok(solved) = attempt(equation, near, FULL, effort)
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
    let rest = [Vector::<Y::Manifold>::zero(); STAGES];
    failure::continue_in_step_size(rest, |(k, fraction), next| {
        // The same displacements: once a step is long for friction they hardly change with its size.
        let guess = if fraction > 0.0 { k.map(|k| k * (fraction / next)) } else { k };
        let solved = equation.of_fraction(next).solve(guess, ON_THE_WAY);
        effort.iterations += match &solved {
            Ok(solved) => solved.evaluations,
            Err(unsolved) => unsolved.evaluations,
        };
        Some(solved.ok()?.k)
    })
}
