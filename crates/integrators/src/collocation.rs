//! Methods with stages: Gauss of order `2s`, Radau IIA of order `2s − 1`, with both laws exact.

mod chart;
mod covectors;
mod dense;
mod equation;
mod fallbacks;
mod full;
mod heat;
mod linear;
mod memory;
mod solve;
mod step;
mod tableau;

use metriplectic_dynamics::{Metriplectic, SecondLaw, system::Point};

pub use memory::StageMemory;

use crate::method::{Control, Flow, Method, Promises, Refusal, StepEnds, StepStart, Taken};
use crate::midpoint::Dim;
use crate::step_error::StepError;
use fallbacks::Fallbacks;
use tableau::{GAUSS, RADAU, Tableau};

/// A point of a system.
type PointOf<Y> = Point<Y>;

/// The Gauss method of `S` stages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gauss<const S: usize> {
    /// How often a step that is not solved is split in halves; both laws hold for each half.
    pub splits: usize,
}

/// The Radau IIA method of `S` stages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Radau<const S: usize> {
    /// How often a step that is not solved is split in halves; both laws hold for each half.
    pub splits: usize,
}

/// How often a step is split in halves, unless another number is asked for.
const SPLITS: usize = 10;

macro_rules! method {
    ($name:ident, $tableaux:expr, $first:literal, $last:literal) => {
        impl<const S: usize> Default for $name<S> {
            fn default() -> Self {
                Self { splits: SPLITS }
            }
        }

        impl<const S: usize> $name<S> {
            const IS_A_METHOD: () = assert!(
                S >= $first && S <= $last,
                concat!(stringify!($name), " has ", $first, " to ", $last, " stages")
            );

            fn tableau() -> &'static Tableau {
                let () = Self::IS_A_METHOD;
                &$tableaux[S - $first]
            }
        }

        impl<Y: Metriplectic, const S: usize> Method<Y> for $name<S> {
            type Memory = StageMemory<Dim<Y>>;

            fn order(&self) -> u32 {
                Self::tableau().order
            }

            fn control(&self) -> Control {
                control(Self::tableau())
            }

            fn promises(&self, system: &Y) -> Promises {
                Promises::all_laws(system.second_law() == SecondLaw::Exact)
            }

            fn step(
                &self,
                system: &Y,
                start: &StepStart<'_, Y>,
                h: f64,
                memory: &mut StageMemory<Dim<Y>>,
            ) -> Result<Taken<Y>, StepError> {
                let start = step::start_of(Self::tableau(), start, h);
                fallbacks::with_halves(Self::tableau(), self.splits, system, &start, memory)
            }

            fn attempt(
                &self,
                system: &Y,
                start: &StepStart<'_, Y>,
                h: f64,
                memory: &mut StageMemory<Dim<Y>>,
            ) -> Result<Taken<Y>, Refusal> {
                let start = step::start_of(Self::tableau(), start, h);
                step::try_step(Self::tableau(), system, &start, memory, Fallbacks::Direct).map_err(
                    |failure| Refusal {
                        effort: failure.effort,
                        error: failure.first_law(start.time, h),
                        second_law: false,
                    },
                )
            }

            fn error(
                &self,
                system: &Y,
                step: &StepEnds<'_, Y>,
                memory: &StageMemory<Dim<Y>>,
                norm: impl Fn(&<Y as Flow>::Vector) -> f64,
            ) -> Option<f64> {
                dense::error(Self::tableau(), system, step, memory, norm)
            }

            fn between(
                &self,
                system: &Y,
                step: &StepEnds<'_, Y>,
                memory: &mut StageMemory<Dim<Y>>,
                theta: f64,
            ) -> Option<PointOf<Y>> {
                let promises = Method::<Y>::promises(self, system);
                dense::between(Self::tableau(), system, step, promises, memory, theta)
            }
        }
    };
}

method!(Gauss, GAUSS, 1, 4);
method!(Radau, RADAU, 2, 4);

/// The defect of the polynomial of a step is `O(h^{s+1})`, and its end is of order `p`: held to `τ^{(s+1)/p}`, the
/// error of a run is proportional to the tolerance `τ`.
fn control(tableau: &Tableau) -> Control {
    let local = tableau.stages as f64 + 1.0;
    Control {
        power: local / f64::from(tableau.order),
        alpha: 0.7 / local,
        beta: 0.4 / local,
        rejected: 1.0 / local,
        ratios: [0.2, 3.0],
    }
}
