//! The methods with stages as one type, so that a test compiles its runs once.
#![allow(dead_code, reason = "each test file uses some of the methods")]

use metriplectic::integrators::{
    Control, Element, Flow, LimitingSites, Memory, MethodError, Promises, Refusal, StepEnds,
    StepStart, Taken,
};
use metriplectic::prelude::*;

/// A method with stages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Stages {
    Gauss1,
    Gauss2,
    Gauss3,
    Gauss4,
    Radau2,
    Radau3,
    Radau4,
}

pub(crate) use Stages::*;

pub(crate) const GAUSS: [Stages; 4] = [Gauss1, Gauss2, Gauss3, Gauss4];
pub(crate) const RADAU: [Stages; 3] = [Radau2, Radau3, Radau4];

/// The methods of a [`Stepper`] that is one of many, by a macro that calls the one that it is with its memory.
macro_rules! forward_steps {
    ($flow:ident, $each:ident) => {
        fn name(&self) -> String {
            $each!(self, &mut Self::Memory::default(), |method, _memory| {
                Stepper::<$flow>::name(method)
            })
        }

        fn order(&self) -> u32 {
            $each!(self, &mut Self::Memory::default(), |method, _memory| {
                Stepper::<$flow>::order(method)
            })
        }

        fn damps(&self) -> bool {
            $each!(self, &mut Self::Memory::default(), |method, _memory| {
                Stepper::<$flow>::damps(method)
            })
        }

        fn control(&self) -> Control {
            $each!(self, &mut Self::Memory::default(), |method, _memory| {
                Stepper::<$flow>::control(method)
            })
        }

        fn check(&self, follows_tolerance: bool) -> Result<(), MethodError> {
            $each!(self, &mut Self::Memory::default(), |method, _memory| {
                Stepper::<$flow>::check(method, follows_tolerance)
            })
        }

        fn promises(&self, flow: &$flow) -> Promises {
            $each!(self, &mut Self::Memory::default(), |method, _memory| method.promises(flow))
        }

        fn step(
            &self,
            start: &StepStart<'_, $flow>,
            h: f64,
            memory: &mut Self::Memory,
        ) -> Result<Taken<$flow>, StepError> {
            $each!(self, memory, |method, memory| method.step(start, h, memory))
        }

        fn attempt(
            &self,
            start: &StepStart<'_, $flow>,
            h: f64,
            memory: &mut Self::Memory,
        ) -> Result<Taken<$flow>, Refusal> {
            $each!(self, memory, |method, memory| method.attempt(start, h, memory))
        }

        fn error(
            &self,
            step: &StepEnds<'_, $flow>,
            memory: &Self::Memory,
            norm: impl Fn(&<$flow as Flow>::Vector) -> f64,
        ) -> Option<f64> {
            let mut memory = memory.clone();
            $each!(self, &mut memory, |method, memory| method.error(step, memory, norm))
        }

        fn limiting_sites(
            &self,
            step: &StepEnds<'_, $flow>,
            memory: &Self::Memory,
            allowed: &<$flow as Flow>::Vector,
        ) -> LimitingSites {
            let mut memory = memory.clone();
            $each!(self, &mut memory, |method, memory| {
                method.limiting_sites(step, memory, allowed)
            })
        }

        fn between(
            &self,
            step: &StepEnds<'_, $flow>,
            memory: &mut Self::Memory,
            theta: f64,
        ) -> Option<Element<$flow>> {
            $each!(self, memory, |method, memory| method.between(step, memory, theta))
        }
    };
}
#[allow(unused_imports, reason = "the methods of all families use it, in some tests")]
pub(crate) use forward_steps;

macro_rules! each {
    ($self:expr, $both:expr, |$method:ident, $memory:ident| $call:expr) => {
        match ($self, $both) {
            (Gauss1, $memory) => {
                let $method = &Gauss::<1>;
                $call
            }
            (Gauss2, $memory) => {
                let $method = &Gauss::<2>;
                $call
            }
            (Gauss3, $memory) => {
                let $method = &Gauss::<3>;
                $call
            }
            (Gauss4, $memory) => {
                let $method = &Gauss::<4>;
                $call
            }
            (Radau2, $memory) => {
                let $method = &Radau::<2>;
                $call
            }
            (Radau3, $memory) => {
                let $method = &Radau::<3>;
                $call
            }
            (Radau4, $memory) => {
                let $method = &Radau::<4>;
                $call
            }
        }
    };
}

// Systems and open systems.
impl<F, M> Stepper<F> for Stages
where
    F: Flow,
    M: Memory,
    Gauss<1>: Stepper<F, Memory = M>,
    Gauss<2>: Stepper<F, Memory = M>,
    Gauss<3>: Stepper<F, Memory = M>,
    Gauss<4>: Stepper<F, Memory = M>,
    Radau<2>: Stepper<F, Memory = M>,
    Radau<3>: Stepper<F, Memory = M>,
    Radau<4>: Stepper<F, Memory = M>,
{
    type Memory = M;

    forward_steps!(F, each);
}
