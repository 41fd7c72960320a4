//! States of an open system: a point, the time, and the ledger.

use std::marker::PhantomData;
use std::sync::Arc;

use crate::round_off::sum::plus;
use crate::step::{EventExchange, Laws, LedgerErrors, LedgerSummary, StartError, StateSpace};
use metriplectic_dynamics::exchange::{Entries, Names};

/// The entries of a step: the work of the parameter, and those of ports and baths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Booked<E> {
    /// The work `W_t` that is done by the time in the energy.
    pub parameter: f64,
    /// The work of each port; the heat and the entropy of each bath.
    pub entries: E,
}

impl<E: Entries> Booked<E> {
    /// The numbers by their index, the parameter first.
    pub(super) fn get(&self, index: usize) -> f64 {
        index.checked_sub(1).map_or(self.parameter, |index| self.entries.get(index))
    }

    /// A combination of what is booked, with weights.
    pub(super) fn combined(terms: &[(f64, &Self)]) -> Self {
        let sum =
            |index: usize| terms.iter().map(|(weight, booked)| weight * booked.get(index)).sum();
        Self { parameter: sum(0), entries: E::from_index(|i| sum(i + 1)) }
    }

    /// A step in which nothing is booked.
    pub(super) fn nothing() -> Self {
        Self { parameter: 0.0, entries: E::from_index(|_| 0.0) }
    }
}

/// The kind of an entry of a ledger.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Work,
    Heat,
    Entropy,
}

/// The entries of a ledger with their names.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns(Vec<(Arc<str>, Kind)>);

impl Columns {
    /// Makes the columns of the parts with these names.
    pub(super) fn new(names: &Names) -> Self {
        let kinds =
            |is_bath: bool| if is_bath { &[Kind::Heat, Kind::Entropy][..] } else { &[Kind::Work] };
        let columns = names.iter().flat_map(|(name, is_bath)| {
            kinds(*is_bath).iter().map(|kind| (Arc::clone(name), *kind))
        });
        Self(columns.collect())
    }

    /// The indices of the heats; that of the entropy of a bath follows its heat.
    pub(super) fn heats(&self) -> impl Iterator<Item = usize> {
        let columns = self.0.iter().enumerate();
        columns.filter(|(_, column)| column.1 == Kind::Heat).map(|(index, _)| index)
    }

    /// The index of the heat of a bath, in their order.
    pub(super) fn heat(&self, bath: usize) -> Option<usize> {
        let heats = self.0.iter().enumerate().filter(|(_, column)| column.1 == Kind::Heat);
        heats.map(|(index, _)| index).nth(bath)
    }

    /// The largest size of an entry of each kind: work, heat and entropy.
    pub(super) fn largest(&self, entry: impl Fn(usize) -> f64) -> [f64; 3] {
        [Kind::Work, Kind::Heat, Kind::Entropy].map(|kind| {
            let entries = self.0.iter().enumerate().filter(|(_, column)| column.1 == kind);
            entries.fold(0.0, |most, (i, _)| f64::max(most, entry(i).abs()))
        })
    }

    /// Numbers of the columns: one for each work and each heat, and another one for each entropy.
    pub(super) fn sizes(&self, energy: f64, entropy: impl Fn(usize) -> f64) -> Vec<f64> {
        let columns = self.0.iter().enumerate();
        columns
            .map(|(i, (_, kind))| if *kind == Kind::Entropy { entropy(i) } else { energy })
            .collect()
    }

    fn index(&self, name: &str, kind: Kind) -> Option<usize> {
        self.0.iter().position(|column| *column.0 == *name && column.1 == kind)
    }
}

/// The exchange of a system with its surroundings since the start of a run: the work of the parameter, the work of each port, the heat of
/// each bath, and the entropy that the baths have gained.
///
/// Each sum is compensated. All work and heat goes into one more sum, [`net`](Self::net), by which the balance of
/// the energy is kept: the entries grow with what flows through a system, and their round-off with them.
#[derive(Clone, Debug, PartialEq)]
pub struct Ledger {
    /// The sum of all work and heat, and what rounding has lost of it.
    net: [f64; 2],
    /// The work of the parameter, and the sum of each column.
    sums: Box<[[f64; 2]]>,
    /// The sums of the work and the heat of events, and of the entropy that their surroundings have gained.
    events: [[f64; 2]; 3],
    columns: Arc<Columns>,
}

impl Ledger {
    /// The ledger of a system with these columns, before anything is booked.
    pub(super) fn empty(columns: &Arc<Columns>) -> Self {
        let sums = vec![[0.0; 2]; columns.0.len() + 1].into();
        Self { net: [0.0; 2], sums, events: [[0.0; 2]; 3], columns: Arc::clone(columns) }
    }

    /// The ledger of a flow of your own, before anything is booked: of ports and of baths, each with its name and whether it is a
    /// bath.
    pub fn of(parts: impl IntoIterator<Item = (Arc<str>, bool)>) -> Self {
        let names: Names = parts.into_iter().collect();
        Self::empty(&Arc::new(Columns::new(&names)))
    }

    /// The ledger with one more step: the work of the time in the energy, then the work of each port, and the heat and the entropy of
    /// each bath in their order.
    #[must_use]
    pub fn with_entries(&self, entries: &[f64]) -> Self {
        self.plus(|index| entries[index])
    }

    /// The entries booked between another ledger and this one, the work of the time first.
    pub fn entries_since(&self, other: &Self) -> Vec<f64> {
        (0..self.sums.len()).map(|index| self.change(other, index)).collect()
    }

    /// The ledger with one more event.
    #[must_use]
    pub fn with_event(&self, event: &EventExchange) -> Self {
        let mut ledger = self.clone();
        let EventExchange { work, heat, entropy } = *event;
        for (sum, number) in ledger.events.iter_mut().zip([work, heat, entropy]) {
            *sum = plus(*sum, number);
        }
        ledger.net = plus(plus(ledger.net, work), heat);
        ledger
    }

    /// The ledger with one more step.
    #[must_use]
    pub(super) fn with<E: Entries>(&self, step: &Booked<E>) -> Self {
        self.plus(|index| step.get(index))
    }

    /// The ledger with numbers by their index, the work of the parameter first.
    #[inline]
    fn plus(&self, number: impl Fn(usize) -> f64) -> Self {
        let mut ledger = self.clone();
        for (index, sum) in ledger.sums.iter_mut().enumerate() {
            *sum = plus(*sum, number(index));
        }
        ledger.net = plus(ledger.net, number(0));
        for (i, (_, kind)) in self.columns.0.iter().enumerate() {
            if *kind != Kind::Entropy {
                ledger.net = plus(ledger.net, number(i + 1));
            }
        }
        ledger
    }

    /// The change of a number between another ledger and this one.
    fn change(&self, other: &Self, index: usize) -> f64 {
        let [[a, low_a], [b, low_b]] = [self.sums[index], other.sums[index]];
        (a - b) + (low_a - low_b)
    }

    /// Returns the sum `Σ |ΔW| + Σ |ΔQ|` of all work and heat that was booked between another ledger and this one.
    #[must_use]
    pub fn flowed(&self, other: &Self) -> f64 {
        let columns = self.columns.0.iter().enumerate();
        let energies = columns.filter(|(_, (_, kind))| *kind != Kind::Entropy).map(|(i, _)| i + 1);
        std::iter::once(0).chain(energies).map(|index| self.change(other, index).abs()).sum()
    }

    /// The sizes of the sums.
    pub(super) fn sizes<E: Entries>(&self) -> Booked<E> {
        let size = |index: usize| self.sums[index][0].abs();
        Booked { parameter: size(0), entries: E::from_index(|i| size(i + 1)) }
    }

    /// The index of the heat of each bath among the entries of ports and baths; that of its entropy follows.
    pub fn heats(&self) -> impl Iterator<Item = usize> {
        self.columns.heats()
    }

    /// Returns whether there are entries of ports or baths.
    pub fn has_entries(&self) -> bool {
        self.len() > 0
    }

    /// The sizes of the entries, that of the work of the time first.
    pub fn entry_sizes(&self) -> Vec<f64> {
        self.sums.iter().map(|[sum, _]| sum.abs()).collect()
    }

    /// Sorts errors of the entries, that of the work of the time first, and takes the largest of each kind.
    pub fn errors_by_kind(&self, errors: &[f64]) -> LedgerErrors {
        let [work, heat, entropy] = self.columns.largest(|i| errors[i + 1]);
        LedgerErrors::new(work.max(errors[0].abs()), heat, entropy)
    }

    /// Returns the entries that were booked between another ledger and this one.
    pub(super) fn since<E: Entries>(&self, other: &Self) -> Booked<E> {
        let change = |index| self.change(other, index);
        Booked { parameter: change(0), entries: E::from_index(|i| change(i + 1)) }
    }

    /// The work `W_t` of the time in the energy, into the system.
    pub fn parameter_work(&self) -> f64 {
        self.sums[0][0]
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
        Some(self.sums[self.columns.index(name, kind)? + 1][0])
    }

    /// The places of the work of a port, and of the heat and the entropy of a bath, behind the work of the parameter.
    pub(crate) fn places(&self, name: &str) -> [Option<usize>; 3] {
        [Kind::Work, Kind::Heat, Kind::Entropy]
            .map(|kind| self.columns.index(name, kind).map(|index| index + 1))
    }

    /// How many sums there are, that of the work of the parameter among them.
    pub(crate) fn count(&self) -> usize {
        self.sums.len()
    }

    /// The work of the [events that change the state](crate::Watched::jump), into the system.
    pub const fn event_work(&self) -> f64 {
        self.events[0][0]
    }

    /// The heat of these events, into the system.
    pub const fn event_heat(&self) -> f64 {
        self.events[1][0]
    }

    /// The sum of all work and heat.
    pub const fn net(&self) -> f64 {
        self.net[0]
    }

    /// The entropy that all baths have gained, those of events among them.
    pub fn entropy_of_baths(&self) -> f64 {
        let entropies = self.of_kind(Kind::Entropy);
        entropies.fold(self.events[2], |sum, (_, [high, low])| plus(plus(sum, high), low))[0]
    }

    /// Returns the laws `H − W − Q` and `S + Σ S_b`, from those of the closed system at this state.
    #[must_use]
    pub fn balanced<L>(&self, laws: Laws<L>) -> Laws<L> {
        let [net, rest] = self.net;
        let entropy = laws.entropy + self.entropy_of_baths();
        Laws { energy: (laws.energy - net) - rest, entropy, ..laws }
    }

    /// Returns the laws that a state must have for the balance to be `laws`: the energy more by all that has flowed in, and
    /// the entropy less by what the baths have gained.
    #[must_use]
    pub fn targets<L: Clone>(&self, laws: &Laws<L>) -> Laws<L> {
        let [net, rest] = self.net;
        Laws {
            energy: (laws.energy + net) + rest,
            entropy: laws.entropy - self.entropy_of_baths(),
            invariants: laws.invariants.clone(),
        }
    }

    /// The names and sums of a kind.
    fn of_kind(&self, kind: Kind) -> impl Iterator<Item = (&Arc<str>, [f64; 2])> {
        let columns = self.columns.0.iter().zip(&self.sums[1..]);
        columns.filter(move |(column, _)| column.1 == kind).map(|((name, _), sum)| (name, *sum))
    }

    /// The names and entries of work and of heat.
    fn summary(&self) -> [Vec<(Arc<str>, f64)>; 2] {
        [Kind::Work, Kind::Heat].map(|kind| {
            self.of_kind(kind).map(|(name, [sum, _])| (Arc::clone(name), sum)).collect()
        })
    }

    /// The names and entries of work and of heat, for a certificate.
    pub fn summarised(&self, parameter: Option<f64>, system_entropy: f64) -> LedgerSummary {
        let [work, heat] = self.summary();
        LedgerSummary { parameter, work, heat, system_entropy }
    }

    /// The ledger of the same parts with these [`numbers`](Self::numbers).
    #[must_use]
    pub fn with_numbers(&self, numbers: &[f64]) -> Self {
        Self::read(&self.columns, numbers)
    }

    /// All numbers: each sum with its last digits, for a checkpoint.
    pub fn numbers(&self) -> Vec<f64> {
        let sums = self.sums.iter().chain(&self.events).flatten();
        self.net.iter().chain(sums).copied().collect()
    }

    /// How many entries there are beside the work of the parameter.
    fn len(&self) -> usize {
        self.columns.0.len()
    }

    /// How many numbers a ledger with these columns has.
    pub(super) fn length(columns: &Columns) -> usize {
        10 + 2 * columns.0.len()
    }

    /// The ledger with these numbers.
    pub(super) fn read(columns: &Arc<Columns>, numbers: &[f64]) -> Self {
        let mut pairs = numbers.chunks_exact(2).map(|pair| [pair[0], pair[1]]);
        let mut next = || pairs.next().unwrap_or([0.0; 2]);
        let net = next();
        let sums = (0..=columns.0.len()).map(|_| next()).collect();
        let events = [(); 3].map(|()| next());
        Self { net, sums, events, columns: Arc::clone(columns) }
    }
}

/// A state of an open system.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenState<P> {
    /// The point.
    pub x: P,
    /// The time.
    pub time: f64,
    /// The exchange of the system since the start of the run.
    pub ledger: Ledger,
}

impl<P> OpenState<P> {
    /// The state in which a run starts at a time, of a system with a ledger like this empty one. A state on which nothing is
    /// booked, with a clock at zero, takes the time of the run. The clock and the ledger of another one go on.
    ///
    /// # Errors
    ///
    /// [`StartError`] if the clock shows another time, or the ledger has other entries.
    pub fn begun(self, time: f64, empty: &Ledger) -> Result<Self, StartError> {
        let [found, expected] = [&self.ledger, empty].map(Ledger::len);
        if self.ledger.columns != empty.columns {
            return Err(StartError::Ledger { found, expected });
        }
        let is_new = self.time == 0.0 && self.ledger == *empty;
        if !is_new && (self.time - time).abs() > 0.0 {
            return Err(StartError::Clock { clock: self.time, start: time });
        }
        Ok(Self { time, ..self })
    }

    /// The state with another point, at the same time and with the same ledger: for an
    /// [event that changes the state](crate::Watched::jump).
    #[must_use]
    pub fn at(&self, x: P) -> Self {
        Self { x, time: self.time, ledger: self.ledger.clone() }
    }
}

/// The states of an open system: points of the space `M` with the time and a ledger.
#[derive(Debug)]
pub struct OpenSpace<M>(PhantomData<fn() -> M>);

impl<M> Clone for OpenSpace<M> {
    fn clone(&self) -> Self {
        Self(PhantomData)
    }
}

impl<M> PartialEq for OpenSpace<M> {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl<M: StateSpace> StateSpace for OpenSpace<M> {
    type Element = OpenState<M::Element>;

    /// The entries of the point, the time, and each sum of the ledger with its last digits: all work and heat, the work
    /// of the parameter, the columns of the ports and baths in their order, and the work, the heat and the entropy of events.
    fn numbers(x: &Self::Element) -> Vec<f64> {
        let mut numbers = M::numbers(&x.x);
        numbers.push(x.time);
        numbers.extend(x.ledger.numbers());
        numbers
    }
}
