//! The traits of a dual number.

use num_dual::{DualNum, DualStruct, Mappable};
use num_traits::{FloatConst, FromPrimitive, Inv, Num, One, ParseFloatError, Signed, Zero};

use crate::tape::exponent;
use crate::{Op, Recorded, book};

impl Inv for Recorded {
    type Output = Self;
    fn inv(self) -> Self {
        DualNum::recip(&self)
    }
}

impl Zero for Recorded {
    fn zero() -> Self {
        Self::from_re(0.0)
    }

    #[track_caller]
    fn is_zero(&self) -> bool {
        self.known("`is_zero`") == 0.0
    }
}

impl One for Recorded {
    fn one() -> Self {
        Self::from_re(1.0)
    }

    #[track_caller]
    #[expect(clippy::float_cmp, reason = "the function asks for equal values")]
    fn is_one(&self) -> bool {
        self.known("`is_one`") == 1.0
    }
}

impl Num for Recorded {
    type FromStrRadixErr = ParseFloatError;

    fn from_str_radix(text: &str, radix: u32) -> Result<Self, ParseFloatError> {
        f64::from_str_radix(text, radix).map(Self::from_re)
    }
}

impl Signed for Recorded {
    fn abs(&self) -> Self {
        self.unary(Op::Abs, self.value.abs())
    }

    #[track_caller]
    fn abs_sub(&self, other: &Self) -> Self {
        let is_more = self.known("`abs_sub`") > other.known("`abs_sub`");
        if is_more { *self - *other } else { Self::from_re(0.0) }
    }

    fn signum(&self) -> Self {
        self.unary(Op::Sign, self.value.signum())
    }

    #[track_caller]
    fn is_positive(&self) -> bool {
        self.known("`is_positive`").is_sign_positive()
    }

    #[track_caller]
    fn is_negative(&self) -> bool {
        self.known("`is_negative`").is_sign_negative()
    }
}

impl FromPrimitive for Recorded {
    fn from_i64(n: i64) -> Option<Self> {
        f64::from_i64(n).map(Self::from_re)
    }

    fn from_u64(n: u64) -> Option<Self> {
        f64::from_u64(n).map(Self::from_re)
    }

    fn from_f64(n: f64) -> Option<Self> {
        Some(Self::from_re(n))
    }
}

macro_rules! numbers {
    ($($name:ident)*) => {
        impl FloatConst for Recorded {
            $(fn $name() -> Self {
                Self::from_re(f64::$name())
            })*
        }
    };
}

numbers!(E FRAC_1_PI FRAC_1_SQRT_2 FRAC_2_PI FRAC_2_SQRT_PI FRAC_PI_2 FRAC_PI_3 FRAC_PI_4 FRAC_PI_6
    FRAC_PI_8 LN_10 LN_2 LOG10_E LOG2_E PI SQRT_2);

impl DualStruct for Recorded {
    type Real = f64;
    type Inner = f64;

    #[track_caller]
    fn re(&self) -> f64 {
        self.known("`re`")
    }

    fn from_inner(inner: &f64) -> Self {
        Self::from_re(*inner)
    }
}

impl Mappable<Self> for Recorded {
    type Output<O> = O;

    fn map_dual<M: Fn(Self) -> O, O>(self, f: M) -> O {
        f(self)
    }
}

macro_rules! elementary {
    ($($name:ident $op:ident),* $(,)?) => {
        $(fn $name(&self) -> Self {
            self.unary(Op::$op, f64::$name(self.value))
        })*
    };
}

impl DualNum for Recorded {
    type Primitive = f64;
    type InnerDual = f64;

    const NDERIV: usize = 0;

    fn from_re(value: f64) -> Self {
        Self::from_re(value)
    }

    fn scale(self, factor: &f64) -> Self {
        self * *factor
    }

    elementary! {
        recip Recip, sqrt Sqrt, cbrt Cbrt, exp Exp, exp_m1 ExpM1, ln Ln, ln_1p Ln1p,
        sin Sin, cos Cos, tan Tan, asin Asin, acos Acos, atan Atan,
        sinh Sinh, cosh Cosh, tanh Tanh, asinh Asinh, acosh Acosh, atanh Atanh,
    }

    fn powi(&self, n: i32) -> Self {
        let value = self.value.powi(n);
        let k = f64::from(n);
        let op = if exponent(k).is_some() { Op::PowI } else { Op::PowF };
        self.with_constant(op, k, value)
    }

    fn powf(&self, n: f64) -> Self {
        self.with_constant(Op::PowF, n, self.value.powf(n))
    }

    fn powd(&self, n: Self) -> Self {
        self.binary(Op::Power, n, self.value.powf(n.value))
    }

    fn exp2(&self) -> Self {
        (*self * f64::LN_2()).exp()
    }

    fn log(&self, base: f64) -> Self {
        self.ln() / base.ln()
    }

    fn log2(&self) -> Self {
        self.ln() / f64::LN_2()
    }

    fn log10(&self) -> Self {
        self.ln() / f64::LN_10()
    }

    fn sin_cos(&self) -> (Self, Self) {
        (self.sin(), self.cos())
    }

    fn atan2(&self, other: Self) -> Self {
        self.binary(Op::Atan2, other, self.value.atan2(other.value))
    }

    #[track_caller]
    fn sph_j0(&self) -> Self {
        Self::from_re(DualNum::sph_j0(&self.known(BESSEL)))
    }

    #[track_caller]
    fn sph_j1(&self) -> Self {
        Self::from_re(DualNum::sph_j1(&self.known(BESSEL)))
    }

    #[track_caller]
    fn sph_j2(&self) -> Self {
        Self::from_re(DualNum::sph_j2(&self.known(BESSEL)))
    }

    fn mul_add(&self, a: Self, b: Self) -> Self {
        if [*self, a, b].into_iter().any(Self::is_constant) {
            return *self * a + b;
        }
        book::put(Op::MultiplyAdd, &[*self, a, b], 0.0, self.value * a.value + b.value)
    }
}

/// These series branch near zero.
const BESSEL: &str = "a spherical Bessel function";
