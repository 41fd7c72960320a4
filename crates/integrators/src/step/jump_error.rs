//! Errors of events that change the state.

use metriplectic_manifolds::PointError;

/// Why an [event cannot change the state](crate::Watched::jump).
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum JumpError {
    /// The closure returns no point of the space.
    #[error("it leads to no point of the space: {0}")]
    NoPoint(#[source] PointError),
    /// The laws have no value at the new state.
    #[error("the energy or the entropy has no value at the state to which it leads: {entries:?}")]
    OutOfDomain {
        /// The entries of this state.
        entries: Vec<f64>,
    },
    /// The entropy of the system and its surroundings falls.
    #[error(
        "it lowers the entropy of the system and its surroundings by {fall:.3e}; if what the energy changes by is heat, name \
         the temperature with `.heat_at(T)`, or say `.may_lower_entropy()` where a part of the surroundings is not in \
         the model"
    )]
    LowersEntropy {
        /// By how much.
        fall: f64,
    },
    /// A listed Casimir or momentum changes.
    #[error(
        "it changes invariant {index} by {change:.3e}; leave this one out of the list, or keep it in the closure"
    )]
    BreaksInvariant {
        /// Which one, in the order of the list, counted from 0.
        index: usize,
        /// By how much.
        change: f64,
    },
    /// The state returns to the event within the last digits of the time, and would do so for ever.
    #[error(
        "the state returns to it in a time below the last digits, so infinitely many of them pile up there; end the run with \
         `.stop()` at an event of a small speed, or hold the state by a model of the contact"
    )]
    PilesUp,
}

metriplectic_equations::debug_is_the_sentence!(JumpError);
