//! What a run knows of a system and of a method.
//!
//! A run needs little of a system: its laws, and how large things are. This is a [`Flow`]; every
//! [`Metriplectic`](metriplectic_dynamics::Metriplectic) system is one. It knows of a method that it takes
//! steps, what these promise, and what has to be saved between two of them: a [`Method`]. Everything that a
//! user does with a run, from [`Span`](crate::Span) to [`Checkpoint`], works with any flow
//! and any method.

mod control;
mod evidence;
mod flow;
mod initial_scales;
mod metriplectic;
mod reach;
mod step;
mod vector;

use std::fmt::Debug;

pub use control::Control;
pub use evidence::{Effort, EntropyStep, Evidence, LimitingSites, Promises, StageLaws};
pub use flow::{Element, Flow, Laws, Recheck, StateSpace};
pub use step::{Refusal, StepEnds, StepStart, Taken};
pub use vector::{Components, Vector};

use crate::error::RunError;
use crate::run::checkpoint::{Checkpoint, ResumeError, Saved};
use crate::run::span::Schedule;
use crate::run::steps::Steps;
use crate::run::trajectory::Trajectory;
use crate::step_error::StepError;

/// A one-step method.
///
/// Laws ([`laws::method`](crate::laws::method)): 1. [`order`](Self::order) is the slope of the error;
/// 2. what [`promises`](Self::promises) says holds on every step; 3. a step from a saved memory is the same
/// step, bit for bit.
pub trait Method<F: Flow>: Sized {
    /// What it keeps from one step to the next, [`saved`](Memory) by a checkpoint.
    type Memory: Memory;

    /// The name in a checkpoint, with the stages or the tableau and without options. A run is resumed by a method of
    /// its name. The default is the name of the type without paths.
    fn name(&self) -> String {
        name_of::<Self>()
    }

    /// The order of convergence: it sets the exponents of adaptive step sizes.
    fn order(&self) -> u32;

    /// What holds exactly on every step.
    fn promises(&self, flow: &F) -> Promises;

    /// One step of size `h`, at any price.
    ///
    /// A run calls it within [`Flow::with_room`]; so does a caller that steps a large system by itself.
    ///
    /// # Errors
    ///
    /// [`StepError`] if it cannot be taken.
    fn step(
        &self,
        flow: &F,
        start: &StepStart<'_, F>,
        h: f64,
        memory: &mut Self::Memory,
    ) -> Result<Taken<F>, StepError>;

    /// One step of size `h` where a smaller one may be tried instead: an error costs little.
    ///
    /// # Errors
    ///
    /// What became of the step.
    fn attempt(
        &self,
        flow: &F,
        start: &StepStart<'_, F>,
        h: f64,
        memory: &mut Self::Memory,
    ) -> Result<Taken<F>, Refusal> {
        self.step(flow, start, h, memory).map_err(|error| Refusal {
            effort: Effort::default(),
            error: Some(error),
            second_law: false,
        })
    }

    /// How steps follow a tolerance; [`Control::of_order`] unless the method has a rule of its own.
    fn control(&self) -> Control {
        Control::of_order(self.order())
    }

    /// The error of a step in units of the one allowed, by a norm that gives it for a displacement. The
    /// estimate of the [`Flow`] serves methods that have none of their own in their memory.
    fn error(
        &self,
        flow: &F,
        step: &StepEnds<'_, F>,
        memory: &Self::Memory,
        norm: impl Fn(&F::Vector) -> f64,
    ) -> Option<f64> {
        let _ = memory;
        Some(norm(&flow.local_error(step.x, step.end, step.h)?))
    }

    /// The sites at which a step has the largest error, in units of the one allowed, and at which the motion is
    /// stiffest. A run asks for them on a few steps, and only for vectors with [`sites`](Vector::sites).
    ///
    /// The default has the site of the error that the [`Flow`] estimates.
    fn limiting_sites(
        &self,
        flow: &F,
        step: &StepEnds<'_, F>,
        memory: &Self::Memory,
        allowed: &F::Vector,
    ) -> LimitingSites {
        let _ = memory;
        let error = flow.local_error(step.x, step.end, step.h);
        LimitingSites::new(error.and_then(|error| error.largest_site(allowed)), None)
    }

    /// The state at the fraction `θ` of a step that was taken, from the memory after it; `None` if the method does
    /// not know it, or if the flow does not say what [lies between](Flow::displacement) two states. Where only the
    /// method does not know it, inside a step that is longer than a chart, and inside a step in
    /// [parts](Effort::splits), a run takes a step of size `θh`.
    ///
    /// The default is the cubic of Hermite in the chart at the start, of order 3, moved
    /// [onto](Flow::onto) the laws: the energy and the further invariants that the run began with, and an
    /// entropy that does not fall from one fraction to a later one.
    fn between(
        &self,
        flow: &F,
        step: &StepEnds<'_, F>,
        memory: &mut Self::Memory,
        theta: f64,
    ) -> Option<Element<F>> {
        let _ = memory;
        crate::run::dense::between(flow, step, self.promises(flow), theta)
    }

    /// Verifies the model and starts a run: endless in steps of size `h`, or over a [`Span`](crate::Span) or
    /// [`Until`](crate::Until).
    ///
    /// # Errors
    ///
    /// [`RunError`] if the model breaks a law or the schedule cannot be run.
    fn steps(
        self,
        flow: &F,
        x0: Element<F>,
        schedule: impl Into<Schedule>,
    ) -> Result<Steps<'_, F, Self>, RunError<F::Space>> {
        let schedule = schedule.into();
        flow.with_room(|| Steps::start(self, flow, x0, schedule))
    }

    /// Verifies the model, runs it over a [`Span`](crate::Span) or [`Until`](crate::Until), and records the states.
    ///
    /// # Errors
    ///
    /// [`RunError`]; if a step failed, the trajectory so far is in it.
    fn run(
        self,
        flow: &F,
        x0: Element<F>,
        schedule: impl Into<Schedule>,
    ) -> Result<Trajectory<F::Space>, RunError<F::Space>> {
        let schedule = schedule.into();
        flow.with_room(|| self.steps(flow, x0, schedule)?.run())
    }

    /// Takes up a run where it was put down. With the system and the method of that run the steps
    /// are those that it would have taken, bit for bit.
    ///
    /// # Errors
    ///
    /// [`ResumeError`] if the checkpoint does not belong to the system or to the method, or if its file has
    /// changed.
    fn resume<'a>(
        self,
        flow: &'a F,
        checkpoint: &Checkpoint,
    ) -> Result<Steps<'a, F, Self>, ResumeError> {
        flow.with_room(|| Steps::resume(self, flow, checkpoint))
    }
}

/// The name of a type without the paths of its modules.
pub(crate) fn name_of<T>() -> String {
    let full = std::any::type_name::<T>();
    let (mut name, mut start) = (String::with_capacity(full.len()), 0);
    for (at, byte) in full.bytes().enumerate() {
        if byte == b':' {
            start = at + 1;
        } else if byte.is_ascii() && !byte.is_ascii_alphanumeric() && byte != b'_' {
            name.push_str(&full[start..=at]);
            start = at + 1;
        }
    }
    name.push_str(&full[start..]);
    name
}

/// What a method keeps from one step to the next.
pub trait Memory: Clone + Debug + Default {
    /// The memory for steps of `ratio` times the size.
    #[must_use]
    fn rescaled(&self, ratio: f64) -> Self;

    /// Notes what a try that was refused has left in its own copy of this memory.
    fn refused(&mut self, tried: Self) {
        let _ = tried;
    }

    /// Puts all of its numbers into a checkpoint.
    fn save(&self, saved: &mut Saved);

    /// Reads them from a checkpoint.
    ///
    /// # Errors
    ///
    /// [`ResumeError`] if a number is missing or impossible.
    fn restore(saved: &Saved) -> Result<Self, ResumeError>;
}

/// The memory of a method that has none.
impl Memory for () {
    fn rescaled(&self, _: f64) -> Self {}

    fn save(&self, _: &mut Saved) {}

    fn restore(_: &Saved) -> Result<Self, ResumeError> {
        Ok(())
    }
}
