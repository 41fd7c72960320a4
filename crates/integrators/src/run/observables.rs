//! Named numbers of a state, recorded along with it and streamed to a file.
//!
//! A run of a hundred million steps leaves no room for its states. What is wanted of it are some
//! numbers every now and then, and these go to a file as they come:
//!
//! ```
//! use metriplectic_dynamics::System;
//! use metriplectic_fields::Real;
//! use metriplectic_integrators::{Observables, Run, Span};
//! use metriplectic_manifolds::{LieDual, WeylMidpoint};
//! use nalgebra::Vector3;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let body = System::on(LieDual::so3())
//!     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
//!     .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
//!     .build()?;
//! let watch = Observables::on(&body)
//!     .of("p1", |p| p.x)
//!     .of("|p|", |p| p.norm())
//!     .of_state("S", |state| state.entropy);
//! # let file = Vec::new();
//! // let file = File::create("body.csv")?;
//! let mut table = watch.csv(file)?;
//! let mut steps = WeylMidpoint.steps(&body, Vector3::new(0.4, 0.5, 0.3), Span::steps(0.1, 20))?;
//! table.write(steps.state())?;
//! for state in &mut steps {
//!     table.write(&state?)?;
//! }
//! let file = table.finish()?;
//! println!("{}", steps.certificate());
//! # let text = String::from_utf8(file)?;
//! # assert!(text.starts_with("t,p1,|p|,S\n0.0,0.4,0.7071067811865476,0.25\n0.1,"));
//! # assert_eq!(text.lines().count(), 22);
//! # Ok(())
//! # }
//! ```
//!
//! Two formats are written here, with the standard library alone: CSV, whose digits give back the same
//! numbers, and NPY, which `numpy` reads as an array with named columns.
//! In both the file holds whole rows whenever something is written to it, and what is still in
//! memory is written when the table is finished or dropped: a run that is interrupted leaves a file
//! that can be read. The first column is always the time.
//!
//! If the disk is full, the error says how many rows are in the file as a whole ([`TableError`]). What
//! could not be written stays in memory, and the next call goes on where this one ended: once there is room,
//! the file is the one that it would have been. Until then an array has the rows that its header counts, and
//! a table of comma-separated values may end in a cut line, which has no line break.

use std::fmt;
use std::io::{self, Seek, SeekFrom, Write};

use crate::method::{Flow, StateSpace};
use crate::run::trajectory::State;

/// A table that cannot be written; the source of an [`io::Error`] of this module.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TableError {
    /// Two columns have one name, and no reader could tell them apart.
    #[error("two columns have the name {name:?}; the time has the name \"t\" already")]
    SameName {
        /// The name.
        name: String,
    },
    /// Writing has failed; what was not written is kept for the next call.
    #[error("{source}; {rows} rows are in the file as a whole, and the others are kept in memory")]
    Write {
        /// The rows that are in the file as a whole.
        rows: usize,
        /// What has failed.
        source: io::Error,
    },
}

impl From<TableError> for io::Error {
    fn from(error: TableError) -> Self {
        let kind = match &error {
            TableError::SameName { .. } => io::ErrorKind::InvalidInput,
            TableError::Write { source, .. } => source.kind(),
        };
        Self::new(kind, error)
    }
}

/// Named numbers of a state; the time comes first.
pub struct Observables<'a, M: StateSpace> {
    list: Vec<Observable<'a, M>>,
}

/// A name, and what it stands for.
type Observable<'a, M> = (String, Box<dyn Fn(&State<M>) -> f64 + Send + Sync + 'a>);

impl<'a, M: StateSpace> Observables<'a, M> {
    /// The time alone.
    #[must_use]
    pub fn new() -> Self {
        Self { list: vec![("t".to_owned(), Box::new(|state: &State<M>| state.time))] }
    }

    /// The time alone, for runs of this system: the compiler then knows the points of the closures.
    #[must_use]
    pub fn on<F: Flow<Space = M>>(_flow: &F) -> Self {
        Self::new()
    }

    /// One number more, a function of the point.
    #[must_use]
    pub fn of(
        self,
        name: impl Into<String>,
        f: impl Fn(&M::Element) -> f64 + Send + Sync + 'a,
    ) -> Self {
        self.of_state(name, move |state| f(&state.point))
    }

    /// One number more, a function of the state: its energy, its entropy.
    #[must_use]
    pub fn of_state(
        mut self,
        name: impl Into<String>,
        f: impl Fn(&State<M>) -> f64 + Send + Sync + 'a,
    ) -> Self {
        self.list.push((name.into(), Box::new(f)));
        self
    }

    /// The names of the columns.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.list.iter().map(|(name, _)| name.as_str())
    }

    /// The numbers of a state, in the order of the names.
    pub fn row(&self, state: &State<M>) -> impl Iterator<Item = f64> {
        self.list.iter().map(move |(_, f)| f(state))
    }

    /// A table of comma-separated values (RFC 4180) under a line of names. A number read back is the
    /// number written, to the last bit: it has the digits that tell it from its neighbours.
    ///
    /// # Errors
    ///
    /// [`TableError`]: two columns of one name, and those of writing to `to`.
    pub fn csv<W: Write>(&self, to: W) -> io::Result<Csv<'_, M, W>> {
        self.check_names()?;
        let names: Vec<_> = self.names().map(quoted).collect();
        let mut table = Csv { of: self, to: Some(to), lines: names.join(","), rows: 0 };
        table.lines.push('\n');
        table.flush()?;
        Ok(table)
    }

    /// An array of `numpy` with one named `<f8` column for each number (format version 1.0, or 3.0 for
    /// names that are not ASCII): `numpy.load(path)["t"]`.
    ///
    /// The number of rows in the header is brought up to date whenever rows are written, hence
    /// the [`Seek`].
    ///
    /// # Errors
    ///
    /// [`TableError`]: two columns of one name, and those of writing to `to`.
    pub fn npy<W: Write + Seek>(&self, mut to: W) -> io::Result<Npy<'_, M, W>> {
        self.check_names()?;
        let origin = to.stream_position()?;
        let mut table = Npy { of: self, to: Some(to), origin, rows: 0, bytes: Vec::new() };
        table.flush()?;
        Ok(table)
    }

    fn check_names(&self) -> Result<(), TableError> {
        for (index, name) in self.names().enumerate() {
            if self.names().take(index).any(|before| before == name) {
                return Err(TableError::SameName { name: name.to_owned() });
            }
        }
        Ok(())
    }
}

impl<M: StateSpace> Default for Observables<'_, M> {
    fn default() -> Self {
        Self::new()
    }
}

impl<M: StateSpace> fmt::Debug for Observables<'_, M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.names()).finish()
    }
}

/// A name as RFC 4180 wants it.
fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.into()
    }
}

/// The bytes that are collected before they are written.
const BUFFER: usize = 1 << 16;

/// A table of comma-separated values; made by [`Observables::csv`].
#[derive(Debug)]
pub struct Csv<'a, M: StateSpace, W: Write> {
    of: &'a Observables<'a, M>,
    /// `None` once the table is finished.
    to: Option<W>,
    /// What has not been written; it begins in the middle of a line if writing has failed there.
    lines: String,
    /// The rows that were given to it.
    rows: usize,
}

impl<M: StateSpace, W: Write> Csv<'_, M, W> {
    /// One row more.
    ///
    /// # Errors
    ///
    /// Those of writing.
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
    /// Those of writing.
    pub fn flush(&mut self) -> io::Result<()> {
        let Some(to) = &mut self.to else { return Ok(()) };
        // No byte is written twice, and none is left out.
        let (written, result) = write(to, self.lines.as_bytes());
        self.lines.drain(..written);
        result.and_then(|()| to.flush()).map_err(|source| {
            let left = self.lines.bytes().filter(|&byte| byte == b'\n').count();
            TableError::Write { rows: self.rows.saturating_sub(left), source }.into()
        })
    }

    /// Writes the rows that are still in memory, and gives back what was written to.
    ///
    /// # Errors
    ///
    /// Those of writing.
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

/// An array of `numpy`; made by [`Observables::npy`].
#[derive(Debug)]
pub struct Npy<'a, M: StateSpace, W: Write + Seek> {
    of: &'a Observables<'a, M>,
    to: Option<W>,
    /// Where the header starts.
    origin: u64,
    /// The rows in the file, all of which its header counts.
    rows: usize,
    /// The rows that have not been written.
    bytes: Vec<u8>,
}

impl<M: StateSpace, W: Write + Seek> Npy<'_, M, W> {
    /// One row more.
    ///
    /// # Errors
    ///
    /// Those of writing.
    pub fn write(&mut self, state: &State<M>) -> io::Result<()> {
        self.bytes.extend(self.of.row(state).flat_map(f64::to_le_bytes));
        if self.bytes.len() < BUFFER { Ok(()) } else { self.flush() }
    }

    /// Writes the rows that are still in memory, and then the header that counts them.
    ///
    /// # Errors
    ///
    /// Those of writing.
    pub fn flush(&mut self) -> io::Result<()> {
        let (origin, rows, row) = (self.origin, self.rows, 8 * self.of.list.len());
        let Some(to) = &mut self.to else { return Ok(()) };
        let all = rows + self.bytes.len() / row;
        let header = header(self.of.names(), all);
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
        append().map_err(|source| TableError::Write { rows, source })?;
        self.bytes.clear();
        self.rows = all;
        Ok(())
    }

    /// Writes the rows that are still in memory, and gives back what was written to.
    ///
    /// # Errors
    ///
    /// Those of writing.
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

/// The header of an array with so many rows: as long for any number of rows, and a multiple of 64
/// bytes.
fn header<'a>(names: impl Iterator<Item = &'a str>, rows: usize) -> Vec<u8> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use metriplectic_manifolds::Euclidean;
    use nalgebra::Vector1;

    type Line = Euclidean<1>;

    fn state(step: usize, x: f64) -> State<Line> {
        let point = Vector1::new(x);
        State { step, time: step as f64, point, energy: 0.0, entropy: -x }
    }

    const NUMBERS: [f64; 7] =
        [0.1 + 0.2, f64::MIN_POSITIVE, -0.0, 1e300 / 3.0, 5e-324, f64::INFINITY, f64::NAN];

    #[test]
    fn numbers_survive_a_csv() {
        let watch = Observables::<Line>::new()
            .of("x, \"x\"", |x: &Vector1<f64>| x.x)
            .of_state("S", |state| state.entropy);
        let mut table = watch.csv(Vec::new()).unwrap();
        for (step, x) in NUMBERS.into_iter().enumerate() {
            table.write(&state(step, x)).unwrap();
        }
        let text = String::from_utf8(table.finish().unwrap()).unwrap();
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some("t,\"x, \"\"x\"\"\",S"));
        for (step, x) in NUMBERS.into_iter().enumerate() {
            let row: Vec<f64> =
                lines.next().unwrap().split(',').map(|x| x.parse().unwrap()).collect();
            assert_eq!(row[0].to_bits(), (step as f64).to_bits());
            assert!(
                row[1].to_bits() == x.to_bits() && row[2].to_bits() == (-x).to_bits() || x.is_nan()
            );
        }
        assert_eq!(lines.next(), None);
    }

    /// The header and the numbers of an array, read by the description of the format
    /// (numpy.lib.format).
    fn read(bytes: &[u8]) -> (String, Vec<f64>) {
        assert_eq!(&bytes[..6], b"\x93NUMPY");
        let (start, len) = match bytes[6] {
            1 => (10, usize::from(u16::from_le_bytes([bytes[8], bytes[9]]))),
            3 => (12, u32::from_le_bytes([bytes[8], bytes[9], bytes[10], bytes[11]]) as usize),
            other => panic!("version {other}"),
        };
        assert_eq!((start + len) % 64, 0);
        let header = String::from_utf8(bytes[start..start + len].to_vec()).unwrap();
        let numbers = bytes[start + len..].chunks(8);
        (header, numbers.map(|x| f64::from_le_bytes(x.try_into().unwrap())).collect())
    }

    #[test]
    fn an_array_counts_its_rows() {
        for (name, python, version) in [("it's", "it\\'s", 1), ("ω", "ω", 3)] {
            let watch = Observables::<Line>::new().of(name, |x: &Vector1<f64>| x.x);
            let mut table = watch.npy(io::Cursor::new(Vec::new())).unwrap();
            for (step, x) in NUMBERS.into_iter().enumerate() {
                table.write(&state(step, x)).unwrap();
                if step == 2 {
                    table.flush().unwrap();
                }
            }
            let bytes = table.finish().unwrap().into_inner();
            assert_eq!(bytes[6], version);
            let (header, numbers) = read(&bytes);
            let expected = format!(
                "{{'descr': [('t', '<f8'), ('{python}', '<f8')], 'fortran_order': False, \
                 'shape': (7,), }}"
            );
            assert_eq!(header.trim_end(), expected);
            assert!(header.ends_with('\n'));
            let xs: Vec<_> = numbers.iter().skip(1).step_by(2).map(|x| x.to_bits()).collect();
            assert_eq!(xs, NUMBERS.map(f64::to_bits));
        }
    }

    /// A writer that shares what it has been given.
    #[derive(Clone, Default)]
    struct Shared(std::rc::Rc<std::cell::RefCell<Vec<u8>>>);

    impl Write for Shared {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.borrow_mut().write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn what_is_written_are_whole_rows_at_any_time() {
        let (file, watch) = (Shared::default(), Observables::<Line>::new().of("x", |x| x.x));
        let mut table = watch.csv(file.clone()).unwrap();
        assert_eq!(*file.0.borrow(), b"t,x\n");
        let (mut longest, mut writes) = (0, 0);
        for step in 0..20_000 {
            table.write(&state(step, 0.1 * step as f64)).unwrap();
            let len = file.0.borrow().len();
            assert_eq!(file.0.borrow().last(), Some(&b'\n'));
            (longest, writes) = (len, writes + usize::from(len > longest));
        }
        assert!(writes > 2 && writes < 20, "{writes}");
        drop(table);
        assert_eq!(file.0.borrow().iter().filter(|&&byte| byte == b'\n').count(), 20_001);
    }

    /// A disk with room for so many bytes.
    #[derive(Debug, Default)]
    struct Disk {
        file: io::Cursor<Vec<u8>>,
        room: usize,
    }

    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let at = usize::try_from(self.file.position()).unwrap_or(usize::MAX);
            let left = self.room.saturating_sub(at);
            match left.min(bytes.len()) {
                0 if !bytes.is_empty() => Err(io::ErrorKind::StorageFull.into()),
                some => self.file.write(&bytes[..some]),
            }
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Seek for Disk {
        fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
            self.file.seek(to)
        }
    }

    /// How many rows an error says are in the file.
    fn rows_of(error: &io::Error) -> usize {
        assert_eq!(error.kind(), io::ErrorKind::StorageFull, "{error}");
        match error.get_ref().and_then(|source| source.downcast_ref()) {
            Some(TableError::Write { rows, .. }) => *rows,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_full_disk_leaves_rows_that_can_be_read_and_room_to_go_on() {
        let watch = Observables::<Line>::new().of("x", |x: &Vector1<f64>| x.x);
        let whole = |rows: usize| {
            let mut csv = watch.csv(Vec::new()).unwrap();
            let mut npy = watch.npy(io::Cursor::new(Vec::new())).unwrap();
            for step in 0..rows {
                csv.write(&state(step, 0.1 * step as f64)).unwrap();
                npy.write(&state(step, 0.1 * step as f64)).unwrap();
            }
            (csv.finish().unwrap(), npy.finish().unwrap().into_inner())
        };
        let (lines, array) = whole(20);
        for room in 0..array.len() {
            let mut table = match watch.npy(Disk { room, ..Disk::default() }) {
                Ok(table) => table,
                Err(error) => {
                    assert!(rows_of(&error) == 0 && room < 128, "{error}");
                    continue;
                }
            };
            for step in 0..20 {
                table.write(&state(step, 0.1 * step as f64)).unwrap();
                if step % 7 == 6 {
                    let _ = table.flush();
                }
            }
            let error = table.flush().unwrap_err();
            let rows = rows_of(&error);
            let there = table.to.as_ref().unwrap().file.get_ref();
            let (header, numbers) = read(&there[..128 + 16 * rows]);
            assert!(header.contains(&format!("'shape': ({rows},)")), "{header}");
            assert_eq!(numbers.len(), 2 * rows);
            assert_eq!(there[128..128 + 16 * rows], array[128..128 + 16 * rows]);
            // Somebody makes room.
            table.to.as_mut().unwrap().room = usize::MAX;
            assert!(*table.finish().unwrap().file.get_ref() == array, "{room}");
        }
        for room in 0..lines.len() {
            let Ok(mut table) = watch.csv(Disk { room, ..Disk::default() }) else {
                assert!(room < 4);
                continue;
            };
            for step in 0..20 {
                table.write(&state(step, 0.1 * step as f64)).unwrap();
                if step % 7 == 6 {
                    let _ = table.flush();
                }
            }
            let rows = rows_of(&table.flush().unwrap_err());
            let there = table.to.as_ref().unwrap().file.get_ref();
            assert_eq!(*there, lines[..room]);
            assert_eq!(there.iter().filter(|&&byte| byte == b'\n').count(), rows + 1);
            table.to.as_mut().unwrap().room = usize::MAX;
            assert!(*table.finish().unwrap().file.get_ref() == lines, "{room}");
        }
    }

    #[test]
    fn two_columns_of_one_name_are_refused() {
        let twice = Observables::<Line>::new().of("x", |x| x.x).of_state("x", |s| s.entropy);
        let time = Observables::<Line>::new().of("t", |x: &Vector1<f64>| x.x);
        for (watch, name) in [(twice, "x"), (time, "t")] {
            let csv = watch.csv(Vec::new()).map(|_| ()).unwrap_err();
            let npy = watch.npy(io::Cursor::new(Vec::new())).map(|_| ()).unwrap_err();
            for error in [csv, npy] {
                assert_eq!(error.kind(), io::ErrorKind::InvalidInput);
                let source = error.get_ref().and_then(|source| source.downcast_ref());
                assert!(
                    matches!(source, Some(TableError::SameName { name: other }) if other == name)
                );
            }
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_device_without_room_is_an_error() {
        let watch = Observables::<Line>::new().of("x", |x: &Vector1<f64>| x.x);
        let full = || std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        assert_eq!(rows_of(&watch.csv(full()).unwrap_err()), 0);
        assert_eq!(rows_of(&watch.npy(full()).unwrap_err()), 0);
    }
}
