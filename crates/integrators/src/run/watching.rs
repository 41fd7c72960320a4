//! Outputs and events between the steps of a run.

use std::collections::VecDeque;

use crate::run::certificate::EventCount;
use crate::run::event::{Event, Events, LastNumber};
use crate::run::progress::Progress;
use crate::run::requests::{Outputs, Requests};
use crate::run::span_error::SpanError;
use crate::run::state::State;
use crate::step::{EntropyStep, Flow, Laws, StateSpace};

/// The start of the last step.
#[derive(Clone, Debug)]
pub(super) struct StepBefore<F: Flow + ?Sized> {
    pub(super) state: State<F::Space>,
    /// The laws there.
    pub(super) values: Laws<F::Numbers>,
    /// The entropy after the last step before it that dissipated.
    pub(super) entropy: f64,
    /// The size of the step; 0 before the first one.
    pub(super) h: f64,
    /// Whether the step was taken in parts.
    pub(super) in_parts: bool,
    /// How the entropy at its end was found, by a method that projects onto it.
    pub(super) entropy_step: Option<EntropyStep>,
}

/// Outputs and events between the steps of a run.
pub(super) struct Watching<M: StateSpace> {
    pub(super) outputs: Outputs,
    pub(super) events: Events<M>,
    /// The states to record of the last step, if they replace the one at its end.
    pub(super) queue: VecDeque<State<M>>,
    pub(super) found: Vec<Event<M>>,
}

impl<M: StateSpace> Watching<M> {
    /// Takes up the requests of a run that is at this state; `None` if there are none.
    pub(super) fn new<V>(
        requests: Requests,
        progress: &Progress<V>,
        state: &State<M>,
        (last, counts): (&[LastNumber], &[EventCount]),
    ) -> Result<Option<Box<Self>>, SpanError> {
        let start = progress.start;
        let next_end = progress.next_end(state.time);
        requests.check([start, progress.end()], next_end, progress.direction())?;
        let Requests { times, interval, events } = requests;
        let outputs = Outputs::of(progress, state.time, times, interval);
        let events = Events::new(events, state, last, counts)?;
        if outputs.is_empty() && events.is_empty() {
            return Ok(None);
        }
        let (queue, found) = (VecDeque::new(), Vec::new());
        Ok(Some(Box::new(Self { outputs, events, queue, found })))
    }

    /// Whether the states of the queue are recorded in place of the one at the end of the step.
    pub(super) fn replaces_steps(&self) -> bool {
        !self.outputs.is_empty() || !self.queue.is_empty()
    }

    /// Returns whether no output is left, and no event ends the run.
    pub(super) fn is_over(&self) -> bool {
        self.queue.is_empty()
            && !self.outputs.is_empty()
            && self.outputs.are_over()
            && !self.events.may_stop()
    }

    pub(super) const fn queue(&mut self) -> &mut VecDeque<State<M>> {
        &mut self.queue
    }
}
