//! Energies that depend on time.

use std::fmt;

use metriplectic_fields::{ErasedField, Real, Scalar, ScalarField, Space};

/// An energy `H(t, x)` from a closure `|t, x| -> Real`; as a field of the point alone it is `H(0, x)`.
#[derive(Clone, Copy)]
pub struct AtTime<F>(pub F);

// By hand, because closures have no `Debug`.
impl<F> fmt::Debug for AtTime<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("AtTime").finish_non_exhaustive()
    }
}

#[diagnostic::do_not_recommend]
impl<M: Space, F: Fn(Real, &M::Point<Real>) -> Real> ScalarField<M> for AtTime<F> {
    fn at<D: Scalar>(&self, x: &M::Point<D>) -> D {
        <InTime as Clock<M, Self>>::at(self, [0.0; 2], x)
    }

    fn at_real(&self, x: &M::Point<Real>) -> Real {
        (self.0)(Real::from(0.0), x)
    }
}

/// A closure of the time and of a point behind a pointer.
pub type OfTime<M, T> = Box<dyn Fn(Real, &<M as Space>::Point<Real>) -> T + Send + Sync>;

/// Whether the energy of a system depends on time, and how it is evaluated there.
pub trait Clock<M: Space, H>: Copy + Default + fmt::Debug + Send + Sync + 'static {
    /// Whether it does.
    const RUNS: bool;

    /// Evaluates `½ (H(t, x) + H(t', x))` at any scalar.
    fn at<D: Scalar>(energy: &H, times: [f64; 2], x: &M::Point<D>) -> D;

    /// Evaluates the same at the scalar of closures.
    fn at_real(energy: &H, times: [f64; 2], x: &M::Point<Real>) -> Real;

    /// The field itself if it does not depend on time: it may know its derivatives.
    fn still(energy: &H) -> Option<&impl ScalarField<M>>;

    /// Evaluates `H(t, x)` with the derivatives that `t` and `x` carry.
    fn in_time(energy: &H, t: Real, x: &M::Point<Real>) -> Real;

    /// The energy behind a pointer.
    type Erased;

    /// Moves the energy behind a pointer.
    fn erased(energy: H) -> Self::Erased
    where
        H: Send + Sync + 'static;
}

/// The energy does not depend on time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Still;

impl<M: Space, H: ScalarField<M>> Clock<M, H> for Still {
    const RUNS: bool = false;

    #[inline]
    fn at<D: Scalar>(energy: &H, _: [f64; 2], x: &M::Point<D>) -> D {
        energy.at(x)
    }

    #[inline]
    fn at_real(energy: &H, _: [f64; 2], x: &M::Point<Real>) -> Real {
        energy.at_real(x)
    }

    #[inline]
    fn still(energy: &H) -> Option<&impl ScalarField<M>> {
        Some(energy)
    }

    fn in_time(energy: &H, _: Real, x: &M::Point<Real>) -> Real {
        energy.at_real(x)
    }

    type Erased = ErasedField<M>;

    fn erased(energy: H) -> ErasedField<M>
    where
        H: Send + Sync + 'static,
    {
        ErasedField::new(energy)
    }
}

/// The energy is [`AtTime`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InTime;

impl<M: Space, F: Fn(Real, &M::Point<Real>) -> Real> Clock<M, AtTime<F>> for InTime {
    const RUNS: bool = true;

    #[inline]
    fn at<D: Scalar>(energy: &AtTime<F>, times: [f64; 2], x: &M::Point<D>) -> D {
        let mean = |x: &M::Point<Real>| <Self as Clock<M, AtTime<F>>>::at_real(energy, times, x);
        ScalarField::<M>::at(&mean, x)
    }

    #[inline]
    fn at_real(AtTime(energy): &AtTime<F>, [t, end]: [f64; 2], x: &M::Point<Real>) -> Real {
        let first = energy(Real::from(t), x);
        if t.to_bits() == end.to_bits() {
            return first;
        }
        (first + energy(Real::from(end), x)) * 0.5
    }

    #[inline]
    fn still(_: &AtTime<F>) -> Option<&impl ScalarField<M>> {
        None::<&f64>
    }

    #[inline]
    fn in_time(AtTime(energy): &AtTime<F>, t: Real, x: &M::Point<Real>) -> Real {
        energy(t, x)
    }

    type Erased = AtTime<OfTime<M, Real>>;

    fn erased(energy: AtTime<F>) -> Self::Erased
    where
        AtTime<F>: Send + Sync + 'static,
    {
        AtTime(Box::new(move |t, x| <Self as Clock<M, AtTime<F>>>::in_time(&energy, t, x)))
    }
}
