//! A fault of a flow that is no metriplectic system.

use std::fmt;
use std::sync::Arc;

/// A fault that a [`Flow`](crate::Flow) which is no metriplectic system has found at the start of a run. It is the
/// flow's own error, which can be downcast from it.
///
/// ```
/// use metriplectic_integrators::FlowError;
/// let error = FlowError::new("7a".parse::<i32>().unwrap_err());
/// assert!(error.downcast_ref::<std::num::ParseIntError>().is_some());
/// ```
#[derive(Clone, thiserror::Error)]
#[error("{0}")]
pub struct FlowError(#[source] Arc<dyn std::error::Error + Send + Sync>);

/// Compares by identity: two errors with the same text differ.
impl PartialEq for FlowError {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl FlowError {
    /// Wraps the error of a flow.
    pub fn new(error: impl std::error::Error + Send + Sync + 'static) -> Self {
        Self(Arc::new(error))
    }

    /// The flow's own error, if it is of this type.
    pub fn downcast_ref<E: std::error::Error + 'static>(&self) -> Option<&E> {
        self.0.downcast_ref()
    }
}

impl fmt::Debug for FlowError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}
