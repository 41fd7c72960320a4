//! Derivatives at any scalar, by nesting dual numbers.
//!
//! These are the definitions. At real points [`ScalarField::jet1`], [`ScalarField::jet2`],
//! [`ScalarField::differential_at`] and [`ScalarField::hessian_at`] compute the same faster.

use num_dual::Dual;

use crate::{ChartPoint, Column, Matrix, Scalar, ScalarField, Space, Square, Vector};

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
