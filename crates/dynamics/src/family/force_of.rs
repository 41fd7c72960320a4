//! Forces of the velocity and of parameters, on the dual of a Lie algebra.

use std::fmt;
use std::sync::Arc;

use metriplectic_fields::{Column, Plus, Real, Scalar, ScalarField, Vector};
use metriplectic_manifolds::{Euclidean, LieDual, MetricError, Product, Riemannian};
use nalgebra::{Const, SVector};

use super::Freeze;
use crate::bracket::{Bracket, BracketArgs, Force, ForcedLiePoisson};

/// The Lie-Poisson bracket with the force of a closure `|ξ, θ| -> F`, on `g* × Rᴾ`; the counterpart of [`ForcedLiePoisson`].
pub struct ForcedOf<F>(pub(super) Arc<F>);

/// A force by a closure `|ξ, θ| -> F` at one `θ`.
pub struct ForceAt<F, const P: usize> {
    force: Arc<F>,
    theta: SVector<Real, P>,
}

impl<F> Clone for ForcedOf<F> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<F, const P: usize> Clone for ForceAt<F, P> {
    fn clone(&self) -> Self {
        Self { force: Arc::clone(&self.force), theta: self.theta }
    }
}

impl<F> fmt::Debug for ForcedOf<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ForcedOf").finish_non_exhaustive()
    }
}

impl<F, const P: usize> fmt::Debug for ForceAt<F, P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ForceAt").finish_non_exhaustive()
    }
}

impl<F, const P: usize> Freeze<P> for ForcedOf<F> {
    type Narrow = ForcedLiePoisson<ForceAt<F, P>>;

    fn freeze(&self, theta: &SVector<Real, P>) -> Self::Narrow {
        ForcedLiePoisson(ForceAt { force: Arc::clone(&self.0), theta: *theta })
    }
}

#[diagnostic::do_not_recommend]
impl<F, const N: usize, const P: usize> Force<N> for ForceAt<F, P>
where
    F: Fn(&SVector<Real, N>, &SVector<Real, P>) -> SVector<Real, N>,
{
    fn at<D: Scalar>(&self, xi: &SVector<D, N>) -> SVector<D, N> {
        Force::<N>::at(&|xi: &SVector<Real, N>| (self.force)(xi, &self.theta), xi)
    }

    fn at_real(&self, xi: &SVector<Real, N>) -> SVector<Real, N> {
        (self.force)(xi, &self.theta)
    }
}

/// The product with the parameters.
type Wide<const N: usize, const P: usize> = Product<LieDual<N>, Euclidean<P>>;

/// The components on the dual.
fn first<D: Scalar, const N: usize>(v: &impl Column<D>) -> SVector<D, N> {
    SVector::from_fn(|i, _| v[i])
}

/// Components on the dual, with zeros for the parameters.
fn wide<D: Scalar, V: Column<D>, const N: usize>(v: &SVector<D, N>) -> V {
    V::from_index(|i| if i < N { v[i] } else { D::zero() })
}

#[diagnostic::do_not_recommend]
impl<G, F, const N: usize, const P: usize> Bracket<Wide<N, P>, G> for ForcedOf<F>
where
    Const<N>: Plus<Const<P>>,
    G: Riemannian<Wide<N, P>>,
    F: Fn(&SVector<Real, N>, &SVector<Real, P>) -> SVector<Real, N>,
{
    fn apply<D: Scalar>(
        &self,
        at: &BracketArgs<'_, Wide<N, P>, G, D>,
        alpha: &Vector<Wide<N, P>, D>,
    ) -> Result<Vector<Wide<N, P>, D>, MetricError> {
        let (mu, _) = at.g.x.point();
        Ok(wide(&at.space.0.algebra().coadjoint(&first(alpha), &mu)))
    }

    fn is_forced(&self) -> bool {
        true
    }

    fn force<D: Scalar>(
        &self,
        at: &BracketArgs<'_, Wide<N, P>, G, D>,
        w: &Vector<Wide<N, P>, D>,
    ) -> Result<Vector<Wide<N, P>, D>, MetricError> {
        let ((_, theta), xi) = (at.g.x.point(), first(w));
        // Each component is a scalar field of velocity and parameters, which has its lift.
        let force = SVector::<D, N>::from_fn(|i, _| {
            let component = |(xi, t): &(SVector<Real, N>, SVector<Real, P>)| (self.0)(xi, t)[i];
            ScalarField::<Wide<N, P>>::at(&component, &(xi, theta))
        });
        Ok(wide(&at.space.0.algebra().coadjoint(&xi, &force)))
    }
}
