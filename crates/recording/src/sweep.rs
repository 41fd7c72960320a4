//! Sweeps along a tape: forward for values, back for gradients.

use std::cell::Cell;
use std::cmp::Ordering;

use metriplectic_fields::Scalar;
use num_traits::Signed;

use crate::tape::Instruction;
use crate::{Op, Tape, room};

/// 1 or 0.
#[inline]
fn flag<D: Scalar>(holds: bool) -> D {
    D::from(if holds { 1.0 } else { 0.0 })
}

/// Returns whether a condition holds.
#[inline]
fn holds<D: Scalar>(condition: &D) -> bool {
    condition.re() != 0.0
}

/// Evaluates one instruction on the registers before it.
#[inline(always)]
pub(crate) fn evaluate<D: Scalar>(instruction: &Instruction, r: &[D]) -> D {
    let &Instruction { op, operands: [a, b, c], constant: k } = instruction;
    let [a, b, c] = [a as usize, b as usize, c as usize];
    match op {
        Op::Literal => D::from(k),
        Op::Negation => -r[a],
        Op::Recip => r[a].recip(),
        Op::Sqrt => r[a].sqrt(),
        Op::Cbrt => r[a].cbrt(),
        Op::Exp => r[a].exp(),
        Op::ExpM1 => r[a].exp_m1(),
        Op::Ln => r[a].ln(),
        Op::Ln1p => r[a].ln_1p(),
        Op::Sin => r[a].sin(),
        Op::Cos => r[a].cos(),
        Op::Tan => r[a].tan(),
        Op::Asin => r[a].asin(),
        Op::Acos => r[a].acos(),
        Op::Atan => r[a].atan(),
        Op::Sinh => r[a].sinh(),
        Op::Cosh => r[a].cosh(),
        Op::Tanh => r[a].tanh(),
        Op::Asinh => r[a].asinh(),
        Op::Acosh => r[a].acosh(),
        Op::Atanh => r[a].atanh(),
        Op::Abs => Signed::abs(&r[a]),
        Op::Sign => D::from(r[a].re().signum()),
        Op::LogicalNot => flag(!holds(&r[a])),
        Op::Addition => r[a] + r[b],
        Op::Subtraction => r[a] - r[b],
        Op::Multiplication => r[a] * r[b],
        Op::Division => r[a] / r[b],
        Op::Power => r[a].powd(r[b]),
        Op::Atan2 => r[a].atan2(r[b]),
        Op::Min | Op::Max => r[if is_chosen_first(instruction, r) { a } else { b }],
        Op::Less => flag(r[a].re() < r[b].re()),
        Op::LessEqual => flag(r[a].re() <= r[b].re()),
        Op::Equal => flag(is_equal(&r[a], &r[b])),
        Op::LogicalAnd => flag(holds(&r[a]) && holds(&r[b])),
        Op::LogicalOr => flag(holds(&r[a]) || holds(&r[b])),
        Op::AddConstant => r[a] + k,
        Op::ConstantSub => -r[a] + k,
        Op::Scale => r[a] * k,
        Op::DivConstant => r[a] / k,
        Op::ConstantDiv => D::from(k) / r[a],
        Op::PowI => r[a].powi(integer(k)),
        Op::PowF => r[a].powf(k),
        Op::Select => r[if is_chosen_first(instruction, r) { b } else { c }],
        Op::MultiplyAdd => r[a] * r[b] + r[c],
        Op::ScaleAdd => r[a] * k + r[b],
    }
}

/// Returns whether [`Op::Min`], [`Op::Max`] and [`Op::Select`] give the first of their two alternatives.
#[inline]
pub(crate) fn is_chosen_first<D: Scalar>(instruction: &Instruction, r: &[D]) -> bool {
    let [a, b, _] = instruction.operands.map(|register| register as usize);
    match instruction.op {
        Op::Min => r[b].re().partial_cmp(&r[a].re()) != Some(Ordering::Less),
        Op::Max => r[b].re().partial_cmp(&r[a].re()) != Some(Ordering::Greater),
        _ => holds(&r[a]),
    }
}

#[inline]
#[expect(clippy::float_cmp, reason = "the operation asks for equal values")]
fn is_equal<D: Scalar>(a: &D, b: &D) -> bool {
    a.re() == b.re()
}

/// The exponent of a power, which is an `i32`.
#[inline]
#[expect(clippy::cast_possible_truncation, reason = "`Instruction::check` admits integers alone")]
pub(crate) fn integer(k: f64) -> i32 {
    k as i32
}

/// Adds the weight `w` of an instruction with the result `y` to those of its operands: `w̄_a += w ∂y/∂a`.
#[inline(always)]
fn pull_back(instruction: &Instruction, r: &[f64], y: f64, w: f64, bar: &[Cell<f64>]) {
    let &Instruction { op, operands: [a, b, c], constant: k } = instruction;
    let [a, b, c] = [a as usize, b as usize, c as usize];
    let add = |register: usize, part: f64| bar[register].set(bar[register].get() + part);
    match op {
        Op::Literal
        | Op::Sign
        | Op::LogicalNot
        | Op::Less
        | Op::LessEqual
        | Op::Equal
        | Op::LogicalAnd
        | Op::LogicalOr => {}
        Op::Negation | Op::ConstantSub => add(a, -w),
        Op::Recip => add(a, -(w * (y * y))),
        Op::Sqrt => add(a, w * 0.5 / y),
        Op::Cbrt => add(a, w / (y * y * 3.0)),
        Op::Exp => add(a, w * y),
        // y + 1 has no digits where y is near −1.
        Op::ExpM1 => add(a, w * r[a].exp()),
        Op::Ln => add(a, w / r[a]),
        Op::Ln1p => add(a, w / (r[a] + 1.0)),
        Op::Sin => add(a, w * r[a].cos()),
        Op::Cos => add(a, -(w * r[a].sin())),
        Op::Tan => add(a, w * (y * y + 1.0)),
        Op::Asin => add(a, w / ((1.0 - r[a]) * (1.0 + r[a])).sqrt()),
        Op::Acos => add(a, -(w / ((1.0 - r[a]) * (1.0 + r[a])).sqrt())),
        Op::Atan => add(a, w / (r[a] * r[a] + 1.0)),
        Op::Sinh => add(a, w * r[a].cosh()),
        Op::Cosh => add(a, w * r[a].sinh()),
        // 1 − y² has no digits where y is near 1.
        Op::Tanh => {
            let cosh = r[a].cosh();
            add(a, w / (cosh * cosh));
        }
        Op::Asinh => add(a, w / (r[a] * r[a] + 1.0).sqrt()),
        Op::Acosh => add(a, w / ((r[a] - 1.0) * (r[a] + 1.0)).sqrt()),
        Op::Atanh => add(a, w / ((1.0 - r[a]) * (1.0 + r[a]))),
        Op::Abs => {
            if r[a].is_sign_positive() {
                add(a, w);
            } else {
                add(a, -w);
            }
        }
        Op::Addition => {
            add(a, w);
            add(b, w);
        }
        Op::Subtraction => {
            add(a, w);
            add(b, -w);
        }
        Op::Multiplication => {
            add(a, w * r[b]);
            add(b, w * r[a]);
        }
        Op::Division => {
            let quotient = w / r[b];
            add(a, quotient);
            add(b, -(quotient * y));
        }
        Op::Power => {
            add(a, w * r[b] * r[a].powf(r[b] - 1.0));
            // 0ᵇ = 0 for all b > 0, and ln 0 is infinite.
            if r[a] != 0.0 {
                add(b, w * y * r[a].ln());
            }
        }
        Op::Atan2 => {
            let q = w / (r[a] * r[a] + r[b] * r[b]);
            add(a, q * r[b]);
            add(b, -(q * r[a]));
        }
        Op::Min | Op::Max => add(if is_chosen_first(instruction, r) { a } else { b }, w),
        Op::AddConstant => add(a, w),
        Op::Scale => add(a, w * k),
        Op::DivConstant => add(a, w / k),
        Op::ConstantDiv => add(a, -(w * y / r[a])),
        Op::PowI => {
            let n = integer(k);
            if n != 0 {
                add(a, w * r[a].powi(n - 1) * k);
            }
        }
        Op::PowF => {
            if k != 0.0 {
                add(a, w * r[a].powf(k - 1.0) * k);
            }
        }
        Op::Select => add(if is_chosen_first(instruction, r) { b } else { c }, w),
        Op::MultiplyAdd => {
            add(a, w * r[b]);
            add(b, w * r[a]);
            add(c, w);
        }
        Op::ScaleAdd => {
            add(a, w * k);
            add(b, w);
        }
    }
}

impl Tape {
    /// Evaluates all registers from the inputs that `fill` writes.
    #[inline]
    pub(crate) fn forward<D: Scalar>(&self, r: &mut Vec<D>, fill: impl FnOnce(&mut [D])) {
        let n = self.inputs();
        r.resize(self.registers(), D::zero());
        fill(&mut r[..n]);
        for (k, instruction) in self.code().iter().enumerate() {
            let y = evaluate(instruction, r);
            r[n + k] = y;
        }
    }

    /// Goes back from the weights of the outputs to those of all registers.
    ///
    /// An instruction of weight zero is left out: nobody reads it, or only a branch that is not taken, and its slope may
    /// be infinite.
    #[inline]
    pub(crate) fn backward(&self, r: &[f64], bar: &mut Vec<f64>, weigh: impl FnOnce(&mut [f64])) {
        let n = self.inputs();
        bar.clear();
        bar.resize(r.len(), 0.0);
        weigh(bar);
        // Cells, because the weight of the result is read beside those that are written.
        let bar = Cell::from_mut(bar.as_mut_slice()).as_slice_of_cells();
        let results = r[n..].iter().zip(&bar[n..]);
        for (instruction, (&y, w)) in self.code().iter().zip(results).rev() {
            let w = w.get();
            if w != 0.0 {
                pull_back(instruction, r, y, w, bar);
            }
        }
    }

    /// Panics unless there is one number for each input and output.
    #[track_caller]
    fn assert_lengths(&self, x: usize, y: usize) {
        assert_eq!(x, self.inputs(), "a tape takes one number for each of its inputs");
        assert_eq!(y, self.outputs().len(), "a tape gives one number for each of its outputs");
    }

    /// Evaluates the outputs `y = f(x)` at any scalar, by one sweep forward.
    ///
    /// # Panics
    ///
    /// If `x` or `y` has not as many numbers as there are inputs or outputs.
    pub fn evaluate<D: Scalar>(&self, x: &[D], y: &mut [D]) {
        self.assert_lengths(x.len(), y.len());
        room::with(|room| {
            self.forward(&mut room.values, |inputs| inputs.copy_from_slice(x));
            for (y, &register) in y.iter_mut().zip(self.outputs()) {
                *y = room.values[register as usize];
            }
        });
    }

    /// Computes `f(x)` for a tape of one output.
    ///
    /// # Panics
    ///
    /// If `x` has not as many numbers as there are inputs, or if there is not one output.
    #[must_use]
    pub fn value(&self, x: &[f64]) -> f64 {
        let mut y = [f64::NAN];
        self.evaluate(x, &mut y);
        y[0]
    }

    /// Computes `f(x)` and writes its gradient `∂f/∂x_i` for a tape of one output, by one sweep forward and one back.
    ///
    /// # Panics
    ///
    /// If `x` or `df` has not as many numbers as there are inputs, or if there is not one output.
    pub fn gradient(&self, x: &[f64], df: &mut [f64]) -> f64 {
        let mut y = [f64::NAN];
        self.pull_back(x, &[1.0], &mut y, df);
        y[0]
    }

    /// Evaluates the outputs `y = f(x)` and writes `Σ_j w_j ∂f_j/∂x_i` for weights `w` of the outputs, by one sweep forward and
    /// one back.
    ///
    /// # Panics
    ///
    /// If a list has not as many numbers as there are inputs or outputs.
    pub fn pull_back(&self, x: &[f64], w: &[f64], y: &mut [f64], df: &mut [f64]) {
        self.assert_lengths(x.len(), y.len());
        self.assert_lengths(df.len(), w.len());
        room::with(|room| {
            self.forward(&mut room.values, |inputs| inputs.copy_from_slice(x));
            let weigh = |bar: &mut [f64]| {
                for (&register, w) in self.outputs().iter().zip(w) {
                    bar[register as usize] += w;
                }
            };
            self.backward(&room.values, &mut room.weights, weigh);
            for (y, &register) in y.iter_mut().zip(self.outputs()) {
                *y = room.values[register as usize];
            }
            df.copy_from_slice(&room.weights[..self.inputs()]);
        });
    }

    /// Computes `f(x)`, and writes the gradient `df` and its derivative `Hf v` along `v`, for a tape of one output: the
    /// derivative of a sweep forward and one back along `v` (Griewank and Walther 2008, §3.4).
    ///
    /// # Panics
    ///
    /// If a list has not as many numbers as there are inputs, or if there is not one output.
    pub fn gradient_along(&self, x: &[f64], v: &[f64], df: &mut [f64], hv: &mut [f64]) -> f64 {
        for list in [x, v, df, hv] {
            self.assert_lengths(list.len(), 1);
        }
        self.second_order(
            |inputs| inputs.copy_from_slice(x),
            |at| {
                df.copy_from_slice(at.gradient());
                let seed = |_, put: &mut dyn FnMut(usize, f64)| {
                    v.iter().enumerate().for_each(|(input, &v)| put(input, v));
                };
                at.along(1, seed, |_, column| hv.copy_from_slice(column));
                at.value()
            },
        )
    }

    /// Computes `f(x)`, and writes the gradient and the Hessian row by row, for a tape of one output: the derivatives of
    /// a sweep forward and one back along all inputs, several at a time.
    ///
    /// # Panics
    ///
    /// If `x` and `df` have not as many numbers as there are inputs, `hf` not its square, or if there is not one output.
    pub fn hessian(&self, x: &[f64], df: &mut [f64], hf: &mut [f64]) -> f64 {
        let n = self.inputs();
        self.assert_lengths(x.len(), 1);
        self.assert_lengths(df.len(), 1);
        assert_eq!(hf.len(), n * n, "a Hessian has a row for each input");
        self.second_order(
            |inputs| inputs.copy_from_slice(x),
            |at| {
                df.copy_from_slice(at.gradient());
                let seed = |j, put: &mut dyn FnMut(usize, f64)| put(j, 1.0);
                at.along(n, seed, |j, column| hf[j * n..(j + 1) * n].copy_from_slice(column));
                at.value()
            },
        )
    }
}
