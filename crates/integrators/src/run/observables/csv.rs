//! Tables of comma-separated values.

use std::fmt;
use std::io::{self, Write};

use super::{BUFFER, Observables, ObservablesError};
use crate::run::state::State;
use crate::step::StateSpace;

/// A table of comma-separated values; made by [`Observables::csv`].
#[derive(Debug)]
pub struct Csv<'a, M: StateSpace, W: Write> {
    pub(super) of: &'a Observables<'a, M>,
    /// `None` once the table is finished.
    pub(super) to: Option<W>,
    /// Text that is not yet written; it begins in the middle of a line if writing has failed there.
    pub(super) lines: String,
    /// The rows that were given to it.
    pub(super) rows: usize,
    /// The rows that are in the file: it has been flushed since.
    pub(super) confirmed: usize,
}

impl<M: StateSpace, W: Write> Csv<'_, M, W> {
    /// One row more.
    ///
    /// # Errors
    ///
    /// The errors of writing.
    pub fn write(&mut self, state: &State<M>) -> io::Result<()> {
        for (index, x) in self.of.row(state).enumerate() {
            let comma = if index == 0 { "" } else { "," };
            fmt::Write::write_fmt(&mut self.lines, format_args!("{comma}{x:?}"))
                .map_err(io::Error::other)?;
        }
        self.lines.push('\n');
        self.rows += 1;
        if self.lines.len() < BUFFER { Ok(()) } else { self.flush() }
    }

    /// Writes the rows that are still in memory.
    ///
    /// # Errors
    ///
    /// The errors of writing.
    pub fn flush(&mut self) -> io::Result<()> {
        let Some(to) = &mut self.to else { return Ok(()) };
        // No byte is written twice, and none is left out.
        let (written, result) = write(to, self.lines.as_bytes());
        self.lines.drain(..written);
        // A buffer takes bytes that its disk then refuses.
        let flushed = to.flush();
        if flushed.is_ok() {
            let left = self.lines.bytes().filter(|&byte| byte == b'\n').count();
            self.confirmed = self.rows.saturating_sub(left);
        }
        result
            .and(flushed)
            .map_err(|source| ObservablesError::Write { rows: self.confirmed, source }.into())
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

impl<M: StateSpace, W: Write> Drop for Csv<'_, M, W> {
    /// Writes what is still in memory; an error is lost, so prefer [`finish`](Self::finish).
    fn drop(&mut self) {
        let _ = self.flush();
    }
}

/// Writes as much as there is room for, and says how many bytes that are: `write_all` does not.
fn write(to: &mut impl Write, bytes: &[u8]) -> (usize, io::Result<()>) {
    let mut written = 0;
    while written < bytes.len() {
        match to.write(&bytes[written..]) {
            Ok(0) => return (written, Err(io::ErrorKind::WriteZero.into())),
            Ok(more) => written += more,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return (written, Err(error)),
        }
    }
    (written, Ok(()))
}

/// A cell of text as RFC 4180 wants it: within quotes if it has a comma, a quote or a line break.
#[must_use]
pub fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.into()
    }
}
