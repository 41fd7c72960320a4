//! A metric from a closure, with numerical geodesics.

use std::fmt;

use metriplectic_fields::{
    ChartPoint, Column, Matrix, MatrixField, MatrixJet, Real, Scalar, Square, Vector,
};

use crate::chart_metric;
use crate::geodesic::{self, Arrival};
use crate::geodesic_jet::{ArrivalJet, GeodesicJet};
use crate::metric::{Factored, GeodesicEnd, MetricError};
use crate::metric_error::{on_part, stopped};
use crate::{Manifold, MetricJet, Riemannian, Slopes, StepPath, StepPathJet, shooting};

/// A metric given as a matrix field; see [`Metric::field`](crate::Metric::field).
#[derive(Clone, Copy)]
pub struct FieldMetric<F> {
    field: F,
}

impl<F> FieldMetric<F> {
    pub(crate) const fn new(field: F) -> Self {
        Self { field }
    }
}

impl<F> fmt::Debug for FieldMetric<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("FieldMetric").finish_non_exhaustive()
    }
}

impl<M: Manifold, F: MatrixField<M>> Riemannian<M> for FieldMetric<F> {
    const IS_RECORDED: bool = F::IS_RECORDED;

    type At<D: Scalar> = Factored<M::Dim, D>;

    fn at<D: Scalar>(&self, x: &ChartPoint<M, D>) -> Result<Self::At<D>, MetricError> {
        Factored::new(chart_metric::metric(&self.field, x))
    }

    fn matrix<D: Scalar>(&self, x: &ChartPoint<M, D>) -> Matrix<M, D> {
        chart_metric::metric(&self.field, x)
    }

    fn exp<D: Scalar>(
        &self,
        x: &ChartPoint<M, D>,
        v: &Vector<M, D>,
    ) -> Result<GeodesicEnd<M, D>, MetricError> {
        geodesic::follow(&self.field, x, v)
    }

    fn end(&self, x: &M::Point<f64>, v: &Vector<M>) -> Result<M::Point<f64>, MetricError> {
        // A step is solved for the energy at the end of its path, so the end must have the same roundings.
        Ok(self.weyl_path(x, v)?.end)
    }

    fn weyl_path(&self, x: &M::Point<f64>, d: &Vector<M>) -> Result<StepPath<M>, MetricError> {
        let first = Arrival::of(&self.field, x, &(*d * 0.5)).map_err(on_first_half)?;
        let (z, velocity) = first.with_velocity(&self.field).map_err(on_first_half)?;
        let second = Arrival::of(&self.field, &z, &velocity).map_err(on_second_half)?;
        Ok(StepPath { z: ChartPoint::centre(&z), d: velocity * 2.0, end: second.point() })
    }

    fn along(
        &self,
        x: &M::Point<f64>,
        v: &Vector<M>,
        t: f64,
    ) -> Result<M::Point<Real>, MetricError> {
        let (here, velocity) = if t > 0.0 {
            let (here, velocity) = geodesic::follow_real(&self.field, x, &(*v * t))
                .map_err(|error| on_part(error, 0.0, t))?;
            (here, velocity * t.recip())
        } else {
            (x.clone(), *v)
        };
        let bend = geodesic::acceleration(&self.field, &here, &velocity).ok_or_else(|| {
            let g = chart_metric::metric(&self.field, &ChartPoint::<M>::centre(&here));
            stopped(t, &g).unwrap_or(MetricError::Edge { time: t })
        })?;
        let jet =
            Vector::<M, Real>::from_index(|i| Real::new(0.0, velocity[i], velocity[i], bend[i]));
        Ok(M::chart(&here, &jet))
    }

    /// Finds *a* geodesic by shooting, because the cut locus of a closure is not known. It refuses a point that
    /// the chart at the other point does not reach ([`MetricError::OutOfChart`]): the antipode, and a rotation
    /// by half a turn.
    fn log(&self, x: &M::Point<f64>, y: &M::Point<f64>) -> Result<Vector<M>, MetricError> {
        shooting::log(self, &self.field, x, y)
    }

    fn weyl_jet(&self, x: &M::Point<f64>, d: &Vector<M>) -> Result<StepPathJet<M>, MetricError> {
        let half = GeodesicJet {
            point: x.clone(),
            velocity: *d * 0.5,
            dpoint: Matrix::<M>::zeros(),
            dvelocity: Matrix::<M>::one() * 0.5,
        };
        let z = ArrivalJet::of(&self.field, &half).and_then(|middle| middle.jet(&self.field));
        let z = z.map_err(on_first_half)?;
        let end = ArrivalJet::of(&self.field, &z).map_err(on_second_half)?;
        // The path without derivatives, so that both have the same roundings.
        let path = self.weyl_path(x, d)?;
        Ok(StepPathJet {
            z: path.z.base,
            dz: z.dpoint,
            d: path.d,
            dd: z.dvelocity * 2.0,
            end: path.end,
            dend: end.derivative(),
        })
    }

    fn accuracy(&self) -> f64 {
        geodesic::ACCURACY
    }

    #[inline]
    fn volume_density<D: Scalar>(at: &Self::At<D>) -> Result<D, MetricError> {
        at.root_determinant()
    }

    fn slopes(&self, x: &M::Point<f64>) -> Slopes<M> {
        Some(self.field.covariant_jet(x).slopes)
    }

    #[inline]
    fn jet(&self, x: &M::Point<f64>) -> Result<MetricJet<M, Self>, MetricError> {
        let MatrixJet { value, slopes } = self.field.covariant_jet(x);
        Ok(MetricJet { at: Factored::new(value)?, slopes: Some(slopes) })
    }
}

pub(crate) fn on_first_half(error: MetricError) -> MetricError {
    on_part(error, 0.0, 0.5)
}

pub(crate) fn on_second_half(error: MetricError) -> MetricError {
    on_part(error, 0.5, 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Canonical, Cayley, Euclidean, InnerProduct, LieDual, Metric, Projection, Retraction,
        Rotations, Sphere, rotations,
    };
    use nalgebra::{Matrix2, Matrix3, Vector2, Vector3, vector};
    use num_dual::DualNum;
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};
    use std::f64::consts::PI;

    /// The upper half plane with curvature −1.
    fn half_plane() -> FieldMetric<impl Fn(&Vector2<Real>) -> Matrix2<Real>> {
        Metric::field(|q: &Vector2<Real>| Matrix2::from_diagonal_element(q.y.powi(-2)))
    }

    #[test]
    fn geodesics_of_the_half_plane_are_its_semicircles() {
        let (g, x) = (half_plane(), vector![0.3, 1.2]);
        for (k, length) in [0.1, 1.0, 2.0, 4.0].into_iter().enumerate() {
            let (sine, cosine) = (0.4 + k as f64).sin_cos();
            // Unit speed at height y is y in the chart.
            let v = vector![cosine, sine] * (x.y * length);
            let end = Riemannian::<Euclidean<2>>::end(&g, &x, &v).unwrap();
            // cosh d = 1 + |x − y|²/(2 x₂ y₂), and the centre of the circle is on the axis.
            let distance = (1.0 + (end - x).norm_squared() / (2.0 * x.y * end.y)).acosh();
            // The unit of length is the radius of curvature, below which `acosh` loses relative digits.
            let unit = 1.0;
            assert!(
                (distance - length).abs() < 1e-13 * length.max(unit),
                "{distance} for {length}"
            );
            let centre = x.x + x.y * sine / cosine;
            let radii = ((x - vector![centre, 0.0]).norm(), (end - vector![centre, 0.0]).norm());
            assert!((radii.0 / radii.1 - 1.0).abs() < 2e-13);
        }
    }

    #[test]
    fn logarithms_of_the_half_plane_are_found_and_have_the_right_length() {
        let g = half_plane();
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        for _ in 0..400 {
            let mut point = || vector![rng.random_range(-1.0..1.0), rng.random_range(0.2..2.0)];
            let (x, y): (Vector2<f64>, Vector2<f64>) = (point(), point());
            let v = Riemannian::<Euclidean<2>>::log(&g, &x, &y).unwrap();
            let distance = (1.0 + (y - x).norm_squared() / (2.0 * x.y * y.y)).acosh();
            assert!((v.norm() / x.y - distance).abs() < 1e-11 * (1.0 + distance));
        }
    }

    #[test]
    fn geodesics_and_logarithms_have_no_unit_of_length() {
        // The metric of the half plane is the same in every unit.
        let (g, x, v, y) =
            (half_plane(), vector![0.3, 1.2], vector![0.8, -0.5], vector![-0.7, 0.4]);
        let end = |s: f64| Riemannian::<Euclidean<2>>::end(&g, &(x * s), &(v * s)).unwrap();
        let log = |s: f64| Riemannian::<Euclidean<2>>::log(&g, &(x * s), &(y * s)).unwrap();
        for s in [-40, -3, 60].map(|k| 2.0_f64.powi(k)) {
            assert_eq!(end(s), end(1.0) * s);
            assert_eq!(log(s), log(1.0) * s);
        }
    }

    #[test]
    fn the_half_plane_has_its_christoffel_symbols_and_distances() {
        let (g, x) = (half_plane(), vector![0.3, 1.2]);
        let [across, up] = Riemannian::<Euclidean<2>>::christoffel(&g, &x).unwrap();
        // Γˣ_xy = −1/y, Γʸ_xx = 1/y, Γʸ_yy = −1/y.
        assert!((across - Matrix2::new(0.0, -1.0, -1.0, 0.0) / x.y).norm() < 1e-15);
        assert!((up - Matrix2::new(1.0, 0.0, 0.0, -1.0) / x.y).norm() < 1e-15);
        let distance = Riemannian::<Euclidean<2>>::distance(&g, &x, &(x * 2.0)).unwrap();
        let exact = (1.0 + x.norm_squared() / (4.0 * x.y * x.y)).acosh();
        assert!((distance - exact).abs() < 1e-12);
    }

    /// A metric with all its entries, none of them constant.
    fn skewed<D: Scalar>(q: &Vector3<D>) -> Matrix3<D> {
        let wave = Vector3::new(q.y.sin(), q.z.cos(), q.x * 0.5);
        let other = Vector3::new(q.x * q.z, -q.y, q.z.exp() * 0.3);
        Matrix3::identity() + wave * wave.transpose() + other * other.transpose() * D::from(0.2)
    }

    /// `Γᵏ_ij` from the matrix alone, by differences of order four.
    fn christoffel_by_differences(x: &Vector3<f64>) -> [Matrix3<f64>; 3] {
        let h = 1e-3;
        let slopes = [0, 1, 2].map(|k| {
            let at = |t: f64| skewed(&(x + Vector3::ith(k, t * h)));
            ((at(1.0) - at(-1.0)) * 8.0 - (at(2.0) - at(-2.0))) / (12.0 * h)
        });
        let inverse = skewed(x).try_inverse().unwrap();
        [0, 1, 2].map(|k| {
            Matrix3::from_fn(|i, j| {
                let first_kind =
                    |l: usize| slopes[i][(l, j)] + slopes[j][(l, i)] - slopes[l][(i, j)];
                (0..3).map(|l| 0.5 * inverse[(k, l)] * first_kind(l)).sum()
            })
        })
    }

    #[test]
    fn christoffel_symbols_are_those_of_differences_of_the_metric() {
        let g = Metric::field(|q: &Vector3<Real>| skewed(q));
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        for _ in 0..50 {
            let x = Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0));
            let symbols = Riemannian::<Euclidean<3>>::christoffel(&g, &x).unwrap();
            for (exact, differences) in symbols.iter().zip(christoffel_by_differences(&x)) {
                assert_eq!(*exact, exact.transpose());
                assert!((exact - differences).amax() < 1e-10, "{exact} or {differences}");
            }
        }
    }

    #[test]
    fn geodesics_solve_their_equation() {
        let g = Metric::field(|q: &Vector3<Real>| skewed(q));
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        for _ in 0..20 {
            let mut column = || Vector3::from_fn(|_, _| rng.random_range(-0.7..0.7));
            let (x, v) = (column(), column());
            let at = |t: f64| Riemannian::<Euclidean<3>>::end(&g, &x, &(v * t)).unwrap();
            // Differences of order four of points on the way.
            let (t, h) = (0.6, 2e-2);
            let [a, b, c, d, e] = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|k| at(t + k * h));
            let velocity = ((d - b) * 8.0 - (e - a)) / (12.0 * h);
            let acceleration = ((d + b) * 16.0 - (e + a) - c * 30.0) / (12.0 * h * h);
            let symbols = christoffel_by_differences(&c);
            let force = Vector3::from_fn(|k, _| velocity.dot(&(symbols[k] * velocity)));
            assert!((acceleration + force).norm() < 1e-6, "{acceleration} and {force}");
            let along = Riemannian::<Euclidean<3>>::along(&g, &x, &v, t).unwrap();
            assert!((along.map(|entry| entry.eps1) - velocity).norm() < 1e-7);
            assert!((along.map(|entry| entry.eps1eps2) + force).norm() < 1e-6);
        }
    }

    #[test]
    fn what_the_chart_does_not_reach_has_no_logarithm() {
        let (round, form) = (Canonical, Metric::field(|_: &Vector3<Real>| Matrix3::identity()));
        let x = vector![0.6, 0.0, 0.8];
        let log = Riemannian::<Sphere<2>>::log(&form, &x, &-x);
        assert!(matches!(log, Err(MetricError::OutOfChart { .. })), "{log:?}");
        assert!(Riemannian::<Sphere<2>>::log(&round, &x, &-x).is_err());
        // Half a turn has two straight lines, and which one is found would be a matter of rounding.
        let body = Metric::field(|_: &Matrix3<Real>| Matrix3::identity());
        let r = rotations::exp(&vector![0.3, -0.2, 0.5]);
        let turned = |angle: f64| r * rotations::exp(&(vector![2.0, -1.0, 2.0] / 3.0 * angle));
        let log = Riemannian::<Rotations>::log(&body, &r, &turned(PI));
        assert!(
            matches!(log, Err(MetricError::OutOfChart { distance }) if (distance - PI).abs() < 1e-14)
        );
        assert!(Riemannian::<Rotations>::log(&Canonical, &r, &turned(PI)).is_err());
        let log = Riemannian::<Rotations>::log(&body, &r, &turned(PI - 1e-9)).unwrap();
        assert!((log.norm() - (PI - 1e-9)).abs() < 1e-12);
    }

    #[test]
    fn points_that_are_not_finite_have_no_logarithm() {
        for bad in [f64::NAN, f64::INFINITY] {
            let (x, y) = (Vector3::x(), vector![0.0, bad, 0.6]);
            let (r, s) = (Matrix3::identity(), Matrix3::from_diagonal(&vector![1.0, 1.0, bad]));
            let form = Metric::field(|_: &Vector3<Real>| Matrix3::identity());
            let body = Metric::field(|_: &Matrix3<Real>| Matrix3::identity());
            let errors = [
                Riemannian::<Sphere<2>>::log(&Canonical, &x, &y).unwrap_err(),
                Riemannian::<Sphere<2>>::log(&Canonical, &y, &x).unwrap_err(),
                Riemannian::<Sphere<2>>::log(&form, &x, &y).unwrap_err(),
                Riemannian::<Rotations>::log(&Canonical, &r, &s).unwrap_err(),
                Riemannian::<Rotations>::log(&Canonical, &s, &r).unwrap_err(),
                Riemannian::<Rotations>::log(&body, &r, &s).unwrap_err(),
                Riemannian::<Euclidean<3>>::log(&Canonical, &x, &y).unwrap_err(),
                Riemannian::<Euclidean<3>>::end(&Canonical, &x, &y).unwrap_err(),
                Riemannian::<Sphere<2>>::end(&Canonical, &y, &vector![0.1, 0.2]).unwrap_err(),
                Riemannian::<Rotations>::end(&Canonical, &s, &Vector3::x()).unwrap_err(),
                Retraction::<Sphere<2>, _>::inverse(&Projection, &Canonical, &x, &y).unwrap_err(),
                Retraction::<Rotations, _>::inverse(&Cayley, &Canonical, &r, &s).unwrap_err(),
            ];
            for (k, error) in errors.into_iter().enumerate() {
                assert!(matches!(error, MetricError::NotFinite { .. }), "{bad}, case {k}: {error}");
            }
        }
    }

    #[test]
    fn a_geodesic_that_is_lost_says_where_and_why() {
        let (x, v) = (vector![0.0, 0.0], vector![3.0, 0.0]);
        // The edge x = 1 of the slit metric is at a finite distance, and there is nothing beyond it:
        // with x' = 3 (1 − x)^(−1/4) it is reached at t = 4/15.
        let slit =
            Metric::field(|q: &Vector2<Real>| Matrix2::from_diagonal_element((-q.x + 1.0).sqrt()));
        let reached = |t: f64| (t - 4.0 / 15.0).abs() < 1e-4;
        let error = Riemannian::<Euclidean<2>>::end(&slit, &x, &v).unwrap_err();
        assert!(matches!(error, MetricError::Edge { time } if reached(time)), "{error}");
        // In the first and in the second half of a path, and on the way to an inner point.
        let error = Riemannian::<Euclidean<2>>::weyl_jet(&slit, &x, &v).unwrap_err();
        assert!(matches!(error, MetricError::Edge { time } if reached(time)), "{error}");
        let error = Riemannian::<Euclidean<2>>::weyl_path(&slit, &x, &(v / 3.0)).unwrap_err();
        assert!(matches!(error, MetricError::Edge { time } if reached(time / 3.0)), "{error}");
        let error = Riemannian::<Euclidean<2>>::along(&slit, &x, &v, 0.5).unwrap_err();
        assert!(matches!(error, MetricError::Edge { time } if reached(time)), "{error}");
        let centre = ChartPoint::centre(&x);
        let error = Riemannian::<Euclidean<2>>::exp(&slit, &centre, &v).unwrap_err();
        assert!(matches!(error, MetricError::Edge { time } if reached(time)), "{error}");
        // Here it is there, and negative: x' = 3 (1 − x)^(−1/2) comes to x = 1 at t = 2/9.
        let fold = Metric::field(|q: &Vector2<Real>| {
            Matrix2::from_diagonal(&vector![-q.x + 1.0, 1.0.into()])
        });
        let error = Riemannian::<Euclidean<2>>::end(&fold, &x, &v).unwrap_err();
        let MetricError::Degenerate { time, not_positive } = error else { panic!("{error}") };
        assert!((time - 2.0 / 9.0).abs() < 1e-4, "{error}");
        assert!(not_positive.index == 0 && not_positive.pivot <= 0.0, "{error}");
        // A metric with a wave of length 10⁻⁵ is positive everywhere, and too uneven for a long way.
        let rough = Metric::field(|q: &Vector2<Real>| {
            Matrix2::from_diagonal_element((q.x * 6e5).sin() * 0.9 + 1.0)
        });
        let error = Riemannian::<Euclidean<2>>::end(&rough, &x, &v).unwrap_err();
        assert!(matches!(error, MetricError::Uneven { time, pieces } if time < 1.0 && pieces > 1));
    }

    #[test]
    fn a_constant_closure_is_the_constant_metric() {
        let g = Matrix3::new(2.0, 0.3, 0.0, 0.3, 1.0, -0.2, 0.0, -0.2, 3.0);
        let closure = Metric::field(move |_: &Vector3<Real>| g.cast::<Real>());
        let constant = Metric::constant(g).unwrap();
        let x = ChartPoint::<LieDual<3>>::centre(&vector![1.0, 2.0, 3.0]);
        let alpha = vector![0.3, -0.1, 0.7];
        let left = Riemannian::<LieDual<3>>::at(&closure, &x).unwrap();
        let right = Riemannian::<LieDual<3>>::at(&constant, &x).unwrap();
        assert_eq!(left.sharp(&alpha), right.sharp(&alpha));
        assert!((g * right.sharp(&alpha) - alpha).norm() < 1e-15);
    }
}
