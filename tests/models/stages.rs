//! The methods with stages as one type, so that a test compiles its runs once.
#![allow(dead_code, reason = "each test file uses some of the methods")]

use metriplectic::fields::Space;
use metriplectic::integrators::{
    Control, Flow, Promises, Refusal, StageMemory, StepEnds, StepStart, Taken,
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

macro_rules! each {
    ($self:expr, $method:ident => $call:expr) => {
        match $self {
            Gauss1 => {
                let $method = Gauss::<1>;
                $call
            }
            Gauss2 => {
                let $method = Gauss::<2>;
                $call
            }
            Gauss3 => {
                let $method = Gauss::<3>;
                $call
            }
            Gauss4 => {
                let $method = Gauss::<4>;
                $call
            }
            Radau2 => {
                let $method = Radau::<2>;
                $call
            }
            Radau3 => {
                let $method = Radau::<3>;
                $call
            }
            Radau4 => {
                let $method = Radau::<4>;
                $call
            }
        }
    };
}

type MemoryOf<Y> = StageMemory<<<Y as Metriplectic>::Manifold as Space>::Dim>;

impl<Y: Metriplectic> Stepper<Y> for Stages {
    type Memory = MemoryOf<Y>;

    fn order(&self) -> u32 {
        each!(self, method => Stepper::<Y>::order(&method))
    }

    fn control(&self) -> Control {
        each!(self, method => Stepper::<Y>::control(&method))
    }

    fn promises(&self, system: &Y) -> Promises {
        each!(self, method => method.promises(system))
    }

    fn step(
        &self,
        system: &Y,
        start: &StepStart<'_, Y>,
        h: f64,
        memory: &mut MemoryOf<Y>,
    ) -> Result<Taken<Y>, StepError> {
        each!(self, method => method.step(system, start, h, memory))
    }

    fn attempt(
        &self,
        system: &Y,
        start: &StepStart<'_, Y>,
        h: f64,
        memory: &mut MemoryOf<Y>,
    ) -> Result<Taken<Y>, Refusal> {
        each!(self, method => method.attempt(system, start, h, memory))
    }

    fn error(
        &self,
        system: &Y,
        step: &StepEnds<'_, Y>,
        memory: &MemoryOf<Y>,
        norm: impl Fn(&<Y as Flow>::Vector) -> f64,
    ) -> Option<f64> {
        each!(self, method => method.error(system, step, memory, norm))
    }

    fn between(
        &self,
        system: &Y,
        step: &StepEnds<'_, Y>,
        memory: &mut MemoryOf<Y>,
        theta: f64,
    ) -> Option<<Y::Manifold as Space>::Point<f64>> {
        each!(self, method => method.between(system, step, memory, theta))
    }
}
