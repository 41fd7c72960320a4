//! The steps of a run, kept for the way back.

use std::ops::Range;

use super::differentiated::Differentiated;
use super::error::{TangentError, Unlinearised};
use super::part::{Again, Ended, Part, memory_before};
use super::pieces::parts;
use super::smooth::{FlowOf, SmoothFlow, SpaceOf, VectorOf};
use super::steps::again;
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
use crate::step::{Element, Flow, HasFlow, Stepper};

/// A step of a run.
pub(super) struct TapedStep<F: Flow> {
    /// The time of its start.
    pub(super) time: f64,
    pub(super) parts: Vec<Part<F>>,
    /// The steps up to its end, and the latest time that is one of its end.
    pub(super) end: (usize, f64),
    /// The steps to the recorded states inside it.
    pub(super) outputs: Vec<Vec<Part<F>>>,
}

/// The start of a row of steps.
pub(super) struct Segment<V> {
    /// The largest sizes of the entries before it.
    largest: Option<V>,
    checkpoint: Checkpoint,
    step: usize,
}

/// The steps of a run: all of its last segment, and the starts of the others.
pub(super) struct Tape<F: Flow> {
    pub(super) states: Vec<State<F::Space>>,
    pub(super) certificate: Certificate,
    pub(super) ending: Ending,
    /// The schedule, for the outputs of steps that are taken again.
    schedule: Schedule,
    pub(super) segments: Vec<Segment<F::Vector>>,
    pub(super) steps: Vec<TapedStep<F>>,
}

/// A run on its way.
struct Recorder<'a, D: HasFlow, M: Stepper<FlowOf<D>>> {
    system: &'a D,
    steps: Steps<'a, FlowOf<D>, M>,
    /// The time at which it started.
    start: f64,
    /// The largest sizes of the entries so far, if steps beside the others are taken.
    largest: Option<VectorOf<D>>,
}

/// A step with the states that the run yields in place of the one at its end.
type Recorded<F> = (TapedStep<F>, Vec<State<<F as Flow>::Space>>);

impl<D: Differentiated<M>, M: Stepper<FlowOf<D>>> Recorder<'_, D, M> {
    fn segment(&self) -> Segment<VectorOf<D>> {
        let (checkpoint, step) = (self.steps.checkpoint(), self.steps.state().step);
        Segment { largest: self.largest.clone(), checkpoint, step }
    }

    /// Takes one step; `None` if the run has ended before it.
    fn advance(&mut self) -> Result<Option<Recorded<FlowOf<D>>>, TangentError<SpaceOf<D>>> {
        let again = again(self.system, &self.steps, &mut self.largest);
        let scales = self.steps.scales();
        let again = again.as_ref();
        let before = self.steps.state().clone();
        self.steps.advance()?;
        let end = self.steps.state();
        if end.step == before.step {
            return Ok(None);
        }
        let failed = |cause| TangentError::NotLinearised { time: before.time, cause };
        let (flow, method) = (self.steps.flow(), self.steps.method());
        let last = self.steps.last_step(&scales);
        let ended = Ended::of_run(&end.point, &last).with_again(again, last.h);
        let parts = parts(method, &last.start, &ended).map_err(failed)?;
        let until = (end.step, end.time + rounding(self.start, end.time));
        let mut step = TapedStep { time: before.time, parts, end: until, outputs: Vec::new() };
        let mut states = Vec::new();
        for asked in self.steps.outputs() {
            if asked.step == end.step {
                states.push(asked.clone());
                continue;
            }
            if self.steps.certificate().noise.is_some() {
                // A step of that fraction has other numbers than the path.
                let what = "outputs inside steps of a path with noise";
                return Err(TangentError::Broken { what });
            }
            let theta = (asked.time - before.time) / (end.time - before.time);
            let (point, parts) = inside(method, (&last, again), theta).map_err(failed)?;
            step.outputs.push(parts);
            let laws = flow.laws(&point);
            let (energy, entropy) = (laws.energy, laws.entropy);
            states.push(State { point, energy, entropy, ..*asked });
        }
        Ok(Some((step, states)))
    }
}

/// The state at a fraction of a step, by a step of that size.
fn inside<F: Flow, M: Stepper<F>>(
    method: &M,
    (last, again): (&LastStep<'_, F>, Option<&Again<F::Vector>>),
    theta: f64,
) -> Result<(Element<F>, Vec<Part<F>>), Unlinearised> {
    let (h, mut memory) = (theta * last.h, memory_before::<F, M>(again)?);
    let taken = method.step(&last.start, h, &mut memory).map_err(|_| Unlinearised::Singular)?;
    let parts =
        parts(method, &last.start, &Ended::new(&taken, h, &memory).with_again(again, last.h))?;
    Ok((taken.x, parts))
}

impl<F: SmoothFlow> Tape<F> {
    /// Runs a system, and keeps at most `most` steps.
    pub(super) fn record<D, M: Stepper<F>>(
        method: M,
        system: &D,
        (x0, schedule): (Element<F>, Schedule),
        most: usize,
    ) -> Result<Self, TangentError<F::Space>>
    where
        D: Differentiated<M> + HasFlow<Flow = F>,
    {
        if !schedule.watch.events.is_empty() {
            return Err(TangentError::Broken { what: "events" });
        }
        if !schedule.corners.is_empty() {
            return Err(TangentError::Broken { what: "corners" });
        }
        if schedule.backward {
            return Err(TangentError::Broken { what: "a run back in time" });
        }
        let steps = method.steps(system.as_flow(), x0, schedule.clone())?;
        let mut recording =
            steps.recording(steps.state().clone()).map_err(RunError::<F::Space>::from)?;
        let mut recorder = Recorder { system, steps, start: schedule.start, largest: None };
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
    pub(super) fn again<D, M: Stepper<F>>(
        &self,
        method: M,
        system: &D,
        [segment, next]: [&Segment<F::Vector>; 2],
    ) -> Result<Vec<TapedStep<F>>, TangentError<F::Space>>
    where
        D: Differentiated<M> + HasFlow<Flow = F>,
    {
        let steps = method.resume(system.as_flow(), &segment.checkpoint)?;
        let steps = steps.watching(self.schedule.clone()).map_err(RunError::from)?;
        let mut recorder = Recorder {
            system,
            steps,
            start: self.schedule.start,
            largest: segment.largest.clone(),
        };
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
    pub(super) fn recorded(&self, step: &TapedStep<F>) -> [Range<usize>; 2] {
        let (number, latest) = step.end;
        let end = self.states.partition_point(|state| state.step < number);
        let is_end = |state: &&State<F::Space>| state.step == number && state.time <= latest;
        let at_end = self.states[end..].iter().take_while(is_end).count();
        [end - step.outputs.len()..end, end..end + at_end]
    }
}
