//! Implicit steps of a model whose force depends on time and does work, as those of ports and baths do.
//!
//! The energy changes by the work of the force alone: with the covectors `w_i` of the stages `X_i`, or those of the midpoint scheme
//! at its base point,
//!
//! ```math
//! H(t', x') - H(t, x) = W_t + h \sum_i b_i \langle w_{H,i}, f(t_i, X_i, w_{H,i}, w_{S,i}) \rangle .
//! ```
//!
//! The work `W_t` of an energy that depends on time is that of [open systems](crate::open), with a frozen state.

use metriplectic_equations::Model;

use super::collocation::{
    Clock, Collocation, Frozen, Stage, StageNumbers, StageSolution, TimeOfStep, TimedStep,
    WorkOfTime,
};
use super::drift;
use super::midpoint::{Midpoint, MidpointNumbers, Solution};
use super::parts::Parts;
use super::start::Start;
use crate::numbers::AtRunTime;
use crate::step::failure::{Cause, Fallbacks};
use crate::step::{Directions, Effort, Entries, Evidence, Laws, Memory, Values};

/// The start of a step of a driven model.
pub(crate) struct DrivenStart<'a> {
    /// The model. For a midpoint scheme its energy is the mean of those at both ends, else that at the time that it is asked for.
    pub(crate) model: &'a dyn Model,
    pub(crate) x: &'a Entries,
    pub(crate) times: TimeOfStep,
    /// The work of the time, if the energy depends on it.
    pub(crate) clock: Option<&'a dyn WorkOfTime>,
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
    /// The work of the time in the energy.
    pub(crate) work_of_time: f64,
    /// The frozen state of this work, with its share.
    pub(crate) frozen: (Entries, f64),
    /// The loss of energy beside the work of the force, in a method that damps: not positive.
    pub(crate) lost: f64,
    pub(crate) evidence: Evidence,
    pub(crate) effort: Effort,
}

/// A method with such steps.
pub(crate) trait DrivenMethod {
    /// The memory from one step to the next.
    type Memory: Memory;

    /// Says whether the model of a step has the mean of the energies at both ends.
    const HAS_MEAN_ENERGY: bool;

    /// Solves a step; else says why not, with the least residual and what was done.
    fn solve(
        &self,
        start: &DrivenStart<'_>,
        memory: &mut Self::Memory,
        fallbacks: Fallbacks,
    ) -> Result<DrivenStep, (Cause, f64, Effort)>;
}

impl DrivenStart<'_> {
    /// Calls `f` with the start, whose model is that in the middle of the step.
    fn in_middle<T>(
        &self,
        f: impl for<'b> FnOnce(&Start<'b, AtRunTime>, &'b Parts<'b, AtRunTime>) -> T,
    ) -> T {
        let &Self { model, x, times, h, ref values, ref accumulated_error, .. } = self;
        let (TimeOfStep([time, _]), parts) = (times, &Parts::of(model).at(times.at(0.5)));
        let nothing = || drift::nothing::<AtRunTime>(values);
        let accumulated_error = accumulated_error.clone().unwrap_or_else(nothing);
        f(&Start { parts, x, time, h, values: values.clone(), accumulated_error }, parts)
    }
}

impl DrivenMethod for Midpoint {
    type Memory = MidpointNumbers<AtRunTime>;

    const HAS_MEAN_ENERGY: bool = true;

    fn solve(
        &self,
        start: &DrivenStart<'_>,
        memory: &mut Self::Memory,
        fallbacks: Fallbacks,
    ) -> Result<DrivenStep, (Cause, f64, Effort)> {
        let solved = start.in_middle(|start, _| self.solution(start, memory, fallbacks));
        let solved = solved.map_err(|failure| (failure.cause, failure.residual, failure.effort));
        let Solution { end, z, energy, entropy, evidence, effort } = solved?;
        let (w, time) = ([energy, entropy], start.times.at(0.5));
        let stages = vec![DrivenStage { time, weight: 1.0, x: z.clone(), w }];
        let frozen = |clock: &dyn WorkOfTime| 0.5 * (clock.frozen(start.x) + clock.frozen(&end));
        let (work_of_time, frozen) = (start.clock.map_or(0.0, frozen), (z, 1.0));
        Ok(DrivenStep { end, stages, work_of_time, frozen, lost: 0.0, evidence, effort })
    }
}

impl DrivenMethod for Collocation {
    type Memory = StageNumbers<AtRunTime>;

    const HAS_MEAN_ENERGY: bool = false;

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
        DrivenStage { time: self.times.at(node), weight, x, w: [energy, entropy] }
    }

    fn of_stages(&self, solution: StageSolution<AtRunTime>) -> DrivenStep {
        let StageSolution { end, stages, frozen, lost, evidence, effort } = solution;
        let stages: Vec<_> = stages.into_iter().map(|stage| self.of_stage(stage)).collect();
        let work_of_time = self.clock.map_or(0.0, |clock| {
            let (z, share) = &frozen;
            let rate = |stage: &DrivenStage| {
                clock.power(stage.time, &stage.x) - share * clock.power(stage.time, z)
            };
            let rates: f64 = stages.iter().map(|stage| stage.weight * rate(stage)).sum();
            share * clock.frozen(z) + self.times.length() * rates
        });
        DrivenStep { end, stages, work_of_time, frozen, lost, evidence, effort }
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
            let in_time: Vec<_> =
                nodes.iter().map(|node| middle.at(start.times.at(*node))).collect();
            let clock = start.clock.map(|work| Clock {
                ends: start.times.0.map(|time| middle.at(time)),
                times: start.times,
                work,
            });
            f(&TimedStep { method: *self, start: inner, in_time: &in_time, clock: clock.as_ref() })
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

    /// The stages of the last step, with the frozen state.
    pub(crate) fn driven_stages(
        &self,
        start: &DrivenStart<'_>,
        memory: &StageNumbers<AtRunTime>,
    ) -> Option<(Vec<DrivenStage>, Frozen<AtRunTime>)> {
        let (stages, frozen) = self.timed(start, |step| step.stages(memory))?;
        Some((stages.into_iter().map(|stage| start.of_stage(stage)).collect(), frozen))
    }

    /// The defects of the polynomial of the last step at both ends.
    pub(crate) fn driven_defects(
        &self,
        start: &DrivenStart<'_>,
        end: &Entries,
        memory: &StageNumbers<AtRunTime>,
    ) -> Option<[Directions; 2]> {
        let parts = start.times.0.map(|time| Parts::of(start.model).at(time));
        self.defects(parts.each_ref(), [start.x, end], start.h, memory)
    }
}
