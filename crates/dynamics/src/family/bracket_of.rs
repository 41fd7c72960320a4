//! Brackets of the state and of parameters.

use std::fmt;
use std::sync::Arc;

use metriplectic_fields::{Dimension, Form, Matrix, Real, Scalar, Square as _, Vector};
use metriplectic_manifolds::{Euclidean, Manifold, MetricError, Product, Riemannian, Times};
use nalgebra::SVector;

use super::Freeze;
use crate::bracket::{Bracket, BracketArgs, BracketJet, FieldPoisson};

/// A bracket by a closure `|x, θ| -> Π`, on `M × Rᴾ`; the counterpart of [`FieldPoisson`].
pub struct BracketOf<F> {
    field: Arc<F>,
    is_poisson: bool,
}

/// A bracket by a closure `|x, θ| -> Π` at one `θ`.
pub struct BracketAt<F, const P: usize> {
    field: Arc<F>,
    theta: SVector<Real, P>,
    is_poisson: bool,
}

impl<F> BracketOf<F> {
    pub(super) fn new(field: F, is_poisson: bool) -> Self {
        Self { field: Arc::new(field), is_poisson }
    }
}

impl<F> Clone for BracketOf<F> {
    fn clone(&self) -> Self {
        Self { field: Arc::clone(&self.field), ..*self }
    }
}

impl<F, const P: usize> Clone for BracketAt<F, P> {
    fn clone(&self) -> Self {
        Self { field: Arc::clone(&self.field), ..*self }
    }
}

impl<F> fmt::Debug for BracketOf<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("BracketOf").field("is_poisson", &self.is_poisson).finish_non_exhaustive()
    }
}

impl<F, const P: usize> fmt::Debug for BracketAt<F, P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("BracketAt").field("is_poisson", &self.is_poisson).finish_non_exhaustive()
    }
}

impl<F, const P: usize> Freeze<P> for BracketOf<F> {
    type Narrow = BracketAt<F, P>;

    fn freeze(&self, theta: &SVector<Real, P>) -> BracketAt<F, P> {
        let Self { field, is_poisson } = self;
        BracketAt { field: Arc::clone(field), theta: *theta, is_poisson: *is_poisson }
    }
}

/// The bracket of a closure.
const fn field<F>(closure: F, is_poisson: bool) -> FieldPoisson<F> {
    if is_poisson { FieldPoisson::new(closure) } else { FieldPoisson::almost(closure) }
}

#[diagnostic::do_not_recommend]
impl<M, G, F, const P: usize> Bracket<M, G> for BracketAt<F, P>
where
    M: Manifold,
    G: Riemannian<M>,
    F: Fn(&M::Point<Real>, &SVector<Real, P>) -> Form<M, Real>,
{
    fn apply<D: Scalar>(
        &self,
        at: &BracketArgs<'_, M, G, D>,
        alpha: &Vector<M, D>,
    ) -> Result<Vector<M, D>, MetricError> {
        let closure = |x: &M::Point<Real>| (self.field)(x, &self.theta);
        field(closure, self.is_poisson).apply(at, alpha)
    }

    fn linearise(
        &self,
        at: &BracketArgs<'_, M, G>,
        alpha: &Vector<M>,
    ) -> Result<BracketJet<M>, MetricError> {
        let closure = |x: &M::Point<Real>| (self.field)(x, &self.theta);
        field(closure, self.is_poisson).linearise(at, alpha)
    }

    fn tensor<D: Scalar>(
        &self,
        at: &BracketArgs<'_, M, G, D>,
    ) -> Result<Matrix<M, D>, MetricError> {
        let closure = |x: &M::Point<Real>| (self.field)(x, &self.theta);
        field(closure, self.is_poisson).tensor(at)
    }

    fn is_poisson(&self) -> bool {
        self.is_poisson
    }
}

/// The closure on `M × Rᴾ`: the first block of the matrix, and zeros.
fn block<M, F, const P: usize>(
    f: &F,
    (x, t): &(M::Point<Real>, SVector<Real, P>),
) -> Form<Product<M, Euclidean<P>>, Real>
where
    M: Manifold + Times<Euclidean<P>>,
    F: Fn(&M::Point<Real>, &SVector<Real, P>) -> Form<M, Real>,
{
    let n = <M::Velocity as Dimension>::LEN;
    let tensor = f(x, t);
    Form::<Product<M, Euclidean<P>>, Real>::from_entries(|i, j| {
        if i < n && j < n { tensor[(i, j)] } else { Real::from(0.0) }
    })
}

#[diagnostic::do_not_recommend]
impl<M, G, F, const P: usize> Bracket<Product<M, Euclidean<P>>, G> for BracketOf<F>
where
    M: Manifold + Times<Euclidean<P>>,
    G: Riemannian<Product<M, Euclidean<P>>>,
    F: Fn(&M::Point<Real>, &SVector<Real, P>) -> Form<M, Real>,
{
    fn apply<D: Scalar>(
        &self,
        at: &BracketArgs<'_, Product<M, Euclidean<P>>, G, D>,
        alpha: &Vector<Product<M, Euclidean<P>>, D>,
    ) -> Result<Vector<Product<M, Euclidean<P>>, D>, MetricError> {
        field(|p: &_| block::<M, F, P>(&self.field, p), self.is_poisson).apply(at, alpha)
    }

    fn linearise(
        &self,
        at: &BracketArgs<'_, Product<M, Euclidean<P>>, G>,
        alpha: &Vector<Product<M, Euclidean<P>>>,
    ) -> Result<BracketJet<Product<M, Euclidean<P>>>, MetricError> {
        field(|p: &_| block::<M, F, P>(&self.field, p), self.is_poisson).linearise(at, alpha)
    }

    fn is_poisson(&self) -> bool {
        self.is_poisson
    }
}
