//! One implicit step: guess, solve, retract, and the last digits.

use metriplectic_dynamics::{Invariants, Metriplectic};
use metriplectic_fields::{ChartPoint, Column, Dimension, ScalarField, Vector};
use metriplectic_manifolds::{Manifold, Retraction};

use super::equation::{Dissipated, Residual};
use super::fallbacks::{self, StepFailure};
use super::memory::MemoryOf;
use super::scheme::Scheme;
use super::{level, restored};
use crate::discrete_gradient::DiscreteGradient;
use crate::newton::{Inverse, Root};
use crate::round_off::bound::{BROKEN, breaks_first_law, sizes_on_a_step};
use crate::round_off::compensation::Displaced;
use crate::round_off::drift;
use crate::step::failure::{Cause, Fallbacks};
use crate::step::{Dim, Effort, Evidence, Flow as _, Laws, Start, Taken, name_of};

/// The name of a scheme in a checkpoint.
pub(crate) fn scheme_name<R, W>() -> String {
    format!("Scheme<{}, {}>", name_of::<R>(), name_of::<W>())
}

/// A solution of the equation of a step.
pub(super) struct Solved<'a, Y: Metriplectic, R, W> {
    pub(super) equation: Residual<'a, Y, R, W>,
    pub(super) root: Root<Y::Manifold, Dissipated>,
    pub(super) effort: Effort,
    pub(super) evidence: Evidence,
}

impl<R, W: DiscreteGradient> Scheme<R, W> {
    /// Guess and solve.
    #[inline]
    pub(super) fn solved<'a, Y>(
        &'a self,
        start: &Start<'a, Y>,
        memory: &mut MemoryOf<Y>,
        fallbacks: Fallbacks,
    ) -> Result<Solved<'a, Y, R, W>, StepFailure>
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric>,
    {
        let system = start.system;
        let guess = memory.predictor.guess(system, start);
        let target = drift::target(system, start, &guess);
        let equation = Residual::of_start(system, self, start, target);
        let (root, effort) =
            fallbacks::solve(&self.newton, &equation, &guess, &mut memory.jacobian, fallbacks)?;
        let evidence = evidence(&root, memory.friction());
        let contradicts = evidence.rests && moves(start, &root, memory.jacobian.inverse.as_ref());
        if contradicts || !has_digits(start, &root, evidence.friction) {
            return Err(StepFailure { residual: root.residual, cause: Cause::Unsolved, effort });
        }
        Ok(Solved { equation, root, effort, evidence })
    }

    /// Guess, solve, retract; then the last digits.
    pub(crate) fn try_step<Y>(
        &self,
        start: &Start<'_, Y>,
        memory: &mut MemoryOf<Y>,
        fallbacks: Fallbacks,
    ) -> Result<Taken<Y>, StepFailure>
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric>,
    {
        let Solved { equation, root, mut effort, evidence } =
            self.solved(start, memory, fallbacks)?;
        let system = start.system;
        let failed = |cause, effort| StepFailure { residual: root.residual, cause, effort };
        if evidence.rests {
            // What the solver found is its own round-off, and following it would make a random walk of
            // the energy.
            return Ok(Taken { x: start.x.clone(), values: start.values, evidence, effort });
        }
        let end = self.retraction.end(system.metric(), start.x, &root.u);
        let end = end.map_err(|_| failed(Cause::Edge, effort))?;
        // Where the laws hold at the point with the digits that earlier steps have lost, the step goes there.
        let shifted = memory.compensation.shifted::<Y::Manifold>(&end);
        let held = shifted.and_then(|shifted| level::held(&equation, &shifted));
        let level::Polished { u, end, moved, evaluated } = if held.is_some() {
            level::Polished { u: root.u, end, moved: false, evaluated: held }
        } else {
            level::polish(&equation, &root, end, &mut effort)
        };
        // Outside an open chart the defect is infinite: there is no state to go on from.
        if system.manifold().defect(&end).is_infinite() {
            return Err(failed(Cause::Edge, effort));
        }
        memory.predictor.note::<Y::Manifold>(start.x, &u, &end);
        let compensated = if moved {
            memory.compensation.clear();
            None
        } else {
            let lost =
                |x: &_, d: &_, end: &_| self.retraction.lost_digits(system.metric(), x, d, end);
            let step = Displaced { x: start.x, d: &u, end: &end };
            memory.compensation.add::<Y::Manifold>(lost, &step)
        };
        let evaluated = if compensated.is_some() { held } else { evaluated };
        let x = compensated.unwrap_or(end);
        // The last digits of the end, which no residual has seen, may be beyond the edge.
        let values = match evaluated {
            Some([energy, entropy]) if Y::Invariants::COUNT == 0 => {
                Laws { energy, entropy, ..start.values }
            }
            _ => system.laws(&x),
        };
        let (x, values) = match restored::restored(start, &x, &values, equation.is_exact()) {
            Some(restored) => {
                memory.compensation.clear();
                restored
            }
            None => (x, values),
        };
        let change = values.energy - start.values.energy;
        if !values.entropy.is_finite() {
            return Err(failed(Cause::Edge, effort));
        }
        let sizes = || sizes_on_a_step(system, [start.x, &x]);
        if let Some(size) = breaks_first_law(change, values.energy, sizes) {
            return Err(failed(Cause::Energy { change, size }, effort));
        }
        Ok(Taken { x, values, evidence, effort })
    }
}

/// Evidence about the motion in a solution.
fn evidence<M: Manifold>(root: &Root<M, Dissipated>, friction: f64) -> Evidence {
    let rests = (0..Vector::<M>::LEN).all(|i| root.u[i].abs() <= 2.0 * root.round_off[i]);
    let Dissipated { slope_squared, dissipates } = root.evidence;
    Evidence {
        entropy_slope: slope_squared.sqrt(),
        dissipates,
        friction,
        rests,
        ..Evidence::default()
    }
}

/// The displacement by the velocity at a state, in units of round-off, from which on the state does not rest.
/// A factor of four fails `midpoint/step.rs::a_state_with_a_velocity_does_not_rest`.
pub(crate) const MOVES: f64 = 100.0;

/// Returns whether the motion at the start of a step leaves it, by the velocity, which no guess enters, and the inverse of the
/// Jacobian.
#[cold]
fn moves<Y: Metriplectic>(
    start: &Start<'_, Y>,
    Root { round_off, .. }: &Root<Y::Manifold, Dissipated>,
    inverse: Option<&Inverse<Dim<Y>>>,
) -> bool {
    let at = ChartPoint::<Y::Manifold>::centre(start.x);
    let Ok(velocity) = start.system.velocity(&at) else { return false };
    let explicit = velocity * start.h;
    let d = inverse.map_or(explicit, |inverse| inverse.matrix * explicit);
    (0..Dim::<Y>::LEN).any(|i| d[i].abs() > MOVES * round_off[i])
}

/// The rate `h|K'|` of friction from which on the round-off of a solution may be large.
/// A factor of four fails `midpoint/step.rs::a_solution_without_digits_is_one_of_very_stiff_friction`.
pub(crate) const VERY_STIFF: f64 = 1e8;

/// Whether the round-off of a solution is small: if friction is so stiff that the slow motion has no digits
/// beside it, the round-off of the displacement is as large as the displacement, and a state would seem to
/// rest. It is measured by the energy that goes with it, which has one unit for all components.
fn has_digits<Y: Metriplectic>(
    start: &Start<'_, Y>,
    Root { u, round_off, .. }: &Root<Y::Manifold, Dissipated>,
    friction: f64,
) -> bool {
    if friction <= VERY_STIFF {
        return true;
    }
    let scales = Y::Manifold::scales(start.x);
    if (0..Dim::<Y>::LEN).all(|i| round_off[i] <= 1e-2 * BROKEN * (scales[i] + u[i].abs())) {
        return true;
    }
    let dh = start.system.energy().jet1(start.x).df.abs();
    dh.dot(round_off) <= BROKEN * (start.values.energy.abs() + dh.dot(&scales))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::step::StepStart;
    use metriplectic_dynamics::{Symplectic, System};
    use metriplectic_fields::Real;
    use metriplectic_manifolds::Euclidean;
    use nalgebra::{Vector2, vector};

    #[test]
    fn a_state_with_a_velocity_does_not_rest() {
        let system = System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5)
            .build()
            .unwrap();
        let moves = |p: f64| {
            let x = vector![0.0, p];
            let start = Start::of(&StepStart::first(&system, &x), 0.5);
            let evidence = Dissipated { slope_squared: 1.0, dissipates: false };
            let (u, round_off) = (vector![0.0, 0.0], vector![1e-16, 1e-16]);
            let root =
                Root { u, residual: 0.0, round_off, residual_bound: 1.0, iterations: 1, evidence };
            moves(&start, &root, None)
        };
        assert!(moves(4e-14) && !moves(1e-14));
    }

    #[test]
    fn a_solution_without_digits_is_one_of_very_stiff_friction() {
        let system = System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5)
            .build()
            .unwrap();
        let x = vector![1.0, 1.0];
        let start = Start::of(&StepStart::first(&system, &x), 0.1);
        let evidence = Dissipated { slope_squared: 1.0, dissipates: true };
        let root = Root {
            u: vector![0.1, 0.1],
            residual: 0.0,
            round_off: vector![0.1, 0.1],
            residual_bound: 1.0,
            iterations: 1,
            evidence,
        };
        assert!(has_digits(&start, &root, 5e7) && !has_digits(&start, &root, 2e8));
    }
}
