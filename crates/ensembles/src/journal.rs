//! The file in which each row is kept as soon as it is done.
//!
//! A journal is text. Its first line names the format, the version, the hash of the plan and the columns; each line
//! after it is a row. A line ends in its check sum, so a torn line is no row, and a sweep that is started again runs
//! this row anew. Rows stand in the order in which they finished. Numbers are the hexadecimal digits of their bits,
//! without the zeros at the end.
//!
//! A row that failed may be run again: of its lines the last one counts. A plan that gets more samples gets a line with
//! its number of rows. Rows that are being run stand in another file, see `running.rs`.

mod header;
mod line;

use std::cmp::Reverse;
use std::collections::{HashMap, HashSet};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufRead as _, BufReader, Read, Seek as _, SeekFrom, Write};
use std::path::{Path, PathBuf};

pub(crate) use header::Header;
pub(crate) use line::{encode, same_numbers};

use crate::entry::Entry;
use crate::error::JournalError;

/// A journal that rows are appended to.
#[derive(Debug)]
pub(crate) struct Journal {
    path: PathBuf,
    file: File,
}

/// The content of a journal.
#[derive(Debug)]
pub(crate) struct Content {
    pub(crate) header: Header,
    /// Each row with the text of its numbers, in the order of the file.
    pub(crate) rows: Vec<Entry>,
    /// Lines that are no rows: torn or changed ones.
    pub(crate) damaged: usize,
    /// True if the file has just begun.
    pub(crate) new: bool,
    /// Whether the last line has its end.
    whole: bool,
}

impl Journal {
    /// Opens the journal of a plan, or begins one, and returns the rows that it has.
    pub(crate) fn open(path: &Path, header: &Header) -> Result<(Self, Content), JournalError> {
        let failed = |source| JournalError::Io { path: path.to_owned(), source };
        regular(path)?;
        let mut options = OpenOptions::new();
        let file = options.read(true).append(true).create(true).open(path).map_err(failed)?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => {
                return Err(JournalError::InUse { path: path.to_owned() });
            }
            // Some network file systems have no locks; two processes then run some rows twice.
            Err(TryLockError::Error(_)) | Ok(()) => {}
        }
        let mut journal = Self { path: path.to_owned(), file };
        let file = &mut journal.file;
        if is_begun(file, header).map_err(failed)? {
            let mut content = read(path)?;
            content.header.check(header, path)?;
            if !content.whole {
                // A torn last line gets its end, so that the next row begins on a line of its own.
                file.write_all(b"\n").map_err(failed)?;
            }
            if content.header.rows < header.rows {
                file.write_all(&line::encode_rows(header.rows)).map_err(failed)?;
                content.header.rows = header.rows;
            }
            return Ok((journal, content));
        }
        file.set_len(0).map_err(failed)?;
        file.write_all(header.line().as_bytes()).map_err(failed)?;
        let (header, rows) = (header.clone(), Vec::new());
        let content = Content { header, rows, damaged: 0, new: true, whole: true };
        Ok((journal, content))
    }

    /// Appends the line of a row.
    pub(crate) fn append(&mut self, line: &[u8]) -> Result<(), JournalError> {
        append(&mut self.file, line)
            .map_err(|source| JournalError::Io { path: self.path.clone(), source })
    }

    /// Hands all rows to the disk.
    pub(crate) fn finish(self) -> Result<(), JournalError> {
        let failed = |source| JournalError::Io { path: self.path.clone(), source };
        self.file.sync_data().map_err(failed)
    }
}

impl Drop for Journal {
    /// Releases the lock. Closing the file does not: a process that another thread starts has the file open until it
    /// becomes its program, and the lock would last as long.
    fn drop(&mut self) {
        // A file system without locks refuses this.
        _ = self.file.unlock();
    }
}

/// Appends a line in one write, where the system takes it as a whole.
fn append(to: &mut impl Write, line: &[u8]) -> io::Result<()> {
    to.write_all(line)
}

/// Accepts a path that is a regular file, or nothing yet: a device may be read without end.
fn regular(path: &Path) -> Result<(), JournalError> {
    match path.metadata() {
        Ok(data) if data.is_file() => Ok(()),
        Ok(_) => Err(JournalError::NotAFile { path: path.to_owned() }),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        Err(source) => Err(JournalError::Io { path: path.to_owned(), source }),
    }
}

/// Returns whether a file has more in it than a part of its first line.
fn is_begun(file: &mut File, header: &Header) -> io::Result<bool> {
    let line = header.line();
    let mut start = Vec::new();
    file.seek(SeekFrom::Start(0))?;
    Read::by_ref(file).take(line.len() as u64 + 1).read_to_end(&mut start)?;
    let torn = start.len() < line.len() && line.as_bytes().starts_with(&start);
    Ok(!torn)
}

/// Reads a journal.
pub(crate) fn read(path: &Path) -> Result<Content, JournalError> {
    let failed = |source| JournalError::Io { path: path.to_owned(), source };
    regular(path)?;
    let mut reader = BufReader::new(File::open(path).map_err(failed)?);
    let mut line = Vec::new();
    let mut next = |line: &mut Vec<u8>| {
        line.clear();
        reader.read_until(b'\n', line).map_err(failed)
    };
    next(&mut line)?;
    let header = Header::parse(&line, path)?;
    let (rows, new) = (Vec::new(), false);
    let mut content = Content { header, rows, damaged: 0, new, whole: true };
    while next(&mut line)? > 0 {
        content.whole = line.ends_with(b"\n");
        match line::decode(&line, &content.header) {
            Some(entry) => content.rows.push(entry),
            None => match line::decode_rows(&line) {
                Some(rows) => content.header.rows = content.header.rows.max(rows),
                None => content.damaged += 1,
            },
        }
    }
    settle(&mut content.rows);
    Ok(content)
}

/// Leaves of each row that has failed and was run again the last line.
fn settle(rows: &mut Vec<Entry>) {
    let last: HashMap<usize, usize> =
        rows.iter().enumerate().map(|(at, entry)| (entry.number, at)).collect();
    let mut lines = 0..;
    rows.retain(|entry| {
        let line = lines.next();
        entry.is_done() || line == last.get(&entry.number).copied()
    });
}

/// The rows of some journals of one plan, in the order of their numbers and each once.
///
/// # Errors
///
/// [`JournalError::AnotherSweep`], [`JournalError::Contradiction`], and those of reading.
pub(crate) fn merged(paths: &[PathBuf]) -> Result<Content, JournalError> {
    let contents = paths.iter().map(|path| Ok((path.as_path(), read(path)?)));
    combined(contents.collect::<Result<_, _>>()?)
}

/// Merges journals that have been read.
pub(crate) fn combined(journals: Vec<(&Path, Content)>) -> Result<Content, JournalError> {
    let mut all: Option<Content> = None;
    let mut rows: Vec<(Entry, &Path)> = Vec::new();
    for (path, mut content) in journals {
        rows.extend(std::mem::take(&mut content.rows).into_iter().map(|entry| (entry, path)));
        match &mut all {
            None => all = Some(content),
            Some(first) => {
                content.header.check(&first.header, path)?;
                first.header.rows = first.header.rows.max(content.header.rows);
                first.damaged += content.damaged;
            }
        }
    }
    let mut all = all.ok_or(JournalError::None)?;
    // A row that one process has passed over and another has run is that of the other.
    let run: HashSet<usize> = (rows.iter())
        .filter(|(entry, _)| entry.passed_over().is_none())
        .map(|(entry, _)| entry.number)
        .collect();
    rows.retain(|(entry, _)| entry.passed_over().is_none() || !run.contains(&entry.number));
    rows.sort_by_key(|(entry, _)| (entry.number, Reverse(entry.passed_over())));
    for ((entry, first), (other, second)) in rows.iter().zip(rows.iter().skip(1)) {
        let ran = entry.passed_over().is_none();
        if entry.number == other.number && ran && !same_numbers(entry, other) {
            let (row, first, second) = (entry.number, first.to_path_buf(), second.to_path_buf());
            return Err(JournalError::Contradiction { row, first, second });
        }
    }
    all.rows = rows.into_iter().map(|(entry, _)| entry).collect();
    all.rows.dedup_by_key(|entry| entry.number);
    Ok(all)
}

#[cfg(test)]
mod tests;
