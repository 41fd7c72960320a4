//! Whether an error stays where it is over a long run.

use std::fmt;

/// Shares of the run that are watched separately.
const TENTHS: usize = 10;
/// Fewest values from which a growth is read: ten in each tenth.
const NEEDED: usize = 100;

/// Watches the error of a run in constant memory, and tells whether it grows.
///
/// Two numbers tell the growths apart, both from the ten tenths of the run. The growth exponent
/// `γ = −log₁₀ (mean range of a tenth / range of the run)` is 0 for an error that covers its range
/// again and again, ½ for a random walk and 1 for a line (the rescaled range of Hurst 1951). And
/// `τ = |slope| / standard error` finds a line under noise, see [`Drift::slope`].
///
/// # Examples
///
/// ```
/// use metriplectic_studies::{Drift, Growth};
///
/// let mut drift = Drift::over(100_000);
/// for step in 0..100_000 {
///     drift.push(1e-15 * (0.3 * f64::from(step)).sin());
/// }
/// assert_eq!(drift.growth(), Some(Growth::Flat));
/// assert!(drift.ratio() < 1.01);
/// ```
#[derive(Clone, Debug)]
pub struct Drift {
    total: usize,
    count: usize,
    tenths: [Tenth; TENTHS],
}

/// How the error of a run grows with the number of steps `n`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Growth {
    /// Not at all: noise or a bounded oscillation.
    Flat,
    /// As `√n`: independent errors that add up.
    Walk,
    /// As `n`: an error made again and again.
    Linear,
}

/// The slope of the least-squares line through the signed error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slope {
    /// Change of the error per step.
    pub per_step: f64,
    /// Its standard error.
    pub standard_error: f64,
}

impl Drift {
    /// Watches a run of `total_steps` values.
    #[must_use]
    pub fn over(total_steps: usize) -> Self {
        Self { total: total_steps.max(1), count: 0, tenths: [Tenth::EMPTY; TENTHS] }
    }

    /// Takes the next signed error. Values past the announced total count as the last tenth.
    pub fn push(&mut self, value: f64) {
        let tenth = (self.count.saturating_mul(TENTHS) / self.total).min(TENTHS - 1);
        self.tenths[tenth].push(self.count as f64, value);
        self.count += 1;
    }

    /// The largest `|value|` of the first tenth of the run; NaN if a value was, or if there is none.
    #[must_use]
    pub fn first_tenth_worst(&self) -> f64 {
        self.tenths[0].worst()
    }

    /// The largest `|value|` of the last tenth of the run; NaN if a value was, or if the run has
    /// not reached it.
    #[must_use]
    pub fn last_tenth_worst(&self) -> f64 {
        self.tenths[TENTHS - 1].worst()
    }

    /// The largest `|value|` so far; NaN if a value was, or if there is none.
    #[must_use]
    pub fn worst(&self) -> f64 {
        self.filled().map(Tenth::worst).reduce(larger).unwrap_or(f64::NAN)
    }

    /// Worst of the last tenth over worst of the first: near 1 for a flat error, 10 for a line from
    /// zero. An error that stays zero has ratio 1, one that leaves zero has ratio ∞.
    #[must_use]
    pub fn ratio(&self) -> f64 {
        let (first, last) = (self.first_tenth_worst(), self.last_tenth_worst());
        if first <= 0.0 && last <= 0.0 { 1.0 } else { last / first }
    }

    /// The least-squares slope `Σ (n − n̄)(e − ē) / Σ (n − n̄)²` over all values.
    ///
    /// Its standard error is taken from the means of the tenths about the line,
    /// `√(Σ r_k² / (b − 2) / Σ (n_k − n̄)²)` with `b = 10` of them: the usual formula, over single
    /// values, holds the steps of a run to be independent and would be far too sure. It is infinite
    /// before the third tenth.
    #[must_use]
    pub fn slope(&self) -> Slope {
        let line = self.filled().fold(Sums::EMPTY, |sum, tenth| sum.merged(&tenth.sums));
        let (mut squares, mut lever) = (0.0, 0.0);
        for tenth in self.filled() {
            let n = tenth.sums.mean_n - line.mean_n;
            squares += (tenth.sums.mean_e - line.mean_e - line.slope() * n).powi(2);
            lever += n * n;
        }
        let free = self.filled().count().saturating_sub(2) as f64;
        let standard_error =
            if free > 0.0 { (squares / free / lever).sqrt() } else { f64::INFINITY };
        Slope { per_step: line.slope(), standard_error }
    }

    /// How the error grows: a line if `τ > 20` or `γ > 0.8`, or if `τ > 8` at `γ < ¼`; else flat if
    /// `γ < ¼`, else a random walk.
    ///
    /// `None` if the run is not complete, shorter than 100 steps, or not finite. A random walk
    /// passes for another growth about twice in a hundred; an oscillation must have a period below
    /// a tenth of the run to be seen as one.
    #[must_use]
    pub fn growth(&self) -> Option<Growth> {
        if self.count < self.total.max(NEEDED) || !self.worst().is_finite() {
            return None;
        }
        let (exponent, certainty) = (self.exponent(), self.slope().certainty());
        let flat = exponent < 0.25;
        let linear = certainty > 20.0 || exponent > 0.8 || (flat && certainty > 8.0);
        Some(match (linear, flat) {
            (true, _) => Growth::Linear,
            (false, true) => Growth::Flat,
            (false, false) => Growth::Walk,
        })
    }

    /// The growth exponent `γ`; 0 for an error that never changes.
    fn exponent(&self) -> f64 {
        let mean = self.filled().map(|t| t.high - t.low).sum::<f64>() / TENTHS as f64;
        let low = self.filled().map(|t| t.low).fold(f64::INFINITY, f64::min);
        let high = self.filled().map(|t| t.high).fold(f64::NEG_INFINITY, f64::max);
        if high > low { -(mean / (high - low)).log10() } else { 0.0 }
    }

    fn filled(&self) -> impl Iterator<Item = &Tenth> {
        self.tenths.iter().filter(|tenth| !tenth.is_empty())
    }
}

impl Slope {
    /// `τ`, the slope in standard errors; 0 for a slope of zero.
    fn certainty(&self) -> f64 {
        let size = self.per_step.abs();
        if size > 0.0 { size / self.standard_error } else { 0.0 }
    }
}

/// `worst 3.1e-16, tenths 2.2e-16 → 3.0e-16 (× 1.36), slope 1.2e-21 ± 3.0e-21 per step: flat`
impl fmt::Display for Drift {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (first, last) = (self.first_tenth_worst(), self.last_tenth_worst());
        write!(f, "worst {:.1e}, tenths {first:.1e} → {last:.1e}", self.worst())?;
        write!(f, " (× {:.2}), slope {} per step: ", self.ratio(), self.slope())?;
        match self.growth() {
            Some(growth) => growth.fmt(f),
            None => write!(f, "undecided after {} of {} steps", self.count, self.total),
        }
    }
}

/// `1.2e-21 ± 3.0e-21`
impl fmt::Display for Slope {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.1e} ± {:.1e}", self.per_step, self.standard_error)
    }
}

/// `flat`, `random walk` or `linear`.
impl fmt::Display for Growth {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Flat => "flat",
            Self::Walk => "random walk",
            Self::Linear => "linear",
        })
    }
}

/// One tenth of the run.
#[derive(Clone, Copy, Debug)]
struct Tenth {
    low: f64,
    high: f64,
    worst: f64,
    sums: Sums,
}

impl Tenth {
    const EMPTY: Self =
        Self { low: f64::INFINITY, high: f64::NEG_INFINITY, worst: 0.0, sums: Sums::EMPTY };

    fn push(&mut self, step: f64, value: f64) {
        self.low = self.low.min(value);
        self.high = self.high.max(value);
        self.worst = larger(self.worst, value.abs());
        self.sums.push(step, value);
    }

    fn is_empty(&self) -> bool {
        self.sums.count < 0.5
    }

    fn worst(&self) -> f64 {
        if self.is_empty() { f64::NAN } else { self.worst }
    }
}

/// The sums that a least-squares line needs of the values `(n, e)`, updated without cancellation
/// (Chan et al. 1983, pairwise updating).
#[derive(Clone, Copy, Debug)]
struct Sums {
    count: f64,
    mean_n: f64,
    mean_e: f64,
    /// `Σ (n − n̄)²`
    spread: f64,
    /// `Σ (n − n̄)(e − ē)`
    joint: f64,
}

impl Sums {
    const EMPTY: Self = Self { count: 0.0, mean_n: 0.0, mean_e: 0.0, spread: 0.0, joint: 0.0 };

    fn push(&mut self, n: f64, e: f64) {
        *self = self.merged(&Self { count: 1.0, mean_n: n, mean_e: e, ..Self::EMPTY });
    }

    fn merged(&self, other: &Self) -> Self {
        let count = self.count + other.count;
        let fraction = if count > 0.0 { other.count / count } else { 0.0 };
        let (dn, de) = (other.mean_n - self.mean_n, other.mean_e - self.mean_e);
        Self {
            count,
            mean_n: self.mean_n + fraction * dn,
            mean_e: self.mean_e + fraction * de,
            spread: self.spread + other.spread + self.count * fraction * dn * dn,
            joint: self.joint + other.joint + self.count * fraction * dn * de,
        }
    }

    fn slope(&self) -> f64 {
        if self.spread > 0.0 { self.joint / self.spread } else { 0.0 }
    }
}

/// The larger of two, and NaN if either is: `f64::max` would hide a failed step.
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};

    use super::*;

    const STEPS: u32 = 20_000;

    fn watched(mut error: impl FnMut(f64) -> f64) -> Drift {
        let mut drift = Drift::over(STEPS as usize);
        (0..STEPS).for_each(|step| drift.push(error(f64::from(step))));
        drift
    }

    /// Runs with this growth, of a hundred seeds.
    fn runs(growth: Growth, error: impl Fn(f64, &mut ChaCha8Rng) -> f64) -> usize {
        let seeded = |seed| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            watched(|n| error(n, &mut rng)).growth()
        };
        (0..100).filter(|&seed| seeded(seed) == Some(growth)).count()
    }

    fn noise(rng: &mut ChaCha8Rng) -> f64 {
        1e-16 * rng.random_range(-1.0..1.0)
    }

    #[test]
    fn noise_is_flat() {
        assert_eq!(runs(Growth::Flat, |_, rng| 1e-15 + noise(rng)), 100);
    }

    #[test]
    fn a_walk_is_a_walk() {
        let walk = |seed| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let mut sum = 0.0;
            watched(|_| {
                sum += noise(&mut rng);
                sum
            })
        };
        let walks = (0..200).filter(|&seed| walk(seed).growth() == Some(Growth::Walk)).count();
        assert!(walks >= 190, "{walks} of 200");
    }

    #[test]
    fn a_drift_is_linear_bare_and_under_noise() {
        let bare = watched(|n| -1e-20 * n);
        assert_eq!(bare.growth(), Some(Growth::Linear));
        assert!((bare.ratio() - 10.0).abs() < 0.01, "{bare}");
        let per_step = 1e-16 / f64::from(STEPS);
        for times in [1.0, 5.0, 30.0] {
            let found = runs(Growth::Linear, |n, rng| times * per_step * n + noise(rng));
            assert_eq!(found, 100, "drift of {times} times the noise");
        }
    }

    #[test]
    fn an_oscillation_is_flat() {
        let drift = watched(|n| (n * 0.011).sin());
        assert_eq!(drift.growth(), Some(Growth::Flat), "{drift}");
        assert!((drift.ratio() - 1.0).abs() < 1e-3);
    }

    #[test]
    fn the_slope_is_the_least_squares_one() {
        let drift = watched(|n| 3.0 + 2.0 * n + if n < 1.0 { 1.0 } else { 0.0 });
        let m = f64::from(STEPS);
        // One value e at n = 0 adds −e n̄ / Σ (n − n̄)² = −6 e / (m (m + 1)).
        let expected = 2.0 - 6.0 / (m * (m + 1.0));
        assert!((drift.slope().per_step - expected).abs() < 1e-13, "{drift}");
    }

    #[test]
    fn the_standard_error_does_not_believe_in_independent_steps() {
        let slow = watched(|n| (n * 0.001).sin());
        let slope = slow.slope();
        assert!(slope.per_step.abs() < 3.0 * slope.standard_error, "{slow}");
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let fast = watched(|_| noise(&mut rng)).slope();
        let usual = 1e-16 / 3_f64.sqrt() * 12_f64.sqrt() / f64::from(STEPS).powf(1.5);
        assert!((0.3..2.0).contains(&(fast.standard_error / usual)), "{fast}");
    }

    #[test]
    fn the_worst_are_of_their_tenths() {
        let mut drift = Drift::over(100);
        (0..100).for_each(|n| drift.push(-f64::from(n)));
        let worst = (drift.first_tenth_worst(), drift.last_tenth_worst(), drift.worst());
        assert_eq!(worst, (9.0, 99.0, 99.0));
        assert_eq!(drift.growth(), Some(Growth::Linear));
        drift.push(-1000.0);
        assert!((drift.last_tenth_worst() - 1000.0).abs() < 1e-9);
    }

    #[test]
    fn zeros_are_flat() {
        let drift = watched(|_| 0.0);
        assert_eq!(drift.growth(), Some(Growth::Flat));
        assert!((drift.ratio() - 1.0).abs() < 1e-15);
        let leaving = watched(|n| if n > 15_000.0 { 1.0 } else { 0.0 });
        assert!(leaving.ratio().is_infinite());
    }

    #[test]
    fn a_failed_step_is_not_forgotten() {
        let drift = watched(|n| if n > 99.0 && n < 101.0 { f64::NAN } else { 1.0 });
        assert!(drift.worst().is_nan() && drift.first_tenth_worst().is_nan());
        assert!((drift.last_tenth_worst() - 1.0).abs() < 1e-15);
        assert_eq!(drift.growth(), None);
    }

    #[test]
    fn an_unfinished_run_is_undecided() {
        let mut drift = Drift::over(1000);
        (0..500).for_each(|_| drift.push(1.0));
        assert_eq!(drift.growth(), None);
        assert!(drift.last_tenth_worst().is_nan());
        assert!(drift.to_string().ends_with("undecided after 500 of 1000 steps"), "{drift}");
        assert!(Drift::over(0).worst().is_nan());
    }

    #[test]
    fn it_prints_on_one_line() {
        let drift = watched(|n| 1e-16 * (n + 1.0));
        let expected = "worst 2.0e-12, tenths 2.0e-13 → 2.0e-12 (× 10.00), slope 1.0e-16 ± ";
        assert!(drift.to_string().starts_with(expected), "{drift}");
        assert!(drift.to_string().ends_with(" per step: linear"), "{drift}");
    }
}
