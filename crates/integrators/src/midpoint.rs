//! The scheme of the paper: one implicit step.
//!
//! The equation of a step is tried in this order, until it is solved:
//!
//! 1. **Newton's method from the guess**: the displacement extrapolated from the steps before, with the
//!    Jacobian that they have left, else that of explicit Euler. It is damped: a correction that
//!    leaves the domain of a field, or does not reduce the residual, is halved up to
//!    [`Newton::halvings`] times. At most [`Newton::iterations`] corrections.
//! 2. **Newton's method from rest**, `u = 0`, where all is defined that is defined at the start. Its first
//!    correction is the linearly implicit step, which stiff friction does not drive off. At most 8
//!    corrections.
//! 3. **Continuation in the step size**: the solution that begins at rest is followed along its tangent
//!    from a step of size 0 to the one that is asked for, by increments that double where Newton's
//!    method ends near the prediction and are quartered where it does not. At most 200 increments, and
//!    none below 10⁻⁴ of the size reached: there the solution has turned back, or has met the edge of the
//!    domain.
//! 4. **The globaliser**, 100 iterations of argmin's L-BFGS on `½|F(u)|²` from the best point of 1 and 2,
//!    then Newton's method from where it ends (with the feature `argmin`). What it finds is a solution,
//!    with both laws, but it may be another one than that of 3.
//! 5. **Halves**: the step is taken as two of half the size, each by 1 and 2 alone, and each that
//!    fails is halved again, [`Scheme::splits`] times at most. Both laws hold for each part.
//! 6. [`StepError`]: `OutOfDomain` if in the smallest part the edge of a domain is in Newton's way,
//!    `DependentInvariants` if it starts where a further invariant depends on the other fields, otherwise
//!    `NotConverged`; the first and the last with all that was tried.
//!
//! Steps of adaptive size are tried by 1 and 2, and then by a smaller step.
//!
//! Of the 242 starts of `tests/hard_corpus.rs` 218 have a solution that continuation in 60 digits finds.
//! All of them end in a certified step.

mod equation;
mod fallbacks;
#[cfg(feature = "argmin")]
mod globaliser;
mod jacobian;
mod memory;
mod predictor;
mod restored;
mod run;

use metriplectic_dynamics::velocity::projected_fractions;
use metriplectic_dynamics::{Invariants, Metriplectic, SecondLaw, system::Point};
use metriplectic_fields::{ChartPoint, Column, Dimension, ScalarField, Space, Vector};
use metriplectic_manifolds::{Manifold, Retraction};

pub(crate) use equation::Jet;
pub use equation::{Dissipated, Residual};
pub use memory::MidpointMemory;
pub use run::Run;

use crate::discrete_gradient::{DiscreteGradient, Gonzalez};
use crate::method::{
    Evidence, Flow as _, Laws, Method, Promises, Refusal, StepStart, Taken, name_of,
};
use crate::newton::{Newton, Root};
use crate::round_off::bound::{BROKEN, breaks_first_law, sizes_on_a_step};
use crate::round_off::compensation::Displaced;
use crate::round_off::drift::{self, DriftCorrection};
use crate::round_off::level;
use crate::step_error::StepError;
use crate::step_failure::{Cause, Fallbacks};
use fallbacks::StepFailure;

/// The dimension of the manifold of a system.
pub(crate) type Dim<Y> = <<Y as Metriplectic>::Manifold as Space>::Dim;

/// A number for each further invariant of a system.
pub type Numbers<Y> = <<<Y as Metriplectic>::Manifold as Space>::Dim as Dimension>::Array<f64>;

/// The memory of a scheme for a system.
pub(crate) type MemoryOf<Y> = MidpointMemory<Dim<Y>>;

/// A scheme: a retraction, and how hard to try to solve its equation.
///
/// ```
/// use metriplectic_integrators::{Newton, Scheme};
/// use metriplectic_manifolds::WeylMidpoint;
/// let scheme = Scheme { splits: 4, ..Scheme::new(WeylMidpoint) };
/// let patient = scheme.newton(Newton { iterations: 60, ..Newton::default() });
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scheme<R, W = Gonzalez> {
    /// Turns a vector into a pair of points.
    pub retraction: R,
    /// Accounts for the change of energy and entropy along a step.
    pub gradient: W,
    /// Solves the equation of a step.
    pub newton: Newton,
    /// How often a step that is not solved is split in halves; both laws hold for each half.
    pub splits: usize,
}

impl<R> Scheme<R> {
    /// The scheme of a retraction, with the discrete gradient of Gonzalez and the default solver.
    pub fn new(retraction: R) -> Self {
        Self { retraction, gradient: Gonzalez, newton: Newton::default(), splits: 10 }
    }
}

impl<R, W> Scheme<R, W> {
    /// Replaces the discrete gradient.
    #[must_use]
    pub fn gradient<V: DiscreteGradient>(self, gradient: V) -> Scheme<R, V> {
        let Self { retraction, newton, splits, .. } = self;
        Scheme { retraction, gradient, newton, splits }
    }

    /// Replaces the options of the solver.
    #[must_use]
    pub fn newton(self, newton: Newton) -> Self {
        Self { newton, ..self }
    }
}

/// Where an implicit step starts.
#[derive(Debug)]
pub(crate) struct Start<'a, Y: Metriplectic> {
    /// The point `x`.
    pub(crate) x: &'a Point<Y>,
    /// The time at which the step starts, for its errors; that of the whole step for a part of it.
    pub(crate) time: f64,
    /// The step size.
    pub(crate) h: f64,
    /// The laws at `x`.
    pub(crate) values: Laws<Numbers<Y>>,
    /// The round-off `H(x) − H(x₀)` that earlier steps have left, and that of the entropy, since
    /// something was dissipated, and of the further invariants.
    pub(crate) accumulated_error: DriftCorrection<Y>,
}

impl<'a, Y: Metriplectic> Start<'a, Y> {
    fn of(&StepStart { x, time, values, reference, .. }: &StepStart<'a, Y>, h: f64) -> Self {
        let accumulated_error = Laws {
            energy: values.energy - reference.energy,
            entropy: values.entropy - reference.entropy,
            invariants: Dim::<Y>::array(|k| values.invariants[k] - reference.invariants[k]),
        };
        Self { x, time, h, values, accumulated_error }
    }
}

impl<Y, R, W> Method<Y> for Scheme<R, W>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    type Memory = MemoryOf<Y>;

    fn name(&self) -> String {
        format!("Scheme<{}, {}>", name_of::<R>(), name_of::<W>())
    }

    fn order(&self) -> u32 {
        2
    }

    fn promises(&self, system: &Y) -> Promises {
        Promises::all_laws(system.second_law() == SecondLaw::Exact)
    }

    fn step(
        &self,
        system: &Y,
        start: &StepStart<'_, Y>,
        h: f64,
        memory: &mut MemoryOf<Y>,
    ) -> Result<Taken<Y>, StepError> {
        self.with_halves(system, &Start::of(start, h), memory)
    }

    fn attempt(
        &self,
        system: &Y,
        start: &StepStart<'_, Y>,
        h: f64,
        memory: &mut MemoryOf<Y>,
    ) -> Result<Taken<Y>, Refusal> {
        let start = Start::of(start, h);
        self.try_step(system, &start, memory, Fallbacks::FirstTries).map_err(|failure| Refusal {
            effort: failure.effort,
            error: failure.cause.first_law(start.time, h),
            second_law: false,
        })
    }
}

impl<R, W: DiscreteGradient> Scheme<R, W> {
    /// Guess, solve, retract; then the last digits.
    fn try_step<Y>(
        &self,
        system: &Y,
        start: &Start<'_, Y>,
        memory: &mut MemoryOf<Y>,
        fallbacks: Fallbacks,
    ) -> Result<Taken<Y>, StepFailure>
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric>,
    {
        let guess = memory.predictor.guess(system, start);
        let target = drift::target(system, start, &guess);
        let equation = Residual::of_start(system, self, start, target);
        let (root, mut effort) =
            fallbacks::solve(&self.newton, &equation, &guess, &mut memory.jacobian, fallbacks)?;
        let evidence = evidence(&root, memory.friction());
        let failed = |cause, effort| StepFailure { residual: root.residual, cause, effort };
        if !has_digits(system, start, &root, evidence.friction) {
            return Err(failed(Cause::Unsolved, effort));
        }
        if evidence.rests {
            // What the solver found is its own round-off, and following it would make a random walk of
            // the energy.
            return Ok(Taken { x: start.x.clone(), values: start.values, evidence, effort });
        }
        let end = self.retraction.end(system.metric(), start.x, &root.u);
        let end = end.map_err(|_| failed(Cause::Edge, effort))?;
        // Where the laws hold at the point with the digits that earlier steps have lost, the step goes there.
        let shifted = memory.compensation.shifted::<Y::Manifold>(&end);
        let held = shifted.and_then(|shifted| level::held(&equation, &shifted));
        let level::Polished { u, end, moved, evaluated } = if held.is_some() {
            level::Polished { u: root.u, end, moved: false, evaluated: held }
        } else {
            level::polish(&equation, &root, end, &mut effort)
        };
        // Outside an open chart the defect is infinite: there is no state to go on from.
        if system.manifold().defect(&end).is_infinite() {
            return Err(failed(Cause::Edge, effort));
        }
        memory.predictor.note::<Y::Manifold>(start.x, &u, &end);
        let compensated = if moved {
            memory.compensation.clear();
            None
        } else {
            let lost =
                |x: &_, d: &_, end: &_| self.retraction.lost_digits(system.metric(), x, d, end);
            let step = Displaced { x: start.x, d: &u, end: &end };
            memory.compensation.add::<Y::Manifold>(lost, &step)
        };
        let evaluated = if compensated.is_some() { held } else { evaluated };
        let x = compensated.unwrap_or(end);
        // The last digits of the end, which no residual has seen, may be beyond the edge.
        let values = match evaluated {
            Some([energy, entropy]) if Y::Invariants::COUNT == 0 => {
                Laws { energy, entropy, ..start.values }
            }
            _ => system.laws(&x),
        };
        let (x, values) = match restored::restored(system, start, &x, &values, equation.is_exact())
        {
            Some(restored) => {
                memory.compensation.clear();
                restored
            }
            None => (x, values),
        };
        let change = values.energy - start.values.energy;
        if !values.entropy.is_finite() {
            return Err(failed(Cause::Edge, effort));
        }
        let sizes = || sizes_on_a_step(system, [start.x, &x]);
        if let Some(size) = breaks_first_law(change, values.energy, sizes) {
            return Err(failed(Cause::Energy { change, size }, effort));
        }
        Ok(Taken { x, values, evidence, effort })
    }
}

/// What a solution tells of the motion.
fn evidence<M: Manifold>(root: &Root<M, Dissipated>, friction: f64) -> Evidence {
    let rests = (0..Vector::<M>::LEN).all(|i| root.u[i].abs() <= 2.0 * root.round_off[i]);
    let Dissipated { slope_squared, dissipates } = root.evidence;
    Evidence {
        entropy_slope: slope_squared.sqrt(),
        dissipates,
        friction,
        rests,
        ..Evidence::default()
    }
}

/// The rate `h|K'|` of friction from which on the round-off of a solution may be large.
const VERY_STIFF: f64 = 1e8;

/// Whether the round-off of a solution is small: if friction is so stiff that the slow motion has no digits
/// beside it, the round-off of the displacement is as large as the displacement, and a state would seem to
/// rest. It is measured by the energy that goes with it, which has one unit for all components.
fn has_digits<Y: Metriplectic>(
    system: &Y,
    start: &Start<'_, Y>,
    Root { u, round_off, .. }: &Root<Y::Manifold, Dissipated>,
    friction: f64,
) -> bool {
    if friction <= VERY_STIFF {
        return true;
    }
    let scales = Y::Manifold::scales(start.x);
    if (0..Dim::<Y>::LEN).all(|i| round_off[i] <= 1e-2 * BROKEN * (scales[i] + u[i].abs())) {
        return true;
    }
    let dh = system.energy().jet1(start.x).df.abs();
    dh.dot(round_off) <= BROKEN * (start.values.energy.abs() + dh.dot(&scales))
}

/// The further invariant that has the least independent fraction at `x`, and this fraction, if it is small
/// enough to be the cause of a failure.
pub(crate) fn dependent_invariant<Y: Metriplectic>(
    system: &Y,
    x: &Point<Y>,
) -> Option<(usize, f64)> {
    let fractions = projected_fractions(system, &ChartPoint::centre(x)).ok()?;
    let least = fractions.into_iter().enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
    least.filter(|(_, fraction)| *fraction < DEPENDENT)
}

/// The independent fraction of a further invariant's differential that explains a failure.
const DEPENDENT: f64 = 1e-3;
