//! Outcomes of rows.

use metriplectic_integrators::Ending;

use crate::figures::Figures;

/// A row with what became of it.
#[derive(Clone, Debug)]
pub(crate) struct Entry {
    pub(crate) number: usize,
    pub(crate) parameters: Box<[f64]>,
    pub(crate) outcome: Outcome,
    /// The wall time, which is no part of the compared numbers.
    pub(crate) seconds: f64,
}

/// The outcome of a row.
#[derive(Clone, Debug)]
pub(crate) enum Outcome {
    Done(Done),
    Failed(Failed),
    /// The process has ended while the row ran, so many times.
    PassedOver(usize),
}

/// The outcome of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum RowStatus {
    /// Its run has ended.
    Done,
    /// It failed, with an error or a panic.
    Failed,
    /// The process ended while the row ran, by an abort of the row itself or from outside. So the next start has passed over it.
    /// [`Runs::retry_failed`](crate::Runs::retry_failed) runs it again.
    PassedOver,
}

/// The kind of a row that was passed over.
const KILLED: &str = "killed";

/// The sentence of a row that was passed over.
const PASSED_OVER: &str =
    "the process ended while this row ran, so it was passed over; `retry_failed()` runs it again";

/// A row whose run has ended.
#[derive(Clone, Debug)]
pub(crate) struct Done {
    /// The name of how it ended.
    pub(crate) ending: &'static str,
    pub(crate) figures: Figures,
    /// The entries of the last state.
    pub(crate) end: Box<[f64]>,
    /// Numbers of the whole run.
    pub(crate) measures: Box<[f64]>,
    /// The times of the recorded states, if anything was observed there.
    pub(crate) times: Box<[f64]>,
    /// The observables at these times, one observable after the other.
    pub(crate) series: Box<[f64]>,
}

/// A row that failed.
#[derive(Clone, Debug)]
pub(crate) struct Failed {
    pub(crate) kind: String,
    pub(crate) message: String,
    /// The numbers of the steps before it failed.
    pub(crate) figures: Option<Figures>,
}

/// The names of how a run ended.
pub(crate) const ENDINGS: [&str; 4] = ["span", "rest", "event", "stopped"];

/// The name of how a run ended.
pub(crate) const fn ending(ending: Ending) -> &'static str {
    match ending {
        Ending::Span => ENDINGS[0],
        Ending::Rest { .. } => ENDINGS[1],
        Ending::Event { .. } => ENDINGS[2],
        _ => ENDINGS[3],
    }
}

impl Entry {
    pub(crate) const fn done(&self) -> Option<&Done> {
        match &self.outcome {
            Outcome::Done(done) => Some(done),
            Outcome::Failed(_) | Outcome::PassedOver(_) => None,
        }
    }

    pub(crate) const fn failed(&self) -> Option<&Failed> {
        match &self.outcome {
            Outcome::Failed(failed) => Some(failed),
            Outcome::Done(_) | Outcome::PassedOver(_) => None,
        }
    }

    pub(crate) const fn status(&self) -> RowStatus {
        match self.outcome {
            Outcome::Done(_) => RowStatus::Done,
            Outcome::Failed(_) => RowStatus::Failed,
            Outcome::PassedOver(_) => RowStatus::PassedOver,
        }
    }

    /// How often the process has ended while the row ran, since it last had another outcome.
    pub(crate) const fn passed_over(&self) -> Option<usize> {
        match self.outcome {
            Outcome::PassedOver(times) => Some(times),
            Outcome::Done(_) | Outcome::Failed(_) => None,
        }
    }

    pub(crate) const fn is_done(&self) -> bool {
        matches!(self.outcome, Outcome::Done(_))
    }

    /// The kind and the sentence of a row that is not done.
    pub(crate) fn error(&self) -> Option<(&str, &str)> {
        match &self.outcome {
            Outcome::Done(_) => None,
            Outcome::Failed(failed) => Some((&failed.kind, &failed.message)),
            Outcome::PassedOver(_) => Some((KILLED, PASSED_OVER)),
        }
    }
}
