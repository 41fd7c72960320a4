//! From the frame of one chart to that of another.

use metriplectic_fields::{Column as _, Matrix, Space, Square as _, Vector};
use num_dual::Dual64;

/// The matrix from components in the frame at `from` to those in the frame at `to`, a point that differs from it by
/// round-off: `d/dε φ_to⁻¹(φ_from(ε e_k))`.
///
/// Two such points may have different frames: that of a sphere turns where its last entry changes its sign, and the middle of
/// a step computed from either end may lie on either side.
pub fn between<M: Space>(from: &M::Point<f64>, to: &M::Point<f64>) -> Option<Matrix<M>> {
    // A chart that is a translation has one frame everywhere.
    if from == to || M::RATES_ARE_VELOCITIES {
        return None;
    }
    Some(Matrix::<M>::from_columns(|k| {
        let e =
            Vector::<M, Dual64>::from_index(|i| Dual64::new(0.0, if i == k { 1.0 } else { 0.0 }));
        let there = M::coordinates(to, &M::chart(from, &e));
        Vector::<M>::from_index(|i| there[i].eps)
    }))
}

/// The matrix with rows in the frame at `from`, in the frame at `to`.
pub(super) fn turned<M: Space>(
    a: Matrix<M>,
    from: &M::Point<f64>,
    to: &M::Point<f64>,
) -> Matrix<M> {
    between::<M>(from, to).map_or(a, |turn| turn * a)
}
