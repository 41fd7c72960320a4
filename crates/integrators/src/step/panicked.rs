//! Panics in a system.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A panic in a run of a system as [`FromEquations`](crate::FromEquations), as the flow's own error: in a step or while a state on the way
/// is verified, with the states before it ([`StepError::Flow`](crate::StepError::Flow)), and elsewhere, while the start is verified or
/// in the function of an event, without them ([`RunError::Flow`](crate::RunError::Flow)).
#[derive(Clone, PartialEq, Eq, thiserror::Error)]
#[error("it has panicked: {message}")]
#[non_exhaustive]
pub struct Panicked {
    /// The message of the panic.
    pub message: String,
}

metriplectic_equations::debug_is_the_sentence!(Panicked);

impl Panicked {
    fn with(payload: &(dyn Any + Send)) -> Self {
        let text = payload.downcast_ref::<&str>().map(ToString::to_string);
        let message = text.or_else(|| payload.downcast_ref::<String>().cloned());
        Self { message: message.unwrap_or_else(|| "without a message".to_owned()) }
    }
}

/// Calls `f`, whose panic is an error.
pub(crate) fn caught<T>(f: impl FnOnce() -> T) -> Result<T, Panicked> {
    // Whoever calls it gives up what `f` was about to change.
    catch_unwind(AssertUnwindSafe(f)).map_err(|payload| Panicked::with(&*payload))
}
