//! The iteration for the velocities of the stages.

use metriplectic_dynamics::Metriplectic;
use metriplectic_fields::Vector;

use super::chart::StepChart;
use super::equation::{Evaluated, StageEquation, Unknowns};
use super::linear::Linear;
use crate::method::{Flow as _, Laws};
use crate::midpoint::{Dim, Numbers};
use crate::round_off::bound::ROUNDED;

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

/// A step that was not solved.
#[derive(Clone, Copy, Debug)]
pub(super) struct Unsolved {
    /// The smallest correction, in units of round-off.
    pub(super) residual: f64,
    /// Whether the equation was not defined on the way.
    pub(super) edge: bool,
    /// Evaluations of the equation.
    pub(super) evaluations: usize,
}

/// How far the iteration goes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Budget {
    /// Evaluations of the equation.
    pub(super) evaluations: usize,
    /// The correction that counts as solved, in units of its round-off.
    pub(super) tolerance: f64,
}

/// The multiple of round-off at which a correction that no longer falls counts as solved.
const STALL: f64 = 100.0;
/// The multiple of its round-off that the residual may then leave of a law, of which runs are allowed 12.
const STALLED_LAW: f64 = 8.0;
/// The contraction from which on a linear part no longer serves.
const SLOW: f64 = 0.3;
/// Halvings of one correction.
const HALVINGS: usize = 8;
/// The fraction of the round-off that a last correction without an evaluation has to promise.
const SURE: f64 = 0.03;

/// An evaluation with its correction.
struct Iterate<Y: Metriplectic> {
    k: Unknowns<Y>,
    at: Evaluated<Y>,
    delta: Unknowns<Y>,
    round_off: Vector<Y::Manifold>,
    size: f64,
}

impl<Y: Metriplectic> Iterate<Y> {
    /// What is left, in units of the round-off of the solution and of the laws.
    fn total(&self) -> f64 {
        self.size.max(self.at.excess)
    }

    /// Whether less than a fraction is left of another one; near round-off of the laws alone.
    fn is_nearer(&self, other: &Self, fraction: f64) -> bool {
        self.size < fraction * other.size
            || other.size <= STALL && self.total() < fraction * other.total()
    }
}

/// The end of a step after the last correction.
struct End<Y: Metriplectic> {
    k: Unknowns<Y>,
    chart: StepChart<Y::Manifold>,
    values: Laws<Numbers<Y>>,
}

impl<Y: Metriplectic> StageEquation<'_, Y> {
    fn iterate(&self, linear: &Linear<Dim<Y>>, k: Unknowns<Y>) -> Option<Iterate<Y>> {
        let at = self.evaluate(&k)?;
        let round_off = linear.round_off(&at, &k);
        let (delta, size) = linear.correction(&at.residual, &round_off);
        size.is_finite().then_some(Iterate { k, at, delta, round_off, size })
    }

    /// The velocities near a guess, at which the laws hold.
    pub(super) fn solve(&self, guess: Unknowns<Y>, budget: Budget) -> Result<Solved<Y>, Unsolved> {
        let solved = self.iterated(guess, budget)?;
        if solved.at.error <= STALLED_LAW || !self.integrals || budget.tolerance > 1.0 {
            return Ok(solved);
        }
        // An integral along the step is off by more than its estimate.
        let equation = Self { integrals: false, ..*self };
        let again = equation.iterated(solved.k, budget)?;
        Ok(Solved { evaluations: solved.evaluations + again.evaluations, ..again })
    }

    fn iterated(&self, guess: Unknowns<Y>, budget: Budget) -> Result<Solved<Y>, Unsolved> {
        let failed = |residual, edge, evaluations| Unsolved { residual, edge, evaluations };
        let Some(mut linear) = Linear::of(self, &guess) else {
            return Err(failed(f64::INFINITY, true, 0));
        };
        let Some(mut here) = self.iterate(&linear, guess) else {
            return Err(failed(f64::INFINITY, true, 1));
        };
        let (mut evaluations, mut contraction) = (1, f64::INFINITY);
        let mut fresh = true;
        loop {
            if here.total() <= budget.tolerance {
                let Iterate { k, at, round_off, .. } = here;
                return Ok(Solved { k, at, linear, round_off, evaluations });
            }
            let promised = contraction * here.total();
            if promised <= SURE
                && let Some(End { k, chart, values }) = self.last(&here)
            {
                let Iterate { at, round_off, .. } = here;
                let at = Evaluated { end: chart.end, d: chart.d, values, ..at };
                return Ok(Solved { k, at, linear, round_off, evaluations });
            }
            if evaluations >= budget.evaluations {
                return Err(failed(here.size, false, evaluations));
            }
            let Some(next) = self.descend(&linear, &here, &mut evaluations) else {
                if here.size <= STALL && here.at.excess <= STALLED_LAW {
                    let Iterate { k, at, round_off, .. } = here;
                    return Ok(Solved { k, at, linear, round_off, evaluations });
                }
                if !fresh && let Some(renewed) = Linear::of(self, &here.k) {
                    (linear, fresh) = (renewed, true);
                    (here.delta, here.size) = linear.correction(&here.at.residual, &here.round_off);
                    contraction = f64::INFINITY;
                    continue;
                }
                return Err(failed(
                    here.size,
                    self.evaluate(&moved(&here, 1.0)).is_none(),
                    evaluations,
                ));
            };
            contraction = (next.size / here.size).max(next.at.excess / here.at.excess);
            let slow = next.size > SLOW * here.size;
            here = next;
            fresh = false;
            if slow
                && here.size > STALL
                && let Some(renewed) = Linear::of(self, &here.k)
            {
                (linear, fresh) = (renewed, true);
                here.round_off = linear.round_off(&here.at, &here.k);
                (here.delta, here.size) = linear.correction(&here.at.residual, &here.round_off);
                contraction = f64::INFINITY;
            }
        }
    }

    /// The longest of the corrections `Δ, Δ/2, Δ/4, …` after which the next one is shorter.
    fn descend(
        &self,
        linear: &Linear<Dim<Y>>,
        here: &Iterate<Y>,
        evaluations: &mut usize,
    ) -> Option<Iterate<Y>> {
        let mut length = 1.0;
        for _ in 0..=HALVINGS {
            *evaluations += 1;
            if let Some(next) = self.iterate(linear, moved(here, length))
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

    /// The end after the last correction, with the laws evaluated there; `None` if they are off.
    fn last(&self, here: &Iterate<Y>) -> Option<End<Y>> {
        let k = moved(here, 1.0);
        let chart = self.chart(&k)?;
        let values = self.system.laws(&chart.end);
        let off = values.energy - self.values.energy + self.drift.energy;
        // Not so if it is not a number.
        let conserved = off.abs() <= ROUNDED * here.at.energy_size;
        if !conserved || !values.entropy.is_finite() {
            return None;
        }
        Some(End { k, chart, values })
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
