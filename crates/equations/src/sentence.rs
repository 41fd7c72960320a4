//! Errors that print as their sentence.

/// Gives an error the `Debug` form of its sentence, the `Display` form: a `main` that returns an error prints the former.
///
/// ```
/// use metriplectic_equations::{PointError, debug_is_the_sentence};
///
/// /// An error of a crate above.
/// #[derive(thiserror::Error)]
/// #[error("no state in row {row}")]
/// struct NoState<E: std::error::Error + 'static> {
///     row: usize,
///     source: E,
/// }
///
/// debug_is_the_sentence!([E: std::error::Error + 'static] NoState<E>);
///
/// let error = NoState { row: 7, source: PointError::NotFinite { index: 0, value: f64::NAN } };
/// assert_eq!(format!("{error:?}"), "no state in row 7");
/// ```
#[doc(hidden)]
#[macro_export]
macro_rules! debug_is_the_sentence {
    ([$($generics:tt)*] $error:ty) => {
        /// Prints the sentence of the `Display` form, which a `main` that returns the error shows.
        impl<$($generics)*> ::core::fmt::Debug for $error {
            fn fmt(&self, f: &mut ::core::fmt::Formatter<'_>) -> ::core::fmt::Result {
                ::core::fmt::Display::fmt(self, f)
            }
        }
    };
    ($error:ty) => {
        $crate::debug_is_the_sentence!([] $error);
    };
}
