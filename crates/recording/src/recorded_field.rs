//! A closure with its tape.

use std::fmt;

use metriplectic_fields::{Dimension, Jet1, Jet2, Real, Scalar, ScalarField};

use crate::{PointEntries, Tape, TapeField};

/// The fewest variables with which the gradient by a sweep back takes fewer instructions than by dual numbers.
const GRADIENT_FROM: usize = 8;

/// The fewest variables with which the Hessian by sweeps takes fewer instructions than by dual numbers.
const HESSIAN_FROM: usize = 16;

/// A closure with its tape, of which each evaluation uses the faster one.
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
    #[inline]
    fn at<D: Scalar>(&self, x: &M::Point<D>) -> D {
        if const { M::Dim::LEN >= GRADIENT_FROM } {
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
}
