//! A Poisson tensor from a closure.

use std::fmt;

use metriplectic_fields::{Matrix, MatrixField, Scalar, Square, Vector, along_slopes};
use metriplectic_manifolds::{Manifold, MetricError, Riemannian, out_of_chart};

use super::{Bracket, BracketArgs, BracketJet};

/// The tensor `Π(x)` of a matrix field; see [`Poisson::field`](super::Poisson::field) and
/// [`AlmostPoisson::field`](super::AlmostPoisson::field).
#[derive(Clone, Copy)]
pub struct FieldPoisson<F> {
    field: F,
    poisson: bool,
}

impl<F> fmt::Debug for FieldPoisson<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("FieldPoisson").finish_non_exhaustive()
    }
}

impl<F> FieldPoisson<F> {
    pub(crate) const fn new(field: F) -> Self {
        Self { field, poisson: true }
    }

    pub(crate) const fn almost(field: F) -> Self {
        Self { field, poisson: false }
    }
}

impl<M: Manifold, G: Riemannian<M>, F: MatrixField<M>> Bracket<M, G> for FieldPoisson<F> {
    const IS_RECORDED: bool = F::IS_RECORDED;

    fn apply<D: Scalar>(
        &self,
        at: &BracketArgs<'_, M, G, D>,
        alpha: &Vector<M, D>,
    ) -> Result<Vector<M, D>, MetricError> {
        Ok(self.tensor_at(at)? * *alpha)
    }

    fn tensor<D: Scalar>(
        &self,
        at: &BracketArgs<'_, M, G, D>,
    ) -> Result<Matrix<M, D>, MetricError> {
        self.tensor_at(at)
    }

    fn linearise(
        &self,
        at: &BracketArgs<'_, M, G>,
        alpha: &Vector<M>,
    ) -> Result<BracketJet<M>, MetricError> {
        let jet = self.field.contravariant_jet(&at.g.x.point());
        let (value, along_z) = (jet.value * *alpha, along_slopes::<M>(&jet.slopes, alpha));
        Ok(BracketJet { value, along_z, along_s: Matrix::<M>::zeros(), tensor: jet.value })
    }

    fn is_poisson(&self) -> bool {
        self.poisson
    }
}

impl<F> FieldPoisson<F> {
    /// The matrix in the frame of the chart.
    fn tensor_at<M: Manifold, G: Riemannian<M>, D: Scalar>(
        &self,
        at: &BracketArgs<'_, M, G, D>,
    ) -> Result<Matrix<M, D>, MetricError>
    where
        F: MatrixField<M>,
    {
        M::contravariant(at.g.x, &self.field.at(&at.g.x.point()))
            .ok_or_else(|| out_of_chart(at.g.x))
    }
}
