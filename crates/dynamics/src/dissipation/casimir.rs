//! The dissipation of a form on a Lie algebra, which makes a Casimir grow.

use metriplectic_fields::{Scalar, Square};
use metriplectic_manifolds::{LieAlgebra, LieDual, MetricAt, MetricError, Riemannian};
use nalgebra::{DMatrix, SMatrix, SVector};

use super::{Dissipation, DissipationJet};

/// The dissipation of a symmetric positive semidefinite form `κ` on a Lie algebra `g`, on its dual
/// (Bloch, Farré Puiggalí, Martín de Diego 2024, eq. "ops1"; Gay-Balmaz and Holm 2014,
/// arXiv:1310.4543, for the Casimir dissipation of which it is an instance):
///
/// ```math
/// K_w(\alpha, \beta) = \kappa([w, \alpha], [w, \beta]) .
/// ```
///
/// It is the force of the forced Euler-Poincaré equations: with `F(ξ) = κ[ξ, dC]`
/// ([`force`](Self::force)) and `w = ξ = dH`, `K dC = ad*_ξ F(ξ)`, so that
///
/// ```math
/// \mu' = \mathrm{ad}^*_\xi \bigl( \mu + F(\xi) \bigr), \qquad
/// C' = \kappa([\xi, dC], [\xi, dC]) \ge 0 .
/// ```
///
/// It annihilates `w` because `[w, w] = 0`. On so(3)* with `κ = 1` it is
/// [`MetricDissipation`](super::MetricDissipation).
///
/// ```
/// use metriplectic_dynamics::{CasimirDissipation, System};
/// use metriplectic_fields::Real;
/// use metriplectic_manifolds::LieDual;
/// use nalgebra::{SMatrix, Vector6};
/// let se3 = LieDual::se3();
/// let friction = CasimirDissipation::new(se3.algebra(), SMatrix::identity() * 0.1).unwrap();
/// let system = System::on(se3)
///     .energy(|x: &Vector6<Real>| x.norm_squared() * 0.5 + x[2] * x[5])
///     .entropy(|x: &Vector6<Real>| (3..6).map(|i| x[i] * x[i]).sum::<Real>() * 0.5)
///     .dissipation(friction)
///     .build();
/// assert!(system.is_ok());
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct CasimirDissipation<const N: usize> {
    algebra: LieAlgebra<N>,
    form: SMatrix<f64, N, N>,
}

/// The negative eigenvalue, relative to the largest, that the rounding of the entries may cause.
const ROUND_OFF: f64 = 64.0 * f64::EPSILON;

impl<const N: usize> CasimirDissipation<N> {
    /// The dissipation of the form with the matrix `form` in the basis of the algebra.
    ///
    /// # Errors
    ///
    /// [`FormError`] if the matrix is not finite, not symmetric, or not positive semidefinite.
    pub fn new(algebra: &LieAlgebra<N>, form: SMatrix<f64, N, N>) -> Result<Self, FormError> {
        let allowed = ROUND_OFF * form.amax();
        for row in 0..N {
            for column in 0..N {
                let size = (form[(row, column)] - form[(column, row)]).abs();
                if !size.is_finite() {
                    return Err(FormError::NotFinite { row, column });
                }
                if size > allowed {
                    return Err(FormError::NotSymmetric { row, column, size });
                }
            }
        }
        let eigenvalue = DMatrix::from_fn(N, N, |i, j| form[(i, j)]).symmetric_eigenvalues().min();
        if eigenvalue < -allowed * N as f64 {
            return Err(FormError::NotPositive { eigenvalue });
        }
        Ok(Self { algebra: algebra.clone(), form })
    }

    /// Returns the algebra.
    pub(crate) const fn algebra(&self) -> &LieAlgebra<N> {
        &self.algebra
    }

    /// Computes vectors `c_a`, as columns, with `κ = Σ c_a c_aᵀ`: the factor of Cholesky, whose columns vanish where its
    /// pivots are round-off.
    pub(crate) fn columns(&self) -> SMatrix<f64, N, N> {
        let (mut rest, mut columns) = (self.form, SMatrix::<f64, N, N>::zeros());
        for a in 0..N {
            let pivot = rest[(a, a)];
            if pivot > ROUND_OFF * self.form[(a, a)] {
                let column = rest.column(a) / pivot.sqrt();
                rest -= column * column.transpose();
                columns.set_column(a, &column);
            }
        }
        columns
    }

    /// The force `F(ξ) = κ[ξ, dC]` in `g*`, for the differential `dC` of a Casimir:
    /// `⟨F(ξ), η⟩ = κ(η, [ξ, dC])`.
    #[inline]
    pub fn force<D: Scalar>(&self, xi: &SVector<D, N>, dc: &SVector<D, N>) -> SVector<D, N> {
        let form = SMatrix::<D, N, N>::from_entries(|i, j| D::from(self.form[(i, j)]));
        form * self.algebra.bracket(xi, dc)
    }
}

impl<const N: usize, G: Riemannian<LieDual<N>>> Dissipation<LieDual<N>, G>
    for CasimirDissipation<N>
{
    #[inline]
    fn apply<D: Scalar>(
        &self,
        _: &MetricAt<'_, LieDual<N>, G, D>,
        w: &SVector<D, N>,
        alpha: &SVector<D, N>,
    ) -> Result<SVector<D, N>, MetricError> {
        Ok(self.algebra.coadjoint(w, &self.force(w, alpha)))
    }

    #[inline]
    fn linearise(
        &self,
        _: &MetricAt<'_, LieDual<N>, G>,
        w: &SVector<f64, N>,
        alpha: &SVector<f64, N>,
    ) -> Result<DissipationJet<LieDual<N>>, MetricError> {
        let force = self.force(w, alpha);
        // (ad_w)^d_b = C_ab^d w^a, ad_α likewise, and ad*_δ F = f δ with f_ba = C_ab^d F_d.
        let zero = SMatrix::<f64, N, N>::zeros();
        let (mut ad_w, mut ad_alpha, mut turned) = (zero, zero, zero);
        for c in self.algebra.constants() {
            ad_w[(c.d, c.b)] += c.value * w[c.a];
            ad_alpha[(c.d, c.b)] += c.value * alpha[c.a];
            turned[(c.b, c.a)] += c.value * force[c.d];
        }
        let lowered = ad_w.transpose() * self.form;
        Ok(DissipationJet {
            value: ad_w.transpose() * force,
            along_z: zero,
            along_w: turned - lowered * ad_alpha,
            tensor: lowered * ad_w,
        })
    }
}

/// A matrix that is not a positive semidefinite form.
#[derive(Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FormError {
    /// An entry is NaN or infinite.
    #[error("entry ({row}, {column}) of the form is not a finite number")]
    NotFinite {
        /// Row of the entry.
        row: usize,
        /// Its column.
        column: usize,
    },
    /// `κ ≠ κᵀ`.
    #[error(
        "the form is not symmetric: entries ({row}, {column}) and ({column}, {row}) differ by {size:.3e}"
    )]
    NotSymmetric {
        /// Row of the entry.
        row: usize,
        /// Its column.
        column: usize,
        /// `|κ_ij − κ_ji|`.
        size: f64,
    },
    /// `κ` has a negative eigenvalue, so it would destroy entropy.
    #[error("the form is not positive semidefinite: it has the eigenvalue {eigenvalue:.3e}")]
    NotPositive {
        /// The least eigenvalue.
        eigenvalue: f64,
    },
}

metriplectic_equations::debug_is_the_sentence!(FormError);

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, vector};

    #[test]
    fn a_form_that_is_not_semidefinite_is_refused_with_its_number() {
        let so3 = LieDual::so3();
        let form = |m: Matrix3<f64>| CasimirDissipation::new(so3.algebra(), m);
        assert!(form(Matrix3::from_diagonal(&vector![1.0, 0.0, 2.0])).is_ok());
        let indefinite = form(Matrix3::new(1.0, 2.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0, 1.0));
        assert!(
            matches!(indefinite, Err(FormError::NotPositive { eigenvalue }) if (eigenvalue + 1.0).abs() < 1e-14)
        );
        let mut skewed = Matrix3::identity();
        skewed.m21 = 0.5;
        let error = FormError::NotSymmetric { row: 0, column: 1, size: 0.5 };
        assert_eq!(form(skewed), Err(error));
        skewed.m21 = f64::NAN;
        assert_eq!(form(skewed), Err(FormError::NotFinite { row: 0, column: 1 }));
        // One vector has no area: this form is singular, and rounded.
        let b = vector![0.1, 0.7, -0.3];
        assert!(form(b * b.transpose()).is_ok());
    }
}
