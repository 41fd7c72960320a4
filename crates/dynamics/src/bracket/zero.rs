//! No bracket: pure relaxation.

use metriplectic_fields::{ChartPoint, Column, Matrix, Scalar, Square, Vector};
use metriplectic_manifolds::{Euclidean, Manifold};

use super::{Bracket, BracketJet, NaturalBracket};

/// `Π = 0`: the state climbs `S` along a level set of `H`, and nothing moves reversibly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Zero;

impl<M: Manifold> Bracket<M> for Zero {
    #[inline]
    fn apply<D: Scalar>(&self, _: &M, _: &ChartPoint<M, D>, _: &Vector<M, D>) -> Vector<M, D> {
        Vector::<M, D>::zero()
    }

    #[inline]
    fn linearise(&self, _: &M, _: &M::Point<f64>, _: &Vector<M>) -> BracketJet<M> {
        let zero = Matrix::<M>::zeros();
        BracketJet { value: Vector::<M>::zero(), along_z: zero, tensor: zero }
    }

    fn is_zero(&self) -> bool {
        true
    }
}

impl<const N: usize> NaturalBracket for Euclidean<N> {
    type Bracket = Zero;

    fn natural_bracket(&self) -> Zero {
        Zero
    }
}
