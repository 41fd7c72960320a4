//! A Poisson tensor from a closure.

use metriplectic_fields::{ChartPoint, Dimension, Matrix, MatrixField, Scalar, Square, Vector};
use metriplectic_manifolds::Manifold;

use super::{Bracket, BracketJet};

/// The tensor `Π(x)` of a matrix field; see [`Poisson::field`](super::Poisson::field).
#[derive(Clone, Copy, Debug)]
pub struct FieldPoisson<F> {
    field: F,
}

impl<F> FieldPoisson<F> {
    pub(super) const fn new(field: F) -> Self {
        Self { field }
    }
}

impl<M: Manifold, F: MatrixField<M>> Bracket<M> for FieldPoisson<F> {
    fn apply<D: Scalar>(&self, _: &M, x: &ChartPoint<M, D>, alpha: &Vector<M, D>) -> Vector<M, D> {
        self.field.at(&x.point()) * *alpha
    }

    fn linearise(&self, _: &M, z: &M::Point<f64>, alpha: &Vector<M>) -> BracketJet<M> {
        let jet = self.field.jet(z);
        let mut along_z = Matrix::<M>::zeros();
        for k in 0..M::Dim::LEN {
            let column = jet.slopes[k] * *alpha;
            for i in 0..M::Dim::LEN {
                along_z[(i, k)] = column[i];
            }
        }
        BracketJet { value: jet.value * *alpha, along_z, tensor: jet.value }
    }
}
