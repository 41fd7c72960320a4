//! Methods for flows in plain numbers, behind a pointer.

use std::any::Any;
use std::fmt::Debug;

use super::plain::{Directions, Entries};
use super::{
    Control, Element, Excursion, LimitingSites, Memory, MethodError, NoiseSummary, PlainFlow,
    Promises, Refusal, RestoreError, Saved, StepEnds, StepError, StepStart, Stepper, Taken,
};

/// A method for flows in plain numbers, of which nothing else is known: a [`Stepper`] behind a pointer.
pub(crate) trait PlainMethod {
    /// [`Stepper::name`].
    fn name(&self) -> String;

    /// [`Stepper::memory`].
    fn memory(&self) -> PlainMemory;

    /// [`Stepper::order`].
    fn order(&self) -> u32;

    /// [`Stepper::control`].
    fn control(&self) -> Control;

    /// [`Stepper::damps`].
    fn damps(&self) -> bool;

    /// [`Stepper::noise`].
    fn noise(&self, flow: &PlainFlow<'_>) -> Option<NoiseSummary>;

    /// [`Stepper::nothing_between`].
    fn nothing_between(&self, time: f64, h: f64) -> StepError;

    /// [`Stepper::on_path`].
    fn on_path(
        &self,
        start: &StepStart<'_, PlainFlow<'_>>,
        sizes: [f64; 2],
        memory: &PlainMemory,
    ) -> Option<Entries>;

    /// [`Stepper::excursion`].
    fn excursion(
        &self,
        start: &StepStart<'_, PlainFlow<'_>>,
        h: f64,
        memory: &PlainMemory,
        excursion: &Excursion<'_, Entries>,
    ) -> Option<bool>;

    /// [`Stepper::promises`].
    fn promises(&self, flow: &PlainFlow<'_>) -> Promises;

    /// [`Stepper::check`].
    ///
    /// # Errors
    ///
    /// The method's own error.
    fn check(&self, follows_tolerance: bool) -> Result<(), MethodError>;

    /// [`Stepper::step`].
    ///
    /// # Errors
    ///
    /// [`StepError`] if it cannot be taken.
    fn step<'a>(
        &self,
        start: &StepStart<'_, PlainFlow<'a>>,
        h: f64,
        memory: &mut PlainMemory,
    ) -> Result<Taken<PlainFlow<'a>>, StepError>;

    /// [`Stepper::attempt`].
    ///
    /// # Errors
    ///
    /// The refusal of the step.
    fn attempt<'a>(
        &self,
        start: &StepStart<'_, PlainFlow<'a>>,
        h: f64,
        memory: &mut PlainMemory,
    ) -> Result<Taken<PlainFlow<'a>>, Refusal>;

    /// [`Stepper::error`].
    fn error(
        &self,
        step: &StepEnds<'_, PlainFlow<'_>>,
        memory: &PlainMemory,
        norm: &dyn Fn(&Directions) -> f64,
    ) -> Option<f64>;

    /// [`Stepper::between`].
    fn between(
        &self,
        step: &StepEnds<'_, PlainFlow<'_>>,
        memory: &mut PlainMemory,
        theta: f64,
    ) -> Option<Entries>;
}

impl<'a> Stepper<PlainFlow<'a>> for &dyn PlainMethod {
    type Memory = PlainMemory;

    fn name(&self) -> String {
        (**self).name()
    }

    fn memory(&self) -> PlainMemory {
        (**self).memory()
    }

    fn order(&self) -> u32 {
        (**self).order()
    }

    fn control(&self) -> Control {
        (**self).control()
    }

    fn damps(&self) -> bool {
        (**self).damps()
    }

    fn noise(&self, flow: &PlainFlow<'a>) -> Option<NoiseSummary> {
        (**self).noise(flow)
    }

    fn nothing_between(&self, time: f64, h: f64) -> StepError {
        (**self).nothing_between(time, h)
    }

    fn on_path(
        &self,
        start: &StepStart<'_, PlainFlow<'a>>,
        sizes: [f64; 2],
        memory: &PlainMemory,
    ) -> Option<Entries> {
        (**self).on_path(start, sizes, memory)
    }

    fn excursion(
        &self,
        start: &StepStart<'_, PlainFlow<'a>>,
        h: f64,
        memory: &PlainMemory,
        excursion: &Excursion<'_, Entries>,
    ) -> Option<bool> {
        (**self).excursion(start, h, memory, excursion)
    }

    fn promises(&self, flow: &PlainFlow<'a>) -> Promises {
        (**self).promises(flow)
    }

    fn check(&self, follows_tolerance: bool) -> Result<(), MethodError> {
        (**self).check(follows_tolerance)
    }

    fn step(
        &self,
        start: &StepStart<'_, PlainFlow<'a>>,
        h: f64,
        memory: &mut PlainMemory,
    ) -> Result<Taken<PlainFlow<'a>>, StepError> {
        (**self).step(start, h, memory)
    }

    fn attempt(
        &self,
        start: &StepStart<'_, PlainFlow<'a>>,
        h: f64,
        memory: &mut PlainMemory,
    ) -> Result<Taken<PlainFlow<'a>>, Refusal> {
        (**self).attempt(start, h, memory)
    }

    fn error(
        &self,
        step: &StepEnds<'_, PlainFlow<'a>>,
        memory: &PlainMemory,
        norm: impl Fn(&Directions) -> f64,
    ) -> Option<f64> {
        (**self).error(step, memory, &norm)
    }

    /// A vector of plain numbers has no sites.
    fn limiting_sites(
        &self,
        _: &StepEnds<'_, PlainFlow<'a>>,
        _: &PlainMemory,
        _: &Directions,
    ) -> LimitingSites {
        LimitingSites::default()
    }

    fn between(
        &self,
        step: &StepEnds<'_, PlainFlow<'a>>,
        memory: &mut PlainMemory,
        theta: f64,
    ) -> Option<Element<PlainFlow<'a>>> {
        (**self).between(step, memory, theta)
    }
}

/// A [`Memory`] behind a pointer.
trait AnyMemory: Debug {
    fn copy(&self) -> Box<dyn AnyMemory>;
    fn rescaled(&self, ratio: f64) -> Box<dyn AnyMemory>;
    fn restarted(&self) -> Box<dyn AnyMemory>;
    fn clocked(&mut self);
    fn take_room(&mut self, from: &mut dyn Any);
    fn reuse(&mut self, given_up: Box<dyn Any>);
    fn refused(&mut self, tried: Box<dyn Any>);
    fn stage_count(&self) -> Option<u32>;
    fn stage_velocities(&self) -> Vec<f64>;
    fn save(&self, saved: &mut Saved);
    fn any(&self) -> &dyn Any;
    fn any_mut(&mut self) -> &mut dyn Any;
    fn into_any(self: Box<Self>) -> Box<dyn Any>;
}

impl<T: Memory> AnyMemory for T {
    fn copy(&self) -> Box<dyn AnyMemory> {
        Box::new(self.clone())
    }

    fn rescaled(&self, ratio: f64) -> Box<dyn AnyMemory> {
        Box::new(Memory::rescaled(self, ratio))
    }

    fn restarted(&self) -> Box<dyn AnyMemory> {
        Box::new(Memory::restarted(self))
    }

    fn clocked(&mut self) {
        Memory::clocked(self);
    }

    fn take_room(&mut self, from: &mut dyn Any) {
        if let Some(from) = from.downcast_mut() {
            Memory::take_room(self, from);
        }
    }

    fn reuse(&mut self, given_up: Box<dyn Any>) {
        if let Ok(given_up) = given_up.downcast() {
            Memory::reuse(self, *given_up);
        }
    }

    fn refused(&mut self, tried: Box<dyn Any>) {
        if let Ok(tried) = tried.downcast() {
            Memory::refused(self, *tried);
        }
    }

    fn stage_count(&self) -> Option<u32> {
        Memory::stage_count(self)
    }

    fn stage_velocities(&self) -> Vec<f64> {
        Memory::stage_velocities(self)
    }

    fn save(&self, saved: &mut Saved) {
        Memory::save(self, saved);
    }

    fn any(&self) -> &dyn Any {
        self
    }

    fn any_mut(&mut self) -> &mut dyn Any {
        self
    }

    fn into_any(self: Box<Self>) -> Box<dyn Any> {
        self
    }
}

/// The memory of a method behind a pointer; none if no [method](PlainMethod::memory) has made it.
#[derive(Debug, Default)]
pub(crate) struct PlainMemory(Option<Box<dyn AnyMemory>>);

impl PlainMemory {
    /// A memory behind a pointer.
    pub(crate) fn new(memory: impl Memory) -> Self {
        Self(Some(Box::new(memory)))
    }

    /// The memory as the method knows it.
    pub(crate) fn of<T: Memory>(&mut self) -> &mut T {
        let memory = self.0.get_or_insert_with(|| Box::new(T::default()));
        memory.any_mut().downcast_mut().expect("a method has one kind of memory")
    }

    /// The memory after a step.
    pub(crate) fn after_a_step<T: Memory>(&self) -> Option<&T> {
        self.0.as_ref().and_then(|memory| memory.any().downcast_ref())
    }
}

impl Clone for PlainMemory {
    fn clone(&self) -> Self {
        Self(self.0.as_ref().map(|memory| memory.copy()))
    }
}

impl Memory for PlainMemory {
    fn rescaled(&self, ratio: f64) -> Self {
        Self(self.0.as_ref().map(|memory| memory.rescaled(ratio)))
    }

    fn restarted(&self) -> Self {
        Self(self.0.as_ref().map(|memory| memory.restarted()))
    }

    fn clocked(&mut self) {
        if let Some(memory) = &mut self.0 {
            memory.clocked();
        }
    }

    fn take_room(&mut self, from: &mut Self) {
        if let (Some(memory), Some(from)) = (&mut self.0, &mut from.0) {
            memory.take_room(from.any_mut());
        }
    }

    fn reuse(&mut self, given_up: Self) {
        if let (Some(memory), Some(given_up)) = (&mut self.0, given_up.0) {
            memory.reuse(given_up.into_any());
        }
    }

    fn refused(&mut self, tried: Self) {
        if let (Some(memory), Some(tried)) = (&mut self.0, tried.0) {
            memory.refused(tried.into_any());
        }
    }

    fn stage_count(&self) -> Option<u32> {
        self.0.as_ref()?.stage_count()
    }

    fn stage_velocities(&self) -> Vec<f64> {
        self.0.as_ref().map_or_else(Vec::new, |memory| memory.stage_velocities())
    }

    fn save(&self, saved: &mut Saved) {
        if let Some(memory) = &self.0 {
            memory.save(saved);
        }
    }

    /// Refuses all numbers: a run is resumed in the types of its method.
    fn restore(_: &Saved) -> Result<Self, RestoreError> {
        Err(RestoreError::Damaged { what: "memory of a method without a type", value: f64::NAN })
    }
}
