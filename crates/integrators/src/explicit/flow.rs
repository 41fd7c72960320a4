//! The interface between explicit methods and systems.

use crate::step::{Element, Flow, Laws};

/// A flow on which explicit methods run: it says the rates of a stage, and moves a state onto its laws. Every
/// [`Metriplectic`](metriplectic_dynamics::Metriplectic) system is one.
pub trait StageFlow: Flow {
    /// The differentials of the laws at a state, with their values.
    type Gradients: Clone + std::fmt::Debug;

    /// Evaluates the laws and their differentials at a state; `None` where one has no value.
    fn gradients(&self, x: &Element<Self>) -> Option<Self::Gradients>;

    /// The values of the laws that go with the differentials.
    fn values(&self, gradients: &Self::Gradients) -> Laws<Self::Numbers>;

    /// The velocity at a state, in the frame there, and the entropy `⟨dS, K dS⟩` that is produced per unit of
    /// time; `None` where they have no value.
    fn velocity(
        &self,
        x: &Element<Self>,
        gradients: &Self::Gradients,
    ) -> Option<(Self::Vector, f64)>;

    /// The velocity and the production at a state of which nothing else is asked.
    #[inline]
    fn motion(&self, x: &Element<Self>) -> Option<(Self::Vector, f64)> {
        self.velocity(x, &self.gradients(x)?)
    }

    /// The state `ψ_x(q)` at which a stage is taken; `None` beyond the edge of the chart or the domain.
    fn stage(&self, x: &Element<Self>, q: &Self::Vector) -> Option<Element<Self>>;

    /// The rates in the chart of the stages at `x`, of the velocity `v` at `y = ψ_x(q)`.
    fn stage_rates(
        &self,
        x: &Element<Self>,
        at: (&Self::Vector, &Element<Self>),
        v: &Self::Vector,
    ) -> Self::Vector;

    /// The coordinates `ψ_x⁻¹(y)`.
    fn stage_coordinates(&self, x: &Element<Self>, y: &Element<Self>) -> Self::Vector;

    /// Returns whether the entropy falls from a state to one near it, where the change of its values is round-off. A
    /// flow that cannot say returns `false`.
    fn falls_below_round_off(&self, x: &Element<Self>, y: &Element<Self>) -> bool {
        let _ = (x, y);
        false
    }

    /// Whether [`project`](Self::project) uses an estimate of the local error; see [`Target::error`].
    fn weighs_errors(&self) -> bool {
        false
    }

    /// Moves a state onto its laws, by Newton's method along their differentials.
    ///
    /// # Errors
    ///
    /// [`ProjectionError`] if no state near `y` has these values.
    fn project(
        &self,
        y: Element<Self>,
        target: &Target<'_, Self>,
    ) -> Result<Projected<Self>, ProjectionError>;
}

/// The values of the laws onto which a state is moved, and how far.
#[derive(Debug)]
pub struct Target<'a, F: Flow + ?Sized> {
    /// The energy and the further invariants; the entropy counts if [`with_entropy`](Self::with_entropy).
    pub laws: &'a Laws<F::Numbers>,
    /// Whether the entropy is one of them. If not, it is only compared with its value.
    pub with_entropy: bool,
    /// A displacement, longer than which none is allowed.
    pub limit: Option<&'a F::Vector>,
    /// The unit of each entry, in which displacements and the independence of the laws are measured: the error that is
    /// allowed, or the size in this step. Without it, the size at the state. A flow that
    /// [weighs errors](StageFlow::weighs_errors) may have units of its own.
    pub units: Option<&'a F::Vector>,
    /// An estimate of the local error of the step, if the flow [weighs errors](StageFlow::weighs_errors): a state
    /// may be moved in proportion to it, so that nothing moves which the step has not moved.
    pub error: Option<&'a F::Vector>,
}

/// A state on its laws.
#[derive(Clone, Debug)]
pub struct Projected<F: StageFlow + ?Sized> {
    /// The state.
    pub x: Element<F>,
    /// The differentials of the laws there.
    pub gradients: F::Gradients,
    /// The entropy, less what the errors of the other laws, which are round-off, make of it; and the round-off
    /// of this number.
    pub entropy: f64,
    /// The round-off of `entropy`.
    pub entropy_round_off: f64,
}

/// Why a state could not be moved onto its laws.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProjectionError {
    /// The entropy depends on the other laws, and has another value.
    NoEntropy,
    /// There is no state near by with these values.
    Far,
    /// The way leads out of the domain.
    Outside,
}
