//! The fallbacks where the iteration does not solve a step from its guess, in the order of [`crate::collocation`].

use super::covectors::{each_stage, zeros};
use super::equation::{StageEquation, Unknowns};
use super::linear::Linear;
use super::solve::Solved;
use crate::collocation::fallbacks::{FROM_REST, FULL, ON_THE_WAY, StepFailure, WHOLE};
use crate::collocation::solve::Unsolved;
use crate::implicit::drift;
use crate::numbers::Lengths;
use crate::step::failure::{self, Cause, Fallbacks};
use crate::step::{Effort, Vector as _};

/// The evaluations of a solution, or of a try.
fn evaluations<L: Lengths>(solved: &Result<Solved<L>, Unsolved>) -> usize {
    match solved {
        Ok(solved) => solved.evaluations,
        Err(unsolved) => unsolved.evaluations,
    }
}

/// Solves the equation of a step from a guess, with the derivatives of an earlier step if they are known, from rest, or by continuation in
/// its size.
pub(super) fn solve<'a, L: Lengths>(
    equation: &StageEquation<'a, L>,
    guess: Option<Unknowns<L>>,
    known: Option<Linear<L>>,
    fallbacks: Fallbacks,
    effort: &mut Effort,
) -> Result<Solved<L>, StepFailure> {
    let mut best = Unsolved { residual: f64::INFINITY, edge: false, evaluations: 0 };
    let mut try_near =
        |equation: &StageEquation<'a, L>, guess, budget, known, effort: &mut Effort| {
            let solved = equation.solve_near(guess, budget, known);
            effort.iterations += evaluations(&solved);
            solved.map_err(|unsolved| {
                if unsolved.residual < best.residual || best.evaluations == 0 {
                    best = unsolved;
                }
            })
        };
    if let Some(guess) = &guess
        && let Ok(solved) = try_near(equation, guess.clone(), WHOLE, known, effort)
    {
        return Ok(solved);
    }
    let mut attempt = |equation: &StageEquation<'a, L>, guess, budget, effort: &mut Effort| {
        try_near(equation, guess, budget, None, effort)
    };
    let mut equation = equation.clone();
    if equation.tableau.one_sided {
        // Where friction is stiff, to take back a rounding of the energy may ask for more than the motion gives.
        equation.drift = drift::nothing::<L>(&equation.values);
    }
    let rest = || zeros(equation.parts);
    if let Ok(solved) = attempt(&equation, rest(), FROM_REST, effort) {
        return Ok(solved);
    }
    if let Ok(solved) = attempt(&equation, guess.unwrap_or_else(rest), FULL, effort) {
        return Ok(solved);
    }
    if fallbacks == Fallbacks::All
        && let Some(near) = continue_in_step_size(&equation, effort)
        && let Ok(solved) = attempt(&equation, near, FULL, effort)
    {
        return Ok(solved);
    }
    let cause = if best.edge { Cause::Edge } else { Cause::Unsolved };
    Err(StepFailure { cause, effort: *effort })
}

/// The velocities of the last of a row of steps of growing sizes from the same start, up to the size of the equation: each begins on
/// the polynomial of the one before.
#[cold]
fn continue_in_step_size<L: Lengths>(
    equation: &StageEquation<'_, L>,
    effort: &mut Effort,
) -> Option<Unknowns<L>> {
    effort.continued += 1;
    let (parts, stages) = (equation.parts, equation.tableau.stages);
    failure::continue_in_step_size(zeros(parts), |(k, fraction), next| {
        // The same displacements: once a step is long for friction they hardly change with its size.
        let guess = if fraction > 0.0 {
            each_stage(parts, stages, |i| k[i].map(|k| k * (fraction / next)))
        } else {
            k
        };
        let solved = equation.of_fraction(next).solve(guess, ON_THE_WAY);
        effort.iterations += evaluations(&solved);
        Some(solved.ok()?.k)
    })
}
