//! Closures as fields.
//!
//! A closure is written over the one scalar [`Real`]. At another scalar `D` of derivative order
//! ≤ 2 it is lifted by its second-order Taylor expansion about the real part `x` of the point,
//!
//! ```math
//! f(\varphi_x(d)) = f + f_i\, d_i + \tfrac12 f_{ij}\, d_i d_j ,
//! ```
//!
//! which is exact because the coordinates `d` are nilpotent, `d_i d_j d_k = 0`. A scalar of order 3
//! would need derivatives that the closure does not have; it stops the build.

use crate::{Dimension, Form, MatrixField, Real, Scalar, ScalarField, Space, Square};

// For a closure that returns an `f64`, the compiler then explains scalar fields, and not `Fn`.
#[diagnostic::do_not_recommend]
impl<M, F> ScalarField<M> for F
where
    M: Space,
    F: Fn(&M::Point<Real>) -> Real,
{
    #[inline]
    fn at<D: Scalar>(&self, x: &M::Point<D>) -> D {
        let mut sum = D::zero();
        taylor_seeds::<M, D>(x, |point, weights| sum += weights.of(&self(point)));
        sum
    }

    #[inline]
    fn at_real(&self, x: &M::Point<Real>) -> Real {
        self(x)
    }
}

impl<M, F> MatrixField<M> for F
where
    M: Space,
    F: Fn(&M::Point<Real>) -> Form<M, Real>,
{
    fn at<D: Scalar>(&self, x: &M::Point<D>) -> Form<M, D> {
        let mut sum = Form::<M, D>::zeros();
        taylor_seeds::<M, D>(x, |point, weights| {
            let a = self(point);
            sum += Form::<M, D>::from_entries(|i, j| weights.of(&a[(i, j)]));
        });
        sum
    }

    #[inline]
    fn at_real(&self, x: &M::Point<Real>) -> Form<M, Real> {
        self(x)
    }
}

/// The weights of one evaluation in the Taylor sum: a factor for each part of a [`Real`].
struct Weights<D> {
    re: f64,
    eps1: D,
    eps2: D,
    eps1eps2: D,
}

impl<D: Scalar> Weights<D> {
    /// Computes the weighted sum of the parts that the order of `D` needs. It omits the others instead of
    /// multiplying them by zero, because they may be infinite (the slope of a norm at zero).
    #[inline]
    fn of(&self, f: &Real) -> D {
        let value = D::from(self.re * f.re);
        match D::NDERIV {
            0 => value,
            1 => self.eps1 * f.eps1 + self.eps2 * f.eps2 + value,
            _ => self.eps1 * f.eps1 + self.eps2 * f.eps2 + self.eps1eps2 * f.eps1eps2 + value,
        }
    }
}

/// Visits the seeded points of a Taylor expansion about the real part of `x`: one for order 0,
/// `⌈n/2⌉` for order 1, `n(n+1)/2` for order 2.
#[inline]
fn taylor_seeds<M: Space, D: Scalar>(
    x: &M::Point<D>,
    mut visit: impl FnMut(&M::Point<Real>, &Weights<D>),
) {
    const {
        assert!(
            D::NDERIV <= 2,
            "a closure has derivatives up to order 2, and this scalar asks for more: write the \
             field as a type of your own with the generic method `at`"
        );
    }
    let n = M::Dim::LEN;
    let base = M::real(x);
    let none = D::zero();
    if const { D::NDERIV == 0 } {
        let weights = Weights { re: 1.0, eps1: none, eps2: none, eps1eps2: none };
        return visit(&M::constant(&base), &weights);
    }
    let (d, seeded) = (M::coordinates(&base, x), M::seeds(&base));
    let first = |i: usize| if i == 0 { 1.0 } else { 0.0 };
    if const { D::NDERIV == 1 } {
        for i in (0..n).step_by(2) {
            let eps2 = if i + 1 < n { d[i + 1] } else { none };
            let weights = Weights { re: first(i), eps1: d[i], eps2, eps1eps2: none };
            visit(&seeded(i, i + 1), &weights);
        }
        return;
    }
    for i in 0..n {
        let weights = Weights { re: first(i), eps1: d[i], eps2: none, eps1eps2: d[i] * d[i] * 0.5 };
        visit(&seeded(i, i), &weights);
        for j in i + 1..n {
            let weights = Weights { re: 0.0, eps1: none, eps2: none, eps1eps2: d[i] * d[j] };
            visit(&seeded(i, j), &weights);
        }
    }
}
