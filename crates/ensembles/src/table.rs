//! The table of a sweep: all of its rows in the order of their numbers.

mod columns;
mod files;
mod summary;
mod time;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::entry::{Entry, RowStatus};
use crate::error::{JournalError, TableError};
use crate::figures::FIGURES;
use crate::journal::{Header, merged};
use crate::shard::of_shard;

pub use time::Series;

/// The rows of a sweep. Its numbers do not depend on threads, shards, or how often the sweep was put down.
///
/// | column | of a row |
/// |---|---|
/// | `row` | the number |
/// | the parameters | by their names |
/// | `outcome` | `span`, `rest`, `event` or `stopped` for how it ended; the kind of the error if it failed; `killed` if it was [passed over](RowStatus::PassedOver) |
/// | `run.t` | the time reached |
/// | `run.steps`, `run.rejected` | steps taken, and given up |
/// | `run.energy_error` | `max abs(H − H₀)`, relative to the size of the terms of `H` |
/// | `run.entropy_increment`, `run.entropy_gained` | the least `ΔS` of a step, and that of the run |
/// | `run.entropy_slope` | the least size of the discrete gradient of the entropy; infinite without one |
/// | `run.manifold_defect` | the largest defect of the manifold |
/// | `run.friction`, `run.stiff` | the largest rate `h abs(K')`; 1 if a step does not damp it |
/// | `run.local_error`, `run.resolved` | the largest error of a step; 1 if no step is known to be too long |
/// | `run.kept` | 1 if all laws that the method promises were kept to round-off |
/// | `end.0`, `end.1`, … | the entries of the last state |
/// | what was measured and observed | by their names; the last value of what was observed |
/// | `error` | the sentence of the error |
#[derive(Clone, Debug)]
pub struct Table {
    header: Header,
    /// In the order of their numbers, each once.
    entries: Vec<Entry>,
    damaged: usize,
}

/// A row of a table.
#[derive(Clone, Copy, Debug)]
pub struct TableRow<'a> {
    header: &'a Header,
    entry: &'a Entry,
}

impl Table {
    pub(crate) fn new(header: Header, mut entries: Vec<Entry>, damaged: usize) -> Self {
        // Of a row that was run again the last outcome counts.
        entries.reverse();
        entries.sort_by_key(|entry| entry.number);
        entries.dedup_by_key(|entry| entry.number);
        Self { header, entries, damaged }
    }

    /// Puts journals of one sweep together: those of its shards, on any machines.
    ///
    /// Rows that are in none of them are [missing](Self::missing), and [`complete`](Self::complete) insists on all.
    ///
    /// # Errors
    ///
    /// [`JournalError::AnotherSweep`] if they have different plans, [`JournalError::Contradiction`] if two of them have
    /// different numbers for a row.
    pub fn merge<P: AsRef<Path>>(
        journals: impl IntoIterator<Item = P>,
    ) -> Result<Self, JournalError> {
        let paths: Vec<PathBuf> = journals.into_iter().map(|p| p.as_ref().to_owned()).collect();
        let content = merged(&paths)?;
        Ok(Self::new(content.header, content.rows, content.damaged))
    }

    /// Lists the journals of a path: that of a sweep in one process, and those of all shards beside it.
    ///
    /// # Errors
    ///
    /// [`JournalError::None`] if there is none, and [`JournalError::Io`] if the folder cannot be read.
    pub fn journals(path: impl AsRef<Path>) -> Result<Vec<PathBuf>, JournalError> {
        let path = path.as_ref();
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let failed = |source: io::Error| JournalError::Io { path: folder.to_owned(), source };
        let marker = of_shard(path, 0).file_name().map(|name| name.to_string_lossy().into_owned());
        let marker = marker.unwrap_or_default();
        let ending =
            path.extension().map_or(String::new(), |e| format!(".{}", e.to_string_lossy()));
        let stem = marker.strip_suffix(&format!("0{ending}")).unwrap_or(&marker);
        let mut found: Vec<(Option<usize>, PathBuf)> = Vec::new();
        if path.is_file() {
            found.push((None, path.to_owned()));
        }
        for entry in fs::read_dir(folder).map_err(failed)? {
            let name = entry.map_err(failed)?.file_name().to_string_lossy().into_owned();
            let index = name.strip_prefix(stem).and_then(|name| name.strip_suffix(&ending));
            if let Some(Ok(index)) = index.map(str::parse) {
                found.push((Some(index), path.with_file_name(name)));
            }
        }
        found.sort();
        if found.is_empty() {
            return Err(JournalError::None);
        }
        Ok(found.into_iter().map(|(_, path)| path).collect())
    }

    /// The name of the sweep.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.header.name
    }

    /// The number of rows in the table, done or not.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether it has no rows.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// The number of rows of the plan.
    #[must_use]
    pub const fn planned(&self) -> usize {
        self.header.rows
    }

    /// The number of rows that failed or were passed over.
    #[must_use]
    pub fn failed(&self) -> usize {
        self.entries.iter().filter(|entry| !entry.is_done()).count()
    }

    /// The numbers of the rows that were being run when a process was killed, so that the next one has
    /// [passed over](RowStatus::PassedOver) them.
    #[must_use]
    pub fn passed_over(&self) -> Vec<usize> {
        let passed = |entry: &&Entry| entry.passed_over().is_some();
        self.entries.iter().filter(passed).map(|entry| entry.number).collect()
    }

    /// The lines of the journals that were no whole rows: torn by a kill, for example. Their rows are run anew.
    #[must_use]
    pub const fn damaged_lines(&self) -> usize {
        self.damaged
    }

    /// The numbers of the rows of the plan that are not in the table.
    #[must_use]
    pub fn missing(&self) -> Vec<usize> {
        let mut known = self.entries.iter().map(|entry| entry.number).peekable();
        (0..self.header.rows).filter(|row| known.next_if_eq(row).is_none()).collect()
    }

    /// The table, if it has all rows of the plan.
    ///
    /// # Errors
    ///
    /// [`TableError::Missing`] with the rows that it does not have.
    pub fn complete(self) -> Result<Self, TableError> {
        let rows = self.missing();
        if rows.is_empty() { Ok(self) } else { Err(TableError::Missing { rows }) }
    }

    /// The rows in the order of their numbers.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = TableRow<'_>> {
        self.entries.iter().map(|entry| TableRow { header: &self.header, entry })
    }

    /// The row of a number, if the table has it.
    #[must_use]
    pub fn row(&self, number: usize) -> Option<TableRow<'_>> {
        let at = self.entries.binary_search_by_key(&number, |entry| entry.number).ok()?;
        Some(TableRow { header: &self.header, entry: &self.entries[at] })
    }

    /// The wall time of all rows in seconds, which differs from one execution to the next.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.entries.iter().map(|entry| entry.seconds).sum()
    }
}

impl<'a> TableRow<'a> {
    /// The number of the row.
    #[must_use]
    pub const fn number(&self) -> usize {
        self.entry.number
    }

    /// The parameters in the order of the plan.
    #[must_use]
    pub fn parameters(&self) -> &'a [f64] {
        &self.entry.parameters
    }

    /// The outcome of the row.
    #[must_use]
    pub const fn status(&self) -> RowStatus {
        self.entry.status()
    }

    /// The kind of the error in a word and its sentence, if the row failed. That of a row that was passed over is `killed`.
    #[must_use]
    pub fn error(&self) -> Option<(&'a str, &'a str)> {
        self.entry.error()
    }

    /// The entries of the last state; none in a row that failed.
    #[must_use]
    pub fn end(&self) -> &'a [f64] {
        self.entry.done().map_or(&[], |done| &done.end)
    }

    /// The wall time in seconds, which differs from one execution to the next.
    #[must_use]
    pub const fn seconds(&self) -> f64 {
        self.entry.seconds
    }

    /// An observable, with the times of the states; `None` if the row failed or there is no such name.
    pub fn series(&self, name: &str) -> Option<impl Iterator<Item = (f64, f64)> + use<'a>> {
        let column = self.header.observables.iter().position(|other| other == name)?;
        let done = self.entry.done()?;
        let n = done.times.len();
        let values = &done.series[column * n..(column + 1) * n];
        Some(done.times.iter().copied().zip(values.iter().copied()))
    }

    /// The number of a column; `None` if the row does not have it.
    #[must_use]
    pub fn get(&self, column: &str) -> Option<f64> {
        let Self { header, entry } = *self;
        let at = |names: &[String]| names.iter().position(|name| name == column);
        if column == "row" {
            return Some(entry.number as f64);
        }
        if column == "failed" {
            return Some(f64::from(u8::from(!entry.is_done())));
        }
        if let Some(k) = at(&header.parameters) {
            return Some(entry.parameters[k]);
        }
        if let Some(k) = FIGURES.iter().position(|name| *name == column) {
            let figures = match (entry.done(), entry.failed()) {
                (Some(done), _) => Some(&done.figures),
                (_, Some(failed)) => failed.figures.as_ref(),
                _ => None,
            };
            return figures.map(|figures| figures[k]);
        }
        let done = entry.done()?;
        if let Some(k) = column.strip_prefix("end.") {
            return done.end.get(k.parse::<usize>().ok()?).copied();
        }
        if let Some(k) = at(&header.measures) {
            return Some(done.measures[k]);
        }
        let (k, n) = (at(&header.observables)?, done.times.len());
        done.series.get(((k + 1) * n).checked_sub(1)?).copied()
    }
}
