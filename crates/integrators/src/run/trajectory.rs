//! The record of a run.

use std::fs::File;
use std::io::{self, Write as _};
use std::path::Path;

use approx::{AbsDiffEq, RelativeEq};
use metriplectic_dynamics::SecondLaw;

use crate::run::certificate::Certificate;
use crate::run::checkpoint::Checkpoint;
use crate::run::ending::Ending;
use crate::run::event::Event;
use crate::run::paired::{Unpaired, paired};
use crate::run::picture::{COLORS, Panel, draw};
use crate::run::state::State;
use crate::step::StateSpace;

/// The record of a run: states and certificate.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(bound = "M: StateSpace"))]
pub struct Trajectory<M: StateSpace> {
    pub(super) states: Vec<State<M>>,
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Vec::is_empty"))]
    pub(super) events: Vec<Event<M>>,
    pub(super) certificate: Certificate,
    pub(super) ending: Ending,
    #[cfg_attr(feature = "serde", serde(skip))]
    pub(super) checkpoint: Checkpoint,
}

impl<M: StateSpace> Trajectory<M> {
    /// The recorded states, the start first.
    pub fn states(&self) -> &[State<M>] {
        &self.states
    }

    /// The [events](crate::Watch::event) that were asked for, in the order of their times.
    ///
    /// ```
    /// # use metriplectic_dynamics::System;
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_integrators::{Event, Run, Span, Watch};
    /// # use metriplectic_manifolds::{LieDual, WeylMidpoint};
    /// # use nalgebra::Vector3;
    /// # fn main() -> Result<(), metriplectic_integrators::Error> {
    /// # let body = System::on(LieDual::so3())
    /// #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
    /// #     .build()?;
    /// let span = Span::steps(0.1, 100).event("node", |p: &Vector3<f64>| p.y);
    /// let run = WeylMidpoint.run(&body, Vector3::new(0.4, 0.5, 0.3), span)?;
    /// let times: Vec<f64> = run.events().iter().map(Event::time).collect();
    /// assert!(times.len() > 1 && times.is_sorted());
    /// # Ok(())
    /// # }
    /// ```
    pub fn events(&self) -> &[Event<M>] {
        &self.events
    }

    /// How often the [events](Self::events) of this name have happened, in the whole of a run that was resumed; `None` if none was
    /// asked for.
    pub fn count(&self, event: &str) -> Option<usize> {
        let counts = self.certificate.event_counts.iter();
        counts
            .filter(|counted| counted.name == event)
            .map(|counted| counted.count)
            .reduce(|a, b| a + b)
    }

    /// The state at the end of the run.
    pub fn last(&self) -> &State<M> {
        &self.states[self.states.len() - 1]
    }

    /// The numbers of the [states](Self::states) at some times, to the rounding of times. The last state of a run that came to
    /// [rest](Ending::Rest) stands for all later times.
    ///
    /// Data find their states by this, not by their place in a list: a run may end before its data do.
    ///
    /// ```
    /// # use metriplectic_dynamics::System;
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_integrators::{Run, Span, Watch};
    /// # use metriplectic_manifolds::{LieDual, WeylMidpoint};
    /// # use nalgebra::Vector3;
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # let body = System::on(LieDual::so3())
    /// #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
    /// #     .build()?;
    /// let span = Span::until(10.0).output_at([1.0, 2.0]);
    /// let run = WeylMidpoint.run(&body, Vector3::new(0.4, 0.5, 0.3), span)?;
    /// assert_eq!(run.indices_at(&[2.0, 10.0, 0.0])?, [2, 3, 0]);
    /// assert_eq!(run.at(2.0)?.time, 2.0);
    /// assert!(run.indices_at(&[3.0]).is_err());
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    ///
    /// [`Unpaired`] names the time at which there is no state, and how the run has ended if it did not reach it.
    pub fn indices_at(&self, times: &[f64]) -> Result<Vec<usize>, Unpaired> {
        let recorded: Vec<f64> = self.states.iter().map(|state| state.time).collect();
        paired(times, &recorded, (self.ending, self.events.last().map(|event| &event.name)))
    }

    /// The recorded state at a time, to the rounding of times. Ask for it by [`output_at`](crate::Watch::output_at) or
    /// [`output_every`](crate::Watch::output_every): a finished run does not know the states between.
    ///
    /// # Errors
    ///
    /// [`Unpaired`], as [`indices_at`](Self::indices_at).
    pub fn at(&self, time: f64) -> Result<&State<M>, Unpaired> {
        Ok(&self.states[self.indices_at(&[time])?[0]])
    }

    /// Writes the recorded states as a table of comma-separated values: the time `t`, the entries of the state `x1, x2, …`, the energy
    /// `H` and the entropy `S`. [`Observables`](crate::Observables) name other columns, and write them while the run goes on.
    ///
    /// # Errors
    ///
    /// The errors of writing to the file.
    pub fn csv(&self, path: impl AsRef<Path>) -> io::Result<()> {
        let mut file = io::BufWriter::new(File::create(path)?);
        let entries = M::numbers(&self.last().point).len();
        let names = (1..=entries).map(|k| format!("x{k},")).collect::<String>();
        writeln!(file, "t,{names}H,S")?;
        for state in &self.states {
            write!(file, "{:?}", state.time)?;
            for x in M::numbers(&state.point) {
                write!(file, ",{x:?}")?;
            }
            writeln!(file, ",{:?},{:?}", state.energy, state.entropy)?;
        }
        file.flush()
    }

    /// Draws the recorded states over the time as an SVG file: the entries of the state `x1, x2, …`, the first 14 of them if there
    /// are more; below them the error `H − H₀` of the energy, and the entropy `S` if there is one.
    /// [`Observables::svg`](crate::Observables::svg) draws other numbers.
    ///
    /// ```
    /// # use metriplectic_dynamics::System;
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_integrators::{Run, Span};
    /// # use metriplectic_manifolds::{LieDual, WeylMidpoint};
    /// # use nalgebra::Vector3;
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # let body = System::on(LieDual::so3())
    /// #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
    /// #     .build()?;
    /// # let path = std::env::temp_dir().join(format!("metriplectic-{}.svg", std::process::id()));
    /// let run = WeylMidpoint.run(&body, Vector3::new(0.4, 0.5, 0.3), Span::steps(0.1, 100))?;
    /// run.svg(&path)?;
    /// # assert!(std::fs::read_to_string(&path)?.ends_with("</svg>\n"));
    /// # std::fs::remove_file(path)?;
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    ///
    /// The errors of writing to the file.
    pub fn svg(&self, path: impl AsRef<Path>) -> io::Result<()> {
        let times: Vec<f64> = self.states.iter().map(|state| state.time).collect();
        let line = |of: &dyn Fn(&State<M>) -> f64| self.states.iter().map(of).collect::<Vec<_>>();
        let rows: Vec<_> = self.states.iter().map(|state| M::numbers(&state.point)).collect();
        let drawn = rows[0].len().min(2 * COLORS.len());
        let entry = |k: usize| (format!("x{}", k + 1), rows.iter().map(|row| row[k]).collect());
        let start = self.states[0].energy;
        let mut panels: Vec<Panel> = vec![
            (0..drawn).map(entry).collect(),
            vec![("H − H₀".to_owned(), line(&|state| state.energy - start))],
        ];
        if self.certificate.second_law != SecondLaw::NoEntropy {
            panels.push(vec![("S".to_owned(), line(&|state| state.entropy))]);
        }
        std::fs::write(path, draw(&times, &panels))
    }

    /// The balance of the run, over all of its steps, recorded or not.
    pub const fn certificate(&self) -> &Certificate {
        &self.certificate
    }

    /// How the run ended.
    pub const fn ending(&self) -> Ending {
        self.ending
    }

    /// The place where the run was put down: its end, the state before the step that failed, or the state at which the
    /// model broke a law. From here it goes on,
    /// with a later end ([`Checkpoint::with_steps`], [`Checkpoint::with_end`]) or other options of its method.
    pub const fn checkpoint(&self) -> &Checkpoint {
        &self.checkpoint
    }

    /// The recorded states in order.
    pub fn iter(&self) -> std::slice::Iter<'_, State<M>> {
        self.states.iter()
    }
}

impl<'a, M: StateSpace> IntoIterator for &'a Trajectory<M> {
    type Item = &'a State<M>;
    type IntoIter = std::slice::Iter<'a, State<M>>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

/// Trajectories are compared state by state.
impl<M: StateSpace> AbsDiffEq for Trajectory<M>
where
    Self: PartialEq,
    State<M>: PartialEq,
{
    type Epsilon = f64;

    fn default_epsilon() -> f64 {
        f64::default_epsilon()
    }

    fn abs_diff_eq(&self, other: &Self, epsilon: f64) -> bool {
        self.states.abs_diff_eq(&other.states, epsilon)
    }
}

impl<M: StateSpace> RelativeEq for Trajectory<M>
where
    Self: PartialEq,
    State<M>: PartialEq,
{
    fn default_max_relative() -> f64 {
        f64::default_max_relative()
    }

    fn relative_eq(&self, other: &Self, epsilon: f64, max_relative: f64) -> bool {
        self.states.relative_eq(&other.states, epsilon, max_relative)
    }
}

#[cfg(all(test, feature = "serde"))]
mod tests {
    use crate::{Run as _, Span};
    use metriplectic_dynamics::System;
    use metriplectic_fields::Real;
    use metriplectic_manifolds::{Manifold as _, Rotations, WeylMidpoint};
    use nalgebra::Matrix3;

    #[test]
    fn a_trajectory_is_written_with_the_entries_of_its_points() {
        let group = System::on(Rotations::bi_invariant())
            .energy(|r: &Matrix3<Real>| r.m11)
            .entropy(|r: &Matrix3<Real>| r.m12)
            .build()
            .unwrap();
        let run = WeylMidpoint.run(&group, Matrix3::identity(), Span::steps(0.1, 3)).unwrap();
        let json = serde_json::to_value(&run).unwrap();
        assert_eq!(json["certificate"]["steps"], 3);
        assert_eq!(json["certificate"]["initial_energy"], 1.0);
        assert_eq!(json["certificate"]["second_law"], "Exact");
        let states = json["states"].as_array().unwrap();
        assert_eq!(states.len(), 4);
        for (json, state) in states.iter().zip(&run) {
            let point: Vec<f64> = serde_json::from_value(json["point"].clone()).unwrap();
            assert_eq!(point, Rotations::entries(&state.point));
            assert_eq!(json["energy"].as_f64(), Some(state.energy));
        }
    }
}
