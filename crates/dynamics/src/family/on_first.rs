//! Dissipations on the first factor of `M × Rᴾ`.

use std::fmt;
use std::sync::Arc;

use metriplectic_fields::{
    Column as _, Dimension, Form, Matrix, Real, Scalar, Square, Vector, Velocity,
};
use metriplectic_manifolds::{
    Euclidean, Manifold, MetricAt, MetricError, Product, Riemannian, Split, Times,
};
use nalgebra::SVector;

use super::Freeze;
use crate::dissipation::{Dissipation, DissipationJet, FieldDissipation, by_dual_numbers};

/// A dissipation of the first factor, which does not depend on the second.
#[derive(Clone, Copy, Debug)]
pub struct OnFirst<K>(pub K);

impl<K: Clone, const P: usize> Freeze<P> for OnFirst<K> {
    type Narrow = K;

    const DEPENDS: bool = false;

    fn freeze(&self, _: &SVector<Real, P>) -> K {
        self.0.clone()
    }
}

#[diagnostic::do_not_recommend]
impl<A, B, G, K> Dissipation<Product<A, B>, G> for OnFirst<K>
where
    A: Manifold + Times<B>,
    B: Manifold,
    G: Split<A, B>,
    K: Dissipation<A, G::Left>,
{
    fn apply<D: Scalar>(
        &self,
        g: &MetricAt<'_, Product<A, B>, G, D>,
        w: &Vector<Product<A, B>, D>,
        alpha: &Vector<Product<A, B>, D>,
    ) -> Result<Vector<Product<A, B>, D>, MetricError> {
        let (x, y) = Product::parts(g.x);
        let left = g.metric.left(&y.base);
        let (left, _) = g.halves(&left, (&x, &y))?;
        let ((w, _), (alpha, _)) = (Product::<A, B>::split(w), Product::<A, B>::split(alpha));
        let k = self.0.apply(&left, &w, &alpha)?;
        Ok(Product::<A, B>::join(&k, &Vector::<B, D>::zero()))
    }

    fn linearise(
        &self,
        g: &MetricAt<'_, Product<A, B>, G>,
        w: &Vector<Product<A, B>>,
        alpha: &Vector<Product<A, B>>,
    ) -> Result<DissipationJet<Product<A, B>>, MetricError> {
        if !g.metric.is_sum() {
            return by_dual_numbers(self, g, w, alpha);
        }
        let (x, y) = Product::parts(g.x);
        let left = g.metric.left(&y.base);
        let (left, _) = g.halves(&left, (&x, &y))?;
        let ((w, _), (alpha, _)) = (Product::<A, B>::split(w), Product::<A, B>::split(alpha));
        let jet = self.0.linearise(&left, &w, &alpha)?;
        let zero = Matrix::<B>::zeros();
        Ok(DissipationJet {
            value: Product::<A, B>::join(&jet.value, &Vector::<B>::zero()),
            along_z: Product::<A, B>::block(&jet.along_z, &zero),
            along_w: Product::<A, B>::block(&jet.along_w, &zero),
            tensor: Product::<A, B>::block(&jet.tensor, &zero),
        })
    }

    fn is_none(&self) -> bool {
        self.0.is_none()
    }

    fn adapts(&self) -> bool {
        self.0.adapts()
    }

    fn is_projected(&self) -> bool {
        self.0.is_projected()
    }

    fn is_default(&self) -> bool {
        self.0.is_default()
    }
}

/// A dissipation by a closure `|x, w, θ| -> K` that annihilates `w` itself, on `M × Rᴾ`; the counterpart of
/// [`FieldDissipation`](crate::FieldDissipation).
pub struct FieldOf<F>(pub(super) Arc<F>);

/// A dissipation by a closure `|x, w, θ| -> K` at one `θ`.
pub struct FieldAt<F, const P: usize> {
    field: Arc<F>,
    theta: SVector<Real, P>,
}

impl<F> Clone for FieldOf<F> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<F, const P: usize> Clone for FieldAt<F, P> {
    fn clone(&self) -> Self {
        Self { field: Arc::clone(&self.field), theta: self.theta }
    }
}

impl<F> fmt::Debug for FieldOf<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("FieldOf").finish_non_exhaustive()
    }
}

impl<F, const P: usize> fmt::Debug for FieldAt<F, P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("FieldAt").finish_non_exhaustive()
    }
}

impl<F, const P: usize> Freeze<P> for FieldOf<F> {
    type Narrow = FieldAt<F, P>;

    fn freeze(&self, theta: &SVector<Real, P>) -> FieldAt<F, P> {
        FieldAt { field: Arc::clone(&self.0), theta: *theta }
    }
}

#[diagnostic::do_not_recommend]
impl<M, G, F, const P: usize> Dissipation<M, G> for FieldAt<F, P>
where
    M: Manifold,
    G: Riemannian<M>,
    F: Fn(&M::Point<Real>, &Velocity<M, Real>, &SVector<Real, P>) -> Form<M, Real>,
{
    fn apply<D: Scalar>(
        &self,
        g: &MetricAt<'_, M, G, D>,
        w: &Vector<M, D>,
        alpha: &Vector<M, D>,
    ) -> Result<Vector<M, D>, MetricError> {
        let closure = |x: &M::Point<Real>, w: &Velocity<M, Real>| (self.field)(x, w, &self.theta);
        FieldDissipation(closure).apply(g, w, alpha)
    }

    fn tensor(&self, g: &MetricAt<'_, M, G>, w: &Vector<M>) -> Result<Matrix<M>, MetricError> {
        let closure = |x: &M::Point<Real>, w: &Velocity<M, Real>| (self.field)(x, w, &self.theta);
        FieldDissipation(closure).tensor(g, w)
    }

    fn linearise(
        &self,
        g: &MetricAt<'_, M, G>,
        w: &Vector<M>,
        alpha: &Vector<M>,
    ) -> Result<DissipationJet<M>, MetricError> {
        let closure = |x: &M::Point<Real>, w: &Velocity<M, Real>| (self.field)(x, w, &self.theta);
        FieldDissipation(closure).linearise(g, w, alpha)
    }
}

/// The closure on `M × Rᴾ`: the first block of the matrix, and zeros.
fn block<M, F, const P: usize>(
    f: &F,
    (x, t): &(M::Point<Real>, SVector<Real, P>),
    w: &Velocity<Product<M, Euclidean<P>>, Real>,
) -> Form<Product<M, Euclidean<P>>, Real>
where
    M: Manifold + Times<Euclidean<P>>,
    F: Fn(&M::Point<Real>, &Velocity<M, Real>, &SVector<Real, P>) -> Form<M, Real>,
{
    let n = <M::Velocity as Dimension>::LEN;
    let k = f(x, &Velocity::<M, Real>::from_index(|i| w[i]), t);
    Form::<Product<M, Euclidean<P>>, Real>::from_entries(|i, j| {
        if i < n && j < n { k[(i, j)] } else { Real::from(0.0) }
    })
}

#[diagnostic::do_not_recommend]
impl<M, G, F, const P: usize> Dissipation<Product<M, Euclidean<P>>, G> for FieldOf<F>
where
    M: Manifold + Times<Euclidean<P>>,
    G: Riemannian<Product<M, Euclidean<P>>>,
    F: Fn(&M::Point<Real>, &Velocity<M, Real>, &SVector<Real, P>) -> Form<M, Real>,
{
    fn apply<D: Scalar>(
        &self,
        g: &MetricAt<'_, Product<M, Euclidean<P>>, G, D>,
        w: &Vector<Product<M, Euclidean<P>>, D>,
        alpha: &Vector<Product<M, Euclidean<P>>, D>,
    ) -> Result<Vector<Product<M, Euclidean<P>>, D>, MetricError> {
        FieldDissipation(|x: &_, w: &_| block::<M, F, P>(&self.0, x, w)).apply(g, w, alpha)
    }

    fn tensor(
        &self,
        g: &MetricAt<'_, Product<M, Euclidean<P>>, G>,
        w: &Vector<Product<M, Euclidean<P>>>,
    ) -> Result<Matrix<Product<M, Euclidean<P>>>, MetricError> {
        FieldDissipation(|x: &_, w: &_| block::<M, F, P>(&self.0, x, w)).tensor(g, w)
    }

    fn linearise(
        &self,
        g: &MetricAt<'_, Product<M, Euclidean<P>>, G>,
        w: &Vector<Product<M, Euclidean<P>>>,
        alpha: &Vector<Product<M, Euclidean<P>>>,
    ) -> Result<DissipationJet<Product<M, Euclidean<P>>>, MetricError> {
        FieldDissipation(|x: &_, w: &_| block::<M, F, P>(&self.0, x, w)).linearise(g, w, alpha)
    }
}
