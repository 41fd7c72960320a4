//! A matrix field as a metric in a chart, with its derivatives.

use metriplectic_fields::{
    ChartPoint, Column, Matrix, MatrixField, MatrixJet, Real, Scalar, Space, Square, Vector,
    along_slopes,
};

/// The metric in the frame of the chart, at any scalar.
#[inline]
pub(crate) fn metric<M: Space, D: Scalar>(
    field: &impl MatrixField<M>,
    x: &ChartPoint<M, D>,
) -> Matrix<M, D> {
    M::covariant(x, &field.at(&x.point()))
}

/// The metric at `φ_x(q + ε₁ e_i + ε₂ e_j)`; an index beyond the dimension seeds nothing.
#[inline]
pub(crate) fn seeded<M: Space>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    q: &Vector<M>,
    [i, j]: [usize; 2],
) -> Matrix<M, Real> {
    let part = |k, direction| if k == direction { 1.0 } else { 0.0 };
    let q = Vector::<M, Real>::from_index(|k| Real::new(q[k], part(k, i), part(k, j), 0.0));
    let at = ChartPoint { base: x.clone(), q };
    M::covariant(&at, &field.at_real(&at.point()))
}

/// The metric and its derivatives along the chart at `x`, at the point with coordinates `q`.
pub(crate) fn metric_jet<M: Space>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    q: &Vector<M>,
) -> MatrixJet<M> {
    let part = |k, direction| if k == direction { 1.0 } else { 0.0 };
    M::covariant_jet(x, q, |i, j| {
        let seed = |k| Real::new(q[k], part(k, i), part(k, j), 0.0);
        field.at_real(&M::chart(x, &Vector::<M, Real>::from_index(seed)))
    })
}

/// A part of a matrix of hyper-dual numbers.
pub(crate) fn part<M: Space>(a: &Matrix<M, Real>, pick: impl Fn(&Real) -> f64) -> Matrix<M> {
    Matrix::<M>::from_entries(|i, j| pick(&a[(i, j)]))
}

/// Columns `(∂_k g) v` at a real point of a chart, with `g` itself.
pub(crate) fn dg_v<M: Space>(
    field: &impl MatrixField<M>,
    x: &M::Point<f64>,
    q: &Vector<M>,
    v: &Vector<M>,
) -> (Matrix<M>, Matrix<M>) {
    let g = metric_jet(field, x, q);
    (g.value, along_slopes::<M>(&g.slopes, v))
}
