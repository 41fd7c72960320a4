//! Rows on all threads.

use std::any::Any;
use std::collections::HashSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Instant;

use metriplectic_integrators::{Error, StateSpace};

use crate::bar::Bar;
use crate::entry::{Done, Entry, Failed, Outcome, ending};
use crate::error::{JournalError, SweepError};
use crate::figures::{figures, kind};
use crate::interrupt::{self, Listening};
use crate::journal::{Header, Journal, combined, encode};
use crate::record::{Record, Recorded};
use crate::row::Row;
use crate::runs::Runs;
use crate::table::Table;

/// The execution of a sweep.
pub(crate) struct Execution<'r, 'a, M: StateSpace, F> {
    runs: &'r Runs<'a, M, F>,
    header: Header,
    journal: Option<Journal>,
    known: Vec<Entry>,
    damaged: usize,
}

/// The state that the threads share.
struct Sink {
    journal: Option<Journal>,
    rows: Vec<Entry>,
    failure: Option<JournalError>,
    bar: Bar,
}

impl<'r, 'a, M, T, F> Execution<'r, 'a, M, F>
where
    M: StateSpace,
    T: Recorded<Space = M>,
    F: Fn(&Row) -> Result<T, Error> + Sync,
{
    /// Opens the journal.
    pub(crate) fn new(runs: &'r Runs<'a, M, F>, header: Header) -> Result<Self, SweepError> {
        let Some(path) = runs.journal_of_shard() else {
            return Ok(Self { runs, header, journal: None, known: Vec::new(), damaged: 0 });
        };
        let (journal, content) = Journal::open(&path, &header)?;
        // Rows that stand twice are compared.
        let content = combined(vec![(&path, content)])?;
        let (known, damaged) = (content.rows, content.damaged);
        let bits = |values: &[f64]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        for entry in &known {
            if bits(&entry.parameters) != bits(&runs.plan.values(entry.number)) {
                let found = format!("{} (row {} has other parameters)", header.about, entry.number);
                let expected = header.about.clone();
                return Err(JournalError::AnotherSweep { path, found, expected }.into());
            }
        }
        Ok(Self { runs, header, journal: Some(journal), known, damaged })
    }

    /// Runs the rows that are not known.
    pub(crate) fn all(self) -> Result<Table, SweepError> {
        let Self { runs, header, journal, known, damaged } = self;
        let _listening = Listening::begin();
        let done: HashSet<usize> = known.iter().map(|entry| entry.number).collect();
        let mine = (runs.shard.index..header.rows).step_by(runs.shard.count);
        let all = mine.len();
        let todo: Vec<usize> = mine.filter(|row| !done.contains(row)).collect();
        let failed = known.iter().filter(|entry| entry.failed().is_some()).count();
        let bar = Bar::new(all, all - todo.len(), failed, runs.quiet);
        let has_journal = journal.is_some();
        let sink = Mutex::new(Sink { journal, rows: known, failure: None, bar });
        let names: Arc<[String]> = header.parameters.clone().into();
        let (next, stopped) = (AtomicUsize::new(0), AtomicBool::new(false));
        let work = || {
            while !stopped.load(Ordering::Relaxed)
                && let Some(&number) = todo.get(next.fetch_add(1, Ordering::Relaxed))
            {
                let row = prepared(runs, runs.plan.known_row(number, &names), &header);
                let taken = !interrupt::asked()
                    && outcome(runs, &row).is_some_and(|entry| {
                        let line = if has_journal { encode(&entry) } else { Vec::new() };
                        sink.lock().unwrap_or_else(PoisonError::into_inner).take(entry, &line)
                    });
                if taken { finished(&row) } else { stopped.store(true, Ordering::Relaxed) }
            }
        };
        // Threads of its own: one of rayon's would begin another row while it waits for the loops of a lattice.
        thread::scope(|scope| {
            for _ in 1..runs.thread_count().min(todo.len()) {
                // Without the thread the others run its rows.
                let _ = thread::Builder::new().spawn_scoped(scope, work);
            }
            work();
        });
        let stopped = stopped.into_inner();
        let Sink { journal, rows, failure, bar } =
            sink.into_inner().unwrap_or_else(PoisonError::into_inner);
        bar.finish();
        let written = journal.map_or(Ok(()), Journal::finish);
        let table = Table::new(header, rows, damaged);
        match failure.map_or(written, Err) {
            Err(source) => Err(SweepError::Write { source, table: Box::new(table) }),
            Ok(()) if stopped => {
                Err(SweepError::Interrupted { table: Box::new(table), journal: has_journal })
            }
            Ok(()) => Ok(table),
        }
    }
}

impl Sink {
    /// Takes a row that is done, and returns whether it is kept. After a failed write nothing more is written.
    fn take(&mut self, entry: Entry, line: &[u8]) -> bool {
        self.bar.add(entry.failed().is_some());
        self.rows.push(entry);
        if self.failure.is_none()
            && let Some(journal) = &mut self.journal
        {
            self.failure = journal.append(line).err();
        }
        self.failure.is_none()
    }
}

/// A row that knows where its checkpoint is.
#[cfg(feature = "serde")]
fn prepared<M: StateSpace, F>(runs: &Runs<'_, M, F>, mut row: Row, header: &Header) -> Row {
    row.long = runs
        .journal
        .as_deref()
        .map(|path| crate::long::LongRow::new(path, header.plan, runs.checkpoints));
    row
}

#[cfg(not(feature = "serde"))]
fn prepared<M: StateSpace, F>(_: &Runs<'_, M, F>, row: Row, _: &Header) -> Row {
    row
}

/// Removes the checkpoint of a row that is in the journal.
fn finished(row: &Row) {
    #[cfg(feature = "serde")]
    row.remove_checkpoint();
    #[cfg(not(feature = "serde"))]
    let _ = row;
}

/// Runs a row to its outcome; `None` if it was put down for another time.
pub(crate) fn outcome<M, T, F>(runs: &Runs<'_, M, F>, row: &Row) -> Option<Entry>
where
    M: StateSpace,
    T: Recorded<Space = M>,
    F: Fn(&Row) -> Result<T, Error> + Sync,
{
    let (number, begun) = (row.number(), Instant::now());
    // A panic leaves nothing behind that another row sees: rows share nothing but what their closure captures.
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        (runs.run)(row).map(|run| observed(runs, &run.recorded()))
    }));
    let outcome = match outcome {
        Ok(Ok(done)) => Outcome::Done(done),
        #[cfg(feature = "serde")]
        Ok(Err(error)) if crate::long::is_put_down(&error) => return None,
        Ok(Err(error)) => {
            let (kind, figures) = kind::<M>(&error);
            let (kind, message) = (kind.to_owned(), error.to_string());
            Outcome::Failed(Failed { kind, message, figures })
        }
        Err(payload) => {
            let (kind, message) = ("panic".to_owned(), said(&*payload));
            Outcome::Failed(Failed { kind, message, figures: None })
        }
    };
    let (parameters, seconds) = (row.values().into(), begun.elapsed().as_secs_f64());
    Some(Entry { number, parameters, outcome, seconds })
}

/// The message of a panic.
fn said(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().copied();
    let text = text.or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    text.map_or_else(|| "the closure panicked".to_owned(), |text| format!("panicked: {text}"))
}

/// The numbers of a run.
fn observed<M: StateSpace, F>(runs: &Runs<'_, M, F>, run: &Record<M>) -> Done {
    let last = run.last();
    let measures = runs.measures.iter().map(|(_, measure)| measure(run)).collect();
    let count = runs.observables.names().count() - 1;
    let (mut times, mut series): (Box<[f64]>, Box<[f64]>) = Default::default();
    if count > 0 {
        let states = run.states();
        times = states.iter().map(|state| state.time).collect();
        series = vec![0.0; count * states.len()].into();
        for (k, state) in states.iter().enumerate() {
            for (column, x) in runs.observables.row(state).skip(1).enumerate() {
                series[column * states.len() + k] = x;
            }
        }
    }
    Done {
        ending: ending(run.ending()),
        figures: figures(run.certificate(), last.time),
        end: if runs.has_end { M::numbers(&last.point).into() } else { [].into() },
        measures,
        times,
        series,
    }
}
