//! The half line `R₊ = { s > 0 }`.
//!
//! - **Point and velocity**: columns of one number, `s` and `s'`.
//! - **Frame**: `s' = s v`.
//! - **Chart**: `φ_s(q) = s e^q`, onto the whole half line, and its inverse `ln(y/s)`, which is
//!   `ln(1 + (y − s)/s)` within a factor of two, where the first form has too few digits.
//! - **Geodesics** of the canonical metric `ds²/s²` are `s e^{tv}`, which do not reach zero in
//!   finite time. It is the metric of positive matrices for 1 × 1 matrices (Bhatia 2007, ch. 6). The logarithm
//!   has a relative error below `2ε`. A geodesic that leaves the range of numbers, 5·10⁻³²⁴ to 2·10³⁰⁸, is an
//!   error.
//! - **Brackets**: none, as on every curve. The half line is a factor, for a temperature, a volume or
//!   an internal energy, of a [`Product`](crate::Product).

use metriplectic_fields::{ChartPoint, Column, Real, Scalar, Space};
use nalgebra::{Const, SVector, Vector1};
use rand::{Rng, RngExt};

use crate::flat::straight_lines;
use crate::{Flat, Manifold, PointError};

/// The positive numbers R₊, for a state that must not reach zero. See the [module](mod@crate::half_line).
///
/// As a closure, the canonical metric is `Metric::field(|s| Matrix1::new(s.x.powi(-2)))`.
///
/// ```
/// use metriplectic_manifolds::{Canonical, HalfLine, Riemannian};
/// use nalgebra::Vector1;
/// let (one, e) = (Vector1::new(1.0), Vector1::new(1_f64.exp()));
/// let length = Riemannian::<HalfLine>::log(&Canonical, &one, &e).unwrap();
/// assert!((length.x - 1.0).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HalfLine;

impl Space for HalfLine {
    type Dim = Const<1>;
    type Velocity = Const<1>;
    type Point<D: Scalar> = Vector1<D>;

    #[inline]
    fn constant<D: Scalar>(x: &Vector1<f64>) -> Vector1<D> {
        Column::embed(x)
    }

    #[inline]
    fn real<D: Scalar>(x: &Vector1<D>) -> Vector1<f64> {
        Column::real(x)
    }

    #[inline]
    fn chart<D: Scalar>(x: &Vector1<f64>, q: &Vector1<D>) -> Vector1<D> {
        Vector1::new(q.x.exp() * x.x)
    }

    #[inline]
    fn coordinates<D: Scalar>(x: &Vector1<f64>, y: &Vector1<D>) -> Vector1<D> {
        let ratio = y.x / x.x;
        Vector1::new(match ratio.re() {
            near if (0.5..=2.0).contains(&near) => ((y.x - x.x) / x.x).ln_1p(),
            far if far.is_normal() => ratio.ln(),
            _ => y.x.ln() - x.x.ln(),
        })
    }

    const RATES_ARE_VELOCITIES: bool = true;

    /// The chart is a translation of the logarithm.
    #[inline]
    fn stage_rates(
        _: &Vector1<f64>,
        _: (&Vector1<f64>, &Vector1<f64>),
        v: &Vector1<f64>,
    ) -> Vector1<f64> {
        *v
    }

    /// `s' = s e^q v`.
    #[inline]
    fn embed<D: Scalar>(at: &ChartPoint<Self, D>, v: &Vector1<D>) -> Vector1<D> {
        at.point() * v.x
    }
}

impl Manifold for HalfLine {
    const ENTRIES: usize = 1;

    straight_lines!();

    /// The distance to the [projection](Self::project): how far a number is below zero, and not quite
    /// nothing for zero itself.
    fn defect(&self, x: &Vector1<f64>) -> f64 {
        if x.x.is_finite() { (self.project(x).x - x.x).abs() } else { f64::NAN }
    }

    fn entries(x: &Vector1<f64>) -> Vec<f64> {
        vec![x.x]
    }

    #[inline]
    fn write(x: &Vector1<f64>, put: &mut impl FnMut(f64)) {
        put(x.x);
    }

    fn assemble(next: &mut impl FnMut() -> f64) -> Vector1<f64> {
        Vector1::new(next())
    }

    #[inline]
    fn magnitude(x: &Vector1<f64>) -> f64 {
        x.x.abs()
    }

    /// Returns 1, because the chart is the logarithm of a ratio and has no unit.
    #[inline]
    fn scales(_: &Vector1<f64>) -> Vector1<f64> {
        Vector1::new(1.0)
    }

    #[inline]
    fn pairing_size(w: &Vector1<f64>, v: &Vector1<f64>) -> f64 {
        (w.x * v.x).abs()
    }

    /// The velocity `s' = s`, of the length 1.
    #[inline]
    fn leg(x: &Vector1<Real>, _: usize) -> Vector1<Real> {
        *x
    }

    /// No positive number is nearest to one that is not: `2.2·10⁻³⁰⁸`, the smallest of full precision,
    /// stands for zero.
    fn project(&self, x: &Vector1<f64>) -> Vector1<f64> {
        Vector1::new(if x.x <= 0.0 { f64::MIN_POSITIVE } else { x.x })
    }

    /// `e^u` with `u` uniform in `−1 … 1`.
    fn random(&self, rng: &mut impl Rng) -> Vector1<f64> {
        let u: f64 = rng.random_range(-1.0..1.0);
        SVector::from([u.exp()])
    }

    /// No number that is not positive is allowed, however near to zero.
    fn check(&self, x: &Vector1<f64>) -> Result<(), PointError> {
        if !x.x.is_finite() {
            return Err(PointError::NotFinite { index: 0, value: x.x });
        }
        match self.defect(x) {
            defect if defect > 0.0 => Err(PointError::OffManifold { defect, allowed: 0.0 }),
            _ => Ok(()),
        }
    }
}

/// The logarithm is a global chart.
impl Flat for HalfLine {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Canonical, Exponential, Metric, MetricError, Riemannian, WeylMidpoint, laws};
    use nalgebra::Matrix1;
    use num_dual::DualNum;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_half_line_keeps_the_laws(x in 0.1..10.0, u in -1.0..1.0) {
            let (x, u) = (Vector1::new(x), Vector1::new(u));
            let field = Metric::field(|s: &Vector1<Real>| Matrix1::new(s.x.powi(-2)));
            laws::manifold(&HalfLine, &x, &u)?;
            laws::metric::<HalfLine, _>(&Canonical, &x, &u)?;
            laws::metric::<HalfLine, _>(&field, &x, &u)?;
            laws::retraction::<HalfLine, _, _>(&WeylMidpoint, &Canonical, &x, &u)?;
            laws::retraction::<HalfLine, _, _>(&Exponential, &field, &x, &u)?;
        }
    }

    #[test]
    fn what_is_not_positive_is_off_the_half_line() {
        for off in [0.0, -1e-300, -3.0] {
            assert!(HalfLine.check(&Vector1::new(off)).is_err());
            assert!(HalfLine.check(&HalfLine.project(&Vector1::new(off))).is_ok());
        }
        let defect = |s| Vector1::new(HalfLine.defect(&Vector1::new(s)));
        assert_eq!(defect(-3.0), Vector1::new(3.0));
        assert_eq!(defect(0.0), Vector1::new(f64::MIN_POSITIVE));
        for on in [5e-324, 1.0, f64::MAX] {
            assert_eq!(HalfLine.project(&Vector1::new(on)), Vector1::new(on));
            assert_eq!(defect(on), Vector1::new(0.0));
        }
    }

    #[test]
    fn logarithms_have_their_digits_between_all_numbers() {
        // The exact ones, rounded.
        for (x, y, exact) in [
            (1.0, 1.0 + f64::EPSILON, f64::EPSILON),
            (1.0, 1e-17, -39.143_946_580_898_77),
            (3.0, 1e-10, -24.124_463_218_608_567),
            (1e-200, 1e200, 921.034_037_197_618_3),
            (1e200, 1e-200, -921.034_037_197_618_3),
            (2.0, 1.0, -std::f64::consts::LN_2),
        ] {
            let (x, y) = (Vector1::new(x), Vector1::new(y));
            let log = Riemannian::<HalfLine>::log(&Canonical, &x, &y).unwrap().x;
            let off = (log - exact).abs() / exact.abs();
            assert!(off <= 2.0 * f64::EPSILON, "{x} to {y}: {log}");
        }
    }

    #[test]
    fn what_is_not_finite_is_no_point_and_is_never_reached() {
        for off in [f64::NAN, f64::INFINITY] {
            assert!(HalfLine.defect(&Vector1::new(off)).is_nan());
            let projected = HalfLine.project(&Vector1::new(off));
            assert!(matches!(HalfLine.check(&projected), Err(PointError::NotFinite { .. })));
        }
        let one = Vector1::new(1.0);
        for to in [-1.0, 0.0, f64::NAN, f64::INFINITY] {
            let log = Riemannian::<HalfLine>::log(&Canonical, &one, &Vector1::new(to));
            assert!(matches!(log, Err(MetricError::NotFinite { .. })), "{to}: {log:?}");
        }
        // e^10000 is no number, and e^−10000 is not a positive one.
        for v in [1e4, -1e4, f64::NAN].map(Vector1::new) {
            let end = Riemannian::<HalfLine>::end(&Canonical, &one, &v);
            assert!(matches!(end, Err(MetricError::NotFinite { .. })), "{v}: {end:?}");
            let end = Riemannian::<HalfLine>::exp(&Canonical, &ChartPoint::centre(&one), &v);
            assert!(matches!(end, Err(MetricError::NotFinite { .. })), "{v}: {end:?}");
        }
    }
}
