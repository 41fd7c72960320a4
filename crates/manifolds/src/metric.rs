//! Riemannian metrics: flat, sharp, norm, geodesics.
//!
//! A metric is the canonical one of its manifold ([`Canonical`]), a constant matrix
//! ([`Metric::constant`]), or a closure that gives the matrix `g(x)` in the coordinate frame at
//! each point ([`Metric::field`]), whose geodesics are integrated numerically.

use metriplectic_fields::{
    ChartPoint, Column, Dimension, Matrix, NotPositive, Real, Scalar, Space, Square, Vector,
};
use nalgebra::SMatrix;

use crate::{Constant, FieldMetric, StepPath, StepPathJet};

/// The metric at one point: an inner product `G(u, v) = uᵀ g v` on tangent vectors, factored as
/// `g = L Lᵀ`.
///
/// Laws: 1. `sharp` undoes `flat`; 2. `from_orthonormal(orthonormal(α)) = sharp(α)`;
/// 3. `orthonormal(α)·orthonormal(β) = G*(α, β)`.
pub trait InnerProduct<V>: Copy {
    /// The covector `♭v = g v`.
    fn flat(&self, v: &V) -> V;

    /// The components `L⁻¹α` of a covector in an orthonormal coframe.
    fn orthonormal(&self, alpha: &V) -> V;

    /// The vector `L⁻ᵀ a` with the orthonormal components `a`.
    #[allow(
        clippy::wrong_self_convention,
        reason = "the inverse of `orthonormal`; the inner product converts, and is not what is made"
    )]
    fn from_orthonormal(&self, a: &V) -> V;

    /// The vector `♯α = g⁻¹α`.
    #[inline]
    fn sharp(&self, alpha: &V) -> V {
        self.from_orthonormal(&self.orthonormal(alpha))
    }
}

/// A few roundings: the accuracy of a closed form.
pub(crate) const ROUNDED: f64 = 4.0 * f64::EPSILON;

/// Where a geodesic arrives: the point in the chart centred at its real part, and the velocity in
/// that frame.
pub type GeodesicEnd<M, D> = (ChartPoint<M, D>, Vector<M, D>);

/// A Riemannian metric on `M`, and its geodesics.
///
/// Laws ([`laws::metric`](crate::laws::metric)): 1. `g` is symmetric; 2. and positive; 3. the laws
/// of its inner product; 4. `exp_x(0) = x`; 5. geodesics have constant speed; 6. `weyl_jet` is the
/// derivative of the midpoint path.
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

    /// The vector `v` at `x` with `exp_x(v) = y`. Of an open [`Chart`](crate::Chart) the domain is not
    /// known here: the way may lead through what it leaves out.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if there is none that is found.
    fn log(&self, x: &M::Point<f64>, y: &M::Point<f64>) -> Result<Vector<M>, MetricError>;

    /// The geodesic of time 1 from `x` with velocity `d`, at its middle and its end.
    ///
    /// # Errors
    ///
    /// Those of [`exp`](Self::exp).
    #[inline]
    fn weyl_arc(&self, x: &M::Point<f64>, d: &Vector<M>) -> Result<StepPath<M>, MetricError> {
        let StepPathJet { z, d, end, .. } = self.weyl_jet(x, d)?;
        Ok(StepPath { z: ChartPoint::centre(&z), d, end })
    }

    /// The same path, with the derivatives along `d`.
    ///
    /// # Errors
    ///
    /// Those of [`exp`](Self::exp).
    fn weyl_jet(&self, x: &M::Point<f64>, d: &Vector<M>) -> Result<StepPathJet<M>, MetricError>;

    /// The length `√G(v, v)` of a tangent vector at a real point.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the matrix is not symmetric and positive.
    fn norm(&self, x: &M::Point<f64>, v: &Vector<M>) -> Result<f64, MetricError> {
        let at = self.at(&ChartPoint::centre(x))?;
        finite("the length of a vector", at.orthonormal(&at.flat(v)).magnitude())
    }

    /// The length of the geodesic that [`log`](Self::log) finds between two points: their distance,
    /// where it is the shortest.
    ///
    /// # Errors
    ///
    /// Those of [`log`](Self::log).
    fn distance(&self, x: &M::Point<f64>, y: &M::Point<f64>) -> Result<f64, MetricError> {
        self.norm(x, &self.log(x, y)?)
    }

    /// The Christoffel symbols at a real point in the chart centred there: the `k`-th matrix is
    /// `Γᵏ_ij = ½ g^{kl} (∂_i g_lj + ∂_j g_li − ∂_l g_ij)`. They vanish where the chart is normal.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the matrix is not symmetric and positive.
    fn christoffel(
        &self,
        x: &M::Point<f64>,
    ) -> Result<<M::Dim as Dimension>::Array<Matrix<M>>, MetricError> {
        let n = M::Dim::LEN;
        let mut symbols = M::Dim::array(|_| Matrix::<M>::zeros());
        let Some(g) = self.slopes(x) else { return Ok(symbols) };
        let at = self.at(&ChartPoint::centre(x))?;
        for i in 0..n {
            for j in 0..n {
                let first_kind =
                    Vector::<M>::from_index(|l| 0.5 * (g[i][(l, j)] + g[j][(l, i)] - g[l][(i, j)]));
                let raised = at.sharp(&first_kind);
                for k in 0..n {
                    symbols[k][(i, j)] = raised[k];
                }
            }
        }
        Ok(symbols)
    }

    /// The relative accuracy of the ends of geodesics.
    fn accuracy(&self) -> f64 {
        ROUNDED
    }

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
    fn volume_density<D: Scalar>(&self, x: &ChartPoint<M, D>) -> Result<D, MetricError> {
        finite("√det g", self.matrix(x).root_determinant()?)
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
    fn from_orthonormal(&self, a: &V) -> V {
        *a
    }
}

/// A symmetric positive matrix `g` and its Cholesky factor.
#[derive(Clone, Copy, Debug)]
pub struct Factored<N: Dimension, D: Scalar> {
    pub(crate) g: N::Matrix<D>,
    pub(crate) l: N::Matrix<D>,
}

impl<N: Dimension, D: Scalar> Factored<N, D> {
    /// Factors `g = L Lᵀ`.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if `g` is not finite, not symmetric, or not positive.
    pub fn new(g: N::Matrix<D>) -> Result<Self, MetricError> {
        symmetric(&g)?;
        let l = g.cholesky()?;
        Ok(Self { g, l })
    }
}

impl<N: Dimension, D: Scalar> PartialEq for Factored<N, D> {
    fn eq(&self, other: &Self) -> bool {
        self.g == other.g
    }
}

impl<N: Dimension, D: Scalar> InnerProduct<N::Vector<D>> for Factored<N, D> {
    #[inline]
    fn flat(&self, v: &N::Vector<D>) -> N::Vector<D> {
        self.g * *v
    }

    #[inline]
    fn orthonormal(&self, alpha: &N::Vector<D>) -> N::Vector<D> {
        self.l.solve_lower(alpha)
    }

    #[inline]
    fn from_orthonormal(&self, a: &N::Vector<D>) -> N::Vector<D> {
        self.l.solve_lower_transpose(a)
    }
}

/// Refuses a matrix that is not symmetric up to the rounding of its entries: relative to `√(g_ii g_jj)`,
/// the size that an entry can have in a positive matrix, in its own unit.
fn symmetric<D: Scalar, A: Square<D>>(g: &A) -> Result<(), MetricError> {
    if !g.max_abs().is_finite() {
        return Err(entry_not_finite(g));
    }
    for i in 0..A::Column::LEN {
        for j in 0..i {
            let size = (g[(i, j)].re() - g[(j, i)].re()).abs();
            if size > 0.0 && size > 64.0 * f64::EPSILON * entry_size(g, i, j) {
                return Err(MetricError::NotSymmetric { row: i, column: j, size });
            }
        }
    }
    Ok(())
}

/// The size `√(g_ii g_jj)` of an entry of a positive matrix.
#[cold]
fn entry_size<D: Scalar, A: Square<D>>(g: &A, i: usize, j: usize) -> f64 {
    g[(i, i)].re().abs().sqrt() * g[(j, j)].re().abs().sqrt()
}

/// The first entry that is not finite.
#[cold]
fn entry_not_finite<D: Scalar, A: Square<D>>(g: &A) -> MetricError {
    let n = A::Column::LEN;
    let entries = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    let bad = entries.map(|(i, j)| (i, j, g[(i, j)].re())).find(|(.., entry)| !entry.is_finite());
    let (row, column, value) = bad.unwrap_or((0, 0, f64::NAN));
    MetricError::EntryNotFinite { row, column, value }
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
        Constant::new(g)
    }

    /// The metric `G(u, v) = θ(u)·A(x) θ(v)` from a closure `A` or any other
    /// [`MatrixField`](metriplectic_fields::MatrixField), with `θ` the
    /// [`velocity`](metriplectic_fields::Space::embed) of a tangent vector:
    ///
    /// | on | a velocity is | the closure returns |
    /// |---|---|---|
    /// | a vector space, a chart | `x'` | `g`, `n × n` |
    /// | Sⁿ | `x'` in Rⁿ⁺¹ | a form on Rⁿ⁺¹, `(n+1) × (n+1)`; what it does off the sphere is not looked at |
    /// | SO(3) | the body angular velocity `Ω` | the inner product on so(3), `3 × 3` |
    /// | R₊ | `s'` | `1 × 1` |
    /// | a product | both, one below the other | the full matrix |
    ///
    /// Whether it is symmetric and positive is checked at every point where it is used. Geodesics are
    /// integrated with an estimated error of 10⁻¹³ in each piece; their derivatives come from dual
    /// numbers.
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
        FieldMetric::new(field)
    }
}

/// The vector `(t + ε₁ + ε₂) v`.
#[inline]
pub(crate) fn stretched<M: Space>(v: &Vector<M>, t: f64) -> Vector<M, Real> {
    Vector::<M, Real>::from_index(|i| Real::new(t * v[i], v[i], v[i], 0.0))
}

/// Refuses a geodesic that reaches the injectivity `radius`, up to the rounding of its length.
#[inline]
pub(crate) fn within(radius: f64, length: f64) -> Result<(), MetricError> {
    if length < radius - 4.0 * f64::EPSILON { Ok(()) } else { Err(beyond(radius, length)) }
}

/// A length that is not a number has not reached anything.
#[cold]
fn beyond(radius: f64, length: f64) -> MetricError {
    if length.is_nan() {
        MetricError::NotFinite { quantity: "the length of the geodesic", value: length }
    } else {
        MetricError::CutLocus { length, radius }
    }
}

/// A number that has not left the range of numbers.
#[inline]
pub(crate) fn finite<D: Scalar>(quantity: &'static str, number: D) -> Result<D, MetricError> {
    let value = number.re();
    if value.is_finite() { Ok(number) } else { Err(MetricError::NotFinite { quantity, value }) }
}

/// A column whose components have not left the range of numbers.
#[inline]
pub(crate) fn finite_column<D: Scalar, V: Column<D>>(
    quantity: &'static str,
    v: V,
) -> Result<V, MetricError> {
    for i in 0..V::LEN {
        finite(quantity, v[i])?;
    }
    Ok(v)
}

/// A metric that cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MetricError {
    /// An entry is NaN or infinite.
    #[error(
        "entry ({row}, {column}) of the metric is {value}; every entry must be a finite number"
    )]
    EntryNotFinite {
        /// Row of the entry.
        row: usize,
        /// Its column.
        column: usize,
        /// Its value.
        value: f64,
    },
    /// What is computed of a metric and of points is NaN, because they are, or beyond the range of
    /// numbers.
    #[error(
        "{quantity} is {value}, which is not a finite number; take finite points, closer together"
    )]
    NotFinite {
        /// What is not finite.
        quantity: &'static str,
        /// Its value.
        value: f64,
    },
    /// A point is at or beyond the edge of the chart at another one: on Sⁿ its antipode, on SO(3) half
    /// a turn.
    #[error(
        "the chart at one point does not reach the other, at the coordinate distance {distance}; take \
         a smaller step, or points that are closer together"
    )]
    OutOfChart {
        /// The norm of the coordinates; not a number where there are none.
        distance: f64,
    },
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
    /// A geodesic runs out of the chart: the metric beyond is not a number.
    #[error(
        "the geodesic runs into the edge of the chart at {time:.3} of its way, where the metric is not a \
         finite number; take a smaller step, or a metric in which the edge is far"
    )]
    Edge {
        /// The fraction of the way that was followed.
        time: f64,
    },
    /// A geodesic comes to a place where its metric is not positive.
    #[error(
        "at {time:.3} of the way of a geodesic the metric is {not_positive}; take a smaller step, or \
         leave the place out of the domain"
    )]
    Degenerate {
        /// The fraction of the way that was followed.
        time: f64,
        /// The pivot.
        not_positive: NotPositive,
    },
    /// A geodesic through a metric that varies too much along it.
    #[error(
        "the geodesic was followed for {time:.3} of its way in {pieces} pieces, and the metric is too \
         uneven to go on; take a smaller step, and look for what is not smooth in the metric"
    )]
    Uneven {
        /// The fraction of the way that was followed.
        time: f64,
        /// The pieces that were tried.
        pieces: usize,
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

impl MetricError {
    /// The error of a geodesic that stops at `time`, if it is the matrix `g` there that stops it.
    pub(crate) fn stopped<D: Scalar>(time: f64, g: &impl Square<D>) -> Option<Self> {
        let not_positive = g.cholesky().err()?;
        let edge = !not_positive.pivot.is_finite();
        Some(if edge { Self::Edge { time } } else { Self::Degenerate { time, not_positive } })
    }

    /// The error on a part of a way that begins at `start` and has the length `fraction`.
    pub(crate) fn on_part(self, start: f64, fraction: f64) -> Self {
        let whole = |time| start + fraction * time;
        match self {
            Self::Edge { time } => Self::Edge { time: whole(time) },
            Self::Degenerate { time, not_positive } => {
                Self::Degenerate { time: whole(time), not_positive }
            }
            Self::Uneven { time, pieces } => Self::Uneven { time: whole(time), pieces },
            other => other,
        }
    }

    /// The error of a point that is at the edge of its chart.
    #[cold]
    pub fn out_of_chart<M: Space, D: Scalar>(x: &ChartPoint<M, D>) -> Self {
        Self::OutOfChart { distance: x.q.magnitude() }
    }
}
