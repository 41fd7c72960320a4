//! Riemannian metrics: flat, sharp, norm, geodesics.
//!
//! A metric is the canonical one of its manifold ([`Canonical`]), a constant matrix
//! ([`Metric::constant`]), or a closure that gives the matrix `g(x)` in the coordinate frame at
//! each point ([`Metric::field`]). On a flat space the geodesics of a closure are straight lines only if its derivative
//! vanishes; that is checked wherever a geodesic is asked for.

use std::fmt;

use metriplectic_fields::{
    ChartPoint, Column, Dimension, Matrix, MatrixField, NotPositive, Scalar, Space, Square, Vector,
};
use nalgebra::{Const, SMatrix, SVector};

use crate::ArcJet;

/// The metric at one point: an inner product `G(u, v) = uᵀ g v` on tangent vectors, factored as
/// `g = L Lᵀ`.
///
/// Laws: 1. `sharp` undoes `flat`; 2. `raise(orthonormal(α)) = sharp(α)`;
/// 3. `orthonormal(α)·orthonormal(β) = G*(α, β)`.
pub trait InnerProduct<V>: Copy {
    /// The covector `♭v = g v`.
    fn flat(&self, v: &V) -> V;

    /// The components `L⁻¹α` of a covector in an orthonormal coframe.
    fn orthonormal(&self, alpha: &V) -> V;

    /// The vector `L⁻ᵀ a` with the orthonormal components `a`.
    fn raise(&self, a: &V) -> V;

    /// The vector `♯α = g⁻¹α`.
    #[inline]
    fn sharp(&self, alpha: &V) -> V {
        self.raise(&self.orthonormal(alpha))
    }
}

/// Where a geodesic arrives: the point in the chart centred at its real part, and the velocity in
/// that frame.
pub type GeodesicEnd<M, D> = (ChartPoint<M, D>, Vector<M, D>);

/// A Riemannian metric on `M`, and its geodesics.
///
/// Laws ([`laws::metric`](crate::laws::metric)): 1. `g` is symmetric; 2. and positive; 3. the laws
/// of its inner product; 4. `exp_x(0) = x`; 5. geodesics have constant speed; 6. `weyl_jet` is the
/// derivative of the midpoint arc.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a metric on `{M}`",
    note = "a metric is `Metric::constant(matrix)?`, or `Metric::field(closure)` with a closure from a point over `Real` to the symmetric matrix g"
)]
pub trait Riemannian<M: Space> {
    /// The metric at one point.
    type At<D: Scalar>: InnerProduct<Vector<M, D>>;

    /// The metric at a point, in the frame of its chart.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the matrix is not symmetric and positive.
    fn at<D: Scalar>(&self, x: &ChartPoint<M, D>) -> Result<Self::At<D>, MetricError>;

    /// The matrix `g` itself, unchecked.
    fn matrix<D: Scalar>(&self, x: &ChartPoint<M, D>) -> Matrix<M, D>;

    /// The geodesic with `γ(0) = x` and `γ'(0) = v`, at time 1.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the geodesic cannot be followed.
    fn exp<D: Scalar>(
        &self,
        x: &ChartPoint<M, D>,
        v: &Vector<M, D>,
    ) -> Result<GeodesicEnd<M, D>, MetricError>;

    /// The end `exp_x(v)` of a geodesic from a real point: a faster answer where the chart is normal.
    ///
    /// # Errors
    ///
    /// Those of [`exp`](Self::exp).
    fn end<D: Scalar>(
        &self,
        x: &M::Point<f64>,
        v: &Vector<M, D>,
    ) -> Result<M::Point<D>, MetricError> {
        Ok(self.exp(&ChartPoint::centre(x), v)?.0.point())
    }

    /// The vector `v` at `x` with `exp_x(v) = y`.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if there is none that is found.
    fn log(&self, x: &M::Point<f64>, y: &M::Point<f64>) -> Result<Vector<M>, MetricError>;

    /// The geodesic of time 1 from `x` with velocity `d`, at its middle and its end, with the
    /// derivatives along `d`.
    ///
    /// # Errors
    ///
    /// Those of [`exp`](Self::exp).
    fn weyl_jet(&self, x: &M::Point<f64>, d: &Vector<M>) -> Result<ArcJet<M>, MetricError>;

    /// The density `√det g` of the volume form in the chart.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the matrix is not symmetric and positive.
    fn volume<D: Scalar>(&self, x: &ChartPoint<M, D>) -> Result<D, MetricError> {
        Ok(self.matrix(x).root_determinant()?)
    }

    /// The derivatives `∂g/∂qᵏ` at a real point; `None` for a metric that is constant by
    /// construction.
    fn slopes(&self, x: &M::Point<f64>) -> Option<<M::Dim as Dimension>::Array<Matrix<M>>>;
}

/// The canonical metric of a manifold; the dot product on a flat space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Canonical;

impl<V: Copy> InnerProduct<V> for Canonical {
    #[inline]
    fn flat(&self, v: &V) -> V {
        *v
    }

    #[inline]
    fn orthonormal(&self, alpha: &V) -> V {
        *alpha
    }

    #[inline]
    fn raise(&self, a: &V) -> V {
        *a
    }
}

/// A symmetric positive matrix `g` and its Cholesky factor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Factored<A> {
    g: A,
    l: A,
}

impl<A> Factored<A> {
    /// Factors `g = L Lᵀ`.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if `g` is not finite, not symmetric, or not positive.
    pub fn new<D: Scalar>(g: A) -> Result<Self, MetricError>
    where
        A: Square<D>,
    {
        symmetric(&g)?;
        let l = g.cholesky()?;
        Ok(Self { g, l })
    }
}

impl<D: Scalar, const N: usize> InnerProduct<SVector<D, N>> for Factored<SMatrix<D, N, N>> {
    #[inline]
    fn flat(&self, v: &SVector<D, N>) -> SVector<D, N> {
        self.g * *v
    }

    #[inline]
    fn orthonormal(&self, alpha: &SVector<D, N>) -> SVector<D, N> {
        self.l.solve_lower(alpha)
    }

    #[inline]
    fn raise(&self, a: &SVector<D, N>) -> SVector<D, N> {
        self.l.solve_lower_transpose(a)
    }
}

/// Refuses a matrix that is not symmetric up to the rounding of its entries.
fn symmetric<D: Scalar, A: Square<D>>(g: &A) -> Result<(), MetricError> {
    let largest = g.max_abs();
    if !largest.is_finite() {
        return Err(MetricError::NotFinite);
    }
    for i in 0..A::Column::LEN {
        for j in 0..i {
            let size = (g[(i, j)].re() - g[(j, i)].re()).abs();
            if size > 64.0 * f64::EPSILON * largest {
                return Err(MetricError::NotSymmetric { row: i, column: j, size });
            }
        }
    }
    Ok(())
}

/// Ready-made metrics.
#[derive(Clone, Copy, Debug)]
pub enum Metric {}

impl Metric {
    /// The metric with the same matrix everywhere on a flat space.
    ///
    /// ```
    /// use metriplectic_manifolds::Metric;
    /// use nalgebra::Matrix2;
    /// assert!(Metric::constant(Matrix2::new(2.0, 0.5, 0.5, 1.0)).is_ok());
    /// assert!(Metric::constant(Matrix2::new(1.0, 2.0, 2.0, 1.0)).is_err());
    /// ```
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the matrix is not finite, symmetric and positive.
    pub fn constant<const N: usize>(g: SMatrix<f64, N, N>) -> Result<Constant<N>, MetricError> {
        Factored::new(g).map(|factored| Constant { factored })
    }

    /// The metric with the matrix `g(x)` in the frame at each point, from a closure or any other
    /// [`MatrixField`].
    ///
    /// Whether it is symmetric and positive is checked at every point where it is used.
    ///
    /// ```
    /// use metriplectic_fields::Real;
    /// use num_dual::DualNum;
    /// use metriplectic_manifolds::Metric;
    /// use nalgebra::{Matrix2, Vector2};
    /// let _half_plane =
    ///     Metric::field(|q: &Vector2<Real>| Matrix2::from_diagonal_element(q.y.powi(-2)));
    /// ```
    pub const fn field<F>(field: F) -> FieldMetric<F> {
        FieldMetric { field }
    }
}

/// A metric with the same matrix everywhere; see [`Metric::constant`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constant<const N: usize> {
    factored: Factored<SMatrix<f64, N, N>>,
}

/// A manifold whose charts are global and linear: straight lines are the geodesics of every metric
/// that is constant in them.
pub trait Flat: Space {}

impl<M: Flat> Riemannian<M> for Canonical {
    type At<D: Scalar> = Self;

    #[inline]
    fn at<D: Scalar>(&self, _: &ChartPoint<M, D>) -> Result<Self, MetricError> {
        Ok(Self)
    }

    fn matrix<D: Scalar>(&self, _: &ChartPoint<M, D>) -> Matrix<M, D> {
        Matrix::<M, D>::one()
    }

    #[inline]
    fn exp<D: Scalar>(
        &self,
        x: &ChartPoint<M, D>,
        v: &Vector<M, D>,
    ) -> Result<GeodesicEnd<M, D>, MetricError> {
        Ok(straight(x, v))
    }

    #[inline]
    fn volume<D: Scalar>(&self, _: &ChartPoint<M, D>) -> Result<D, MetricError> {
        Ok(D::one())
    }

    #[inline]
    fn end<D: Scalar>(
        &self,
        x: &M::Point<f64>,
        v: &Vector<M, D>,
    ) -> Result<M::Point<D>, MetricError> {
        Ok(M::chart(x, v))
    }

    fn log(&self, x: &M::Point<f64>, y: &M::Point<f64>) -> Result<Vector<M>, MetricError> {
        Ok(M::coordinates(x, y))
    }

    #[inline]
    fn weyl_jet(&self, x: &M::Point<f64>, d: &Vector<M>) -> Result<ArcJet<M>, MetricError> {
        Ok(ArcJet::straight(x, d))
    }

    fn slopes(&self, _: &M::Point<f64>) -> Option<<M::Dim as Dimension>::Array<Matrix<M>>> {
        None
    }
}

impl<M: Flat + Space<Dim = Const<N>>, const N: usize> Riemannian<M> for Constant<N> {
    type At<D: Scalar> = Factored<SMatrix<D, N, N>>;

    #[inline]
    fn at<D: Scalar>(&self, _: &ChartPoint<M, D>) -> Result<Self::At<D>, MetricError> {
        let embed = |a: &SMatrix<f64, N, N>| SMatrix::from_entries(|i, j| D::from(a[(i, j)]));
        Ok(Factored { g: embed(&self.factored.g), l: embed(&self.factored.l) })
    }

    fn matrix<D: Scalar>(&self, _: &ChartPoint<M, D>) -> SMatrix<D, N, N> {
        SMatrix::from_entries(|i, j| D::from(self.factored.g[(i, j)]))
    }

    #[inline]
    fn exp<D: Scalar>(
        &self,
        x: &ChartPoint<M, D>,
        v: &Vector<M, D>,
    ) -> Result<GeodesicEnd<M, D>, MetricError> {
        Ok(straight(x, v))
    }

    fn log(&self, x: &M::Point<f64>, y: &M::Point<f64>) -> Result<Vector<M>, MetricError> {
        Ok(M::coordinates(x, y))
    }

    #[inline]
    fn weyl_jet(&self, x: &M::Point<f64>, d: &Vector<M>) -> Result<ArcJet<M>, MetricError> {
        Ok(ArcJet::straight(x, d))
    }

    fn slopes(&self, _: &M::Point<f64>) -> Option<<M::Dim as Dimension>::Array<Matrix<M>>> {
        None
    }
}

/// A metric given as a matrix field; see [`Metric::field`].
#[derive(Clone, Copy)]
pub struct FieldMetric<F> {
    field: F,
}

impl<F> fmt::Debug for FieldMetric<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("FieldMetric").finish_non_exhaustive()
    }
}

impl<const N: usize, M, F> Riemannian<M> for FieldMetric<F>
where
    M: Flat + Space<Dim = Const<N>>,
    F: MatrixField<M>,
{
    type At<D: Scalar> = Factored<SMatrix<D, N, N>>;

    fn at<D: Scalar>(&self, x: &ChartPoint<M, D>) -> Result<Self::At<D>, MetricError> {
        Factored::new(self.field.at(&x.point()))
    }

    fn matrix<D: Scalar>(&self, x: &ChartPoint<M, D>) -> SMatrix<D, N, N> {
        self.field.at(&x.point())
    }

    fn exp<D: Scalar>(
        &self,
        x: &ChartPoint<M, D>,
        v: &Vector<M, D>,
    ) -> Result<GeodesicEnd<M, D>, MetricError> {
        constant_at(&self.field, &M::real(&x.point()))?;
        Ok(straight(x, v))
    }

    fn log(&self, x: &M::Point<f64>, y: &M::Point<f64>) -> Result<Vector<M>, MetricError> {
        constant_at(&self.field, x)?;
        Ok(M::coordinates(x, y))
    }

    fn weyl_jet(&self, x: &M::Point<f64>, d: &Vector<M>) -> Result<ArcJet<M>, MetricError> {
        let jet = ArcJet::straight(x, d);
        constant_at(&self.field, x)?;
        constant_at(&self.field, &jet.z)?;
        Ok(jet)
    }

    fn slopes(&self, x: &M::Point<f64>) -> Option<<M::Dim as Dimension>::Array<Matrix<M>>> {
        Some(self.field.jet(x).slopes)
    }
}

/// Refuses a geodesic that reaches the injectivity `radius`, up to the rounding of its length.
pub(crate) fn within(radius: f64, length: f64) -> Result<(), MetricError> {
    if length < radius - 4.0 * f64::EPSILON {
        Ok(())
    } else {
        Err(MetricError::CutLocus { length, radius })
    }
}

/// Where the flat geodesic through `x` arrives: `x + v`, with the same velocity.
#[inline]
fn straight<M: Flat, D: Scalar>(x: &ChartPoint<M, D>, v: &Vector<M, D>) -> GeodesicEnd<M, D> {
    (ChartPoint::around(&M::chart(&x.base, &(x.q + *v))), *v)
}

/// Refuses a metric closure whose derivative does not vanish at `x`.
fn constant_at<M: Flat>(g: &impl MatrixField<M>, x: &M::Point<f64>) -> Result<(), MetricError> {
    let jet = g.jet(x);
    let slope = jet.slopes.as_ref().iter().map(|slope| slope.max_abs()).fold(0.0, f64::max);
    // Round-off in the closure's own derivative of a constant.
    if slope <= 64.0 * f64::EPSILON * jet.value.max_abs() {
        Ok(())
    } else {
        Err(MetricError::Varies { slope })
    }
}

/// A metric that cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MetricError {
    /// An entry is NaN or infinite.
    #[error("the metric has an entry that is not a finite number")]
    NotFinite,
    /// `g ≠ gᵀ`.
    #[error(
        "the metric is not symmetric: entries ({row}, {column}) and ({column}, {row}) differ by {size:.3e}"
    )]
    NotSymmetric {
        /// Row of the entry.
        row: usize,
        /// Column of the entry.
        column: usize,
        /// The difference to its mirror image.
        size: f64,
    },
    /// Not positive definite.
    #[error("the metric is {0}")]
    NotPositive(#[from] NotPositive),
    /// A closure metric on a flat space depends on the point.
    #[error(
        "the metric varies (a derivative of size {slope:.3e}), so its geodesics are not straight \
         lines, and curved ones are not followed yet; use a constant metric"
    )]
    Varies {
        /// The largest derivative of an entry.
        slope: f64,
    },
    /// Two points, or the ends of a step, are so far apart that no shortest geodesic, or more than
    /// one, joins them.
    #[error(
        "a geodesic of length {length:.6} reaches the cut locus, which starts at {radius:.6}; take a \
         smaller step, or points that are closer together"
    )]
    CutLocus {
        /// The length of the geodesic.
        length: f64,
        /// The injectivity radius.
        radius: f64,
    },
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Euclidean, LieDual};
    use metriplectic_fields::Real;
    use nalgebra::{Matrix2, Matrix3, Vector2, Vector3, vector};
    use num_dual::DualNum;

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
        assert_eq!(
            Metric::constant(Matrix2::from_element(f64::NAN)).unwrap_err(),
            MetricError::NotFinite
        );
    }

    #[test]
    fn a_varying_closure_has_no_straight_geodesics() {
        let half_plane =
            Metric::field(|q: &Vector2<Real>| Matrix2::from_diagonal_element(q.y.powi(-2)));
        let x = ChartPoint::<Euclidean<2>>::centre(&vector![0.0, 2.0]);
        let error = Riemannian::<Euclidean<2>>::exp(&half_plane, &x, &vector![0.1, 0.0]);
        // ∂(y⁻²)/∂y at y = 2 is −1/4.
        assert_eq!(error.unwrap_err(), MetricError::Varies { slope: 0.25 });
        // … but it is a metric all the same, at every single point.
        assert!(Riemannian::<Euclidean<2>>::at(&half_plane, &x).is_ok());
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
