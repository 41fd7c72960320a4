//! The interface between runs and systems.

use std::fmt::Debug;
use std::ops::IndexMut;

use metriplectic_dynamics::invariants::Kind;
use metriplectic_dynamics::{ModelError, SecondLaw};
use metriplectic_equations::{Equations, Evaluated};
use metriplectic_manifolds::{Manifold, PointError};

use super::initial_scales::initial_scales;
use super::plain::{Directions, Entries, Values};
use super::{
    EventExchange, FlowError, LedgerErrors, LedgerSummary, Scales, StartError, StepError, Vector,
    both,
};

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

/// The occasion on which a run asks for the laws of its model again.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Recheck {
    /// A state on the way, after a step. The check allocates nothing if no law is broken.
    OnTheWay {
        /// The steps so far. A flow with many parts may check other ones after each of them.
        step: usize,
    },
    /// The end of the run, or a state that a step has left where it is.
    End,
    /// A state from which a step of this size fails, before the run ends in the error of the step.
    Failure {
        /// The size of the step.
        h: f64,
    },
}

/// States that are lists of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlainNumbers;

impl StateSpace for PlainNumbers {
    type Element = Entries;

    fn numbers(x: &Entries) -> Vec<f64> {
        x.to_vec()
    }
}

/// A flow in plain numbers, of which nothing else is known.
pub type PlainFlow<'a> = dyn Flow<Space = PlainNumbers, Numbers = Values, Vector = Directions> + 'a;

/// A flow whose states are listed in plain numbers, so that a [`Simulation`](crate::Simulation) runs it.
pub trait Listed: Flow + Sized {
    /// Says whether a panic in the flow ends a run in an error: in one whose functions are yours.
    const CATCHES_PANICS: bool = false;

    /// The parts of a state that are no entries, such as the names in a ledger.
    type Layout: Clone + Send + Sync + 'static;

    /// Returns these parts, which all states of the flow share.
    fn layout(&self) -> &Self::Layout;

    /// Reads a state.
    fn read(layout: &Self::Layout, entries: &[f64]) -> Element<Self>;

    /// Writes the entries of a state.
    fn write(x: &Element<Self>) -> Entries;

    /// Reads and checks the state in which a run starts. What is booked beside a point may be left out.
    ///
    /// # Errors
    ///
    /// [`PointError`] if they are no entries of a state.
    fn at_start(&self, entries: &[f64]) -> Result<Element<Self>, PointError> {
        self.element(entries)
    }

    /// Returns the state that a jump leads to, as [`jumped`](Flow::jumped) does.
    fn led(x: &Element<Self>, y: Element<Self>) -> Element<Self> {
        let _ = x;
        y
    }
}

/// A flow whose vectors and laws are written in plain numbers too, so that its runs are compiled with this library.
pub trait Written: Listed {
    /// Says whether the flow answers [`Equations`] and has so few directions that explicit methods are compiled with the library.
    #[doc(hidden)]
    const HAS_EXPLICIT: bool = false;

    /// Says whether the flow is a model on a vector space with the canonical metric, without further invariants and of so few
    /// variables that implicit methods are compiled with the library.
    #[doc(hidden)]
    const HAS_IMPLICIT: bool = false;

    /// Reads a vector.
    fn vector(directions: &Directions) -> Self::Vector;

    /// Writes a vector.
    fn directions(v: &Self::Vector) -> Directions;

    /// Reads a number for each further invariant.
    fn numbers(values: &Values) -> Self::Numbers;
}

/// A visitor of a flow: in its types, or in plain numbers.
pub trait FlowVisitor<F: Flow>: Sized {
    /// The result.
    type Output;

    /// Visits the flow in its types.
    fn typed(self, flow: &F) -> Self::Output;

    /// Visits the flow in plain numbers.
    fn written(self, flow: &F) -> Self::Output
    where
        F: Written;

    /// Visits the flow of a system that answers [`Equations`], whose states are points without a ledger or a clock.
    fn answered(self, flow: &F, system: &dyn Equations) -> Self::Output
    where
        F: Written,
    {
        let _ = system;
        self.written(flow)
    }

    /// Visits the flow of a system that answers [`Equations`] and nothing else, whose states are plain numbers.
    fn own(self, flow: &F, system: &dyn Equations) -> Self::Output
    where
        F: Written,
    {
        let _ = system;
        self.written(flow)
    }
}

/// A flow of which nothing is known but what its states and its numbers are. A run is compiled for it, and so once for each space.
pub(crate) type AnyFlow<'a, F> = dyn Flow<Space = <F as Flow>::Space, Numbers = <F as Flow>::Numbers, Vector = <F as Flow>::Vector>
    + 'a;

/// Calls `f` in the [room](Flow::room) of a flow.
///
/// # Panics
///
/// If the room does not call the work in it.
#[inline]
pub fn in_room<F: Flow + ?Sized, T>(flow: &F, f: impl FnOnce() -> T) -> T {
    let (mut f, mut result) = (Some(f), None);
    flow.room(&mut || result = f.take().map(|f| f()));
    result.expect("a room calls the work in it")
}

/// A system as a run sees it: its laws, its sizes, and its equation of motion.
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

    /// Calls `work` once, with the room on the stack that a step of this flow needs. A flow whose steps need little calls it
    /// as it is.
    #[inline]
    fn room(&self, work: &mut dyn FnMut()) {
        work();
    }

    /// The state in which a run starts at a time. The default is the one that is given.
    ///
    /// # Errors
    ///
    /// [`StartError`] if the state carries a clock that shows another time.
    fn begin(&self, x: Element<Self>, time: f64) -> Result<Element<Self>, StartError> {
        let _ = time;
        Ok(x)
    }

    /// The state at another reading of the clock, where states carry one; `None` if they do not, or show this time. A run
    /// asks for it at the end of each step, with the time that it records, and across each
    /// [corner](crate::Watch::corners).
    #[inline]
    fn clocked(&self, x: &Element<Self>, time: f64) -> Option<Element<Self>> {
        let _ = (x, time);
        None
    }

    /// The state to which an event leads, from the one at which it was found and from what a closure made of that. What a
    /// state carries beside its point, a clock or a ledger, stays. The default is the closure's state.
    fn jumped(&self, x: &Element<Self>, y: Element<Self>) -> Element<Self> {
        let _ = x;
        y
    }

    /// The state with the exchange of an event in its ledger; `None` if states have no ledger. Then the run keeps the
    /// balance.
    fn with_event(&self, x: &Element<Self>, event: &EventExchange) -> Option<Element<Self>> {
        let _ = (x, event);
        None
    }

    /// Returns whether the flow depends on time. Then no state is at rest.
    fn depends_on_time(&self) -> bool {
        false
    }

    /// Returns the exchange of the system up to a state, for the certificate of an open one.
    fn ledger(&self, x: &Element<Self>) -> Option<LedgerSummary> {
        let _ = x;
        None
    }

    /// Returns whether the numbers of a direction beyond [`len`](Vector::len) are booked in a ledger, whose errors a run
    /// estimates.
    #[inline]
    fn has_ledger(&self) -> bool {
        false
    }

    /// Sorts the estimated errors of what a step has booked; `None` without a ledger.
    fn ledger_errors(&self, errors: &Self::Vector) -> Option<LedgerErrors> {
        let _ = errors;
        None
    }

    /// Gives the entries of the ledger the sizes at a state that their errors are relative to where little has flowed, and the
    /// sizes of the terms of their rates.
    fn with_ledger_sizes(
        &self,
        x: &Element<Self>,
        scales: Scales<Self::Vector>,
    ) -> Scales<Self::Vector> {
        let _ = x;
        scales
    }

    /// Looks at the ends of each step that was taken, for what must hold on every one. Steps are `of_one_size`, or follow a
    /// tolerance.
    ///
    /// # Errors
    ///
    /// [`StepError`] that ends the run.
    #[inline]
    fn inspect(&self, ends: [&Element<Self>; 2], of_one_size: bool) -> Result<(), StepError> {
        let _ = (ends, of_one_size);
        Ok(())
    }

    /// The state with these entries.
    ///
    /// # Errors
    ///
    /// [`PointError`] if they are no state.
    fn element(&self, entries: &[f64]) -> Result<Element<Self>, PointError>;

    /// The promise of the model about its entropy.
    fn entropy_law(&self) -> SecondLaw {
        SecondLaw::NoEntropy
    }

    /// Which fields are evaluated from a recording, as found at a state; nothing where none is written to be recorded.
    fn evaluated(&self, x: &Element<Self>) -> Vec<Evaluated> {
        let _ = x;
        Vec::new()
    }

    /// Why each further invariant is conserved.
    fn kinds(&self) -> Vec<Kind> {
        Vec::new()
    }

    /// Whether the dissipation is projected, and is not quite the tensor that was written down.
    fn is_projected(&self) -> bool {
        false
    }

    /// The largest eigenvalue `G*(dH, dH)` of the dissipation of the metric at a state, if a system has this dissipation and no
    /// scale `κ` was chosen for it.
    fn default_friction(&self, x: &Element<Self>) -> Option<f64> {
        let _ = x;
        None
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

    /// Returns whether the model was verified before the run. A run then checks the model at its start, after each
    /// multiple of 149 steps and at its end, and the certificate says so.
    fn is_verified(&self) -> bool {
        false
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

    /// Returns whether [`recheck`](Self::recheck) or [`reexamine`](Self::reexamine) checks anything on an occasion. A run does
    /// not ask for them otherwise.
    fn rechecks(&self, occasion: Recheck) -> bool {
        let _ = occasion;
        false
    }

    /// Verifies the model at a state that the run has reached. A law that is broken there ends the run.
    ///
    /// # Errors
    ///
    /// The first law of the model that is broken.
    fn recheck(&self, x: &Element<Self>, occasion: Recheck) -> Result<(), ModelError> {
        let _ = (x, occasion);
        Ok(())
    }

    /// Verifies what only the flow knows of at a state that the run has reached.
    ///
    /// # Errors
    ///
    /// The flow's own error.
    fn reexamine(&self, x: &Element<Self>, occasion: Recheck) -> Result<(), FlowError> {
        let _ = (x, occasion);
        Ok(())
    }

    /// The verdict on the model at a state that the run has reached: of [`recheck`](Self::recheck), then of
    /// [`reexamine`](Self::reexamine).
    ///
    /// # Errors
    ///
    /// [`StepError::Model`] or [`StepError::Flow`].
    fn verdict(&self, x: &Element<Self>, time: f64, occasion: Recheck) -> Result<(), StepError> {
        let broken = |law| StepError::Model { time, law: Box::new(law) };
        self.recheck(x, occasion).map_err(broken)?;
        self.reexamine(x, occasion).map_err(|law| StepError::Flow { time, law })
    }

    /// Verifies at the end of the run of a system that was verified before it what may hold at some states alone.
    ///
    /// # Errors
    ///
    /// The flow's own error.
    fn examine_end(&self, x: &Element<Self>) -> Result<(), FlowError> {
        let _ = x;
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
        both(ends, |x| self.term_sizes(x).energy)
    }

    /// The round-off of the growth of the entropy in a step.
    fn entropy_round_off(&self, ends: [&Element<Self>; 2]) -> f64 {
        let sizes = both(ends, |x| self.term_sizes(x).entropy);
        // Numbers without digits are zeros.
        4.0 * f64::EPSILON * sizes[0].max(sizes[1]) + f64::MIN_POSITIVE / f64::EPSILON
    }

    /// The invariant that depends most on the other fields at a state, and its independent fraction, if this
    /// explains a failure.
    fn dependent_invariant(&self, x: &Element<Self>) -> Option<(usize, f64)> {
        let _ = x;
        None
    }

    /// The sizes that the entries reach soon in a run that lasts `span`. The default is two steps of the classical
    /// method of order 4, of a size that resolves the motion.
    fn reach(&self, x: &Element<Self>, span: f64) -> Option<Scales<Self::Vector>> {
        initial_scales(self, x, span)
    }

    /// The sizes of the terms that the velocity `v` at a state is summed of, with entries of these sizes. Velocities
    /// below their round-off are noise. The default knows of none.
    fn velocity_terms(
        &self,
        x: &Element<Self>,
        v: &Self::Vector,
        sizes: &Self::Vector,
    ) -> Option<Self::Vector> {
        let _ = (x, sizes);
        Some(v.zero())
    }

    /// The velocity at a state and the sizes of what it is summed of.
    fn rates_and_terms(&self, x: &Element<Self>) -> Option<[Self::Vector; 2]> {
        let rates = self.rates(x, &self.sizes(x).map(|_| 0.0))?;
        let terms = rates.map(f64::abs);
        Some([rates, terms])
    }

    /// Receives a visitor: in the types of the flow, or in plain numbers if it is [written](Written) in them.
    fn visit<V: FlowVisitor<Self>>(&self, visitor: V) -> V::Output
    where
        Self: Sized,
    {
        visitor.typed(self)
    }

    /// An estimate of the local error of a step, for methods that have none; `None` if it has no value.
    fn local_error(&self, x: &Element<Self>, end: &Element<Self>, h: f64) -> Option<Self::Vector> {
        let _ = (x, end, h);
        None
    }
}

/// A flow, or a system at values of parameters whose runs are those of a flow.
pub trait HasFlow {
    /// The flow of its runs.
    type Flow: Flow;

    /// Returns the flow.
    fn as_flow(&self) -> &Self::Flow;
}

impl<F: Flow> HasFlow for F {
    type Flow = F;

    fn as_flow(&self) -> &F {
        self
    }
}
