//! Compensation of the digits that rounding loses of a position.

use metriplectic_fields::{Dimension, Vector};
use metriplectic_manifolds::Manifold;

/// The digits that rounding has lost of the position in the steps so far.
///
/// The entries of a point are rounded in every step, and steps shorter than their last digit would
/// be lost altogether. What is lost is added to the next displacement (compensated summation; Kahan
/// 1965, Hairer, Lubich, Wanner 2006, §VIII.5).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Compensation<N: Dimension>(pub(crate) Option<N::Vector<f64>>);

/// A step by the displacement `d` from `x`, with its rounded end.
pub(crate) struct Displaced<'a, M: Manifold> {
    pub(crate) x: &'a M::Point<f64>,
    pub(crate) d: &'a Vector<M>,
    pub(crate) end: &'a M::Point<f64>,
}

impl<N: Dimension> Compensation<N> {
    /// The compensation without lost digits.
    pub(crate) const NONE: Self = Self(None);

    /// The end was moved for another reason, and what has been lost is no longer known.
    pub(crate) fn clear(&mut self) {
        self.0 = None;
    }

    /// The end of a step, moved by what earlier steps have lost; `None` if it does not move.
    #[inline]
    pub(crate) fn shifted<M: Manifold<Dim = N>>(
        &self,
        end: &M::Point<f64>,
    ) -> Option<M::Point<f64>> {
        let before = self.0.filter(|before| (0..N::LEN).any(|i| before[i].abs() > 0.0))?;
        Some(M::chart(end, &before))
    }

    /// The end of the `step`, moved by what earlier steps have lost; `None` if it does not move.
    #[inline]
    pub(crate) fn add<M: Manifold<Dim = N>>(
        &mut self,
        lost_digits: impl Fn(&M::Point<f64>, &N::Vector<f64>, &M::Point<f64>) -> N::Vector<f64>,
        step: &Displaced<'_, M>,
    ) -> Option<M::Point<f64>> {
        let Displaced { x, d, end } = step;
        let lost = lost_digits(x, d, end);
        match self.0 {
            Some(before) if (0..N::LEN).any(|i| before[i].abs() > 0.0) => {
                let compensated = M::chart(end, &before);
                self.0 = Some(lost + lost_digits(end, &before, &compensated));
                Some(compensated)
            }
            _ => {
                self.0 = Some(lost);
                None
            }
        }
    }
}
