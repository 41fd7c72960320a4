//! The chart of a step: that of the vector space, around the middle of the step. As in [`crate::collocation`].

use crate::implicit::algebra::is_finite;
use crate::implicit::parts::Parts;
use crate::numbers::Lengths;

/// The chart of a step.
pub(super) struct StepChart<L: Lengths> {
    /// The middle `z`.
    pub(super) z: L::State,
    /// The displacement `d`.
    pub(super) d: L::Vector,
    /// The end `x'`.
    pub(super) end: L::State,
}

impl<L: Lengths> StepChart<L> {
    /// The chart of the step with the displacement `d` at `x`; `None` where a number leaves its range.
    #[inline]
    pub(super) fn of(parts: &Parts<'_, L>, x: &L::State, d: L::Vector) -> Option<Self> {
        let z = parts.moved(x, &parts.vector(|i| d[i] * 0.5));
        let half = parts.between(x, &z);
        let back = parts.vector(|i| half[i] * 2.0);
        let end = parts.moved(x, &d);
        (is_finite(&d) && is_finite(&back)).then_some(Self { z, d, end })
    }
}
