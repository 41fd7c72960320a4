//! The interface between runs and methods.

use super::{
    Compiled, Control, Effort, Element, Excursion, Flow, LimitingSites, Memory, MethodError,
    NoiseSummary, Promises, Refusal, StepEnds, StepError, StepStart, Taken, Vector as _, dense,
    name_of,
};

/// A one-step method.
///
/// Laws ([`laws::method`](crate::laws::method)): 1. [`order`](Self::order) is the slope of the error;
/// 2. what [`promises`](Self::promises) says holds on every step; 3. a step from a saved memory is the same
/// step, bit for bit.
pub trait Stepper<F: Flow + ?Sized>: Sized {
    /// The memory from one step to the next, [`saved`](Memory) by a checkpoint.
    type Memory: Memory;

    /// Says whether [`between`](Self::between) is the default. Then a run in plain numbers forms the state in plain numbers.
    const HAS_DEFAULT_BETWEEN: bool = false;

    /// Says whether [`compiled`](Self::compiled) returns an explicit method.
    #[doc(hidden)]
    const IS_EXPLICIT: bool = false;

    /// Says whether [`compiled`](Self::compiled) returns an implicit method.
    #[doc(hidden)]
    const IS_IMPLICIT: bool = false;

    /// Returns what the method is, if its steps in plain numbers are compiled with the library.
    #[doc(hidden)]
    fn compiled(&self) -> Option<Compiled> {
        None
    }

    /// The name in a checkpoint, with the stages or the tableau and without options. A run is resumed by a method of
    /// its name. The default is the name of the type without paths.
    fn name(&self) -> String {
        name_of::<Self>()
    }

    /// The memory before the first step, and after a corner across which nothing is extrapolated.
    fn memory(&self) -> Self::Memory {
        Self::Memory::default()
    }

    /// The order of convergence: it sets the exponents of adaptive step sizes.
    fn order(&self) -> u32;

    /// The laws that hold exactly on every step.
    fn promises(&self, flow: &F) -> Promises;

    /// Whether the method damps what is faster than a step, and adds entropy beside that of the friction.
    fn damps(&self) -> bool {
        false
    }

    /// Describes the noise of a run; `None` for one without random numbers.
    fn noise(&self, flow: &F) -> Option<NoiseSummary> {
        let _ = flow;
        None
    }

    /// Returns the error of a request for a state inside a step where there is none.
    fn nothing_between(&self, time: f64, h: f64) -> StepError {
        StepError::NothingBetween { time, h }
    }

    /// Returns the state at the fraction `θ` of a step of size `h` that was taken, on the random path that belongs to its numbers, from
    /// the memory after it; `None` of a method without random numbers, or whose numbers have no values there.
    fn on_path(
        &self,
        start: &StepStart<'_, F>,
        [h, theta]: [f64; 2],
        memory: &Self::Memory,
    ) -> Option<Element<F>> {
        let _ = (start, h, theta, memory);
        None
    }

    /// Draws whether a function that has one sign at two times of a step has the other one between them, from the memory after the
    /// step; `None` as for [`on_path`](Self::on_path).
    fn excursion(
        &self,
        start: &StepStart<'_, F>,
        h: f64,
        memory: &Self::Memory,
        excursion: &Excursion<'_, Element<F>>,
    ) -> Option<bool> {
        let _ = (start, h, memory, excursion);
        None
    }

    /// Refuses options with which no run can start, of steps that follow a tolerance or have one size.
    ///
    /// # Errors
    ///
    /// The method's own error.
    fn check(&self, follows_tolerance: bool) -> Result<(), MethodError> {
        let _ = follows_tolerance;
        Ok(())
    }

    /// Refuses a flow of which the method has no steps.
    ///
    /// # Errors
    ///
    /// The method's own error.
    fn serves(&self, flow: &F) -> Result<(), MethodError> {
        let _ = flow;
        Ok(())
    }

    /// Takes a step of size `h`, in parts if needed. It is negative in a run [back in time](crate::Watch::backward).
    ///
    /// A run calls it in the [room](Flow::room) of the flow ([`in_room`](super::in_room)); so does a caller that steps a large system by itself.
    ///
    /// # Errors
    ///
    /// [`StepError`] if it cannot be taken.
    fn step(
        &self,
        start: &StepStart<'_, F>,
        h: f64,
        memory: &mut Self::Memory,
    ) -> Result<Taken<F>, StepError>;

    /// Tries a step of size `h` once. The caller may try a smaller one.
    ///
    /// # Errors
    ///
    /// The refusal of the step.
    fn attempt(
        &self,
        start: &StepStart<'_, F>,
        h: f64,
        memory: &mut Self::Memory,
    ) -> Result<Taken<F>, Refusal> {
        self.step(start, h, memory).map_err(|error| Refusal {
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
        step: &StepEnds<'_, F>,
        memory: &Self::Memory,
        norm: impl Fn(&F::Vector) -> f64,
    ) -> Option<f64> {
        let _ = memory;
        Some(norm(&step.flow.local_error(step.x, step.end, step.h)?))
    }

    /// The sites at which a step has the largest error, in units of the one allowed, and at which the motion is
    /// stiffest. A run asks for them on a few steps, and only for vectors with [`sites`](super::Vector::sites).
    ///
    /// The default has the site of the error that the [`Flow`] estimates.
    fn limiting_sites(
        &self,
        step: &StepEnds<'_, F>,
        memory: &Self::Memory,
        allowed: &F::Vector,
    ) -> LimitingSites {
        let _ = memory;
        let error = step.flow.local_error(step.x, step.end, step.h);
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
        step: &StepEnds<'_, F>,
        memory: &mut Self::Memory,
        theta: f64,
    ) -> Option<Element<F>> {
        let _ = memory;
        dense::between(step, self.promises(step.flow), theta)
    }
}
