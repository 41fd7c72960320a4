//! Steps in a row.

use std::fmt;

use crate::run::certificate::Certificate;
use crate::run::course::{Course, Said};
use crate::run::ending::Ending;
use crate::run::error::RunError;
use crate::run::schedule::Schedule;
use crate::run::state::State;
use crate::run::stepping::Stepping;
use crate::step::{AnyFlow, Element, Flow, StepError, Stepper, in_room};

/// The iterator over the states of a run after its start, in constant memory; ended by an error, or
/// where its schedule ends. With a step size alone it is endless. It yields the state after each step, or those at
/// the [times asked for](crate::Watch::output_at) and the last one. An endless iterator over such times ends with them.
///
/// Made by [`Method::steps`](crate::Method::steps) or [`Run::steps`](crate::Run::steps).
pub struct Steps<'a, F: Flow + ?Sized, M: Stepper<F>> {
    pub(super) method: M,
    pub(super) flow: &'a F,
    pub(super) memory: M::Memory,
    pub(super) course: Course<'a, AnyFlow<'a, F>>,
}

impl<F: Flow + ?Sized, M: Stepper<F>> fmt::Debug for Steps<'_, F, M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Steps")
            .field("state", &self.course.state)
            .field("memory", &self.memory)
            .field("certificate", &self.course.certificate)
            .finish_non_exhaustive()
    }
}

impl<'a, F: Flow + ?Sized, M: Stepper<F>> Steps<'a, F, M> {
    /// Verifies the model, and starts a run of a flow, which is given as any one with its states and numbers too.
    pub(crate) fn start_any(
        method: M,
        (flow, any): (&'a F, &'a AnyFlow<'a, F>),
        x0: Element<F>,
        schedule: Schedule,
    ) -> Result<Self, RunError<F::Space>> {
        schedule.check()?;
        method.check(!schedule.is_fixed())?;
        method.serves(flow)?;
        let said = Said::by(&method, flow, schedule.start);
        let course = Course::start(any, said, x0, schedule)?;
        let memory = method.memory();
        Ok(Self { method, flow, memory, course })
    }

    /// Verifies the model, and starts.
    pub(crate) fn start(
        method: M,
        flow: &'a F,
        x0: Element<F>,
        schedule: Schedule,
    ) -> Result<Self, RunError<F::Space>>
    where
        F: Sized,
    {
        Self::start_any(method, (flow, flow), x0, schedule)
    }

    /// The state reached so far.
    pub const fn state(&self) -> &State<F::Space> {
        &self.course.state
    }

    /// The balance of the steps taken so far.
    pub const fn certificate(&self) -> &Certificate {
        &self.course.certificate
    }

    /// How the run ended; `None` as long as there are steps to take.
    pub const fn ending(&self) -> Option<Ending> {
        self.course.ending()
    }

    /// Takes one step. A run that has [ended](Self::ending) stays where it is.
    ///
    /// # Errors
    ///
    /// [`StepError`]; the state is then the last one reached.
    pub fn advance(&mut self) -> Result<&State<F::Space>, StepError> {
        if self.course.progress.ending.is_none() {
            let Self { course, method, flow, memory } = self;
            in_room(*flow, || {
                let mut method = Stepping { method, flow: *flow, memory, tried: None };
                course.take_step(&mut method).map_err(|error| course.explained(error))
            })?;
        }
        Ok(&self.course.state)
    }
}
