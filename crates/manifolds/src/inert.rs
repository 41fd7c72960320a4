//! A cometric that is zero: directions in which nothing moves.

use metriplectic_fields::{ChartPoint, Column, Matrix, Real, Scalar, Space, Square, Vector};
use nalgebra::SVector;

use crate::metric::GeodesicEnd;
use crate::{
    Canonical, Euclidean, InnerProduct, MetricError, Riemannian, Slopes, StepPath, StepPathJet,
};

/// The cometric `G* = 0` on `Rᴾ`, for parameters as a factor of a product: `(g, Inert)` on `M × Rᴾ`.
///
/// Every projection, the dissipation of the metric and the discrete gradient of Gonzalez go through the inner product
/// of covectors, so they see nothing of this factor: its numbers stay where they are, and the motion of the other factor is
/// the one without it. With the canonical metric in its place the dissipation would move the numbers, which is another equation.
///
/// It is the limit of the metric `λ²·1` for `λ → ∞`, in which lengths are infinite: as an
/// [`InnerProduct`] its `flat`, `orthonormal` and `from_orthonormal` are zero, and law 1 of inner products (`♯♭v = v`) does not hold.
/// Geodesics are straight lines.
///
/// ```
/// use metriplectic_manifolds::{InnerProduct, Inert};
/// use nalgebra::vector;
/// assert_eq!(Inert.sharp(&vector![3.0, -1.0]), vector![0.0, 0.0]);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Inert;

impl<D: Scalar, const P: usize> InnerProduct<SVector<D, P>> for Inert {
    #[inline]
    fn flat(&self, _: &SVector<D, P>) -> SVector<D, P> {
        Column::zero()
    }

    #[inline]
    fn orthonormal(&self, _: &SVector<D, P>) -> SVector<D, P> {
        Column::zero()
    }

    #[inline]
    fn from_orthonormal(&self, _: &SVector<D, P>) -> SVector<D, P> {
        Column::zero()
    }
}

/// The chart space of the parameters.
type Flat<const P: usize> = Euclidean<P>;

impl<const P: usize> Riemannian<Flat<P>> for Inert {
    type At<D: Scalar> = Self;

    #[inline]
    fn at<D: Scalar>(&self, _: &ChartPoint<Flat<P>, D>) -> Result<Self, MetricError> {
        Ok(Self)
    }

    fn matrix<D: Scalar>(&self, _: &ChartPoint<Flat<P>, D>) -> Matrix<Flat<P>, D> {
        Square::zeros()
    }

    fn exp<D: Scalar>(
        &self,
        x: &ChartPoint<Flat<P>, D>,
        v: &Vector<Flat<P>, D>,
    ) -> Result<GeodesicEnd<Flat<P>, D>, MetricError> {
        Riemannian::<Flat<P>>::exp(&Canonical, x, v)
    }

    fn end(
        &self,
        x: &SVector<f64, P>,
        v: &SVector<f64, P>,
    ) -> Result<SVector<f64, P>, MetricError> {
        Riemannian::<Flat<P>>::end(&Canonical, x, v)
    }

    fn along(
        &self,
        x: &SVector<f64, P>,
        v: &SVector<f64, P>,
        t: f64,
    ) -> Result<SVector<Real, P>, MetricError> {
        Riemannian::<Flat<P>>::along(&Canonical, x, v, t)
    }

    fn log(
        &self,
        x: &SVector<f64, P>,
        y: &SVector<f64, P>,
    ) -> Result<SVector<f64, P>, MetricError> {
        Riemannian::<Flat<P>>::log(&Canonical, x, y)
    }

    fn weyl_path(
        &self,
        x: &SVector<f64, P>,
        d: &SVector<f64, P>,
    ) -> Result<StepPath<Flat<P>>, MetricError> {
        Riemannian::<Flat<P>>::weyl_path(&Canonical, x, d)
    }

    fn weyl_jet(
        &self,
        x: &SVector<f64, P>,
        d: &SVector<f64, P>,
    ) -> Result<StepPathJet<Flat<P>>, MetricError> {
        Riemannian::<Flat<P>>::weyl_jet(&Canonical, x, d)
    }

    #[inline]
    fn volume_density<D: Scalar>(_: &Self) -> Result<D, MetricError> {
        Ok(D::one())
    }

    fn slopes(&self, x: &<Flat<P> as Space>::Point<f64>) -> Slopes<Flat<P>> {
        Riemannian::<Flat<P>>::slopes(&Canonical, x)
    }
}
