//! Records, from which rows are measured.

use metriplectic_integrators::{Certificate, Ending, Event, State, StateSpace, Trajectory};

/// The record of a row: the states, the events and the certificate of its run.
#[derive(Clone, Debug)]
pub struct Record<M: StateSpace> {
    pub(crate) states: Vec<State<M>>,
    pub(crate) events: Vec<Crossing<M>>,
    pub(crate) certificate: Certificate,
    pub(crate) ending: Ending,
}

/// An event of a row.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Crossing<M: StateSpace> {
    /// The name that the event was given.
    pub name: String,
    /// Which one of the events that were asked for, counted from 0.
    pub index: usize,
    /// Whether the function rises through zero.
    pub rises: bool,
    /// The state there.
    pub state: State<M>,
}

impl<M: StateSpace> Record<M> {
    /// The recorded states, the start first.
    #[must_use]
    pub fn states(&self) -> &[State<M>] {
        &self.states
    }

    /// The state at the end of the run.
    #[must_use]
    pub fn last(&self) -> &State<M> {
        &self.states[self.states.len() - 1]
    }

    /// The events in the order of their times.
    #[must_use]
    pub fn events(&self) -> &[Crossing<M>] {
        &self.events
    }

    /// The time of the first event of a name; NaN without one, which is an empty cell of the table.
    #[must_use]
    pub fn time_of(&self, event: &str) -> f64 {
        let first = self.events.iter().find(|crossing| crossing.name == event);
        first.map_or(f64::NAN, |crossing| crossing.state.time)
    }

    /// The balance of the run.
    #[must_use]
    pub const fn certificate(&self) -> &Certificate {
        &self.certificate
    }

    /// How the run ended.
    #[must_use]
    pub const fn ending(&self) -> Ending {
        self.ending
    }
}

/// A result that a closure of a row may return: a [`Trajectory`], or the [`Record`] of a long row.
pub trait Recorded {
    /// Where the states of the run live.
    type Space: StateSpace;

    /// The record of the row.
    fn recorded(self) -> Record<Self::Space>;
}

impl<M: StateSpace> Recorded for Record<M> {
    type Space = M;

    fn recorded(self) -> Self {
        self
    }
}

impl<M: StateSpace> Recorded for Trajectory<M> {
    type Space = M;

    fn recorded(self) -> Record<M> {
        let events = self.events().iter().map(Crossing::of).collect();
        let (certificate, ending) = (self.certificate().clone(), self.ending());
        Record { states: self.states().to_vec(), events, certificate, ending }
    }
}

impl<M: StateSpace> Crossing<M> {
    pub(crate) fn of(event: &Event<M>) -> Self {
        let &Event { ref name, index, rises, ref state, .. } = event;
        Self { name: name.to_string(), index, rises, state: state.clone() }
    }
}
