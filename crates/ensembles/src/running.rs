//! The rows that a process is running, in a file beside its journal.
//!
//! `relax.journal.running` has a place of one length for each thread, with the number of its row. A process that ends in any
//! orderly way removes the file. So one that is found tells which rows were run when a process was killed, by an abort of a
//! row or from outside, and a restart passes over them.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use crate::error::JournalError;
use crate::interrupt;

/// The beginning of the file; the number is that of the format.
const FORMAT: &str = "metriplectic-running 1";

/// The bytes of a place: a number of 20 digits, the check sum of a checkpoint, a space, and the end of the line.
const PLACE: usize = 20 + 1 + 16 + 1;

/// A row that was being run, and the check sum of the checkpoint from which it had begun; 0 if it had none.
pub(crate) type InFlight = (usize, u64);

/// The file of a process that runs rows.
#[derive(Debug)]
pub(crate) struct Running {
    path: PathBuf,
    file: Mutex<File>,
    /// The length of the first line.
    first: usize,
}

impl Running {
    /// The file beside a journal.
    fn path(journal: &Path) -> PathBuf {
        let mut name = journal.file_name().unwrap_or_default().to_owned();
        name.push(".running");
        journal.with_file_name(name)
    }

    /// The rows that a process of this plan was running when it was killed.
    pub(crate) fn left(journal: &Path, plan: u64) -> Vec<InFlight> {
        let Ok(text) = fs::read_to_string(Self::path(journal)) else { return Vec::new() };
        let mut lines = text.lines();
        if lines.next() != Some(&head(plan)) {
            return Vec::new();
        }
        let row = |line: &str| {
            let (number, sum) = line.trim().split_once(' ')?;
            Some((number.parse().ok()?, u64::from_str_radix(sum, 16).ok()?))
        };
        lines.filter_map(row).collect()
    }

    /// Begins the file of a process with so many threads.
    pub(crate) fn begin(journal: &Path, plan: u64, threads: usize) -> Result<Self, JournalError> {
        let path = Self::path(journal);
        let failed = |source| JournalError::Io { path: path.clone(), source };
        let first = head(plan) + "\n";
        // With all of its bytes, so that a disk that is full later has room for it.
        let text = first.clone() + &blank().repeat(threads);
        let written = (|| {
            let mut options = OpenOptions::new();
            let mut file = options.write(true).create(true).truncate(true).open(&path)?;
            file.write_all(text.as_bytes())?;
            Ok::<_, io::Error>(file)
        })();
        let file = written.map_err(failed)?;
        interrupt::leaves(&path);
        Ok(Self { path, file: Mutex::new(file), first: first.len() })
    }

    /// Says that a thread begins a row.
    pub(crate) fn row(&self, thread: usize, (number, sum): InFlight) -> Result<(), JournalError> {
        self.write(thread, &format!("{number:>20} {sum:016x}\n"))
    }

    /// Says that the row of a thread is in the journal.
    pub(crate) fn none(&self, thread: usize) -> Result<(), JournalError> {
        self.write(thread, &blank())
    }

    fn write(&self, thread: usize, text: &str) -> Result<(), JournalError> {
        debug_assert_eq!(text.len(), PLACE);
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let place = (self.first + thread * PLACE) as u64;
        let written =
            file.seek(SeekFrom::Start(place)).and_then(|_| file.write_all(text.as_bytes()));
        written.map_err(|source| JournalError::Io { path: self.path.clone(), source })
    }
}

impl Drop for Running {
    /// Removes the file: the process ends in an orderly way.
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.path);
        interrupt::has_left(&self.path);
    }
}

/// The first line, without its end.
fn head(plan: u64) -> String {
    format!("{FORMAT} plan={plan:016x}")
}

/// A place without a row.
fn blank() -> String {
    " ".repeat(PLACE - 1) + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_that_is_killed_leaves_the_numbers_of_its_rows() {
        let journal =
            std::env::temp_dir().join(format!("running-{}.3.journal", std::process::id()));
        assert_eq!(Running::left(&journal, 7), []);
        let running = Running::begin(&journal, 7, 3).unwrap();
        assert_eq!(Running::left(&journal, 7), []);
        running.row(0, (17, 0)).unwrap();
        running.row(2, (usize::MAX, u64::MAX)).unwrap();
        running.row(1, (4, 9)).unwrap();
        assert_eq!(Running::left(&journal, 7), [(17, 0), (4, 9), (usize::MAX, u64::MAX)]);
        assert_eq!(Running::left(&journal, 8), [], "another plan");
        running.none(1).unwrap();
        running.row(0, (18, 0)).unwrap();
        assert_eq!(Running::left(&journal, 7), [(18, 0), (usize::MAX, u64::MAX)]);
        drop(running);
        assert_eq!(Running::left(&journal, 7), []);
    }
}
