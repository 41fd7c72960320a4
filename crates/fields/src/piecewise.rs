//! Functions with a kink.

use num_dual::{Dual64, DualNum, DualStruct};

use crate::Real;

/// The functions with a kink that an `f64` has, with their derivatives.
///
/// On either side of its kink each is smooth. There a derivative is that of the side that the value was taken from, as the
/// table says. A step across a kink has order 1 at most, and steps that follow a tolerance grow small there: end the step at the kink by an
/// event with a [corner](../../metriplectic_integrators/trait.Watch.html) where its time matters.
///
/// | function | the kink | derivative there |
/// |---|---|---|
/// | `abs` | 0 | that of `x` at `+0`, of `−x` at `−0` |
/// | `signum` | 0, a step | 0 |
/// | `min`, `max`, `clamp` | equal values | that of the first one |
/// | `hypot` | both 0 | not a number, which a run refuses |
/// | `rem_euclid` | multiples of the modulus, a step | 1 |
///
/// ```
/// use metriplectic_fields::{Piecewise, Real};
///
/// let x = Real::new(-2.0, 1.0, 0.0, 0.0);
/// let stop = (x.abs() - 1.5).max(0.0); // a stop that begins at 1.5
/// assert_eq!((stop.re, stop.eps1), (0.5, -1.0));
/// assert_eq!(x.clamp(-1.0, 1.0).eps1, 0.0);
/// assert_eq!(x.rem_euclid(1.5), Real::new(1.0, 1.0, 0.0, 0.0));
/// ```
pub trait Piecewise: Sized {
    /// Returns `|x|`.
    #[must_use]
    fn abs(self) -> Self;

    /// Returns the sign, 1 or −1, as [`f64::signum`] has it.
    #[must_use]
    fn signum(self) -> Self;

    /// Returns the smaller of two numbers; NaN if one of them is, where that of an `f64` is the other one.
    #[must_use]
    fn min(self, other: impl Into<Self>) -> Self;

    /// Returns the larger of two numbers; NaN if one of them is.
    #[must_use]
    fn max(self, other: impl Into<Self>) -> Self;

    /// Returns the number of an interval that is closest to this one.
    #[must_use]
    fn clamp(self, low: impl Into<Self>, high: impl Into<Self>) -> Self {
        self.max(low).min(high)
    }

    /// Returns `√(x² + y²)`, without an overflow on the way.
    #[must_use]
    fn hypot(self, other: impl Into<Self>) -> Self;

    /// Returns the remainder of a division by a number, from 0 up to its size, as [`f64::rem_euclid`] has it: an angle by a turn.
    #[must_use]
    fn rem_euclid(self, modulus: f64) -> Self;
}

macro_rules! dual_numbers {
    ($($number:ty)*) => {$(
        impl Piecewise for $number {
            #[inline]
            fn abs(self) -> Self {
                if self.re().is_sign_negative() { -self } else { self }
            }

            #[inline]
            fn signum(self) -> Self {
                self.re().signum().into()
            }

            #[inline]
            fn min(self, other: impl Into<Self>) -> Self {
                let other = other.into();
                if self.re() <= other.re() || self.re().is_nan() { self } else { other }
            }

            #[inline]
            fn max(self, other: impl Into<Self>) -> Self {
                let other = other.into();
                if self.re() >= other.re() || self.re().is_nan() { self } else { other }
            }

            #[inline]
            fn hypot(self, other: impl Into<Self>) -> Self {
                let other = other.into();
                let size = self.re().abs().max(other.re().abs());
                if size == 0.0 || !size.is_finite() {
                    return (self * self + other * other).sqrt();
                }
                let (x, y) = (self / size, other / size);
                (x * x + y * y).sqrt() * size
            }

            #[inline]
            fn rem_euclid(self, modulus: f64) -> Self {
                // The value is exact: what is left of it is 0.
                self - self.re() + self.re().rem_euclid(modulus)
            }
        }
    )*};
}

dual_numbers!(Dual64 Real);

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    /// Values, first and second derivatives against those of the branches, on both sides of each kink.
    #[test]
    fn values_and_derivatives_are_those_of_the_branch() {
        for x in [-3.7_f64, -0.2, 0.2, 3.7, 1e-200, -1e200] {
            let seed = Real::new(x, 1.0, 1.0, 0.0);
            let same = |y: Real, jet: [f64; 4]| {
                let bits = [y.re, y.eps1, y.eps2, y.eps1eps2].map(|x| (x + 0.0).to_bits());
                assert_eq!(bits, jet.map(|x| (x + 0.0).to_bits()), "{y} at {x}");
            };
            let sign = x.signum();
            same(seed.abs(), [x.abs(), sign, sign, 0.0]);
            same(seed.signum(), [sign, 0.0, 0.0, 0.0]);
            let below = f64::from(u8::from(x < 1.0));
            same(seed.min(1.0), [x.min(1.0), below, below, 0.0]);
            same(seed.max(1.0), [x.max(1.0), 1.0 - below, 1.0 - below, 0.0]);
            let inside = f64::from(u8::from(x.abs() < 1.0));
            same(seed.clamp(-1.0, 1.0), [x.clamp(-1.0, 1.0), inside, inside, 0.0]);
            same(seed.rem_euclid(1.5), [x.rem_euclid(1.5), 1.0, 1.0, 0.0]);
            assert!(seed.min(f64::NAN).re.is_nan() && Real::from(f64::NAN).max(x).re.is_nan());
        }
    }

    #[test]
    fn a_hypotenuse_neither_overflows_nor_underflows() {
        let at = |unit: f64| Real::new(3.0 * unit, 1.0, 1.0, 0.0).hypot(4.0 * unit);
        for unit in [1.0, 1e-200, 1e200] {
            assert_relative_eq!(at(unit).re, 5.0 * unit, max_relative = 4.0 * f64::EPSILON);
            assert_relative_eq!(at(unit).eps1, 0.6, max_relative = 8.0 * f64::EPSILON);
        }
        for unit in [1.0, 1e-100, 1e100] {
            let bend = at(unit).eps1eps2 * unit; // y²/r³
            assert_relative_eq!(bend, 16.0 / 125.0, max_relative = 16.0 * f64::EPSILON);
        }
        let corner = Real::new(0.0, 1.0, 0.0, 0.0).hypot(0.0);
        assert!(corner.re == 0.0 && corner.eps1.is_nan());
    }
}
