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
//! If the disk is full, the error says how many rows are in the file as a whole ([`ObservablesError`]). Behind a buffer,
//! such as a `BufWriter`, there may be more of them. What
//! could not be written stays in memory, and the next call goes on where this one ended: once there is room,
//! the file is the one that it would have been. Until then an array has the rows that its header counts, and
//! a table of comma-separated values may end in a cut line, which has no line break.

mod csv;
mod npy;

use std::fmt;
use std::io::{self, Seek, Write};
use std::path::Path;

use crate::run::event::Event;
use crate::run::picture::draw;
use crate::run::state::State;
use crate::run::trajectory::Trajectory;
use crate::step::{Flow, HasFlow, StateSpace};

pub use csv::{Csv, quoted};
pub use npy::{Npy, npy_header};

/// A table that cannot be written; the source of an [`io::Error`] of this module.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum ObservablesError {
    /// Two columns have one name, and no reader could tell them apart.
    #[error("two columns have the name {name:?}; the time has the name \"t\" already")]
    SameName {
        /// The name.
        name: String,
    },
    /// Writing has failed; what was not written is kept for the next call.
    #[error(
        "{source}; at least {rows} rows are in the file as a whole, and the others are kept in memory"
    )]
    Write {
        /// The rows that are in the file as a whole, by the last flush without an error.
        rows: usize,
        /// The error of writing.
        source: io::Error,
    },
}

metriplectic_equations::debug_is_the_sentence!(ObservablesError);

impl From<ObservablesError> for io::Error {
    fn from(error: ObservablesError) -> Self {
        let kind = match &error {
            ObservablesError::SameName { .. } => io::ErrorKind::InvalidInput,
            ObservablesError::Write { source, .. } => source.kind(),
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
    pub fn on<Y: HasFlow<Flow: Flow<Space = M>>>(_system: &Y) -> Self {
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
    /// [`ObservablesError`]: two columns of one name, and those of writing to `to`.
    pub fn csv<W: Write>(&self, to: W) -> io::Result<Csv<'_, M, W>> {
        self.check_names()?;
        let names: Vec<_> = self.names().map(quoted).collect();
        let mut table =
            Csv { of: self, to: Some(to), lines: names.join(","), rows: 0, confirmed: 0 };
        table.lines.push('\n');
        table.flush()?;
        Ok(table)
    }

    /// Writes a table of [events](Event) as comma-separated values: the name `event`, the `direction`, which is `rises` or `falls`, and
    /// the numbers of the state at which it was found.
    ///
    /// ```
    /// # use metriplectic_dynamics::System;
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_integrators::{Observables, Run, Span, Watch};
    /// # use metriplectic_manifolds::{LieDual, WeylMidpoint};
    /// # use nalgebra::Vector3;
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # let body = System::on(LieDual::so3())
    /// #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
    /// #     .build()?;
    /// let span = Span::until(20.0).event("node", |p: &Vector3<f64>| p.y).stop_after(2);
    /// let run = WeylMidpoint.run(&body, Vector3::new(0.4, 0.5, 0.3), span)?;
    /// let mut table = Vec::new();
    /// Observables::on(&body).of("p1", |p| p.x).events_csv(run.events(), &mut table)?;
    /// let text = String::from_utf8(table)?;
    /// assert!(text.starts_with("event,direction,t,p1\nnode,falls,1.26") && text.lines().count() == 3);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    ///
    /// [`ObservablesError`]: two columns of one name, and those of writing to `to`.
    pub fn events_csv<W: Write>(&self, events: &[Event<M>], mut to: W) -> io::Result<()> {
        self.check_names()?;
        let names: Vec<_> = self.names().map(quoted).collect();
        writeln!(to, "event,direction,{}", names.join(","))?;
        for event in events {
            write!(to, "{},{}", quoted(&event.name), if event.rises { "rises" } else { "falls" })?;
            for number in self.row(&event.state) {
                write!(to, ",{number:?}")?;
            }
            writeln!(to)?;
        }
        to.flush()
    }

    /// An array of `numpy` with one named `<f8` column for each number (format version 1.0, or 3.0 for
    /// names that are not ASCII): `numpy.load(path)["t"]`.
    ///
    /// The number of rows in the header is brought up to date whenever rows are written, hence
    /// the [`Seek`].
    ///
    /// # Errors
    ///
    /// [`ObservablesError`]: two columns of one name, and those of writing to `to`.
    pub fn npy<W: Write + Seek>(&self, mut to: W) -> io::Result<Npy<'_, M, W>> {
        self.check_names()?;
        let origin = to.stream_position()?;
        let mut table = Npy { of: self, to: Some(to), origin, rows: 0, bytes: Vec::new() };
        table.flush()?;
        Ok(table)
    }

    /// Draws these numbers of the recorded states of a run over the time, on one pair of axes, as an SVG file. A number that is not
    /// finite leaves a gap.
    ///
    /// ```
    /// # use metriplectic_dynamics::System;
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_integrators::{Observables, Run, Span};
    /// # use metriplectic_manifolds::{LieDual, WeylMidpoint};
    /// # use nalgebra::Vector3;
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # let body = System::on(LieDual::so3())
    /// #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
    /// #     .build()?;
    /// # let path = std::env::temp_dir().join(format!("metriplectic-of-{}.svg", std::process::id()));
    /// let run = WeylMidpoint.run(&body, Vector3::new(0.4, 0.5, 0.3), Span::steps(0.1, 100))?;
    /// Observables::on(&body).of("|p|", |p| p.norm()).of("p1", |p| p.x).svg(&run, &path)?;
    /// # assert!(std::fs::read_to_string(&path)?.contains(">|p|</text>"));
    /// # std::fs::remove_file(path)?;
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    ///
    /// The errors of writing to the file.
    pub fn svg(&self, run: &Trajectory<M>, path: impl AsRef<Path>) -> io::Result<()> {
        let times: Vec<f64> = run.iter().map(|state| state.time).collect();
        let line = |(name, f): &Observable<'a, M>| (name.clone(), run.iter().map(f).collect());
        std::fs::write(path, draw(&times, &[self.list.iter().skip(1).map(line).collect()]))
    }

    fn check_names(&self) -> Result<(), ObservablesError> {
        for (index, name) in self.names().enumerate() {
            if self.names().take(index).any(|before| before == name) {
                return Err(ObservablesError::SameName { name: name.to_owned() });
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

/// The bytes that are collected before they are written.
const BUFFER: usize = 1 << 16;

#[cfg(test)]
mod tests;
