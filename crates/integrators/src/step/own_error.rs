//! Faults that only a flow or a method knows of.

use std::error::Error;
use std::sync::Arc;

/// An error that holds another one, of a type that the library does not know.
macro_rules! own_error {
    ($(#[$meta:meta])* $name:ident of $owner:literal) => {
        $(#[$meta])*
        #[derive(Clone, thiserror::Error)]
        #[error("{0}")]
        pub struct $name(#[source] Arc<dyn Error + Send + Sync>);

        /// Compares by identity: two errors with the same text differ.
        impl PartialEq for $name {
            fn eq(&self, other: &Self) -> bool {
                Arc::ptr_eq(&self.0, &other.0)
            }
        }

        impl $name {
            #[doc = concat!("Wraps the error of a ", $owner, ".")]
            pub fn new(error: impl Error + Send + Sync + 'static) -> Self {
                Self(Arc::new(error))
            }

            #[doc = concat!("The ", $owner, "'s own error, if it is of this type.")]
            pub fn downcast_ref<E: Error + 'static>(&self) -> Option<&E> {
                self.0.downcast_ref()
            }
        }

        metriplectic_equations::debug_is_the_sentence!($name);
    };
}

own_error!(
    /// A fault that a [`Flow`](crate::Flow) which is no metriplectic system has found at the start of a run. It is the
    /// flow's own error, which can be downcast from it.
    ///
    /// ```
    /// use metriplectic_integrators::FlowError;
    /// let error = FlowError::new("7a".parse::<i32>().unwrap_err());
    /// assert!(error.downcast_ref::<std::num::ParseIntError>().is_some());
    /// ```
    FlowError of "flow"
);

own_error!(
    /// A fault that a method has found in itself before a run, such as a [`TableauError`](crate::TableauError). It is
    /// the method's own error, which can be downcast from it.
    MethodError of "method"
);
