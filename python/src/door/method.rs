//! A method that is chosen by its name.

use metriplectic_integrators::{
    Compiled, Control, DormandPrince5, DormandPrince8, Element, Flow, FromEquations, Gauss,
    Gonzalez, ItohAbe, LimitingSites, MeanValue, Memory, MethodError, NoiseSummary, OpenEquations,
    Promises, Radau, Refusal, RestoreError, RungeKuttaChebyshev, Saved, Scheme, StepEnds,
    StepError, StepStart, Stepper, SymmetricItohAbe, Taken,
};
use metriplectic_manifolds::{ChartMidpoint, Exponential, WeylMidpoint};

use super::interrupt::Interruptible;

/// Calls a function of a method with each of the methods.
macro_rules! methods {
    ($then:ident!($($before:tt)*)) => {
        $then! { $($before)*
            WeylGonzalez: Scheme<WeylMidpoint, Gonzalez> = "midpoint", "gonzalez", Scheme::new(WeylMidpoint);
            WeylMeanValue: Scheme<WeylMidpoint, MeanValue> = "midpoint", "mean-value", Scheme::new(WeylMidpoint).gradient(MeanValue);
            WeylItohAbe: Scheme<WeylMidpoint, ItohAbe> = "midpoint", "itoh-abe", Scheme::new(WeylMidpoint).gradient(ItohAbe);
            WeylSymmetric: Scheme<WeylMidpoint, SymmetricItohAbe> = "midpoint", "symmetric-itoh-abe", Scheme::new(WeylMidpoint).gradient(SymmetricItohAbe);
            ExponentialGonzalez: Scheme<Exponential, Gonzalez> = "exponential", "gonzalez", Scheme::new(Exponential);
            ExponentialMeanValue: Scheme<Exponential, MeanValue> = "exponential", "mean-value", Scheme::new(Exponential).gradient(MeanValue);
            ExponentialItohAbe: Scheme<Exponential, ItohAbe> = "exponential", "itoh-abe", Scheme::new(Exponential).gradient(ItohAbe);
            ExponentialSymmetric: Scheme<Exponential, SymmetricItohAbe> = "exponential", "symmetric-itoh-abe", Scheme::new(Exponential).gradient(SymmetricItohAbe);
            ChartGonzalez: Scheme<ChartMidpoint, Gonzalez> = "chart-midpoint", "gonzalez", Scheme::new(ChartMidpoint);
            ChartMeanValue: Scheme<ChartMidpoint, MeanValue> = "chart-midpoint", "mean-value", Scheme::new(ChartMidpoint).gradient(MeanValue);
            ChartItohAbe: Scheme<ChartMidpoint, ItohAbe> = "chart-midpoint", "itoh-abe", Scheme::new(ChartMidpoint).gradient(ItohAbe);
            ChartSymmetric: Scheme<ChartMidpoint, SymmetricItohAbe> = "chart-midpoint", "symmetric-itoh-abe", Scheme::new(ChartMidpoint).gradient(SymmetricItohAbe);
            Gauss1: Gauss<1> = "gauss1", "", Gauss;
            Gauss2: Gauss<2> = "gauss2", "", Gauss;
            Gauss3: Gauss<3> = "gauss3", "", Gauss;
            Gauss4: Gauss<4> = "gauss4", "", Gauss;
            Radau2: Radau<2> = "radau2", "", Radau;
            Radau3: Radau<3> = "radau3", "", Radau;
            Radau4: Radau<4> = "radau4", "", Radau;
            Dp5: DormandPrince5 = "dp5", "", DormandPrince5;
            Dp8: DormandPrince8 = "dp8", "", DormandPrince8;
            Chebyshev: RungeKuttaChebyshev = "chebyshev", "", RungeKuttaChebyshev;
        }
    };
}

macro_rules! define {
    ($($name:ident: $type:ty = $text:literal, $gradient:literal, $value:expr;)*) => {
        /// One of the methods of the library.
        #[derive(Clone, Copy, Debug)]
        pub(crate) enum AnyMethod {
            $(#[doc = stringify!($type)] $name($type),)*
        }

        impl AnyMethod {
            /// Finds a method by its name, and by that of the discrete gradient of a scheme.
            pub(crate) fn named(name: &str, gradient: &str) -> Option<Self> {
                match (name, gradient) {
                    $(($text, $gradient) => Some(Self::$name($value)),)*
                    _ => None,
                }
            }

            /// Lists the names, without those of discrete gradients.
            pub(crate) fn names() -> Vec<&'static str> {
                let mut names = vec![$($text),*];
                names.dedup();
                names
            }

            /// Returns whether a method has a discrete gradient.
            pub(crate) fn has_gradient(name: &str) -> bool {
                [$(($text, $gradient)),*].iter().any(|(of, gradient)| *of == name && !gradient.is_empty())
            }
        }
    };
}
methods!(define!());

/// Makes the methods a method of a flow: each question is asked of the one that was chosen.
macro_rules! stepper {
    ([$flow:ty, $memory:ident] $($name:ident: $type:ty = $text:literal, $gradient:literal, $value:expr;)*) => {
        /// The memory of the method that was chosen.
        #[derive(Clone, Debug, Default)]
        pub(crate) enum $memory {
            /// None yet.
            #[default]
            None,
            $(#[doc = stringify!($type)] $name(<$type as Stepper<$flow>>::Memory),)*
        }

        impl Memory for $memory {
            fn rescaled(&self, ratio: f64) -> Self {
                match self {
                    Self::None => Self::None,
                    $(Self::$name(memory) => Self::$name(memory.rescaled(ratio)),)*
                }
            }

            fn restarted(&self) -> Self {
                match self {
                    Self::None => Self::None,
                    $(Self::$name(memory) => Self::$name(memory.restarted()),)*
                }
            }

            fn beside(&self) -> Self {
                match self {
                    Self::None => Self::None,
                    $(Self::$name(memory) => Self::$name(memory.beside()),)*
                }
            }

            fn clocked(&mut self) {
                match self {
                    Self::None => {}
                    $(Self::$name(memory) => memory.clocked(),)*
                }
            }

            fn take_room(&mut self, from: &mut Self) {
                match (self, from) {
                    $((Self::$name(memory), Self::$name(from)) => memory.take_room(from),)*
                    _ => {}
                }
            }

            fn reuse(&mut self, given_up: Self) {
                match (self, given_up) {
                    $((Self::$name(memory), Self::$name(given_up)) => memory.reuse(given_up),)*
                    _ => {}
                }
            }

            fn refused(&mut self, tried: Self) {
                match (self, tried) {
                    $((Self::$name(memory), Self::$name(tried)) => memory.refused(tried),)*
                    _ => {}
                }
            }

            fn stage_count(&self) -> Option<u32> {
                match self {
                    Self::None => None,
                    $(Self::$name(memory) => memory.stage_count(),)*
                }
            }

            fn stage_velocities(&self) -> Vec<f64> {
                match self {
                    Self::None => Vec::new(),
                    $(Self::$name(memory) => memory.stage_velocities(),)*
                }
            }

            fn save(&self, saved: &mut Saved) {
                match self {
                    Self::None => {}
                    $(Self::$name(memory) => memory.save(saved),)*
                }
            }

            /// A memory does not say whose it is: runs that are taken up again ask the method itself.
            fn restore(_: &Saved) -> Result<Self, RestoreError> {
                Ok(Self::None)
            }
        }

        impl Stepper<$flow> for AnyMethod {
            type Memory = $memory;

            const IS_EXPLICIT: bool = true;

            const IS_IMPLICIT: bool = true;

            fn compiled(&self) -> Option<Compiled> {
                match self {
                    $(Self::$name(method) => Stepper::<$flow>::compiled(method),)*
                }
            }

            fn name(&self) -> String {
                match self {
                    $(Self::$name(method) => Stepper::<$flow>::name(method),)*
                }
            }

            fn memory(&self) -> $memory {
                match self {
                    $(Self::$name(method) => $memory::$name(Stepper::<$flow>::memory(method)),)*
                }
            }

            fn order(&self) -> u32 {
                match self {
                    $(Self::$name(method) => Stepper::<$flow>::order(method),)*
                }
            }

            fn promises(&self, flow: &$flow) -> Promises {
                match self {
                    $(Self::$name(method) => method.promises(flow),)*
                }
            }

            fn damps(&self) -> bool {
                match self {
                    $(Self::$name(method) => Stepper::<$flow>::damps(method),)*
                }
            }

            fn noise(&self, flow: &$flow) -> Option<NoiseSummary> {
                match self {
                    $(Self::$name(method) => method.noise(flow),)*
                }
            }

            fn nothing_between(&self, time: f64, h: f64) -> StepError {
                match self {
                    $(Self::$name(method) => Stepper::<$flow>::nothing_between(method, time, h),)*
                }
            }

            fn check(&self, follows_tolerance: bool) -> Result<(), MethodError> {
                match self {
                    $(Self::$name(method) => Stepper::<$flow>::check(method, follows_tolerance),)*
                }
            }

            fn serves(&self, flow: &$flow) -> Result<(), MethodError> {
                match self {
                    $(Self::$name(method) => method.serves(flow),)*
                }
            }

            fn step(
                &self,
                start: &StepStart<'_, $flow>,
                h: f64,
                memory: &mut $memory,
            ) -> Result<Taken<$flow>, StepError> {
                match self {
                    $(Self::$name(method) => {
                        method.step(start, h, of!($flow, $memory::$name, memory, method))
                    })*
                }
            }

            fn attempt(
                &self,
                start: &StepStart<'_, $flow>,
                h: f64,
                memory: &mut $memory,
            ) -> Result<Taken<$flow>, Refusal> {
                match self {
                    $(Self::$name(method) => {
                        method.attempt(start, h, of!($flow, $memory::$name, memory, method))
                    })*
                }
            }

            fn control(&self) -> Control {
                match self {
                    $(Self::$name(method) => Stepper::<$flow>::control(method),)*
                }
            }

            fn error(
                &self,
                step: &StepEnds<'_, $flow>,
                memory: &$memory,
                norm: impl Fn(&<$flow as Flow>::Vector) -> f64,
            ) -> Option<f64> {
                match (self, memory) {
                    $((Self::$name(method), $memory::$name(memory)) => method.error(step, memory, norm),)*
                    _ => None,
                }
            }

            fn limiting_sites(
                &self,
                step: &StepEnds<'_, $flow>,
                memory: &$memory,
                allowed: &<$flow as Flow>::Vector,
            ) -> LimitingSites {
                match (self, memory) {
                    $((Self::$name(method), $memory::$name(memory)) => {
                        method.limiting_sites(step, memory, allowed)
                    })*
                    _ => LimitingSites::default(),
                }
            }

            fn between(
                &self,
                step: &StepEnds<'_, $flow>,
                memory: &mut $memory,
                theta: f64,
            ) -> Option<Element<$flow>> {
                match self {
                    $(Self::$name(method) => {
                        method.between(step, of!($flow, $memory::$name, memory, method), theta)
                    })*
                }
            }
        }
    };
}

/// The memory of the method that was chosen, made where there is none.
macro_rules! of {
    ($flow:ty, $all:ident::$name:ident, $memory:ident, $method:ident) => {{
        if !matches!($memory, $all::$name(_)) {
            *$memory = Stepper::<$flow>::memory(&AnyMethod::$name(*$method));
        }
        match $memory {
            $all::$name(memory) => memory,
            _ => unreachable!("a method makes a memory of its own"),
        }
    }};
}

methods!(stepper!([FromEquations<Interruptible>, ClosedMemory]));
methods!(stepper!([OpenEquations<Interruptible>, OpenMemory]));
