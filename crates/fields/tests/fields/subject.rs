//! One nonlinear function, to be written as a closure and as a type of its own.

use metriplectic_fields::{
    Column, Dimension, Matrix, MatrixField, Real, Scalar, ScalarField, Square,
};

use crate::spaces::TestSpace;

/// The number of summands.
const SUMMANDS: usize = 5;

/// The summands of the function, which between them call `exp`, `sin`, `cos`, `ln`, `atan`, `powi`
/// and divide.
fn summands<D: Scalar>(x: &[D]) -> [D; SUMMANDS] {
    let (mut u, mut w) = (D::zero(), D::zero());
    for (k, &entry) in x.iter().enumerate() {
        u += entry * (0.7 - 0.2 * k as f64);
        w += entry * x[(k + 1) % x.len()];
    }
    [
        (u * 0.5).exp() * w.sin(),
        (w * w + 1.0).ln(),
        u / (w.cos() + 2.0),
        (u * w).atan(),
        (x[x.len() - 1] + 4.0).powi(-3) * u.powi(4),
    ]
}

/// The sum of all summands.
fn total<D: Scalar>(x: &[D]) -> D {
    summands(x).into_iter().fold(D::zero(), |sum, summand| sum + summand)
}

/// The entry `(i, j)` of a matrix field, made of the same summands.
fn entry<D: Scalar>(x: &[D], i: usize, j: usize) -> D {
    let parts = summands(x);
    parts[i % SUMMANDS] + parts[(i + 2 * j + 1) % SUMMANDS] * (1.0 + j as f64)
}

/// The function behind door 1.
pub(crate) struct ByHand;

impl<M: TestSpace> ScalarField<M> for ByHand {
    fn at<D: Scalar>(&self, x: &M::Point<D>) -> D {
        total(M::entries(x))
    }
}

impl<M: TestSpace> MatrixField<M> for ByHand {
    fn at<D: Scalar>(&self, x: &M::Point<D>) -> Matrix<M, D> {
        Matrix::<M, D>::from_entries(|i, j| entry(M::entries(x), i, j))
    }
}

/// The function behind door 2.
pub(crate) fn closure<M: TestSpace>() -> impl Fn(&M::Point<Real>) -> Real {
    |x| total(M::entries(x))
}

/// The matrix behind door 2.
pub(crate) fn matrix_closure<M: TestSpace>() -> impl Fn(&M::Point<Real>) -> Matrix<M, Real> {
    |x| Matrix::<M, Real>::from_entries(|i, j| entry(M::entries::<Real>(x), i, j))
}

/// One summand alone.
struct Summand(usize);

impl<M: TestSpace> ScalarField<M> for Summand {
    fn at<D: Scalar>(&self, x: &M::Point<D>) -> D {
        summands(M::entries(x))[self.0]
    }
}

/// `n Σ_k (|s_k| + |ds_k| + |Hs_k|)` over the summands `s_k` at `x`: what round-off is relative to
/// where chart coordinates have dual parts up to 1.
pub(crate) fn size<M: TestSpace>(x: &M::Point<f64>) -> f64 {
    let size_of = |k| {
        let jet = ScalarField::<M>::jet2(&Summand(k), x);
        jet.value.abs() + jet.df.magnitude() + jet.hf.max_abs()
    };
    M::Dim::LEN as f64 * (0..SUMMANDS).map(size_of).sum::<f64>()
}
