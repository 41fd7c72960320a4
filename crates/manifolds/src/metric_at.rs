//! A metric at one point, evaluated once.

use std::cell::OnceCell;
use std::fmt;

use metriplectic_fields::{ChartPoint, Dimension, Matrix, Scalar, Space};

use crate::{MetricError, Riemannian};

/// The derivatives `∂g/∂qᵏ` of a metric along the chart.
pub type MetricSlopes<M> = <<M as Space>::Dim as Dimension>::Array<Matrix<M>>;

/// The derivatives of a metric; `None` if it is constant by construction.
pub type Slopes<M> = Option<MetricSlopes<M>>;

/// A metric at one point of a chart. What is asked for is evaluated once, and kept for all that need it there:
/// the inner product, the bracket, the dissipation and the volume form.
///
/// ```
/// use metriplectic_fields::{ChartPoint, Real};
/// use metriplectic_manifolds::{Euclidean, InnerProduct, Metric, MetricAt, MetricError};
/// use nalgebra::{Matrix2, Vector2, vector};
/// use num_dual::DualNum;
/// let half_plane =
///     Metric::field(|q: &Vector2<Real>| Matrix2::from_diagonal_element((q.y * q.y).recip()));
/// let x = ChartPoint::centre(&vector![0.0, 2.0]);
/// let g = MetricAt::<Euclidean<2>, _>::new(&half_plane, &x);
/// assert_eq!(g.inner()?.flat(&vector![1.0, 0.0]), vector![0.25, 0.0]);
/// assert_eq!(g.volume_density()?, 0.25);
/// # Ok::<(), MetricError>(())
/// ```
pub struct MetricAt<'a, M: Space, G: Riemannian<M>, D: Scalar = f64> {
    /// The metric.
    pub metric: &'a G,
    /// The point, and the chart that components refer to.
    pub x: &'a ChartPoint<M, D>,
    inner: OnceCell<G::At<D>>,
    slopes: OnceCell<Slopes<M>>,
}

impl<M: Space, G: Riemannian<M>, D: Scalar> fmt::Debug for MetricAt<'_, M, G, D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("MetricAt").field("x", self.x).finish_non_exhaustive()
    }
}

impl<'a, M: Space, G: Riemannian<M>, D: Scalar> MetricAt<'a, M, G, D> {
    /// Makes the metric at `x`, without an evaluation.
    #[inline]
    pub const fn new(metric: &'a G, x: &'a ChartPoint<M, D>) -> Self {
        Self { metric, x, inner: OnceCell::new(), slopes: OnceCell::new() }
    }

    /// Makes the metric at `x`, where its inner product is known.
    #[inline]
    pub(crate) fn known(metric: &'a G, x: &'a ChartPoint<M, D>, inner: G::At<D>) -> Self {
        Self { metric, x, inner: OnceCell::from(inner), slopes: OnceCell::new() }
    }

    /// Returns the inner product.
    ///
    /// # Errors
    ///
    /// [`MetricError`] if the matrix is not symmetric and positive.
    #[inline]
    pub fn inner(&self) -> Result<&G::At<D>, MetricError> {
        if let Some(inner) = self.inner.get() {
            return Ok(inner);
        }
        let inner = self.metric.at(self.x)?;
        Ok(self.inner.get_or_init(|| inner))
    }

    /// Returns the density `√det g` of the volume form in the chart.
    ///
    /// # Errors
    ///
    /// The errors of [`inner`](Self::inner), and [`MetricError::NotFinite`] beyond the range of numbers.
    #[inline]
    pub fn volume_density(&self) -> Result<D, MetricError> {
        G::volume_density(self.inner()?)
    }
}

impl<M: Space, G: Riemannian<M>> MetricAt<'_, M, G> {
    /// Returns the derivatives `∂g/∂qᵏ` along the chart, at its centre. The inner product is evaluated with them.
    ///
    /// # Errors
    ///
    /// The errors of [`inner`](Self::inner).
    #[inline]
    pub fn slopes(&self) -> Result<&Slopes<M>, MetricError> {
        if let Some(slopes) = self.slopes.get() {
            return Ok(slopes);
        }
        let jet = self.metric.jet(&self.x.base)?;
        self.inner.get_or_init(|| jet.at);
        Ok(self.slopes.get_or_init(|| jet.slopes))
    }
}

/// A metric at a real point, with its derivatives along the chart there.
pub struct MetricJet<M: Space, G: Riemannian<M>> {
    /// The inner product.
    pub at: G::At<f64>,
    /// The derivatives of the matrix.
    pub slopes: Slopes<M>,
}

impl<M: Space, G: Riemannian<M>> fmt::Debug for MetricJet<M, G> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("MetricJet").finish_non_exhaustive()
    }
}
