//! Everything that a user does with a run of any method.

mod adaptive;
pub mod certificate;
mod checked;
pub mod checkpoint;
pub mod controller;
mod corners;
mod departure;
pub(crate) mod ending;
pub(crate) mod error;
pub mod event;
mod judged;
pub(crate) mod jump;
mod jumping;
pub(crate) mod last_step;
pub(crate) mod method;
pub mod observables;
mod output;
mod progress;
mod recheck;
mod record;
pub(crate) mod requests;
mod root;
pub(crate) mod schedule;
pub mod span;
pub(crate) mod span_error;
pub(crate) mod state;
pub mod steps;
pub mod trajectory;
pub mod until;
pub mod watch;
mod watching;

pub use ending::Ending;
pub use method::Method;
pub use schedule::Schedule;
pub use span_error::SpanError;
pub use state::State;
