//! A closure with its tape.

use std::fmt;

use metriplectic_fields::{
    Dimension, Evaluation, Jet1, Jet2, Matrix, Real, Scalar, ScalarField, Vector,
};

use crate::{PointEntries, Tape, TapeField};

/// The fewest variables with which the gradient by a sweep back takes fewer instructions than by dual numbers.
///
/// Instructions for a ring of sites with three variables each and one `exp` a site, by closure and by tape (callgrind,
/// x86-64, release): 576 and 2124 with 6 variables, 4078 and 3195 with 9, 5995 and 4197 with 12, 28,714 and 8167 with 24,
/// 120,747 and 19,607 with 48.
///
/// A factor of four fails `tests/recorded_fields.rs::each_derivative_comes_from_the_faster_one`.
pub(crate) const GRADIENT_FROM: usize = 9;

/// The fewest variables with which the Hessian by sweeps takes fewer instructions than by dual numbers.
///
/// Instructions for the same ring: 12,045 and 14,452 with 6 variables, 38,140 and 25,756 with 9, 81,540 and 35,991 with 12,
/// 715,868 and 86,144 with 24, 5,931,070 and 275,868 with 48.
///
/// A factor of four fails `tests/recorded_fields.rs::each_derivative_comes_from_the_faster_one`.
const HESSIAN_FROM: usize = 7;

/// A closure with its tape, of which each evaluation uses the faster one.
///
/// A value comes from the closure, which the compiler has seen: the tape takes twice the instructions. Derivatives come from the tape
/// in high dimensions, from 9 for a gradient and from 7 for a Hessian.
///
/// The values and derivatives of both agree to round-off, which [`Recordable::recorded`](crate::Recordable::recorded) has checked.
#[derive(Clone)]
pub struct RecordedField<M, F> {
    closure: F,
    tape: TapeField<M>,
}

impl<M: PointEntries, F> RecordedField<M, F> {
    pub(crate) fn new(closure: F, tape: TapeField<M>) -> Self {
        Self { closure, tape }
    }

    /// The tape.
    #[must_use]
    pub fn tape(&self) -> &Tape {
        self.tape.tape()
    }

    /// The tape as a field, without the closure.
    #[must_use]
    pub fn into_tape(self) -> TapeField<M> {
        self.tape
    }
}

impl<M, F> fmt::Debug for RecordedField<M, F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("RecordedField").field(&self.tape).finish()
    }
}

#[diagnostic::do_not_recommend]
impl<M, F> ScalarField<M> for RecordedField<M, F>
where
    M: PointEntries,
    F: Fn(&M::Point<Real>) -> Real,
{
    fn evaluation(&self, _: &M::Point<f64>) -> Evaluation {
        if M::Dim::LEN >= GRADIENT_FROM {
            Evaluation::Tape
        } else {
            Evaluation::FewVariables(M::Dim::LEN)
        }
    }

    #[inline]
    fn at<D: Scalar>(&self, x: &M::Point<D>) -> D {
        if const { D::NDERIV > 0 && M::Dim::LEN >= GRADIENT_FROM } {
            self.tape.at(x)
        } else {
            ScalarField::<M>::at(&self.closure, x)
        }
    }

    #[inline]
    fn at_real(&self, x: &M::Point<Real>) -> Real {
        (self.closure)(x)
    }

    #[inline]
    fn jet1(&self, x: &M::Point<f64>) -> Jet1<M> {
        if const { M::Dim::LEN >= GRADIENT_FROM } {
            self.tape.jet1(x)
        } else {
            ScalarField::<M>::jet1(&self.closure, x)
        }
    }

    #[inline]
    fn jet2(&self, x: &M::Point<f64>) -> Jet2<M> {
        if const { M::Dim::LEN >= HESSIAN_FROM } {
            self.tape.jet2(x)
        } else {
            ScalarField::<M>::jet2(&self.closure, x)
        }
    }

    #[inline]
    fn differential_at(&self, x: &M::Point<f64>, q: &Vector<M>) -> Vector<M> {
        if const { M::Dim::LEN >= GRADIENT_FROM } {
            self.tape.differential_at(x, q)
        } else {
            ScalarField::<M>::differential_at(&self.closure, x, q)
        }
    }

    #[inline]
    fn hessian_at(&self, x: &M::Point<f64>, q: &Vector<M>) -> Matrix<M> {
        if const { M::Dim::LEN >= HESSIAN_FROM } {
            self.tape.hessian_at(x, q)
        } else {
            ScalarField::<M>::hessian_at(&self.closure, x, q)
        }
    }
}
