//! The dissipation of a metriplectic 4-bracket that is a Kulkarni-Nomizu product.

use std::fmt;

use metriplectic_fields::{
    ChartPoint, Column, Dimension, Matrix, MatrixField, MatrixJet, Scalar, Square, Vector,
};
use metriplectic_manifolds::{Manifold, MetricAt, MetricError, Riemannian, out_of_chart};

use super::{Dissipation, DissipationJet, turn};

/// The dissipation of two symmetric positive semidefinite matrix fields `σ` and `μ` on covectors,
/// by their Kulkarni-Nomizu product with `w` in the second and the fourth slot (Morrison and Updike
/// 2024, *Phys. Rev. E* 109, 045202):
///
/// ```math
/// K_w(\alpha, \beta) = \sigma(w, w)\, \mu(\alpha, \beta) - \sigma(w, \alpha)\, \mu(w, \beta)
///     - \mu(w, \alpha)\, \sigma(w, \beta) + \mu(w, w)\, \sigma(\alpha, \beta) .
/// ```
///
/// The two fields are closures `|x| -> matrix` or any other [`MatrixField`], acting on covectors dual
/// to the [`velocity`](metriplectic_fields::Space::embed) of the space. By Cauchy and Schwarz
/// `2|σ(w,α) μ(w,α)| ≤ σ(w,w) μ(α,α) + μ(w,w) σ(α,α)`, so `K_w ⪰ 0`; `σ = μ = G*/√2` is
/// [`MetricDissipation`](super::MetricDissipation). It is evaluated as `K_w α = −N w` with the
/// bivector `N = σw ∧ μα + μw ∧ σα`, so that `⟨w, K_w α⟩` cancels in pairs.
///
/// ```
/// use metriplectic_dynamics::{KulkarniNomizu, System};
/// use metriplectic_fields::Real;
/// use metriplectic_manifolds::Euclidean;
/// use nalgebra::{Matrix3, Vector3};
/// // Entropy is made by the third coordinate alone, at the cost of the first two.
/// let sigma = |x: &Vector3<Real>| Matrix3::from_diagonal(&Vector3::new(x.z, x.z, 0.0.into()));
/// let mu = |_: &Vector3<Real>| Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, 1.0)).cast();
/// let system = System::on(Euclidean::<3>)
///     .energy(|x: &Vector3<Real>| x.norm_squared() * 0.5)
///     .entropy(|x: &Vector3<Real>| x.z)
///     .dissipation(KulkarniNomizu(sigma, mu))
///     .build();
/// assert!(system.is_ok());
/// ```
#[derive(Clone, Copy)]
pub struct KulkarniNomizu<A, B>(pub A, pub B);

impl<A, B> fmt::Debug for KulkarniNomizu<A, B> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("KulkarniNomizu").finish_non_exhaustive()
    }
}

impl<M, G, A, B> Dissipation<M, G> for KulkarniNomizu<A, B>
where
    M: Manifold,
    G: Riemannian<M>,
    A: MatrixField<M>,
    B: MatrixField<M>,
{
    fn apply<D: Scalar>(
        &self,
        g: &MetricAt<'_, M, G, D>,
        w: &Vector<M, D>,
        alpha: &Vector<M, D>,
    ) -> Result<Vector<M, D>, MetricError> {
        let (sigma, mu) = (form(&self.0, g.x)?, form(&self.1, g.x)?);
        Ok(product::<M, D>(&sigma, &mu, w, alpha))
    }

    fn linearise(
        &self,
        g: &MetricAt<'_, M, G>,
        w: &Vector<M>,
        alpha: &Vector<M>,
    ) -> Result<DissipationJet<M>, MetricError> {
        let z = &g.x.base;
        Ok(jet(&self.0.contravariant_jet(z), &self.1.contravariant_jet(z), w, alpha))
    }
}

/// A matrix on covectors, in the frame of the chart.
pub(super) fn form<M: Manifold, D: Scalar>(
    field: &impl MatrixField<M>,
    x: &ChartPoint<M, D>,
) -> Result<Matrix<M, D>, MetricError> {
    M::contravariant(x, &field.at(&x.point())).ok_or_else(|| out_of_chart(x))
}

/// `K_w α`, bilinear in `σ` and `μ`.
pub(super) fn product<M: Manifold, D: Scalar>(
    sigma: &Matrix<M, D>,
    mu: &Matrix<M, D>,
    w: &Vector<M, D>,
    alpha: &Vector<M, D>,
) -> Vector<M, D> {
    turn::<M, D>(&(*sigma * *w), &(*mu * *alpha), w)
        + turn::<M, D>(&(*mu * *w), &(*sigma * *alpha), w)
}

/// `K_w α` with its derivatives, from those of `σ` and `μ`.
pub(super) fn jet<M: Manifold>(
    sigma: &MatrixJet<M>,
    mu: &MatrixJet<M>,
    w: &Vector<M>,
    alpha: &Vector<M>,
) -> DissipationJet<M> {
    let (s, m) = (&sigma.value, &mu.value);
    let (sw, sa, mw, ma) = (*s * *w, *s * *alpha, *m * *w, *m * *alpha);
    let (wsw, wmw, asw, amw) = (w.dot(&sw), w.dot(&mw), alpha.dot(&sw), alpha.dot(&mw));
    let outer = Matrix::<M>::outer;
    let mut along_z = Matrix::<M>::zeros();
    for k in 0..M::Dim::LEN {
        let column = product::<M, f64>(&sigma.slopes[k], m, w, alpha)
            + product::<M, f64>(s, &mu.slopes[k], w, alpha);
        for i in 0..M::Dim::LEN {
            along_z[(i, k)] = column[i];
        }
    }
    DissipationJet {
        value: product::<M, f64>(s, m, w, alpha),
        along_z,
        // K_w α = (w·μw) σα + (w·σw) μα − (α·μw) σw − (α·σw) μw.
        along_w: (outer(&sa, &mw) + outer(&ma, &sw)) * 2.0
            - (outer(&sw, &ma) + outer(&mw, &sa))
            - (*s * amw + *m * asw),
        tensor: *s * wmw + *m * wsw - (outer(&sw, &mw) + outer(&mw, &sw)),
    }
}
