//! Riemannian metrics: flat, sharp, norm, geodesics.
//!
//! A metric is the canonical one of its manifold ([`Canonical`]), a constant matrix
//! ([`Metric::constant`]), or a closure that gives the matrix `g(x)` in the coordinate frame at
//! each point ([`Metric::field`]), whose geodesics are integrated numerically.

use std::fmt;

use metriplectic_fields::{
    ChartPoint, Column, Dimension, Matrix, MatrixField, NotPositive, Real, Scalar, Space, Square,
    Vector,
};
use nalgebra::{Const, SMatrix, SVector};
use num_dual::Dual64;

use crate::{ArcJet, geodesic};

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
    fn end(&self, x: &M::Point<f64>, v: &Vector<M>) -> Result<M::Point<f64>, MetricError> {
        Ok(self.exp(&ChartPoint::centre(x), v)?.0.point())
    }

    /// The geodesic from a real point with velocity `v`, at time `t`, with its first and second
    /// derivative along `t`: the point `γ(t + ε₁ + ε₂)`.
    ///
    /// # Errors
    ///
    /// Those of [`exp`](Self::exp).
    fn along(
        &self,
        x: &M::Point<f64>,
        v: &Vector<M>,
        t: f64,
    ) -> Result<M::Point<Real>, MetricError>;

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

    /// What rounding has lost of the displacement `v` on the way from `x` to `y = exp_x(v)`, so that
    /// the next step can make up for it; zero where it is not known.
    #[inline]
    fn lost(&self, _x: &M::Point<f64>, _v: &Vector<M>, _y: &M::Point<f64>) -> Vector<M> {
        Vector::<M>::zero()
    }

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
    fn end(&self, x: &M::Point<f64>, v: &Vector<M>) -> Result<M::Point<f64>, MetricError> {
        Ok(M::chart(x, v))
    }

    #[inline]
    fn along(
        &self,
        x: &M::Point<f64>,
        v: &Vector<M>,
        t: f64,
    ) -> Result<M::Point<Real>, MetricError> {
        Ok(M::chart(x, &(Vector::<M, Real>::embed(v) * time(t))))
    }

    #[inline]
    fn lost(&self, x: &M::Point<f64>, v: &Vector<M>, y: &M::Point<f64>) -> Vector<M> {
        *v - M::coordinates(x, y)
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

    #[inline]
    fn along(
        &self,
        x: &M::Point<f64>,
        v: &Vector<M>,
        t: f64,
    ) -> Result<M::Point<Real>, MetricError> {
        Ok(M::chart(x, &(Vector::<M, Real>::embed(v) * time(t))))
    }

    #[inline]
    fn lost(&self, x: &M::Point<f64>, v: &Vector<M>, y: &M::Point<f64>) -> Vector<M> {
        *v - M::coordinates(x, y)
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
        let [q, velocity] = geodesic::follow(&self.field, &x.base, &x.q, v)?;
        Ok((ChartPoint::around(&M::chart(&x.base, &q)), velocity))
    }

    fn along(
        &self,
        x: &M::Point<f64>,
        v: &Vector<M>,
        t: f64,
    ) -> Result<M::Point<Real>, MetricError> {
        let [q, velocity] = geodesic::follow(&self.field, x, &Vector::<M>::zero(), &(*v * t))?;
        let velocity = if t > 0.0 { velocity * t.recip() } else { *v };
        let bend = geodesic::acceleration(&self.field, &M::chart(x, &q), &velocity)
            .ok_or(MetricError::Lost { time: t })?;
        let jet =
            Vector::<M, Real>::from_index(|i| Real::new(q[i], velocity[i], velocity[i], bend[i]));
        Ok(M::chart(x, &jet))
    }

    fn log(&self, x: &M::Point<f64>, y: &M::Point<f64>) -> Result<Vector<M>, MetricError> {
        shoot(self, x, y)
    }

    fn weyl_jet(&self, x: &M::Point<f64>, d: &Vector<M>) -> Result<ArcJet<M>, MetricError> {
        arc_by_dual_numbers(self, x, d)
    }

    fn slopes(&self, x: &M::Point<f64>) -> Option<<M::Dim as Dimension>::Array<Matrix<M>>> {
        Some(self.field.jet(x).slopes)
    }
}

/// The time `t + ε₁ + ε₂`.
#[inline]
pub(crate) fn time(t: f64) -> Real {
    Real::new(t, 1.0, 1.0, 0.0)
}

/// The midpoint arc of any metric: two halves of a geodesic, one dual number for each direction.
fn arc_by_dual_numbers<M: Space, G: Riemannian<M>>(
    metric: &G,
    x: &M::Point<f64>,
    d: &Vector<M>,
) -> Result<ArcJet<M>, MetricError> {
    let zero = Matrix::<M>::zeros();
    let mut jet: Option<ArcJet<M>> = None;
    for k in 0..M::Dim::LEN {
        let half = Vector::<M, Dual64>::from_index(|i| {
            Dual64::new(0.5 * d[i], if i == k { 0.5 } else { 0.0 })
        });
        let (z, v) = metric.exp(&ChartPoint::centre(x), &half)?;
        let (end, _) = metric.exp(&z, &v)?;
        let jet = jet.get_or_insert_with(|| ArcJet {
            z: z.base.clone(),
            dz: zero,
            d: Vector::<M>::from_index(|i| 2.0 * v[i].re),
            dd: zero,
            end: end.base.clone(),
            dend: zero,
        });
        for i in 0..M::Dim::LEN {
            jet.dz[(i, k)] = z.q[i].eps;
            jet.dd[(i, k)] = 2.0 * v[i].eps;
            jet.dend[(i, k)] = end.q[i].eps;
        }
    }
    jet.ok_or(MetricError::NotFinite)
}

/// Corrections that one shot of a logarithm may take, and halvings of each.
const CORRECTIONS: usize = 20;
const HALVINGS: usize = 8;
/// Stages of the continuation of a logarithm, until it is given up.
const STAGES: [u32; 4] = [1, 4, 16, 64];

/// The logarithm by shooting: Newton's method for `exp_x(v) = y`. If it does not get there from the
/// straight line, the end is moved from `x` to `y` in stages, each shot aimed by the one before.
fn shoot<M: Space, G: Riemannian<M>>(
    metric: &G,
    x: &M::Point<f64>,
    y: &M::Point<f64>,
) -> Result<Vector<M>, MetricError> {
    let straight = M::coordinates(x, y);
    let mut missed = MetricError::NotFinite;
    for stages in STAGES {
        let mut v = Vector::<M>::zero();
        let end = (1..=stages).try_for_each(|stage| {
            let share = f64::from(stage) / f64::from(stages);
            let grown = f64::from(stage) / f64::from((stage - 1).max(1));
            let aim = if stage == 1 { straight * share } else { v * grown };
            v = hit(metric, x, &M::chart(x, &(straight * share)), &aim)?;
            Ok(())
        });
        match end {
            Ok(()) => return Ok(v),
            Err(error) => missed = error,
        }
    }
    Err(missed)
}

/// Newton's method for `exp_x(v) = y`, damped, from a first aim.
fn hit<M: Space, G: Riemannian<M>>(
    metric: &G,
    x: &M::Point<f64>,
    y: &M::Point<f64>,
    aim: &Vector<M>,
) -> Result<Vector<M>, MetricError> {
    let miss = |v: &Vector<M>| metric.end(x, v).map(|end| M::coordinates(&end, y));
    let size = M::coordinates(x, y).magnitude();
    let (mut v, mut off) = (*aim, miss(aim)?);
    for _ in 0..CORRECTIONS {
        if off.magnitude() <= 4.0 * f64::EPSILON * (1.0 + size) {
            return Ok(v);
        }
        let missed = MetricError::NoLogarithm { distance: size, missed_by: off.magnitude() };
        let correction = metric.weyl_jet(x, &v)?.dend.solve(&off).ok_or(missed)?;
        let mut length = 1.0;
        let closer = (0..HALVINGS).find_map(|_| {
            let next = v + correction * length;
            length *= 0.5;
            let off_next = miss(&next).ok()?;
            (off_next.magnitude() < off.magnitude()).then_some((next, off_next))
        });
        match closer {
            Some(next) => (v, off) = next,
            // The geodesic itself is good to 1e-13: a stall there is the end.
            None if off.magnitude() <= 1e-12 * (1.0 + size) => return Ok(v),
            None => return Err(missed),
        }
    }
    Err(MetricError::NoLogarithm { distance: size, missed_by: off.magnitude() })
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
    /// A geodesic was lost on its way.
    #[error(
        "the geodesic cannot be followed beyond {time:.3} of its way: it runs into the edge of the \
         chart, or the metric is not positive there; take a smaller step"
    )]
    Lost {
        /// The share of the way that was followed.
        time: f64,
    },
    /// No geodesic was found between two points.
    #[error(
        "no geodesic was found to a point at the coordinate distance {distance:.3e}; the best one \
         misses it by {missed_by:.1e}; take points that are closer together"
    )]
    NoLogarithm {
        /// The coordinate distance of the points.
        distance: f64,
        /// How far off the best geodesic ends.
        missed_by: f64,
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
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};

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
            assert!((distance - length).abs() < 1e-12 * length, "{distance} for {length}");
            let centre = x.x + x.y * sine / cosine;
            let radii = ((x - vector![centre, 0.0]).norm(), (end - vector![centre, 0.0]).norm());
            assert!((radii.0 / radii.1 - 1.0).abs() < 1e-12);
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
    fn a_geodesic_that_leaves_the_chart_is_an_error_with_the_time() {
        // The edge x = 1 of the slit metric is at a finite distance, and there is nothing beyond it.
        let slit =
            Metric::field(|q: &Vector2<Real>| Matrix2::from_diagonal_element((-q.x + 1.0).sqrt()));
        let error = Riemannian::<Euclidean<2>>::end(&slit, &vector![0.0, 0.0], &vector![3.0, 0.0]);
        assert!(matches!(error, Err(MetricError::Lost { time }) if time > 0.1 && time < 1.0));
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
