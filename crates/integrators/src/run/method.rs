//! Runs by any method.

use crate::run::checkpoint::{Checkpoint, ResumeError};
use crate::run::error::RunError;
use crate::run::plain::Whole;
use crate::run::schedule::Schedule;
use crate::run::steps::Steps;
use crate::run::trajectory::Trajectory;
use crate::step::{Element, Flow, HasFlow, Stepper, in_room};

/// Runs of a one-step method. Every [`Stepper`] is one, and a retraction of this library too:
/// `WeylMidpoint.run(&system, x0, Span::steps(0.1, 1000))` takes the steps of its [`Scheme`](crate::Scheme) with the default
/// options. A retraction of your own runs by `Scheme::new(mine).run(..)`. `Run` is another name of this trait.
pub trait Method<F: Flow>: Stepper<F> {
    /// Verifies the model and starts a run: endless in steps of size `h`, or over a [`Span`](crate::Span) or
    /// [`Until`](crate::Until).
    ///
    /// # Errors
    ///
    /// [`RunError`] if the model breaks a law or the schedule cannot be run.
    fn steps<'a, Y: HasFlow<Flow = F>>(
        self,
        system: &'a Y,
        x0: Element<F>,
        schedule: impl Into<Schedule>,
    ) -> Result<Steps<'a, F, Self>, RunError<F::Space>> {
        let (flow, schedule) = (system.as_flow(), schedule.into());
        in_room(flow, || Steps::start(self, flow, x0, schedule))
    }

    /// Verifies the model, runs it over a [`Span`](crate::Span) or [`Until`](crate::Until), and records the states.
    ///
    /// # Errors
    ///
    /// [`RunError`]; if a step failed, the trajectory so far is in it.
    fn run<Y: HasFlow<Flow = F>>(
        self,
        system: &Y,
        x0: Element<F>,
        schedule: impl Into<Schedule>,
    ) -> Result<Trajectory<F::Space>, RunError<F::Space>> {
        let schedule = schedule.into();
        system.as_flow().visit(Whole { method: self, x0, schedule })
    }

    /// Takes up a run where it was put down. With the system and the method of that run the steps
    /// are those that it would have taken, bit for bit.
    ///
    /// # Errors
    ///
    /// [`ResumeError`] if the checkpoint does not belong to the system or to the method, or if its file has
    /// changed.
    fn resume<'a, Y: HasFlow<Flow = F>>(
        self,
        system: &'a Y,
        checkpoint: &Checkpoint,
    ) -> Result<Steps<'a, F, Self>, ResumeError> {
        let flow = system.as_flow();
        in_room(flow, || Steps::resume(self, flow, checkpoint))
    }
}

impl<F: Flow, M: Stepper<F>> Method<F> for M {}
