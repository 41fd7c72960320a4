//! The rows of a sweep with what they do and what is observed: everything but their execution.

use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

use metriplectic_integrators::{Error, Observables, StateSpace};

use crate::error::PlanError;
use crate::execution::Execution;
use crate::journal::Header;
use crate::plan::Sweep;
use crate::record::{Record, Recorded};
use crate::row::Row;
use crate::shard::{Shard, of_shard};
use crate::sweep_error::SweepError;
use crate::table::Table;

/// A number of a whole run.
type Measure<'a, M> = Box<dyn Fn(&Record<M>) -> f64 + Send + Sync + 'a>;

/// A sweep with the closure of its rows; made by [`Sweep::run`], and run by [`execute`](Self::execute).
pub struct Runs<'a, M: StateSpace, F> {
    pub(crate) plan: Sweep,
    pub(crate) run: F,
    pub(crate) observables: Observables<'a, M>,
    pub(crate) measures: Vec<(String, Measure<'a, M>)>,
    pub(crate) journal: Option<PathBuf>,
    pub(crate) shard: Shard,
    pub(crate) threads: Option<usize>,
    pub(crate) has_end: bool,
    pub(crate) quiet: bool,
    pub(crate) retries: bool,
    #[cfg(feature = "serde")]
    pub(crate) checkpoints: std::time::Duration,
}

impl Sweep {
    /// Says what a row does: a closure that builds a system from the parameters and returns its trajectory.
    pub fn run<'a, T, F>(self, run: F) -> Runs<'a, T::Space, F>
    where
        T: Recorded,
        F: Fn(&Row) -> Result<T, Error> + Sync,
    {
        Runs::new(self, run, Observables::new())
    }
}

impl<'a, M: StateSpace, F> Runs<'a, M, F> {
    pub(crate) fn new(plan: Sweep, run: F, observables: Observables<'a, M>) -> Self {
        Self {
            plan,
            run,
            observables,
            measures: Vec::new(),
            journal: None,
            shard: Shard::WHOLE,
            threads: None,
            has_end: true,
            quiet: false,
            retries: false,
            #[cfg(feature = "serde")]
            checkpoints: std::time::Duration::from_secs(60),
        }
    }

    /// Observes a number of the point at each recorded state. Its last value is a column of the table, and
    /// [`Table::mean`] and [`Table::quantiles`] show it in time. Let rows record few states: `Span::at_most`, or
    /// outputs at the same times in each row.
    #[must_use]
    pub fn observe(
        mut self,
        name: impl Into<String>,
        number: impl Fn(&M::Element) -> f64 + Send + Sync + 'a,
    ) -> Self {
        self.observables = self.observables.of(name, number);
        self
    }

    /// Measures one number of the whole run, such as the time of an event.
    #[must_use]
    pub fn measure(
        mut self,
        name: impl Into<String>,
        number: impl Fn(&Record<M>) -> f64 + Send + Sync + 'a,
    ) -> Self {
        self.measures.push((name.into(), Box::new(number)));
        self
    }

    /// Keeps each row in a file as soon as it is done. A sweep that is started again runs the rows that the file
    /// does not have. Rows that were being run when the process was killed are [passed over](crate::RowStatus::PassedOver), since one
    /// of them may have killed it. Each [shard](Self::shard) has a file of its own: shard 3 of `relax.journal` is
    /// `relax.3.journal`.
    #[must_use]
    pub fn journal(self, path: impl Into<PathBuf>) -> Self {
        Self { journal: Some(path.into()), ..self }
    }

    /// Runs the rows of the journal that failed or were [passed over](crate::RowStatus::PassedOver) once more, after all others.
    /// Rows that were passed over come last and one at a time: if one of them ends the process again, it is the only one that the
    /// next start passes over.
    ///
    /// The journal keeps the last outcome of a row. Rows that are done are not run again.
    #[must_use]
    pub fn retry_failed(self) -> Self {
        Self { retries: true, ..self }
    }

    /// Runs the rows of a shard alone.
    #[must_use]
    pub fn shard(self, shard: Shard) -> Self {
        Self { shard, ..self }
    }

    /// Runs rows on so many threads, rather than on as many as `RAYON_NUM_THREADS` says or the machine has. The table
    /// has the same bits.
    #[must_use]
    pub fn threads(self, threads: usize) -> Self {
        Self { threads: Some(threads.max(1)), ..self }
    }

    /// Leaves out the entries of the last states, where they are many.
    #[must_use]
    pub fn without_end(self) -> Self {
        Self { has_end: false, ..self }
    }

    /// Shows no bar. It is shown on a terminal alone in any case.
    #[must_use]
    pub fn quiet(self) -> Self {
        Self { quiet: true, ..self }
    }

    /// How often a [long row](Row::run_long) writes its checkpoint; each minute unless given.
    #[cfg(feature = "serde")]
    #[must_use]
    pub fn checkpoint_every(self, interval: std::time::Duration) -> Self {
        Self { checkpoints: interval, ..self }
    }

    /// The number of threads.
    pub(crate) fn thread_count(&self) -> usize {
        let asked = || std::env::var("RAYON_NUM_THREADS").ok()?.trim().parse().ok();
        let there = || std::thread::available_parallelism().map_or(1, usize::from);
        self.threads.or_else(asked).filter(|threads| *threads > 0).unwrap_or_else(there)
    }

    /// The file of a shard.
    pub(crate) fn journal_of_shard(&self) -> Option<PathBuf> {
        let path = self.journal.as_deref()?;
        Some(if self.shard.count == 1 { path.to_owned() } else { of_shard(path, self.shard.index) })
    }

    /// The names of what is measured and observed.
    fn columns(&self) -> [Vec<String>; 2] {
        let measures = self.measures.iter().map(|(name, _)| name.clone()).collect();
        [measures, self.observables.names().skip(1).map(str::to_owned).collect()]
    }

    /// The first line of the journal.
    pub(crate) fn header(&self) -> Result<Header, PlanError> {
        let rows = self.plan.rows()?;
        let [measures, observables] = self.columns();
        let mut columns: Vec<String> = measures.iter().chain(&observables).cloned().collect();
        self.plan.check_names(&columns)?;
        columns.insert(measures.len(), String::new());
        Ok(Header {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            plan: self.plan.fingerprint(&columns),
            rows,
            name: self.plan.name().to_owned(),
            about: self.plan.about(),
            parameters: self.plan.names(),
            measures,
            observables,
        })
    }
}

impl<M, T, F> Runs<'_, M, F>
where
    M: StateSpace,
    T: Recorded<Space = M>,
    F: Fn(&Row) -> Result<T, Error> + Sync,
{
    /// Runs all rows that the journal does not have, on all threads, and returns the table.
    ///
    /// A row that fails is a row of the table, and [`retry_failed`](Self::retry_failed) runs it again. The terminal shows a bar with the rate, the failures and the time left.
    /// Ctrl-C, or the signal of a scheduler, ends the sweep after the rows in hand.
    ///
    /// # Errors
    ///
    /// [`SweepError`]; the rows so far are in [`SweepError::table`].
    pub fn execute(&self) -> Result<Table, SweepError> {
        Execution::new(self, self.header()?)?.all()
    }

    /// Runs one row, without the journal. It has the bits of the same row in the table of all.
    ///
    /// # Errors
    ///
    /// [`PlanError`] if there is no such row.
    pub fn only(&self, row: usize) -> Result<Table, PlanError> {
        let header = self.header()?;
        let _ = self.plan.row(row)?;
        let names: Arc<[String]> = header.parameters.clone().into();
        let entry = crate::execution::outcome(self, &self.plan.known_row(row, &names));
        Ok(Table::new(header, entry.into_iter().collect(), 0))
    }
}

impl<M: StateSpace, F> fmt::Debug for Runs<'_, M, F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { plan, observables, journal, shard, .. } = self;
        f.debug_struct("Runs")
            .field("plan", plan)
            .field("observables", observables)
            .field("journal", journal)
            .field("shard", shard)
            .finish_non_exhaustive()
    }
}
