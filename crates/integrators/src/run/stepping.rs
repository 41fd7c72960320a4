//! A method at work, as a run sees it.

use crate::step::{
    AnyFlow, Element, Excursion, Flow, LimitingSites, Memory as _, Refusal, StepEnds, StepError,
    StepStart, Stepper, Taken,
};

/// A method with its memory, for a flow of which only the states and the numbers are known.
pub(super) trait AnyStepper<F: Flow + ?Sized> {
    /// Takes a step of size `h`, in parts if needed.
    fn step(&mut self, start: StepStart<'_, F>, h: f64) -> Result<Taken<F>, StepError>;

    /// Tries a step of size `h` with a copy of the memory, for steps of `ratio` times the size of the last one.
    fn attempt(&mut self, start: StepStart<'_, F>, h: f64, ratio: f64)
    -> Result<Taken<F>, Refusal>;

    /// Returns the local error of the step that was tried ([`Stepper::error`]).
    fn error_of_try(&self, step: &StepEnds<'_, F>, norm: &dyn Fn(&F::Vector) -> f64)
    -> Option<f64>;

    /// Goes on with the memory of the step that was tried.
    fn accept(&mut self);

    /// Gives up the memory of the step that was tried.
    fn give_up(&mut self);

    /// Notes what a step that was refused has left in its memory.
    fn refuse(&mut self);

    /// Returns the local error of a step that was taken ([`Stepper::error`]).
    fn error(&self, step: &StepEnds<'_, F>, norm: &dyn Fn(&F::Vector) -> f64) -> Option<f64>;

    /// Returns the sites that limit a step that was taken ([`Stepper::limiting_sites`]).
    fn limiting_sites(&self, step: &StepEnds<'_, F>, allowed: &F::Vector) -> LimitingSites;

    /// Takes a new memory, behind a corner.
    fn begin(&mut self);

    /// Forgets what is a function of the state reached, whose clock was set ([`Memory::clocked`]).
    fn clocked(&mut self);

    /// Calls `f` with the method as it is at its first step, without a memory.
    fn afresh(&self, f: &mut dyn FnMut(&mut dyn AnyStepper<F>));

    /// Returns the state at the fraction `θ` of a step that was taken ([`Stepper::between`]).
    fn between(&mut self, step: &StepEnds<'_, F>, theta: f64) -> Option<Element<F>>;

    /// Returns the error of a request for a state inside a step where there is none.
    fn nothing_between(&self, time: f64, h: f64) -> StepError;

    /// Returns the state at a fraction of a step that was taken on a random path ([`Stepper::on_path`]).
    fn on_path(&self, start: StepStart<'_, F>, sizes: [f64; 2]) -> Option<Element<F>>;

    /// Draws whether a function was beyond zero between two times of a step that was taken ([`Stepper::excursion`]).
    fn excursion(
        &self,
        start: StepStart<'_, F>,
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
    /// The memory of the step that was tried.
    pub(super) tried: Option<M::Memory>,
}

impl<'a, F: Flow + ?Sized, M: Stepper<F>> AnyStepper<AnyFlow<'a, F>> for Stepping<'_, 'a, F, M> {
    fn step(
        &mut self,
        start: StepStart<'_, AnyFlow<'a, F>>,
        h: f64,
    ) -> Result<Taken<AnyFlow<'a, F>>, StepError> {
        self.method.step(&start_of(self.flow, start), h, self.memory).map(taken)
    }

    fn attempt(
        &mut self,
        start: StepStart<'_, AnyFlow<'a, F>>,
        h: f64,
        ratio: f64,
    ) -> Result<Taken<AnyFlow<'a, F>>, Refusal> {
        let memory = self.tried.insert(self.memory.rescaled(ratio));
        memory.take_room(self.memory);
        self.method.attempt(&start_of(self.flow, start), h, memory).map(taken)
    }

    fn error_of_try(
        &self,
        step: &StepEnds<'_, AnyFlow<'a, F>>,
        norm: &dyn Fn(&F::Vector) -> f64,
    ) -> Option<f64> {
        self.method.error(&ends_of(self.flow, step), self.tried.as_ref()?, norm)
    }

    fn accept(&mut self) {
        if let Some(tried) = self.tried.take() {
            let before = std::mem::replace(self.memory, tried);
            self.memory.reuse(before);
        }
    }

    fn give_up(&mut self) {
        if let Some(tried) = self.tried.take() {
            self.memory.reuse(tried);
        }
    }

    fn refuse(&mut self) {
        if let Some(tried) = self.tried.take() {
            self.memory.refused(tried);
        }
    }

    fn error(
        &self,
        step: &StepEnds<'_, AnyFlow<'a, F>>,
        norm: &dyn Fn(&F::Vector) -> f64,
    ) -> Option<f64> {
        self.method.error(&ends_of(self.flow, step), self.memory, norm)
    }

    fn limiting_sites(
        &self,
        step: &StepEnds<'_, AnyFlow<'a, F>>,
        allowed: &F::Vector,
    ) -> LimitingSites {
        self.method.limiting_sites(&ends_of(self.flow, step), self.memory, allowed)
    }

    fn begin(&mut self) {
        *self.memory = self.method.memory();
    }

    fn clocked(&mut self) {
        self.memory.clocked();
    }

    fn afresh(&self, f: &mut dyn FnMut(&mut dyn AnyStepper<AnyFlow<'a, F>>)) {
        let &Self { method, flow, .. } = self;
        f(&mut Stepping { method, flow, memory: &mut method.memory(), tried: None });
    }

    fn between(&mut self, step: &StepEnds<'_, AnyFlow<'a, F>>, theta: f64) -> Option<Element<F>> {
        self.method.between(&ends_of(self.flow, step), self.memory, theta)
    }

    fn nothing_between(&self, time: f64, h: f64) -> StepError {
        self.method.nothing_between(time, h)
    }

    fn on_path(&self, start: StepStart<'_, AnyFlow<'a, F>>, sizes: [f64; 2]) -> Option<Element<F>> {
        self.method.on_path(&start_of(self.flow, start), sizes, self.memory)
    }

    fn excursion(
        &self,
        start: StepStart<'_, AnyFlow<'a, F>>,
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
#[inline]
fn start_of<'s, F: Flow + ?Sized>(
    flow: &'s F,
    StepStart { x, time, values, reference, allowed, .. }: StepStart<'s, AnyFlow<'_, F>>,
) -> StepStart<'s, F> {
    StepStart { flow, x, time, values, reference, allowed }
}

/// The ends of a step of the flow itself.
#[inline]
fn ends_of<'s, F: Flow + ?Sized>(
    flow: &'s F,
    &StepEnds { x, end, h, values, reference, .. }: &StepEnds<'s, AnyFlow<'_, F>>,
) -> StepEnds<'s, F> {
    StepEnds { flow, x, end, h, values, reference }
}

/// A step of any flow with these states and numbers.
#[inline]
fn taken<'a, F: Flow + ?Sized>(
    Taken { x, values, evidence, effort }: Taken<F>,
) -> Taken<AnyFlow<'a, F>> {
    Taken { x, values, evidence, effort }
}
