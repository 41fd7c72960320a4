//! Why a run has no tangent.

use crate::run::checkpoint::ResumeError;
use crate::run::error::RunError;
use crate::step::{StateSpace, StepError};

/// Why a step has no derivative.
#[derive(Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Unlinearised {
    /// A path from one end of a step to the other was not found, or a Jacobian is singular or not a number.
    #[error("the equation of the step has no regular derivative there; take smaller steps")]
    Singular,
    /// The scheme is not the same seen from either end of a step.
    #[error(
        "the steps have derivatives if the scheme is symmetric: take `WeylMidpoint` or `ChartMidpoint` with `Gonzalez`, `MeanValue` or \
         `SymmetricItohAbe`, or another method"
    )]
    NotSymmetric,
    /// A field has no second derivative at a state of the run.
    #[error(
        "a second derivative of the model is not finite there, as that of a norm at zero; write `norm_squared()`, or \
         start elsewhere"
    )]
    NotSmooth,
    /// The step that was differentiated is not the one that was taken.
    #[error(
        "the step ends {off:.1e} of its size away from the one that was taken; take smaller steps"
    )]
    NotReproduced {
        /// The largest difference of an entry, relative to its size.
        off: f64,
    },
    /// The step lies where its method changes its formula, so that its derivative is another one on either side.
    #[error(
        "the step lies where its method changes its formula, as a step that damps does near an infinite temperature; \
         take smaller steps, or another start"
    )]
    Branch,
    /// Derivatives by differences have no step.
    #[error(
        "every entry that moves has been zero in the run, so that a difference has no size; start elsewhere"
    )]
    NoSize,
    /// A parameter is zero, and derivatives along it are differences.
    #[error(
        "the parameter {name} is zero, so that a difference along it has no size; take another value, or a `Family` or a model that \
         knows its parameters, whose derivatives are exact"
    )]
    ZeroParameter {
        /// The parameter.
        name: &'static str,
    },
    /// A system at parameters beside those of the run is refused.
    #[error("there is no system at parameters beside these; take values inside their bounds")]
    NoSystem,
    /// The time of a corner depends on a parameter.
    #[error(
        "the law changes at a time that depends on the parameter {name}, and the corner that is named stays where it is; take differences \
         of whole runs, each of which names its own corner"
    )]
    MovingCorner {
        /// The parameter.
        name: &'static str,
    },
    /// A step bends over less than differences can resolve.
    #[error(
        "differences of steps beside the step do not agree, as where a function is not smooth; take smaller steps, or another start"
    )]
    Bent,
    /// The derivative breaks the first law of tangents.
    #[error(
        "dH(x') T' differs from dH(x₀) by {off:.1e} of its terms, so the derivative is wrong; take smaller steps"
    )]
    LawBroken {
        /// The difference, relative to the terms.
        off: f64,
    },
}

metriplectic_equations::debug_is_the_sentence!(Unlinearised);

/// A run whose tangent cannot be computed.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum TangentError<M: StateSpace> {
    /// The run did not finish.
    #[error(transparent)]
    Run(#[from] RunError<M>),
    /// A checkpoint of the run was not taken up.
    #[error(transparent)]
    Resume(#[from] ResumeError),
    /// A step of the run failed.
    #[error(transparent)]
    Step(#[from] StepError),
    /// A step has no derivative.
    #[error("no tangent of the step from t = {time}: {cause}")]
    NotLinearised {
        /// The time at which the step starts.
        time: f64,
        /// Why.
        cause: Unlinearised,
    },
    /// An accuracy of derivatives that is not between round-off and 1.
    #[error(
        "the accuracy of the derivatives is {accuracy:e}; it must be at least 1.5e-14, which is round-off, and below 1, as 1e-8"
    )]
    Accuracy {
        /// The accuracy asked for.
        accuracy: f64,
    },
    /// Derivatives are not as exact as asked for.
    #[error(
        "the derivatives of the last two runs differ by {reached:.1e}, and not by {accuracy:.1e} or less; ask for less, for a shorter \
         run, or for a method of higher order"
    )]
    Inexact {
        /// The accuracy asked for.
        accuracy: f64,
        /// The difference of the last two runs.
        reached: f64,
    },
    /// The state jumps at an event without derivatives, or the run goes back in time.
    #[error(
        "the schedule has {what}, across which the tangent is not carried; give a jump or a stop its derivatives at points of the system \
         with its parameters (`Jumping::differentiable`, `Watched::differentiable`), or run up to the first one and go on from there"
    )]
    Broken {
        /// The jumps, the stop or the run.
        what: &'static str,
    },
    /// The derivatives of a jump are those of another map than the one by which the state has jumped.
    #[error(
        "at t = {time} the map of the jump at {event}, given with its derivatives, leads {off:.1e} of the size of the state away from \
         the one by which it has jumped; write the same map in both"
    )]
    OtherJump {
        /// The name of the event.
        event: String,
        /// Its time.
        time: f64,
        /// The largest difference of an entry, relative to the size of the state.
        off: f64,
    },
    /// The derivatives of an event are those of another function than the one by which it was found.
    #[error(
        "at t = {time} the function of the event {event}, given with its derivatives, is {off:.1e} of what it could be and not zero; write \
         the same function in both"
    )]
    OtherFunction {
        /// The name of the event.
        event: String,
        /// Its time.
        time: f64,
        /// `|g|/|dg|`, with the entries in units of their sizes.
        off: f64,
    },
    /// An event lies at a corner of the law, and leaves it when the start or a parameter moves.
    #[error(
        "the event {event} at t = {time} lies at a corner, where the velocity is another one on either side, so its time has no derivative; \
         choose another start, or move the corner or the event"
    )]
    EventAtCorner {
        /// The name of the event.
        event: String,
        /// Its time.
        time: f64,
    },
    /// An event is grazing: its function hardly changes along the motion, so that its time has no derivative.
    #[error(
        "the event {event} at t = {time} is grazing: its function changes along the motion by {slope:.1e} of what it \
         could, so its time has no derivative; choose another function or another start"
    )]
    Grazing {
        /// The name of the event.
        event: String,
        /// Its time.
        time: f64,
        /// `|dg·v|/(|dg||v|)`, with the entries in units of their sizes.
        slope: f64,
    },
}

metriplectic_equations::debug_is_the_sentence!([M: StateSpace] TangentError<M>);
