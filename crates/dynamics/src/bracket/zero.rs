//! No bracket: pure relaxation.

use metriplectic_fields::{Column, Matrix, Scalar, Square, Vector};
use metriplectic_manifolds::{Chart, Euclidean, HalfLine, Manifold, MetricError, Riemannian};

use super::{Bracket, BracketArgs, BracketJet, NaturalBracket};

/// The bracket `Π = 0`: `S` grows along a level set of `H`, and nothing moves reversibly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Zero;

impl<M: Manifold, G: Riemannian<M>> Bracket<M, G> for Zero {
    #[inline]
    fn apply<D: Scalar>(
        &self,
        _: &BracketArgs<'_, M, G, D>,
        _: &Vector<M, D>,
    ) -> Result<Vector<M, D>, MetricError> {
        Ok(Vector::<M, D>::zero())
    }

    #[inline]
    fn linearise(
        &self,
        _: &BracketArgs<'_, M, G>,
        _: &Vector<M>,
    ) -> Result<BracketJet<M>, MetricError> {
        let (value, zero) = (Vector::<M>::zero(), Matrix::<M>::zeros());
        Ok(BracketJet { value, along_z: zero, along_s: zero, tensor: zero })
    }

    fn is_zero(&self) -> bool {
        true
    }
}

/// A space starts without a bracket.
macro_rules! starts_from_zero {
    ($([$($generics:tt)*] $space:ty),+) => {$(
        impl<$($generics)*> NaturalBracket for $space {
            type Bracket = Zero;

            fn natural_bracket(&self) -> Zero {
                Zero
            }
        }
    )+};
}

starts_from_zero!([const N: usize] Euclidean<N>, [const N: usize] Chart<N>, [] HalfLine);
