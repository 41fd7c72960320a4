//! The laws of a system in plain numbers at a state, with their differentials.

use metriplectic_equations::{ENERGY, ENTROPY, Equations};

use super::lengths::{AtRunTime, Lengths, List};
use crate::step::Laws;
use crate::system::NO_CLOCK;

/// The laws of a system with their differentials.
#[derive(Clone, Debug)]
#[allow(private_bounds, reason = "no other crate makes rows")]
pub struct Rows<L: Lengths = AtRunTime> {
    values: L::Values,
    /// The differentials, one after another.
    w: L::Rows,
}

#[allow(private_bounds, reason = "no other crate makes rows")]
impl<L: Lengths> Rows<L> {
    #[inline]
    pub(super) fn of(system: &(impl Equations + ?Sized), x: &[f64]) -> Self {
        let mut values = L::Values::room(|| system.sizes().laws);
        let mut w = L::Rows::room(|| system.sizes().laws * system.sizes().directions);
        system.differentials(NO_CLOCK, x, values.numbers_mut(), w.numbers_mut());
        Self { values, w }
    }

    /// Returns whether all numbers are finite.
    #[inline]
    pub(super) fn is_finite(&self) -> bool {
        let check = |sum, numbers: &[f64]| numbers.iter().fold(sum, |sum, n| sum + 0.0 * n);
        check(check(0.0, self.values.numbers()), self.w.numbers()) == 0.0
    }

    /// The values of the laws.
    #[inline]
    pub(super) fn laws(&self) -> Laws<L::Invariants> {
        laws::<L>(self.values())
    }

    /// The values of the laws, one after another.
    #[inline]
    pub(super) fn values(&self) -> &[f64] {
        self.values.numbers()
    }

    /// The differential of a law.
    #[inline]
    pub(super) fn row(&self, law: usize) -> L::Vector {
        let n = self.w.numbers().len() / self.values().len();
        L::Vector::of(&self.w.numbers()[law * n..][..n])
    }

    /// The differentials of all laws, one after another.
    #[inline]
    pub(crate) fn all(&self) -> &[f64] {
        self.w.numbers()
    }
}

/// The laws of these values.
#[inline]
pub(super) fn laws<L: Lengths>(values: &[f64]) -> Laws<L::Invariants> {
    let invariants = L::invariants(&values[ENTROPY + 1..]);
    Laws { energy: values[ENERGY], entropy: values[ENTROPY], invariants }
}
