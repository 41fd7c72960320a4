//! The steps of a run, kept for the way back.

use metriplectic_dynamics::Differentiable;
use metriplectic_dynamics::system::Point;

use super::error::{TangentError, Unlinearised};
use super::part::{Ended, Part};
use super::pieces::parts;
use crate::run::certificate::Certificate;
use crate::run::checkpoint::Checkpoint;
use crate::run::error::RunError;
use crate::run::last_step::LastStep;
use crate::run::method::Method as _;
use crate::run::requests::{Outputs, rounding};
use crate::run::schedule::Schedule;
use crate::run::span_error::SpanError;
use crate::run::state::State;
use crate::run::steps::Steps;
use crate::step::{Flow as _, Stepper};

/// A step of a run.
pub(super) struct TapedStep<D: Differentiable> {
    /// The time of its start.
    pub(super) time: f64,
    pub(super) parts: Vec<Part<D>>,
    /// The number of the recorded state at its end.
    pub(super) state: Option<usize>,
    /// Recorded states inside it, and the steps to them.
    pub(super) outputs: Vec<(usize, Vec<Part<D>>)>,
}

/// The start of a row of steps.
pub(super) struct Segment {
    checkpoint: Checkpoint,
    outputs: Outputs,
    /// Recorded states so far.
    count: usize,
    step: usize,
}

/// The steps of a run: all of its last segment, and the starts of the others.
pub(super) struct Tape<D: Differentiable> {
    pub(super) states: Vec<State<D::Manifold>>,
    pub(super) certificate: Certificate,
    pub(super) segments: Vec<Segment>,
    pub(super) steps: Vec<TapedStep<D>>,
}

/// A run on its way, with its outputs.
struct Recorder<'a, D: Differentiable, M: Stepper<D>> {
    steps: Steps<'a, D, M>,
    outputs: Outputs,
    start: f64,
    /// Recorded states so far.
    count: usize,
}

/// A step with the states that were recorded in it.
type Recorded<D> = (TapedStep<D>, Vec<State<<D as metriplectic_dynamics::Metriplectic>::Manifold>>);

impl<D: Differentiable, M: Stepper<D>> Recorder<'_, D, M> {
    fn segment(&self) -> Segment {
        let (checkpoint, step) = (self.steps.checkpoint(), self.steps.state().step);
        Segment { checkpoint, outputs: self.outputs.clone(), count: self.count, step }
    }

    /// Takes one step; `None` if the run has ended before it.
    fn advance(&mut self) -> Result<Option<Recorded<D>>, TangentError<D::Manifold>> {
        let scales = self.steps.scales();
        let before = self.steps.state().clone();
        self.steps.advance()?;
        if self.steps.state().step == before.step {
            return Ok(None);
        }
        let failed = |cause| TangentError::NotLinearised { time: before.time, cause };
        let (flow, method) = (self.steps.flow(), self.steps.method());
        let last = self.steps.last_step(&scales);
        let end = self.steps.state();
        let ended = Ended::of_run(&end.point, &last);
        let parts = parts(method, &last.start, &ended).map_err(failed)?;
        let mut step = TapedStep { time: before.time, parts, state: None, outputs: Vec::new() };
        let mut states = Vec::new();
        let mut is_due = self.outputs.is_empty();
        while let Some(time) = self.outputs.next(end.time) {
            if (end.time - time).abs() <= rounding(self.start, end.time) {
                is_due = true;
                continue;
            }
            let theta = (time - before.time) / (end.time - before.time);
            let (point, parts) = inside(method, &last, theta).map_err(failed)?;
            step.outputs.push((self.count + states.len(), parts));
            let laws = flow.laws(&point);
            let (energy, entropy) = (laws.energy, laws.entropy);
            states.push(State { step: before.step, time, point, energy, entropy });
        }
        if is_due {
            step.state = Some(self.count + states.len());
            states.push(end.clone());
        }
        self.count += states.len();
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
        (x0, mut schedule): (Point<D>, Schedule),
        most: usize,
    ) -> Result<Self, TangentError<D::Manifold>> {
        if !schedule.watch.events.is_empty() {
            return Err(TangentError::Broken { what: "events" });
        }
        if !schedule.corners.is_empty() {
            return Err(TangentError::Broken { what: "corners" });
        }
        let (start, end) = (schedule.start, schedule.end());
        schedule.watch.check([start, end], start).map_err(RunError::from)?;
        let (times, interval) = (schedule.watch.times.take(), schedule.watch.interval.take());
        let outputs = Outputs::after(start, start, times, interval);
        let steps = method.steps(system, x0, schedule)?;
        if steps.is_endless() {
            return Err(RunError::from(SpanError::Endless).into());
        }
        let mut states = vec![steps.state().clone()];
        let mut recorder = Recorder { steps, outputs, start, count: 1 };
        let (mut segments, mut taken) = (vec![recorder.segment()], Vec::new());
        while recorder.steps.ending().is_none() {
            if taken.len() == most {
                taken.clear();
                segments.push(recorder.segment());
            }
            if let Some((step, here)) = recorder.advance()? {
                taken.push(step);
                states.extend(here);
            }
        }
        let certificate = recorder.steps.certificate().clone();
        Ok(Self { states, certificate, segments, steps: taken })
    }

    /// Takes the steps between two segments again, bit for bit.
    pub(super) fn again<M: Stepper<D>>(
        method: M,
        system: &D,
        [segment, next]: [&Segment; 2],
    ) -> Result<Vec<TapedStep<D>>, TangentError<D::Manifold>> {
        let steps = method.resume(system, &segment.checkpoint)?;
        let (outputs, count) = (segment.outputs.clone(), segment.count);
        let mut recorder = Recorder { start: outputs.start(), steps, outputs, count };
        let mut taken = Vec::with_capacity(next.step - segment.step);
        while recorder.steps.state().step < next.step {
            match recorder.advance()? {
                Some((step, _)) => taken.push(step),
                None => break,
            }
        }
        Ok(taken)
    }
}
