//! States of an open system: a point, the time, and the ledger.

use std::marker::PhantomData;
use std::sync::Arc;

use metriplectic_dynamics::exchange::{Entries, Names};
use metriplectic_manifolds::Manifold;

use crate::step::StateSpace;

/// What is booked in a step: the work of the parameter, and the entries of ports and baths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Booked<E> {
    /// The work `W_t` that is done by the time in the energy.
    pub parameter: f64,
    /// The work of each port; the heat and the entropy of each bath.
    pub entries: E,
}

impl<E: Entries> Booked<E> {
    /// Nothing.
    pub(super) fn nothing() -> Self {
        Self { parameter: 0.0, entries: E::from_index(|_| 0.0) }
    }

    /// A function of the numbers that two have at the same place.
    pub(super) fn zip(&self, other: &Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let entries = E::from_index(|i| f(self.entries.get(i), other.entries.get(i)));
        Self { parameter: f(self.parameter, other.parameter), entries }
    }
}

/// What an entry of a ledger is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Work,
    Heat,
    Entropy,
}

/// The entries of a ledger with their names.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Columns(Vec<(Arc<str>, Kind)>);

impl Columns {
    /// Those of the parts with these names.
    pub(super) fn new(names: &Names) -> Self {
        let kinds =
            |is_bath: bool| if is_bath { &[Kind::Heat, Kind::Entropy][..] } else { &[Kind::Work] };
        let columns = names.iter().flat_map(|(name, is_bath)| {
            kinds(*is_bath).iter().map(|kind| (Arc::clone(name), *kind))
        });
        Self(columns.collect())
    }

    /// The index of the first heat.
    pub(super) fn first_heat(&self) -> Option<usize> {
        self.0.iter().position(|column| column.1 == Kind::Heat)
    }

    fn index(&self, name: &str, kind: Kind) -> Option<usize> {
        self.0.iter().position(|column| *column.0 == *name && column.1 == kind)
    }
}

/// What has flowed into a system since the start of a run: the work of the parameter, the work of each port, the heat of
/// each bath, and the entropy that the baths have gained.
///
/// Each sum is compensated. All work and heat goes into one more sum, [`net`](Self::net), by which the balance of
/// the energy is kept: the entries grow with what flows through a system, and their round-off with them.
#[derive(Clone, Debug, PartialEq)]
pub struct Ledger<E> {
    sum: Booked<E>,
    lost: Booked<E>,
    net: [f64; 2],
    columns: Arc<Columns>,
}

/// The sum of a number of two parts and another one, without a rounding of the sum of all three.
fn plus([high, low]: [f64; 2], x: f64) -> [f64; 2] {
    let sum = high + x;
    let part = sum - high;
    let error = (high - (sum - part)) + (x - part);
    let low = low + error;
    let whole = sum + low;
    [whole, low - (whole - sum)]
}

impl<E: Entries> Ledger<E> {
    /// The ledger of a system with these columns, before anything is booked.
    pub(super) fn empty(columns: &Arc<Columns>) -> Self {
        let nothing = Booked::nothing();
        Self { sum: nothing, lost: nothing, net: [0.0; 2], columns: Arc::clone(columns) }
    }

    /// The ledger with one more step.
    #[must_use]
    pub(super) fn with(&self, step: &Booked<E>) -> Self {
        let add = |sum: f64, lost: f64, x: f64| plus([sum, lost], x);
        let parameter = add(self.sum.parameter, self.lost.parameter, step.parameter);
        let entry =
            |i: usize| add(self.sum.entries.get(i), self.lost.entries.get(i), step.entries.get(i));
        let mut net = plus(self.net, step.parameter);
        for (i, (_, kind)) in self.columns.0.iter().enumerate() {
            if *kind != Kind::Entropy {
                net = plus(net, step.entries.get(i));
            }
        }
        Self {
            sum: Booked { parameter: parameter[0], entries: E::from_index(|i| entry(i)[0]) },
            lost: Booked { parameter: parameter[1], entries: E::from_index(|i| entry(i)[1]) },
            net,
            columns: Arc::clone(&self.columns),
        }
    }

    /// What was booked between another ledger and this one.
    pub(super) fn since(&self, other: &Self) -> Booked<E> {
        let sum = self.sum.zip(&other.sum, |a, b| a - b);
        let lost = self.lost.zip(&other.lost, |a, b| a - b);
        sum.zip(&lost, |a, b| a + b)
    }

    /// The sum of all work and heat, and its last digits.
    pub(super) const fn net_parts(&self) -> [f64; 2] {
        self.net
    }

    /// The work `W_t` of the time in the energy, into the system.
    pub const fn parameter_work(&self) -> f64 {
        self.sum.parameter
    }

    /// The work of a port, into the system; `None` if no port has this name.
    pub fn work(&self, port: &str) -> Option<f64> {
        self.entry(port, Kind::Work)
    }

    /// The heat of a bath, into the system; `None` if no bath has this name.
    pub fn heat(&self, bath: &str) -> Option<f64> {
        self.entry(bath, Kind::Heat)
    }

    /// The entropy that a bath has gained; `None` if no bath has this name.
    pub fn bath_entropy(&self, bath: &str) -> Option<f64> {
        self.entry(bath, Kind::Entropy)
    }

    fn entry(&self, name: &str, kind: Kind) -> Option<f64> {
        Some(self.sum.entries.get(self.columns.index(name, kind)?))
    }

    /// The sum of all work and heat.
    pub const fn net(&self) -> f64 {
        self.net[0]
    }

    /// The entropy that all baths have gained.
    pub fn entropy_of_baths(&self) -> f64 {
        let entropies =
            self.columns.0.iter().enumerate().filter(|(_, column)| column.1 == Kind::Entropy);
        let sum = entropies.fold([0.0; 2], |sum, (i, _)| {
            plus(plus(sum, self.sum.entries.get(i)), self.lost.entries.get(i))
        });
        sum[0]
    }

    /// The work of each port and the heat of each bath, by their names, in the order of the system; the work of the
    /// parameter has no name.
    pub fn entries(&self) -> impl Iterator<Item = (&str, f64)> {
        let columns =
            self.columns.0.iter().enumerate().filter(|(_, column)| column.1 != Kind::Entropy);
        columns.map(|(i, (name, _))| (&**name, self.sum.entries.get(i)))
    }

    /// The names and entries of work and of heat.
    pub(super) fn summary(&self) -> [Vec<(Arc<str>, f64)>; 2] {
        [Kind::Work, Kind::Heat].map(|wanted| {
            let columns =
                self.columns.0.iter().enumerate().filter(|(_, column)| column.1 == wanted);
            columns.map(|(i, (name, _))| (Arc::clone(name), self.sum.entries.get(i))).collect()
        })
    }

    /// All numbers, in the order in which [`read`](Self::read) reads them.
    fn numbers(&self) -> Vec<f64> {
        let mut numbers = self.net.to_vec();
        for booked in [&self.sum, &self.lost] {
            numbers.push(booked.parameter);
            numbers.extend((0..E::LEN).map(|i| booked.entries.get(i)));
        }
        numbers
    }

    /// How many numbers there are.
    pub(super) const NUMBERS: usize = 4 + 2 * E::LEN;

    /// The ledger with these numbers.
    pub(super) fn read(columns: &Arc<Columns>, numbers: &[f64]) -> Self {
        let mut next = numbers.iter().copied();
        let mut next = || next.next().unwrap_or(0.0);
        let net = [next(), next()];
        let mut booked = || Booked { parameter: next(), entries: E::fill(&mut next) };
        Self { net, sum: booked(), lost: booked(), columns: Arc::clone(columns) }
    }
}

/// A state of an open system.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenState<P, E> {
    /// The point.
    pub x: P,
    /// The time.
    pub time: f64,
    /// What has flowed into the system since the start of the run.
    pub ledger: Ledger<E>,
}

/// The states of an open system: points of `M` with the time and a ledger.
#[derive(Debug)]
pub struct OpenSpace<M, E>(PhantomData<fn() -> (M, E)>);

impl<M, E> Clone for OpenSpace<M, E> {
    fn clone(&self) -> Self {
        Self(PhantomData)
    }
}

impl<M, E> PartialEq for OpenSpace<M, E> {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl<M: Manifold, E: Entries> StateSpace for OpenSpace<M, E> {
    type Element = OpenState<M::Point<f64>, E>;

    /// The entries of the point, the time, the net sum with its last digits, and the entries of the ledger with
    /// theirs.
    fn numbers(x: &Self::Element) -> Vec<f64> {
        let mut numbers = M::entries(&x.x);
        numbers.push(x.time);
        numbers.extend(x.ledger.numbers());
        numbers
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_keep_the_digits_that_flow_through() {
        // 10⁵ in and out again, a million times, with a millionth of 1 left each time.
        let mut sum = [1.0, 0.0];
        for _ in 0..1_000_000 {
            for x in [1e5, 1e-6, -1e5] {
                sum = plus(sum, x);
            }
        }
        let exact = (0..1_000_000).fold([1.0, 0.0], |sum, _| plus(sum, 1e-6))[0];
        assert!((sum[0] - exact).abs() <= f64::EPSILON * exact, "{sum:?}");
    }
}
