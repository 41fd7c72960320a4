//! Metrics that are constant in a global chart: their geodesics are straight lines.

use metriplectic_fields::{ChartPoint, Matrix, Real, Scalar, Space, Square, Vector};
use nalgebra::{Const, SMatrix};

use crate::metric::{Factored, GeodesicEnd, MetricError, stretched};
use crate::metric_error::finite_column;
use crate::{Canonical, Riemannian, Slopes, StepPath, StepPathJet};

/// A manifold whose charts are global and linear: straight lines are the geodesics of every metric
/// that is constant in them.
pub trait Flat: Space {}

/// Straight lines, the geodesics of every metric that is constant in a global chart.
macro_rules! straight_geodesics {
    () => {
        #[inline]
        fn exp<D: Scalar>(
            &self,
            x: &ChartPoint<M, D>,
            v: &Vector<M, D>,
        ) -> Result<GeodesicEnd<M, D>, MetricError> {
            straight(x, v)
        }

        #[inline]
        fn end(&self, x: &M::Point<f64>, v: &Vector<M>) -> Result<M::Point<f64>, MetricError> {
            let end = M::chart(x, v);
            reached::<M>(&end)?;
            Ok(end)
        }

        #[inline]
        fn along(
            &self,
            x: &M::Point<f64>,
            v: &Vector<M>,
            t: f64,
        ) -> Result<M::Point<Real>, MetricError> {
            Ok(M::chart(x, &stretched::<M>(v, t)))
        }

        #[inline]
        fn lost_digits(&self, x: &M::Point<f64>, v: &Vector<M>, y: &M::Point<f64>) -> Vector<M> {
            lost_digits::<M>(x, v, y)
        }

        fn log(&self, x: &M::Point<f64>, y: &M::Point<f64>) -> Result<Vector<M>, MetricError> {
            finite_column("the logarithm", M::coordinates(x, y))
        }

        #[inline]
        fn weyl_path(&self, x: &M::Point<f64>, d: &Vector<M>) -> Result<StepPath<M>, MetricError> {
            Ok(StepPath::straight(x, d))
        }

        #[inline]
        fn weyl_jet(
            &self,
            x: &M::Point<f64>,
            d: &Vector<M>,
        ) -> Result<StepPathJet<M>, MetricError> {
            Ok(StepPathJet::straight(x, d))
        }

        fn slopes(&self, _: &M::Point<f64>) -> Slopes<M> {
            None
        }
    };
}

impl<M: Flat> Riemannian<M> for Canonical {
    const IS_CANONICAL: bool = true;

    type At<D: Scalar> = Self;

    #[inline]
    fn at<D: Scalar>(&self, _: &ChartPoint<M, D>) -> Result<Self, MetricError> {
        Ok(Self)
    }

    fn matrix<D: Scalar>(&self, _: &ChartPoint<M, D>) -> Matrix<M, D> {
        Matrix::<M, D>::one()
    }

    #[inline]
    fn volume_density<D: Scalar>(_: &Self) -> Result<D, MetricError> {
        Ok(D::one())
    }

    straight_geodesics!();
}

/// A metric with the same matrix everywhere; see [`Metric::constant`](crate::Metric::constant).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constant<const N: usize> {
    factored: Factored<Const<N>, f64>,
}

impl<const N: usize> Constant<N> {
    pub(crate) fn new(g: SMatrix<f64, N, N>) -> Result<Self, MetricError> {
        Factored::new(g).map(|factored| Self { factored })
    }
}

impl<M: Flat + Space<Dim = Const<N>>, const N: usize> Riemannian<M> for Constant<N> {
    type At<D: Scalar> = Factored<Const<N>, D>;

    #[inline]
    fn at<D: Scalar>(&self, _: &ChartPoint<M, D>) -> Result<Self::At<D>, MetricError> {
        let embed = |a: &SMatrix<f64, N, N>| SMatrix::from_entries(|i, j| D::from(a[(i, j)]));
        Ok(Factored { g: embed(&self.factored.g), l: embed(&self.factored.l) })
    }

    fn matrix<D: Scalar>(&self, _: &ChartPoint<M, D>) -> SMatrix<D, N, N> {
        SMatrix::from_entries(|i, j| D::from(self.factored.g[(i, j)]))
    }

    #[inline]
    fn volume_density<D: Scalar>(at: &Self::At<D>) -> Result<D, MetricError> {
        at.root_determinant()
    }

    straight_geodesics!();
}

/// Computes the digits that rounding loses of a translation by `v`.
#[inline]
pub(crate) fn lost_digits<M: Space>(
    x: &M::Point<f64>,
    v: &Vector<M>,
    y: &M::Point<f64>,
) -> Vector<M> {
    *v - M::coordinates(x, y)
}

/// The straight lines of a flat manifold, for its implementation of [`Manifold`](crate::Manifold).
macro_rules! straight_lines {
    () => {
        #[inline]
        fn line(
            x: &Self::Point<f64>,
            u: &metriplectic_fields::Vector<Self>,
        ) -> $crate::StepPath<Self> {
            $crate::StepPath::straight(x, u)
        }

        #[inline]
        fn line_jet(
            x: &Self::Point<f64>,
            u: &metriplectic_fields::Vector<Self>,
        ) -> $crate::StepPathJet<Self> {
            $crate::StepPathJet::straight(x, u)
        }

        #[inline]
        fn lost_digits(
            x: &Self::Point<f64>,
            u: &metriplectic_fields::Vector<Self>,
            y: &Self::Point<f64>,
        ) -> metriplectic_fields::Vector<Self> {
            $crate::flat::lost_digits::<Self>(x, u, y)
        }
    };
}
pub(crate) use straight_lines;

/// The end of the flat geodesic through `x`: `x + v`, with the same velocity.
#[inline]
fn straight<M: Flat, D: Scalar>(
    x: &ChartPoint<M, D>,
    v: &Vector<M, D>,
) -> Result<GeodesicEnd<M, D>, MetricError> {
    let end = ChartPoint::around(&M::chart(&x.base, &(x.q + *v)));
    reached::<M>(&end.base)?;
    Ok((end, *v))
}

/// Refuses the end of a geodesic whose numbers are not finite, and one that has no chart of its own
/// because its numbers have run out: `s e^q` at zero.
#[inline]
fn reached<M: Flat>(y: &M::Point<f64>) -> Result<(), MetricError> {
    finite_column("a coordinate of the end", M::coordinates(y, y)).map(drop)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Metric;
    use metriplectic_fields::NotPositive;
    use nalgebra::Matrix2;

    #[test]
    fn bad_constant_metrics_are_refused() {
        let asymmetric = Matrix2::new(1.0, 0.2, 0.1, 1.0);
        assert!(matches!(
            Metric::constant(asymmetric),
            Err(MetricError::NotSymmetric { row: 1, column: 0, .. })
        ));
        let indefinite = Matrix2::new(1.0, 0.0, 0.0, -3.0);
        assert!(matches!(
            Metric::constant(indefinite),
            Err(MetricError::NotPositive(NotPositive { index: 1, .. }))
        ));
        let infinite = Matrix2::new(1.0, 0.0, f64::INFINITY, 1.0);
        assert_eq!(
            Metric::constant(infinite).unwrap_err(),
            MetricError::EntryNotFinite { row: 1, column: 0, value: f64::INFINITY }
        );
    }
}
