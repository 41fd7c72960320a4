//! Arrays of `numpy`.

use std::io::{self, Seek, SeekFrom, Write};

use super::{BUFFER, Observables, ObservablesError};
use crate::run::state::State;
use crate::step::StateSpace;

/// An array of `numpy`; made by [`Observables::npy`].
#[derive(Debug)]
pub struct Npy<'a, M: StateSpace, W: Write + Seek> {
    pub(super) of: &'a Observables<'a, M>,
    pub(super) to: Option<W>,
    /// Where the header starts.
    pub(super) origin: u64,
    /// The rows in the file, all of which its header counts.
    pub(super) rows: usize,
    /// The rows that have not been written.
    pub(super) bytes: Vec<u8>,
}

impl<M: StateSpace, W: Write + Seek> Npy<'_, M, W> {
    /// One row more.
    ///
    /// # Errors
    ///
    /// The errors of writing.
    pub fn write(&mut self, state: &State<M>) -> io::Result<()> {
        self.bytes.extend(self.of.row(state).flat_map(f64::to_le_bytes));
        if self.bytes.len() < BUFFER { Ok(()) } else { self.flush() }
    }

    /// Writes the rows that are still in memory, and then the header that counts them.
    ///
    /// # Errors
    ///
    /// The errors of writing.
    pub fn flush(&mut self) -> io::Result<()> {
        let (origin, rows, row) = (self.origin, self.rows, 8 * self.of.list.len());
        let Some(to) = &mut self.to else { return Ok(()) };
        let all = rows + self.bytes.len() / row;
        let header = npy_header(self.of.names(), all);
        // The rows first, over what an earlier call has written in part, then the header that counts them.
        let mut append = || {
            if all > rows {
                let end = origin + header.len() as u64 + (rows * row) as u64;
                to.seek(SeekFrom::Start(end))?;
                to.write_all(&self.bytes)?;
                to.flush()?;
            }
            to.seek(SeekFrom::Start(origin))?;
            to.write_all(&header)?;
            to.seek(SeekFrom::End(0))?;
            to.flush()
        };
        append().map_err(|source| ObservablesError::Write { rows, source })?;
        self.bytes.clear();
        self.rows = all;
        Ok(())
    }

    /// Writes the rows that are still in memory, and gives back what was written to.
    ///
    /// # Errors
    ///
    /// The errors of writing.
    pub fn finish(mut self) -> io::Result<W> {
        self.flush()?;
        self.to.take().ok_or_else(|| io::Error::other("the table was finished before"))
    }
}

impl<M: StateSpace, W: Write + Seek> Drop for Npy<'_, M, W> {
    /// Writes what is still in memory; an error is lost, so prefer [`finish`](Self::finish).
    fn drop(&mut self) {
        let _ = self.flush();
    }
}

/// The header of an array of `numpy` with named `<f8` columns and so many rows, before the bytes of its numbers: as long
/// for any number of rows, and a multiple of 64 bytes.
#[must_use]
pub fn npy_header<'a>(names: impl Iterator<Item = &'a str>, rows: usize) -> Vec<u8> {
    let columns: Vec<_> = names.map(|name| format!("('{}', '<f8')", escaped(name))).collect();
    let columns = columns.join(", ");
    let dictionary =
        |rows| format!("{{'descr': [{columns}], 'fortran_order': False, 'shape': ({rows},), }}");
    let (text, longest) = (dictionary(rows), dictionary(usize::MAX).len());
    let plain = text.is_ascii() && longest < usize::from(u16::MAX) - 64;
    let before = if plain { 10 } else { 12 };
    let total = (before + longest + 1).next_multiple_of(64);
    let mut bytes = b"\x93NUMPY".to_vec();
    if plain {
        bytes.extend([1, 0]);
        bytes.extend(&((total - before) as u64).to_le_bytes()[..2]);
    } else {
        bytes.extend([3, 0]);
        bytes.extend(&((total - before) as u64).to_le_bytes()[..4]);
    }
    bytes.extend(text.as_bytes());
    bytes.resize(total - 1, b' ');
    bytes.push(b'\n');
    bytes
}

/// A name within quotes of Python.
fn escaped(name: &str) -> String {
    name.replace('\\', "\\\\").replace('\'', "\\'").replace('\n', "\\n").replace('\r', "\\r")
}
