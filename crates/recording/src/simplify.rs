//! Simplification of a tape, with the same bits at `f64`.

use std::collections::HashMap;

use crate::sweep::{evaluate, integer};
use crate::tape::Instruction;
use crate::{Op, Tape};

impl Tape {
    /// Simplifies the tape, in one pass and with the same bits at `f64`.
    ///
    /// - Operations on constants are done now, and equal instructions are done once.
    /// - A constant operand becomes the constant of its instruction; a quotient by a power of two becomes a product.
    /// - `x + 0`, `x·1`, `x/1`, `x¹` and `−(−x)` become `x`, and `x⁰` becomes 1. The only bit that changes is the sign of
    ///   `−0 + 0`. `x·0` stays, because it is not 0 where `x` is infinite or NaN.
    /// - A product that only one sum reads becomes a part of that sum ([`Op::MultiplyAdd`], [`Op::ScaleAdd`]), which rounds
    ///   as often.
    /// - What no output needs is left out.
    ///
    /// Derivatives are the same to round-off.
    #[must_use]
    pub fn simplified(&self) -> Self {
        simplified(self)
    }
}

/// A [simplified](Tape::simplified) tape.
fn simplified(tape: &Tape) -> Tape {
    let n = tape.inputs();
    let mut new = Simplifier { inputs: n, code: Vec::new(), places: HashMap::new() };
    // What each register of the old tape has become. The registers fit into `u32`, as `MOST_REGISTERS` does.
    let mut now: Vec<Value> = (0..n).map(|k| Value::Register(place(k))).collect();
    now.reserve(tape.code().len());
    for one in tape.code() {
        let operand = |k: usize| match one.reads().get(k) {
            Some(&register) => now[register as usize],
            None => Value::Constant(0.0),
        };
        let value = new.add(one.op, [operand(0), operand(1), operand(2)], one.constant);
        now.push(value);
    }
    let outputs = tape.outputs().iter().map(|&register| new.register(now[register as usize]));
    let outputs: Vec<u32> = outputs.collect();
    fuse(n, &mut new.code, &outputs);
    let (code, outputs) = live(n, &new.code, &outputs);
    Tape::new(n, code, outputs).unwrap_or_else(|_| tape.clone())
}

/// The number of a register.
#[expect(
    clippy::cast_possible_truncation,
    reason = "a tape has at most `MOST_REGISTERS` registers"
)]
fn place(register: usize) -> u32 {
    register as u32
}

#[derive(Clone, Copy)]
enum Value {
    Register(u32),
    Constant(f64),
}

struct Simplifier {
    inputs: usize,
    code: Vec<Instruction>,
    /// The place of each instruction.
    places: HashMap<(Op, [u32; 3], u64), u32>,
}

impl Simplifier {
    /// Returns the register of a value, which is an instruction of its own for a constant.
    fn register(&mut self, value: Value) -> u32 {
        match value {
            Value::Register(register) => register,
            Value::Constant(k) => self.put(Op::Literal, [0; 3], k),
        }
    }

    /// Returns the register of an instruction, which is a new one unless the same stands there already.
    fn put(&mut self, op: Op, mut operands: [u32; 3], constant: f64) -> u32 {
        if op.commutes() && operands[0] > operands[1] {
            operands.swap(0, 1);
        }
        let next = place(self.inputs + self.code.len());
        let entry = self.places.entry((op, operands, constant.to_bits()));
        let register = *entry.or_insert(next);
        if register == next {
            self.code.push(Instruction { op, operands, constant });
        }
        register
    }

    /// The instruction that defines a register; `None` for an input.
    fn source(&self, register: u32) -> Option<Instruction> {
        let k = (register as usize).checked_sub(self.inputs)?;
        Some(self.code[k])
    }

    /// `−x` if the register is `−x`.
    fn negated(&self, register: u32) -> Option<u32> {
        self.source(register).filter(|one| one.op == Op::Negation).map(|one| one.operands[0])
    }

    /// Adds an operation on values.
    #[expect(clippy::float_cmp, reason = "only these numbers are neutral")]
    fn add(&mut self, op: Op, values: [Value; 3], k: f64) -> Value {
        use Value::{Constant, Register};
        if let Some(known) = folded(op, &values, k) {
            return Constant(known);
        }
        let none = Constant(0.0);
        let one = |x: u32| [Register(x), none, none];
        let two = |a: u32, b: u32| [Register(a), Register(b), none];
        match (op, values) {
            (Op::Addition, [Register(x), Constant(c), _] | [Constant(c), Register(x), _]) => {
                self.add(Op::AddConstant, one(x), c)
            }
            (Op::Addition, [Register(a), Register(b), _]) => {
                if let Some(b) = self.negated(b) {
                    self.add(Op::Subtraction, two(a, b), 0.0)
                } else if let Some(a) = self.negated(a) {
                    self.add(Op::Subtraction, two(b, a), 0.0)
                } else {
                    self.put_values(op, values, k)
                }
            }
            (Op::Subtraction, [Register(x), Constant(c), _]) => {
                self.add(Op::AddConstant, one(x), -c)
            }
            (Op::Subtraction, [Constant(c), Register(x), _]) => {
                self.add(Op::ConstantSub, one(x), c)
            }
            (Op::Subtraction, [Register(a), Register(b), _]) => match self.negated(b) {
                Some(b) => self.add(Op::Addition, two(a, b), 0.0),
                None => self.put_values(op, values, k),
            },
            (Op::Multiplication, [Register(x), Constant(c), _] | [Constant(c), Register(x), _]) => {
                self.add(Op::Scale, one(x), c)
            }
            (Op::Division, [Register(x), Constant(c), _]) => self.add(Op::DivConstant, one(x), c),
            (Op::Division, [Constant(c), Register(x), _]) => self.add(Op::ConstantDiv, one(x), c),
            (Op::Power, [Register(x), Constant(c), _]) => self.add(Op::PowF, one(x), c),
            (Op::Select, [Constant(c), yes, no]) => {
                if c == 0.0 {
                    no
                } else {
                    yes
                }
            }
            (Op::MultiplyAdd, [a, b, c]) if [a, b, c].iter().any(Value::is_constant) => {
                let product = self.add(Op::Multiplication, [a, b, none], 0.0);
                self.add(Op::Addition, [product, c, none], 0.0)
            }
            (Op::ScaleAdd, [a, b, _]) if [a, b].iter().any(Value::is_constant) => {
                let product = self.add(Op::Scale, [a, none, none], k);
                self.add(Op::Addition, [product, b, none], 0.0)
            }
            (Op::AddConstant, [x, ..]) if k == 0.0 => x,
            (Op::Scale | Op::DivConstant | Op::PowI | Op::PowF, [x, ..]) if k == 1.0 => x,
            (Op::Scale, _) if k == -1.0 => self.add(Op::Negation, values, 0.0),
            (Op::DivConstant, _) if has_exact_reciprocal(k) => self.add(Op::Scale, values, 1.0 / k),
            (Op::ConstantDiv, _) if k == 1.0 => self.add(Op::Recip, values, 0.0),
            (Op::PowI | Op::PowF, _) if k == 0.0 => Constant(1.0),
            (Op::PowI, [Register(x), ..]) if (-4..=4).contains(&integer(k)) => {
                self.power(x, integer(k))
            }
            (Op::Negation, [Register(x), ..]) => match self.negated(x) {
                Some(x) => Register(x),
                None => self.put_values(op, values, k),
            },
            _ => self.put_values(op, values, k),
        }
    }

    /// Adds an operation on the registers of values.
    fn put_values(&mut self, op: Op, values: [Value; 3], k: f64) -> Value {
        let mut operands = [0; 3];
        for (operand, value) in operands.iter_mut().zip(values).take(op.operands()) {
            *operand = self.register(value);
        }
        Value::Register(self.put(op, operands, k))
    }

    /// Adds `xⁿ` for `|n| = 1 … 4` as products, in the order in which `powi` squares.
    fn power(&mut self, x: u32, n: i32) -> Value {
        let product =
            |this: &mut Self, a: u32, b: u32| this.put(Op::Multiplication, [a, b, 0], 0.0);
        let power = match n.unsigned_abs() {
            1 => x,
            2 => product(self, x, x),
            3 => {
                let square = product(self, x, x);
                product(self, x, square)
            }
            _ => {
                let square = product(self, x, x);
                product(self, square, square)
            }
        };
        Value::Register(if n < 0 { self.put(Op::Recip, [power, 0, 0], 0.0) } else { power })
    }
}

impl Value {
    fn is_constant(&self) -> bool {
        matches!(self, Self::Constant(_))
    }
}

/// Returns the result of an operation whose operands are constants.
fn folded(op: Op, values: &[Value; 3], constant: f64) -> Option<f64> {
    let mut numbers = [0.0; 3];
    for (number, value) in numbers.iter_mut().zip(values).take(op.operands()) {
        let Value::Constant(known) = value else { return None };
        *number = *known;
    }
    Some(evaluate(&Instruction { op, operands: [0, 1, 2], constant }, &numbers))
}

/// Returns whether `x/k` has the bits of `x·(1/k)`: `k` is a power of two, and neither number is subnormal.
fn has_exact_reciprocal(k: f64) -> bool {
    let mantissa = k.to_bits() & ((1 << 52) - 1);
    mantissa == 0 && k.is_normal() && (1.0 / k).is_normal()
}

/// Makes a product that only one sum reads a part of this sum. The product is then read by no instruction.
fn fuse(n: usize, code: &mut [Instruction], outputs: &[u32]) {
    let mut reads = vec![0_u32; n + code.len()];
    for &output in outputs {
        reads[output as usize] += 1;
    }
    for k in (0..code.len()).rev() {
        if reads[n + k] > 0 {
            code[k].reads().iter().for_each(|&register| reads[register as usize] += 1);
        }
    }
    for k in 0..code.len() {
        let Instruction { op, operands: [a, b, _], .. } = code[k];
        // `a − b` is `a + b·(−1)`, so that a scaled `b` joins with the opposite factor.
        let joined = |product: u32, other: u32, sign: f64| {
            let place = (product as usize).checked_sub(n)?;
            let Instruction { op, operands: [x, y, _], constant } = code[place];
            let is_read_once = reads[product as usize] == 1 && product != other;
            match op {
                Op::Multiplication if is_read_once && sign > 0.0 => Some(Instruction {
                    op: Op::MultiplyAdd,
                    operands: [x, y, other],
                    constant: 0.0,
                }),
                Op::Scale if is_read_once => {
                    let constant = constant * sign;
                    Some(Instruction { op: Op::ScaleAdd, operands: [x, other, 0], constant })
                }
                _ => None,
            }
        };
        let better = match op {
            Op::Addition => joined(b, a, 1.0).or_else(|| joined(a, b, 1.0)),
            Op::Subtraction => joined(b, a, -1.0),
            _ => None,
        };
        if let Some(better) = better {
            code[k] = better;
        }
    }
}

/// Leaves out what no output needs.
fn live(n: usize, code: &[Instruction], outputs: &[u32]) -> (Vec<Instruction>, Vec<u32>) {
    let mut is_live = vec![false; n + code.len()];
    outputs.iter().for_each(|&register| is_live[register as usize] = true);
    for (k, one) in code.iter().enumerate().rev() {
        if is_live[n + k] {
            one.reads().iter().for_each(|&register| is_live[register as usize] = true);
        }
    }
    let mut places: Vec<u32> = (0..n).map(place).collect();
    let mut kept = Vec::new();
    for (k, one) in code.iter().enumerate() {
        places.push(place(n + kept.len()));
        if is_live[n + k] {
            let mut one = *one;
            let operands = one.op.operands();
            for register in &mut one.operands[..operands] {
                *register = places[*register as usize];
            }
            kept.push(one);
        }
    }
    (kept, outputs.iter().map(|&register| places[register as usize]).collect())
}
