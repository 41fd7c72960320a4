//! The iteration for the velocities of the stages.

use metriplectic_dynamics::{Metriplectic, VectorField};
use metriplectic_fields::{ChartPoint, Column as _, Dimension as _, Vector};
use metriplectic_manifolds::Manifold as _;

use super::chart::StepChart;
use super::equation::{Evaluated, StageEquation, Unknowns};
use super::full::Full;
use super::linear::Linear;
use super::tableau::STAGES;
use crate::step::{Dim, Flow as _, Laws, Numbers};

/// A solved step.
pub(super) struct Solved<Y: Metriplectic> {
    /// The velocities of the stages, at the start of the step.
    pub(super) k: Unknowns<Y>,
    /// The last evaluation. Its end and its values are those of `k`.
    pub(super) at: Evaluated<Y>,
    /// The linear part that solved it.
    pub(super) linear: Linear<Dim<Y>>,
    /// The round-off of the displacements.
    pub(super) round_off: Vector<Y::Manifold>,
    /// Evaluations of the equation.
    pub(super) evaluations: usize,
}

impl<Y: Metriplectic> Solved<Y> {
    /// Returns whether all displacements are round-off.
    pub(super) fn rests(&self, &StageEquation { tableau, h, .. }: &StageEquation<'_, Y>) -> bool {
        let Self { k, round_off, .. } = self;
        let is_round_off = |k: &Vector<Y::Manifold>| {
            (0..Dim::<Y>::LEN).all(|c| (h * k[c]).abs() <= 2.0 * round_off[c])
        };
        k[..tableau.stages].iter().all(is_round_off)
    }

    /// Returns whether the motion at the start of the step would leave it, although all displacements are round-off.
    ///
    /// A root that is judged by itself may be rest where nothing rests. So the velocity is asked, which no guess enters.
    #[cold]
    fn contradicts(&self, equation: &StageEquation<'_, Y>) -> bool {
        let at = ChartPoint::<Y::Manifold>::centre(equation.x);
        let mut v = [Vector::<Y::Manifold>::zero(); STAGES];
        for i in 0..equation.tableau.stages {
            let here = match &equation.in_time {
                Some(in_time) => VectorField::velocity(&in_time.systems[i], &at),
                None if i == 0 => equation.system.velocity(&at),
                None => Ok(v[0]),
            };
            let Ok(here) = here else { return false };
            v[i] = here;
        }
        let (_, size) = self.linear.correction(&v, &self.round_off);
        size > MOVES
    }
}

/// A step that was not solved.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unsolved {
    /// The smallest correction, in units of round-off.
    pub(crate) residual: f64,
    /// Whether the equation was not defined on the way.
    pub(crate) edge: bool,
    /// Evaluations of the equation.
    pub(crate) evaluations: usize,
}

/// How far the iteration goes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget {
    /// Corrections.
    pub(crate) corrections: usize,
    /// The correction that counts as solved, in units of its round-off.
    pub(crate) tolerance: f64,
    /// Which derivatives they are computed with.
    pub(crate) derivatives: Derivatives,
}

/// The derivatives that a correction is computed with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Derivatives {
    /// Derivatives of the equation of motion in the middle of the step.
    InTheMiddle,
    /// Derivatives of the equation of the step along all of its unknowns.
    OfAllStages,
}

/// The multiple of round-off at which a correction that no longer falls counts as solved.
pub(crate) const STALL: f64 = 100.0;
/// The multiple of its round-off that the residual may then leave of a law, of which runs are allowed 12.
pub(crate) const STALLED_LAW: f64 = 8.0;
/// The contraction from which on a linear part no longer serves.
/// A factor of four fails `tests/stiff_friction.rs::gas_containers_with_a_wall_that_leaks_fast`.
pub(crate) const SLOW: f64 = 0.3;
/// Halvings of one correction.
/// A factor of four fails `tests/tangent/parts.rs::parts_of_a_step_are_chained`.
pub(crate) const HALVINGS: usize = 8;
/// The fraction of the round-off that a last correction without an evaluation has to promise.
pub(crate) const SURE: f64 = 0.03;

/// The displacement by the velocity at a state, in units of round-off, from which on the state does not rest.
/// A factor of four fails `collocation/solve.rs::a_state_with_a_velocity_does_not_rest`.
pub(crate) const MOVES: f64 = 100.0;

/// The error of the laws at an end, in units of their round-off, above which a better end is looked for.
pub(crate) const HALF: f64 = 0.5;

/// The ratio of a round-off to that after a correction below which it was not known before.
pub(crate) const UNKNOWN: f64 = 0.25;

/// The fraction of the squares of known corrections that the next one may be.
pub(crate) const KNOWN: f64 = 0.25;

/// An evaluation with its correction.
struct Iterate<Y: Metriplectic> {
    k: Unknowns<Y>,
    at: Evaluated<Y>,
    delta: Unknowns<Y>,
    round_off: Vector<Y::Manifold>,
    /// The size of the correction, in units of round-off.
    size: f64,
    /// The error of the laws, in units of round-off.
    excess: f64,
}

impl<Y: Metriplectic> Iterate<Y> {
    /// The remaining error, in units of the round-off of the solution and of the laws.
    fn total(&self) -> f64 {
        self.size.max(self.excess)
    }

    /// Whether less than a fraction is left of another one; near round-off of the laws alone.
    fn is_nearer(&self, other: &Self, fraction: f64) -> bool {
        self.size < fraction * other.size
            || other.size <= STALL && self.total() < fraction * other.total()
    }
}

impl<Y: Metriplectic> Iterate<Y> {
    /// The sums of the squares of the corrections before and here, in units of the round-off here, without the entries
    /// that begin to move: their correction grows, and their round-off was not known before.
    fn known_since(&self, before: &Self) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for c in 0..Dim::<Y>::LEN {
            let unit = self.round_off[c].max(f64::MIN_POSITIVE);
            let [was, is] = [before, self]
                .map(|at| at.delta.iter().map(|v| (v[c] / unit).powi(2)).sum::<f64>());
            let begins = before.round_off[c] < UNKNOWN * self.round_off[c] && is > was;
            if !begins {
                sums = [sums[0] + was, sums[1] + is];
            }
        }
        sums
    }
}

/// The end of a step after the last correction.
struct End<Y: Metriplectic> {
    k: Unknowns<Y>,
    chart: StepChart<Y::Manifold>,
    values: Laws<Numbers<Y>>,
    error: f64,
}

impl<Y: Metriplectic> StageEquation<'_, Y> {
    /// The velocities near a guess, at which the laws hold.
    pub(super) fn solve(&self, guess: Unknowns<Y>, budget: Budget) -> Result<Solved<Y>, Unsolved> {
        let undefined = Unsolved { residual: f64::INFINITY, edge: true, evaluations: 1 };
        let linear = Linear::of(self, &guess).ok_or(undefined)?;
        let equation = StageEquation { rounding: linear.rounding(), ..*self };
        let at = equation.evaluate(&guess).ok_or(undefined)?;
        let mut iteration =
            Iteration { equation, budget, linear, full: None, evaluations: 1, corrections: 0 };
        if budget.derivatives == Derivatives::OfAllStages {
            let correction = iteration.blended(&guess, &at);
            iteration.full = Full::of(&equation, &guess, &at, &correction);
            iteration.evaluations += iteration.full.as_ref().map_or(0, |full| full.evaluations);
        }
        let here = iteration.corrected(guess, at).ok_or(undefined)?;
        let solved = iteration.run(here)?;
        if solved.rests(&equation) && solved.contradicts(&equation) {
            return Err(Unsolved { evaluations: solved.evaluations, edge: false, ..undefined });
        }
        Ok(solved)
    }

    /// The end after the last correction, with the laws evaluated there; `None` if they are off.
    fn last(&self, here: &Iterate<Y>) -> Option<End<Y>> {
        // The balance of an open system needs the stages.
        if self.in_time.is_some() {
            return None;
        }
        let k = moved(here, 1.0);
        let chart = self.chart(&k)?;
        let values = self.system.laws(&chart.end);
        let error = self.error(&values, &here.at.sizes);
        // Not so if it is not a number.
        let conserved = error <= HALF;
        if !conserved || !values.entropy.is_finite() {
            return None;
        }
        Some(End { k, chart, values, error })
    }
}

/// An iteration under way.
struct Iteration<'a, Y: Metriplectic> {
    equation: StageEquation<'a, Y>,
    budget: Budget,
    linear: Linear<Dim<Y>>,
    /// The derivatives of all stages, where these are asked for.
    full: Option<Full>,
    evaluations: usize,
    /// Corrections so far.
    corrections: usize,
}

impl<Y: Metriplectic> Iteration<'_, Y> {
    /// An evaluation with its correction.
    fn corrected(&self, k: Unknowns<Y>, at: Evaluated<Y>) -> Option<Iterate<Y>> {
        let round_off = self.linear.round_off(&at, &k);
        let (delta, size) = match &self.full {
            Some(full) => {
                let delta = full.solve(&at.residual);
                (delta, self.linear.measure(&delta, &round_off))
            }
            None => self.linear.correction(&at.residual, &round_off),
        };
        let excess = self.linear.excess(&at);
        size.is_finite().then_some(Iterate { k, at, delta, round_off, size, excess })
    }

    /// The correction with one Jacobian.
    fn blended(&self, k: &Unknowns<Y>, at: &Evaluated<Y>) -> Unknowns<Y> {
        let round_off = self.linear.round_off(at, k);
        self.linear.correction(&at.residual, &round_off).0
    }

    /// Forms the derivatives anew at the point.
    fn renew(&mut self, here: Iterate<Y>) -> Option<Iterate<Y>> {
        self.renewed(here.k, here.at)
    }

    /// An evaluation with its correction by the derivatives there.
    fn renewed(&mut self, k: Unknowns<Y>, at: Evaluated<Y>) -> Option<Iterate<Y>> {
        self.linear = Linear::of(&self.equation, &k)?;
        self.equation.rounding = self.linear.rounding();
        if self.full.is_some() {
            let correction = self.blended(&k, &at);
            self.full = Full::of(&self.equation, &k, &at, &correction);
            self.evaluations += self.full.as_ref()?.evaluations;
        }
        self.corrected(k, at)
    }

    fn solved(self, here: Iterate<Y>) -> Solved<Y> {
        let Iterate { k, at, round_off, .. } = here;
        Solved { k, at, linear: self.linear, round_off, evaluations: self.evaluations }
    }

    fn run(mut self, mut here: Iterate<Y>) -> Result<Solved<Y>, Unsolved> {
        let (mut contraction, mut is_fresh) = (f64::INFINITY, true);
        loop {
            if here.total() <= self.budget.tolerance {
                let better = if here.at.error > HALF { self.better(&here) } else { None };
                return Ok(self.solved(better.unwrap_or(here)));
            }
            if contraction * here.total() <= SURE
                && let Some(End { k, chart, values, error }) = self.equation.last(&here)
            {
                let at = Evaluated { end: chart.end, d: chart.d, values, error, ..here.at };
                return Ok(self.solved(Iterate { k, at, ..here }));
            }
            let (size, evaluations) = (here.size, self.evaluations);
            let failed = Unsolved { residual: size, edge: false, evaluations };
            if self.corrections >= self.budget.corrections {
                return Err(failed);
            }
            let Some(next) = self.descend(&here) else {
                if here.size <= STALL && here.excess <= STALLED_LAW {
                    return Ok(self.solved(here));
                }
                if is_fresh && let Some(next) = self.begin(&here) {
                    (here, contraction) = (next, f64::INFINITY);
                    continue;
                }
                if is_fresh {
                    let edge = self.equation.evaluate(&moved(&here, 1.0)).is_none();
                    return Err(Unsolved { edge, evaluations: self.evaluations, ..failed });
                }
                here = self.renew(here).ok_or(failed)?;
                (contraction, is_fresh) = (f64::INFINITY, true);
                continue;
            };
            contraction = (next.size / here.size).max(next.excess / here.excess);
            let is_slow = next.size > SLOW * here.size && next.size > STALL;
            // Round-off at a guess that was far too long would let the iteration stop anywhere.
            let sizes = Y::Manifold::scales(self.equation.x);
            let is_too_long = self.linear.is_of_a_longer_step(&sizes, &next.at.d);
            (here, is_fresh) = (next, false);
            if is_slow || is_too_long {
                here = self.renew(here).ok_or(failed)?;
                (contraction, is_fresh) = (f64::INFINITY, true);
            }
        }
    }

    /// The whole correction, where an entry begins to move with it and the others are nearer.
    ///
    /// An entry that moves at a higher order than the others, as heat does in a system that is released from rest, has no
    /// round-off before they have moved. In units of that, no correction of it is short.
    fn begin(&mut self, here: &Iterate<Y>) -> Option<Iterate<Y>> {
        self.corrections += 1;
        self.evaluations += 1;
        let k = moved(here, 1.0);
        let at = self.equation.evaluate(&k)?;
        let next = self.renewed(k, at)?;
        let [before, after] = next.known_since(here);
        (after < KNOWN * before).then_some(next)
    }

    /// One more correction of a solved step whose end has other laws; `None` if they are not nearer then.
    fn better(&mut self, here: &Iterate<Y>) -> Option<Iterate<Y>> {
        self.evaluations += 1;
        let k = moved(here, 1.0);
        let at = self.equation.evaluate(&k).filter(|at| at.error < here.at.error)?;
        self.corrected(k, at)
    }

    /// The longest of the corrections `Δ, Δ/2, Δ/4, …` after which the next one is shorter.
    fn descend(&mut self, here: &Iterate<Y>) -> Option<Iterate<Y>> {
        self.corrections += 1;
        let mut length = 1.0;
        for _ in 0..=HALVINGS {
            self.evaluations += 1;
            let k = moved(here, length);
            if let Some(at) = self.equation.evaluate(&k)
                && let Some(next) = self.corrected(k, at)
                && next.is_nearer(here, 1.0 - 0.25 * length)
            {
                return Some(next);
            }
            if here.size <= STALL {
                return None;
            }
            length *= 0.5;
        }
        None
    }
}

/// The velocities after a fraction of the correction.
fn moved<Y: Metriplectic>(here: &Iterate<Y>, length: f64) -> Unknowns<Y> {
    let mut k = here.k;
    for (k, delta) in k.iter_mut().zip(&here.delta) {
        *k += *delta * length;
    }
    k
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collocation::tableau::GAUSS;
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
        // A root that is off by these units of round-off in both entries, and was declared to be rest.
        let moves = |units: f64| {
            let x = vector![0.0, 1.0];
            let equation = StageEquation::new(&GAUSS[0], &system, &x, system.laws(&x), 1e-3);
            let rest = [Vector2::zeros(); STAGES];
            let linear = Linear::of(&equation, &rest).unwrap();
            let at = equation.evaluate(&rest).unwrap();
            // The displacement 1e-3 in one of two entries.
            let round_off = Vector2::repeat(1e-3 / 2_f64.sqrt() / units);
            Solved::<_> { k: rest, at, linear, round_off, evaluations: 0 }.contradicts(&equation)
        };
        assert!(moves(200.0) && !moves(50.0));
    }
}
