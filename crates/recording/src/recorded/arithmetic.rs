//! Sums, products and comparisons, between all the forms of operands that a dual number has.

use std::cmp::Ordering;
use std::iter::{Product, Sum};
use std::ops::{
    Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Rem, RemAssign, Sub, SubAssign,
};

use crate::{Op, Recorded};

impl Recorded {
    fn plus(self, other: Self) -> Self {
        let value = self.value + other.value;
        match (self.is_constant(), other.is_constant()) {
            (false, true) => self.with_constant(Op::AddConstant, other.value, value),
            (true, false) => other.with_constant(Op::AddConstant, self.value, value),
            _ => self.binary(Op::Addition, other, value),
        }
    }

    fn minus(self, other: Self) -> Self {
        let value = self.value - other.value;
        match (self.is_constant(), other.is_constant()) {
            (false, true) => self.with_constant(Op::AddConstant, -other.value, value),
            (true, false) => other.with_constant(Op::ConstantSub, self.value, value),
            _ => self.binary(Op::Subtraction, other, value),
        }
    }

    fn times(self, other: Self) -> Self {
        let value = self.value * other.value;
        match (self.is_constant(), other.is_constant()) {
            (false, true) => self.with_constant(Op::Scale, other.value, value),
            (true, false) => other.with_constant(Op::Scale, self.value, value),
            _ => self.binary(Op::Multiplication, other, value),
        }
    }

    fn over(self, other: Self) -> Self {
        let value = self.value / other.value;
        match (self.is_constant(), other.is_constant()) {
            (false, true) => self.with_constant(Op::DivConstant, other.value, value),
            (true, false) => other.with_constant(Op::ConstantDiv, self.value, value),
            _ => self.binary(Op::Division, other, value),
        }
    }

    /// The remainder has no instruction: dual numbers have none.
    #[track_caller]
    fn modulo(self, other: Self) -> Self {
        Self::from_re(self.known("the remainder `%`") % other.known("the remainder `%`"))
    }
}

macro_rules! operators {
    ($($tr:ident $method:ident $f:ident $assign:ident $assign_method:ident;)*) => {$(
        impl $tr for Recorded {
            type Output = Self;
            #[track_caller]
            fn $method(self, other: Self) -> Self {
                self.$f(other)
            }
        }

        impl $tr<&Self> for Recorded {
            type Output = Self;
            #[track_caller]
            fn $method(self, other: &Self) -> Self {
                self.$f(*other)
            }
        }

        impl $tr<Recorded> for &Recorded {
            type Output = Recorded;
            #[track_caller]
            fn $method(self, other: Recorded) -> Recorded {
                self.$f(other)
            }
        }

        impl $tr for &Recorded {
            type Output = Recorded;
            #[track_caller]
            fn $method(self, other: Self) -> Recorded {
                self.$f(*other)
            }
        }

        impl $tr<f64> for Recorded {
            type Output = Self;
            #[track_caller]
            fn $method(self, other: f64) -> Self {
                self.$f(Self::from_re(other))
            }
        }

        impl $assign for Recorded {
            #[track_caller]
            fn $assign_method(&mut self, other: Self) {
                *self = self.$f(other);
            }
        }

        impl $assign<f64> for Recorded {
            #[track_caller]
            fn $assign_method(&mut self, other: f64) {
                *self = self.$f(Self::from_re(other));
            }
        }
    )*};
}

operators! {
    Add add plus AddAssign add_assign;
    Sub sub minus SubAssign sub_assign;
    Mul mul times MulAssign mul_assign;
    Div div over DivAssign div_assign;
    Rem rem modulo RemAssign rem_assign;
}

impl Neg for Recorded {
    type Output = Self;
    fn neg(self) -> Self {
        self.unary(Op::Negation, -self.value)
    }
}

impl Neg for &Recorded {
    type Output = Recorded;
    fn neg(self) -> Recorded {
        -*self
    }
}

impl Sum for Recorded {
    fn sum<I: Iterator<Item = Self>>(numbers: I) -> Self {
        numbers.fold(Self::from_re(0.0), Self::plus)
    }
}

impl<'a> Sum<&'a Self> for Recorded {
    fn sum<I: Iterator<Item = &'a Self>>(numbers: I) -> Self {
        numbers.copied().sum()
    }
}

impl Product for Recorded {
    fn product<I: Iterator<Item = Self>>(numbers: I) -> Self {
        numbers.fold(Self::from_re(1.0), Self::times)
    }
}

impl<'a> Product<&'a Self> for Recorded {
    fn product<I: Iterator<Item = &'a Self>>(numbers: I) -> Self {
        numbers.copied().product()
    }
}

const COMPARISON: &str = "a comparison";

impl PartialEq for Recorded {
    #[track_caller]
    fn eq(&self, other: &Self) -> bool {
        self.known(COMPARISON) == other.known(COMPARISON)
    }
}

impl PartialEq<f64> for Recorded {
    #[track_caller]
    fn eq(&self, other: &f64) -> bool {
        self.known(COMPARISON) == *other
    }
}

macro_rules! comparisons {
    ($($other:ty, $value:expr;)*) => {$(
        // The provided methods would ask for themselves, and not for the line of the function.
        impl PartialOrd<$other> for Recorded {
            #[track_caller]
            fn partial_cmp(&self, other: &$other) -> Option<Ordering> {
                self.known(COMPARISON).partial_cmp(&$value(other))
            }

            #[track_caller]
            fn lt(&self, other: &$other) -> bool {
                self.known(COMPARISON) < $value(other)
            }

            #[track_caller]
            fn le(&self, other: &$other) -> bool {
                self.known(COMPARISON) <= $value(other)
            }

            #[track_caller]
            fn gt(&self, other: &$other) -> bool {
                self.known(COMPARISON) > $value(other)
            }

            #[track_caller]
            fn ge(&self, other: &$other) -> bool {
                self.known(COMPARISON) >= $value(other)
            }
        }
    )*};
}

comparisons! {
    Self, |other: &Self| other.known(COMPARISON);
    f64, |other: &f64| *other;
}
