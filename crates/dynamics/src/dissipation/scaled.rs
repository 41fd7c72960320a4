//! A dissipation times a number.

use std::fmt;

use metriplectic_fields::{Matrix, Scalar, ScalarField, Square, Vector};
use metriplectic_manifolds::{Manifold, MetricAt, MetricError, Riemannian};

use super::{Dissipation, DissipationJet};

/// The dissipation `κ(x) K_w`, from a scalar field `κ` and any dissipation `K`, in this order.
///
/// It is symmetric and annihilates `w` as `K` does. It is positive semidefinite if `κ(x) ≥ 0`, which
/// verification checks at sampled points.
#[derive(Clone, Copy)]
pub struct Scaled<F, K>(pub F, pub K);

impl<F, K: fmt::Debug> fmt::Debug for Scaled<F, K> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Scaled").field(&self.1).finish_non_exhaustive()
    }
}

impl<M, G, F, K> Dissipation<M, G> for Scaled<F, K>
where
    M: Manifold,
    G: Riemannian<M>,
    F: ScalarField<M>,
    K: Dissipation<M, G>,
{
    #[inline]
    fn apply<D: Scalar>(
        &self,
        g: &MetricAt<'_, M, G, D>,
        w: &Vector<M, D>,
        alpha: &Vector<M, D>,
    ) -> Result<Vector<M, D>, MetricError> {
        Ok(self.1.apply(g, w, alpha)? * self.0.at(&g.x.point()))
    }

    #[inline]
    fn linearise(
        &self,
        g: &MetricAt<'_, M, G>,
        w: &Vector<M>,
        alpha: &Vector<M>,
    ) -> Result<DissipationJet<M>, MetricError> {
        let (jet, kappa) = (self.1.linearise(g, w, alpha)?, self.0.jet1(&g.x.base));
        Ok(DissipationJet {
            value: jet.value * kappa.value,
            along_z: jet.along_z * kappa.value + Matrix::<M>::outer(&jet.value, &kappa.df),
            along_w: jet.along_w * kappa.value,
            tensor: jet.tensor * kappa.value,
        })
    }

    fn is_none(&self) -> bool {
        self.1.is_none()
    }

    fn adapts(&self) -> bool {
        self.1.adapts()
    }

    fn is_projected(&self) -> bool {
        self.1.is_projected()
    }
}
