//! The states of a run in a row: one after the other, or all in a trajectory.

use crate::run::checkpoint::Checkpoint;
use crate::run::controller::StepSize;
use crate::run::course::Course;
use crate::run::ending::Ending;
use crate::run::error::RunError;
use crate::run::progress::Progress;
use crate::run::recording::{Numbered, Recording};
use crate::run::span_error::SpanError;
use crate::run::state::State;
use crate::run::steps::Steps;
use crate::run::trajectory::Trajectory;
use crate::run::watching::Watching;
use crate::step::{Flow, StateSpace, StepError, Stepper, in_room};

/// The most states that a run makes room for beforehand: it may end long before its span.
const ROOM: usize = 1 << 12;

impl<M: StateSpace> Numbered for State<M> {
    fn step(&self) -> usize {
        self.step
    }
}

impl<F: Flow + ?Sized, M: Stepper<F>> Steps<'_, F, M> {
    /// Takes all steps that are left, and records the states from here on.
    ///
    /// # Errors
    ///
    /// [`RunError::Step`] if a step failed, with the trajectory so far;
    /// [`SpanError::Endless`] if the schedule has no end.
    pub fn run(self) -> Result<Trajectory<F::Space>, RunError<F::Space>> {
        let flow = self.flow;
        in_room(flow, || self.record())
    }

    /// Begins to record a run, from what is recorded of its start.
    pub(crate) fn recording<S: Numbered>(&self, start: S) -> Result<Recording<S>, SpanError> {
        self.course.recording(start)
    }

    /// Whether the [outputs](Self::outputs) of the last step are recorded in place of the state at its end.
    pub(crate) fn replaces_steps(&self) -> bool {
        self.course.watching.as_deref().is_some_and(Watching::replaces_steps)
    }

    /// Takes all steps that are left, and records their states.
    fn record(mut self) -> Result<Trajectory<F::Space>, RunError<F::Space>> {
        let mut recording = self.course.recording(self.course.state.clone())?;
        let mut failure = None;
        while self.course.progress.ending.is_none() && failure.is_none() {
            failure = self.advance().err();
            self.course.record(&mut recording, failure.is_some());
        }
        let checkpoint = self.checkpoint();
        self.course.trajectory(recording.states, checkpoint, failure)
    }
}

impl<F: Flow + ?Sized> Course<'_, F> {
    /// Begins to record.
    #[inline]
    fn recording<S: Numbered>(&self, start: S) -> Result<Recording<S>, SpanError> {
        let Progress { count, every, most, .. } = self.progress;
        if count.is_none() && matches!(self.progress.step_size, StepSize::Fixed(_)) {
            return Err(SpanError::Endless);
        }
        let room = count.map_or(ROOM, |count| (count - self.state.step.min(count)) / every);
        let mut states = Vec::with_capacity(room.min(ROOM) + 2);
        states.push(start);
        Ok(Recording { states, every, most })
    }

    /// Records what the last step has reached.
    #[inline(never)]
    fn record(&mut self, recording: &mut Recording<State<F::Space>>, failed: bool) {
        if self.watched(&mut recording.states, failed) {
            return;
        }
        let (state, over) = (&self.state, self.progress.ending.is_some());
        recording.end_of_step(state.step, [over, failed], || state.clone());
    }

    /// The trajectory through these states. In place of a call, which would move all of the run.
    #[inline(always)]
    fn trajectory(
        mut self,
        states: Vec<State<F::Space>>,
        checkpoint: Checkpoint,
        failure: Option<StepError>,
    ) -> Result<Trajectory<F::Space>, RunError<F::Space>> {
        let ending = self.progress.ending.unwrap_or(Ending::Stopped);
        let events = self.take_events();
        let certificate = self.certificate;
        let trajectory = Trajectory { states, events, certificate, ending, checkpoint };
        match failure {
            Some(cause) => Err(RunError::Step { cause, trajectory: Box::new(trajectory) }),
            None => Ok(trajectory),
        }
    }

    /// Returns whether a run without an end has found all that is yielded in place of its steps.
    fn waits_for_nothing(&self) -> bool {
        self.watching.as_deref().is_some_and(Watching::is_over)
            && self.progress.end().is_infinite()
            && self.progress.rest.is_none()
    }

    /// Records the states that were asked for in the last step, if they replace the one at its end.
    fn watched(&mut self, states: &mut Vec<State<F::Space>>, failed: bool) -> bool {
        let Some(watching) = self.watching.as_mut().filter(|watching| watching.replaces_steps())
        else {
            return false;
        };
        states.extend(watching.queue().drain(..));
        let left =
            |last: &State<F::Space>| self.progress.direction() * (self.state.time - last.time);
        if failed && states.last().is_none_or(|last| left(last) > 0.0) {
            states.push(self.state.clone());
        }
        true
    }
}

impl<F: Flow + ?Sized, M: Stepper<F>> Iterator for Steps<'_, F, M> {
    type Item = Result<State<F::Space>, StepError>;

    fn next(&mut self) -> Option<Self::Item> {
        while !self.course.failed {
            if let Some(watching) = &mut self.course.watching
                && let Some(state) = watching.queue().pop_front()
            {
                return Some(Ok(state));
            }
            if self.course.progress.ending.is_some() || self.course.waits_for_nothing() {
                return None;
            }
            let advanced = self.advance().cloned();
            self.course.failed = advanced.is_err();
            if self.course.failed
                || self.course.watching.as_ref().is_none_or(|w| !w.replaces_steps())
            {
                return Some(advanced);
            }
        }
        None
    }
}
