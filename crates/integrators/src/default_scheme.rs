//! Retractions as methods: each stands for its scheme with the default options.

use metriplectic_manifolds::{Cayley, ChartMidpoint, Exponential, Projection, WeylMidpoint};

use crate::midpoint::Scheme;
use crate::step::{
    Compiled, Control, Element, Flow, LimitingSites, MethodError, NoiseSummary, Promises, Refusal,
    StepEnds, StepError, StepStart, Stepper, Taken,
};

/// The steps of `Scheme::new(R)`, under its name.
macro_rules! by_default {
    ($($retraction:ty),+) => {$(
        impl<F: Flow> Stepper<F> for $retraction
        where
            Scheme<Self>: Stepper<F>,
        {
            type Memory = <Scheme<Self> as Stepper<F>>::Memory;

            const HAS_DEFAULT_BETWEEN: bool = <Scheme<Self> as Stepper<F>>::HAS_DEFAULT_BETWEEN;

            const IS_IMPLICIT: bool = <Scheme<Self> as Stepper<F>>::IS_IMPLICIT;

            fn compiled(&self) -> Option<Compiled> {
                Scheme::new(*self).compiled()
            }

            fn name(&self) -> String {
                Scheme::new(*self).name()
            }

            fn order(&self) -> u32 {
                Scheme::new(*self).order()
            }

            fn promises(&self, flow: &F) -> Promises {
                Scheme::new(*self).promises(flow)
            }

            fn damps(&self) -> bool {
                Scheme::new(*self).damps()
            }

            fn noise(&self, flow: &F) -> Option<NoiseSummary> {
                Scheme::new(*self).noise(flow)
            }

            fn nothing_between(&self, time: f64, h: f64) -> StepError {
                Scheme::new(*self).nothing_between(time, h)
            }

            fn check(&self, follows_tolerance: bool) -> Result<(), MethodError> {
                Scheme::new(*self).check(follows_tolerance)
            }

            fn step(
                &self,
                start: &StepStart<'_, F>,
                h: f64,
                memory: &mut Self::Memory,
            ) -> Result<Taken<F>, StepError> {
                Scheme::new(*self).step(start, h, memory)
            }

            fn attempt(
                &self,
                start: &StepStart<'_, F>,
                h: f64,
                memory: &mut Self::Memory,
            ) -> Result<Taken<F>, Refusal> {
                Scheme::new(*self).attempt(start, h, memory)
            }

            fn control(&self) -> Control {
                Scheme::new(*self).control()
            }

            fn error(
                &self,
                step: &StepEnds<'_, F>,
                memory: &Self::Memory,
                norm: impl Fn(&F::Vector) -> f64,
            ) -> Option<f64> {
                Scheme::new(*self).error(step, memory, norm)
            }

            fn limiting_sites(
                &self,
                step: &StepEnds<'_, F>,
                memory: &Self::Memory,
                allowed: &F::Vector,
            ) -> LimitingSites {
                Scheme::new(*self).limiting_sites(step, memory, allowed)
            }

            fn between(
                &self,
                step: &StepEnds<'_, F>,
                memory: &mut Self::Memory,
                theta: f64,
            ) -> Option<Element<F>> {
                Scheme::new(*self).between(step, memory, theta)
            }
        }
    )+};
}
by_default!(WeylMidpoint, ChartMidpoint, Exponential, Projection, Cayley);
