//! A method at work, as the parts of a run see it that are not its loop.

use crate::step::{
    AnyFlow, Element, Excursion, Flow, Memory as _, StepEnds, StepError, StepStart, Stepper, Taken,
};

/// A method with its memory, for a flow of which only the states and the numbers are known.
pub(super) trait AnyStepper<F: Flow + ?Sized> {
    /// Takes a step of size `h`, in parts if needed.
    fn step(&mut self, start: &StepStart<'_, F>, h: f64) -> Result<Taken<F>, StepError>;

    /// Calls `f` with the method as it is at its first step, without a memory.
    fn afresh(&self, f: &mut dyn FnMut(&mut dyn AnyStepper<F>));

    /// Returns the state at the fraction `θ` of a step that was taken ([`Stepper::between`]).
    fn between(&mut self, step: &StepEnds<'_, F>, theta: f64) -> Option<Element<F>>;

    /// Returns the error of a request for a state inside a step where there is none.
    fn nothing_between(&self, time: f64, h: f64) -> StepError;

    /// Returns the state at a fraction of a step that was taken on a random path ([`Stepper::on_path`]).
    fn on_path(&self, start: &StepStart<'_, F>, sizes: [f64; 2]) -> Option<Element<F>>;

    /// Draws whether a function was beyond zero between two times of a step that was taken ([`Stepper::excursion`]).
    fn excursion(
        &self,
        start: &StepStart<'_, F>,
        h: f64,
        excursion: &Excursion<'_, Element<F>>,
    ) -> Option<bool>;

    /// Forgets what is extrapolated across a corner or a jump.
    fn restart(&mut self);
}

/// A method with its memory and its flow.
pub(super) struct Stepping<'s, 'a, F: Flow + ?Sized, M: Stepper<F>> {
    pub(super) method: &'s M,
    pub(super) flow: &'a F,
    pub(super) memory: &'s mut M::Memory,
}

impl<'a, F: Flow + ?Sized, M: Stepper<F>> AnyStepper<AnyFlow<'a, F>> for Stepping<'_, 'a, F, M> {
    fn step(
        &mut self,
        start: &StepStart<'_, AnyFlow<'a, F>>,
        h: f64,
    ) -> Result<Taken<AnyFlow<'a, F>>, StepError> {
        let start = start_of(self.flow, start);
        let Taken { x, values, evidence, effort } = self.method.step(&start, h, self.memory)?;
        Ok(Taken { x, values, evidence, effort })
    }

    fn afresh(&self, f: &mut dyn FnMut(&mut dyn AnyStepper<AnyFlow<'a, F>>)) {
        let &Self { method, flow, .. } = self;
        f(&mut Stepping { method, flow, memory: &mut method.memory() });
    }

    fn between(&mut self, step: &StepEnds<'_, AnyFlow<'a, F>>, theta: f64) -> Option<Element<F>> {
        let &StepEnds { x, end, h, values, reference, .. } = step;
        let step = StepEnds { flow: self.flow, x, end, h, values, reference };
        self.method.between(&step, self.memory, theta)
    }

    fn nothing_between(&self, time: f64, h: f64) -> StepError {
        self.method.nothing_between(time, h)
    }

    fn on_path(
        &self,
        start: &StepStart<'_, AnyFlow<'a, F>>,
        sizes: [f64; 2],
    ) -> Option<Element<F>> {
        self.method.on_path(&start_of(self.flow, start), sizes, self.memory)
    }

    fn excursion(
        &self,
        start: &StepStart<'_, AnyFlow<'a, F>>,
        h: f64,
        excursion: &Excursion<'_, Element<F>>,
    ) -> Option<bool> {
        self.method.excursion(&start_of(self.flow, start), h, self.memory, excursion)
    }

    fn restart(&mut self) {
        *self.memory = self.memory.restarted();
    }
}

/// The start of a step of the flow itself.
fn start_of<'s, F: Flow + ?Sized>(
    flow: &'s F,
    start: &StepStart<'s, AnyFlow<'_, F>>,
) -> StepStart<'s, F> {
    let &StepStart { x, time, ref values, ref reference, ref allowed, .. } = start;
    let (values, reference) = (values.clone(), reference.clone());
    StepStart { flow, x, time, values, reference, allowed: allowed.clone() }
}
