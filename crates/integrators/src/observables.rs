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

use std::fmt;
use std::io::{self, Seek, SeekFrom, Write};

use metriplectic_dynamics::Metriplectic;
use metriplectic_fields::Space;

use crate::trajectory::State;

/// Named numbers of a state; the time comes first.
pub struct Observables<'a, M: Space> {
    list: Vec<Observable<'a, M>>,
}

/// A name, and what it stands for.
type Observable<'a, M> = (String, Box<dyn Fn(&State<M>) -> f64 + Send + Sync + 'a>);

impl<'a, M: Space> Observables<'a, M> {
    /// The time alone.
    #[must_use]
    pub fn new() -> Self {
        Self { list: vec![("t".to_owned(), Box::new(|state: &State<M>| state.time))] }
    }

    /// The time alone, for runs of this system: the compiler then knows the points of the closures.
    #[must_use]
    pub fn on<Y: Metriplectic<Manifold = M>>(_system: &Y) -> Self {
        Self::new()
    }

    /// One number more, a function of the point.
    #[must_use]
    pub fn of(
        self,
        name: impl Into<String>,
        f: impl Fn(&M::Point<f64>) -> f64 + Send + Sync + 'a,
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
    /// Those of writing to `to`.
    pub fn csv<W: Write>(&self, to: W) -> io::Result<Csv<'_, M, W>> {
        let names: Vec<_> = self.names().map(quoted).collect();
        let mut table = Csv { of: self, to: Some(to), lines: names.join(",") };
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
    /// Those of writing to `to`.
    pub fn npy<W: Write + Seek>(&self, mut to: W) -> io::Result<Npy<'_, M, W>> {
        let origin = to.stream_position()?;
        let mut table = Npy { of: self, to: Some(to), origin, rows: 0, bytes: Vec::new() };
        table.flush()?;
        Ok(table)
    }
}

impl<M: Space> Default for Observables<'_, M> {
    fn default() -> Self {
        Self::new()
    }
}

impl<M: Space> fmt::Debug for Observables<'_, M> {
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
pub struct Csv<'a, M: Space, W: Write> {
    of: &'a Observables<'a, M>,
    /// `None` once the table is finished.
    to: Option<W>,
    lines: String,
}

impl<M: Space, W: Write> Csv<'_, M, W> {
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
        if self.lines.len() < BUFFER { Ok(()) } else { self.flush() }
    }

    /// Writes the rows that are still in memory.
    ///
    /// # Errors
    ///
    /// Those of writing.
    pub fn flush(&mut self) -> io::Result<()> {
        let Some(to) = &mut self.to else { return Ok(()) };
        // Rows that were written in part are not written again.
        let lines = std::mem::take(&mut self.lines);
        to.write_all(lines.as_bytes())?;
        to.flush()
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

impl<M: Space, W: Write> Drop for Csv<'_, M, W> {
    /// Writes what is still in memory; an error is lost, so prefer [`finish`](Self::finish).
    fn drop(&mut self) {
        let _ = self.flush();
    }
}

/// An array of `numpy`; made by [`Observables::npy`].
#[derive(Debug)]
pub struct Npy<'a, M: Space, W: Write + Seek> {
    of: &'a Observables<'a, M>,
    to: Option<W>,
    /// Where the header starts.
    origin: u64,
    rows: usize,
    bytes: Vec<u8>,
}

impl<M: Space, W: Write + Seek> Npy<'_, M, W> {
    /// One row more.
    ///
    /// # Errors
    ///
    /// Those of writing.
    pub fn write(&mut self, state: &State<M>) -> io::Result<()> {
        self.bytes.extend(self.of.row(state).flat_map(f64::to_le_bytes));
        self.rows += 1;
        if self.bytes.len() < BUFFER { Ok(()) } else { self.flush() }
    }

    /// Writes the rows that are still in memory, and then the header that counts them.
    ///
    /// # Errors
    ///
    /// Those of writing.
    pub fn flush(&mut self) -> io::Result<()> {
        let header = header(self.of.names(), self.rows);
        let Some(to) = &mut self.to else { return Ok(()) };
        let bytes = std::mem::take(&mut self.bytes);
        if self.rows > 0 {
            to.seek(SeekFrom::End(0))?;
            to.write_all(&bytes)?;
            to.flush()?;
        }
        to.seek(SeekFrom::Start(self.origin))?;
        to.write_all(&header)?;
        to.seek(SeekFrom::End(0))?;
        to.flush()
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

impl<M: Space, W: Write + Seek> Drop for Npy<'_, M, W> {
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
}
