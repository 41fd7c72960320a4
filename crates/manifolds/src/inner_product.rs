//! The metric at one point.

use metriplectic_fields::{Column, Dimension, Scalar, Square, triangular};

use crate::metric_error::{MetricError, finite};

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

    /// Computes `√det g`, the product of the pivots of `L`.
    ///
    /// # Errors
    ///
    /// [`MetricError::NotFinite`] if it is beyond the range of numbers.
    pub(crate) fn root_determinant(&self) -> Result<D, MetricError> {
        let pivots = (0..N::LEN).map(|i| self.l[(i, i)]);
        finite("√det g", pivots.fold(D::one(), |product, pivot| product * pivot))
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

/// Refuses a matrix that is not finite, or not symmetric up to the rounding of its entries.
fn symmetric<D: Scalar, A: Square<D>>(g: &A) -> Result<(), MetricError> {
    if !g.max_abs().is_finite() {
        return Err(entry_not_finite(g));
    }
    match triangular::asymmetric(A::Column::LEN, g) {
        Some((row, column, size)) => Err(MetricError::NotSymmetric { row, column, size }),
        None => Ok(()),
    }
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
