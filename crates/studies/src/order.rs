//! The order of convergence a method is measured to have.

use std::fmt;

use crate::student;

/// Fewest points a fit is trusted with.
const NEEDED: usize = 4;
/// Points of the coarse end from which a plateau is first suspected.
const COARSE: usize = 3;
/// A point used in the fit stands this far above the plateau, so that round-off contaminates it by
/// a tenth at most.
const CLEARANCE: f64 = 10.0;
/// The order of the lowest schemes. Errors that fall by less than half of this order have ceased to fall,
/// whatever the slope before: on data that are mostly plateau, the median slope is small too.
const LOWEST_ORDER: f64 = 1.0;

/// The fitted order `p` of `error ≈ C hᵖ`, with its uncertainty and the points it rests on.
///
/// # Examples
///
/// ```
/// use metriplectic_studies::Order;
///
/// let steps = [0.1, 0.05, 0.025, 0.0125, 1e-7, 1e-9];
/// let errors = steps.map(|h: f64| (3.0 * h * h).max(1e-15));
/// let order = Order::fit(&steps, &errors)?;
/// assert_eq!(order.to_string(), "2.00 [2.00, 2.00]");
/// assert_eq!(order.plateau, [5]);
/// # Ok::<(), metriplectic_studies::OrderError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Order {
    /// The slope of `ln error` over `ln h`.
    pub slope: f64,
    /// The constant `C` of `error ≈ C hᵖ`.
    pub constant: f64,
    /// The 95 % confidence interval of the slope.
    pub interval: (f64, f64),
    /// Indices, into the slices given, of the points in the fit, from the largest step down.
    pub used: Vec<usize>,
    /// Indices of the points left out as round-off, from the largest step down.
    pub plateau: Vec<usize>,
}

/// Why no order could be fitted.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OrderError {
    /// The slices differ in length.
    #[error("{steps} steps but {errors} errors; give one error for each step")]
    LengthMismatch {
        /// Number of steps.
        steps: usize,
        /// Number of errors.
        errors: usize,
    },
    /// A step has no logarithm.
    #[error("step {index} is {value}; steps must be positive and finite")]
    InvalidStep {
        /// Index of the step.
        index: usize,
        /// The step.
        value: f64,
    },
    /// An error has no logarithm.
    #[error(
        "error {index} is {value}; errors must be positive and finite: \
         leave out a run that met its reference exactly, shorten the step of one that failed"
    )]
    InvalidError {
        /// Index of the error.
        index: usize,
        /// The error.
        value: f64,
    },
    /// A step occurs twice.
    #[error("steps {first} and {second} are both {value}; measure each step once")]
    RepeatedStep {
        /// Index of one of the two.
        first: usize,
        /// Index of the other.
        second: usize,
        /// The step.
        value: f64,
    },
    /// Too few points are left for a slope with an uncertainty.
    #[error(
        "{found} points above round-off ({dropped} dropped), {needed} needed; \
         add steps above the largest, or use a more accurate reference"
    )]
    TooFewPoints {
        /// Points above round-off.
        found: usize,
        /// Points dropped as round-off.
        dropped: usize,
        /// Points needed.
        needed: usize,
    },
    /// The errors do not fall with the step: every point lies on the plateau.
    #[error(
        "the {points} errors between {low:.1e} and {high:.1e} do not fall with the step \
         (slope {slope:.2}, 95 % interval from {lower:.2}); enlarge the steps until they do"
    )]
    AllPlateau {
        /// Number of points.
        points: usize,
        /// The smallest error.
        low: f64,
        /// The largest error.
        high: f64,
        /// The slope of the points.
        slope: f64,
        /// The lower end of its 95 % interval.
        lower: f64,
    },
}

metriplectic_equations::debug_is_the_sentence!(OrderError);

impl Order {
    /// Fits `ln error = ln C + p ln h` by ordinary least squares, `error[i]` measured at `steps[i]`,
    /// in any order. The interval is `p ± t₀.₉₅(m−2) σ_p` of Student's t with `m − 2` degrees of
    /// freedom, `m` the number of points used.
    ///
    /// The points at the fine end where round-off takes over are left out, as follows. Going from
    /// the largest step down, let the first `k ≥ 3` points have the fitted slope `p_k`. The rest is
    /// the plateau if
    ///
    /// 1. none of its points falls from the `k`-th step on by half of what `p_k` predicts (the fit
    ///    is the yardstick rather than the neighbour: on a plateau, a neighbour may fall by luck),
    /// 2. and together they fall by less than order ½, or than half of the median slope from point
    ///    to point (errors that keep falling are the asymptotic range after a bad start, no
    ///    round-off).
    ///
    /// Then the points within a factor of ten of the plateau go too, since round-off contaminates
    /// them. A last point that round-off lifts by less than half of its predicted fall stays in the
    /// fit; the interval shows it.
    ///
    /// # Errors
    ///
    /// - [`OrderError::LengthMismatch`], [`OrderError::InvalidStep`], [`OrderError::InvalidError`],
    ///   [`OrderError::RepeatedStep`] if the data are not `m` distinct steps with positive, finite
    ///   errors;
    /// - [`OrderError::TooFewPoints`] if fewer than four points are above round-off;
    /// - [`OrderError::AllPlateau`] if the errors do not fall significantly.
    pub fn fit(steps: &[f64], errors: &[f64]) -> Result<Self, OrderError> {
        let points = sorted(steps, errors)?;
        let used = above_plateau(&points);
        let (kept, dropped) = points.split_at(used);
        if kept.len() < NEEDED {
            let (found, dropped) = (kept.len(), dropped.len());
            return Err(OrderError::TooFewPoints { found, dropped, needed: NEEDED });
        }
        let line = Line::through(kept);
        let t = student::two_sided(0.95, kept.len() - 2);
        let half = t * line.slope_deviation(kept);
        let falls = line.slope - half > 0.0;
        if !falls {
            return Err(all_plateau(kept, line.slope, half));
        }
        Ok(Self {
            slope: line.slope,
            constant: line.at(0.0).exp(),
            interval: (line.slope - half, line.slope + half),
            used: indices(kept),
            plateau: indices(dropped),
        })
    }

    /// Whether the slope is within `band` of `expected` *and* known that well: the interval reaches
    /// no farther than `band` from the slope, so that noise cannot pass for agreement.
    #[must_use]
    pub fn agrees(&self, expected: f64, band: f64) -> bool {
        let half = 0.5 * (self.interval.1 - self.interval.0);
        (self.slope - expected).abs() <= band && half <= band
    }
}

/// `2.00 [1.99, 2.01]`: the slope and its interval.
impl fmt::Display for Order {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.2} [{:.2}, {:.2}]", self.slope, self.interval.0, self.interval.1)
    }
}

/// One measurement: `x = ln h`, `y = ln error`.
#[derive(Clone, Copy, Debug)]
struct Point {
    index: usize,
    x: f64,
    y: f64,
}

/// The least-squares line `y = ȳ + p (x − x̄)`.
#[derive(Clone, Copy, Debug)]
struct Line {
    slope: f64,
    mean_x: f64,
    mean_y: f64,
    /// `Σ (x − x̄)²`
    spread: f64,
}

impl Line {
    fn through(points: &[Point]) -> Self {
        let m = points.len() as f64;
        let mean_x = points.iter().map(|p| p.x).sum::<f64>() / m;
        let mean_y = points.iter().map(|p| p.y).sum::<f64>() / m;
        let spread: f64 = points.iter().map(|p| (p.x - mean_x).powi(2)).sum();
        let joint: f64 = points.iter().map(|p| (p.x - mean_x) * (p.y - mean_y)).sum();
        Self { slope: joint / spread, mean_x, mean_y, spread }
    }

    fn at(&self, x: f64) -> f64 {
        self.mean_y + self.slope * (x - self.mean_x)
    }

    /// `σ_p = √(Σ r² / (m − 2) / Σ (x − x̄)²)`, `r` the residuals.
    fn slope_deviation(&self, points: &[Point]) -> f64 {
        let squares: f64 = points.iter().map(|p| (p.y - self.at(p.x)).powi(2)).sum();
        (squares / (points.len() as f64 - 2.0) / self.spread).sqrt()
    }
}

/// The points from the largest step down, checked.
fn sorted(steps: &[f64], errors: &[f64]) -> Result<Vec<Point>, OrderError> {
    if steps.len() != errors.len() {
        return Err(OrderError::LengthMismatch { steps: steps.len(), errors: errors.len() });
    }
    let invalid = |values: &[f64]| values.iter().position(|v| !(v.is_finite() && *v > 0.0));
    if let Some(index) = invalid(steps) {
        return Err(OrderError::InvalidStep { index, value: steps[index] });
    }
    if let Some(index) = invalid(errors) {
        return Err(OrderError::InvalidError { index, value: errors[index] });
    }
    let mut order: Vec<usize> = (0..steps.len()).collect();
    order.sort_by(|&i, &j| steps[j].total_cmp(&steps[i]));
    let mut pairs = order.iter().zip(order.iter().skip(1));
    if let Some((&first, &second)) = pairs.find(|(i, j)| steps[**i] <= steps[**j]) {
        return Err(OrderError::RepeatedStep { first, second, value: steps[first] });
    }
    let point = |index: usize| Point { index, x: steps[index].ln(), y: errors[index].ln() };
    Ok(order.into_iter().map(point).collect())
}

/// How many of the points, from the largest step down, are clear of round-off.
fn above_plateau(points: &[Point]) -> usize {
    let typical = typical_slope(points);
    let plateau = (COARSE..points.len()).find(|&k| is_plateau(points, k, typical));
    plateau.map_or(points.len(), |k| {
        // Its first two points only: past them, accumulated round-off may rise again.
        let level = points[k..].iter().take(2).map(|p| p.y).fold(f64::NEG_INFINITY, f64::max);
        points[..k].iter().take_while(|p| p.y > level + CLEARANCE.ln()).count()
    })
}

/// The two conditions of [`Order::fit`] on the points from the `k`-th on.
fn is_plateau(points: &[Point], k: usize, typical: f64) -> bool {
    let (coarse, rest) = points.split_at(k);
    let line = Line::through(coarse);
    let start = points[k - 1].x;
    let above = |p: &Point| p.y - line.at(p.x) > 0.5 * line.slope * (start - p.x);
    // A single point has a slope only with its neighbour.
    let tail = if rest.len() < 2 { &points[k - 1..] } else { rest };
    let flat = Line::through(tail).slope < 0.5 * typical.max(LOWEST_ORDER);
    line.slope > 0.0 && flat && rest.iter().all(above)
}

/// The median of the slopes from point to point.
fn typical_slope(points: &[Point]) -> f64 {
    let pairs = points.iter().zip(points.iter().skip(1));
    let mut slopes: Vec<f64> = pairs.map(|(a, b)| (a.y - b.y) / (a.x - b.x)).collect();
    slopes.sort_by(f64::total_cmp);
    slopes.get(slopes.len() / 2).copied().unwrap_or(0.0)
}

fn all_plateau(points: &[Point], slope: f64, half: f64) -> OrderError {
    let errors = points.iter().map(|p| p.y.exp());
    OrderError::AllPlateau {
        points: points.len(),
        low: errors.clone().fold(f64::INFINITY, f64::min),
        high: errors.fold(0.0, f64::max),
        slope,
        lower: slope - half,
    }
}

fn indices(points: &[Point]) -> Vec<usize> {
    points.iter().map(|p| p.index).collect()
}

#[cfg(test)]
mod tests;
