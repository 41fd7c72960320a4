//! The dissipation built from a cometric that may be degenerate.

use std::fmt;

use metriplectic_fields::{Dimension, MatrixField, MatrixJet, Scalar, Vector};
use metriplectic_manifolds::{Manifold, MetricAt, MetricError, Riemannian};

use super::kulkarni_nomizu::{form, jet};
use super::{Dissipation, DissipationJet, turn};

/// The dissipation of [`MetricDissipation`](super::MetricDissipation) with a symmetric matrix field
/// `G*` on covectors that you give. `G*` need only be positive *semi*definite. It need not be the inverse
/// of a metric, and variables without friction have rows of zeros. Thermodynamic models are of this kind.
///
/// ```math
/// K_w(\alpha, \beta) = G^*(w, w)\, G^*(\alpha, \beta) - G^*(w, \alpha)\, G^*(w, \beta) .
/// ```
///
/// The field is a closure `|x| -> matrix` or any other [`MatrixField`], acting on covectors dual to
/// the [`velocity`](metriplectic_fields::Space::embed) of the space. It is `G*(w, w)` times the
/// form `G*` off `w`, or 0: `K_w ⪰ 0` by Cauchy and Schwarz. A `G*` of rank one has `K = 0`. It is
/// evaluated as `K_w α = −(♯w ∧ ♯α) w`, so that `⟨w, K_w α⟩` cancels in pairs.
///
/// ```
/// use metriplectic_dynamics::{CometricDissipation, System};
/// use metriplectic_fields::Real;
/// use metriplectic_manifolds::Euclidean;
/// use nalgebra::{Matrix3, Vector3};
/// // x = (q, p, s): the momentum and the entropy exchange energy, the position is left alone.
/// let cometric = |_: &Vector3<Real>| Matrix3::from_diagonal(&Vector3::new(0.0, 0.1, 0.1)).cast();
/// let system = System::on(Euclidean::<3>)
///     .energy(|x: &Vector3<Real>| (x.x * x.x + x.y * x.y) * 0.5 + x.z)
///     .entropy(|x: &Vector3<Real>| x.z)
///     .dissipation(CometricDissipation(cometric))
///     .build();
/// assert!(system.is_ok());
/// ```
#[derive(Clone, Copy)]
pub struct CometricDissipation<F>(pub F);

impl<F> fmt::Debug for CometricDissipation<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("CometricDissipation").finish_non_exhaustive()
    }
}

impl<M: Manifold, G: Riemannian<M>, F: MatrixField<M>> Dissipation<M, G>
    for CometricDissipation<F>
{
    fn apply<D: Scalar>(
        &self,
        g: &MetricAt<'_, M, G, D>,
        w: &Vector<M, D>,
        alpha: &Vector<M, D>,
    ) -> Result<Vector<M, D>, MetricError> {
        let cometric = form(&self.0, g.x)?;
        Ok(turn::<M, D>(&(cometric * *w), &(cometric * *alpha), w))
    }

    fn linearise(
        &self,
        g: &MetricAt<'_, M, G>,
        w: &Vector<M>,
        alpha: &Vector<M>,
    ) -> Result<DissipationJet<M>, MetricError> {
        // The Kulkarni-Nomizu product of G* with its own half.
        let g = self.0.contravariant_jet(&g.x.base);
        let half = MatrixJet { value: g.value * 0.5, slopes: M::Dim::array(|k| g.slopes[k] * 0.5) };
        Ok(jet(&g, &half, w, alpha))
    }
}
