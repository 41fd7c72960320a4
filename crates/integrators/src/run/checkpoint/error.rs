//! Why a run cannot be taken up.

use metriplectic_manifolds::PointError;

use crate::run::span_error::SpanError;
use crate::step::{MethodError, RestoreError};

/// A checkpoint that cannot be resumed.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ResumeError {
    /// It was written by another version of this library.
    #[error(
        "the checkpoint has format {found}, and {expected} is what is read here; resume it with the version that wrote it"
    )]
    Version {
        /// The format of the checkpoint.
        found: u32,
        /// The format of this version.
        expected: u32,
    },
    /// Its point is not one of the manifold.
    #[error("the point of the checkpoint: {0}")]
    Point(#[from] PointError),
    /// A list in it has another length than the system says.
    #[error(
        "the checkpoint has {found} {what}, the system {expected}; resume it with the system that it is of"
    )]
    Length {
        /// The name of the list.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length that it should have.
        expected: usize,
    },
    /// A field has another value than the checkpoint says.
    #[error(
        "the {field} is {found} at the point of the checkpoint, which says {stored}; resume it with the system that it is of"
    )]
    AnotherSystem {
        /// Which field.
        field: &'static str,
        /// Its value in the checkpoint.
        stored: f64,
        /// Its value in the system.
        found: f64,
    },
    /// The end that it is to be given cannot be that of the run.
    #[error(transparent)]
    Span(#[from] SpanError),
    /// It is of a run in steps of one size, and is to be given a time at which it ends.
    #[error(
        "the run takes steps of one size; say how many with `with_steps` instead of `with_end`"
    )]
    FixedSteps,
    /// It is of a run whose steps follow a tolerance, and is to be given a number of steps.
    #[error(
        "the steps of the run follow a tolerance; say when it ends with `with_end` instead of `with_steps`"
    )]
    AdaptiveSteps,
    /// It is of a run by another method.
    #[error(
        "the checkpoint is of a run by `{stored}`, and `{found}` was to resume it; resume it with the method that \
         it is of, or start a run by the other one at its point"
    )]
    AnotherMethod {
        /// The [name](crate::Stepper::name) of the method in the checkpoint.
        stored: String,
        /// The name of the method that was to resume it.
        found: String,
    },
    /// The method has found a fault of its own.
    #[error(transparent)]
    Method(#[from] MethodError),
    /// A number of its file has changed since it was written.
    #[error(
        "the numbers of the checkpoint have the checksum {found:016x}, and its file says {stored:016x}; the file \
         was changed or damaged: take another copy of it"
    )]
    Altered {
        /// The checksum in the file.
        stored: u64,
        /// The checksum of the numbers in the file.
        found: u64,
    },
    /// A number that a method has saved is impossible.
    #[error("the {what} of the checkpoint is {value}, which no run has; write another one")]
    Damaged {
        /// Which number.
        what: &'static str,
        /// Its value.
        value: f64,
    },
}

metriplectic_equations::debug_is_the_sentence!(ResumeError);

impl From<RestoreError> for ResumeError {
    fn from(error: RestoreError) -> Self {
        match error {
            RestoreError::Length { what, found, expected } => {
                Self::Length { what, found, expected }
            }
            RestoreError::Damaged { what, value } => Self::Damaged { what, value },
        }
    }
}

/// Accepts a list of the length that the system says.
pub(super) const fn expect_length(
    what: &'static str,
    found: usize,
    expected: usize,
) -> Result<(), ResumeError> {
    if found == expected { Ok(()) } else { Err(ResumeError::Length { what, found, expected }) }
}
