//! Methods with stages for typed systems.

use metriplectic_dynamics::{Metriplectic, SecondLaw, system::Point};

use super::StageMemory;
use super::many::{self, OfFewOrMany};
use crate::collocation::{Gauss, Radau, control, dense, parts, step};
use crate::step::failure::Fallbacks;
use crate::step::{
    Compiled, Control, Dim, Flow, Promises, Refusal, StepEnds, StepError, StepStart, Stepper, Taken,
};

macro_rules! of_stages {
    ($($name:ident),*) => {$(
        impl<Y: Metriplectic, const S: usize> Stepper<Y> for $name<S> {
            type Memory = StageMemory<Dim<Y>>;

            const IS_IMPLICIT: bool = true;

            fn compiled(&self) -> Option<Compiled> {
                let () = Self::IS_A_METHOD;
                Some(Compiled::$name { stages: S })
            }

            fn name(&self) -> String {
                format!("{}::<{S}>", stringify!($name))
            }

            fn order(&self) -> u32 {
                Self::tableau().order
            }

            fn control(&self) -> Control {
                control(Self::tableau())
            }

            fn damps(&self) -> bool {
                Self::tableau().one_sided
            }

            fn promises(&self, system: &Y) -> Promises {
                Promises::all_laws(system.second_law() == SecondLaw::Exact)
            }

            fn step(
                &self,
                start: &StepStart<'_, Y>,
                h: f64,
                memory: &mut StageMemory<Dim<Y>>,
            ) -> Result<Taken<Y>, StepError> {
                // A constant, so that only one of the two is compiled.
                if const { many::is_of_many::<Y>() } {
                    return many::step(&Self::in_numbers(), start, h, memory.many());
                }
                let start = step::start_of(Self::tableau(), start, h);
                parts::take(Self::tableau(), Self::SPLITS, &start, memory.few())
            }

            fn attempt(
                &self,
                start: &StepStart<'_, Y>,
                h: f64,
                memory: &mut StageMemory<Dim<Y>>,
            ) -> Result<Taken<Y>, Refusal> {
                if const { many::is_of_many::<Y>() } {
                    return many::attempt(&Self::in_numbers(), start, h, memory.many());
                }
                let start = step::start_of(Self::tableau(), start, h);
                let (tableau, memory) = (Self::tableau(), memory.few());
                let tried = step::try_step(tableau, &start, memory, Fallbacks::FirstTries);
                tried.map_err(|failure| Refusal {
                    effort: failure.effort,
                    error: failure.cause.first_law(start.time, h),
                    second_law: false,
                })
            }

            fn error(
                &self,
                step: &StepEnds<'_, Y>,
                memory: &StageMemory<Dim<Y>>,
                norm: impl Fn(&<Y as Flow>::Vector) -> f64,
            ) -> Option<f64> {
                match memory {
                    OfFewOrMany::Few(memory) => dense::error(Self::tableau(), step, memory, norm),
                    OfFewOrMany::Many(memory) => {
                        many::error(&Self::in_numbers(), step, memory, norm)
                    }
                }
            }

            fn between(
                &self,
                step: &StepEnds<'_, Y>,
                memory: &mut StageMemory<Dim<Y>>,
                theta: f64,
            ) -> Option<Point<Y>> {
                if const { many::is_of_many::<Y>() } {
                    return many::between(&Self::in_numbers(), step, memory.many(), theta);
                }
                let promises = Stepper::<Y>::promises(self, step.flow);
                let within = dense::Within { tableau: Self::tableau(), step, theta };
                dense::between(&within, promises, memory.few())
            }
        }
    )*};
}
of_stages!(Gauss, Radau);
