//! The memory of a scheme from one step to the next: as [`MidpointMemory`](crate::midpoint::MidpointMemory), in plain numbers and under
//! its names.

use std::fmt;

use smallvec::SmallVec;

use super::newton::Inverse;
use crate::implicit::algebra::{Matrix, add, dot, magnitude};
use crate::implicit::drift::Compensation;
use crate::implicit::parts::Parts;
use crate::implicit::start::Start;
use crate::midpoint::jacobian::STEPS;
use crate::midpoint::memory::NAMES;
use crate::midpoint::predictor::{DIFFERENCES, FALLS, LOW};
use crate::numbers::{Lengths, List};
use crate::step::{FARTHEST, Memory, RestoreError, Saved};

/// The memory of a scheme for a model in plain numbers.
#[doc(hidden)]
#[allow(private_bounds, reason = "no other crate makes one")]
pub struct MidpointNumbers<L: Lengths> {
    pub(super) predictor: Predictor<L>,
    pub(super) jacobian: KeptJacobian<L>,
    pub(super) compensation: Compensation<L>,
}

/// The displacements of the steps before, from which the next one is extrapolated: their backward differences `∇ʲd`, as far as they
/// are known.
pub(super) struct Predictor<L: Lengths>(SmallVec<[L::Vector; DIFFERENCES]>);

/// The Jacobian of an earlier step, and what it was formed for.
pub(super) struct KeptJacobian<L: Lengths> {
    /// Its inverse, if there is one.
    pub(super) inverse: Option<Inverse<L>>,
    /// The size of the step.
    h: f64,
    /// The length of its displacement.
    length: f64,
}

// By hand, because lengths have none of these.
impl<L: Lengths> Clone for MidpointNumbers<L> {
    fn clone(&self) -> Self {
        let Self { predictor, jacobian: KeptJacobian { inverse, h, length }, compensation } = self;
        Self {
            predictor: Predictor(predictor.0.clone()),
            jacobian: KeptJacobian { inverse: inverse.clone(), h: *h, length: *length },
            compensation: compensation.clone(),
        }
    }
}

impl<L: Lengths> fmt::Debug for MidpointNumbers<L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("MidpointNumbers")
            .field("differences", &self.predictor.0)
            .finish_non_exhaustive()
    }
}

impl<L: Lengths> Default for MidpointNumbers<L> {
    fn default() -> Self {
        Self {
            predictor: Predictor(SmallVec::new()),
            jacobian: KeptJacobian { inverse: None, h: 0.0, length: 0.0 },
            compensation: Compensation(None),
        }
    }
}

#[allow(private_bounds, reason = "no other crate makes one")]
impl<L: Lengths> MidpointNumbers<L> {
    /// The rate `h|K'|` of the friction where the kept Jacobian was formed.
    pub(super) fn friction(&self) -> f64 {
        self.jacobian.inverse.as_ref().map_or(0.0, |inverse| inverse.friction)
    }

    /// The memory itself, if its vectors have this length, as those of every step do.
    pub(super) fn keep_length(&mut self, n: usize) {
        let lists = self.predictor.0.iter().chain(&self.compensation.0);
        let has = |list: &L::Vector| list.numbers().len() == n;
        let inverse = self.jacobian.inverse.as_ref();
        if !lists.chain(inverse.map(|inverse| &inverse.round_off)).all(has) {
            *self = Self::default();
        }
    }
}

impl<L: Lengths> KeptJacobian<L> {
    /// Forgets a Jacobian that may not be tried for a step of size `h` with this guess of the displacement: the sizes that the
    /// round-off is judged by are those of steps that are about as long.
    pub(super) fn prepare(&mut self, h: f64, guess: &L::Vector) {
        if let Some(inverse) = &self.inverse {
            let fraction = magnitude(guess) / self.length;
            let same_size = self.h.to_bits() == h.to_bits();
            if !(same_size && inverse.age < STEPS && (0.7..1.5).contains(&fraction)) {
                self.inverse = None;
            }
        }
    }

    /// Notes the step of size `h` with the displacement `u` that a new inverse has solved.
    pub(super) fn note(&mut self, h: f64, u: &L::Vector) {
        (self.h, self.length) = (h, magnitude(u));
    }
}

impl<L: Lengths> Predictor<L> {
    /// The displacement of a step: extrapolated, else that of explicit Euler, else rest.
    pub(super) fn guess(&self, start: &Start<'_, L>) -> L::Vector {
        let guess = self.extrapolate().or_else(|| explicit(start));
        guess.unwrap_or_else(|| start.parts.zero())
    }

    /// The next displacement on the polynomial through the last ones, as many as would have been best for the last step.
    fn extrapolate(&self) -> Option<L::Vector> {
        if self.0.len() < 2 {
            return None;
        }
        let (last, differences) = self.0.split_first()?;
        let (mut best, mut smallest) = (1, f64::INFINITY);
        for (difference, k) in differences.iter().zip(1..) {
            let size = dot(difference, difference);
            if k >= LOW && (best + 1 < k || size > FALLS * smallest) {
                break;
            }
            if size < smallest {
                (best, smallest) = (k, size);
            }
        }
        // Where the last difference is the smallest, it is the next one that counts.
        if best + 1 == self.0.len() || best + 1 >= LOW {
            best += 1;
        }
        let mut sum = last.clone();
        differences.iter().take(best - 1).for_each(|difference| add(&mut sum, 1.0, difference));
        Some(sum)
    }

    /// Notes the displacement `d` of a step between two states.
    pub(super) fn note(&mut self, parts: &Parts<'_, L>, [x, end]: [&L::State; 2], d: &L::Vector) {
        let mut difference = d.clone();
        for last in &mut self.0 {
            let next = parts.vector(|i| difference[i] - last[i]);
            *last = std::mem::replace(&mut difference, next);
        }
        if self.0.len() < DIFFERENCES {
            self.0.push(difference);
        }
        parts.transport(x, end, &mut self.0);
    }

    /// Rescales the displacements to steps of another size, on the parabola through the last three.
    fn rescaled(&self, ratio: f64) -> Self {
        if ratio.to_bits() == 1.0_f64.to_bits() {
            return Self(self.0.clone());
        }
        let Some(first) = self.0.first() else { return Self(SmallVec::new()) };
        if ratio > FARTHEST {
            return Self(SmallVec::new());
        }
        // Far from the three points their parabola says nothing.
        let known = self.0.len().min(if ratio > 2.0 { 1 } else { 3 });
        let n = first.numbers().len();
        let number = |j: usize, i: usize| if j < known { self.0[j][i] } else { 0.0 };
        let at = |k: f64, i: usize| {
            let (d, slope, bend) = (number(0, i), number(1, i), number(2, i));
            let mean = d + bend * ((ratio * ratio - 1.0) / 24.0);
            let s = 0.5 - (k + 0.5) * ratio;
            (mean + slope * s + bend * (0.5 * s * (s + 1.0))) * ratio
        };
        let row = |f: &dyn Fn(usize) -> f64| super::super::algebra::vector(n, f);
        let rows = [
            row(&|i| at(0.0, i)),
            row(&|i| at(0.0, i) - at(1.0, i)),
            row(&|i| at(0.0, i) - at(1.0, i) * 2.0 + at(2.0, i)),
        ];
        let known = if ratio > 2.0 { 2 * known } else { known };
        Self(rows.into_iter().take(known).collect())
    }
}

/// The explicit Euler displacement. An entry that it hardly moves gets that of the velocity at half of it.
fn explicit<L: Lengths>(start: &Start<'_, L>) -> Option<L::Vector> {
    let parts = start.parts;
    let displacement = |x: &L::State| {
        let velocity = parts.velocity(x)?;
        let displacement = parts.vector(|i| velocity[i] * start.h);
        super::super::algebra::is_finite(&displacement).then_some(displacement)
    };
    let (u, sizes) = (displacement(start.x)?, parts.scales(start.x));
    // The round-off of an energy ε H, over the square of such a displacement, is as large as its second derivative.
    let rests = |i: usize| sizes[i] > 0.0 && u[i].abs() <= f64::EPSILON.sqrt() * sizes[i];
    if !(0..parts.n()).any(rests) {
        return Some(u);
    }
    let half = parts.moved(start.x, &parts.vector(|i| u[i] * 0.5));
    let Some(later) = displacement(&half) else { return Some(u) };
    // A stiff entry would move by more than its size.
    let moves = |i: usize| rests(i) && later[i].abs() <= sizes[i];
    Some(parts.vector(|i| if moves(i) { later[i] } else { u[i] }))
}

impl<L: Lengths> Memory for MidpointNumbers<L> {
    fn rescaled(&self, ratio: f64) -> Self {
        Self { predictor: self.predictor.rescaled(ratio), ..self.clone() }
    }

    fn save(&self, saved: &mut Saved) {
        let column = |v: &L::Vector| v.numbers().to_vec();
        for (name, difference) in NAMES.iter().zip(&self.predictor.0) {
            saved.put(*name, column(difference));
        }
        if let KeptJacobian { inverse: Some(inverse), h, length } = &self.jacobian {
            saved.put("inverse", inverse.matrix.numbers().to_vec());
            saved.put("round-off of the solution", column(&inverse.round_off));
            let &Inverse { residual_bound, contraction, first, friction, age, .. } = inverse;
            let numbers =
                [residual_bound, contraction, first, friction, f64::from(age), *h, *length];
            saved.put("what the inverse was formed for", numbers);
        }
        if let Some(lost) = &self.compensation.0 {
            saved.put("compensation", column(lost));
        }
    }

    fn restore(saved: &Saved) -> Result<Self, RestoreError> {
        let column = |name: &'static str| -> Result<Option<L::Vector>, RestoreError> {
            let Some(list) = saved.list(name)? else { return Ok(None) };
            let (found, expected) = (list.len(), L::directions(list.len()));
            if found != expected {
                return Err(RestoreError::Length { what: name, found, expected });
            }
            Ok(Some(L::Vector::of(&list)))
        };
        let mut memory = Self::default();
        for name in NAMES {
            let Some(difference) = column(name)? else { break };
            memory.predictor.0.push(difference);
        }
        let round_off = column("round-off of the solution")?;
        let numbers = saved.get("what the inverse was formed for", 7)?;
        if let (Some(round_off), Some(numbers)) = (round_off, numbers) {
            let n = round_off.numbers().len();
            if let Some(list) = saved.get("inverse", n * n)? {
                let [residual_bound, contraction, first, friction, age, h, length] =
                    [0, 1, 2, 3, 4, 5, 6].map(|k| numbers[k]);
                if !(0.0..=f64::from(u32::MAX)).contains(&age) {
                    return Err(RestoreError::Damaged { what: "age of the inverse", value: age });
                }
                #[allow(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "it is in range"
                )]
                let age = age as u32;
                let matrix = Matrix::of(n, |i, j| list[i * n + j]);
                let inverse = Inverse {
                    matrix,
                    round_off,
                    residual_bound,
                    contraction,
                    first,
                    friction,
                    age,
                };
                memory.jacobian = KeptJacobian { inverse: Some(inverse), h, length };
            }
        }
        memory.compensation = Compensation(column("compensation")?);
        Ok(memory)
    }
}
