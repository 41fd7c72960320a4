//! A function as a list of instructions.

use std::fmt;

use thiserror::Error;

use crate::Op;

/// The largest number of registers of a tape, inputs and instructions together: a sweep back of that many holds 256 MiB.
///
/// A factor of four fails `src/tape.rs::a_tape_has_at_most_so_many_registers`.
pub const MOST_REGISTERS: usize = 1 << 24;

/// The largest exponent of [`Op::PowI`], with either sign: the third derivative of a power has the factor
/// `k (k − 1)(k − 2)`, which the dual numbers form as an `i32`.
///
/// A factor of four fails `src/tape.rs::an_exponent_is_a_small_integer`.
pub const MOST_EXPONENT: i32 = 1024;

/// One instruction: an operation, the registers that it reads, and its constant. What it does not read is 0.
#[derive(Clone, Copy, Debug)]
pub struct Instruction {
    /// The operation.
    pub op: Op,
    /// The registers `a`, `b`, `c`.
    pub operands: [u32; 3],
    /// The constant `k`.
    pub constant: f64,
}

impl Instruction {
    /// The registers that it reads.
    pub fn reads(&self) -> &[u32] {
        &self.operands[..self.op.operands()]
    }
}

/// Two instructions are equal if their constants have the same bits.
impl PartialEq for Instruction {
    fn eq(&self, other: &Self) -> bool {
        self.op == other.op
            && self.operands == other.operands
            && self.constant.to_bits() == other.constant.to_bits()
    }
}

impl Eq for Instruction {}

impl fmt::Display for Instruction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}(", self.op.name())?;
        for (k, register) in self.reads().iter().enumerate() {
            write!(f, "{}r{register}", if k > 0 { ", " } else { "" })?;
        }
        if self.op.has_constant() {
            write!(f, "{}{:?}", if self.op.operands() > 0 { ", " } else { "" }, self.constant)?;
        }
        f.write_str(")")
    }
}

/// A function `Rⁿ → Rᵐ` as a list of instructions: a *tape*, or Wengert list (Wengert 1964).
///
/// The registers `r0 … r(n−1)` are the inputs, and each instruction defines the next one from registers before it. There
/// are no jumps, so that a sweep forward evaluates the function, and a sweep back from an output forms its gradient
/// at a cost that does not grow with `n` (Griewank and Walther 2008, §3.2):
///
/// ```math
/// r_k = \varphi_k(r_a, r_b, r_c), \qquad \bar r_a \mathrel{+}= \bar r_k \, \partial\varphi_k/\partial r_a .
/// ```
///
/// A sweep needs room for its registers. Each thread keeps it for the next sweep, so that only the first one allocates.
///
/// # Examples
///
/// ```
/// use metriplectic_recording::{Op, Tape};
/// // x y + sin x
/// let code = [(Op::Sin.code(), [0, 0, 0], 0.0), (Op::MultiplyAdd.code(), [0, 1, 2], 0.0)];
/// let tape = Tape::from_parts(2, code, vec![3])?;
/// let mut slope = [0.0; 2];
/// assert_eq!(tape.gradient(&[0.0, 3.0], &mut slope), 0.0);
/// assert_eq!(slope, [4.0, 0.0]);
/// assert_eq!(tape.to_string(), "r2 = sin(r0)\nr3 = mul_add(r0, r1, r2)\nreturn r3");
/// # Ok::<(), metriplectic_recording::TapeError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tape {
    inputs: usize,
    code: Vec<Instruction>,
    outputs: Vec<u32>,
}

/// A tape as plain numbers: the inputs, each instruction with the code of its operation, its registers and its constant,
/// and the registers of the outputs.
pub type Parts = (usize, Vec<(u32, [u32; 3], f64)>, Vec<u32>);

impl Tape {
    /// Makes a tape from plain numbers, the inverse of [`to_parts`](Self::to_parts).
    ///
    /// Constants may be any numbers, also infinite or NaN. A register or constant that an operation does not read
    /// must be 0.
    ///
    /// # Errors
    ///
    /// The first number that makes no sense, as a [`TapeError`].
    pub fn from_parts(
        inputs: usize,
        code: impl IntoIterator<Item = (u32, [u32; 3], f64)>,
        outputs: Vec<u32>,
    ) -> Result<Self, TapeError> {
        let code = code.into_iter();
        let most = MOST_REGISTERS.saturating_sub(inputs);
        let mut list = Vec::with_capacity(code.size_hint().0.min(most));
        for (instruction, (number, operands, constant)) in code.enumerate() {
            if instruction == most {
                return Err(TapeError::TooLarge);
            }
            let op = Op::from_code(number)
                .ok_or(TapeError::UnknownOperation { instruction, code: number })?;
            let one = Instruction { op, operands, constant };
            one.check(instruction, inputs + instruction)?;
            list.push(one);
        }
        Self::new(inputs, list, outputs)
    }

    /// Makes a tape of instructions that are right one by one.
    pub(crate) fn new(
        inputs: usize,
        code: Vec<Instruction>,
        outputs: Vec<u32>,
    ) -> Result<Self, TapeError> {
        let tape = Self { inputs, code, outputs };
        let registers = tape.inputs.saturating_add(tape.code.len());
        if registers > MOST_REGISTERS || tape.outputs.len() > MOST_REGISTERS {
            return Err(TapeError::TooLarge);
        }
        let wrong = tape.outputs.iter().position(|&register| register as usize >= registers);
        if let Some(output) = wrong {
            return Err(TapeError::Output { output, register: tape.outputs[output], registers });
        }
        Ok(tape)
    }

    /// Lists the tape as plain numbers, from which [`from_parts`](Self::from_parts) makes it anew with the same bits.
    #[must_use]
    pub fn to_parts(&self) -> Parts {
        let part = |one: &Instruction| (one.op.code(), one.operands, one.constant);
        (self.inputs, self.code.iter().map(part).collect(), self.outputs.clone())
    }

    /// The number `n` of inputs.
    #[must_use]
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// The instructions.
    #[must_use]
    pub fn code(&self) -> &[Instruction] {
        &self.code
    }

    /// The registers of the `m` outputs.
    #[must_use]
    pub fn outputs(&self) -> &[u32] {
        &self.outputs
    }

    /// The number of registers, inputs and instructions together.
    #[must_use]
    pub fn registers(&self) -> usize {
        self.inputs + self.code.len()
    }
}

impl Instruction {
    /// Checks an instruction that may read the first `defined` registers.
    fn check(&self, instruction: usize, defined: usize) -> Result<(), TapeError> {
        let op = self.op;
        if let Some(&register) = self.reads().iter().find(|&&register| register as usize >= defined)
        {
            return Err(TapeError::ReadsAhead { instruction, register, defined });
        }
        let rest = &self.operands[op.operands()..];
        let constant_is_0 = self.constant.to_bits() == 0;
        if rest.iter().any(|&register| register != 0) || (!op.has_constant() && !constant_is_0) {
            let (operation, operands) = (op.name(), op.operands());
            return Err(TapeError::Unused { instruction, operation, operands });
        }
        if op == Op::PowI && exponent(self.constant).is_none() {
            return Err(TapeError::Exponent { instruction, exponent: self.constant });
        }
        Ok(())
    }
}

/// Returns the exponent of [`Op::PowI`] as an integer; `None` if it is none, or beyond [`MOST_EXPONENT`].
pub(crate) fn exponent(k: f64) -> Option<i32> {
    // A conversion by `as` rounds towards zero and stays within the bounds of an `i32`.
    #[expect(clippy::cast_possible_truncation, reason = "it is compared with the number")]
    let integer = k as i32;
    let is_same = f64::from(integer).to_bits() == k.to_bits();
    (is_same && integer.unsigned_abs() <= MOST_EXPONENT.unsigned_abs()).then_some(integer)
}

impl fmt::Display for Tape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, instruction) in self.code.iter().enumerate() {
            writeln!(f, "r{} = {instruction}", self.inputs + k)?;
        }
        f.write_str("return")?;
        for (k, register) in self.outputs.iter().enumerate() {
            write!(f, "{} r{register}", if k > 0 { "," } else { "" })?;
        }
        Ok(())
    }
}

/// A list of numbers that is no tape.
#[derive(Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum TapeError {
    /// More than [`MOST_REGISTERS`] inputs and instructions, or outputs.
    #[error(
        "a tape has at most {MOST_REGISTERS} registers, inputs and instructions together: record a part of the function, or write it with fewer operations"
    )]
    TooLarge,
    /// A number that stands for no operation.
    #[error(
        "instruction {instruction} has the operation {code}: the operations are 0 to {}",
        Op::ALL.len() - 1
    )]
    UnknownOperation {
        /// The place of the instruction.
        instruction: usize,
        /// The number.
        code: u32,
    },
    /// A register that is read before it is defined.
    #[error(
        "instruction {instruction} reads register {register}, and only {defined} registers are defined before it: put the instruction that defines it first"
    )]
    ReadsAhead {
        /// The place of the instruction.
        instruction: usize,
        /// The register.
        register: u32,
        /// The number of registers before the instruction.
        defined: usize,
    },
    /// A register or a constant that the operation does not read, and that is not 0.
    #[error(
        "instruction {instruction} says more than `{operation}` reads, which is {operands} of three registers: set the rest, and a constant that it does not read, to 0"
    )]
    Unused {
        /// The place of the instruction.
        instruction: usize,
        /// The name of the operation.
        operation: &'static str,
        /// The number of registers that the operation reads.
        operands: usize,
    },
    /// An exponent of [`Op::PowI`] that is no integer, or too large.
    #[error(
        "instruction {instruction} has the exponent {exponent}: `powi` takes integers up to ±{MOST_EXPONENT}, and `powf` any number"
    )]
    Exponent {
        /// The place of the instruction.
        instruction: usize,
        /// The exponent.
        exponent: f64,
    },
    /// An output that no instruction defines.
    #[error(
        "output {output} is register {register}, and the tape has {registers} registers: name one below {registers}"
    )]
    Output {
        /// The place of the output.
        output: usize,
        /// The register.
        register: u32,
        /// The number of registers.
        registers: usize,
    },
}

metriplectic_equations::debug_is_the_sentence!(TapeError);

#[cfg(test)]
mod tests {
    use super::*;

    fn one(op: Op, operands: [u32; 3], constant: f64) -> Result<Tape, TapeError> {
        Tape::from_parts(2, [(op.code(), operands, constant)], vec![2])
    }

    #[test]
    fn what_is_no_tape_is_refused() {
        let found = Tape::from_parts(1, [(1000, [0, 0, 0], 0.0)], vec![]);
        assert_eq!(found, Err(TapeError::UnknownOperation { instruction: 0, code: 1000 }));
        let ahead = TapeError::ReadsAhead { instruction: 0, register: 2, defined: 2 };
        assert_eq!(one(Op::Addition, [0, 2, 0], 0.0), Err(ahead));
        let unused = TapeError::Unused { instruction: 0, operation: "exp", operands: 1 };
        assert_eq!(one(Op::Exp, [0, 1, 0], 0.0), Err(unused));
        assert_eq!(one(Op::Exp, [0, 0, 0], 1.0), Err(unused));
        assert!(one(Op::Scale, [1, 0, 0], f64::NAN).is_ok());
        let found = Tape::from_parts(2, [], vec![0, 2]);
        assert_eq!(found, Err(TapeError::Output { output: 1, register: 2, registers: 2 }));
        let message = ahead.to_string();
        assert!(message.contains("reads register 2, and only 2 registers"), "{message}");
    }

    #[test]
    fn an_exponent_is_a_small_integer() {
        for exponent in [0.0, 3.0, -7.0, 1024.0, -1024.0] {
            assert!(one(Op::PowI, [0; 3], exponent).is_ok(), "{exponent}");
        }
        for exponent in [0.5, f64::NAN, f64::INFINITY, 1025.0, -1025.0, -0.0, 1e300] {
            assert!(one(Op::PowI, [0; 3], exponent).is_err(), "{exponent}");
        }
    }

    #[test]
    fn a_tape_has_at_most_so_many_registers() {
        const MOST: usize = 1 << 24;
        assert!(Tape::from_parts(MOST, [], vec![0]).is_ok());
        let constant = (Op::Literal.code(), [0; 3], 0.0);
        for inputs in [MOST, MOST + 1, usize::MAX] {
            assert_eq!(Tape::from_parts(inputs, [constant], vec![0]), Err(TapeError::TooLarge));
        }
        let endless = std::iter::repeat(constant);
        assert_eq!(Tape::from_parts(MOST - 9, endless, vec![]), Err(TapeError::TooLarge));
    }

    #[test]
    fn parts_and_text_say_all_of_a_tape() {
        let code = [
            (Op::Literal.code(), [0, 0, 0], f64::from_bits(0x7ff8_0000_0000_1234)),
            (Op::Select.code(), [1, 0, 2], 0.0),
            (Op::ScaleAdd.code(), [3, 2, 0], 0.1),
        ];
        let tape = Tape::from_parts(2, code, vec![4, 0]).unwrap();
        let (inputs, code, outputs) = tape.to_parts();
        assert_eq!(Tape::from_parts(inputs, code, outputs), Ok(tape.clone()));
        let text = "r2 = constant(NaN)\nr3 = select(r1, r0, r2)\nr4 = scale_add(r3, r2, 0.1)\nreturn r4, r0";
        assert_eq!(tape.to_string(), text);
    }
}
