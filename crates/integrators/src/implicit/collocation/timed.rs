//! Steps of a model whose force depends on time and does work: the ports and baths of its surroundings. As in [`crate::collocation`],
//! whose file of this name has those of typed systems.

use metriplectic_equations::Path;

use super::clock::Clock;
use super::covectors::{all_finite, combined, each_stage, zeros};
use super::equation::{StageEquation, Unknowns};
use super::fallbacks;
use super::memory::{LastStep, StageNumbers};
use super::solve::Solved;
use super::step::Collocation;
use crate::collocation::fallbacks::StepFailure;
use crate::implicit::drift;
use crate::implicit::parts::Parts;
use crate::implicit::start::Start;
use crate::numbers::Lengths;
use crate::round_off::bound::ROUNDED;
use crate::step::failure::{Cause, Fallbacks};
use crate::step::{Effort, Evidence, StageLaws};

/// A step that was solved.
pub(in crate::implicit) struct StageSolution<L: Lengths> {
    /// The end of the step, with the digits that earlier steps have lost.
    pub(in crate::implicit) end: L::State,
    pub(in crate::implicit) stages: Vec<Stage<L>>,
    pub(in crate::implicit) frozen: Frozen<L>,
    /// The loss of energy beside work and heat of the stages, in a method that damps: not positive.
    pub(in crate::implicit) lost: f64,
    pub(in crate::implicit) evidence: Evidence,
    pub(in crate::implicit) effort: Effort,
}

/// A stage of a step, with the covectors of energy and entropy.
pub(in crate::implicit) struct Stage<L: Lengths> {
    pub(in crate::implicit) node: f64,
    pub(in crate::implicit) weight: f64,
    pub(in crate::implicit) x: L::State,
    pub(in crate::implicit) energy: L::Vector,
    pub(in crate::implicit) entropy: L::Vector,
}

/// The frozen state of the work of the time, with its share.
pub(in crate::implicit) type Frozen<L> = (<L as Lengths>::State, f64);

/// A step of a model with the model at the time of each stage.
pub(in crate::implicit) struct TimedStep<'a, L: Lengths> {
    pub(in crate::implicit) method: Collocation,
    /// The start, with the model in the middle of the step.
    pub(in crate::implicit) start: &'a Start<'a, L>,
    pub(in crate::implicit) in_time: &'a [Parts<'a, L>],
    /// The energy in time, if it depends on it.
    pub(in crate::implicit) clock: Option<&'a Clock<'a, L>>,
}

impl<'a, L: Lengths> TimedStep<'a, L> {
    fn equation(&self) -> StageEquation<'a, L> {
        let equation = StageEquation::new(self.method.tableau, self.start);
        StageEquation { in_time: Some(self.in_time), clock: self.clock, ..equation }
    }

    /// Solves a step, and adds the digits that earlier steps have lost of the position. What it leaves of the laws is for the
    /// next one to take back.
    pub(in crate::implicit) fn solve(
        &self,
        memory: &mut StageNumbers<L>,
        fallbacks: Fallbacks,
    ) -> Result<StageSolution<L>, StepFailure> {
        let (tableau, &Start { parts, x, h, .. }) = (self.method.tableau, self.start);
        memory.keep_length(parts.n());
        memory.last = None;
        // From rest a drive may move entries that have no size yet.
        let guess = memory.guess(parts, tableau, h).or_else(|| self.explicit_guess());
        let mut equation = self.equation();
        if let Some(guess) = &guess {
            equation.drift = drift::target(self.start, &equation.displacement(guess));
        }
        let mut effort = Effort::default();
        let known = memory.linear.take().filter(|known| {
            guess.as_ref().is_some_and(|k| known.serves(tableau, h, &equation.displacement(k)))
        });
        let solved = fallbacks::solve(&equation, guess, known, fallbacks, &mut effort)?;
        let mut solution = self.solution(&equation, &solved, effort)?;
        let Solved { k, linear, evaluations, .. } = solved;
        let u = equation.displacement(&k);
        memory.note(tableau, (parts, x, h), &k);
        // Elsewhere the frame in which they are formed turns.
        let is_kept = linear.is_kept(evaluations) && parts.is_flat();
        memory.keep(k, linear, is_kept);
        if let Some(moved) = memory.compensation.add(parts, Path::Chart, [x, &solution.end], &u) {
            solution.end = moved;
        }
        Ok(solution)
    }

    /// The velocities of the stages by two passes of a fixed-point iteration from rest.
    fn explicit_guess(&self) -> Option<Unknowns<L>> {
        let (tableau, &Start { parts, x, h, .. }) = (self.method.tableau, self.start);
        let mut k = zeros(parts);
        for _ in 0..2 {
            let before = k.clone();
            for i in 0..tableau.stages {
                let q = combined(h, tableau.stages, &tableau.matrix[i], &before);
                k[i] = self.in_time[i].velocity(&parts.moved(x, &q))?;
            }
        }
        all_finite::<L>(&k).then_some(k)
    }

    /// Solves a step of a part of the size, from the polynomial of the whole one, at the fraction `θ`.
    pub(in crate::implicit) fn part(
        &self,
        memory: &StageNumbers<L>,
        theta: f64,
    ) -> Option<StageSolution<L>> {
        let (tableau, LastStep { k, .. }) = (self.method.tableau, memory.last.as_ref()?);
        let guess = each_stage(self.start.parts, tableau.stages, |i| {
            combined(1.0, tableau.stages, &tableau.velocity(theta * tableau.nodes[i]), k)
        });
        let (equation, mut effort) = (self.equation(), Effort::default());
        let (guess, tries) = (Some(guess), Fallbacks::FirstTries);
        let solved = fallbacks::solve(&equation, guess, None, tries, &mut effort).ok()?;
        self.solution(&equation, &solved, effort).ok()
    }

    /// The stages of the step that was solved last, with the frozen state.
    pub(in crate::implicit) fn stages(
        &self,
        memory: &StageNumbers<L>,
    ) -> Option<(Vec<Stage<L>>, Frozen<L>)> {
        let k = &memory.last.as_ref()?.k;
        self.listed(&self.equation(), k).map(|(stages, frozen, _)| (stages, frozen))
    }

    /// Lists stages, with the frozen state and what is left of the energy.
    fn listed(
        &self,
        equation: &StageEquation<'_, L>,
        k: &Unknowns<L>,
    ) -> Option<(Vec<Stage<L>>, Frozen<L>, f64)> {
        let (tableau, (points, covectors, z)) = (self.method.tableau, equation.stages(k)?);
        let share = self.clock.map_or(1.0, |clock| clock.share(tableau, &points.x, &z));
        let stage = |i: usize| Stage {
            node: tableau.nodes[i],
            weight: tableau.weights[i],
            x: points.x[i].clone(),
            energy: covectors.w[i].energy.clone(),
            entropy: covectors.w[i].entropy.clone(),
        };
        let stages = (0..tableau.stages).map(stage).collect();
        Some((stages, (z, share), covectors.laws.energy.left))
    }

    fn solution(
        &self,
        equation: &StageEquation<'_, L>,
        Solved { k, at, linear, .. }: &Solved<L>,
        effort: Effort,
    ) -> Result<StageSolution<L>, StepFailure> {
        let tableau = self.method.tableau;
        let failed = |cause| StepFailure { cause, effort };
        if !equation.is_on_its_way(k, &at.end) {
            return Err(failed(Cause::Unsolved));
        }
        if self.start.parts.is_outside(&at.end) {
            return Err(failed(Cause::Edge));
        }
        let (stages, frozen, left) = self.listed(equation, k).ok_or(failed(Cause::Edge))?;
        let evidence = Evidence {
            entropy_slope: at.entropy_slope,
            dissipates: at.growth != 0.0,
            friction: if tableau.one_sided { 0.0 } else { linear.friction },
            stages: Some(StageLaws::new(at.error * ROUNDED, at.surplus)),
            ..Evidence::default()
        };
        let lost = if tableau.one_sided { left.min(0.0) } else { 0.0 };
        Ok(StageSolution { end: at.end.clone(), stages, frozen, lost, evidence, effort })
    }
}
