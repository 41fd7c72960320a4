//! No dissipation: a Hamiltonian system.

use metriplectic_fields::{Column, Matrix, Scalar, Square, Vector};
use metriplectic_manifolds::{Manifold, MetricAt, MetricError, Riemannian};

use super::{Dissipation, DissipationJet};

/// `K = 0`, the dissipation of a system without entropy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoDissipation;

impl<M: Manifold, G: Riemannian<M>> Dissipation<M, G> for NoDissipation {
    #[inline]
    fn apply<D: Scalar>(
        &self,
        _: &MetricAt<'_, M, G, D>,
        _: &Vector<M, D>,
        _: &Vector<M, D>,
    ) -> Result<Vector<M, D>, MetricError> {
        Ok(Vector::<M, D>::zero())
    }

    #[inline]
    fn linearise(
        &self,
        _: &MetricAt<'_, M, G>,
        _: &Vector<M>,
        _: &Vector<M>,
    ) -> Result<DissipationJet<M>, MetricError> {
        let zero = Matrix::<M>::zeros();
        let value = Vector::<M>::zero();
        Ok(DissipationJet { value, along_z: zero, along_w: zero, tensor: zero })
    }

    fn is_none(&self) -> bool {
        true
    }
}
