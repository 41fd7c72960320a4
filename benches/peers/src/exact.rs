//! The solution to twenty digits, by another method than any that is compared.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::{Number, Problem};

/// A number with some 32 digits, the unevaluated sum of two (Dekker 1971; Hida, Li, Bailey 2001).
#[derive(Clone, Copy, Debug)]
pub struct Double(f64, f64);

/// `a + b` and what its rounding has lost.
fn sum(a: f64, b: f64) -> Double {
    let s = a + b;
    let part = s - a;
    Double(s, (a - (s - part)) + (b - part))
}

impl From<f64> for Double {
    fn from(x: f64) -> Self {
        Self(x, 0.0)
    }
}

impl From<Double> for f64 {
    fn from(x: Double) -> Self {
        x.0
    }
}

impl Add for Double {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let (high, low) = (sum(self.0, other.0), sum(self.1, other.1));
        let high = sum(high.0, high.1 + low.0);
        sum(high.0, high.1 + low.1)
    }
}

impl Neg for Double {
    type Output = Self;

    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl Sub for Double {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Double {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let high = self.0 * other.0;
        let low = self.0.mul_add(other.0, -high);
        sum(high, low + (self.0 * other.1 + self.1 * other.0))
    }
}

impl Div for Double {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        let digits = |rest: Self| Self::from(rest.0 / other.0);
        let first = digits(self);
        let rest = self - other * first;
        let second = digits(rest);
        first + second + digits(rest - other * second)
    }
}

impl Number for Double {}

/// Columns of the extrapolation.
const COLUMNS: usize = 10;

/// `x(time)` by the extrapolation of Gragg, Bulirsch and Stoer in double-double arithmetic, with
/// `steps` basic steps: `n = 2, 4, … 20` substeps of the midpoint rule, order 20.
pub fn flow<P: Problem<N>, const N: usize>(problem: &P, time: f64, steps: u32) -> [Double; N] {
    let h = Double::from(time) / Double::from(f64::from(steps));
    let start = problem.start().map(Double::from);
    (0..steps).fold(start, |x, _| step(problem, &x, h))
}

fn step<P: Problem<N>, const N: usize>(problem: &P, x: &[Double; N], h: Double) -> [Double; N] {
    let mut row: [[Double; N]; COLUMNS] = [*x; COLUMNS];
    for k in 0..COLUMNS {
        let mut value = midpoint(problem, x, h, 2 * (k as u32 + 1));
        // Aitken and Neville in h²: T_{k,j+1} = T_{k,j} + (T_{k,j} − T_{k−1,j})/((n_k/n_{k−j−1})² − 1).
        for j in 0..k {
            let ratio = Double::from((k + 1) as f64) / Double::from((k - j) as f64);
            let before = std::mem::replace(&mut row[j], value);
            let weight = Double::from(1.0) / (ratio * ratio - Double::from(1.0));
            value = std::array::from_fn(|i| value[i] + (value[i] - before[i]) * weight);
        }
        row[k] = value;
    }
    row[COLUMNS - 1]
}

/// `n` steps of the explicit midpoint rule, begun by Euler's.
fn midpoint<P: Problem<N>, const N: usize>(
    problem: &P,
    x: &[Double; N],
    h: Double,
    n: u32,
) -> [Double; N] {
    let part = h / Double::from(f64::from(n));
    let moved = |x: &[Double; N], v: &[Double; N], h: Double| -> [Double; N] {
        std::array::from_fn(|i| x[i] + v[i] * h)
    };
    let (mut last, mut now) = (*x, moved(x, &problem.velocity(x), part));
    for _ in 1..n {
        let next = moved(&last, &problem.velocity(&now), part * Double::from(2.0));
        (last, now) = (now, next);
    }
    now
}
