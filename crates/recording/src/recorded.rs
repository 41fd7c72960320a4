//! A scalar that records what is done with it.

mod arithmetic;
mod dual_number;
mod linear_algebra;
mod piecewise;

use std::fmt;

use crate::Op;
use crate::book::{self, Identity};

/// A scalar that records: each operation on it becomes an instruction of a [`Tape`](crate::Tape), by
/// [`record`](crate::record()).
///
/// Every operation of [`Real`](metriplectic_fields::Real) is one of it, so that the text of a closure compiles: arithmetic
/// with itself and with `f64` on the right, the functions of [`DualNum`](num_dual::DualNum), and the linear algebra of nalgebra.
///
/// An operation on constants is done at once. A question for the value of a number that depends on the
/// inputs, such as `re()`, `<`, `==` or `is_zero()`, is answered, and makes the recording fail with
/// [`RecordingError::Branches`](crate::RecordingError::Branches): what would be done at another value is not on the tape. [`Branchless`](crate::Branchless) has
/// operations that record a choice.
#[derive(Clone, Copy)]
pub struct Recorded {
    pub(crate) identity: Identity,
    pub(crate) value: f64,
}

impl Recorded {
    /// The constant `value`.
    #[must_use]
    pub const fn from_re(value: f64) -> Self {
        Self { identity: Identity::CONSTANT, value }
    }

    #[inline]
    pub(crate) fn is_constant(self) -> bool {
        self.identity.is_constant()
    }

    /// Answers a question of the function that is recorded.
    #[track_caller]
    fn known(self, question: &'static str) -> f64 {
        if !self.is_constant() {
            book::asked(question);
        }
        self.value
    }

    /// Records an operation on one number.
    fn unary(self, op: Op, value: f64) -> Self {
        self.with_constant(op, 0.0, value)
    }

    /// Records an operation on one number and the constant `k`.
    fn with_constant(self, op: Op, k: f64, value: f64) -> Self {
        if self.is_constant() { Self::from_re(value) } else { book::put(op, &[self], k, value) }
    }

    /// Records an operation on two numbers.
    pub(crate) fn binary(self, op: Op, other: Self, value: f64) -> Self {
        if self.is_constant() && other.is_constant() {
            Self::from_re(value)
        } else {
            book::put(op, &[self, other], 0.0, value)
        }
    }
}

/// The value, which is that of the state at which the function is recorded.
impl fmt::Debug for Recorded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(&self.value, f)
    }
}

/// The value, which is that of the state at which the function is recorded.
impl fmt::Display for Recorded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.value, f)
    }
}

impl From<f64> for Recorded {
    fn from(value: f64) -> Self {
        Self::from_re(value)
    }
}
