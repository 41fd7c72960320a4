//! Derivatives at any scalar, by nesting dual numbers.
//!
//! These are the definitions. At real points [`ScalarField::jet1`] and [`ScalarField::jet2`] compute the same
//! faster.

use num_dual::Dual;

use crate::{ChartPoint, Column, Matrix, Real, Scalar, ScalarField, Space, Square, Vector};

/// The differential `∂(f∘φ_x)/∂qⁱ` at `φ_x(q)`, in the coordinate frame of the chart at `x`.
pub fn differential<M: Space, D: Scalar>(
    f: &impl ScalarField<M>,
    x: &ChartPoint<M, D>,
) -> Vector<M, D> {
    Vector::<M, D>::from_index(|i| {
        let q = along::<M, D>(&x.q, i);
        f.at(&M::chart(&x.base, &q)).eps
    })
}

/// The differential at the real coordinates `q` in the frame of the chart at `x`, which need not be
/// its centre, in `⌈n/2⌉` evaluations.
pub fn differential_at<M: Space>(
    f: &impl ScalarField<M>,
    x: &M::Point<f64>,
    q: &Vector<M>,
) -> Vector<M> {
    let mut df = Vector::<M>::zero();
    for i in (0..Vector::<M>::LEN).step_by(2) {
        let value = f.at_real(&M::chart(x, &seeded::<M>(q, i, i + 1)));
        df[i] = value.eps1;
        if i + 1 < Vector::<M>::LEN {
            df[i + 1] = value.eps2;
        }
    }
    df
}

/// The Hessian at the real coordinates `q` of the chart at `x`, which need not be its centre, in
/// `n(n+1)/2` evaluations.
pub fn hessian_at<M: Space>(
    f: &impl ScalarField<M>,
    x: &M::Point<f64>,
    q: &Vector<M>,
) -> Matrix<M> {
    let mut hf = Matrix::<M>::zeros();
    for i in 0..Vector::<M>::LEN {
        for j in i..Vector::<M>::LEN {
            hf[(i, j)] = f.at_real(&M::chart(x, &seeded::<M>(q, i, j))).eps1eps2;
            hf[(j, i)] = hf[(i, j)];
        }
    }
    hf
}

/// `q + ε₁ e_i + ε₂ e_j`.
fn seeded<M: Space>(q: &Vector<M>, i: usize, j: usize) -> Vector<M, Real> {
    let part = |k, direction| if k == direction { 1.0 } else { 0.0 };
    Vector::<M, Real>::from_index(|k| Real::new(q[k], part(k, i), part(k, j), 0.0))
}

/// The Hessian `∂²(f∘φ_x)/∂qⁱ∂qʲ` at `φ_x(q)`, in the coordinates of the chart at `x`.
pub fn hessian<M: Space, D: Scalar>(f: &impl ScalarField<M>, x: &ChartPoint<M, D>) -> Matrix<M, D> {
    jacobian::<M, D>(|q| differential(f, &ChartPoint { base: x.base.clone(), q: *q }), &x.q)
}

/// The Jacobian `∂Fⁱ/∂qʲ` of `F: Rⁿ → Rⁿ` at `q`.
pub fn jacobian<M: Space, D: Scalar>(
    f: impl Fn(&Vector<M, Dual<D>>) -> Vector<M, Dual<D>>,
    q: &Vector<M, D>,
) -> Matrix<M, D> {
    Matrix::<M, D>::from_columns(|j| {
        let column = f(&along::<M, D>(q, j));
        Vector::<M, D>::from_index(|i| column[i].eps)
    })
}

/// `q + ε e_k`.
fn along<M: Space, D: Scalar>(q: &Vector<M, D>, k: usize) -> Vector<M, Dual<D>> {
    Vector::<M, Dual<D>>::from_index(|i| Dual::new(q[i], if i == k { D::one() } else { D::zero() }))
}
