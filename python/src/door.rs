//! The interface to Python, of systems whose functions were recorded.
//!
//! | module | what it holds |
//! |---|---|
//! | [`tapes`] | recordings as they come from Python |
//! | [`interrupt`] | systems that look for signals while they run |
//! | [`method`] | methods by their names |
//! | [`schedule`] | times, outputs and events |
//! | [`kinds`], [`output`] | what is recorded of the states of each kind of system |
//! | [`system`] | the class that holds a system, and its runs |
//! | [`derivatives`] | tangents and gradients |
//! | [`fits`] | least squares by the solver of the library |
//! | [`errors`] | exceptions |

pub(crate) mod definition;
pub(crate) mod derivatives;
pub(crate) mod errors;
pub(crate) mod fits;
pub(crate) mod interrupt;
pub(crate) mod kinds;
pub(crate) mod method;
pub(crate) mod output;
pub(crate) mod schedule;
pub(crate) mod surroundings;
pub(crate) mod system;
pub(crate) mod tapes;
