//! The round metric, whose geodesics are the great circles.

use std::f64::consts::PI;

use metriplectic_fields::{ChartPoint, Column, Real, Scalar, Space};
use nalgebra::{SMatrix, SVector};
use num_dual::Dual;

use super::Sphere;
use super::frame::{angle, great_circle, polished};
use crate::metric::{GeodesicEnd, MetricError};
use crate::metric_error::{finite_column, within};
use crate::normal::Normal;
use crate::{Canonical, Manifold, Riemannian, Slopes, StepPath, StepPathJet};

macro_rules! round {
    ($n:literal in $a:literal) => {
        impl Riemannian<Sphere<$n>> for Canonical {
            const IS_CANONICAL: bool = true;

            type At<D: Scalar> = Normal<D, $n>;

            #[inline]
            fn at<D: Scalar>(
                &self,
                x: &ChartPoint<Sphere<$n>, D>,
            ) -> Result<Normal<D, $n>, MetricError> {
                Ok(Normal::at(&x.q, 1.0))
            }

            fn matrix<D: Scalar>(&self, x: &ChartPoint<Sphere<$n>, D>) -> SMatrix<D, $n, $n> {
                Normal::at(&x.q, 1.0).matrix()
            }

            #[inline]
            fn volume_density<D: Scalar>(at: &Normal<D, $n>) -> Result<D, MetricError> {
                Ok(at.volume_density())
            }

            fn exp<D: Scalar>(
                &self,
                x: &ChartPoint<Sphere<$n>, D>,
                v: &SVector<D, $n>,
            ) -> Result<GeodesicEnd<Sphere<$n>, D>, MetricError> {
                // The chart is pushed forward, and pulled back at the end, by one more dual number.
                let moved = SVector::from_fn(|i, _| Dual::new(x.q[i], v[i]));
                let start = Sphere::<$n>::chart(&x.base, &moved);
                let (point, velocity) = (start.map(|p| p.re), start.map(|p| p.eps));
                within(PI, Column::magnitude(&velocity))?;
                let [point, velocity] = great_circle(&point, &velocity, 1.0);
                let point = polished(&point);
                let base = Sphere::<$n>::real(&point);
                let end = SVector::from_fn(|i, _| Dual::new(point[i], velocity[i]));
                let q = Sphere::<$n>::coordinates(&base, &end);
                Ok((ChartPoint { base, q: q.map(|q| q.re) }, q.map(|q| q.eps)))
            }

            #[inline]
            fn end(
                &self,
                x: &SVector<f64, $a>,
                v: &SVector<f64, $n>,
            ) -> Result<SVector<f64, $a>, MetricError> {
                within(PI, v.norm())?;
                finite_column("an entry of the end", Sphere::<$n>::chart(x, v))
            }

            #[inline]
            fn along(
                &self,
                x: &SVector<f64, $a>,
                v: &SVector<f64, $n>,
                t: f64,
            ) -> Result<SVector<Real, $a>, MetricError> {
                within(PI, v.norm())?;
                Ok(Sphere::<$n>::line_at(x, v, t))
            }

            fn log(
                &self,
                x: &SVector<f64, $a>,
                y: &SVector<f64, $a>,
            ) -> Result<SVector<f64, $n>, MetricError> {
                within(PI, angle(x, y))?;
                finite_column("the logarithm", Sphere::<$n>::coordinates(x, y))
            }

            fn distance(
                &self,
                x: &SVector<f64, $a>,
                y: &SVector<f64, $a>,
            ) -> Result<f64, MetricError> {
                let length = angle(x, y);
                within(PI, length)?;
                // The sides of near points have the rounding of their norms, which the chart leaves out.
                Ok(if length < 1.0 { Sphere::<$n>::coordinates(x, y).norm() } else { length })
            }

            #[inline]
            fn weyl_path(
                &self,
                x: &SVector<f64, $a>,
                d: &SVector<f64, $n>,
            ) -> Result<StepPath<Sphere<$n>>, MetricError> {
                within(PI, d.norm())?;
                Ok(Sphere::<$n>::line(x, d))
            }

            #[inline]
            fn weyl_jet(
                &self,
                x: &SVector<f64, $a>,
                d: &SVector<f64, $n>,
            ) -> Result<StepPathJet<Sphere<$n>>, MetricError> {
                within(PI, d.norm())?;
                Ok(Sphere::<$n>::line_jet(x, d))
            }

            fn slopes(&self, _: &SVector<f64, $a>) -> Slopes<Sphere<$n>> {
                // In normal coordinates the metric is constant to first order.
                None
            }
        }
    };
}

round!(1 in 2);
round!(2 in 3);
round!(3 in 4);
round!(4 in 5);
round!(5 in 6);
round!(6 in 7);
round!(7 in 8);
