//! Choices that a tape can hold.

use metriplectic_fields::{Real, Scalar};
use num_dual::{Dual64, DualStruct};

use crate::{Op, Recorded, book};

/// Comparisons and choices as operations, for fields that are recorded: an `if` on the state is not on a tape, and
/// [`select`](Self::select) is.
///
/// A comparison gives 1 or 0. Both alternatives of a choice are computed, and the one that is not chosen contributes nothing to
/// the gradient, even where its slope is infinite or not a number.
///
/// # Examples
///
/// ```
/// use metriplectic_manifolds::Euclidean;
/// use metriplectic_recording::{Branchless, field};
/// use nalgebra::{Vector1, vector};
/// use num_dual::DualNum;
///
/// let field = field!(|p: &Vector1<Real>| {
///     let zero = Real::from(0.0);
///     zero.less(p.x).select(p.x.sqrt(), zero)
/// });
/// let tape = field.tape(&Euclidean::<1>, &vector![4.0])?;
/// let mut slope = [f64::NAN];
/// assert_eq!(tape.gradient(&[-1.0], &mut slope), 0.0);
/// assert_eq!(slope, [0.0]);
/// # Ok::<(), metriplectic_recording::RecordingError>(())
/// ```
pub trait Branchless: Scalar {
    /// Returns whether this number is less than another one.
    #[must_use]
    fn less(self, other: Self) -> Self;

    /// Returns whether this number is at most another one.
    #[must_use]
    fn less_equal(self, other: Self) -> Self;

    /// Returns whether this number equals another one.
    #[must_use]
    fn equal(self, other: Self) -> Self;

    /// Returns whether this condition and another one hold.
    #[must_use]
    fn and(self, other: Self) -> Self;

    /// Returns whether this condition or another one holds.
    #[must_use]
    fn or(self, other: Self) -> Self;

    /// Returns whether this condition does not hold.
    #[must_use]
    fn negated(self) -> Self;

    /// Returns `yes` if this condition holds, otherwise `no`.
    #[must_use]
    fn select(self, yes: Self, no: Self) -> Self;

    /// Returns the smaller of two numbers, and this one if they are equal.
    #[must_use]
    fn least(self, other: Self) -> Self;

    /// Returns the larger of two numbers, and this one if they are equal.
    #[must_use]
    fn greatest(self, other: Self) -> Self;
}

fn flag(holds: bool) -> f64 {
    if holds { 1.0 } else { 0.0 }
}

macro_rules! numbers {
    ($($number:ty)*) => {$(
        impl Branchless for $number {
            #[inline]
            fn less(self, other: Self) -> Self {
                flag(self.re() < other.re()).into()
            }

            #[inline]
            fn less_equal(self, other: Self) -> Self {
                flag(self.re() <= other.re()).into()
            }

            #[inline]
            #[expect(clippy::float_cmp, reason = "the function asks for equal values")]
            fn equal(self, other: Self) -> Self {
                flag(self.re() == other.re()).into()
            }

            #[inline]
            fn and(self, other: Self) -> Self {
                flag(self.re() != 0.0 && other.re() != 0.0).into()
            }

            #[inline]
            fn or(self, other: Self) -> Self {
                flag(self.re() != 0.0 || other.re() != 0.0).into()
            }

            #[inline]
            fn negated(self) -> Self {
                flag(self.re() == 0.0).into()
            }

            #[inline]
            fn select(self, yes: Self, no: Self) -> Self {
                if self.re() != 0.0 { yes } else { no }
            }

            #[inline]
            fn least(self, other: Self) -> Self {
                if other.re() < self.re() { other } else { self }
            }

            #[inline]
            fn greatest(self, other: Self) -> Self {
                if other.re() > self.re() { other } else { self }
            }
        }
    )*};
}

numbers!(f64 Dual64 Real);

impl Branchless for Recorded {
    fn less(self, other: Self) -> Self {
        self.binary(Op::Less, other, self.value.less(other.value))
    }

    fn less_equal(self, other: Self) -> Self {
        self.binary(Op::LessEqual, other, self.value.less_equal(other.value))
    }

    fn equal(self, other: Self) -> Self {
        self.binary(Op::Equal, other, self.value.equal(other.value))
    }

    fn and(self, other: Self) -> Self {
        self.binary(Op::LogicalAnd, other, self.value.and(other.value))
    }

    fn or(self, other: Self) -> Self {
        self.binary(Op::LogicalOr, other, self.value.or(other.value))
    }

    fn negated(self) -> Self {
        let value = self.value.negated();
        if self.is_constant() {
            Self::from_re(value)
        } else {
            book::put(Op::LogicalNot, &[self], 0.0, value)
        }
    }

    fn select(self, yes: Self, no: Self) -> Self {
        if self.is_constant() {
            return if self.value != 0.0 { yes } else { no };
        }
        book::put(Op::Select, &[self, yes, no], 0.0, self.value.select(yes.value, no.value))
    }

    fn least(self, other: Self) -> Self {
        self.binary(Op::Min, other, self.value.least(other.value))
    }

    fn greatest(self, other: Self) -> Self {
        self.binary(Op::Max, other, self.value.greatest(other.value))
    }
}
