//! Directions of an open system: those of its space, with the clock and what is booked beside them.

use metriplectic_dynamics::exchange::Entries;
use metriplectic_fields::Column;

use super::state::{Booked, Columns};
use crate::round_off::bound::SUMMED;
use crate::step::{LedgerErrors, Vector};

/// A displacement or a rate of an open system: the components on its space, which alone count in norms, the time that
/// passes, and what is booked.
///
/// The numbers beyond [`len`](Vector::len) are those of the clock and of the ledger. A combination of rates by a
/// Runge-Kutta method integrates them with the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpenVector<V, E> {
    /// The components.
    pub v: V,
    /// The time.
    pub clock: f64,
    /// The entries of the ledger.
    pub booked: Booked<E>,
}

impl<V: Column<f64>, E: Entries> OpenVector<V, E> {
    /// The components alone.
    pub(super) fn of(v: V) -> Self {
        Self { v, clock: 0.0, booked: Booked::nothing() }
    }

    /// The sizes of what is booked, by kind.
    pub(super) fn errors(&self, columns: &Columns) -> LedgerErrors {
        let [work, heat, entropy] = columns.largest(|i| self.booked.entries.get(i));
        LedgerErrors::new(work.max(self.booked.parameter.abs()), heat, entropy)
    }

    /// How many numbers there are, with those of the clock and the ledger.
    const ALL: usize = V::LEN + Self::BESIDE;

    /// How many there are beside the components.
    pub(super) const BESIDE: usize = 2 + E::LEN;
}

impl<V: Column<f64>, E: Entries> Vector for OpenVector<V, E> {
    #[inline]
    fn len(&self) -> usize {
        V::LEN
    }

    #[inline]
    fn get(&self, i: usize) -> f64 {
        match i.checked_sub(V::LEN) {
            None => self.v[i],
            Some(0) => self.clock,
            Some(1) => self.booked.parameter,
            Some(i) => self.booked.entries.get(i - 2),
        }
    }

    #[inline]
    fn with(&self, mut number: impl FnMut(usize) -> f64) -> Self {
        let v = V::from_index(&mut number);
        let (clock, parameter) = (number(V::LEN), number(V::LEN + 1));
        let entries = E::from_index(|i| number(V::LEN + 2 + i));
        Self { v, clock, booked: Booked { parameter, entries } }
    }

    /// The clock of a stage at the end of a step is that of the end: the rows of a tableau are sums of entries of tens, whose
    /// rounding would set the stage beyond a corner.
    #[inline]
    fn combination<'a>(h: f64, count: usize, term: impl Fn(usize) -> (f64, &'a Self)) -> Self
    where
        Self: 'a,
    {
        let (w, first) = term(0);
        let (mut sum, mut size) = (first.map(|k| w * k), (w * first.clock).abs());
        for j in 1..count {
            let (w, v) = term(j);
            sum = sum.with(|i| sum.get(i) + w * v.get(i));
            size += (w * v.clock).abs();
        }
        if (sum.clock - 1.0).abs() <= SUMMED * size {
            sum.clock = 1.0;
        }
        sum.map(|q| h * q)
    }

    fn beside_relative_to(&self, sizes: &Self) -> f64 {
        // The clock has no size, nor has an entry in which nothing flows.
        let sized = (V::LEN..Self::ALL).filter(|&i| sizes.get(i) > 0.0);
        sized.fold(0.0, |most, i| larger(most, (self.get(i) / sizes.get(i)).abs()))
    }

    fn to_list(&self) -> Vec<f64> {
        (0..Self::ALL).map(|i| self.get(i)).collect()
    }

    fn with_list(&self, list: &[f64]) -> Option<Self> {
        let known = [V::LEN, Self::ALL].contains(&list.len());
        known.then(|| self.with(|i| list.get(i).copied().unwrap_or(0.0)))
    }
}

/// The larger one of two numbers; NaN if one is.
const fn larger(a: f64, b: f64) -> f64 {
    if b.is_nan() || b > a { b } else { a }
}
