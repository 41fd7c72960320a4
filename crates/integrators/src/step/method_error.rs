//! A fault of a method, found before a run.

use std::fmt;
use std::sync::Arc;

/// A fault that a method has found in itself before a run, such as a [`TableauError`](crate::TableauError). It is the
/// method's own error, which can be downcast from it.
#[derive(Clone, thiserror::Error)]
#[error("{0}")]
pub struct MethodError(#[source] Arc<dyn std::error::Error + Send + Sync>);

/// Compares by identity: two errors with the same text differ.
impl PartialEq for MethodError {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl MethodError {
    /// Wraps the error of a method.
    pub fn new(error: impl std::error::Error + Send + Sync + 'static) -> Self {
        Self(Arc::new(error))
    }

    /// The method's own error, if it is of this type.
    pub fn downcast_ref<E: std::error::Error + 'static>(&self) -> Option<&E> {
        self.0.downcast_ref()
    }
}

impl fmt::Debug for MethodError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}
