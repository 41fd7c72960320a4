//! Every method as one type, so that a test compiles its runs once.
#![allow(dead_code, reason = "each test file uses some of the methods")]

use std::fmt;

use metriplectic::fields::Space;
use metriplectic::integrators::explicit::ExplicitMemory;
use metriplectic::integrators::{
    Control, Element, Flow, LimitingSites, Memory, MethodError, MidpointMemory, Promises, Refusal,
    RestoreError, Saved, StageFlow, StageMemory, StepEnds, StepStart, Taken,
};
use metriplectic::prelude::*;

use crate::stages::{GAUSS, RADAU, Stages, forward_steps};

/// Kutta's method of order 3 (1901), which has neither an error nor a dense output of its own.
const KUTTA: ExplicitRungeKutta = ExplicitRungeKutta::new(&THREE);
const THREE: Tableau = Tableau::new(
    "Kutta3",
    3,
    &[&[(0, 0.5)], &[(0, -1.0), (1, 2.0)]],
    &[(0, 1.0 / 6.0), (1, 2.0 / 3.0), (2, 1.0 / 6.0)],
);

/// A method that takes every flow with stages: systems and lattices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Explicit {
    Kutta3,
    Order5,
    Order8,
    Chebyshev,
}

impl Explicit {
    /// All of them.
    pub(crate) const ALL: [Self; 4] = [Self::Kutta3, Self::Order5, Self::Order8, Self::Chebyshev];
}

/// A method that takes every system; the scheme with one of its retractions.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Any<R = WeylMidpoint> {
    Scheme(R),
    Implicit(Stages),
    Explicit(Explicit),
}

impl<R> Any<R> {
    /// All of them.
    pub(crate) fn all(retraction: R) -> Vec<Self> {
        let implicit = GAUSS.into_iter().chain(RADAU).map(Self::Implicit);
        let explicit = Explicit::ALL.map(Self::Explicit);
        [Self::Scheme(retraction)].into_iter().chain(implicit).chain(explicit).collect()
    }
}

// By hand, because a retraction need not have `Debug`.
impl<R> fmt::Debug for Any<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scheme(_) => f.write_str("Scheme"),
            Self::Implicit(method) => method.fmt(f),
            Self::Explicit(method) => method.fmt(f),
        }
    }
}

impl Explicit {
    /// The method of its coefficients, which has the bits of the method of its name: one type, so that its steps are compiled once.
    const fn method(self) -> ExplicitRungeKutta {
        match self {
            Self::Kutta3 => KUTTA,
            Self::Order5 => ExplicitRungeKutta::new(DormandPrince5::TABLEAU),
            Self::Order8 => ExplicitRungeKutta::new(DormandPrince8::TABLEAU),
            Self::Chebyshev => ExplicitRungeKutta::new(RungeKuttaChebyshev::TABLEAU),
        }
    }
}

macro_rules! each_explicit {
    ($self:expr, $memory_of:expr, |$method:ident, $memory:ident| $call:expr) => {{
        let ($method, $memory) = (&$self.method(), $memory_of);
        $call
    }};
}

impl<F: StageFlow> Stepper<F> for Explicit {
    type Memory = ExplicitMemory<F::Vector>;

    forward_steps!(F, each_explicit);
}

/// The memory of the family that has taken a step.
#[derive(Clone, Debug, Default)]
pub(crate) enum OneOf<M, I, E> {
    #[default]
    New,
    Scheme(M),
    Implicit(I),
    Explicit(E),
}

/// Gives the memory of a family, which is new at the start of a run.
macro_rules! memory_of {
    ($name:ident, $family:ident, $t:ident) => {
        fn $name(&mut self) -> &mut $t {
            if !matches!(self, Self::$family(_)) {
                *self = Self::$family($t::default());
            }
            match self {
                Self::$family(memory) => memory,
                _ => unreachable!("it is of this family"),
            }
        }
    };
}

impl<M: Memory, I: Memory, E: Memory> OneOf<M, I, E> {
    memory_of!(scheme, Scheme, M);
    memory_of!(implicit, Implicit, I);
    memory_of!(explicit, Explicit, E);
}

/// The name of the family in a checkpoint.
const FAMILY: &str = "family";

impl<M: Memory, I: Memory, E: Memory> Memory for OneOf<M, I, E> {
    fn rescaled(&self, ratio: f64) -> Self {
        match self {
            Self::New => Self::New,
            Self::Scheme(memory) => Self::Scheme(memory.rescaled(ratio)),
            Self::Implicit(memory) => Self::Implicit(memory.rescaled(ratio)),
            Self::Explicit(memory) => Self::Explicit(memory.rescaled(ratio)),
        }
    }

    fn refused(&mut self, tried: Self) {
        match tried {
            Self::New => {}
            Self::Scheme(tried) => self.scheme().refused(tried),
            Self::Implicit(tried) => self.implicit().refused(tried),
            Self::Explicit(tried) => self.explicit().refused(tried),
        }
    }

    fn stage_count(&self) -> Option<u32> {
        match self {
            Self::New => None,
            Self::Scheme(memory) => memory.stage_count(),
            Self::Implicit(memory) => memory.stage_count(),
            Self::Explicit(memory) => memory.stage_count(),
        }
    }

    fn stage_velocities(&self) -> Vec<f64> {
        match self {
            Self::New => Vec::new(),
            Self::Scheme(memory) => memory.stage_velocities(),
            Self::Implicit(memory) => memory.stage_velocities(),
            Self::Explicit(memory) => memory.stage_velocities(),
        }
    }

    fn save(&self, saved: &mut Saved) {
        match self {
            Self::New => {}
            Self::Scheme(memory) => {
                saved.put(FAMILY, [1.0]);
                memory.save(saved);
            }
            Self::Implicit(memory) => {
                saved.put(FAMILY, [2.0]);
                memory.save(saved);
            }
            Self::Explicit(memory) => {
                saved.put(FAMILY, [3.0]);
                memory.save(saved);
            }
        }
    }

    fn restore(saved: &Saved) -> Result<Self, RestoreError> {
        let family = saved.get(FAMILY, 1)?.map_or(0.0, |family| family[0]);
        Ok(if family > 2.5 {
            Self::Explicit(E::restore(saved)?)
        } else if family > 1.5 {
            Self::Implicit(I::restore(saved)?)
        } else if family > 0.5 {
            Self::Scheme(M::restore(saved)?)
        } else {
            Self::New
        })
    }
}

macro_rules! each {
    ($self:expr, $both:expr, |$method:ident, $memory:ident| $call:expr) => {
        match $self {
            Any::Scheme(retraction) => {
                let ($method, $memory) = (&Scheme::new(*retraction), $both.scheme());
                $call
            }
            Any::Implicit($method) => {
                let $memory = $both.implicit();
                $call
            }
            Any::Explicit($method) => {
                let $memory = $both.explicit();
                $call
            }
        }
    };
}

type Dim<Y> = <<Y as Metriplectic>::Manifold as Space>::Dim;

impl<Y: Metriplectic, R: Retraction<Y::Manifold, Y::Metric> + Copy> Stepper<Y> for Any<R> {
    type Memory =
        OneOf<MidpointMemory<Dim<Y>>, StageMemory<Dim<Y>>, <DormandPrince8 as Stepper<Y>>::Memory>;

    forward_steps!(Y, each);
}

/// The schemes with one stage, as one type.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum OneStage {
    Weyl,
    Chart,
    Exponential,
    MeanValue,
    ItohAbe,
}

impl OneStage {
    /// All of them.
    pub(crate) const ALL: [Self; 5] =
        [Self::Weyl, Self::Chart, Self::Exponential, Self::MeanValue, Self::ItohAbe];
}

macro_rules! each_scheme {
    ($self:expr, $both:expr, |$method:ident, $memory:ident| $call:expr) => {
        match ($self, $both) {
            (OneStage::Weyl, $memory) => {
                let $method = &Scheme::new(WeylMidpoint);
                $call
            }
            (OneStage::Chart, $memory) => {
                let $method = &Scheme::new(ChartMidpoint);
                $call
            }
            (OneStage::Exponential, $memory) => {
                let $method = &Scheme::new(Exponential);
                $call
            }
            (OneStage::MeanValue, $memory) => {
                let $method = &Scheme::new(WeylMidpoint).gradient(MeanValue);
                $call
            }
            (OneStage::ItohAbe, $memory) => {
                let $method = &Scheme::new(WeylMidpoint).gradient(ItohAbe);
                $call
            }
        }
    };
}

// Systems and open systems.
impl<F, M> Stepper<F> for OneStage
where
    F: Flow,
    M: Memory,
    Scheme<WeylMidpoint>: Stepper<F, Memory = M>,
    Scheme<ChartMidpoint>: Stepper<F, Memory = M>,
    Scheme<Exponential>: Stepper<F, Memory = M>,
    Scheme<WeylMidpoint, MeanValue>: Stepper<F, Memory = M>,
    Scheme<WeylMidpoint, ItohAbe>: Stepper<F, Memory = M>,
{
    type Memory = M;

    forward_steps!(F, each_scheme);
}

/// Every method of a space without a metric of its own, for systems and open systems alike.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Every {
    OneStage(OneStage),
    Implicit(Stages),
    Explicit(Explicit),
}

impl Every {
    /// All of them.
    pub(crate) fn all() -> Vec<Self> {
        let schemes = OneStage::ALL.map(Self::OneStage).into_iter();
        let implicit = GAUSS.into_iter().chain(RADAU).map(Self::Implicit);
        schemes.chain(implicit).chain(Explicit::ALL.map(Self::Explicit)).collect()
    }
}

impl fmt::Debug for Every {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OneStage(method) => method.fmt(f),
            Self::Implicit(method) => method.fmt(f),
            Self::Explicit(method) => method.fmt(f),
        }
    }
}

macro_rules! each_of_every {
    ($self:expr, $both:expr, |$method:ident, $memory:ident| $call:expr) => {
        match $self {
            Every::OneStage($method) => {
                let $memory = $both.scheme();
                $call
            }
            Every::Implicit($method) => {
                let $memory = $both.implicit();
                $call
            }
            Every::Explicit($method) => {
                let $memory = $both.explicit();
                $call
            }
        }
    };
}

impl<F, M, I> Stepper<F> for Every
where
    F: StageFlow,
    M: Memory,
    I: Memory,
    OneStage: Stepper<F, Memory = M>,
    Stages: Stepper<F, Memory = I>,
{
    type Memory = OneOf<M, I, ExplicitMemory<F::Vector>>;

    forward_steps!(F, each_of_every);
}
