//! Implicit steps of a model whose force depends on time and does work, as those of ports and baths do.
//!
//! The energy changes by the work of the force alone: with the covectors `w_i` of the stages `X_i`, or those of the midpoint scheme
//! at its base point,
//!
//! ```math
//! H(x') - H(x) = h \sum_i b_i \langle w_{H,i}, f(t_i, X_i, w_{H,i}, w_{S,i}) \rangle .
//! ```

use metriplectic_equations::Model;

use super::collocation::{Collocation, Stage, StageNumbers, StageSolution, TimedStep};
use super::drift;
use super::midpoint::{Midpoint, MidpointNumbers, Solution};
use super::parts::Parts;
use super::start::Start;
use crate::numbers::AtRunTime;
use crate::step::failure::{Cause, Fallbacks};
use crate::step::{Directions, Effort, Entries, Evidence, Laws, Memory, Values};

/// The start of a step of a driven model.
pub(crate) struct DrivenStart<'a> {
    pub(crate) model: &'a dyn Model,
    pub(crate) x: &'a Entries,
    /// The times at both ends.
    pub(crate) times: [f64; 2],
    /// The size of the step.
    pub(crate) h: f64,
    /// The laws of the model at `x`.
    pub(crate) values: Laws<Values>,
    /// The round-off that earlier steps have left of the laws; nothing where it is not to be taken back.
    pub(crate) accumulated_error: Option<Laws<Values>>,
}

/// A place where the force acts in a step: a stage, or the base point of the midpoint scheme.
pub(crate) struct DrivenStage {
    pub(crate) time: f64,
    /// The fraction of the step.
    pub(crate) weight: f64,
    pub(crate) x: Entries,
    /// The covectors of energy and entropy.
    pub(crate) w: [Directions; 2],
}

/// A step that was solved.
pub(crate) struct DrivenStep {
    pub(crate) end: Entries,
    pub(crate) stages: Vec<DrivenStage>,
    /// The loss of energy beside the work of the force, in a method that damps: not positive.
    pub(crate) lost: f64,
    pub(crate) evidence: Evidence,
    pub(crate) effort: Effort,
}

/// A method with such steps.
pub(crate) trait DrivenMethod {
    /// The memory from one step to the next.
    type Memory: Memory;

    /// Solves a step; else says why not, with the least residual and what was done.
    fn solve(
        &self,
        start: &DrivenStart<'_>,
        memory: &mut Self::Memory,
        fallbacks: Fallbacks,
    ) -> Result<DrivenStep, (Cause, f64, Effort)>;
}

impl DrivenStart<'_> {
    /// The time at a fraction of the step.
    fn time(&self, node: f64) -> f64 {
        let [t, end] = self.times;
        // The end exactly, at which a protocol may jump.
        if node >= 1.0 { end } else { t + node * (end - t) }
    }

    /// Calls `f` with the start, whose model is that in the middle of the step.
    fn in_middle<T>(
        &self,
        f: impl for<'b> FnOnce(&Start<'b, AtRunTime>, &'b Parts<'b, AtRunTime>) -> T,
    ) -> T {
        let &Self { model, x, times: [time, _], h, ref values, ref accumulated_error } = self;
        let parts = &Parts::of(model).at(self.time(0.5));
        let nothing = || drift::nothing::<AtRunTime>(values);
        let accumulated_error = accumulated_error.clone().unwrap_or_else(nothing);
        f(&Start { parts, x, time, h, values: values.clone(), accumulated_error }, parts)
    }
}

impl DrivenMethod for Midpoint {
    type Memory = MidpointNumbers<AtRunTime>;

    fn solve(
        &self,
        start: &DrivenStart<'_>,
        memory: &mut Self::Memory,
        fallbacks: Fallbacks,
    ) -> Result<DrivenStep, (Cause, f64, Effort)> {
        let solved = start.in_middle(|start, _| self.solution(start, memory, fallbacks));
        let solved = solved.map_err(|failure| (failure.cause, failure.residual, failure.effort));
        let Solution { end, z, energy, entropy, evidence, effort } = solved?;
        let w = [energy, entropy];
        let stages = vec![DrivenStage { time: start.time(0.5), weight: 1.0, x: z, w }];
        Ok(DrivenStep { end, stages, lost: 0.0, evidence, effort })
    }
}

impl DrivenMethod for Collocation {
    type Memory = StageNumbers<AtRunTime>;

    fn solve(
        &self,
        start: &DrivenStart<'_>,
        memory: &mut Self::Memory,
        fallbacks: Fallbacks,
    ) -> Result<DrivenStep, (Cause, f64, Effort)> {
        let solved = self.timed(start, |step| step.solve(memory, fallbacks));
        let solved = solved.map_err(|failure| (failure.cause, f64::INFINITY, failure.effort));
        solved.map(|solution| start.of_stages(solution))
    }
}

impl DrivenStart<'_> {
    fn of_stage(
        &self,
        Stage { node, weight, x, energy, entropy }: Stage<AtRunTime>,
    ) -> DrivenStage {
        DrivenStage { time: self.time(node), weight, x, w: [energy, entropy] }
    }

    fn of_stages(&self, solution: StageSolution<AtRunTime>) -> DrivenStep {
        let StageSolution { end, stages, lost, evidence, effort } = solution;
        let stages = stages.into_iter().map(|stage| self.of_stage(stage)).collect();
        DrivenStep { end, stages, lost, evidence, effort }
    }
}

impl Collocation {
    fn timed<T>(
        &self,
        start: &DrivenStart<'_>,
        f: impl FnOnce(&TimedStep<'_, AtRunTime>) -> T,
    ) -> T {
        let nodes = &self.tableau.nodes[..self.tableau.stages];
        start.in_middle(|inner, middle| {
            let in_time: Vec<_> = nodes.iter().map(|node| middle.at(start.time(*node))).collect();
            f(&TimedStep { method: *self, start: inner, in_time: &in_time })
        })
    }

    /// The step to a fraction `θ` of the last one, from its polynomial; `start` has the size of this part.
    pub(crate) fn part_of_driven(
        &self,
        start: &DrivenStart<'_>,
        memory: &StageNumbers<AtRunTime>,
        theta: f64,
    ) -> Option<DrivenStep> {
        let solution = self.timed(start, |step| step.part(memory, theta))?;
        Some(start.of_stages(solution))
    }

    /// The stages of the last step.
    pub(crate) fn driven_stages(
        &self,
        start: &DrivenStart<'_>,
        memory: &StageNumbers<AtRunTime>,
    ) -> Option<Vec<DrivenStage>> {
        let stages = self.timed(start, |step| step.stages(memory))?;
        Some(stages.into_iter().map(|stage| start.of_stage(stage)).collect())
    }

    /// The defects of the polynomial of the last step at both ends.
    pub(crate) fn driven_defects(
        &self,
        start: &DrivenStart<'_>,
        end: &Entries,
        memory: &StageNumbers<AtRunTime>,
    ) -> Option<[Directions; 2]> {
        let parts = start.times.map(|time| Parts::of(start.model).at(time));
        self.defects(parts.each_ref(), [start.x, end], start.h, memory)
    }
}
