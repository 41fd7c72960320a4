//! A Poisson tensor with the same matrix everywhere.

use metriplectic_fields::{Matrix, Scalar, Square};
use metriplectic_manifolds::{Flat, Manifold, MetricError, Riemannian};
use nalgebra::{Const, SMatrix, SVector};

use super::{Bracket, BracketArgs, BracketJet, PoissonError};

/// A constant skew matrix on a flat space; see [`Poisson::constant`](super::Poisson::constant).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstantPoisson<const N: usize> {
    tensor: SMatrix<f64, N, N>,
    /// The column and the value of the one entry of each row, if no row has more, as where positions are paired with momenta.
    pairs: Option<[(usize, f64); N]>,
}

impl<const N: usize> ConstantPoisson<N> {
    pub(super) fn new(tensor: SMatrix<f64, N, N>) -> Result<Self, PoissonError> {
        for row in 0..N {
            for column in 0..N {
                let size = (tensor[(row, column)] + tensor[(column, row)]).abs();
                if !size.is_finite() {
                    return Err(PoissonError::NotFinite { row, column });
                }
                if size > 4.0 * f64::EPSILON * tensor.amax() {
                    return Err(PoissonError::NotSkew { row, column, size });
                }
            }
        }
        Ok(Self { tensor, pairs: pairs(&tensor) })
    }
}

/// The one entry of each row; `None` if a row has more.
fn pairs<const N: usize>(tensor: &SMatrix<f64, N, N>) -> Option<[(usize, f64); N]> {
    let mut pairs = [(0, 0.0); N];
    for (row, pair) in pairs.iter_mut().enumerate() {
        let entries = (0..N).map(|column| (column, tensor[(row, column)]));
        let mut entries = entries.filter(|(_, entry)| *entry != 0.0);
        if let Some(first) = entries.next() {
            *pair = first;
        }
        if entries.next().is_some() {
            return None;
        }
    }
    Some(pairs)
}

impl<const N: usize, M, G> Bracket<M, G> for ConstantPoisson<N>
where
    M: Manifold<Dim = Const<N>> + Flat,
    G: Riemannian<M>,
{
    fn apply<D: Scalar>(
        &self,
        _: &BracketArgs<'_, M, G, D>,
        alpha: &SVector<D, N>,
    ) -> Result<SVector<D, N>, MetricError> {
        if let Some(pairs) = &self.pairs {
            return Ok(SVector::from_fn(|i, _| alpha[pairs[i].0] * pairs[i].1));
        }
        let row = |i| (0..N).fold(D::zero(), |sum, j| sum + alpha[j] * self.tensor[(i, j)]);
        Ok(SVector::from_fn(|i, _| row(i)))
    }

    fn tensor<D: Scalar>(
        &self,
        _: &BracketArgs<'_, M, G, D>,
    ) -> Result<SMatrix<D, N, N>, MetricError> {
        Ok(SMatrix::from_entries(|i, j| D::from(self.tensor[(i, j)])))
    }

    #[inline]
    fn linearise(
        &self,
        _: &BracketArgs<'_, M, G>,
        alpha: &SVector<f64, N>,
    ) -> Result<BracketJet<M>, MetricError> {
        let zero = Matrix::<M>::zeros();
        let value = self.tensor * alpha;
        Ok(BracketJet { value, along_z: zero, along_s: zero, tensor: self.tensor })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix2;

    #[test]
    fn a_matrix_that_is_not_skew_is_refused() {
        let error = ConstantPoisson::new(Matrix2::new(0.0, 1.0, -0.5, 0.0)).unwrap_err();
        assert_eq!(error, PoissonError::NotSkew { row: 0, column: 1, size: 0.5 });
        let error = ConstantPoisson::new(Matrix2::new(0.0, f64::NAN, 1.0, 0.0)).unwrap_err();
        assert_eq!(error, PoissonError::NotFinite { row: 0, column: 1 });
    }
}
