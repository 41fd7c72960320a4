//! Rows that last for hours: they write checkpoints, and go on from them.
//!
//! Row 17 of `relax.journal` has the file `relax.row-17.checkpoint`. It holds the checkpoint of the run and the
//! states and events recorded so far, with a check sum in its last line. It is replaced as a whole, and removed once
//! the row is in the journal.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use metriplectic_integrators::{
    Checkpoint, Element, Error, Flow, FlowError, Method, RunError, Schedule, State, StateSpace,
    Steps,
};

use crate::error::JournalError;
use crate::fingerprint::of_line;
use crate::interrupt;
use crate::record::{Crossing, Record};
use crate::replaced::replaced;
use crate::row::Row;

/// Where a row keeps its checkpoint.
#[derive(Debug)]
pub(crate) struct LongRow {
    journal: PathBuf,
    plan: u64,
    interval: Duration,
    /// Whether the row is a long one.
    used: AtomicBool,
}

/// The file of a long row.
struct Place {
    path: PathBuf,
    row: usize,
    plan: u64,
    interval: Duration,
}

/// A row that was put down because of a signal. It is no failure.
#[derive(thiserror::Error)]
#[error("the row was put down, and goes on when the sweep is started again")]
struct PutDown;

metriplectic_equations::debug_is_the_sentence!(PutDown);

/// A checkpoint that cannot be written or read.
#[derive(thiserror::Error)]
#[error("the checkpoint {} of the row: {problem}", path.display())]
struct CheckpointError {
    path: PathBuf,
    problem: String,
}

metriplectic_equations::debug_is_the_sentence!(CheckpointError);

/// Steps between two looks at the clock.
const GLANCE: usize = 64;

/// The states and events of a row so far, with the bits of their numbers.
#[derive(serde::Serialize, serde::Deserialize)]
struct Saved {
    plan: u64,
    row: usize,
    checkpoint: Checkpoint,
    states: Vec<SavedState>,
    events: Vec<(String, usize, bool, SavedState)>,
}

/// A step, and the bits of the time, the energy, the entropy and the entries.
#[derive(serde::Serialize, serde::Deserialize)]
struct SavedState(usize, [u64; 3], Vec<u64>);

impl LongRow {
    pub(crate) fn new(journal: &Path, plan: u64, interval: Duration) -> Self {
        Self { journal: journal.to_owned(), plan, interval, used: AtomicBool::new(false) }
    }

    /// The file of a row.
    fn place(&self, row: usize) -> Place {
        Place { path: path(&self.journal, row), row, plan: self.plan, interval: self.interval }
    }
}

/// The file of a row: `relax.row-17.checkpoint` beside `relax.journal`.
fn path(journal: &Path, row: usize) -> PathBuf {
    journal.with_extension(format!("row-{row}.checkpoint"))
}

/// The check sum of the checkpoint of a row; 0 if there is none.
pub(crate) fn check_sum(journal: &Path, row: usize) -> u64 {
    fs::read(path(journal, row)).map_or(0, |bytes| of_line(&bytes))
}

/// Refuses checkpoints of rows that belong to another plan, or that were changed.
pub(crate) fn refuse(
    journal: &Path,
    plan: u64,
    rows: [&Vec<usize>; 2],
) -> Result<(), JournalError> {
    let folder = journal.parent().filter(|folder| !folder.as_os_str().is_empty());
    // A folder that cannot be read has the journal in it, which says so.
    let Ok(files) = fs::read_dir(folder.unwrap_or_else(|| Path::new("."))) else { return Ok(()) };
    let stem = journal.file_stem().unwrap_or_default().to_string_lossy().into_owned() + ".row-";
    for file in files.flatten() {
        let name = file.file_name().to_string_lossy().into_owned();
        let row = name.strip_prefix(&stem).and_then(|name| name.strip_suffix(".checkpoint"));
        let Some(Ok(row)) = row.map(str::parse) else { continue };
        if rows.iter().any(|rows| rows.contains(&row)) {
            let (path, interval) = (path(journal, row), Duration::ZERO);
            Place { path, row, plan, interval }.read()?;
        }
    }
    Ok(())
}

impl Place {
    fn failed(&self, problem: impl ToString) -> Error {
        let (path, problem) = (self.path.clone(), problem.to_string());
        FlowError::new(CheckpointError { path, problem }).into()
    }

    fn write(&self, saved: &Saved) -> Result<(), Error> {
        let text = serde_json::to_string(saved).map_err(|error| self.failed(error))?;
        let sum = of_line(text.as_bytes());
        replaced(&self.path, |file| write!(file, "{text}\n#{sum:016x}\n"))
            .map_err(|error| self.failed(error))
    }

    /// The checkpoint of this row, if there is one.
    fn read(&self) -> Result<Option<Saved>, JournalError> {
        let Ok(text) = fs::read_to_string(&self.path) else { return Ok(None) };
        let refused = |changed| {
            let (path, row) = (self.path.clone(), self.row);
            JournalError::Checkpoint { path, row, changed }
        };
        let (json, sum) = text.trim_end().rsplit_once("\n#").ok_or_else(|| refused(true))?;
        if u64::from_str_radix(sum, 16) != Ok(of_line(json.as_bytes())) {
            return Err(refused(true));
        }
        let saved: Saved = serde_json::from_str(json).map_err(|_| refused(true))?;
        let own = (saved.plan, saved.row) == (self.plan, self.row);
        if own { Ok(Some(saved)) } else { Err(refused(false)) }
    }
}

/// Whether a row was put down rather than ended.
pub(crate) fn is_put_down(error: &Error) -> bool {
    matches!(error, Error::Flow(error) if error.downcast_ref::<PutDown>().is_some())
}

impl Row {
    /// Removes the checkpoint of a row that is in the journal.
    pub(crate) fn remove_checkpoint(&self) {
        if let Some(long) = self.long.as_ref().filter(|long| long.used.load(Ordering::Relaxed)) {
            // A short row of this kind has none.
            let _ = fs::remove_file(long.place(self.number()).path);
        }
    }

    /// Runs a row that lasts for hours. Each minute, or as often as
    /// [`Runs::checkpoint_every`](crate::Runs::checkpoint_every) says, it writes a checkpoint beside the journal. A
    /// sweep that is started again goes on from there, with the same bits. Ctrl-C puts such a row down.
    ///
    /// The record has the start, the [outputs](metriplectic_integrators::Watch) and the events that the schedule asks
    /// for, and the last state; not each step. Without a journal there is no checkpoint.
    ///
    /// # Errors
    ///
    /// The errors of [`Method::run`], of resuming, and of the file.
    pub fn run_long<F: Flow, M: Method<F>>(
        &self,
        method: M,
        flow: &F,
        start: Element<F>,
        schedule: impl Into<Schedule>,
    ) -> Result<Record<F::Space>, Error> {
        let schedule = schedule.into();
        let long = self.long.as_ref().map(|long| {
            long.used.store(true, Ordering::Relaxed);
            long.place(self.number())
        });
        let saved = long.as_ref().map_or(Ok(None), Place::read).map_err(FlowError::new)?;
        let (mut steps, mut record) = match saved {
            None => {
                let steps = method.steps(flow, start, schedule)?;
                let record = begun(&steps);
                (steps, record)
            }
            Some(saved) => {
                let steps = method.resume(flow, &saved.checkpoint)?.watching(schedule)?;
                let record = restored(&saved, flow, &steps)?;
                (steps, record)
            }
        };
        let mut written = Instant::now();
        let mut failure = None;
        while steps.ending().is_none() && failure.is_none() {
            failure = steps.advance().err();
            record.states.extend(steps.outputs().cloned());
            record.events.extend(steps.take_events().iter().map(Crossing::of));
            let Some(long) = &long else { continue };
            let asked = interrupt::asked();
            let glance = steps.state().step.is_multiple_of(GLANCE);
            if asked || glance && written.elapsed() >= long.interval {
                if steps.ending().is_none() && failure.is_none() {
                    long.write(&saved_of(long, &steps, &record))?;
                    if asked {
                        return Err(FlowError::new(PutDown).into());
                    }
                }
                written = Instant::now();
            }
        }
        if let Some(cause) = failure {
            // The rest of a run that has failed is its trajectory.
            let trajectory = Box::new(steps.run()?);
            return Err(RunError::Step { cause, trajectory }.into());
        }
        // The states that a run yields in place of its steps end with its last one, which is at the event that stops it.
        let has_last = steps.outputs().next().is_some();
        if !has_last && record.last().step < steps.state().step {
            record.states.push(steps.state().clone());
        }
        record.certificate = steps.certificate().clone();
        record.ending = steps.ending().unwrap_or(record.ending);
        Ok(record)
    }
}

/// The record of a run that begins.
fn begun<F: Flow, M: Method<F>>(steps: &Steps<'_, F, M>) -> Record<F::Space> {
    let ending = metriplectic_integrators::Ending::Stopped;
    let (states, certificate) = (vec![steps.state().clone()], steps.certificate().clone());
    Record { states, events: Vec::new(), certificate, ending }
}

fn saved_of<F: Flow, M: Method<F>>(
    long: &Place,
    steps: &Steps<'_, F, M>,
    record: &Record<F::Space>,
) -> Saved {
    let events = record
        .events
        .iter()
        .map(|event| (event.name.clone(), event.index, event.rises, SavedState::of(&event.state)));
    Saved {
        plan: long.plan,
        row: long.row,
        checkpoint: steps.checkpoint(),
        states: record.states.iter().map(SavedState::of).collect(),
        events: events.collect(),
    }
}

/// The record of a run that goes on.
fn restored<F: Flow, M: Method<F>>(
    saved: &Saved,
    flow: &F,
    steps: &Steps<'_, F, M>,
) -> Result<Record<F::Space>, Error> {
    let state = |saved: &SavedState| saved.state(flow, steps.state());
    let mut record = begun(steps);
    record.states = saved.states.iter().map(state).collect::<Result<_, _>>()?;
    for (name, index, rises, at) in &saved.events {
        let (name, index, rises, state) = (name.clone(), *index, *rises, state(at)?);
        record.events.push(Crossing { name, index, rises, state });
    }
    Ok(record)
}

impl SavedState {
    fn of<M: StateSpace>(state: &State<M>) -> Self {
        let numbers = [state.time, state.energy, state.entropy].map(f64::to_bits);
        let entries = M::numbers(&state.point).into_iter().map(f64::to_bits).collect();
        Self(state.step, numbers, entries)
    }

    fn state<F: Flow>(&self, flow: &F, like: &State<F::Space>) -> Result<State<F::Space>, Error> {
        let Self(step, numbers, entries) = self;
        let entries: Vec<f64> = entries.iter().map(|bits| f64::from_bits(*bits)).collect();
        let mut state = like.clone();
        state.step = *step;
        [state.time, state.energy, state.entropy] = numbers.map(f64::from_bits);
        state.point = flow.element(&entries)?;
        Ok(state)
    }
}
