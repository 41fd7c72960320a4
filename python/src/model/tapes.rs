//! Tapes with the values of their parameters in them, and the products of matrices with covectors.

use metriplectic_recording::{Op, Tape, TapeError};

/// Where an input of a tape comes from.
#[derive(Clone, Copy, Debug)]
enum Source {
    /// An input of the new tape.
    Input(usize),
    /// A number.
    Number(f64),
}

/// The list of a tape under construction.
struct Listing {
    inputs: usize,
    code: Vec<(u32, [u32; 3], f64)>,
}

/// Converts the number of a register.
fn place(register: usize) -> Result<u32, TapeError> {
    u32::try_from(register).map_err(|_| TapeError::TooLarge)
}

impl Listing {
    /// Appends an instruction, and returns its register.
    fn push(&mut self, op: Op, operands: [u32; 3], constant: f64) -> Result<u32, TapeError> {
        self.code.push((op.code(), operands, constant));
        place(self.inputs + self.code.len() - 1)
    }

    /// Appends the instructions of a tape with other inputs, and returns the registers of its outputs.
    fn append(
        &mut self,
        tape: &Tape,
        source: impl Fn(usize) -> Source,
    ) -> Result<Vec<u32>, TapeError> {
        let mut now = Vec::with_capacity(tape.registers());
        for input in 0..tape.inputs() {
            now.push(match source(input) {
                Source::Input(input) => place(input)?,
                Source::Number(number) => self.push(Op::Literal, [0; 3], number)?,
            });
        }
        for one in tape.code() {
            let mut operands = [0; 3];
            for (operand, register) in operands.iter_mut().zip(one.reads()) {
                *operand = now[*register as usize];
            }
            now.push(self.push(one.op, operands, one.constant)?);
        }
        Ok(tape.outputs().iter().map(|&register| now[register as usize]).collect())
    }

    fn finish(self, outputs: Vec<u32>) -> Result<Tape, TapeError> {
        Tape::from_parts(self.inputs, self.code, outputs).map(|tape| tape.simplified())
    }

    /// Returns whether a register is the constant zero.
    fn is_zero(&self, register: u32) -> bool {
        let instruction = (register as usize).checked_sub(self.inputs).map(|k| self.code[k]);
        instruction.is_some_and(|(op, _, constant)| op == Op::Literal.code() && constant == 0.0)
    }

    /// Appends `Σ_j a_j b_j` over the pairs whose first number is not the constant zero.
    fn dot(&mut self, pairs: impl IntoIterator<Item = (u32, u32)>) -> Result<u32, TapeError> {
        let mut sum = None;
        for (a, b) in pairs {
            if self.is_zero(a) {
                continue;
            }
            sum = Some(match sum {
                None => self.push(Op::Multiplication, [a, b, 0], 0.0)?,
                Some(sum) => self.push(Op::MultiplyAdd, [a, b, sum], 0.0)?,
            });
        }
        sum.map_or_else(|| self.push(Op::Literal, [0; 3], 0.0), Ok)
    }
}

/// Returns whether the outputs of a tape depend on an input.
pub(super) fn depends(tape: &Tape, input: usize) -> bool {
    let mut needed = vec![false; tape.registers()];
    tape.outputs().iter().for_each(|&register| needed[register as usize] = true);
    for (k, one) in tape.code().iter().enumerate().rev() {
        if needed[tape.inputs() + k] {
            one.reads().iter().for_each(|&register| needed[register as usize] = true);
        }
    }
    needed[input]
}

/// How the inputs of a tape are laid out: the `states` first, then the time `t`, then the parameters `θ`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout<'a> {
    /// The inputs before the time.
    pub(super) states: usize,
    /// The values of the parameters.
    pub(super) theta: &'a [f64],
}

impl Layout<'_> {
    /// The inputs `[x | t | θ]` of a tape.
    pub(super) const fn inputs(&self) -> usize {
        self.states + 1 + self.theta.len()
    }

    /// Finds the new input of an old one: a state, the time behind `before`, or the value of a parameter.
    fn source(&self, input: usize, before: usize) -> Source {
        match input.checked_sub(self.states) {
            None => Source::Input(input),
            Some(0) => Source::Input(before),
            Some(k) => Source::Number(self.theta[k - 1]),
        }
    }
}

/// A function of a state and, if it depends on it, of the time: a tape with the inputs `[x]` or `[x | t]`.
#[derive(Clone, Debug)]
pub(super) struct OfState {
    pub(super) tape: Tape,
    pub(super) in_time: bool,
}

impl OfState {
    /// Puts the values of the parameters into a tape `[x | t | θ]`.
    pub(super) fn bound(tape: &Tape, layout: Layout<'_>) -> Result<Self, TapeError> {
        let in_time = depends(tape, layout.states);
        let inputs = layout.states + usize::from(in_time);
        let mut listing = Listing { inputs, code: Vec::with_capacity(tape.registers()) };
        let outputs = listing.append(tape, |input| match layout.source(input, layout.states) {
            Source::Input(input) if input == inputs => Source::Number(0.0),
            source => source,
        })?;
        Ok(Self { tape: listing.finish(outputs)?, in_time })
    }
}

/// How the outputs of a tape are a matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// The entries row by row.
    Rows,
    /// Contacts `(ρ, b)`, of which `Σ ρ b bᵀ` is made.
    Contacts,
}

/// Makes the tape of the vector `A α`, with the inputs `[x | t | α]`, from that of a matrix `A` of `n × n` entries with
/// the inputs `[x | t | θ]`. Entries that are zero everywhere cost nothing.
pub(super) fn product(
    tape: &Tape,
    form: Form,
    n: usize,
    layout: Layout<'_>,
) -> Result<Tape, TapeError> {
    let source = |input| layout.source(input, layout.states);
    product_from(tape, form, n, (layout.states, 0), source)
}

/// Makes the same tape with the inputs `[x | t | α | θ]`, with so many numbers before the time and so many parameters.
pub(super) fn product_of_parameters(
    tape: &Tape,
    form: Form,
    n: usize,
    states: usize,
    parameters: usize,
) -> Result<Tape, TapeError> {
    let source = |input: usize| Source::Input(if input > states { input + n } else { input });
    product_from(tape, form, n, (states, parameters), source)
}

/// Makes the tape of the vector `A α` from that of the matrix and the sources of its inputs.
fn product_from(
    tape: &Tape,
    form: Form,
    n: usize,
    (states, parameters): (usize, usize),
    source: impl Fn(usize) -> Source,
) -> Result<Tape, TapeError> {
    let inputs = states + 1 + n + parameters;
    let mut listing = Listing { inputs, code: Vec::with_capacity(tape.registers() + 2 * n) };
    let entries = listing.append(tape, source)?;
    let alpha = (0..n).map(|j| place(states + 1 + j)).collect::<Result<Vec<u32>, _>>()?;
    let mut outputs = Vec::with_capacity(n);
    match form {
        Form::Rows => {
            for row in entries.chunks_exact(n) {
                outputs.push(listing.dot(row.iter().copied().zip(alpha.iter().copied()))?);
            }
        }
        Form::Contacts => {
            let mut forces = Vec::new();
            for contact in entries.chunks_exact(n + 1) {
                let (rate, b) = (contact[0], &contact[1..]);
                let along = listing.dot(b.iter().copied().zip(alpha.iter().copied()))?;
                forces.push((listing.push(Op::Multiplication, [rate, along, 0], 0.0)?, b));
            }
            for i in 0..n {
                outputs.push(listing.dot(forces.iter().map(|(force, b)| (b[i], *force)))?);
            }
        }
    }
    listing.finish(outputs)
}

#[cfg(test)]
mod tests {
    use super::*;
    use metriplectic_recording::record;

    #[test]
    fn a_tape_that_reads_a_number_in_a_choice_alone_depends_on_it() {
        // The sign of t decides.
        let code = [
            (Op::Literal.code(), [0; 3], 0.0),
            (Op::Less.code(), [2, 1, 0], 0.0),
            (Op::Select.code(), [3, 0, 2], 0.0),
            (Op::Sin.code(), [1, 0, 0], 0.0),
        ];
        let chosen = Tape::from_parts(2, code, vec![4]).unwrap();
        assert!(depends(&chosen, 0) && depends(&chosen, 1));
        // The sine of t is on the tape, and no output needs it.
        let left_out = Tape::from_parts(2, code, vec![0]).unwrap();
        assert!(depends(&left_out, 0) && !depends(&left_out, 1));
    }

    #[test]
    fn parameters_become_constants() {
        // x0 θ0 + x1² + t θ1.
        let tape = record(&[0.5; 5], |x| vec![x[0] * x[3] + x[1] * x[1] + x[2] * x[4]]).unwrap();
        let bound = OfState::bound(&tape, Layout { states: 2, theta: &[3.0, 7.0] }).unwrap();
        assert!(bound.in_time);
        assert_eq!(bound.tape.value(&[2.0, 5.0, 0.5]), 6.0 + 25.0 + 3.5);
        let at_rest = record(&[0.5; 5], |x| vec![x[0] * x[3] + x[1] * x[1]]).unwrap();
        let bound = OfState::bound(&at_rest, Layout { states: 2, theta: &[3.0, 7.0] }).unwrap();
        assert!(!bound.in_time);
        assert_eq!(bound.tape.inputs(), 2);
        assert_eq!(bound.tape.value(&[2.0, 5.0]), 6.0 + 25.0);
    }

    #[test]
    fn a_product_leaves_out_what_is_zero() {
        let n = 50;
        let tape = record(&vec![0.5; n + 1], |x| {
            let entry = |k: usize| match (k / n, k % n) {
                (i, j) if i + 1 == j => x[i],
                (i, j) if j + 1 == i => -x[j],
                _ => 0.0.into(),
            };
            (0..n * n).map(entry).collect()
        })
        .unwrap();
        let v = product(&tape, Form::Rows, n, Layout { states: n, theta: &[] }).unwrap();
        assert!(v.code().len() < 4 * n, "{}", v.code().len());
        let (mut x, mut out) = (vec![0.0; 2 * n + 1], vec![0.0; n]);
        (0..n).for_each(|i| (x[i], x[n + 1 + i]) = (1.0 + i as f64, (i as f64).sin()));
        v.evaluate(&x, &mut out);
        let at = |i: usize| (i as f64).sin();
        for (i, out) in out.iter().enumerate() {
            let up = if i + 1 < n { (1.0 + i as f64) * at(i + 1) } else { 0.0 };
            let down = if i > 0 { i as f64 * at(i - 1) } else { 0.0 };
            assert!((out - (up - down)).abs() < 1e-13, "{i}");
        }
    }
}
