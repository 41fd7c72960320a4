//! The methods with stages and the explicit ones as one type, so that a test compiles its runs once.
#![allow(dead_code, reason = "each test file uses some of the methods")]

use metriplectic::fields::Space;
use metriplectic::integrators::{
    Control, Flow, Memory, Promises, Refusal, RestoreError, Saved, StageMemory, StepEnds,
    StepStart, Taken,
};
use metriplectic::prelude::*;

use crate::stages::{GAUSS, RADAU, Stages};

/// A method that takes every system.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Any {
    Implicit(Stages),
    Explicit5,
    Explicit8,
    Chebyshev,
}

impl Any {
    /// All of them.
    pub(crate) fn all() -> Vec<Self> {
        let implicit = GAUSS.into_iter().chain(RADAU).map(Self::Implicit);
        implicit.chain([Self::Explicit5, Self::Explicit8, Self::Chebyshev]).collect()
    }
}

type OfStages<Y> = StageMemory<<<Y as Metriplectic>::Manifold as Space>::Dim>;
type OfExplicit<Y> = <DormandPrince8 as Stepper<Y>>::Memory;

/// The memories of both families.
#[derive(Clone, Debug, Default)]
pub(crate) struct Both<I, E> {
    implicit: I,
    explicit: E,
}

impl<I: Memory, E: Memory> Memory for Both<I, E> {
    fn rescaled(&self, ratio: f64) -> Self {
        Self { implicit: self.implicit.rescaled(ratio), explicit: self.explicit.rescaled(ratio) }
    }

    fn refused(&mut self, tried: Self) {
        self.implicit.refused(tried.implicit);
        self.explicit.refused(tried.explicit);
    }

    fn save(&self, saved: &mut Saved) {
        self.implicit.save(saved);
        self.explicit.save(saved);
    }

    fn restore(saved: &Saved) -> Result<Self, RestoreError> {
        Ok(Self { implicit: I::restore(saved)?, explicit: E::restore(saved)? })
    }
}

/// A call of the method that it is, with the memory of its family.
macro_rules! each {
    ($self:expr, $both:expr, |$method:ident, $memory:ident| $call:expr) => {
        match $self {
            Any::Implicit($method) => {
                let $memory = implicit($both);
                $call
            }
            Any::Explicit5 => {
                let ($method, $memory) = (&DormandPrince5, explicit($both));
                $call
            }
            Any::Explicit8 => {
                let ($method, $memory) = (&DormandPrince8, explicit($both));
                $call
            }
            Any::Chebyshev => {
                let ($method, $memory) = (&RungeKuttaChebyshev, explicit($both));
                $call
            }
        }
    };
}

const fn implicit<I, E>(both: &mut Both<I, E>) -> &mut I {
    &mut both.implicit
}

const fn explicit<I, E>(both: &mut Both<I, E>) -> &mut E {
    &mut both.explicit
}

impl<Y: Metriplectic> Stepper<Y> for Any {
    type Memory = Both<OfStages<Y>, OfExplicit<Y>>;

    fn order(&self) -> u32 {
        each!(self, &mut Self::Memory::default(), |method, _memory| Stepper::<Y>::order(method))
    }

    fn control(&self) -> Control {
        each!(self, &mut Self::Memory::default(), |method, _memory| Stepper::<Y>::control(method))
    }

    fn promises(&self, system: &Y) -> Promises {
        each!(self, &mut Self::Memory::default(), |method, _memory| method.promises(system))
    }

    fn step(
        &self,
        system: &Y,
        start: &StepStart<'_, Y>,
        h: f64,
        memory: &mut Self::Memory,
    ) -> Result<Taken<Y>, StepError> {
        each!(self, memory, |method, memory| method.step(system, start, h, memory))
    }

    fn attempt(
        &self,
        system: &Y,
        start: &StepStart<'_, Y>,
        h: f64,
        memory: &mut Self::Memory,
    ) -> Result<Taken<Y>, Refusal> {
        each!(self, memory, |method, memory| method.attempt(system, start, h, memory))
    }

    fn error(
        &self,
        system: &Y,
        step: &StepEnds<'_, Y>,
        memory: &Self::Memory,
        norm: impl Fn(&<Y as Flow>::Vector) -> f64,
    ) -> Option<f64> {
        let mut memory = memory.clone();
        each!(self, &mut memory, |method, memory| method.error(system, step, memory, norm))
    }

    fn between(
        &self,
        system: &Y,
        step: &StepEnds<'_, Y>,
        memory: &mut Self::Memory,
        theta: f64,
    ) -> Option<<Y::Manifold as Space>::Point<f64>> {
        each!(self, memory, |method, memory| method.between(system, step, memory, theta))
    }
}
