//! The traits that nalgebra asks for: norms, determinants, decompositions.

use approx::{AbsDiffEq, RelativeEq, UlpsEq};
use nalgebra::{ComplexField, Field, RealField, SimdValue};
use num_dual::DualNum;
use num_traits::{FloatConst, Signed, Zero};
use simba::scalar::SubsetOf;

use crate::{Branchless, Recorded};

/// One lane: the number itself.
#[expect(
    unsafe_code,
    reason = "the trait declares two methods unsafe for lanes without a check; these bodies are safe code"
)]
impl SimdValue for Recorded {
    type Element = Self;
    type SimdBool = bool;

    const LANES: usize = 1;

    fn splat(value: Self) -> Self {
        value
    }

    fn extract(&self, _: usize) -> Self {
        *self
    }

    unsafe fn extract_unchecked(&self, _: usize) -> Self {
        *self
    }

    fn replace(&mut self, _: usize, value: Self) {
        *self = value;
    }

    unsafe fn replace_unchecked(&mut self, _: usize, value: Self) {
        *self = value;
    }

    fn select(self, condition: bool, other: Self) -> Self {
        if condition { self } else { other }
    }
}

impl Field for Recorded {}

impl SubsetOf<Self> for Recorded {
    fn to_superset(&self) -> Self {
        *self
    }

    fn from_superset_unchecked(element: &Self) -> Self {
        *element
    }

    fn is_in_subset(_: &Self) -> bool {
        true
    }
}

impl SubsetOf<Recorded> for f64 {
    fn to_superset(&self) -> Recorded {
        Recorded::from_re(*self)
    }

    #[track_caller]
    fn from_superset_unchecked(element: &Recorded) -> Self {
        element.known("a conversion to `f64`")
    }

    fn is_in_subset(_: &Recorded) -> bool {
        true
    }
}

impl SubsetOf<Recorded> for f32 {
    fn to_superset(&self) -> Recorded {
        Recorded::from_re(f64::from(*self))
    }

    #[track_caller]
    #[expect(clippy::cast_possible_truncation, reason = "the function asks for an `f32`")]
    fn from_superset_unchecked(element: &Recorded) -> Self {
        element.known("a conversion to `f32`") as Self
    }

    fn is_in_subset(_: &Recorded) -> bool {
        true
    }
}

impl AbsDiffEq for Recorded {
    type Epsilon = Self;

    fn default_epsilon() -> Self {
        Self::from_re(f64::default_epsilon())
    }

    #[track_caller]
    fn abs_diff_eq(&self, other: &Self, epsilon: Self) -> bool {
        let [a, b, epsilon] = [*self, *other, epsilon].map(|x| x.known(COMPARISON));
        a.abs_diff_eq(&b, epsilon)
    }
}

impl RelativeEq for Recorded {
    fn default_max_relative() -> Self {
        Self::from_re(f64::default_max_relative())
    }

    #[track_caller]
    fn relative_eq(&self, other: &Self, epsilon: Self, most: Self) -> bool {
        let [a, b, epsilon, most] = [*self, *other, epsilon, most].map(|x| x.known(COMPARISON));
        a.relative_eq(&b, epsilon, most)
    }
}

impl UlpsEq for Recorded {
    fn default_max_ulps() -> u32 {
        f64::default_max_ulps()
    }

    #[track_caller]
    fn ulps_eq(&self, other: &Self, epsilon: Self, most: u32) -> bool {
        let [a, b, epsilon] = [*self, *other, epsilon].map(|x| x.known(COMPARISON));
        a.ulps_eq(&b, epsilon, most)
    }
}

const COMPARISON: &str = "a comparison within a tolerance";

macro_rules! dual_functions {
    ($($name:ident)*) => {$(
        fn $name(self) -> Self {
            DualNum::$name(&self)
        }
    )*};
}

/// Rounding has no derivative, and a dual number panics.
macro_rules! roundings {
    ($($name:ident)*) => {$(
        #[track_caller]
        fn $name(self) -> Self {
            Self::from_re(f64::$name(self.known("a rounded number")))
        }
    )*};
}

impl ComplexField for Recorded {
    type RealField = Self;

    dual_functions! {
        recip sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh
        log2 log10 ln ln_1p sqrt exp exp2 exp_m1 cbrt
    }

    roundings!(floor ceil round trunc fract);

    fn from_real(re: Self) -> Self {
        re
    }

    fn real(self) -> Self {
        self
    }

    fn imaginary(self) -> Self {
        Self::zero()
    }

    fn modulus(self) -> Self {
        Signed::abs(&self)
    }

    fn modulus_squared(self) -> Self {
        self * self
    }

    fn argument(self) -> Self {
        Self::zero()
    }

    fn norm1(self) -> Self {
        Signed::abs(&self)
    }

    fn scale(self, factor: Self) -> Self {
        self * factor
    }

    fn unscale(self, factor: Self) -> Self {
        self / factor
    }

    fn signum(self) -> Self {
        Signed::signum(&self)
    }

    fn mul_add(self, a: Self, b: Self) -> Self {
        DualNum::mul_add(&self, a, b)
    }

    fn abs(self) -> Self {
        Signed::abs(&self)
    }

    fn hypot(self, other: Self) -> Self {
        DualNum::sqrt(&(self * self + other * other))
    }

    fn conjugate(self) -> Self {
        self
    }

    fn sin_cos(self) -> (Self, Self) {
        DualNum::sin_cos(&self)
    }

    fn log(self, base: Self) -> Self {
        DualNum::ln(&self) / DualNum::ln(&base)
    }

    fn powi(self, n: i32) -> Self {
        DualNum::powi(&self, n)
    }

    fn powf(self, n: Self) -> Self {
        DualNum::powd(&self, n)
    }

    fn powc(self, n: Self) -> Self {
        DualNum::powd(&self, n)
    }

    #[track_caller]
    fn is_finite(&self) -> bool {
        self.known("`is_finite`").is_finite()
    }

    #[track_caller]
    fn try_sqrt(self) -> Option<Self> {
        let is_positive = self.known("`try_sqrt`") > 0.0;
        is_positive.then(|| DualNum::sqrt(&self))
    }
}

macro_rules! numbers {
    ($($name:ident $number:expr),* $(,)?) => {$(
        fn $name() -> Self {
            Self::from_re($number)
        }
    )*};
}

impl RealField for Recorded {
    numbers! {
        pi f64::PI(), two_pi f64::TAU(), frac_pi_2 f64::FRAC_PI_2(), frac_pi_3 f64::FRAC_PI_3(),
        frac_pi_4 f64::FRAC_PI_4(), frac_pi_6 f64::FRAC_PI_6(), frac_pi_8 f64::FRAC_PI_8(),
        frac_1_pi f64::FRAC_1_PI(), frac_2_pi f64::FRAC_2_PI(), frac_2_sqrt_pi f64::FRAC_2_SQRT_PI(),
        e f64::E(), log2_e f64::LOG2_E(), log10_e f64::LOG10_E(), ln_2 f64::LN_2(), ln_10 f64::LN_10(),
    }

    #[track_caller]
    fn is_sign_positive(&self) -> bool {
        self.known("`is_sign_positive`").is_sign_positive()
    }

    #[track_caller]
    fn is_sign_negative(&self) -> bool {
        self.known("`is_sign_negative`").is_sign_negative()
    }

    #[track_caller]
    fn copysign(self, sign: Self) -> Self {
        let size = Signed::abs(&self);
        if sign.known("`copysign`").is_sign_positive() { size } else { -size }
    }

    fn max(self, other: Self) -> Self {
        self.greatest(other)
    }

    fn min(self, other: Self) -> Self {
        self.least(other)
    }

    fn clamp(self, min: Self, max: Self) -> Self {
        self.greatest(min).least(max)
    }

    fn atan2(self, other: Self) -> Self {
        DualNum::atan2(&self, other)
    }

    fn min_value() -> Option<Self> {
        Some(Self::from_re(f64::MIN))
    }

    fn max_value() -> Option<Self> {
        Some(Self::from_re(f64::MAX))
    }
}
