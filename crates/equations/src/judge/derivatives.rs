//! Derivatives against values.
//!
//! A closure can drop a derivative: `x.re` and `Real::from(f64)` are constants to a dual number. Its values
//! are then right and the motion is wrong. So verification compares every derivative that a step uses with
//! difference quotients of the values,
//!
//! ```math
//! D_k = \frac{f(\varphi_x(\delta_k e_i)) - f(\varphi_x(-\delta_k e_i))}{2 \delta_k}, \qquad
//! \delta_k = 0.45^k\, \ell_i .
//! ```
//!
//! The error of `D_k` falls by five from one `k` to the next, until it is rounding, which doubles. The
//! differences of quotients show both: `|D_k − D_{k−1}|` bounds the first, and the largest
//! `δ_k |D_k − D_{k−1}|` at the finest `k` is the rounding `η` of the values, with all that cancels inside
//! of the field. The derivative is wrong if it differs from the quotient with the smallest bound
//!
//! ```math
//! 8\, |D_k - D_{k-1}| + 8\, \eta / \delta_k + 64\, \varepsilon\, |f| / \delta_k
//! ```
//!
//! by more than this bound. A wide bound decides nothing.

use super::table::Row;

/// The ratio of one `δ` to the next. With a half, values that are integers times some rounding would give the
/// same wrong quotient again and again.
const RATIO: f64 = 0.45;
/// The first `δ` that is tried, `3·10⁻⁴ ℓ`. For most fields it decides.
const FIRST: i32 = 10;
/// The coarsest and the finest `δ`, from `4·10⁻³ ℓ` to `3·10⁻⁶ ℓ`.
const COARSEST: i32 = 7;
const FINEST: i32 = 16;
/// The finest `δ` of a field that has no values at coarser ones, or changes too fast for them.
const LIMIT: i32 = 36;
/// Quotients that the rounding of the values is read off.
const NOISY: usize = 5;
/// A bound is narrow if it is below this fraction of the derivative, or of the values over `ℓ`; to agree
/// at once, it must be narrower.
const NARROW: f64 = 1e-2;
const NARROW_AT_ONCE: f64 = 1e-4;
const NARROW_BESIDE_VALUES: f64 = 1e-8;
/// The rounding of a derivative, relative to itself and to the largest one of the other entries.
#[derive(Clone, Copy, Debug)]
pub struct Rounding {
    itself: f64,
    others: f64,
}

/// The rounding of a closure, evaluated by dual numbers.
pub(super) const OF_CLOSURES: Rounding = Rounding { itself: 1e-9, others: 64.0 * f64::EPSILON };

/// The rounding of a tensor that solves with a metric, which multiplies it by the condition number.
pub const OF_SOLUTIONS: Rounding = Rounding { itself: 1e-6, others: 1e-9 };

/// Appends the values of all entries at a distance along the direction; `None` if there are no values.
pub type Values<'a> = &'a dyn Fn(f64, &mut Row) -> Option<()>;

/// A derivative that is not that of the values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mismatch {
    /// The derivative by dual numbers.
    pub derivative: f64,
    /// The difference quotient of the values.
    pub quotient: f64,
}

/// The derivatives of the entries of a field along a direction.
#[derive(Clone, Debug)]
pub struct Derivatives {
    /// The size of the coordinate along which they are taken.
    pub scale: f64,
    /// The derivatives.
    pub df: Row,
    /// The units of the entries.
    pub units: Row,
    /// Their rounding.
    pub rounding: Rounding,
}

/// No quotient has a narrow bound.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Undecided;

/// A difference quotient of one entry.
#[derive(Clone, Copy)]
struct Quotient {
    delta: f64,
    slope: f64,
    /// The size of the values.
    size: f64,
}

impl Quotient {
    /// Computes the quotient of two values; `None` if it is not finite.
    fn of(delta: f64, right: f64, left: f64) -> Option<Self> {
        let slope = (right - left) / (2.0 * delta);
        let size = right.abs().max(left.abs());
        slope.is_finite().then_some(Self { delta, slope, size })
    }
}

impl Derivatives {
    /// Compares the derivatives with the values of the entries.
    pub fn compare(&self, f: Values<'_>) -> Option<Mismatch> {
        let at = |k| self.quotients(k, f);
        if self.agree_at_once(f).is_some() {
            return None;
        }
        let mut levels: Vec<_> = (COARSEST..=FINEST).filter_map(at).collect();
        let largest = self.largest();
        let compared = |levels: &[Vec<Quotient>]| -> Vec<_> {
            (0..self.df.len()).map(|i| self.mismatch(i, levels, largest)).collect()
        };
        let agrees = |found: &Result<Option<Mismatch>, Undecided>| *found == Ok(None);
        if levels.len() < NOISY || !compared(&levels).iter().all(agrees) {
            levels.extend((FINEST + 1..=LIMIT).filter_map(at));
        }
        compared(&levels).into_iter().find_map(|found| found.ok().flatten())
    }

    /// The mismatch of the `i`-th entry with the quotient of the smallest bound.
    fn mismatch(
        &self,
        i: usize,
        levels: &[Vec<Quotient>],
        largest: f64,
    ) -> Result<Option<Mismatch>, Undecided> {
        let (quotient, bound) = self.best(i, levels)?;
        let derivative = self.df[i];
        let wrong = (quotient - derivative).abs() > bound + self.rounded(i, largest);
        Ok(wrong.then_some(Mismatch { derivative, quotient }))
    }

    /// The quotients of all entries at `δ_k`; `None` where a value is not finite.
    fn quotients(&self, k: i32, f: Values<'_>) -> Option<Vec<Quotient>> {
        let (delta, n) = (self.scale * RATIO.powi(k), self.df.len());
        let mut values = Row::with_capacity(2 * n);
        f(delta, &mut values)?;
        f(-delta, &mut values)?;
        (0..n).map(|i| Quotient::of(delta, values[i], values[i + n])).collect()
    }

    /// Returns `Some` if each derivative agrees with a quotient of a narrow bound, whatever the rounding is.
    fn agree_at_once(&self, f: Values<'_>) -> Option<()> {
        let (deltas, n) = ([FIRST - 1, FIRST].map(|k| self.scale * RATIO.powi(k)), self.df.len());
        let mut values = Row::with_capacity(4 * n);
        for delta in deltas {
            f(delta, &mut values)?;
            f(-delta, &mut values)?;
        }
        let largest = self.largest();
        for i in 0..n {
            let coarse = Quotient::of(deltas[0], values[i], values[i + n])?;
            let fine = Quotient::of(deltas[1], values[i + 2 * n], values[i + 3 * n])?;
            let bound = 8.0 * (fine.slope - coarse.slope).abs() + self.rounding(i, &fine);
            let agrees = (fine.slope - self.df[i]).abs() <= bound + self.rounded(i, largest);
            (agrees && self.is_narrow(i, &fine, bound, NARROW_AT_ONCE)).then_some(())?;
        }
        Some(())
    }

    /// The quotient of the `i`-th entry with the smallest bound, and this bound, if it is narrow. A finer
    /// quotient that contradicts it takes its place, because the coarser `δ` did not resolve the field.
    fn best(&self, i: usize, levels: &[Vec<Quotient>]) -> Result<(f64, f64), Undecided> {
        // Rounding may make different values equal: `1 − cos q` at q = 10⁻⁹.
        let seen: Vec<_> = levels.iter().map(|level| level[i]).filter(|q| q.slope != 0.0).collect();
        if seen.is_empty() {
            return Ok((self.df[i], 0.0));
        }
        let change = |pair: &[Quotient]| (pair[1].slope - pair[0].slope).abs();
        let rounding = seen.windows(2).rev().take(NOISY).map(|pair| change(pair) * pair[1].delta);
        let rounding = rounding.fold(0.0, f64::max);
        // Two quotients may agree by chance. So no bound falls faster than quotients converge.
        let (mut error, mut best) = (f64::INFINITY, None);
        for pair in seen.windows(2) {
            error = change(pair).max(if error.is_finite() { error / 8.0 } else { 0.0 });
            let here = pair[1];
            let bound = 8.0 * (error + rounding / here.delta) + self.rounding(i, &here);
            let better = best.is_none_or(|(slope, smallest): (f64, f64)| {
                bound < smallest || (here.slope - slope).abs() > bound + smallest
            });
            if better && self.is_narrow(i, &here, bound, NARROW) {
                best = Some((here.slope, bound));
            }
        }
        best.ok_or(Undecided)
    }

    /// The rounding of a quotient, from that of the values and of the points.
    fn rounding(&self, i: usize, at: &Quotient) -> f64 {
        // Values below the least one with digits are zeros.
        let least = f64::MIN_POSITIVE / f64::EPSILON;
        let of_values = f64::EPSILON * (64.0 * at.size + 4.0 * self.df[i].abs() * self.scale);
        (of_values + least) / at.delta
    }

    /// The largest derivative in the units of its entry.
    fn largest(&self) -> f64 {
        self.df.iter().zip(&self.units).map(|(df, unit)| (df / unit).abs()).fold(0.0, f64::max)
    }

    /// The rounding of a derivative beside the [largest](Self::largest) one.
    fn rounded(&self, i: usize, largest: f64) -> f64 {
        let others = largest * self.units[i];
        self.rounding.itself * self.df[i].abs() + self.rounding.others * others
    }

    fn is_narrow(&self, i: usize, at: &Quotient, bound: f64, fraction: f64) -> bool {
        let change = NARROW_BESIDE_VALUES * at.size / self.scale;
        bound <= fraction * (at.slope.abs() + self.df[i].abs()) + change
    }
}
