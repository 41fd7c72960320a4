//! The operations of a tape.

// No variant has the name of a trait such as `Mul`: the compiler would then write the trait with its path in its messages
// about closures.
macro_rules! operations {
    ($($(#[doc = $doc:literal])* $name:ident $code:literal $operands:literal $constant:literal $text:literal,)*) => {
        /// An operation of a tape, on registers `a`, `b`, `c` and a constant `k`.
        ///
        /// A comparison gives 1 or 0, and a condition holds where it is not 0. Comparisons have no slope. The
        /// [`code`](Self::code) of an operation never changes: tapes are written with it.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[repr(u8)]
        #[non_exhaustive]
        pub enum Op {
            $($(#[doc = $doc])* $name = $code,)*
        }

        impl Op {
            /// All operations, in the order of their codes.
            pub const ALL: &[Self] = &[$(Self::$name),*];

            /// Returns the number of registers that it reads.
            #[must_use]
            #[inline]
            pub const fn operands(self) -> usize {
                match self { $(Self::$name => $operands),* }
            }

            /// Returns whether it reads the constant of its instruction.
            #[must_use]
            #[inline]
            pub const fn has_constant(self) -> bool {
                match self { $(Self::$name => $constant),* }
            }

            /// Returns its name in a printed tape.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$name => $text),* }
            }
        }
    };
}

operations! {
    /// The constant `k`.
    Literal 0 0 true "constant",
    /// `−a`.
    Negation 1 1 false "neg",
    /// `1/a`.
    Recip 2 1 false "recip",
    /// `√a`.
    Sqrt 3 1 false "sqrt",
    /// `∛a`.
    Cbrt 4 1 false "cbrt",
    /// `eᵃ`.
    Exp 5 1 false "exp",
    /// `eᵃ − 1`.
    ExpM1 6 1 false "exp_m1",
    /// `ln a`.
    Ln 7 1 false "ln",
    /// `ln(1 + a)`.
    Ln1p 8 1 false "ln_1p",
    /// `sin a`.
    Sin 9 1 false "sin",
    /// `cos a`.
    Cos 10 1 false "cos",
    /// `tan a`.
    Tan 11 1 false "tan",
    /// `arcsin a`.
    Asin 12 1 false "asin",
    /// `arccos a`.
    Acos 13 1 false "acos",
    /// `arctan a`.
    Atan 14 1 false "atan",
    /// `sinh a`.
    Sinh 15 1 false "sinh",
    /// `cosh a`.
    Cosh 16 1 false "cosh",
    /// `tanh a`.
    Tanh 17 1 false "tanh",
    /// `arsinh a`.
    Asinh 18 1 false "asinh",
    /// `arcosh a`.
    Acosh 19 1 false "acosh",
    /// `artanh a`.
    Atanh 20 1 false "atanh",
    /// `|a|`.
    Abs 21 1 false "abs",
    /// The sign of `a`, as [`f64::signum`] has it; its slope is 0.
    Sign 22 1 false "sign",
    /// 1 if `a = 0`, otherwise 0.
    LogicalNot 23 1 false "not",
    /// `a + b`.
    Addition 24 2 false "add",
    /// `a − b`.
    Subtraction 25 2 false "sub",
    /// `a b`.
    Multiplication 26 2 false "mul",
    /// `a / b`.
    Division 27 2 false "div",
    /// `aᵇ`.
    Power 28 2 false "pow",
    /// The angle of the point `(b, a)`, as [`f64::atan2`] has it.
    Atan2 29 2 false "atan2",
    /// `b` if `b < a`, otherwise `a`.
    Min 30 2 false "min",
    /// `b` if `b > a`, otherwise `a`.
    Max 31 2 false "max",
    /// 1 if `a < b`, otherwise 0.
    Less 32 2 false "less",
    /// 1 if `a ≤ b`, otherwise 0.
    LessEqual 33 2 false "less_equal",
    /// 1 if `a = b`, otherwise 0.
    Equal 34 2 false "equal",
    /// 1 if the conditions `a` and `b` hold, otherwise 0.
    LogicalAnd 35 2 false "and",
    /// 1 if the condition `a` or `b` holds, otherwise 0.
    LogicalOr 36 2 false "or",
    /// `a + k`.
    AddConstant 37 1 true "add",
    /// `k − a`.
    ConstantSub 38 1 true "constant_sub",
    /// `a k`.
    Scale 39 1 true "mul",
    /// `a / k`.
    DivConstant 40 1 true "div",
    /// `k / a`.
    ConstantDiv 41 1 true "constant_div",
    /// `aᵏ` with an integer `k`.
    PowI 42 1 true "powi",
    /// `aᵏ`.
    PowF 43 1 true "powf",
    /// `b` if the condition `a` holds, otherwise `c`.
    Select 44 3 false "select",
    /// `a b + c`, rounded twice.
    MultiplyAdd 45 3 false "mul_add",
    /// `a k + b`, rounded twice.
    ScaleAdd 46 2 true "scale_add",
}

impl Op {
    /// Returns the number that stands for it in the parts of a tape.
    #[must_use]
    #[inline]
    pub const fn code(self) -> u32 {
        self as u32
    }

    /// Returns the operation with this number; `None` if there is none.
    #[must_use]
    pub fn from_code(code: u32) -> Option<Self> {
        Self::ALL.get(usize::try_from(code).ok()?).copied()
    }

    /// Returns whether `a` and `b` may change places with the same bits.
    pub(crate) const fn commutes(self) -> bool {
        matches!(
            self,
            Self::Addition
                | Self::Multiplication
                | Self::Equal
                | Self::LogicalAnd
                | Self::LogicalOr
                | Self::MultiplyAdd
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_code_leads_back_to_its_operation() {
        for (code, &op) in (0..).zip(Op::ALL) {
            assert_eq!(op.code(), code);
            assert_eq!(Op::from_code(op.code()), Some(op));
            assert!(op.operands() <= 3);
        }
        assert_eq!(Op::from_code(47), None);
        assert_eq!(Op::from_code(u32::MAX), None);
    }
}
