//! Scalar fields of the state and of the parameters.

use std::fmt;
use std::sync::Arc;

use metriplectic_fields::{
    Column, Dimension, Jet2, Matrix, Real, Scalar, ScalarField, Space, Square, Vector,
};
use metriplectic_manifolds::{Euclidean, Product, Times};
use nalgebra::SVector;

use super::Freeze;

/// A closure `|x, θ| -> Real`, as a field on `M × Rᴾ`.
pub struct OfPair<F>(pub(super) Arc<F>);

/// A closure `|x, θ| -> Real` at one `θ`, as a field on `M`.
pub struct AtParameters<F, const P: usize> {
    field: Arc<F>,
    theta: SVector<Real, P>,
}

// By hand, because closures have no `Debug`, and a pointer to one is cloned whatever it is.
impl<F> Clone for OfPair<F> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<F, const P: usize> Clone for AtParameters<F, P> {
    fn clone(&self) -> Self {
        Self { field: Arc::clone(&self.field), theta: self.theta }
    }
}

impl<F> fmt::Debug for OfPair<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("OfPair").finish_non_exhaustive()
    }
}

impl<F, const P: usize> fmt::Debug for AtParameters<F, P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("AtParameters").field("theta", &self.theta.map(|t| t.re)).finish()
    }
}

impl<F, const P: usize> Freeze<P> for OfPair<F> {
    type Narrow = AtParameters<F, P>;

    fn freeze(&self, theta: &SVector<Real, P>) -> AtParameters<F, P> {
        AtParameters { field: Arc::clone(&self.0), theta: *theta }
    }
}

#[diagnostic::do_not_recommend]
impl<M, F, const P: usize> ScalarField<Product<M, Euclidean<P>>> for OfPair<F>
where
    M: Times<Euclidean<P>>,
    F: Fn(&M::Point<Real>, &SVector<Real, P>) -> Real,
{
    fn at<D: Scalar>(&self, x: &(M::Point<D>, SVector<D, P>)) -> D {
        let closure = |(x, t): &(M::Point<Real>, SVector<Real, P>)| (self.0)(x, t);
        ScalarField::<Product<M, Euclidean<P>>>::at(&closure, x)
    }

    #[inline]
    fn at_real(&self, (x, t): &(M::Point<Real>, SVector<Real, P>)) -> Real {
        (self.0)(x, t)
    }

    /// The Hessian without its block `∂²f/∂θ²`, which stands as zero: the cometric of the parameters and their bracket are
    /// zero, so that no motion depends on it. It saves `P(P+1)/2` evaluations.
    fn jet2(&self, x: &(M::Point<f64>, SVector<f64, P>)) -> Jet2<Product<M, Euclidean<P>>> {
        let (n, all) = (M::Dim::LEN, M::Dim::LEN + P);
        let mut value = f64::NAN;
        let mut df = Vector::<Product<M, Euclidean<P>>>::zero();
        let mut hf = Matrix::<Product<M, Euclidean<P>>>::zeros();
        let seeded = Product::<M, Euclidean<P>>::seeds(x);
        for i in 0..n {
            for j in i..all {
                let (x, t) = seeded(i, j);
                let f = (self.0)(&x, &t);
                value = f.re;
                df[i] = f.eps1;
                if i == 0 || j == i {
                    df[j] = f.eps2;
                }
                hf[(i, j)] = f.eps1eps2;
                hf[(j, i)] = f.eps1eps2;
            }
        }
        Jet2 { value, df, hf }
    }
}

#[diagnostic::do_not_recommend]
impl<M, F, const P: usize> ScalarField<M> for AtParameters<F, P>
where
    M: Space,
    F: Fn(&M::Point<Real>, &SVector<Real, P>) -> Real,
{
    #[inline]
    fn at<D: Scalar>(&self, x: &M::Point<D>) -> D {
        let closure = |x: &M::Point<Real>| (self.field)(x, &self.theta);
        ScalarField::<M>::at(&closure, x)
    }

    #[inline]
    fn at_real(&self, x: &M::Point<Real>) -> Real {
        (self.field)(x, &self.theta)
    }
}
