//! The bi-invariant metric, whose geodesics are the one-parameter subgroups.

use std::f64::consts::PI;

use metriplectic_fields::{ChartPoint, Column, Real, Scalar, Space};
use nalgebra::{Matrix3, SMatrix, Vector3};
use num_dual::Dual;

use super::{Rotations, dexp, exp, hat};
use crate::metric::{GeodesicEnd, MetricError};
use crate::metric_error::{finite, finite_column, within};
use crate::normal::Normal;
use crate::rotation_vector::orthogonal;
use crate::{Canonical, Manifold, Riemannian, Slopes, StepPath, StepPathJet};

/// The curvature of SO(3) with `⟨â, b̂⟩ = a·b`.
const CURVATURE: f64 = 0.25;

impl Riemannian<Rotations> for Canonical {
    const IS_CANONICAL: bool = true;

    type At<D: Scalar> = Normal<D, 3>;

    #[inline]
    fn at<D: Scalar>(&self, x: &ChartPoint<Rotations, D>) -> Result<Normal<D, 3>, MetricError> {
        Ok(Normal::at(&x.q, CURVATURE))
    }

    fn matrix<D: Scalar>(&self, x: &ChartPoint<Rotations, D>) -> SMatrix<D, 3, 3> {
        Normal::at(&x.q, CURVATURE).matrix()
    }

    #[inline]
    fn volume_density<D: Scalar>(at: &Normal<D, 3>) -> Result<D, MetricError> {
        Ok(at.volume_density())
    }

    fn exp<D: Scalar>(
        &self,
        x: &ChartPoint<Rotations, D>,
        v: &Vector3<D>,
    ) -> Result<GeodesicEnd<Rotations, D>, MetricError> {
        let omega = dexp(&x.q) * v;
        within(PI, Column::magnitude(&omega))?;
        let end = orthogonal(&(x.point() * exp(&omega)));
        let base = Rotations::real(&end);
        // The body velocity is constant; the chart at the end reads it by one more dual number.
        let turned = end * hat(&omega);
        let moved = end.zip_map(&turned, Dual::new);
        let q = Rotations::coordinates(&base, &moved);
        let at = ChartPoint { base, q: finite_column("a coordinate of the end", q.map(|q| q.re))? };
        Ok((at, q.map(|q| q.eps)))
    }

    #[inline]
    fn end(&self, x: &Matrix3<f64>, v: &Vector3<f64>) -> Result<Matrix3<f64>, MetricError> {
        within(PI, v.norm())?;
        let end = Rotations::chart(x, v);
        finite("an entry of the end", end.sum())?;
        Ok(end)
    }

    #[inline]
    fn along(
        &self,
        x: &Matrix3<f64>,
        omega: &Vector3<f64>,
        t: f64,
    ) -> Result<Matrix3<Real>, MetricError> {
        within(PI, omega.norm())?;
        Ok(Rotations::line_at(x, omega, t))
    }

    fn log(&self, x: &Matrix3<f64>, y: &Matrix3<f64>) -> Result<Vector3<f64>, MetricError> {
        let q = Rotations::coordinates(x, y);
        within(PI, q.norm())?;
        finite_column("the logarithm", q)
    }

    #[inline]
    fn weyl_path(
        &self,
        x: &Matrix3<f64>,
        d: &Vector3<f64>,
    ) -> Result<StepPath<Rotations>, MetricError> {
        within(PI, d.norm())?;
        Ok(Rotations::line(x, d))
    }

    #[inline]
    fn weyl_jet(
        &self,
        x: &Matrix3<f64>,
        d: &Vector3<f64>,
    ) -> Result<StepPathJet<Rotations>, MetricError> {
        within(PI, d.norm())?;
        Ok(Rotations::line_jet(x, d))
    }

    fn slopes(&self, _: &Matrix3<f64>) -> Slopes<Rotations> {
        // In normal coordinates the metric is constant to first order.
        None
    }
}
