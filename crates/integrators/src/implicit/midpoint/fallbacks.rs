//! The fallbacks where Newton's method does not solve the equation of a step, in the order of [`crate::midpoint`].

use super::equation::Equation;
use super::memory::KeptJacobian;
use super::newton::{Inverse, Iterate, Root};
use crate::implicit::algebra::magnitude;
use crate::midpoint::fallbacks::{DIRECT, NEARBY};
use crate::newton::Newton;
use crate::numbers::Lengths;
use crate::step::Effort;
use crate::step::failure::{Cause, Fallbacks, continue_in_step_size};

/// A step that was not taken.
#[derive(Clone, Copy, Debug)]
pub(in crate::implicit) struct StepFailure {
    /// The smallest residual that was found.
    pub(in crate::implicit) residual: f64,
    /// Why it was not taken.
    pub(in crate::implicit) cause: Cause,
    /// The effort of the tries.
    pub(in crate::implicit) effort: Effort,
}

impl<L: Lengths> Equation<'_, L> {
    /// Solves the equation of a step near a guess, first with the Jacobian that is kept.
    pub(super) fn solve(
        &self,
        newton: &Newton,
        guess: &L::Vector,
        kept: &mut KeptJacobian<L>,
        fallbacks: Fallbacks,
    ) -> Result<(Root<L>, Effort), StepFailure> {
        let h = self.h;
        kept.prepare(h, guess);
        let is_known = kept.inverse.is_some();
        let root = self.solve_near(newton, guess, &mut kept.inverse);
        let mut effort = Effort { iterations: iterations(&root), ..Effort::default() };
        let root = match root {
            Ok(root) => root,
            Err(failure) => {
                let inverse = &mut kept.inverse;
                let mut rescue = Rescue { newton, equation: self, inverse, effort };
                let rescued = rescue.solve(failure, fallbacks);
                effort = rescue.effort;
                match rescued {
                    Ok(root) => root,
                    Err(failure) => {
                        kept.inverse = None;
                        return Err(StepFailure { effort, ..failure });
                    }
                }
            }
        };
        if let Some(inverse) = &kept.inverse
            && (!is_known || inverse.age == 0)
        {
            kept.note(h, &root.u);
        }
        Ok((root, effort))
    }

    /// Whether it is the edge of the domain that stops Newton's method at `u`: its correction leads out, cut to the length of the step,
    /// because a far longer one, from a Jacobian that is nearly singular, leads out of any domain.
    fn is_at_edge(&self, u: &L::Vector) -> bool {
        let Some(at) = self.linearise(u) else { return true };
        let Some(step) = at.jacobian.solve(&at.residual) else { return false };
        let fraction = (magnitude(u) + magnitude(&at.residual)) / magnitude(&step);
        let fraction = fraction.min(1.0);
        self.evaluate(&self.parts.vector(|i| u[i] - step[i] * fraction)).is_none()
    }
}

/// The tries after Newton's method from the guess.
struct Rescue<'a, 'b, L: Lengths> {
    newton: &'a Newton,
    equation: &'a Equation<'b, L>,
    inverse: &'a mut Option<Inverse<L>>,
    effort: Effort,
}

impl<L: Lengths> Rescue<'_, '_, L> {
    /// Newton's method from a guess, with its best point if it does not converge.
    fn newton(
        &mut self,
        newton: &Newton,
        guess: &L::Vector,
        best: &mut Iterate<L>,
    ) -> Option<Root<L>> {
        let solved = self.equation.solve_near(newton, guess, self.inverse);
        self.effort.iterations += iterations(&solved);
        solved
            .map_err(|failure| {
                if failure.residual < best.residual {
                    *best = failure;
                }
            })
            .ok()
    }

    /// A root, in the order of [`crate::midpoint`].
    #[cold]
    fn solve(&mut self, failure: Iterate<L>, fallbacks: Fallbacks) -> Result<Root<L>, StepFailure> {
        let mut best = failure;
        let whole = *self.newton;
        let direct = Newton { iterations: DIRECT.min(whole.iterations), ..whole };
        let mut solved = self.newton(&direct, &self.equation.parts.zero(), &mut best);
        if fallbacks == Fallbacks::All
            && solved.is_none()
            && let Some(near) = self.continue_in_step_size()
        {
            solved = self.newton(&whole, &near, &mut best);
        }
        solved.ok_or_else(|| {
            let is_at_edge = self.equation.is_at_edge(&best.best);
            let cause = if is_at_edge { Cause::Edge } else { Cause::Unsolved };
            StepFailure { residual: best.residual, cause, effort: self.effort }
        })
    }

    /// The displacement of the last of a row of steps of growing sizes from the same start, up to that of the equation.
    fn continue_in_step_size(&mut self) -> Option<L::Vector> {
        self.effort.continued += 1;
        // The points on the way need not be solved to round-off.
        let newton = Newton { tolerance: 1e3, iterations: DIRECT, halvings: 2, ..*self.newton };
        let parts = self.equation.parts;
        let less = |a: &L::Vector, b: &L::Vector| parts.vector(|i| a[i] - b[i]);
        continue_in_step_size(parts.zero(), |(u, fraction), next| {
            let equation = self.equation.of_fraction(next);
            self.effort.iterations += 1;
            let at = equation.linearise(&u)?;
            let step = at.jacobian.solve(&at.residual)?;
            // The branch begins as a straight line: the implicit displacement is the explicit one.
            let bends = magnitude(&less(&step, &at.residual)) > NEARBY * magnitude(&step);
            if fraction <= 0.0 && bends {
                return None;
            }
            let predicted = less(&u, &step);
            let solved = equation.solve_near(&newton, &predicted, &mut None);
            self.effort.iterations += iterations(&solved);
            let root = solved.ok()?.u;
            let error = magnitude(&less(&root, &predicted));
            (error <= NEARBY * magnitude(&less(&root, &u))).then_some(root)
        })
    }
}

/// The linear systems that Newton's method has solved.
fn iterations<L: Lengths>(solved: &Result<Root<L>, Iterate<L>>) -> usize {
    solved.as_ref().map_or_else(|best| best.iterations, |root| root.iterations)
}
