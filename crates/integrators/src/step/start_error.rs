//! A start that contradicts its run.

use super::digits::digits;

/// A state of an open run in which another run cannot start.
#[derive(Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StartError {
    /// The clock of the state shows another time than that of the start.
    #[error(
        "the clock of the state shows t = {}, and the run starts at t = {}: let the span start there by \
         `.starting_at({clock:?})`, and clock and ledger go on; or begin with a new clock and an empty ledger, by `start` of \
         the system and the point of the state",
        digits(.clock),
        digits(.start)
    )]
    Clock {
        /// The time that the clock of the state shows.
        clock: f64,
        /// The time at which the run starts.
        start: f64,
    },
    /// The ledger of the state is one of another system.
    #[error(
        "the ledger of the state has {found} entries, and the system has {expected}: begin with a new clock and an empty \
         ledger, by `start` of the system and the point of the state"
    )]
    Ledger {
        /// How many entries the ledger of the state has.
        found: usize,
        /// How many the system has.
        expected: usize,
    },
}

metriplectic_equations::debug_is_the_sentence!(StartError);
