//! The dissipation built from the metric.

use metriplectic_fields::{Column, Dimension, Matrix, Scalar, Square, Vector};
use metriplectic_manifolds::{InnerProduct, Manifold, MetricAt, MetricError, Riemannian};

use super::{Dissipation, DissipationJet, Scaled, turn};

/// The dissipation of a Riemannian metric (Bloch, Farré Puiggalí, Martín de Diego 2024, eq.
/// "semid"):
///
/// ```math
/// K_w(\alpha, \beta) = G^*(w, w)\, G^*(\alpha, \beta) - G^*(w, \alpha)\, G^*(w, \beta) .
/// ```
///
/// It is `G*(w, w)` times the projection off `w`: symmetric, positive semidefinite, and it annihilates
/// `w`. In an orthonormal coframe with components `w_i`, `s_i` it is evaluated by antisymmetry,
///
/// ```math
/// (K_w s)_i = \sum_j w_j a_{ji}, \qquad a_{ji} = w_j s_i - w_i s_j ,
/// ```
///
/// so that `⟨w, K_w s⟩ = Σ w_i w_j a_ji` cancels in pairs instead of between two large numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MetricDissipation;

impl MetricDissipation {
    /// Scales the dissipation by `κ(x) ≥ 0`, a closure `|x| -> Real` or any other
    /// [`ScalarField`](metriplectic_fields::ScalarField).
    ///
    /// ```
    /// use metriplectic_dynamics::{MetricDissipation, System};
    /// use metriplectic_fields::Real;
    /// use metriplectic_manifolds::LieDual;
    /// use nalgebra::Vector3;
    /// let body = System::on(LieDual::so3())
    ///     .energy(|p: &Vector3<Real>| p.x * p.x + p.y * p.y * 0.5)
    ///     .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
    ///     .dissipation(MetricDissipation::scaled(|p: &Vector3<Real>| p.norm_squared() + 0.1))
    ///     .build();
    /// assert!(body.is_ok());
    /// ```
    pub const fn scaled<F>(kappa: F) -> Scaled<F, Self> {
        Scaled(kappa, Self)
    }
}

impl<M: Manifold, G: Riemannian<M>> Dissipation<M, G> for MetricDissipation {
    #[inline]
    fn apply<D: Scalar>(
        &self,
        g: &MetricAt<'_, M, G, D>,
        w: &Vector<M, D>,
        alpha: &Vector<M, D>,
    ) -> Result<Vector<M, D>, MetricError> {
        let g = g.inner()?;
        let w_hat = g.orthonormal(w);
        Ok(g.from_orthonormal(&turn::<M, D>(&w_hat, &g.orthonormal(alpha), &w_hat)))
    }

    #[inline]
    fn linearise(
        &self,
        g: &MetricAt<'_, M, G>,
        w: &Vector<M>,
        alpha: &Vector<M>,
    ) -> Result<DissipationJet<M>, MetricError> {
        let along_z = slope_along_z(g, w, alpha)?;
        let g = g.inner()?;
        let (w_hat, a_hat) = (g.orthonormal(w), g.orthonormal(alpha));
        let value = g.from_orthonormal(&turn::<M, f64>(&w_hat, &a_hat, &w_hat));
        let (w_sharp, a_sharp) = (g.from_orthonormal(&w_hat), g.from_orthonormal(&a_hat));
        let (ww, wa) = (w_hat.dot(&w_hat), w_hat.dot(&a_hat));
        // K = (w·w) g⁻¹ − ♯w ♯wᵀ, and K_w α = (w·w) ♯α − (w·α) ♯w differentiated along w.
        let mut tensor = Matrix::<M>::zeros();
        let mut along_w = Matrix::<M>::zeros();
        for j in 0..M::Dim::LEN {
            let cometric = g.sharp(&Vector::<M>::basis(j));
            for i in 0..M::Dim::LEN {
                tensor[(i, j)] = ww * cometric[i] - w_sharp[i] * w_sharp[j];
                along_w[(i, j)] =
                    2.0 * a_sharp[i] * w_sharp[j] - w_sharp[i] * a_sharp[j] - wa * cometric[i];
            }
        }
        Ok(DissipationJet { value, along_z, along_w, tensor })
    }

    fn adapts(&self) -> bool {
        true
    }

    fn is_default(&self) -> bool {
        true
    }
}

/// `∂(K_w α)/∂z`, which is zero for a constant metric. With `P = ♯w`, `A = ♯α` and
/// `∂_k g⁻¹ = −g⁻¹ (∂_k g) g⁻¹`,
/// `∂_k (K_w α) = −(P·∂_k g P) A + (w·P) ∂_k A + (A·∂_k g P) P − (w·A) ∂_k P`.
#[inline]
fn slope_along_z<M: Manifold, G: Riemannian<M>>(
    g: &MetricAt<'_, M, G>,
    w: &Vector<M>,
    alpha: &Vector<M>,
) -> Result<Matrix<M>, MetricError> {
    let mut slope = Matrix::<M>::zeros();
    let Some(slopes) = g.slopes()? else { return Ok(slope) };
    let g = g.inner()?;
    let (p, a) = (g.sharp(w), g.sharp(alpha));
    for k in 0..M::Dim::LEN {
        let (gp, ga) = (slopes[k] * p, slopes[k] * a);
        let column = -(a * p.dot(&gp)) - g.sharp(&ga) * w.dot(&p)
            + p * a.dot(&gp)
            + g.sharp(&gp) * w.dot(&a);
        for i in 0..M::Dim::LEN {
            slope[(i, k)] = column[i];
        }
    }
    Ok(slope)
}
