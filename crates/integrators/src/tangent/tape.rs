//! The steps of a run, kept for the way back.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::certificate::Sensitivity;
use super::columns::{Carried, Moved};
use super::differentiated::Differentiated;
use super::error::{TangentError, Unlinearised};
use super::event::Located;
use super::product::{Product, Reach, Step, product, propagate};
use super::saltation::{Crossing, crossing};
use super::smooth::{FlowOf, SmoothFlow, SpaceOf, VectorOf};
use super::steps::{Jumps, again, rounding, sizes_at, smooth_events, turn_rows, units_at};
use crate::run::certificate::Certificate;
use crate::run::checkpoint::Checkpoint;
use crate::run::ending::Ending;
use crate::run::error::RunError;
use crate::run::event::Event;
use crate::run::method::Method as _;
use crate::run::recording::Numbered;
use crate::run::schedule::Schedule;
use crate::run::state::State;
use crate::run::steps::Steps;
use crate::step::{Element, Flow, HasFlow, Scales, StateSpace, Stepper};

/// A step of a run.
pub(super) struct TapedStep<F: Flow> {
    /// The time of its start.
    pub(super) time: f64,
    pub(super) product: Product<F>,
    pub(super) end: End,
    /// The steps to the recorded states inside it.
    pub(super) outputs: Vec<Product<F>>,
    /// Its number, that of each part of a step between two jumps.
    number: usize,
}

/// The end of a step that was kept.
pub(super) enum End {
    /// The end of its last part.
    Step,
    /// An event at which the state jumps or the run ends, with the matrix from the frame of the last part to that of the event.
    Event { crossing: Crossing, turn: Option<DMatrix<f64>>, stops: bool },
    /// An event at which the run ends, whose function has no derivatives.
    Stop,
}

impl End {
    /// The costate before the end from that behind it, of a loss that changes by `along_end` with the time at which the run ends.
    pub(super) fn pull_back<M: StateSpace>(
        &self,
        costate: DVector<f64>,
        along_end: f64,
    ) -> Result<DVector<f64>, TangentError<M>> {
        let (Crossing { matrix, time }, turn, stops) = match self {
            Self::Step => return Ok(costate),
            Self::Stop if along_end == 0.0 && costate.iter().all(|entry| *entry == 0.0) => {
                return Ok(costate);
            }
            Self::Stop => return Err(TangentError::Broken { what: "a stop without derivatives" }),
            Self::Event { crossing, turn, stops } => (crossing, turn, *stops),
        };
        let mut costate = matrix.tr_mul(&costate);
        if stops {
            costate += time * along_end;
        }
        if let Some(turn) = turn {
            let turned = turn.tr_mul(&costate.rows(0, turn.nrows()));
            costate.rows_mut(0, turn.nrows()).copy_from(&turned);
        }
        Ok(costate)
    }
}

/// A recorded state, with the number of the step in which it lies.
struct Taped<S> {
    state: S,
    number: usize,
}

impl<S: Numbered> Numbered for Taped<S> {
    fn step(&self) -> usize {
        self.state.step()
    }
}

/// The start of a row of steps.
pub(super) struct Segment<V> {
    /// The largest sizes of the entries before it.
    largest: Option<V>,
    checkpoint: Checkpoint,
    number: usize,
}

/// The steps of a run: all of its last segment, and the starts of the others.
pub(super) struct Tape<F: Flow> {
    pub(super) states: Vec<State<F::Space>>,
    /// The numbers of the steps in which they lie.
    numbers: Vec<usize>,
    pub(super) certificate: Certificate,
    pub(super) ending: Ending,
    /// The schedule, for the outputs of steps that are taken again.
    schedule: Schedule,
    pub(super) segments: Vec<Segment<F::Vector>>,
    pub(super) steps: Vec<TapedStep<F>>,
}

/// A run on its way.
struct Recorder<'a, D: Differentiated<M>, M: Stepper<FlowOf<D>>> {
    system: &'a D,
    steps: Steps<'a, FlowOf<D>, M>,
    events: Jumps<D::MovingWide>,
    /// The number of the last step.
    number: usize,
    /// The largest sizes of the entries so far, if steps beside the others are taken.
    largest: Option<VectorOf<D>>,
}

/// A step with the states that the run yields in place of the one at its end.
type Recorded<F> = (TapedStep<F>, Vec<State<<F as Flow>::Space>>);

/// A step up to the event that ends it.
type UpTo<F> = (Product<F>, End);

impl<D: Differentiated<M>, M: Stepper<FlowOf<D>>> Recorder<'_, D, M> {
    fn segment(&self) -> Segment<VectorOf<D>> {
        let (largest, checkpoint) = (self.largest.clone(), self.steps.checkpoint());
        Segment { largest, checkpoint, number: self.number }
    }

    /// Takes one step; `None` if the run has ended before it.
    fn advance(&mut self) -> Result<Option<Recorded<FlowOf<D>>>, TangentError<SpaceOf<D>>> {
        let again = again(self.system, &self.steps, &mut self.largest);
        let scales = self.steps.scales();
        let again = again.as_ref();
        let before = self.steps.state().step;
        self.steps.advance()?;
        let stops = self.steps.ending().is_some_and(Ending::is_event);
        let found = self.steps.take_events().pop();
        let event = found.filter(|event| stops || event.jump.is_some());
        let cut = event.as_ref().filter(|_| !stops).and_then(|_| self.steps.cut_step(&scales));
        let end = self.steps.state();
        if cut.is_none() && end.step == before {
            return Ok(None);
        }
        self.number += 1;
        let is_cut = cut.is_some();
        let last = cut.unwrap_or_else(|| self.steps.last_step(&scales));
        let (flow, method, time) = (self.steps.flow(), self.steps.method(), last.start.time);
        let failed = |cause| TangentError::NotLinearised { time, cause };
        // A jump moves the end of the run, by which the others are divided.
        let whole = if is_cut { last.h } else { end.time - time };
        let theta = |inside: &State<SpaceOf<D>>| (inside.time - time) / whole;
        let of = (self.system, method);
        let (whole_step, at_end) = match &event {
            Some(event) => self.up_to((&last, again), &scales, (event, theta(&event.state)))?,
            None => {
                let reach = Reach::End(&end.point);
                (product(of, (&last, again), &reach).map_err(failed)?, End::Step)
            }
        };
        let mut step = TapedStep {
            time,
            product: whole_step,
            end: at_end,
            outputs: Vec::new(),
            number: self.number,
        };
        let asked: Vec<_> = self.steps.outputs().collect();
        let count = match &event {
            None => asked.iter().take_while(|state| state.step != end.step).count(),
            // A run that is over ends with the state at the event, or with that after its jump.
            Some(_) => asked.len().saturating_sub(usize::from(self.steps.ending().is_some())),
        };
        let mut states = Vec::new();
        for (k, &asked) in asked.iter().enumerate() {
            if k >= count {
                states.push(asked.clone());
                continue;
            }
            if self.steps.certificate().noise.is_some() {
                // A step of that fraction has other numbers than the path.
                let what = "outputs inside steps of a path with noise";
                return Err(TangentError::Broken { what });
            }
            let reach = Reach::Inside { theta: theta(asked), time: asked.time };
            let output = product(of, (&last, again), &reach).map_err(failed)?;
            let point = output.end.clone();
            step.outputs.push(output);
            let laws = flow.laws(&point);
            let (energy, entropy) = (laws.energy, laws.entropy);
            states.push(State { point, energy, entropy, ..*asked });
        }
        Ok(Some((step, states)))
    }

    /// The last step up to the event that ends it, at a fraction of it.
    fn up_to(
        &self,
        (last, again): Step<'_, FlowOf<D>>,
        scales: &Scales<VectorOf<D>>,
        (event, theta): (&Event<SpaceOf<D>>, f64),
    ) -> Result<UpTo<FlowOf<D>>, TangentError<SpaceOf<D>>> {
        let (system, method) = (self.system, self.steps.method());
        let failed = |cause| TangentError::NotLinearised { time: last.start.time, cause };
        let reach = Reach::Inside { theta, time: event.state.time };
        let up_to = product((system, method), (last, again), &reach).map_err(failed)?;
        let Some(smooth) = &self.events[event.index] else { return Ok((up_to, End::Stop)) };
        let here = Carried::start(system.wide_rows(last.start.x));
        let Moved { mut carried, along_h: mut velocity } =
            propagate((system, method), &up_to, &here).map_err(failed)?;
        if velocity.iter().any(|v| v.is_nan()) {
            return Err(failed(Unlinearised::Branch));
        }
        let x = &event.state.point;
        let turn = system.as_flow().turn(&up_to.end, x);
        if let Some(turn) = &turn {
            velocity = turn * velocity;
            turn_rows(turn, &mut carried.t);
        }
        let (rows, units) = (system.wide_rows(x), units_at((system, method), x, last.h));
        let rounding = rounding((system, method));
        Sensitivity::default().enter(&rows, &units, &carried, rounding).map_err(failed)?;
        let sizes = &sizes_at((system, method), scales, x);
        let across = up_to.across.as_ref();
        let at = Located { event, velocity: &velocity, sizes, across };
        let after = event.jump.as_ref().map(|_| &self.steps.state().point);
        let crossing = crossing((system, method), &at, smooth, after)?;
        Ok((up_to, End::Event { crossing, turn, stops: after.is_none() }))
    }
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
        let events = smooth_events((system, &method), &schedule)?;
        let steps = method.steps(system.as_flow(), x0, schedule.clone())?;
        let checked = Differentiated::<M>::check_parameters(system, &steps.state().point);
        checked.map_err(RunError::<F::Space>::from)?;
        let start = Taped { state: steps.state().clone(), number: 0 };
        let mut recording = steps.recording(start).map_err(RunError::<F::Space>::from)?;
        let mut recorder = Recorder { system, steps, events, number: 0, largest: None };
        let (mut segments, mut taken) = (vec![recorder.segment()], Vec::new());
        while recorder.steps.ending().is_none() {
            if taken.len() == most {
                taken.clear();
                segments.push(recorder.segment());
            }
            let Some((step, instead)) = recorder.advance()? else { continue };
            let number = step.number;
            taken.push(step);
            if recorder.steps.replaces_steps() {
                recording.states.extend(instead.into_iter().map(|state| Taped { state, number }));
            } else {
                let (end, over) = (recorder.steps.state(), recorder.steps.ending().is_some());
                let state = || Taped { state: end.clone(), number };
                recording.end_of_step(end.step, [over, false], state);
            }
        }
        let certificate = recorder.steps.certificate().clone();
        let ending = recorder.steps.ending().unwrap_or(Ending::Stopped);
        let taped = recording.states.into_iter().map(|Taped { state, number }| (state, number));
        let (states, numbers) = taped.unzip();
        Ok(Self { states, numbers, certificate, ending, schedule, segments, steps: taken })
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
        let events = smooth_events((system, &method), &self.schedule)?;
        let steps = method.resume(system.as_flow(), &segment.checkpoint)?;
        let steps = steps.watching(self.schedule.clone()).map_err(RunError::from)?;
        let (number, largest) = (segment.number, segment.largest.clone());
        let mut recorder = Recorder { system, steps, events, number, largest };
        let mut taken = Vec::with_capacity(next.number - segment.number);
        while recorder.number < next.number {
            match recorder.advance()? {
                Some((step, _)) => taken.push(step),
                None => break,
            }
        }
        Ok(taken)
    }

    /// The numbers of the recorded states inside a step, and of those at its end.
    pub(super) fn recorded(&self, step: &TapedStep<F>) -> [Range<usize>; 2] {
        let first = self.numbers.partition_point(|number| *number < step.number);
        let end = self.numbers.partition_point(|number| *number <= step.number);
        let inside = first + step.outputs.len();
        [first..inside, inside..end]
    }
}
