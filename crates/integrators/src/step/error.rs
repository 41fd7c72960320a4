//! Errors of steps.

use std::fmt;
use std::sync::Arc;

use metriplectic_dynamics::ModelError;

use super::digits::{counted, digits};
use super::{Effort, FlowError, JumpError, MethodError};

impl fmt::Display for Effort {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { iterations, continued, splits } = self;
        write!(
            f,
            "{}, {} in the step size and {} of the step",
            counted(*iterations, "Newton iteration", "Newton iterations"),
            counted(*continued, "continuation", "continuations"),
            counted(*splits, "halving", "halvings"),
        )
    }
}

/// A step that could not be taken, after its halves had been tried too.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StepError {
    /// The model was verified at the start of the run, and breaks a law at a state that the run has reached, or near a
    /// state from which a step failed.
    #[error("the model keeps its laws around the start of the run, but not around the state at t = {}: {law}", digits(.time))]
    Model {
        /// The time of the state.
        time: f64,
        /// The law, with the state at which it is broken.
        #[source]
        law: Box<ModelError>,
    },
    /// The method has found a fault of its own.
    #[error("the method cannot take a step from t = {}: {error}", digits(.time))]
    Method {
        /// The time at which the step starts.
        time: f64,
        /// The fault.
        #[source]
        error: MethodError,
    },
    /// The flow has found a fault of its own at a state that the run has reached.
    #[error("the system was verified at the start of the run, but at t = {}: {law}", digits(.time))]
    Flow {
        /// The time of the state.
        time: f64,
        /// The flow's own error.
        #[source]
        law: FlowError,
    },
    /// The implicit equation was not solved.
    #[error(
        "the step of size {h:.3e} from t = {} was not solved: residual {residual:.1e} after \
         {tried}; try a smaller step, below {suggested:.1e}",
        digits(.time)
    )]
    NotConverged {
        /// The time at which the step starts.
        time: f64,
        /// The size of the step that was asked for.
        h: f64,
        /// The residual that was left in the smallest step tried.
        residual: f64,
        /// The effort of the solver.
        tried: Effort,
        /// A step size to try next.
        suggested: f64,
    },
    /// The equation was not solved, and friction is stiff at this step size.
    #[error(
        "the step of size {h:.3e} from t = {} was not solved, because the friction is stiff: \
         h|K'| = {stiffness:.1e} (residual {residual:.1e} after {tried}); take {}steps below {:.1e} while the fast \
         variables relax, as `Span::until` does, or eliminate these",
        digits(.time),
        if *.damps { "" } else { "`Radau`, which damps it in steps of this size, or " },
        .h * 10.0 / .stiffness
    )]
    StiffFriction {
        /// The time at which the step starts.
        time: f64,
        /// The size of the step that was asked for.
        h: f64,
        /// The rate `h|K'|`, with `K'` the derivative of `K dS` along the state.
        stiffness: f64,
        /// The residual that was left in the smallest step tried.
        residual: f64,
        /// The effort of the solver.
        tried: Effort,
        /// True if the method damps friction that is faster than a step, as [`Radau`](crate::Radau) does.
        damps: bool,
    },
    /// The energy is not conserved: it differs by more than a millionth of the size of its terms from what it
    /// was. The size is `|H| + Σ_i |∂_iH| (|x_i| + |d_i|)` with the displacement `d` of the step, at the end of
    /// the step where it is smaller.
    #[error(
        "the first law is broken in the step of size {h:.3e} from t = {}: the energy would be off by \
         {change:.1e}, and its terms are of size {size:.1e}; the energy has too few digits there for this \
         step: try a smaller one, or variables in which large terms do not cancel",
        digits(.time)
    )]
    FirstLawBroken {
        /// The time at which the step starts.
        time: f64,
        /// The size of the step.
        h: f64,
        /// The error of the energy.
        change: f64,
        /// The size of the terms of the energy.
        size: f64,
    },
    /// A further invariant depends on the other fields at the start of the step: its differential is a
    /// combination of theirs. The step was not solved, or the invariant is no longer conserved.
    #[error(
        "invariant {index} depends on the other fields at t = {}: only {fraction:.1e} of its \
         differential is independent of theirs, and no step from there conserves it (it has changed by \
         {change:.1e} since the start); leave it out of the list, or keep away from such states",
        digits(.time)
    )]
    DependentInvariants {
        /// The time at which the step starts.
        time: f64,
        /// Which one, in the order of the list, counted from 0.
        index: usize,
        /// By how much it has changed since the start of the run.
        change: f64,
        /// The fraction of its differential that is independent.
        fraction: f64,
    },
    /// No state near the end of an explicit step has the energy and the further invariants of the run.
    #[error(
        "the step of size {h:.3e} from t = {} was not taken: no state near its end has the energy and the \
         invariants of the run, however small its part ({tried}); take smaller steps, or let them follow a \
         tolerance with `Span::until`",
        digits(.time)
    )]
    NotProjected {
        /// The time at which the step starts.
        time: f64,
        /// The size of the step that was asked for.
        h: f64,
        /// The effort of the solver.
        tried: Effort,
    },
    /// The entropy would fall in an explicit step and in each smaller one, while the state moves.
    #[error(
        "the entropy would fall in the step of size {h:.3e} from t = {}, and in smaller ones, while the state is not \
         at rest: friction produces {rise:.1e} in this step; check that K is positive semidefinite around this \
         state, and that H and S have their derivatives there; if friction is stiff, take smaller steps, or let them \
         follow a tolerance with `Span::until`",
        digits(.time)
    )]
    EntropyFalls {
        /// The time at which the step starts.
        time: f64,
        /// The size of the step.
        h: f64,
        /// The entropy `h Σ b_i ⟨dS, K dS⟩_i` that friction produces in the step.
        rise: f64,
    },
    /// The energy jumps inside a step of a fixed size, or changes faster than the step.
    #[error(
        "the energy changes by {frozen:.3e} along the step of size {h:.3e} from t = {} at a frozen state, and its rate adds \
         up to {quadrature:.3e}: the protocol jumps inside the step, or is faster than it; name the times of its jumps by \
         `.corners([..])`, take smaller steps, or let them follow a tolerance",
        digits(.time)
    )]
    ProtocolJumps {
        /// The time at which the step starts.
        time: f64,
        /// The size of the step.
        h: f64,
        /// The change `H(t', x) − H(t, x)` at a frozen state.
        frozen: f64,
        /// The integral of `∂_tH` there, by the Gauss rule of three points.
        quadrature: f64,
    },
    /// The energy changes along the velocity in proportion to time, which its derivative excludes, and explicit steps
    /// creep.
    #[error(
        "the energy changes at the rate {rate:.1e} along the velocity at t = {}, although `⟨dH, v⟩ = 0`, so steps of size \
         {h:.1e} hardly advance: the derivative of H is not that of its values there; check it around this state, and that \
         no closure takes the value out of a `Real`",
        digits(.time)
    )]
    WrongDerivative {
        /// The time at which the step starts.
        time: f64,
        /// The size of the step.
        h: f64,
        /// The rate at which the energy changes.
        rate: f64,
    },
    /// An event cannot change the state.
    #[error("the event \"{event}\" at t = {} cannot change the state: {error}", digits(.time))]
    Jump {
        /// The time of the event.
        time: f64,
        /// Its name.
        event: Arc<str>,
        /// The reason.
        #[source]
        error: JumpError,
    },
    /// The controller asks for a step below the least one.
    #[error(
        "the step from t = {} would have to be {h:.1e} long to keep the tolerance, below the least \
         step {least:.1e}; the motion may end there: see the energy and the entropy around this \
         state, or ask for a coarser tolerance; if something drives it and has a corner or a jump there, name its time by \
         `.corners([..])`",
        digits(.time)
    )]
    TooSmall {
        /// The time at which the step starts.
        time: f64,
        /// The size that it would have to have.
        h: f64,
        /// The least step size.
        least: f64,
    },
    /// The step that the controller asks for is shorter than the last digit of the time.
    #[error(
        "the step from t = {} would have to be {h:.1e} long to keep the tolerance, below the last \
         digit of the time; the motion may end there: see the energy and the entropy around this state, \
         let the run start at t = 0, or ask for a coarser tolerance; if something drives it and has a corner or a jump \
         there, name its time by `.corners([..])`",
        digits(.time)
    )]
    Standstill {
        /// The time at which the step starts.
        time: f64,
        /// The size that it would have to have.
        h: f64,
    },
    /// Even in the smallest part of the step the way to a solution leads out of the domain of a field, of
    /// the metric or of the chart.
    #[error(
        "the step of size {h:.3e} from t = {} leaves the domain of the model wherever it goes \
         ({tried}); try a smaller step, or check energy and entropy there",
        digits(.time)
    )]
    OutOfDomain {
        /// The time at which the step starts.
        time: f64,
        /// The size of the step that was asked for.
        h: f64,
        /// The effort of the solver.
        tried: Effort,
    },
    /// A part of a large system leaves its domain.
    #[error(
        "the step of size {h:.3e} from t = {} leads out of the domain of the model at site {site} ({tried}); try a \
         smaller step, or check energy and entropy there",
        digits(.time)
    )]
    SiteOutOfDomain {
        /// The time at which the step starts.
        time: f64,
        /// The size of the step that was asked for.
        h: f64,
        /// The first site that leaves.
        site: usize,
        /// The effort of the solver.
        tried: Effort,
    },
    /// A state inside a step was asked for, and the flow gives no displacement between two states, or no smaller step
    /// was found.
    #[error(
        "the step of size {h:.3e} from t = {} was taken, and no state was found inside it, where an output or an \
         event was asked for; take a smaller step (a `Flow` of your own finds states inside a step by its \
         `Flow::displacement`)",
        digits(.time)
    )]
    NothingBetween {
        /// The time at which the step starts.
        time: f64,
        /// The size of the step.
        h: f64,
    },
}

impl StepError {
    /// The size of the step that failed; `None` if the error says already what is wrong with the system.
    pub(crate) const fn size(&self) -> Option<f64> {
        match self {
            Self::NotConverged { h, .. }
            | Self::StiffFriction { h, .. }
            | Self::FirstLawBroken { h, .. }
            | Self::NotProjected { h, .. }
            | Self::EntropyFalls { h, .. }
            | Self::WrongDerivative { h, .. }
            | Self::ProtocolJumps { h, .. }
            | Self::TooSmall { h, .. }
            | Self::Standstill { h, .. }
            | Self::OutOfDomain { h, .. }
            | Self::SiteOutOfDomain { h, .. } => Some(h.abs()),
            Self::Model { .. }
            | Self::Flow { .. }
            | Self::Method { .. }
            | Self::Jump { .. }
            | Self::DependentInvariants { .. }
            | Self::NothingBetween { .. } => None,
        }
    }
}

metriplectic_equations::debug_is_the_sentence!(StepError);
