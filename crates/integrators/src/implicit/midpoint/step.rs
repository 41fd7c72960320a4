//! One step of the midpoint scheme of a model in plain numbers: guess, solve, end; then the last digits. As in
//! [`crate::midpoint`], whose rules it follows.

use metriplectic_equations::ENERGY;

use super::equation::{Dissipated, Equation, Linearised};
use super::fallbacks::StepFailure;
use super::level::Polished;
use super::memory::MidpointNumbers;
use super::newton::{Inverse, Root};
use super::restored;
use crate::implicit::algebra::dot;
use crate::implicit::drift;
use crate::implicit::parts::Parts;
use crate::implicit::start::{Around, Start, Step};
use crate::midpoint::step::{MOVES, VERY_STIFF};
use crate::newton::Newton;
use crate::numbers::Lengths;
use crate::round_off::bound::{BROKEN, breaks_first_law};
use crate::step::failure::{Cause, Fallbacks, smallest_part};
use crate::step::{Effort, Evidence, Laws, PathOfStep, StepError};

/// The midpoint scheme with its options.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Midpoint {
    /// Its name in a checkpoint.
    pub(crate) name: fn() -> String,
    /// Its path and its discrete gradient; none for those of one's own, of which plain numbers know nothing.
    pub(crate) line: Option<PathOfStep>,
    /// Solves the equation of a step.
    pub(crate) newton: Newton,
    /// How often a step that is not solved is split in halves.
    pub(crate) splits: usize,
}

/// A solution of the equation of a step.
struct Solved<'a, L: Lengths> {
    equation: Equation<'a, L>,
    root: Root<L>,
    effort: Effort,
    evidence: Evidence,
}

/// A step that was solved, of a model whose force does work.
pub(in crate::implicit) struct Solution<L: Lengths> {
    /// The end of the step.
    pub(in crate::implicit) end: L::State,
    /// The base point `z`.
    pub(in crate::implicit) z: L::State,
    /// The discrete gradients of energy and entropy.
    pub(in crate::implicit) energy: L::Vector,
    pub(in crate::implicit) entropy: L::Vector,
    pub(in crate::implicit) evidence: Evidence,
    pub(in crate::implicit) effort: Effort,
}

/// Evidence about the motion in a solution.
fn evidence<L: Lengths>(parts: &Parts<'_, L>, root: &Root<L>, friction: f64) -> Evidence {
    let rests = (0..parts.n()).all(|i| root.u[i].abs() <= 2.0 * root.round_off[i]);
    let Dissipated { slope_squared, dissipates } = root.evidence;
    let entropy_slope = slope_squared.sqrt();
    Evidence { entropy_slope, dissipates, friction, rests, ..Evidence::default() }
}

/// Returns whether the motion at the start of a step leaves it, by the velocity, which no guess enters, and the inverse of the Jacobian.
#[cold]
fn moves<L: Lengths>(
    start: &Start<'_, L>,
    Root { round_off, .. }: &Root<L>,
    inverse: Option<&Inverse<L>>,
) -> bool {
    let parts = start.parts;
    let Some(velocity) = parts.velocity(start.x) else { return false };
    let explicit = parts.vector(|i| velocity[i] * start.h);
    let d = inverse.map_or_else(|| explicit.clone(), |inverse| inverse.matrix.times(&explicit));
    (0..parts.n()).any(|i| d[i].abs() > MOVES * round_off[i])
}

/// Whether the round-off of a solution is small: if friction is so stiff that the slow motion has no digits beside it, the round-off of
/// the displacement is as large as the displacement, and a state would seem to rest.
fn has_digits<L: Lengths>(
    start: &Start<'_, L>,
    Root { u, round_off, .. }: &Root<L>,
    friction: f64,
) -> bool {
    if friction <= VERY_STIFF {
        return true;
    }
    let parts = start.parts;
    let scales = parts.scales(start.x);
    let is_small = |i: usize| round_off[i] <= 1e-2 * BROKEN * (scales[i] + u[i].abs());
    if (0..parts.n()).all(is_small) {
        return true;
    }
    let (_, dh) = parts.jet(ENERGY, start.x);
    let dh = parts.vector(|i| dh[i].abs());
    dot(&dh, round_off) <= BROKEN * (start.values.energy.abs() + dot(&dh, &scales))
}

impl Midpoint {
    fn line(&self) -> PathOfStep {
        self.line.expect("a run refuses schemes of one's own")
    }

    /// Guesses a step and solves its equation.
    fn solved<'a, L: Lengths>(
        &self,
        start: &Start<'a, L>,
        memory: &mut MidpointNumbers<L>,
        fallbacks: Fallbacks,
    ) -> Result<Solved<'a, L>, Box<StepFailure>> {
        let &Start { parts, x, h, ref values, .. } = start;
        memory.keep_length(parts.n());
        let guess = memory.predictor.guess(start);
        let drift = drift::target(start, &guess);
        let equation = Equation { parts, line: self.line(), x, h, values: values.clone(), drift };
        let kept = &mut memory.jacobian;
        let (root, effort) = equation.solve(&self.newton, &guess, kept, fallbacks)?;
        let evidence = evidence(parts, &root, memory.friction());
        let contradicts = evidence.rests && moves(start, &root, memory.jacobian.inverse.as_ref());
        if contradicts || !has_digits(start, &root, evidence.friction) {
            let cause = Cause::Unsolved;
            return Err(StepFailure { residual: root.residual, cause, effort }.into());
        }
        Ok(Solved { equation, root, effort, evidence })
    }

    /// Solves the equation of a step whose force does work, and adds the digits that earlier steps have lost of the position. What the
    /// step leaves of the laws is for the next one to take back.
    pub(in crate::implicit) fn solution<L: Lengths>(
        &self,
        start: &Start<'_, L>,
        memory: &mut MidpointNumbers<L>,
        fallbacks: Fallbacks,
    ) -> Result<Solution<L>, Box<StepFailure>> {
        let &Start { parts, x, .. } = start;
        let Solved { equation, root, effort, evidence } = self.solved(start, memory, fallbacks)?;
        let edge = || StepFailure { residual: root.residual, cause: Cause::Edge, effort };
        let path = equation.line.path;
        let z = if parts.is_flat() {
            parts.moved(x, &parts.vector(|i| root.u[i] * path.base()))
        } else {
            parts.curved_path(path, x, &root.u, false).ok_or_else(edge)?.z
        };
        let Linearised { energy, entropy, .. } = equation.linearise(&root.u).ok_or_else(edge)?;
        let end = if evidence.rests {
            x.clone()
        } else {
            let end = parts.end(path, x, &root.u).ok_or_else(edge)?;
            memory.predictor.note(parts, [x, &end], &root.u);
            memory.compensation.add(parts, path, [x, &end], &root.u).unwrap_or(end)
        };
        Ok(Solution { end, z, energy, entropy, evidence, effort })
    }

    /// Tries a step whole.
    pub(in crate::implicit) fn try_step<L: Lengths>(
        &self,
        start: &Start<'_, L>,
        memory: &mut MidpointNumbers<L>,
        around: &dyn Around<L>,
        fallbacks: Fallbacks,
    ) -> Result<Step<L>, Box<StepFailure>> {
        let &Start { parts, x, ref values, .. } = start;
        let Solved { equation, root, mut effort, evidence } =
            self.solved(start, memory, fallbacks)?;
        let failed = |cause, effort| StepFailure { residual: root.residual, cause, effort };
        if evidence.rests {
            // What the solver found is its own round-off, and following it would make a random walk of the energy.
            return Ok(Step { x: x.clone(), values: values.clone(), evidence, effort });
        }
        let path = equation.line.path;
        let end = parts.end(path, x, &root.u).ok_or_else(|| failed(Cause::Edge, effort))?;
        // Where the laws hold at the point with the digits that earlier steps have lost, the step goes there.
        let shifted = memory.compensation.shifted(parts, &end);
        let held = shifted.and_then(|shifted| equation.held(&shifted));
        let Polished { u, end, moved, evaluated } = if held.is_some() {
            Polished { u: root.u.clone(), end, moved: false, evaluated: held }
        } else {
            equation.polish(&root, end, &mut effort)
        };
        if around.is_outside(&end) {
            return Err(failed(Cause::Edge, effort).into());
        }
        memory.predictor.note(parts, [x, &end], &u);
        let compensated = if moved {
            memory.compensation.0 = None;
            None
        } else {
            memory.compensation.add(parts, path, [x, &end], &u)
        };
        let evaluated = if compensated.is_some() { held } else { evaluated };
        let x_end = compensated.unwrap_or(end);
        let after = match evaluated {
            Some([energy, entropy]) if parts.kinds.is_empty() => {
                Laws { energy, entropy, invariants: values.invariants.clone() }
            }
            _ => parts.laws(&x_end),
        };
        let (x_end, after) = match restored::restored(start, &x_end, &after) {
            Some(restored) => {
                memory.compensation.0 = None;
                restored
            }
            None => (x_end, after),
        };
        let change = after.energy - values.energy;
        if !after.entropy.is_finite() {
            return Err(failed(Cause::Edge, effort).into());
        }
        let sizes = || parts.sizes_on_a_step([x, &x_end]);
        if let Some(size) = breaks_first_law(change, after.energy, sizes) {
            return Err(failed(Cause::Energy { change, size }, effort).into());
        }
        Ok(Step { x: x_end, values: after, evidence, effort })
    }

    /// The step, whole or in parts.
    pub(in crate::implicit) fn take<L: Lengths>(
        &self,
        start: &Start<'_, L>,
        memory: &mut MidpointNumbers<L>,
        around: &dyn Around<L>,
    ) -> Result<Step<L>, StepError> {
        let failure = match self.try_step(start, memory, around, Fallbacks::All) {
            Ok(taken) => return Ok(taken),
            Err(failure) => failure,
        };
        *memory = MidpointNumbers::default();
        let mut halves = Halves { scheme: self, around, effort: failure.effort };
        let parts =
            if self.splits == 0 { Err((failure, start.x.clone())) } else { halves.of(start, 1) };
        let effort = halves.effort;
        match parts {
            Ok(taken) => Ok(Step { effort, ..taken }),
            Err((smallest, x)) => {
                Err(self.error(start, &smallest, around.dependent_invariant(&x), effort))
            }
        }
    }

    /// Explains a step that was not solved by the failure of its smallest part, with the invariant that depends on the other fields where
    /// it starts.
    #[cold]
    fn error<L: Lengths>(
        &self,
        start: &Start<'_, L>,
        &StepFailure { residual, cause, .. }: &StepFailure,
        dependent: Option<(usize, f64)>,
        tried: Effort,
    ) -> StepError {
        let &Start { parts, x, time, h, ref values, .. } = start;
        if let Some(error) = cause.first_law(time, h) {
            return error;
        }
        let suggested = smallest_part(h, self.splits);
        let (values, drift) = (values.clone(), drift::nothing::<L>(values));
        let equation = Equation { parts, line: self.line(), x, h: suggested, values, drift };
        let here = equation.linearise(&parts.zero());
        let rates = here.map(|at| at.stiffness).unwrap_or_default();
        // Where friction is slow against the smallest part, or slower than the reversible motion, something else is in the way.
        if rates.friction > f64::max(1.0, rates.rotation) {
            let stiffness = rates.friction * (h / suggested);
            return StepError::StiffFriction { time, h, stiffness, residual, tried, damps: false };
        }
        match (cause, dependent) {
            (Cause::Edge, _) => StepError::OutOfDomain { time, h, tried },
            (_, Some((index, fraction))) => {
                let change = start.accumulated_error.invariants.as_ref()[index].abs();
                StepError::DependentInvariants { time, index, change, fraction }
            }
            _ => StepError::NotConverged { time, h, residual, tried, suggested },
        }
    }
}

/// The parts of a step that was not solved whole.
struct Halves<'a, L: Lengths> {
    scheme: &'a Midpoint,
    around: &'a dyn Around<L>,
    /// The effort of all parts.
    effort: Effort,
}

/// A part that was not taken, and where it starts.
type Failed<L> = (Box<StepFailure>, <L as Lengths>::State);

impl<L: Lengths> Halves<'_, L> {
    /// The two halves of a step that was not solved whole; if they were not solved either, where the smallest part of them starts.
    fn of(&mut self, start: &Start<'_, L>, depth: usize) -> Result<Step<L>, Failed<L>> {
        self.effort.splits += 1;
        let mut memory = MidpointNumbers::default();
        let first = self.half(start, start.x, depth, &mut memory)?;
        let second = self.half(start, &first.x, depth, &mut memory)?;
        let evidence = first.evidence.and(second.evidence);
        Ok(Step { evidence, ..second })
    }

    /// One half, which starts at `x`.
    fn half(
        &mut self,
        start: &Start<'_, L>,
        x: &L::State,
        depth: usize,
        memory: &mut MidpointNumbers<L>,
    ) -> Result<Step<L>, Failed<L>> {
        let values = start.parts.laws(x);
        let mut accumulated_error = start.accumulated_error.clone();
        accumulated_error.energy += values.energy - start.values.energy;
        let part = Start { x, h: 0.5 * start.h, values, accumulated_error, ..*start };
        match self.scheme.try_step(&part, memory, self.around, Fallbacks::FirstTries) {
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
