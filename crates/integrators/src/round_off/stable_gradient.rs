//! A discrete gradient at real points, safe against round-off.

use std::borrow::Borrow;

use metriplectic_fields::{
    Column, Dimension, Matrix, ScalarField, Space, Square, Vector, along_slopes, power_of_two,
};
use metriplectic_manifolds::{InnerProduct, Manifold, MetricSlopes, Nodes, StepPathJet};

use super::bound::SUMMED;
use crate::step::both;

/// A field along one path: the data of a discrete gradient at `f64`.
///
/// The defect `δ = F(x') − F(x) − ⟨w̄, d⟩` of a mean covector `w̄` is of third order, so the difference of the two values
/// loses it in round-off as the step gets short: its error `ε|F|` enters the covector as `ε|F|/|d|`.
/// The fundamental theorem of calculus gives the same number without the cancellation,
///
/// ```math
/// \delta = \int_0^1 \bigl( f(s) - \langle\bar w, d\rangle \bigr) ds, \qquad
/// f(s) = dF(\gamma(s))\,\gamma'(s) ,
/// ```
///
/// here by the three-point Hermite rule with end corrections
/// `∫f = (7f(0) + 16f(½) + 7f(1))/30 − (f'(1) − f'(0))/60`, exact to degree 5. Where the difference
/// is short of digits the two are averaged with the inverse squares of their error estimates; the
/// weight changes smoothly and switches nothing off.
#[derive(Clone, Debug)]
pub struct StableGradient<M: Space> {
    /// The mean covector `w̄`.
    mean: Vector<M>,
    /// The defect `F(x') − F(x) − ⟨w̄, d⟩`.
    defect: f64,
    /// The size of the terms of the slope `⟨w̄, d⟩` ([`Manifold::pairing_size`]).
    change: f64,
    /// The size of a rounding error in a difference of two values of `F`.
    rounding: f64,
    /// The part of it that is left in the defect.
    noise: f64,
}

/// The path that the stable gradients of all fields share.
#[derive(Debug)]
pub struct Segment<'a, M: Space> {
    /// The displacement `d` at the base point.
    pub d: &'a Vector<M>,
    /// The sizes of the entries of the end `x'`, one for each component ([`Manifold::scales`]).
    pub scales: Vector<M>,
}

impl<'a, M: Manifold> Segment<'a, M> {
    /// Makes the segment of a path with the displacement `d` and the end `x'`.
    #[inline]
    pub fn new(d: &'a Vector<M>, end: &M::Point<f64>) -> Self {
        Self { d, scales: M::scales(end) }
    }
}

/// The fraction of `|F| + Σ_i |∂_iF x_i|` by which a step changes `F`, at which a difference of two values of
/// `F` starts to be trusted; from four times that fraction on it is trusted alone.
/// A factor of four fails `tests/tangent/schemes.rs::tangents_of_schemes_are_those_of_differences`.
const SHORT: f64 = 1e-3;

/// The weight of an integral against a difference of two values of size `size` that is about
/// `change`: it falls from 1 to 0 between one and four times the short fraction, with zero slope at both.
#[inline]
pub(crate) fn short(change: f64, size: f64) -> f64 {
    if change.abs() >= 4.0 * SHORT * size && size > 0.0 {
        return 0.0;
    }
    if change.abs() <= SHORT * size {
        return 1.0;
    }
    let fraction = change.abs() / (SHORT * size).max(f64::MIN_POSITIVE);
    let t = ((fraction - 1.0) / 3.0).clamp(0.0, 1.0);
    1.0 - t * t * (3.0 - 2.0 * t)
}

/// The defect as an integral over the nodes of the path, and its weight against a difference with the
/// error `rounding`.
fn safer<M: Space>(
    f: &impl ScalarField<M>,
    Nodes { ends: [x, y], middle }: &Nodes<M>,
    base: impl FnOnce() -> f64,
    slope: f64,
    rounding: f64,
) -> (f64, f64) {
    let middle = middle.as_ref().map_or_else(base, |z| f.at_real(z).eps1);
    let slopes = both([x, y], |x| {
        let f = f.at_real(x);
        [f.eps1, f.eps1eps2]
    });
    integral(slopes, middle, slope, rounding)
}

/// The defect as an integral, and its weight against a difference with the error `rounding`, from the first and the second
/// derivative of `F` at both ends of a path and the first one in its middle, less the slope `⟨w̄, d⟩`.
#[inline]
pub(crate) fn integral(ends: [[f64; 2]; 2], middle: f64, slope: f64, rounding: f64) -> (f64, f64) {
    let integral = Integral::new(ends, middle, slope);
    (integral.value, integral.weight(rounding))
}

/// How far the derivative of a defect, a difference of nearly equal numbers, is above its own round-off: 1 where it is, and 0 where
/// nothing is left of it.
#[inline]
pub(crate) fn trust(change: f64, rounding: f64) -> f64 {
    let noise = 1e3 * rounding / change.max(f64::MIN_POSITIVE);
    (1.0 + noise.powi(2)).recip()
}

impl<M: Manifold> StableGradient<M> {
    /// Evaluates `f` along a path with the mean covector `mean`. `start` is `F(x)`, `end` is `F(x')`,
    /// `base` the slope `⟨dF(z), d⟩` at the base point, and `nodes` those of the path.
    #[inline(always)]
    pub fn new<N: Borrow<Nodes<M>>>(
        f: &impl ScalarField<M>,
        mean: &Vector<M>,
        Segment { d, scales }: &Segment<'_, M>,
        [start, end]: [f64; 2],
        base: impl FnOnce() -> f64,
        nodes: impl FnOnce() -> N,
    ) -> Self {
        let slope = mean.dot(d);
        let change = M::pairing_size(mean, d);
        let mut size = start.abs() + end.abs();
        for i in 0..M::Dim::LEN {
            size += mean[i].abs() * scales[i];
        }
        let rounding = f64::EPSILON * size;
        let difference = (end - start) - slope;
        // Far from round-off, and most often, the difference is all.
        let fraction = short(change, size);
        let (mut defect, mut noise) = (difference, rounding);
        if fraction > 0.0 {
            let (better, weight) = safer(f, nodes().borrow(), base, slope, rounding);
            defect += fraction * weight * (better - difference);
            noise *= 1.0 - fraction * weight;
        }
        Self { mean: *mean, defect, change, rounding, noise }
    }

    /// The data of the same path from its end to its start, which has the same covector.
    #[must_use]
    pub fn reversed(&self) -> Self {
        Self { defect: -self.defect, ..self.clone() }
    }

    /// Returns whether the path is so short that a difference of values has lost digits.
    pub(crate) fn is_short(&self) -> bool {
        f64::EPSILON * self.change.abs() <= SHORT * self.rounding
    }

    /// The covector `w` with `⟨w, d⟩ = F(x') − F(x) + drift_correction`.
    ///
    /// `drift_correction` is what earlier steps have left over; it is zero in the definition.
    #[inline]
    pub fn covector(
        &self,
        drift_correction: f64,
        g: &impl InnerProduct<Vector<M>>,
        d: &Vector<M>,
    ) -> Vector<M> {
        let flat = g.flat(d);
        let square = flat.dot(d);
        if underflows(square) {
            return self.mean + along_short(self.defect + drift_correction, g, d);
        }
        self.mean + flat * ((self.defect + drift_correction) / square)
    }

    /// The round-off of each component of the covector, beside that of its mean.
    #[inline]
    pub fn noise(&self, g: &impl InnerProduct<Vector<M>>, d: &Vector<M>) -> Vector<M> {
        let flat = g.flat(d);
        let square = flat.dot(d);
        if underflows(square) {
            // The defect has underflowed.
            return along_short(self.noise + f64::EPSILON * f64::MIN_POSITIVE * 16.0, g, d).abs();
        }
        flat.abs() * (self.noise / square)
    }

    /// The derivative of the covector along the unknown of the path, from that of its mean and the
    /// differential at `x'`; `slopes` are the derivatives of the metric at `z`, if it has any.
    ///
    /// It is the Jacobian of Newton's method: the derivative of the defect counts as far as it is above round-off.
    #[inline]
    pub fn slope(
        &self,
        drift_correction: f64,
        at: (&impl InnerProduct<Vector<M>>, Option<&MetricSlopes<M>>),
        path: &StepPathJet<M>,
        (dmean, df_end): (&Matrix<M>, &Vector<M>),
    ) -> Matrix<M> {
        let rows = self.defect_slope(path, (dmean, df_end)) * trust(self.change, self.rounding);
        Self::corrected_slope((self.defect + drift_correction, rows), at, path, dmean)
    }

    /// The derivative of the covector as in [`slope`](Self::slope), for a tangent: numbers that are divided by the length of the path,
    /// the defect and its derivatives, are zero where they are round-off. They are of second order in this length.
    pub(crate) fn slope_above_round_off(
        &self,
        at: (&impl InnerProduct<Vector<M>>, Option<&MetricSlopes<M>>),
        path: &StepPathJet<M>,
        (dmean, df_end): (&Matrix<M>, &Vector<M>),
    ) -> Matrix<M> {
        let terms = |k: usize| {
            (0..M::Dim::LEN).fold(0.0, |sum: f64, i| {
                let mean = (path.dd[(i, k)] * self.mean[i]).abs();
                sum + (path.dend[(i, k)] * df_end[i]).abs()
                    + mean
                    + (dmean[(i, k)] * path.d[i]).abs()
            })
        };
        let rows = self.defect_slope(path, (dmean, df_end));
        let rows = Vector::<M>::from_index(|k| but_round_off(rows[k], terms(k)));
        // The defect is an integral and a part of a difference, whose round-off is rounded once more where the integral replaces it.
        let size = SUMMED * (self.change.abs() + self.rounding) + self.noise;
        let is_noise = self.defect.abs() <= size;
        let defect = if is_noise { 0.0 } else { self.defect };
        Self::corrected_slope((defect, rows), at, path, dmean)
    }

    /// The derivative `∂δ = dF(x') ∂x' − ∂⟨w̄, d⟩` of the defect, a difference of nearly equal rows.
    #[inline]
    fn defect_slope(
        &self,
        path: &StepPathJet<M>,
        (dmean, df_end): (&Matrix<M>, &Vector<M>),
    ) -> Vector<M> {
        path.dend.transpose_times(df_end)
            - path.dd.transpose_times(&self.mean)
            - dmean.transpose_times(&path.d)
    }

    /// The derivative of `w̄ + ♭d δ/G(d, d)`, from the defect `δ` and its derivative.
    #[inline]
    fn corrected_slope(
        (defect, rows): (f64, Vector<M>),
        (g, slopes): (&impl InnerProduct<Vector<M>>, Option<&MetricSlopes<M>>),
        path: &StepPathJet<M>,
        dmean: &Matrix<M>,
    ) -> Matrix<M> {
        let mut slope = *dmean;
        let flat = g.flat(&path.d);
        let square = flat.dot(&path.d);
        if underflows(square) {
            return slope;
        }
        let c = defect / square;
        let mut along = rows - path.dd.transpose_times(&flat) * (2.0 * c);
        if let Some(slopes) = slopes {
            // ∂g along z, in ♭d and in G(d, d).
            let dg_v = along_slopes::<M>(slopes, &path.d) * path.dz;
            along -= dg_v.transpose_times(&path.d) * c;
            slope += dg_v * c;
        }
        slope += Matrix::<M>::outer(&flat, &(along * square.recip()));
        slope + Matrix::<M>::from_columns(|k| g.flat(&path.dd.column_at(k))) * c
    }
}

/// The number `x`, or zero where it is round-off of terms of this size.
pub(crate) fn but_round_off(x: f64, terms: f64) -> f64 {
    if x.abs() <= SUMMED * terms { 0.0 } else { x }
}

/// Returns whether a squared length is so small that its terms have lost digits. The path is then measured in units of its own.
#[inline]
pub(crate) fn underflows(square: f64) -> bool {
    square * (f64::EPSILON * f64::EPSILON) < f64::MIN_POSITIVE
}

/// `♭d defect/G(d, d)` on a path so short that its squared length leaves the range of numbers, in units of
/// a power of two near that length; zero on a path without length.
#[cold]
fn along_short<V: Column<f64>>(defect: f64, g: &impl InnerProduct<V>, d: &V) -> V {
    let unit = power_of_two(d.magnitude());
    let flat = g.flat(&V::from_index(|i| d[i] / unit));
    let square = flat.dot(d) / unit;
    if square > 0.0 { flat * (defect / unit / square) } else { V::zero() }
}

/// The defect as an integral, with the estimate of its error.
struct Integral {
    value: f64,
    error: f64,
}

impl Integral {
    /// From `f`, `f'` at both ends of the path (first and second derivative of `F`) and `f` in its
    /// middle, less the slope `⟨w̄, d⟩`. The error is estimated by the difference to Simpson's rule.
    #[inline]
    fn new([start, end]: [[f64; 2]; 2], middle: f64, slope: f64) -> Self {
        let (f0, f1, f2) = (start[0] - slope, middle - slope, end[0] - slope);
        let ends = end[1] - start[1];
        let value = (7.0 * (f0 + f2) + 16.0 * f1) / 30.0 - ends / 60.0;
        let simpson = (f0 + f2 + 4.0 * f1) / 6.0;
        let size = start[0].abs() + middle.abs() + end[0].abs();
        Self { value, error: (value - simpson).abs() + f64::EPSILON * size }
    }

    /// The weight of the integral against a difference with the error `rounding`. The square is
    /// that of a ratio: those of the errors leave the range of numbers long before the state does.
    fn weight(&self, rounding: f64) -> f64 {
        if rounding > 0.0 { (1.0 + (self.error / rounding).powi(2)).recip() } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use metriplectic_fields::Real;
    use metriplectic_manifolds::{Canonical, Euclidean};
    use nalgebra::{Vector2, vector};
    use num_dual::DualNum;

    /// `1 + x³ + 2y³`, whose defect is `(d_x³ + 2d_y³)/4` in closed form.
    fn cubic(x: &Vector2<Real>) -> Real {
        x.x.powi(3) + x.y.powi(3) * 2.0 + 1.0
    }

    #[test]
    fn the_covector_keeps_its_digits_on_short_arcs() {
        let z: Vector2<f64> = vector![0.7, -0.4];
        let df = vector![3.0 * 0.7 * 0.7, 6.0 * 0.4 * 0.4];
        let direction: Vector2<f64> = vector![0.6, 0.8];
        let mut worst = 0.0_f64;
        for k in 0..=140 {
            let length = 10.0_f64.powf(-0.1 * f64::from(k));
            let d = direction * length;
            let (x, y) = (z - d * 0.5, z + d * 0.5);
            // The path of the rounded points, as a step would have it.
            let d: Vector2<f64> = y - x;
            let [start, end]: [f64; 2] =
                [x, y].map(|p| ScalarField::<Euclidean<2>>::at(&cubic, &p));
            let stable = StableGradient::<Euclidean<2>>::new(
                &cubic,
                &df,
                &Segment::new(&d, &y),
                [start, end],
                || df.dot(&d),
                || {
                    let d = d.cast::<Real>();
                    let at = |t| x.cast::<Real>() + d * Real::new(t, 1.0, 1.0, 0.0);
                    Nodes { ends: [at(0.0), at(1.0)], middle: Some(at(0.5)) }
                },
            );
            let w = stable.covector(0.0, &Canonical, &d);
            let defect = 0.25 * (d.x.powi(3) + 2.0 * d.y.powi(3));
            let exact = df + d * (defect / d.norm_squared());
            let size = df.norm() + end.abs() / d.norm().max(1e-2);
            worst = worst.max((w - exact).norm() / (f64::EPSILON * size));
        }
        // Evaluated by the difference alone the error is 10⁹ of these units at |d| = 10⁻¹².
        assert!(worst <= 50.0, "{worst} ε (|dF| + |F|/max(|d|, 10⁻²))");
    }

    #[test]
    fn an_arc_without_length_has_the_differential_itself() {
        let (x, df, d) = (vector![0.7, -0.4], vector![1.47, 0.96], Vector2::zeros());
        let start = ScalarField::<Euclidean<2>>::at(&cubic, &x);
        let stable = StableGradient::<Euclidean<2>>::new(
            &cubic,
            &df,
            &Segment::new(&d, &x),
            [start, start],
            || 0.0,
            || Nodes { ends: [x.cast(); 2], middle: None },
        );
        assert_eq!(stable.covector(0.0, &Canonical, &d), df);
    }

    #[test]
    fn a_sum_of_some_tens_of_roundings_is_round_off() {
        let left = |roundings: f64| but_round_off(roundings * f64::EPSILON * 3.0, 3.0) != 0.0;
        assert!(!left(30.0) && left(100.0));
    }
}
