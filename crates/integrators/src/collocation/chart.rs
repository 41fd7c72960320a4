//! The chart of a step: its middle, and the displacement from its start to its end there.
//!
//! A step with the displacement `u` at `x` has its middle at `z = φ_x(u/2)`. In the chart at `z` it goes from
//! `φ_z(−d/2) = x` to `φ_z(d/2) = x'`. Exchanging the ends changes the sign of `d` and nothing else, so methods with
//! symmetric nodes are reversible in every chart `φ`.
//!
//! In normal coordinates, and on flat spaces, the ray through `u` is a geodesic, `d` is its velocity at `z`, and
//! `x' = φ_x(u)`. In any other chart `d` is `−2φ_z⁻¹(x)`.

use metriplectic_fields::{Column, Dimension, Matrix, Space, Square, Vector};
use metriplectic_manifolds::Manifold;
use num_dual::Dual64;

use crate::round_off::bound::SUMMED;

/// The velocity at `φ_x(q)` with the components `v` in the chart at `x`, in the chart at `y`:
/// `d/dε φ_y⁻¹(φ_x(q + εv))`.
#[inline]
pub(super) fn in_chart_at<M: Space>(
    y: &M::Point<f64>,
    x: &M::Point<f64>,
    q: &Vector<M>,
    v: &Vector<M>,
) -> Vector<M> {
    let moved = Vector::<M, Dual64>::from_index(|i| Dual64::new(q[i], v[i]));
    let there = M::coordinates(y, &M::chart(x, &moved));
    Vector::<M>::from_index(|i| there[i].eps)
}

/// The chart of a step.
#[derive(Clone, Debug)]
pub(super) struct StepChart<M: Space> {
    /// The middle `z`.
    pub(super) z: M::Point<f64>,
    /// The displacement `d` in the chart at `z`.
    pub(super) d: Vector<M>,
    /// The end `x'`.
    pub(super) end: M::Point<f64>,
    /// The displacement less the one of the velocities at `x`; zero in normal coordinates.
    pub(super) shift: Vector<M>,
    /// Half of the displacement at `x`.
    half: Vector<M>,
}

impl<M: Manifold> StepChart<M> {
    /// The chart of the step with the displacement `u` at `x`; `None` beyond the edge of a chart.
    #[inline]
    pub(super) fn of(x: &M::Point<f64>, u: &Vector<M>) -> Option<Self> {
        let half = *u * 0.5;
        let z = M::chart(x, &half);
        let d = in_chart_at::<M>(&z, x, &half, u);
        let back = M::coordinates(&z, x) * -2.0;
        let (shift, sizes) = (back - d, M::scales(&z));
        if !(d.is_finite() && back.is_finite()) {
            return None;
        }
        let rounded = |i: usize| shift[i].abs() <= SUMMED * (sizes[i] + d[i].abs());
        if (0..M::Dim::LEN).all(rounded) {
            let end = M::chart(x, u);
            return Some(Self { z, d, end, shift: Vector::<M>::zero(), half });
        }
        let end = M::chart(&z, &(back * 0.5));
        Some(Self { z, d: back, end, shift, half })
    }

    /// A velocity at `x` in the chart at the middle.
    #[inline]
    pub(super) fn to_middle(&self, x: &M::Point<f64>, v: &Vector<M>) -> Vector<M> {
        in_chart_at::<M>(&self.z, x, &self.half, v)
    }

    /// The inverse of [`to_middle`](Self::to_middle).
    #[inline]
    pub(super) fn to_start(&self, x: &M::Point<f64>, v: &Vector<M>) -> Vector<M> {
        in_chart_at::<M>(x, &self.z, &Vector::<M>::zero(), v)
    }

    /// A linear map in the chart at the middle, for velocities at `x`.
    pub(super) fn map_to_start(&self, x: &M::Point<f64>, map: &Matrix<M>) -> Matrix<M> {
        Matrix::<M>::from_columns(|k| {
            self.to_start(x, &(*map * self.to_middle(x, &Vector::<M>::basis(k))))
        })
    }
}
