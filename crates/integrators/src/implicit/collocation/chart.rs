//! The chart of a step: its middle, and the displacement from its start to its end there. As in [`crate::collocation`], whose file of
//! this name has the reasons.

use crate::implicit::algebra::{Matrix, is_finite};
use crate::implicit::parts::Parts;
use crate::numbers::Lengths;
use crate::round_off::bound::SUMMED;

/// The chart of a step.
pub(super) struct StepChart<L: Lengths> {
    /// The middle `z`.
    pub(super) z: L::State,
    /// The displacement `d`.
    pub(super) d: L::Vector,
    /// The end `x'`.
    pub(super) end: L::State,
    turned: Option<Box<Turned<L>>>,
}

/// The numbers of the chart of a step that is not one of a vector space.
struct Turned<L: Lengths> {
    /// Half of the displacement at the start.
    half: L::Vector,
    /// The displacement less the one of the velocities at the start; zero in normal coordinates.
    shift: L::Vector,
}

impl<L: Lengths> StepChart<L> {
    /// The chart of the step with the displacement `u` at `x`; `None` beyond the edge of a chart, and where a number leaves its range.
    #[inline]
    pub(super) fn of(parts: &Parts<'_, L>, x: &L::State, u: L::Vector) -> Option<Self> {
        let half = parts.vector(|i| u[i] * 0.5);
        let z = parts.moved(x, &half);
        let back = parts.between(&z, x);
        let back = parts.vector(|i| back[i] * -2.0);
        if parts.is_flat() {
            let end = parts.moved(x, &u);
            let usable = is_finite(&u) && is_finite(&back);
            return usable.then_some(Self { z, d: u, end, turned: None });
        }
        let d = parts.velocity_at(&z, (x, &half), &u);
        if !(is_finite(&d) && is_finite(&back)) {
            return None;
        }
        let (shift, sizes) = (parts.vector(|i| back[i] - d[i]), parts.scales(&z));
        let is_rounded = |i: usize| shift[i].abs() <= SUMMED * (sizes[i] + d[i].abs());
        let is_normal = (0..parts.n()).all(is_rounded);
        let end = if is_normal {
            parts.moved(x, &u)
        } else {
            parts.moved(&z, &parts.vector(|i| back[i] * 0.5))
        };
        let (d, shift) = if is_normal { (d, parts.zero()) } else { (back, shift) };
        Some(Self { z, d, end, turned: Some(Box::new(Turned { half, shift })) })
    }

    /// The displacement less the one of the velocities at the start, if it is not zero.
    pub(super) fn shift(&self) -> Option<&L::Vector> {
        self.turned.as_ref().map(|turned| &turned.shift)
    }

    /// A velocity at the start `x` in the chart at the middle.
    #[inline]
    pub(super) fn to_middle(&self, parts: &Parts<'_, L>, x: &L::State, v: &L::Vector) -> L::Vector {
        self.turned
            .as_ref()
            .map_or_else(|| v.clone(), |turned| parts.velocity_at(&self.z, (x, &turned.half), v))
    }

    /// The inverse of [`to_middle`](Self::to_middle).
    #[inline]
    pub(super) fn to_start(&self, parts: &Parts<'_, L>, x: &L::State, v: L::Vector) -> L::Vector {
        if self.turned.is_none() {
            return v;
        }
        parts.velocity_at(x, (&self.z, &parts.zero()), &v)
    }

    /// A linear map in the chart at the middle, for velocities at the start.
    pub(super) fn map_to_start(
        &self,
        parts: &Parts<'_, L>,
        x: &L::State,
        map: Matrix<L>,
    ) -> Matrix<L> {
        if self.turned.is_none() {
            return map;
        }
        Matrix::scaled_one(parts.n(), 1.0)
            .map_columns(|axis| self.to_start(parts, x, map.times(&self.to_middle(parts, x, axis))))
    }
}
