//! The surroundings of the model of an example: its command line, its progress, its files and what it prints.

use std::{env, error::Error};

use metriplectic_dynamics::{Metriplectic, system::Point};
use metriplectic_integrators::{Certificate, Method, Scheme, Span, State};
use metriplectic_manifolds::{Manifold, WeylMidpoint};

use crate::options::{Answer, Options};
use crate::{Panel, Progress, Report};

/// States that a figure and a data file hold, at most.
const RECORDED: usize = 2001;

/// An example with the options of its command line: `--json`, `--steps`, `--step-size` and `--help`.
///
/// # Examples
///
/// ```
/// use metriplectic_dynamics::System;
/// use metriplectic_fields::Real;
/// use metriplectic_manifolds::LieDual;
/// use metriplectic_studies::{Example, Panels};
/// use nalgebra::Vector3;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let folder = std::env::temp_dir().join("metriplectic-doc");
/// let example = Example::new("A free rigid body turns over and over.", 100, 0.1);
/// # let example = example.within(folder);
/// let body = System::on(LieDual::so3())
///     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
///     .build()?;
/// let run = example.run(&body, Vector3::new(0.01, 1.0, 0.01), example.span())?;
/// example
///     .report(&run)
///     .table(["t", "p1"], run.states.iter().map(|state| [state.time, state.point.x]))
///     .figure(Panels::new("A free rigid body").panel(run.energy_error()))
///     .print()
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Example {
    /// Whether one JSON object is printed, in the place of text.
    pub json: bool,
    /// The number of steps.
    pub steps: usize,
    /// The size of a step.
    pub step_size: f64,
    /// Whether a sweep merges the journals of its shards, rather than running rows.
    pub merge: bool,
    folder: Option<std::path::PathBuf>,
}

/// The states of a run, the start first, with its certificate.
#[derive(Clone, Debug)]
pub struct Record<M: Manifold> {
    /// The recorded states.
    pub states: Vec<State<M>>,
    /// The balance over all steps, recorded or not.
    pub certificate: Certificate,
}

impl Example {
    /// Reads the command line of an example that takes so many steps of this size, unless other ones are
    /// asked for. Prints `about` and the options for `--help`, and says what is wrong with a mistake; both
    /// end the program.
    #[must_use]
    pub fn new(about: &'static str, steps: usize, step_size: f64) -> Self {
        let help = [
            format!("Number of steps [default: {steps}]"),
            format!("Size of a step [default: {step_size:?}]"),
        ];
        Self::read(&Options::of_a_run(about, help), steps, step_size)
    }

    /// Reads the command line of an example whose steps follow the motion, up to a largest one, until it
    /// is over.
    #[must_use]
    pub fn adaptive(about: &'static str, largest: f64) -> Self {
        let help = [
            "Number of steps, at most [default: until the end]".to_owned(),
            format!("Size of the largest step [default: {largest:?}]"),
        ];
        Self::read(&Options::of_a_run(about, help), usize::MAX, largest)
    }

    /// Reads the command line of a study of many runs, which has the option `--json` alone.
    #[must_use]
    pub fn study(about: &'static str) -> Self {
        Self::read(&Options::new(about), 0, 0.0)
    }

    /// Reads the command line of a sweep: `--json`, `--merge`, and the shard, which
    /// `Shard::from_environment` reads by itself.
    #[must_use]
    pub fn sweep(about: &'static str) -> Self {
        Self::read(&Options::of_a_sweep(about), 0, 0.0)
    }

    fn read(options: &Options, steps: usize, step_size: f64) -> Self {
        let line = env::args().skip(1);
        Self::parsed(options, line, steps, step_size).unwrap_or_else(|answer| answer.exit())
    }

    fn parsed(
        options: &Options,
        line: impl IntoIterator<Item = String>,
        steps: usize,
        step_size: f64,
    ) -> Result<Self, Answer> {
        let given = options.parse(line)?;
        Ok(Self {
            json: given.contains_key("json"),
            steps: given.get("steps").map_or(Ok(steps), |text| count(text))?,
            step_size: given.get("step-size").map_or(Ok(step_size), |text| size(text))?,
            merge: given.contains_key("merge"),
            folder: None,
        })
    }

    /// Writes the files to this folder, rather than to the [`Gallery`](crate::Gallery).
    #[must_use]
    pub fn within(self, folder: impl Into<std::path::PathBuf>) -> Self {
        Self { folder: Some(folder.into()), ..self }
    }

    /// The span of the run, with at most 2001 recorded states.
    #[must_use]
    pub fn span(&self) -> Span {
        Span::steps(self.step_size, self.steps).at_most(RECORDED)
    }

    /// Runs a system as `WeylMidpoint.run(system, start, span)` does, and shows a bar on the terminal
    /// where that takes more than a second.
    ///
    /// # Errors
    ///
    /// [`RunError`](metriplectic_integrators::RunError) if the model breaks a law,
    /// [`StepError`](metriplectic_integrators::StepError) if a step fails.
    pub fn run<Y: Metriplectic<Manifold: 'static>>(
        &self,
        system: &Y,
        start: Point<Y>,
        span: Span,
    ) -> Result<Record<Y::Manifold>, Box<dyn Error>>
    where
        WeylMidpoint: metriplectic_manifolds::Retraction<Y::Manifold, Y::Metric>,
    {
        self.run_with(Scheme::new(WeylMidpoint), system, start, span)
    }

    /// Runs a system by another method in the same way.
    ///
    /// # Errors
    ///
    /// The errors of [`run`](Self::run).
    pub fn run_with<Y: Metriplectic<Manifold: 'static>>(
        &self,
        method: impl Method<Y>,
        system: &Y,
        start: Point<Y>,
        span: Span,
    ) -> Result<Record<Y::Manifold>, Box<dyn Error>> {
        let mut steps = method.steps(system, start, span)?;
        let mut states = vec![steps.state().clone()];
        let mut progress = Progress::over(span.count());
        for step in 1..=span.count() {
            steps.advance()?;
            let over = steps.ending().is_some();
            if span.records(step) || over {
                states.push(steps.state().clone());
            }
            progress.step();
            if over {
                break;
            }
        }
        Ok(Record { states, certificate: steps.run()?.certificate().clone() })
    }

    /// Begins the report of a run: its certificate and its last state.
    pub fn report<M: Manifold>(&self, run: &Record<M>) -> Report {
        self.report_of_many().run(run)
    }

    /// Begins the report of a run of any flow, of whose last state it has these entries.
    pub fn report_of(&self, certificate: &Certificate, time: f64, entries: Vec<f64>) -> Report {
        self.report_of_many().certified(certificate, time, entries)
    }

    /// Begins a report that is not of one run.
    pub fn report_of_many(&self) -> Report {
        Report::new(self.json, self.folder.clone())
    }
}

impl<M: Manifold> Record<M> {
    /// The state at the end of the run.
    #[must_use]
    pub fn last(&self) -> &State<M> {
        &self.states[self.states.len() - 1]
    }

    /// A number over time.
    pub fn series(&self, value: impl Fn(&State<M>) -> f64) -> Vec<(f64, f64)> {
        self.states.iter().map(|state| (state.time, value(state))).collect()
    }

    /// A number of a step, from the states before and after it, over the time after it.
    pub fn changes(&self, value: impl Fn(&State<M>, &State<M>) -> f64) -> Vec<(f64, f64)> {
        self.states.windows(2).map(|pair| (pair[1].time, value(&pair[0], &pair[1]))).collect()
    }

    /// The energy `H − H₀` over time.
    #[must_use]
    pub fn energy_errors(&self) -> Vec<(f64, f64)> {
        self.series(|state| state.energy - self.certificate.initial_energy)
    }

    /// A panel of the energy `H − H₀`.
    #[must_use]
    pub fn energy_error(&self) -> Panel {
        Panel::new("energy H − H₀", "t").line("H − H₀", self.energy_errors()).level(0.0)
    }

    /// A panel of one number over time.
    pub fn panel(&self, quantity: &str, value: impl Fn(&State<M>) -> f64) -> Panel {
        Panel::new(quantity, "t").line(quantity, self.series(value))
    }
}

/// The name of the program.
pub(crate) fn name() -> String {
    let path = env::current_exe().unwrap_or_default();
    path.file_stem().map_or_else(|| "example".into(), |name| name.to_string_lossy().into_owned())
}

fn count(text: &str) -> Result<usize, Answer> {
    let count = text.parse().ok().filter(|&count| count > 0);
    count.ok_or_else(|| Answer::Mistake(format!("`{text}` is not a number of steps")))
}

fn size(text: &str) -> Result<f64, Answer> {
    let size = text.parse().ok().filter(|size: &f64| size.is_finite() && *size > 0.0);
    size.ok_or_else(|| Answer::Mistake(format!("a step size is positive and finite, not `{text}`")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(options: &Options, line: &[&str]) -> Result<Example, Answer> {
        Example::parsed(options, line.iter().map(|&word| word.to_owned()), 3, 0.1)
    }

    fn parsed(line: &[&str]) -> Result<Example, Answer> {
        let help = ["Number of steps [default: 3]", "Size of a step [default: 0.1]"];
        of(&Options::of_a_run("A test.", help.map(str::to_owned)), line)
    }

    #[test]
    fn options_are_read() {
        let asked = parsed(&["--json", "--steps", "12", "--step-size", "0.5"]).unwrap();
        assert_eq!((asked.json, asked.steps, asked.step_size), (true, 12, 0.5));
        let none = parsed(&[]).unwrap();
        assert_eq!((none.json, none.steps, none.step_size), (false, 3, 0.1));
        assert!(of(&Options::new("A study."), &["--json"]).unwrap().json);
        let sweep = |line: &[&str]| of(&Options::of_a_sweep("A sweep."), line);
        assert!(sweep(&["--merge", "--json"]).unwrap().merge);
        assert!(!sweep(&["--shard", "3/16"]).unwrap().merge);
        assert!(sweep(&["--help"]).unwrap_err().text().contains("--array=0-3"));
    }

    #[test]
    fn help_says_what_the_example_is_and_its_defaults() {
        for flag in ["--help", "-h"] {
            let help = parsed(&[flag]).unwrap_err();
            for part in ["A test.", "[default: 3]", "[default: 0.1]", "--json"] {
                assert!(help.text().contains(part), "{help:?}");
            }
        }
    }

    #[test]
    fn mistakes_are_refused() {
        for line in [
            "--steps=0",
            "--steps=x",
            "--steps",
            "--step-size=0",
            "--step-size=-1",
            "--step-size=NaN",
            "--json=1",
            "--merge",
            "--stepsize=1",
            "12",
        ] {
            let answer = parsed(&[line]);
            assert!(matches!(answer, Err(Answer::Mistake(_))), "{line}: {answer:?}");
        }
        assert!(of(&Options::new(""), &["--steps", "3"]).is_err());
    }
}
