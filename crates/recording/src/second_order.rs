//! Second derivatives: the derivative of a sweep back along several directions at once.

use crate::sweep::{integer, is_chosen_first};
use crate::tape::Instruction;
use crate::{Op, Tape, room};

/// The derivatives of one instruction `y = φ(a, b, c)`. Nothing is nonlinear in `c`, and its slope is 1.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Local {
    kind: Kind,
    operands: [u32; 3],
    /// `∂φ/∂a` and `∂φ/∂b`.
    slopes: [f64; 2],
    /// `∂²φ/∂a²`, `∂²φ/∂a∂b`, `∂²φ/∂b²`.
    bends: [f64; 3],
}

/// Which derivatives of an instruction do not vanish.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Kind {
    /// All vanish.
    #[default]
    Flat,
    /// `y` is `a`.
    Same,
    /// Linear in `a`.
    Line,
    /// Linear in `a` and in `b`.
    Plane,
    /// A function of `a`.
    Curve,
    /// A function of `a` and `b`.
    Surface,
    /// `a b + c`.
    ProductAndSum,
}

impl Local {
    /// Forms the derivatives of an instruction with the result `y`.
    pub(crate) fn of(instruction: &Instruction, r: &[f64], y: f64) -> Self {
        let (op, k) = (instruction.op, instruction.constant);
        // The first operand stands for those that are not read.
        let mut operands = [instruction.operands[0]; 3];
        operands[..op.operands()].copy_from_slice(instruction.reads());
        let [a, b] = [r[operands[0] as usize], r[operands[1] as usize]];
        let flat = Self { operands, ..Self::default() };
        let same = |register: u32| Self { kind: Kind::Same, operands: [register; 3], ..flat };
        let line = |slope: f64| Self { kind: Kind::Line, slopes: [slope, 0.0], ..flat };
        let plane = |slopes: [f64; 2]| Self { kind: Kind::Plane, slopes, ..flat };
        let curve = |slope: f64, bend: f64| Self {
            kind: Kind::Curve,
            slopes: [slope, 0.0],
            bends: [bend, 0.0, 0.0],
            ..flat
        };
        let surface =
            |slopes: [f64; 2], bends: [f64; 3]| Self { kind: Kind::Surface, slopes, bends, ..flat };
        match op {
            Op::Literal
            | Op::Sign
            | Op::LogicalNot
            | Op::Less
            | Op::LessEqual
            | Op::Equal
            | Op::LogicalAnd
            | Op::LogicalOr => flat,
            Op::Negation | Op::ConstantSub => line(-1.0),
            Op::Recip => curve(-y * y, 2.0 * y * y * y),
            Op::Sqrt => curve(0.5 / y, -0.25 / (y * y * y)),
            Op::Cbrt => {
                let slope = 1.0 / (3.0 * y * y);
                curve(slope, -2.0 * slope / (3.0 * y * y * y))
            }
            Op::Exp => curve(y, y),
            Op::ExpM1 => curve(a.exp(), a.exp()),
            Op::Ln => curve(1.0 / a, -1.0 / (a * a)),
            Op::Ln1p => {
                let slope = 1.0 / (a + 1.0);
                curve(slope, -slope * slope)
            }
            Op::Sin => curve(a.cos(), -y),
            Op::Cos => curve(-a.sin(), -y),
            Op::Tan => {
                let slope = y * y + 1.0;
                curve(slope, 2.0 * y * slope)
            }
            Op::Asin | Op::Acos => {
                let slope = 1.0 / ((1.0 - a) * (1.0 + a)).sqrt();
                let sign = if op == Op::Asin { 1.0 } else { -1.0 };
                curve(sign * slope, sign * a * slope * slope * slope)
            }
            Op::Atan => {
                let slope = 1.0 / (a * a + 1.0);
                curve(slope, -2.0 * a * slope * slope)
            }
            Op::Sinh => curve(a.cosh(), y),
            Op::Cosh => curve(a.sinh(), y),
            Op::Tanh => {
                let slope = a.cosh().powi(-2);
                curve(slope, -2.0 * y * slope)
            }
            Op::Asinh => {
                let slope = 1.0 / (a * a + 1.0).sqrt();
                curve(slope, -a * slope * slope * slope)
            }
            Op::Acosh => {
                let slope = 1.0 / ((a - 1.0) * (a + 1.0)).sqrt();
                curve(slope, -a * slope * slope * slope)
            }
            Op::Atanh => {
                let slope = 1.0 / ((1.0 - a) * (1.0 + a));
                curve(slope, 2.0 * a * slope * slope)
            }
            Op::Abs => line(if a.is_sign_positive() { 1.0 } else { -1.0 }),
            Op::Addition => plane([1.0, 1.0]),
            Op::Subtraction => plane([1.0, -1.0]),
            Op::Multiplication => surface([b, a], [0.0, 1.0, 0.0]),
            Op::Division => {
                let slope = 1.0 / b;
                surface([slope, -y * slope], [0.0, -slope * slope, 2.0 * y * slope * slope])
            }
            Op::Power => {
                let (first, second) = (a.powf(b - 1.0), a.powf(b - 2.0));
                // 0ᵇ = 0 for all b > 0, and ln 0 is infinite.
                let ln = if a == 0.0 { 0.0 } else { a.ln() };
                surface(
                    [b * first, y * ln],
                    [b * (b - 1.0) * second, first * (1.0 + b * ln), y * ln * ln],
                )
            }
            Op::Atan2 => {
                let q = 1.0 / (a * a + b * b);
                let (mixed, twice) = ((a * a - b * b) * q * q, 2.0 * a * b * q * q);
                surface([b * q, -a * q], [-twice, mixed, twice])
            }
            Op::Min | Op::Max | Op::Select => {
                let [first, second] = if op == Op::Select { [1, 2] } else { [0, 1] };
                same(operands[if is_chosen_first(instruction, r) { first } else { second }])
            }
            Op::AddConstant => same(operands[0]),
            Op::Scale => line(k),
            Op::DivConstant => line(1.0 / k),
            Op::ConstantDiv => curve(-y / a, 2.0 * y / (a * a)),
            Op::PowI => match integer(k) {
                0 => flat,
                1 => same(operands[0]),
                n => curve(k * a.powi(n - 1), k * (k - 1.0) * a.powi(n - 2)),
            },
            Op::PowF if k == 0.0 => flat,
            #[expect(clippy::float_cmp, reason = "only these exponents are linear")]
            Op::PowF if k == 1.0 => same(operands[0]),
            Op::PowF => curve(k * a.powf(k - 1.0), k * (k - 1.0) * a.powf(k - 2.0)),
            Op::MultiplyAdd => Self { kind: Kind::ProductAndSum, slopes: [b, a], ..flat },
            Op::ScaleAdd => plane([k, 1.0]),
        }
    }

    /// Returns whether one of the operands that have a slope is marked.
    #[inline(always)]
    fn is_touched(&self, marked: &[bool]) -> bool {
        let [a, b, c] = self.operands.map(|register| marked[register as usize]);
        self.kind != Kind::Flat && (a | b | c)
    }

    /// Returns whether a second derivative does not vanish.
    #[inline(always)]
    fn is_bent(&self) -> bool {
        matches!(self.kind, Kind::Curve | Kind::Surface | Kind::ProductAndSum)
    }

    /// Returns whether its slopes change where one of the marked registers does.
    #[inline(always)]
    fn bends_with(&self, moved: &[bool]) -> bool {
        let [a, b, _] = self.operands.map(|register| moved[register as usize]);
        self.is_bent() && (a | b)
    }

    /// Adds the size of what the weight `w` contributes to each operand.
    fn add_sizes(&self, w: f64, sizes: &mut [f64]) {
        let [a, b, c] = self.operands.map(|register| register as usize);
        match self.kind {
            Kind::Flat => {}
            Kind::Same => sizes[a] += w,
            Kind::Line | Kind::Curve => sizes[a] += w * self.slopes[0].abs(),
            Kind::Plane | Kind::Surface | Kind::ProductAndSum => {
                sizes[a] += w * self.slopes[0].abs();
                sizes[b] += w * self.slopes[1].abs();
                if self.kind == Kind::ProductAndSum {
                    sizes[c] += w;
                }
            }
        }
    }

    /// The derivative of the result along `L` directions, from those of the operands.
    #[inline(always)]
    fn tangent<const L: usize>(&self, t: &[[f64; L]]) -> [f64; L] {
        let [a, b, c] = self.operands.map(|register| register as usize);
        let [p, q] = self.slopes;
        match self.kind {
            Kind::Flat => [0.0; L],
            Kind::Same => t[a],
            Kind::Line | Kind::Curve => t[a].map(|a| p * a),
            Kind::Plane | Kind::Surface => {
                let (a, b) = (&t[a], &t[b]);
                std::array::from_fn(|l| p * a[l] + q * b[l])
            }
            Kind::ProductAndSum => {
                let (a, b, c) = (&t[a], &t[b], &t[c]);
                std::array::from_fn(|l| p * a[l] + q * b[l] + c[l])
            }
        }
    }

    /// Adds the derivatives along `L` directions of what the weight `w`, with the derivatives `dw`, contributes to the
    /// weights of the operands: `w̄'_a += w̄' φ_a + w̄ (φ_aa a' + φ_ab b')`.
    #[inline(always)]
    fn pull_back<const L: usize>(
        &self,
        w: f64,
        dw: &[f64; L],
        t: &[[f64; L]],
        bar: &mut [[f64; L]],
    ) {
        let [a, b, c] = self.operands.map(|register| register as usize);
        let [p, q] = self.slopes;
        match self.kind {
            Kind::Flat => {}
            Kind::Same => add(&mut bar[a], |l| dw[l]),
            Kind::Line => add(&mut bar[a], |l| p * dw[l]),
            Kind::Plane => {
                add(&mut bar[a], |l| p * dw[l]);
                add(&mut bar[b], |l| q * dw[l]);
            }
            Kind::Curve => {
                let (bend, a_t) = (w * self.bends[0], &t[a]);
                add(&mut bar[a], |l| p * dw[l] + bend * a_t[l]);
            }
            Kind::Surface => {
                let (a_t, b_t) = (&t[a], &t[b]);
                let [aa, ab, bb] = self.bends.map(|bend| w * bend);
                add(&mut bar[a], |l| p * dw[l] + (aa * a_t[l] + ab * b_t[l]));
                add(&mut bar[b], |l| q * dw[l] + (ab * a_t[l] + bb * b_t[l]));
            }
            Kind::ProductAndSum => {
                let (a_t, b_t) = (&t[a], &t[b]);
                add(&mut bar[a], |l| p * dw[l] + w * b_t[l]);
                add(&mut bar[b], |l| q * dw[l] + w * a_t[l]);
                add(&mut bar[c], |l| dw[l]);
            }
        }
    }
}

#[inline(always)]
fn add<const L: usize>(to: &mut [f64; L], part: impl Fn(usize) -> f64) {
    for (l, to) in to.iter_mut().enumerate() {
        *to += part(l);
    }
}

/// How many directions go along one pair of sweeps: a choice for speed.
const LANES: usize = 8;

/// A tape at a point, with the weights of one output and the derivatives of all instructions.
pub(crate) struct SecondOrder<'a> {
    pub(crate) tape: &'a Tape,
    pub(crate) values: &'a [f64],
    pub(crate) weights: &'a [f64],
    locals: &'a [Local],
}

/// The derivatives of all registers and of their weights along `L` directions, and the marks of those that may not be
/// zero.
struct Lanes<'a, const L: usize> {
    t: &'a mut [[f64; L]],
    bar: &'a mut [[f64; L]],
    moved: &'a mut [bool],
    met: &'a mut [bool],
    needed: &'a mut [bool],
}

/// Lends lanes of zeros, and a list of pairs of numbers: the room for numbers one by one is in use.
fn with_lanes<const L: usize>(registers: usize, f: impl FnOnce(Lanes<'_, L>, &mut Vec<[f64; 2]>)) {
    room::with(|lanes: &mut room::Room<[f64; L]>| {
        room::with(|marks: &mut room::Room<bool>| {
            room::with(|pairs: &mut room::Room<[f64; 2]>| {
                for list in [&mut lanes.values, &mut lanes.weights] {
                    list.clear();
                    list.resize(registers, [0.0; L]);
                }
                marks.values.clear();
                marks.values.resize(3 * registers, false);
                let (t, bar) = (&mut lanes.values, &mut lanes.weights);
                let (moved, rest) = marks.values.split_at_mut(registers);
                let (met, needed) = rest.split_at_mut(registers);
                f(Lanes { t, bar, moved, met, needed }, &mut pairs.values);
            });
        });
    });
}

/// Sets what is marked to zero, and takes the marks away.
fn clear<const L: usize>(lanes: &mut [[f64; L]], marked: &mut [bool]) {
    for (lanes, is_marked) in lanes.iter_mut().zip(marked) {
        if *is_marked {
            (*lanes, *is_marked) = ([0.0; L], false);
        }
    }
}

impl Tape {
    /// Forms value, gradient and the derivatives of all instructions at the inputs that `fill` writes, and hands them to `f`.
    pub(crate) fn second_order<R>(
        &self,
        fill: impl FnOnce(&mut [f64]),
        f: impl FnOnce(&SecondOrder<'_>) -> R,
    ) -> R {
        room::with(|room: &mut room::Room<f64>| {
            self.forward(&mut room.values, fill);
            let output = self.outputs()[0] as usize;
            self.backward(&room.values, &mut room.weights, |bar| bar[output] = 1.0);
            room::with(|locals: &mut room::Room<Local>| {
                let (r, n) = (&room.values, self.inputs());
                let list = self.code().iter().enumerate();
                locals.values.clear();
                locals.values.extend(list.map(|(k, one)| Local::of(one, r, r[n + k])));
                f(&SecondOrder {
                    tape: self,
                    values: &room.values,
                    weights: &room.weights,
                    locals: &locals.values,
                })
            })
        })
    }
}

impl SecondOrder<'_> {
    /// The value of the output.
    pub(crate) fn value(&self) -> f64 {
        self.values[self.tape.outputs()[0] as usize]
    }

    /// The gradient by the inputs.
    pub(crate) fn gradient(&self) -> &[f64] {
        &self.weights[..self.tape.inputs()]
    }

    /// Passes on the derivatives of the gradient along `count` directions, each with its number. `seed(j, inputs)`
    /// passes on the non-zero entries of the `j`-th direction.
    pub(crate) fn along(
        &self,
        count: usize,
        seed: impl Fn(usize, &mut dyn FnMut(usize, f64)),
        column: impl FnMut(usize, &[f64]),
    ) {
        match count {
            0 => {}
            1 => self.along_lanes::<1>(count, seed, column),
            2..=4 => self.along_lanes::<4>(count, seed, column),
            _ => self.along_lanes::<LANES>(count, seed, column),
        }
    }

    /// Goes along `L` directions at a time. A function whose terms have few variables each moves a part of its registers
    /// along a few directions; the others are left out.
    fn along_lanes<const L: usize>(
        &self,
        count: usize,
        seed: impl Fn(usize, &mut dyn FnMut(usize, f64)),
        mut column: impl FnMut(usize, &[f64]),
    ) {
        let n = self.tape.inputs();
        with_lanes::<L>(self.values.len(), |Lanes { t, bar, moved, met, needed }, numbers| {
            self.mark_needed(needed);
            numbers.resize(n.div_ceil(2), [0.0; 2]);
            let numbers = &mut numbers.as_flattened_mut()[..n];
            for first in (0..count).step_by(L) {
                let group = first..count.min(first + L);
                for j in group.clone() {
                    seed(j, &mut |input, entry| {
                        t[input][j - first] = entry;
                        moved[input] = true;
                    });
                }
                for (k, local) in self.locals.iter().enumerate() {
                    if needed[n + k] && local.is_touched(moved) {
                        moved[n + k] = true;
                        t[n + k] = local.tangent(t);
                    }
                }
                for (k, local) in self.locals.iter().enumerate().rev() {
                    let w = self.weights[n + k];
                    // As in a sweep back: what nobody reads contributes nothing.
                    let bends = w != 0.0 && local.bends_with(moved);
                    if bends || met[n + k] {
                        let dw = bar[n + k];
                        if bends || dw.iter().any(|dw| *dw != 0.0) {
                            local.pull_back(w, &dw, t, bar);
                            local
                                .operands
                                .iter()
                                .for_each(|&register| met[register as usize] = true);
                        }
                    }
                }
                for j in group {
                    for (number, lanes) in numbers.iter_mut().zip(bar.iter()) {
                        *number = lanes[j - first];
                    }
                    column(j, numbers);
                }
                clear(t, moved);
                clear(bar, met);
            }
        });
    }

    /// Marks the registers whose derivatives change the slopes of an instruction. Those of a sum that only the output
    /// reads do not.
    fn mark_needed(&self, needed: &mut [bool]) {
        let n = self.tape.inputs();
        for (k, local) in self.locals.iter().enumerate().rev() {
            let [a, b, c] = local.operands.map(|register| register as usize);
            let is_needed = needed[n + k];
            needed[c] |= is_needed;
            needed[a] |= is_needed | local.is_bent();
            needed[b] |= is_needed | local.is_bent();
        }
    }

    /// The largest number on the tape, and the largest sum of the sizes of the terms that make a component of the
    /// gradient. Round-off is relative to them.
    pub(crate) fn sizes(&self) -> (f64, f64) {
        let n = self.tape.inputs();
        let finite =
            |largest: f64, x: f64| if x.is_finite() { largest.max(x.abs()) } else { largest };
        let mut sizes = vec![0.0; self.values.len()];
        sizes[self.tape.outputs()[0] as usize] = 1.0;
        for (k, local) in self.locals.iter().enumerate().rev() {
            if sizes[n + k] > 0.0 {
                local.add_sizes(sizes[n + k], &mut sizes);
            }
        }
        let value = self.values.iter().copied().fold(0.0, finite);
        (value, sizes[..n].iter().copied().fold(0.0, finite))
    }
}
