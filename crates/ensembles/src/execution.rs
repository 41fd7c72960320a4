//! Rows on all threads.

use std::any::Any;
use std::collections::{HashMap, HashSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Instant;

use metriplectic_integrators::{Error, StateSpace};

use crate::bar::Bar;
use crate::entry::{Done, Entry, Failed, Outcome, RowStatus, ending};
use crate::error::JournalError;
use crate::figures::{figures, kind};
use crate::interrupt::{self, Listening};
use crate::journal::{Header, Journal, combined, encode};
use crate::record::{Record, Recorded};
use crate::row::Row;
use crate::running::{InFlight, Running};
use crate::runs::Runs;
use crate::sweep_error::SweepError;
use crate::table::Table;

/// The execution of a sweep.
pub(crate) struct Execution<'r, 'a, M: StateSpace, F> {
    runs: &'r Runs<'a, M, F>,
    header: Header,
    journal: Option<Journal>,
    running: Option<Running>,
    known: Vec<Entry>,
    damaged: usize,
}

/// The rows that are left.
struct Todo {
    /// The rows that any thread may run.
    rows: Vec<usize>,
    /// The rows that are run one at a time, after all others.
    alone: Vec<usize>,
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
            let (known, damaged) = (Vec::new(), 0);
            return Ok(Self { runs, header, journal: None, running: None, known, damaged });
        };
        let (mut journal, content) = Journal::open(&path, &header)?;
        // One that was moved away had other rows in hand.
        let left = if content.new { Vec::new() } else { Running::left(&path, header.plan) };
        // Rows that stand twice are compared.
        let content = combined(vec![(&path, content)])?;
        let (mut known, damaged) = (content.rows, content.damaged);
        // A plan of fewer samples has none of the others.
        known.retain(|entry| entry.number < header.rows);
        let bits = |values: &[f64]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        for entry in &known {
            if bits(&entry.parameters) != bits(&runs.plan.values(entry.number)) {
                let found = format!("{} (row {} has other parameters)", header.about, entry.number);
                let expected = header.about.clone();
                return Err(JournalError::AnotherSweep { path, found, expected }.into());
            }
        }
        let done: HashSet<usize> =
            known.iter().filter(|entry| entry.is_done()).map(|entry| entry.number).collect();
        // A row whose checkpoint has moved on goes on from there.
        let is_stuck = |&(row, sum): &InFlight| {
            row < header.rows && !done.contains(&row) && sum == checkpoint(runs, row)
        };
        for (number, _) in left.into_iter().filter(is_stuck) {
            let before = known.iter().find(|entry| entry.number == number);
            let times = before.and_then(Entry::passed_over).unwrap_or(0) + 1;
            let (parameters, outcome) = (runs.plan.values(number), Outcome::PassedOver(times));
            let entry = Entry { number, parameters, outcome, seconds: 0.0 };
            journal.append(&encode(&entry))?;
            known.retain(|known| known.number != number);
            known.push(entry);
        }
        let mut execution =
            Self { runs, header, journal: Some(journal), running: None, known, damaged };
        refuse_checkpoints(runs, &execution.header, &execution.todo())?;
        let (plan, threads) = (execution.header.plan, runs.thread_count());
        execution.running = Some(Running::begin(&path, plan, threads)?);
        Ok(execution)
    }

    /// The rows of the shard that the journal does not have, and those that are to be run again.
    fn todo(&self) -> Todo {
        let Self { runs, header, known, .. } = self;
        let known: HashMap<usize, &Entry> = known.iter().map(|e| (e.number, e)).collect();
        let (mut rows, mut failed, mut alone) = (Vec::new(), Vec::new(), Vec::new());
        for row in (runs.shard.index..header.rows).step_by(runs.shard.count) {
            match known.get(&row).map(|entry| (entry.status(), entry.passed_over())) {
                None => rows.push(row),
                Some((RowStatus::Failed, _)) if runs.retries => failed.push(row),
                Some((_, Some(times))) if runs.retries => alone.push((times, row)),
                Some(_) => {}
            }
        }
        rows.append(&mut failed);
        // Those that have ended a process more often come after all others, which then are not held up by them.
        alone.sort_unstable();
        Todo { rows, alone: alone.into_iter().map(|(_, row)| row).collect() }
    }

    /// Runs the rows that are not known.
    pub(crate) fn all(self) -> Result<Table, SweepError> {
        let Todo { rows: todo, alone } = self.todo();
        let Self { runs, header, journal, running, known, damaged } = self;
        let _listening = Listening::begin();
        let all = (runs.shard.index..header.rows).step_by(runs.shard.count).len();
        let again: HashSet<usize> = todo.iter().chain(&alone).copied().collect();
        let failed = known.iter().filter(|e| !e.is_done() && !again.contains(&e.number)).count();
        let bar = Bar::new(all, all - again.len(), failed, runs.quiet);
        let has_journal = journal.is_some();
        let sink = Mutex::new(Sink { journal, rows: known, failure: None, bar });
        let names: Arc<[String]> = header.parameters.clone().into();
        let stopped = AtomicBool::new(false);
        let [next, threads] = [const { AtomicUsize::new(0) }; 2];
        let locked = || sink.lock().unwrap_or_else(PoisonError::into_inner);
        // Outside of the lock: other threads go on meanwhile.
        let kept = |written: Result<(), JournalError>| written.is_ok() || locked().kept(written);
        let begin = |thread, row| match &running {
            Some(running) => running.row(thread, (row, checkpoint(runs, row))),
            None => Ok(()),
        };
        let end = |thread| running.as_ref().map_or(Ok(()), |running| running.none(thread));
        let run = |thread: usize, number: usize| {
            let row = prepared(runs, runs.plan.known_row(number, &names), &header);
            let begun = !interrupt::asked() && kept(begin(thread, number));
            let taken = begun
                && outcome(runs, &row).is_some_and(|entry| {
                    let line = if has_journal { encode(&entry) } else { Vec::new() };
                    locked().take(entry, &line)
                });
            if taken {
                finished(&row);
            }
            begun && kept(end(thread)) && taken
        };
        let work = || {
            let thread = threads.fetch_add(1, Ordering::Relaxed);
            while !stopped.load(Ordering::Relaxed)
                && let Some(&number) = todo.get(next.fetch_add(1, Ordering::Relaxed))
            {
                if !run(thread, number) {
                    stopped.store(true, Ordering::Relaxed);
                }
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
        for number in alone {
            if stopped.load(Ordering::Relaxed) || !run(0, number) {
                stopped.store(true, Ordering::Relaxed);
            }
        }
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
        self.bar.add(!entry.is_done());
        self.rows.push(entry);
        let written = match (&mut self.journal, &self.failure) {
            (Some(journal), None) => journal.append(line),
            _ => Ok(()),
        };
        self.kept(written)
    }

    /// Keeps the first failure, and returns whether there is none.
    fn kept(&mut self, written: Result<(), JournalError>) -> bool {
        self.failure = self.failure.take().or(written.err());
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

/// The check sum of the checkpoint of a row; 0 if there is none.
fn checkpoint<M: StateSpace, F>(runs: &Runs<'_, M, F>, row: usize) -> u64 {
    #[cfg(feature = "serde")]
    let sum = runs.journal.as_deref().map_or(0, |journal| crate::long::check_sum(journal, row));
    #[cfg(not(feature = "serde"))]
    let (sum, _) = (0, (runs, row));
    sum
}

/// Refuses checkpoints of another plan, before any row is run.
fn refuse_checkpoints<M: StateSpace, F>(
    runs: &Runs<'_, M, F>,
    header: &Header,
    todo: &Todo,
) -> Result<(), JournalError> {
    #[cfg(feature = "serde")]
    if let Some(journal) = runs.journal.as_deref() {
        crate::long::refuse(journal, header.plan, [&todo.rows, &todo.alone])?;
    }
    #[cfg(not(feature = "serde"))]
    let _ = (runs, header, todo);
    Ok(())
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
