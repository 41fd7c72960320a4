//! The fallbacks where Newton's method does not solve the equation of a step, in the order of the
//! [module](super).

use metriplectic_dynamics::{Metriplectic, system::Point};
use metriplectic_fields::{Column, Space, Square, Vector};
use metriplectic_manifolds::{Manifold, Retraction};

use super::equation::{Dissipated, Residual};
use super::jacobian::KeptJacobian;
use super::memory::MemoryOf;
use super::scheme::Scheme;
use crate::discrete_gradient::DiscreteGradient;
use crate::newton::{Equation, Inverse, Iterate, Newton, Root};
use crate::step::failure::{Cause, Fallbacks, continue_in_step_size, smallest_part};
use crate::step::{Dim, Effort, Flow as _, Laws, Start, StepError, Taken};

/// A step that was not taken.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepFailure {
    /// The smallest residual that was found.
    pub(crate) residual: f64,
    /// Why it was not taken.
    pub(crate) cause: Cause,
    /// The effort of the tries.
    pub(crate) effort: Effort,
}

/// The parts of a step that was not solved whole.
struct Halves<'a, R, W> {
    scheme: &'a Scheme<R, W>,
    /// The effort of all parts.
    effort: Effort,
}

impl<R, W: DiscreteGradient> Scheme<R, W> {
    /// The step, whole or in parts.
    pub(crate) fn with_halves<Y>(
        &self,
        start: &Start<'_, Y>,
        memory: &mut MemoryOf<Y>,
    ) -> Result<Taken<Y>, StepError>
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric>,
    {
        let failure = match self.try_step(start, memory, Fallbacks::All) {
            Ok(taken) => return Ok(taken),
            Err(failure) => failure,
        };
        *memory = MemoryOf::<Y>::default();
        let mut halves = Halves { scheme: self, effort: failure.effort };
        let parts =
            if self.splits == 0 { Err((failure, start.x.clone())) } else { halves.of(start, 1) };
        let effort = halves.effort;
        match parts {
            Ok(taken) => Ok(Taken { effort, ..taken }),
            Err((smallest, x)) => Err(self.error(start, smallest, &x, effort)),
        }
    }

    /// Explains a step that was not solved by the failure of its smallest part, which
    /// starts at `x`.
    #[cold]
    fn error<Y>(
        &self,
        start: &Start<'_, Y>,
        failure: StepFailure,
        x: &Point<Y>,
        tried: Effort,
    ) -> StepError
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric>,
    {
        let Start { system, time, h, .. } = *start;
        let StepFailure { residual, cause, .. } = failure;
        if let Some(error) = failure.cause.first_law(time, h) {
            return error;
        }
        let suggested = smallest_part(h, self.splits);
        let equation = Residual::new(system, self, start.x, suggested);
        let here = equation.linearise(&Vector::<Y::Manifold>::zero());
        let rates = here.map(|at| at.stiffness).unwrap_or_default();
        // Where friction is slow against the smallest part, or slower than the reversible motion, something
        // else is in the way.
        if rates.friction > f64::max(1.0, rates.rotation) {
            let stiffness = rates.friction * (h / suggested);
            return StepError::StiffFriction { time, h, stiffness, residual, tried, damps: false };
        }
        match (cause, system.dependent_invariant(x)) {
            (Cause::Edge, _) => StepError::OutOfDomain { time, h, tried },
            (_, Some((index, fraction))) => {
                let change = start.accumulated_error.invariants[index].abs();
                StepError::DependentInvariants { time, index, change, fraction }
            }
            _ => StepError::NotConverged { time, h, residual, tried, suggested },
        }
    }
}

impl<R, W: DiscreteGradient> Halves<'_, R, W> {
    /// The two halves of a step that was not solved whole; if they were not solved either, where the
    /// smallest part of them starts.
    fn of<Y>(
        &mut self,
        start: &Start<'_, Y>,
        depth: usize,
    ) -> Result<Taken<Y>, (StepFailure, Point<Y>)>
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric>,
    {
        self.effort.splits += 1;
        let mut memory = MemoryOf::<Y>::default();
        let first = self.half(start, start.x, depth, &mut memory)?;
        let second = self.half(start, &first.x, depth, &mut memory)?;
        let evidence = first.evidence.and(second.evidence);
        Ok(Taken { evidence, ..second })
    }

    /// One half, which starts at `x`.
    fn half<Y>(
        &mut self,
        start: &Start<'_, Y>,
        x: &Point<Y>,
        depth: usize,
        memory: &mut MemoryOf<Y>,
    ) -> Result<Taken<Y>, (StepFailure, Point<Y>)>
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric>,
    {
        let h = 0.5 * start.h;
        let laws = start.system.laws(x);
        let energy = start.accumulated_error.energy + (laws.energy - start.values.energy);
        let accumulated_error = Laws { energy, ..start.accumulated_error };
        let part = Start { x, h, values: laws, accumulated_error, ..*start };
        match self.scheme.try_step(&part, memory, Fallbacks::FirstTries) {
            Ok(taken) => {
                self.effort += taken.effort;
                Ok(taken)
            }
            Err(failure) => {
                self.effort += failure.effort;
                if depth >= self.scheme.splits {
                    return Err((failure, x.clone()));
                }
                self.of(&part, depth + 1)
            }
        }
    }
}

/// Solves the equation of a step near a guess, first with the Jacobian that is kept.
pub(super) fn solve<Y, R, W>(
    newton: &Newton,
    equation: &Residual<'_, Y, R, W>,
    guess: &Vector<Y::Manifold>,
    kept: &mut KeptJacobian<Dim<Y>>,
    fallbacks: Fallbacks,
) -> Result<(Root<Y::Manifold, Dissipated>, Effort), StepFailure>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    let h = equation.step_size();
    kept.prepare(h, guess);
    let known = kept.inverse.is_some();
    let root = newton.solve_near(equation, guess, &mut kept.inverse);
    let mut effort = Effort { iterations: iterations(&root), ..Effort::default() };
    let root = match root {
        Ok(root) => root,
        Err(failure) => {
            let mut rescue = Rescue { newton, equation, inverse: &mut kept.inverse, effort };
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
        && (!known || inverse.age == 0)
    {
        kept.note(h, &root.u);
    }
    Ok((root, effort))
}

/// The tries after Newton's method from the guess.
struct Rescue<'a, 'b, Y: Metriplectic, R, W> {
    newton: &'a Newton,
    equation: &'a Residual<'b, Y, R, W>,
    inverse: &'a mut Option<Inverse<Dim<Y>>>,
    effort: Effort,
}

impl<Y, R, W> Rescue<'_, '_, Y, R, W>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    /// Newton's method from a guess, with its best point if it does not converge.
    fn newton(
        &mut self,
        newton: &Newton,
        guess: &Vector<Y::Manifold>,
        best: &mut Iterate<Y::Manifold>,
    ) -> Option<Root<Y::Manifold, Dissipated>> {
        let solved = newton.solve_near(self.equation, guess, self.inverse);
        self.effort.iterations += iterations(&solved);
        solved
            .map_err(|failure| {
                if failure.residual < best.residual {
                    *best = failure;
                }
            })
            .ok()
    }

    /// A root, in the order of the [module](super).
    #[cold]
    fn solve(
        &mut self,
        failure: Iterate<Y::Manifold>,
        fallbacks: Fallbacks,
    ) -> Result<Root<Y::Manifold, Dissipated>, StepFailure> {
        let mut best = failure;
        let whole = *self.newton;
        let direct = Newton { iterations: DIRECT.min(whole.iterations), ..whole };
        let mut solved = self.newton(&direct, &Vector::<Y::Manifold>::zero(), &mut best);
        let all = fallbacks == Fallbacks::All;
        if all
            && solved.is_none()
            && let Some(near) = self.continue_in_step_size()
        {
            solved = self.newton(&whole, &near, &mut best);
        }
        solved.ok_or_else(|| {
            let edge = at_edge(self.equation, &best.best);
            let cause = if edge { Cause::Edge } else { Cause::Unsolved };
            StepFailure { residual: best.residual, cause, effort: self.effort }
        })
    }

    /// The displacement of the last of a row of steps of growing sizes from the same start, up to
    /// that of the equation: the branch of solutions that begins at rest is followed along its tangents. A
    /// solution counts as one of this branch if it is near its prediction.
    fn continue_in_step_size(&mut self) -> Option<Vector<Y::Manifold>> {
        self.effort.continued += 1;
        // The points on the way need not be solved to round-off.
        let newton = Newton { tolerance: 1e3, iterations: DIRECT, halvings: 2, ..*self.newton };
        continue_in_step_size(Vector::<Y::Manifold>::zero(), |(u, fraction), next| {
            let equation = self.equation.of_fraction(next);
            self.effort.iterations += 1;
            let at = equation.linearise(&u)?;
            let step = at.jacobian.solve(&at.residual)?;
            // The branch begins as a straight line: the implicit displacement is the explicit one.
            let bends = (step - at.residual).magnitude() > NEARBY * step.magnitude();
            if fraction <= 0.0 && bends {
                return None;
            }
            let predicted = u - step;
            let solved = newton.solve_near(&equation, &predicted, &mut None);
            self.effort.iterations += iterations(&solved);
            let root = solved.ok()?.u;
            let error = (root - predicted).magnitude();
            (error <= NEARBY * (root - u).magnitude()).then_some(root)
        })
    }
}

/// The linear systems that Newton's method has solved.
fn iterations<M: Space, E>(solved: &Result<Root<M, E>, Iterate<M>>) -> usize {
    solved.as_ref().map_or_else(|best| best.iterations, |root| root.iterations)
}

/// A solution belongs to a branch if it is off its prediction by no more than this fraction of the way.
/// A factor of four fails `tests/mutations.rs::each_part_of_a_step_conserves_the_momentum_of_its_start`.
pub(crate) const NEARBY: f64 = 0.1;
/// Linear systems after which a way from rest is no longer direct, and its end no longer likely to be
/// the solution that belongs to the start.
/// A factor of four fails `tests/stiff.rs::a_step_to_the_edge_of_a_logarithm_does_not_excuse_its_energy`.
pub(crate) const DIRECT: usize = 8;

/// Whether it is the edge of the domain that stops Newton's method at `u`: its correction leads out,
/// cut to the length of the step, because a far longer one, from a Jacobian that is nearly singular,
/// leads out of any domain.
fn at_edge<M: Manifold>(equation: &impl Equation<M>, u: &Vector<M>) -> bool {
    let Some(at) = equation.linearise(u) else { return true };
    let Some(step) = at.jacobian.solve(&at.residual) else { return false };
    let fraction = (u.magnitude() + at.residual.magnitude()) / step.magnitude();
    equation.evaluate(&(*u - step * fraction.min(1.0))).is_none()
}
