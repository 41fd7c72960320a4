//! The iteration for the velocities of the stages. As in [`crate::collocation`], whose rules it follows.

use super::chart::StepChart;
use super::covectors::each_stage;
use super::equation::{Evaluated, StageEquation, Unknowns};
use super::full::Full;
use super::linear::Linear;
use crate::collocation::solve::{
    Budget, Derivatives, HALF, HALVINGS, KNOWN, MOVES, SLOW, STALL, STALLED_LAW, SURE, UNKNOWN,
    Unsolved,
};
use crate::implicit::algebra::add;
use crate::numbers::Lengths;
use crate::step::Laws;

/// A solved step.
pub(super) struct Solved<L: Lengths> {
    /// The velocities of the stages.
    pub(super) k: Unknowns<L>,
    /// The last evaluation. Its end and its values are those of `k`.
    pub(super) at: Evaluated<L>,
    /// The linear part that solved it.
    pub(super) linear: Linear<L>,
    /// The round-off of the displacements.
    pub(super) round_off: L::Vector,
    /// Evaluations of the equation.
    pub(super) evaluations: usize,
}

impl<L: Lengths> Solved<L> {
    /// Returns whether all displacements are round-off.
    pub(super) fn rests(&self, equation: &StageEquation<'_, L>) -> bool {
        let &StageEquation { tableau, parts, h, .. } = equation;
        let Self { k, round_off, .. } = self;
        let is_round_off =
            |k: &L::Vector| (0..parts.n()).all(|c| (h * k[c]).abs() <= 2.0 * round_off[c]);
        k[..tableau.stages].iter().all(is_round_off)
    }

    /// Returns whether the motion at the start of the step would leave it, by the velocity there, which no guess enters.
    #[cold]
    fn contradicts(&self, equation: &StageEquation<'_, L>) -> bool {
        let &StageEquation { tableau, parts, x, in_time, .. } = equation;
        let known = if in_time.is_some() { tableau.stages } else { 1 };
        let velocities = (0..known).map(|i| equation.at_stage(i).velocity(x));
        let Some(velocities) = velocities.collect::<Option<Vec<_>>>() else { return false };
        let v = each_stage(parts, tableau.stages, |i| velocities[i.min(known - 1)].clone());
        let (_, size) = self.linear.correction(parts, &v, &self.round_off);
        size > MOVES
    }
}

/// An evaluation with its correction.
struct Iterate<L: Lengths> {
    k: Unknowns<L>,
    at: Evaluated<L>,
    delta: Unknowns<L>,
    round_off: L::Vector,
    /// The size of the correction, in units of round-off.
    size: f64,
    /// The error of the laws, in units of round-off.
    excess: f64,
}

impl<L: Lengths> Iterate<L> {
    /// The remaining error, in units of the round-off of the solution and of the laws.
    fn total(&self) -> f64 {
        self.size.max(self.excess)
    }

    /// Whether less than a fraction is left of another one; near round-off of the laws alone.
    fn is_nearer(&self, other: &Self, fraction: f64) -> bool {
        self.size < fraction * other.size
            || other.size <= STALL && self.total() < fraction * other.total()
    }

    /// The sums of the squares of the corrections before and here, in units of the round-off here, without the entries that begin to
    /// move: their correction grows, and their round-off was not known before.
    fn known_since(&self, before: &Self, n: usize) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for c in 0..n {
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

    /// The velocities after a fraction of the correction.
    fn moved(&self, length: f64) -> Unknowns<L> {
        let mut k = self.k.clone();
        k.iter_mut().zip(&self.delta).for_each(|(k, delta)| add(k, length, delta));
        k
    }
}

/// The end of a step after the last correction.
struct End<L: Lengths> {
    k: Unknowns<L>,
    chart: StepChart<L>,
    values: Laws<L::Invariants>,
    error: f64,
}

impl<'a, L: Lengths> StageEquation<'a, L> {
    /// The velocities near a guess, at which the laws hold.
    pub(super) fn solve(&self, guess: Unknowns<L>, budget: Budget) -> Result<Solved<L>, Unsolved> {
        self.solve_near(guess, budget, None)
    }

    /// The velocities near a guess, first with the derivatives of an earlier step, if there are any.
    pub(super) fn solve_near(
        &self,
        guess: Unknowns<L>,
        budget: Budget,
        known: Option<Linear<L>>,
    ) -> Result<Solved<L>, Unsolved> {
        let undefined = Unsolved { residual: f64::INFINITY, edge: true, evaluations: 1 };
        let is_fresh = known.is_none();
        let linear = known.or_else(|| Linear::of(self, &guess)).ok_or(undefined)?;
        let equation = StageEquation { rounding: linear.rounding(), ..self.clone() };
        let at = equation.evaluate(&guess).ok_or(undefined)?;
        let mut iteration =
            Iteration { equation, budget, linear, full: None, evaluations: 1, corrections: 0 };
        if budget.derivatives == Derivatives::OfAllStages {
            let correction = iteration.blended(&guess, &at);
            iteration.full = Full::of(&iteration.equation, &guess, &at, &correction);
            iteration.evaluations += iteration.full.as_ref().map_or(0, |full| full.evaluations);
        }
        let here = iteration.corrected(guess, at).ok_or(undefined)?;
        let solved = iteration.run(here, is_fresh)?;
        if solved.rests(self) && solved.contradicts(self) {
            return Err(Unsolved { evaluations: solved.evaluations, edge: false, ..undefined });
        }
        Ok(solved)
    }

    /// The end after the last correction, with the laws evaluated there; `None` if they are off.
    fn last(&self, here: &Iterate<L>) -> Option<End<L>> {
        // The balance with surroundings needs the stages.
        if self.in_time.is_some() {
            return None;
        }
        let k = here.moved(1.0);
        let chart = self.chart(&k)?;
        let values = self.parts.laws(&chart.end);
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
struct Iteration<'a, L: Lengths> {
    equation: StageEquation<'a, L>,
    budget: Budget,
    linear: Linear<L>,
    /// The derivatives of all stages, where these are asked for.
    full: Option<Full>,
    evaluations: usize,
    /// Corrections so far.
    corrections: usize,
}

impl<'a, L: Lengths> Iteration<'a, L> {
    /// An evaluation with its correction.
    fn corrected(&self, k: Unknowns<L>, at: Evaluated<L>) -> Option<Iterate<L>> {
        let round_off = self.linear.round_off(&at, &k);
        let (delta, size) = match &self.full {
            Some(full) => {
                let delta = full.solve(self.equation.parts, &at.residual);
                let size = self.linear.measure(&delta, &round_off);
                (delta, size)
            }
            None => self.linear.correction(self.equation.parts, &at.residual, &round_off),
        };
        let excess = self.linear.excess(&at);
        size.is_finite().then_some(Iterate { k, at, delta, round_off, size, excess })
    }

    /// The correction with one Jacobian.
    fn blended(&self, k: &Unknowns<L>, at: &Evaluated<L>) -> Unknowns<L> {
        let round_off = self.linear.round_off(at, k);
        self.linear.correction(self.equation.parts, &at.residual, &round_off).0
    }

    /// Forms the derivatives anew at the point.
    fn renew(&mut self, here: Iterate<L>) -> Option<Iterate<L>> {
        self.renewed(here.k, here.at)
    }

    /// An evaluation with its correction by the derivatives there.
    fn renewed(&mut self, k: Unknowns<L>, at: Evaluated<L>) -> Option<Iterate<L>> {
        self.linear = Linear::of(&self.equation, &k)?;
        self.equation.rounding = self.linear.rounding();
        if self.full.is_some() {
            let correction = self.blended(&k, &at);
            self.full = Full::of(&self.equation, &k, &at, &correction);
            self.evaluations += self.full.as_ref()?.evaluations;
        }
        self.corrected(k, at)
    }

    fn solved(self, here: Iterate<L>) -> Solved<L> {
        let Iterate { k, at, round_off, .. } = here;
        Solved { k, at, linear: self.linear, round_off, evaluations: self.evaluations }
    }

    /// Corrects as far as the budget goes; derivatives that are not `fresh` are formed anew where they do not serve.
    fn run(mut self, mut here: Iterate<L>, mut is_fresh: bool) -> Result<Solved<L>, Unsolved> {
        let parts = self.equation.parts;
        let mut contraction = f64::INFINITY;
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
                let is_of_another_step = self.linear.age > 0;
                if here.size <= STALL && here.excess <= STALLED_LAW && !is_of_another_step {
                    return Ok(self.solved(here));
                }
                if is_fresh && let Some(next) = self.begin(&here) {
                    (here, contraction) = (next, f64::INFINITY);
                    continue;
                }
                if is_fresh {
                    let edge = self.equation.evaluate(&here.moved(1.0)).is_none();
                    return Err(Unsolved { edge, evaluations: self.evaluations, ..failed });
                }
                here = self.renew(here).ok_or(failed)?;
                (contraction, is_fresh) = (f64::INFINITY, true);
                continue;
            };
            contraction = (next.size / here.size).max(next.excess / here.excess);
            let is_slow = next.size > SLOW * here.size && next.size > STALL;
            // Round-off at a guess that was far too long would let the iteration stop anywhere.
            let sizes = parts.scales(self.equation.x);
            let is_too_long = self.linear.is_of_a_longer_step(&sizes, &next.at.d);
            (here, is_fresh) = (next, false);
            if is_slow || is_too_long {
                here = self.renew(here).ok_or(failed)?;
                (contraction, is_fresh) = (f64::INFINITY, true);
            }
        }
    }

    /// The whole correction, where an entry begins to move with it and the others are nearer: it has no round-off before, and in
    /// units of that no correction of it is short.
    fn begin(&mut self, here: &Iterate<L>) -> Option<Iterate<L>> {
        self.corrections += 1;
        self.evaluations += 1;
        let k = here.moved(1.0);
        let at = self.equation.evaluate(&k)?;
        let next = self.renewed(k, at)?;
        let [before, after] = next.known_since(here, self.equation.parts.n());
        (after < KNOWN * before).then_some(next)
    }

    /// One more correction of a solved step whose end has other laws; `None` if they are not nearer then.
    fn better(&mut self, here: &Iterate<L>) -> Option<Iterate<L>> {
        self.evaluations += 1;
        let k = here.moved(1.0);
        let at = self.equation.evaluate(&k).filter(|at| at.error < here.at.error)?;
        self.corrected(k, at)
    }

    /// The longest of the corrections `Δ, Δ/2, Δ/4, …` after which the next one is shorter.
    fn descend(&mut self, here: &Iterate<L>) -> Option<Iterate<L>> {
        self.corrections += 1;
        let mut length = 1.0;
        for _ in 0..=HALVINGS {
            self.evaluations += 1;
            let k = here.moved(length);
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
