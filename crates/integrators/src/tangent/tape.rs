//! The steps of a run, kept for the way back.

use std::ops::Range;

use metriplectic_dynamics::Differentiable;
use metriplectic_dynamics::system::Point;

use super::error::{TangentError, Unlinearised};
use super::part::{Ended, Part};
use super::pieces::parts;
use crate::run::certificate::Certificate;
use crate::run::checkpoint::Checkpoint;
use crate::run::ending::Ending;
use crate::run::error::RunError;
use crate::run::last_step::LastStep;
use crate::run::method::Method as _;
use crate::run::rounding::rounding;
use crate::run::schedule::Schedule;
use crate::run::state::State;
use crate::run::steps::Steps;
use crate::step::{Flow as _, Stepper};

/// A step of a run.
pub(super) struct TapedStep<D: Differentiable> {
    /// The time of its start.
    pub(super) time: f64,
    pub(super) parts: Vec<Part<D>>,
    /// The steps up to its end, and the latest time that is one of its end.
    pub(super) end: (usize, f64),
    /// The steps to the recorded states inside it.
    pub(super) outputs: Vec<Vec<Part<D>>>,
}

/// The start of a row of steps.
pub(super) struct Segment {
    checkpoint: Checkpoint,
    step: usize,
}

/// The steps of a run: all of its last segment, and the starts of the others.
pub(super) struct Tape<D: Differentiable> {
    pub(super) states: Vec<State<D::Manifold>>,
    pub(super) certificate: Certificate,
    pub(super) ending: Ending,
    /// The schedule, for the outputs of steps that are taken again.
    schedule: Schedule,
    pub(super) segments: Vec<Segment>,
    pub(super) steps: Vec<TapedStep<D>>,
}

/// A run on its way.
struct Recorder<'a, D: Differentiable, M: Stepper<D>> {
    steps: Steps<'a, D, M>,
    /// The time at which it started.
    start: f64,
}

/// A step with the states that the run yields in place of the one at its end.
type Recorded<D> = (TapedStep<D>, Vec<State<<D as metriplectic_dynamics::Metriplectic>::Manifold>>);

impl<D: Differentiable, M: Stepper<D>> Recorder<'_, D, M> {
    fn segment(&self) -> Segment {
        Segment { checkpoint: self.steps.checkpoint(), step: self.steps.state().step }
    }

    /// Takes one step; `None` if the run has ended before it.
    fn advance(&mut self) -> Result<Option<Recorded<D>>, TangentError<D::Manifold>> {
        let scales = self.steps.scales();
        let before = self.steps.state().clone();
        self.steps.advance()?;
        let end = self.steps.state();
        if end.step == before.step {
            return Ok(None);
        }
        let failed = |cause| TangentError::NotLinearised { time: before.time, cause };
        let (flow, method) = (self.steps.flow(), self.steps.method());
        let last = self.steps.last_step(&scales);
        let ended = Ended::of_run(&end.point, &last);
        let parts = parts(method, &last.start, &ended).map_err(failed)?;
        let until = (end.step, end.time + rounding(self.start, end.time));
        let mut step = TapedStep { time: before.time, parts, end: until, outputs: Vec::new() };
        let mut states = Vec::new();
        for asked in self.steps.outputs() {
            if asked.step == end.step {
                states.push(asked.clone());
                continue;
            }
            let theta = (asked.time - before.time) / (end.time - before.time);
            let (point, parts) = inside(method, &last, theta).map_err(failed)?;
            step.outputs.push(parts);
            let laws = flow.laws(&point);
            let (energy, entropy) = (laws.energy, laws.entropy);
            states.push(State { point, energy, entropy, ..*asked });
        }
        Ok(Some((step, states)))
    }
}

/// The state at a fraction of a step, by a step of that size.
fn inside<D: Differentiable, M: Stepper<D>>(
    method: &M,
    last: &LastStep<'_, D>,
    theta: f64,
) -> Result<(Point<D>, Vec<Part<D>>), Unlinearised> {
    let (h, mut memory) = (theta * last.h, M::Memory::default());
    let taken = method.step(&last.start, h, &mut memory).map_err(|_| Unlinearised::Singular)?;
    let parts = parts(method, &last.start, &Ended::new(&taken, h, &memory))?;
    Ok((taken.x, parts))
}

impl<D: Differentiable> Tape<D> {
    /// Runs a system, and keeps at most `most` steps.
    pub(super) fn record<M: Stepper<D>>(
        method: M,
        system: &D,
        (x0, schedule): (Point<D>, Schedule),
        most: usize,
    ) -> Result<Self, TangentError<D::Manifold>> {
        if !schedule.watch.events.is_empty() {
            return Err(TangentError::Broken { what: "events" });
        }
        if !schedule.corners.is_empty() {
            return Err(TangentError::Broken { what: "corners" });
        }
        let steps = method.steps(system, x0, schedule.clone())?;
        let mut recording =
            steps.recording(steps.state().clone()).map_err(RunError::<D::Manifold>::from)?;
        let mut recorder = Recorder { steps, start: schedule.start };
        let (mut segments, mut taken) = (vec![recorder.segment()], Vec::new());
        while recorder.steps.ending().is_none() {
            if taken.len() == most {
                taken.clear();
                segments.push(recorder.segment());
            }
            let Some((step, instead)) = recorder.advance()? else { continue };
            taken.push(step);
            if recorder.steps.replaces_steps() {
                recording.states.extend(instead);
            } else {
                let (end, over) = (recorder.steps.state(), recorder.steps.ending().is_some());
                recording.end_of_step(end.step, [over, false], || end.clone());
            }
        }
        let certificate = recorder.steps.certificate().clone();
        let ending = recorder.steps.ending().unwrap_or(Ending::Stopped);
        let states = recording.states;
        Ok(Self { states, certificate, ending, schedule, segments, steps: taken })
    }

    /// Takes the steps between two segments again, bit for bit.
    pub(super) fn again<M: Stepper<D>>(
        &self,
        method: M,
        system: &D,
        [segment, next]: [&Segment; 2],
    ) -> Result<Vec<TapedStep<D>>, TangentError<D::Manifold>> {
        let steps = method.resume(system, &segment.checkpoint)?;
        let steps = steps.watching(self.schedule.clone()).map_err(RunError::from)?;
        let mut recorder = Recorder { steps, start: self.schedule.start };
        let mut taken = Vec::with_capacity(next.step - segment.step);
        while recorder.steps.state().step < next.step {
            match recorder.advance()? {
                Some((step, _)) => taken.push(step),
                None => break,
            }
        }
        Ok(taken)
    }

    /// The numbers of the recorded states inside a step, and of those at its end.
    pub(super) fn recorded(&self, step: &TapedStep<D>) -> [Range<usize>; 2] {
        let (number, latest) = step.end;
        let end = self.states.partition_point(|state| state.step < number);
        let is_end = |state: &&State<D::Manifold>| state.step == number && state.time <= latest;
        let at_end = self.states[end..].iter().take_while(is_end).count();
        [end - step.outputs.len()..end, end..end + at_end]
    }
}
