//! The error of a sweep that did not finish, with the rows so far.

use crate::error::{JournalError, PlanError};
use crate::table::Table;

/// A sweep that did not finish. The rows so far are in it, and in the journal.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum SweepError {
    /// The plan makes no sense.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The journal cannot be used.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// The journal could not be written, because the disk is full for example.
    #[error("{source}; {} rows are kept in this error", table.len())]
    Write {
        /// The error of the journal.
        source: JournalError,
        /// The rows so far.
        table: Box<Table>,
    },
    /// Ctrl-C or the signal of a scheduler has ended the sweep, after the rows in hand.
    #[error("the sweep was interrupted after {} rows{}", table.len(), advice(*journal))]
    Interrupted {
        /// The rows so far.
        table: Box<Table>,
        /// Says that there is a journal from which it goes on.
        journal: bool,
    },
}

impl SweepError {
    /// The rows that were finished, if the sweep had begun.
    #[must_use]
    pub fn table(&self) -> Option<&Table> {
        match self {
            Self::Write { table, .. } | Self::Interrupted { table, .. } => Some(table),
            Self::Plan(_) | Self::Journal(_) => None,
        }
    }
}

/// The remedy after an interruption.
const fn advice(journal: bool) -> &'static str {
    if journal { "; run it again, and it goes on" } else { "" }
}

metriplectic_equations::debug_is_the_sentence!(SweepError);

metriplectic_integrators::passed_on_as_error!(SweepError);
