//! The path of a step: its base point, its displacement and its end.

use metriplectic_fields::{ChartPoint, Matrix, Scalar, Space, Square, Vector};

/// The path of a step: its base point, its displacement there, and its end.
#[derive(Clone, Debug)]
pub struct StepPath<M: Space, D: Scalar = f64> {
    /// The base point `z`.
    pub z: ChartPoint<M, D>,
    /// The displacement `d = hv ∈ T_zM`.
    pub d: Vector<M, D>,
    /// The end `x'`.
    pub end: M::Point<D>,
}

impl<M: Space> StepPath<M> {
    /// Makes the straight line of a flat space, with its middle as the base: `z = x + u/2`, `d = u`,
    /// `x' = x + u`.
    #[inline]
    pub fn straight(x: &M::Point<f64>, u: &Vector<M>) -> Self {
        let z = ChartPoint::centre(&M::chart(x, &(*u * 0.5)));
        Self { z, d: *u, end: M::chart(x, u) }
    }
}

/// The path of a step at `f64`, with its derivatives along the unknown `u`.
#[derive(Clone, Debug)]
pub struct StepPathJet<M: Space> {
    /// The base point `z`.
    pub z: M::Point<f64>,
    /// `∂z/∂u` in the chart at `z`.
    pub dz: Matrix<M>,
    /// The displacement `d = hv ∈ T_zM`.
    pub d: Vector<M>,
    /// `∂d/∂u` in the chart at `z`.
    pub dd: Matrix<M>,
    /// The end `x'`.
    pub end: M::Point<f64>,
    /// `∂x'/∂u` in the chart at `x'`.
    pub dend: Matrix<M>,
}

impl<M: Space> StepPathJet<M> {
    /// Makes the same straight line as [`StepPath::straight`].
    #[inline]
    pub fn straight(x: &M::Point<f64>, u: &Vector<M>) -> Self {
        let one = Matrix::<M>::one();
        Self {
            z: M::chart(x, &(*u * 0.5)),
            dz: one * 0.5,
            d: *u,
            dd: one,
            end: M::chart(x, u),
            dend: one,
        }
    }
}
