//! What a run knows of a system and of a method.
//!
//! A run needs little of a system: its laws, and how large things are. This is a [`Flow`]; every
//! [`Metriplectic`](metriplectic_dynamics::Metriplectic) system is one. It knows of a method that it takes
//! steps, what these promise, and what has to be saved between two of them: a [`Method`]. Everything that a
//! user does with a run, from [`Span`](crate::Span) to [`Checkpoint`], works with any flow
//! and any method.

mod evidence;
mod metriplectic;
mod reach;
mod vector;

use std::fmt::Debug;
use std::ops::IndexMut;

use metriplectic_dynamics::invariants::Kind;
use metriplectic_dynamics::{ModelError, SecondLaw};
use metriplectic_manifolds::{Manifold, PointError};

pub use evidence::{Effort, EntropyStep, Evidence, LimitingSites, Promises, StageLaws};
pub use vector::{Components, Vector};

use crate::error::{FlowError, RunError};
use crate::run::checkpoint::{Checkpoint, ResumeError, Saved};
use crate::run::scales::Scales;
use crate::run::span::Schedule;
use crate::run::steps::Steps;
use crate::run::trajectory::Trajectory;
use crate::step_error::StepError;

/// Where the states of a run live. Every [`Manifold`] is a state space.
pub trait StateSpace: Clone + Debug + PartialEq + Send + Sync + 'static {
    /// A state.
    type Element: Clone + Debug + PartialEq + Send + Sync;

    /// The entries of a state in their order.
    fn numbers(x: &Self::Element) -> Vec<f64>;
}

impl<M: Manifold> StateSpace for M {
    type Element = M::Point<f64>;

    fn numbers(x: &M::Point<f64>) -> Vec<f64> {
        M::entries(x)
    }
}

/// A state of a flow.
pub type Element<F> = <<F as Flow>::Space as StateSpace>::Element;

/// One number for the energy, one for the entropy, and one for each further invariant: their values, the
/// sizes of their terms, or their errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Laws<L> {
    /// Of the energy `H`.
    pub energy: f64,
    /// Of the entropy `S`; 0 without one.
    pub entropy: f64,
    /// Of each further invariant, in their order.
    pub invariants: L,
}

/// What a run needs of a system: its laws, its sizes, and its equation of motion.
///
/// Implement it for a system that is no [`Metriplectic`](metriplectic_dynamics::Metriplectic) one, such as one
/// of a size that is known only at run time. The methods with a body serve adaptive steps, further invariants
/// and checks of the model.
pub trait Flow {
    /// Where its states live.
    type Space: StateSpace;
    /// A number for each further invariant: an array, or `Vec<f64>`.
    type Numbers: AsRef<[f64]> + IndexMut<usize, Output = f64> + Clone + Debug;
    /// A number for each direction: `Vec<f64>`, or an array of a fixed length.
    type Vector: Vector;

    /// The laws at a state.
    fn laws(&self, x: &Element<Self>) -> Laws<Self::Numbers>;

    /// The sizes `|F| + Σ_i |∂_iF x_i|` of the terms of the laws at a state; their round-off is relative to
    /// these.
    fn term_sizes(&self, x: &Element<Self>) -> Laws<Self::Numbers>;

    /// The velocity at the displacement `d` from a state; `None` where it has no value.
    fn rates(&self, x: &Element<Self>, d: &Self::Vector) -> Option<Self::Vector>;

    /// The size of a state in each direction, in the units of the entries.
    fn sizes(&self, x: &Element<Self>) -> Self::Vector;

    /// The end of the displacement `d` from a state.
    fn moved(&self, x: &Element<Self>, d: &Self::Vector) -> Element<Self>;

    /// The displacement from a state to another one, the inverse of [`moved`](Self::moved); `None` beyond the
    /// edge of its chart, or if the flow does not say. States inside a step need it.
    fn displacement(&self, x: &Element<Self>, y: &Element<Self>) -> Option<Self::Vector> {
        let _ = (x, y);
        None
    }

    /// The entropy `⟨dS, K dS⟩` that is produced at a state per unit of time; `None` where it has no value.
    fn production(&self, x: &Element<Self>) -> Option<f64> {
        let _ = x;
        Some(0.0)
    }

    /// Moves a state that is near the given values of its laws onto them: those of the energy and of the
    /// further invariants, and that of the entropy if there is one in `entropy`. `None` if it is too far from
    /// them. A flow that does not say leaves the state as it is.
    fn onto(
        &self,
        y: &Element<Self>,
        laws: &Laws<Self::Numbers>,
        entropy: Option<f64>,
    ) -> Option<Element<Self>> {
        let _ = (laws, entropy);
        Some(y.clone())
    }

    /// Calls `f` with the room on the stack that a step of this flow needs. A flow whose steps need little calls it
    /// as it is.
    fn with_room<T>(&self, f: impl FnOnce() -> T) -> T {
        f()
    }

    /// The state with these entries.
    ///
    /// # Errors
    ///
    /// [`PointError`] if they are no state.
    fn element(&self, entries: &[f64]) -> Result<Element<Self>, PointError>;

    /// What the model says of its entropy.
    fn entropy_law(&self) -> SecondLaw {
        SecondLaw::NoEntropy
    }

    /// Why each further invariant is conserved.
    fn kinds(&self) -> Vec<Kind> {
        Vec::new()
    }

    /// Whether the dissipation is projected, and is not quite the tensor that was written down.
    fn is_projected(&self) -> bool {
        false
    }

    /// Verifies the model at the start of a run.
    ///
    /// # Errors
    ///
    /// The first law of the model that is broken.
    fn check(&self, x0: &Element<Self>) -> Result<(), ModelError> {
        let _ = x0;
        Ok(())
    }

    /// Verifies what only the flow knows of at the start of a run: its sites, its data.
    ///
    /// # Errors
    ///
    /// The flow's own error.
    fn examine(&self, x0: &Element<Self>) -> Result<(), FlowError> {
        let _ = x0;
        Ok(())
    }

    /// The part of a system at which a displacement from a state leads out of the domain, if the system has parts
    /// that are numbered, such as sites.
    fn site_outside(&self, x: &Element<Self>, d: &Self::Vector) -> Option<usize> {
        let _ = (x, d);
        None
    }

    /// The distance of a state from its space.
    fn defect(&self, x: &Element<Self>) -> f64 {
        let _ = x;
        0.0
    }

    /// The sizes of the terms of the energy on a step, at its two ends.
    fn energy_sizes(&self, ends: [&Element<Self>; 2]) -> [f64; 2] {
        ends.map(|x| self.term_sizes(x).energy)
    }

    /// The round-off of the growth of the entropy in a step.
    fn entropy_round_off(&self, ends: [&Element<Self>; 2]) -> f64 {
        let sizes = ends.map(|x| self.term_sizes(x).entropy);
        4.0 * f64::EPSILON * sizes[0].max(sizes[1])
    }

    /// The invariant that depends most on the other fields at a state, and its independent fraction, if this
    /// explains a failure.
    fn dependent_invariant(&self, x: &Element<Self>) -> Option<(usize, f64)> {
        let _ = x;
        None
    }

    /// The sizes that the entries reach soon in a run that lasts `span`.
    fn reach(&self, x: &Element<Self>, span: f64) -> Option<Scales<Self::Vector>> {
        let _ = (x, span);
        None
    }

    /// The velocity at a state and the sizes of what it is summed of.
    fn rates_and_terms(&self, x: &Element<Self>) -> Option<[Self::Vector; 2]> {
        let rates = self.rates(x, &self.sizes(x).map(|_| 0.0))?;
        let terms = rates.map(f64::abs);
        Some([rates, terms])
    }

    /// An estimate of the local error of a step, for methods that have none; `None` if it has no value.
    fn local_error(&self, x: &Element<Self>, end: &Element<Self>, h: f64) -> Option<Self::Vector> {
        let _ = (x, end, h);
        None
    }
}

/// A one-step method.
///
/// Laws ([`laws::method`](crate::laws::method)): 1. [`order`](Self::order) is the slope of the error;
/// 2. what [`promises`](Self::promises) says holds on every step; 3. a step from a saved memory is the same
/// step, bit for bit.
pub trait Method<F: Flow>: Sized {
    /// What it keeps from one step to the next, [`saved`](Memory) by a checkpoint.
    type Memory: Memory;

    /// The order of convergence: it sets the exponents of adaptive step sizes.
    fn order(&self) -> u32;

    /// What holds exactly on every step.
    fn promises(&self, flow: &F) -> Promises;

    /// One step of size `h`, at any price.
    ///
    /// A run calls it within [`Flow::with_room`]; so does a caller that steps a large system by itself.
    ///
    /// # Errors
    ///
    /// [`StepError`] if it cannot be taken.
    fn step(
        &self,
        flow: &F,
        start: &StepStart<'_, F>,
        h: f64,
        memory: &mut Self::Memory,
    ) -> Result<Taken<F>, StepError>;

    /// One step of size `h` where a smaller one may be tried instead: an error costs little.
    ///
    /// # Errors
    ///
    /// What became of the step.
    fn attempt(
        &self,
        flow: &F,
        start: &StepStart<'_, F>,
        h: f64,
        memory: &mut Self::Memory,
    ) -> Result<Taken<F>, Refusal> {
        self.step(flow, start, h, memory).map_err(|error| Refusal {
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
        flow: &F,
        step: &StepEnds<'_, F>,
        memory: &Self::Memory,
        norm: impl Fn(&F::Vector) -> f64,
    ) -> Option<f64> {
        let _ = memory;
        Some(norm(&flow.local_error(step.x, step.end, step.h)?))
    }

    /// The sites at which a step has the largest error, in units of the one allowed, and at which the motion is
    /// stiffest. A run asks for them on a few steps, and only for vectors with [`sites`](Vector::sites).
    ///
    /// The default has the site of the error that the [`Flow`] estimates.
    fn limiting_sites(
        &self,
        flow: &F,
        step: &StepEnds<'_, F>,
        memory: &Self::Memory,
        allowed: &F::Vector,
    ) -> LimitingSites {
        let _ = memory;
        let error = flow.local_error(step.x, step.end, step.h);
        LimitingSites::new(error.and_then(|error| error.largest_site(allowed)), None)
    }

    /// The state at the fraction `θ` of a step that was taken, from the memory after it; `None` if the flow
    /// does not say what [lies between](Flow::displacement) two states.
    ///
    /// The default is the cubic of Hermite in the chart at the start, of order 3, moved
    /// [onto](Flow::onto) the laws: the energy and the further invariants that the run began with, and an
    /// entropy that does not fall from one fraction to a later one.
    fn between(
        &self,
        flow: &F,
        step: &StepEnds<'_, F>,
        memory: &mut Self::Memory,
        theta: f64,
    ) -> Option<Element<F>> {
        let _ = memory;
        crate::run::dense::between(flow, step, self.promises(flow), theta)
    }

    /// Verifies the model and starts a run: endless in steps of size `h`, or over a [`Span`](crate::Span) or
    /// [`Until`](crate::Until).
    ///
    /// # Errors
    ///
    /// [`RunError`] if the model breaks a law or the schedule cannot be run.
    fn steps(
        self,
        flow: &F,
        x0: Element<F>,
        schedule: impl Into<Schedule>,
    ) -> Result<Steps<'_, F, Self>, RunError<F::Space>> {
        let schedule = schedule.into();
        flow.with_room(|| Steps::start(self, flow, x0, schedule))
    }

    /// Verifies the model, runs it over a [`Span`](crate::Span) or [`Until`](crate::Until), and records the states.
    ///
    /// # Errors
    ///
    /// [`RunError`]; if a step failed, the trajectory so far is in it.
    fn run(
        self,
        flow: &F,
        x0: Element<F>,
        schedule: impl Into<Schedule>,
    ) -> Result<Trajectory<F::Space>, RunError<F::Space>> {
        let schedule = schedule.into();
        flow.with_room(|| self.steps(flow, x0, schedule)?.run())
    }

    /// Takes up a run where it was put down. With the system and the method of that run the steps
    /// are those that it would have taken, bit for bit.
    ///
    /// # Errors
    ///
    /// [`ResumeError`] if the checkpoint does not belong to the system, or is damaged.
    fn resume<'a>(
        self,
        flow: &'a F,
        checkpoint: &Checkpoint,
    ) -> Result<Steps<'a, F, Self>, ResumeError> {
        flow.with_room(|| Steps::resume(self, flow, checkpoint))
    }
}

/// What a method keeps from one step to the next.
pub trait Memory: Clone + Debug + Default {
    /// The memory for steps of `ratio` times the size.
    #[must_use]
    fn rescaled(&self, ratio: f64) -> Self;

    /// Notes what a try that was refused has left in its own copy of this memory.
    fn refused(&mut self, tried: Self) {
        let _ = tried;
    }

    /// Puts all of its numbers into a checkpoint.
    fn save(&self, saved: &mut Saved);

    /// Reads them from a checkpoint.
    ///
    /// # Errors
    ///
    /// [`ResumeError`] if a number is missing or impossible.
    fn restore(saved: &Saved) -> Result<Self, ResumeError>;

    /// The displacement of the last step, and the digits that rounding has lost of the position: a checkpoint
    /// compares them with the state. Empty where there are none.
    fn moved_and_lost(&self) -> [Vec<f64>; 2] {
        [Vec::new(), Vec::new()]
    }
}

/// The memory of a method that has none.
impl Memory for () {
    fn rescaled(&self, _: f64) -> Self {}

    fn save(&self, _: &mut Saved) {}

    fn restore(_: &Saved) -> Result<Self, ResumeError> {
        Ok(())
    }
}

/// Where a step starts.
#[derive(Debug)]
pub struct StepStart<'a, F: Flow + ?Sized> {
    /// The state.
    pub x: &'a Element<F>,
    /// The time.
    pub time: f64,
    /// The laws there.
    pub values: Laws<F::Numbers>,
    /// What they were at the start of the run; for the entropy, after the last step that dissipated. A method
    /// may aim at these values, so that round-off does not add up.
    pub reference: Laws<F::Numbers>,
    /// The error that each entry is allowed in this step, if the steps follow a tolerance.
    pub allowed: Option<F::Vector>,
}

impl<'a, F: Flow> StepStart<'a, F> {
    /// The first step of a run from `x`.
    pub fn first(flow: &F, x: &'a Element<F>) -> Self {
        let values = flow.laws(x);
        Self { x, time: 0.0, reference: values.clone(), values, allowed: None }
    }
}

/// The two ends of a step that was taken.
#[derive(Debug)]
pub struct StepEnds<'a, F: Flow + ?Sized> {
    /// The state at its start.
    pub x: &'a Element<F>,
    /// The state at its end.
    pub end: &'a Element<F>,
    /// Its size.
    pub h: f64,
    /// The laws at both.
    pub values: [&'a Laws<F::Numbers>; 2],
    /// What the laws were at the start of the run, as in [`StepStart::reference`].
    pub reference: &'a Laws<F::Numbers>,
}

/// How steps follow a tolerance: with the error `r` of a step in units of the one allowed, and that of the step
/// before it, `r₋`,
///
/// ```math
/// h_+ = h \, \min\bigl(r_{\max}, \max(r_{\min}, \; s\, r^{-\alpha} r_-^{\beta}) \bigr) .
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Control {
    /// The power of the tolerance to which the error of a step is held.
    pub power: f64,
    /// The exponent `α`.
    pub alpha: f64,
    /// The exponent `β`.
    pub beta: f64,
    /// The exponent of a step that is rejected, without `r₋`.
    pub rejected: f64,
    /// The least ratio of two steps, and the largest.
    pub ratios: [f64; 2],
}

impl Control {
    /// The PI controller of Gustafsson (1991) for a method of order `p`, with local errors `∝ τ^{(p+1)/p}`: the
    /// error at the end of a run is proportional to the tolerance.
    #[must_use]
    pub fn of_order(p: u32) -> Self {
        let local = f64::from(p + 1);
        Self {
            power: local / f64::from(p),
            alpha: 0.7 / local,
            beta: 0.4 / local,
            rejected: 1.0 / local,
            ratios: [0.2, 5.0],
        }
    }
}

/// A step that was taken.
#[derive(Clone, Debug)]
pub struct Taken<F: Flow + ?Sized> {
    /// The state at its end.
    pub x: Element<F>,
    /// The laws there.
    pub values: Laws<F::Numbers>,
    /// What the step tells of the motion.
    pub evidence: Evidence,
    /// What it cost.
    pub effort: Effort,
}

/// A step that was not taken, where a smaller one may be.
#[derive(Clone, Debug)]
pub struct Refusal {
    /// What was done.
    pub effort: Effort,
    /// The error that a run ends with if no smaller step is taken either, where there is a particular one.
    pub error: Option<StepError>,
    /// Whether the entropy would have fallen. Steps then stay smaller for a while.
    pub second_law: bool,
}
