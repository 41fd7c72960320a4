//! Steps of systems that depend on time.

use metriplectic_dynamics::{Metriplectic, VectorField, system::Point};
use metriplectic_fields::{ChartPoint, Column as _, Space as _, Vector};
use metriplectic_manifolds::Manifold;

use super::covectors::{all_finite, at_stage, combined};
use super::dense;
use super::equation::{StageEquation, StagesOf, Unknowns};
use super::fallbacks::{self, StepFailure};
use super::in_time::{InTime, frozen_share};
use super::memory::{LastStep, StageMemory};
use super::solve::Solved;
use super::tableau::{STAGES, Tableau};
use crate::round_off::compensation::Displaced;
use crate::round_off::drift;
use crate::step::failure::{Cause, Fallbacks};
use crate::step::{Dim, Effort, Evidence, StageLaws, Start};

/// A step of a system in time that was solved.
pub(crate) struct StageSolution<Y: Metriplectic> {
    /// The end of the step, with the digits that earlier steps have lost.
    pub(crate) end: Point<Y>,
    /// The middle of its chart, and the share of this frozen state in the work of the time.
    pub(crate) frozen: (Point<Y>, f64),
    /// The nodes and the weights of the stages, and the stages with the covectors of energy and entropy.
    pub(crate) stages: Vec<Stage<Y>>,
    /// The loss of energy beside work and heat of the stages, in a method that damps: not positive.
    pub(crate) lost: f64,
    pub(crate) evidence: Evidence,
    pub(crate) effort: Effort,
}

/// A stage of a step.
pub(crate) struct Stage<Y: Metriplectic> {
    pub(crate) node: f64,
    pub(crate) weight: f64,
    pub(crate) x: Point<Y>,
    pub(crate) energy: Vector<Y::Manifold>,
    pub(crate) entropy: Vector<Y::Manifold>,
}

/// The stages of a step, with the frozen state of its work and the share of this state.
type ListedStages<Y> = (Vec<Stage<Y>>, (Point<Y>, f64));

/// A step of a system in time.
#[derive(Debug)]
pub(crate) struct TimedStep<'a, Y: Metriplectic> {
    pub(crate) tableau: &'static Tableau,
    /// The system in the middle of the step.
    pub(crate) middle: &'a Y,
    pub(crate) in_time: InTime<'a, Y>,
}

impl<Y: Metriplectic> TimedStep<'_, Y> {
    fn equation<'b>(&'b self, start: &Start<'b, Y>) -> StageEquation<'b, Y> {
        let &Start { x, h, values, .. } = start;
        let equation = StageEquation::new(self.tableau, self.middle, x, values, h);
        StageEquation { in_time: Some(self.in_time), ..equation }
    }

    /// Solves a step, and adds the digits that earlier steps have lost of the position. What it leaves of the laws is for the
    /// next one to take back.
    pub(crate) fn solve(
        &self,
        start: &Start<'_, Y>,
        memory: &mut StageMemory<Dim<Y>>,
        fallbacks: Fallbacks,
    ) -> Result<StageSolution<Y>, (Cause, Effort)> {
        memory.last = None;
        let (x, h) = (start.x, start.h);
        // From rest a drive may move entries that have no size yet.
        let guess = memory.guess(self.tableau, h).or_else(|| self.explicit_guess(x, h));
        let mut equation = self.equation(start);
        if let Some(guess) = &guess {
            let d = equation.displacement(guess);
            equation.drift = drift::target(self.middle, start, &d);
        }
        let mut effort = Effort::default();
        let solved = self.solved(&equation, guess, fallbacks, &mut effort);
        let (solved, mut solution) = solved.map_err(|failure| (failure.cause, failure.effort))?;
        let k = solved.k;
        let edge = || (Cause::Edge, effort);
        let u = equation.displacement(&k);
        let chart = equation.chart(&k).ok_or_else(edge)?;
        memory.note::<Y::Manifold>(self.tableau, x, h, &k, &chart, &solution.end);
        memory.last = Some(LastStep { k, filter: *solved.linear.filter() });
        let step = Displaced { x, d: &u, end: &solution.end };
        if let Some(moved) = memory.compensation.add::<Y::Manifold>(Y::Manifold::lost_digits, &step)
        {
            solution.end = moved;
        }
        Ok(solution)
    }

    /// The velocities of the stages by two passes of a fixed-point iteration from rest.
    fn explicit_guess(&self, x: &Point<Y>, h: f64) -> Option<Unknowns<Y>> {
        let Tableau { stages, matrix, .. } = self.tableau;
        let mut k = [Vector::<Y::Manifold>::zero(); STAGES];
        for _ in 0..2 {
            let before = k;
            for i in 0..*stages {
                let q = combined(*stages, &matrix[i], &before) * h;
                let at = ChartPoint { base: x.clone(), q };
                k[i] = VectorField::velocity(&self.in_time.systems[i], &at).ok()?;
            }
        }
        all_finite::<Dim<Y>>(&k).then_some(k)
    }

    /// Solves a step of a part of the size, from the polynomial of the whole one, at the fraction `θ`.
    pub(crate) fn part(
        &self,
        start: &Start<'_, Y>,
        memory: &StageMemory<Dim<Y>>,
        theta: f64,
    ) -> Option<StageSolution<Y>> {
        let last = memory.last?;
        let guess = std::array::from_fn(|i| {
            let nodes = &self.tableau.nodes;
            combined(self.tableau.stages, &self.tableau.velocity(theta * nodes[i]), &last.k)
        });
        let equation = self.equation(start);
        let mut effort = Effort::default();
        let solved = self.solved(&equation, Some(guess), Fallbacks::FirstTries, &mut effort);
        solved.ok().map(|(_, solution)| solution)
    }

    /// The defects of the polynomial of a step at both ends, where the motion has these velocities.
    pub(crate) fn defects(
        &self,
        start: &Start<'_, Y>,
        memory: &StageMemory<Dim<Y>>,
        end: &Point<Y>,
        velocities: [Vector<Y::Manifold>; 2],
    ) -> Option<[Vector<Y::Manifold>; 2]> {
        dense::defects(&self.equation(start), memory, end, velocities)
    }

    /// The stages of the step that was solved last, with the frozen state and its share.
    pub(crate) fn stages(
        &self,
        start: &Start<'_, Y>,
        memory: &StageMemory<Dim<Y>>,
    ) -> Option<ListedStages<Y>> {
        let last = memory.last.as_ref()?;
        Some(self.listed(self.equation(start).stages(&last.k)?))
    }

    /// Lists stages, with the frozen state and its share.
    fn listed(&self, (points, w, z): StagesOf<Y>) -> ListedStages<Y> {
        let tableau = self.tableau;
        let stages = (0..tableau.stages).map(|i| {
            let here = at_stage::<Y>(&w, i);
            Stage {
                node: tableau.nodes[i],
                weight: tableau.weights[i],
                x: points.x[i].clone(),
                energy: here.energy,
                entropy: here.entropy,
            }
        });
        let share = frozen_share((tableau, self.in_time), &points.x, &z);
        (stages.collect(), (z, share))
    }

    fn solved(
        &self,
        equation: &StageEquation<'_, Y>,
        guess: Option<Unknowns<Y>>,
        fallbacks: Fallbacks,
        effort: &mut Effort,
    ) -> Result<(Solved<Y>, StageSolution<Y>), StepFailure> {
        let tableau = self.tableau;
        let solved = fallbacks::solve(equation, guess, fallbacks, effort)?;
        let failed = |cause| StepFailure { cause, effort: *effort };
        let Solved { k, at, linear, .. } = &solved;
        if !Y::Manifold::is_near(&(at.d * 0.5)) {
            return Err(failed(Cause::Unsolved));
        }
        if self.middle.manifold().defect(&at.end).is_infinite() {
            return Err(failed(Cause::Edge));
        }
        let solved_at = equation.stages(k).ok_or_else(|| failed(Cause::Edge))?;
        let lost = if tableau.one_sided { solved_at.1.energy.left.min(0.0) } else { 0.0 };
        let (stages, frozen) = self.listed(solved_at);
        let evidence = Evidence {
            entropy_slope: at.entropy_slope,
            dissipates: at.growth != 0.0,
            friction: if tableau.one_sided { 0.0 } else { linear.friction },
            stages: Some(StageLaws::new(at.error * crate::round_off::bound::ROUNDED, at.surplus)),
            ..Evidence::default()
        };
        let (end, effort) = (at.end.clone(), *effort);
        Ok((solved, StageSolution { end, frozen, stages, lost, evidence, effort }))
    }
}

/// The most stages, for the systems of a step.
pub(crate) const MOST: usize = STAGES;
