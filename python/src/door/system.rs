//! A system of recorded functions, and its runs.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use metriplectic_dynamics::ModelError as Broken;
use metriplectic_dynamics::noise::{Boltzmann, Uniform};
use metriplectic_equations::{FrictionTerms, Report};
use metriplectic_integrators::{
    FromEquations, Method as _, NinomiyaVictoir, Noisy, RandomFlow, RunError as NotRun, Sampler,
    Schedule, Stepper,
};
use numpy::{IntoPyArray, PyArrayMethods as _, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::errors::{ModelError, RunError, bad, caught, in_python, of_model, of_run};
use super::interrupt::{Interruptible, Look};
use super::kinds::{Closed, Kind, Open};
use super::method::AnyMethod;
use super::output::{Names, Output};
use super::schedule::{Derivatives, Event, Times, Watched, noting, watching};
use super::surroundings::Surroundings;
use crate::model::{Definition, Recorded};

/// A system at values of its parameters, behind a pointer.
pub(crate) type Parts = Arc<dyn FrictionTerms + Send + Sync>;

/// A system of recorded functions at values of its parameters.
#[pyclass(frozen, module = "metriplectic._metriplectic")]
#[derive(Debug)]
pub(crate) struct RawSystem {
    pub(crate) definition: Arc<Definition>,
    pub(crate) theta: Arc<[f64]>,
    surroundings: Option<Arc<Surroundings>>,
    /// Boltzmann's constant, if there is noise.
    noise: Option<f64>,
    is_verified: bool,
    pub(crate) names: Arc<[&'static str]>,
}

/// A method with its random numbers.
#[derive(Clone, Debug, FromPyObject)]
pub(crate) struct Chosen {
    method: String,
    gradient: Option<String>,
    sampler: Option<String>,
    seed: u64,
    path: u64,
    three_point: bool,
}

impl Chosen {
    /// Finds the method.
    ///
    /// # Errors
    ///
    /// `ValueError` that lists the names.
    pub(crate) fn method(&self) -> PyResult<AnyMethod> {
        let name = self.method.as_str();
        let has_gradient = AnyMethod::has_gradient(name);
        if self.gradient.is_some() && !has_gradient {
            return Err(bad(format!(
                "the method \"{name}\" has no discrete gradient; leave `gradient=` out"
            )));
        }
        let gradient =
            self.gradient.as_deref().unwrap_or(if has_gradient { "gonzalez" } else { "" });
        AnyMethod::named(name, gradient).ok_or_else(|| {
            let (of, what, names) = if AnyMethod::names().contains(&name) {
                (
                    gradient,
                    "discrete gradient",
                    vec!["gonzalez", "mean-value", "itoh-abe", "symmetric-itoh-abe"],
                )
            } else {
                (name, "method", AnyMethod::names())
            };
            bad(format!("there is no {what} \"{of}\"; there are {}", names.join(", ")))
        })
    }

    fn sampler(&self) -> &str {
        self.sampler.as_deref().unwrap_or("random-flow")
    }
}

/// Rows of a law, its residual, what is allowed and the worst state; the verdict; and the text.
type Reported = (Vec<(&'static str, f64, f64, Vec<f64>)>, Option<String>, String);

/// A run that is asked for.
pub(crate) struct Request {
    pub(crate) start: Vec<f64>,
    pub(crate) schedule: Schedule,
    pub(crate) events: Vec<Watched>,
    pub(crate) look: Arc<Look>,
}

/// A run that did not reach its end: why, and what there is of it.
struct Failed {
    error: PyErr,
    partial: Option<Box<Output>>,
}

/// Runs a system of one kind by one method.
fn run<F: Kind, M: Stepper<F>>(
    flow: &F,
    names: Option<&Names>,
    method: M,
    request: &Request,
) -> Result<Output, Failed> {
    let x0 = flow.at_start(&request.start).map_err(|error| of_model(&Broken::Start(error)));
    let x0 = x0.map_err(|error| Failed { error, partial: None })?;
    type PointOf<F> = metriplectic_integrators::Element<F>;
    let schedule = request.schedule.clone();
    let schedule = watching::<PointOf<F>>(schedule, &request.events, Derivatives::None);
    let schedule = noting::<PointOf<F>>(schedule, &request.look);
    match method.run(flow, x0, schedule) {
        Ok(run) => Ok(Output::of(flow, names, &run)),
        Err(NotRun::Step { cause, trajectory }) => {
            let steps = trajectory.certificate().steps;
            let message = format!("{cause} ({steps} steps were taken and are in `partial`)");
            Err(Failed {
                error: RunError::new_err(in_python(&message)),
                partial: Some(Box::new(Output::of(flow, names, &trajectory))),
            })
        }
        Err(error) => Err(Failed { error: of_run(&error), partial: None }),
    }
}

/// Hands over a run, or the exception with what there is of it: that of a signal, if there was one.
fn handed<'py>(
    py: Python<'py>,
    outcome: Result<Output, Failed>,
    look: &Look,
) -> PyResult<Bound<'py, PyDict>> {
    match (outcome, look.take_error()) {
        (Ok(output), None) => output.into_dict(py),
        (Ok(output), Some(error)) => {
            error.value(py).setattr("partial", output.into_dict(py)?)?;
            Err(error)
        }
        (Err(Failed { error, partial }), signal) => {
            let error = signal.unwrap_or(error);
            let partial = partial.map(|partial| partial.into_dict(py)).transpose()?;
            // An exception of another class may have no room for it.
            let _ = error.value(py).setattr("partial", partial);
            Err(error)
        }
    }
}

impl RawSystem {
    /// The recorded system at other values of its parameters.
    ///
    /// # Errors
    ///
    /// `ModelError` if a part makes no sense there.
    pub(crate) fn parts_at(&self, theta: &[f64]) -> PyResult<Parts> {
        let system = Recorded::new(Arc::clone(&self.definition), theta);
        let system = system.map_err(|error| ModelError::new_err(in_python(&error.to_string())))?;
        Ok(Arc::new(system))
    }

    /// The recorded system at these parameters, with its derivatives along those at these places.
    pub(crate) fn parts_along(&self, theta: &[f64], places: &[usize]) -> PyResult<Parts> {
        let system = Recorded::new(Arc::clone(&self.definition), theta);
        let system = system.and_then(|system| system.along(places));
        let system = system.map_err(|error| ModelError::new_err(in_python(&error.to_string())))?;
        Ok(Arc::new(system))
    }

    /// The system of a run.
    fn supervised(&self, parts: Parts, look: &Arc<Look>) -> Interruptible {
        Interruptible::new(parts, Arc::clone(look), self.is_verified)
    }

    /// The closed system of a run at values of the parameters.
    pub(crate) fn closed(&self, theta: &[f64], look: &Arc<Look>) -> PyResult<Closed> {
        Ok(self.closed_with(self.parts_at(theta)?, look))
    }

    /// The closed system of a run from its parts.
    pub(crate) fn closed_with(&self, parts: Parts, look: &Arc<Look>) -> Closed {
        FromEquations(self.supervised(parts, look))
    }

    /// The open system of a run at values of the parameters; `None` if it is closed.
    pub(crate) fn open(&self, theta: &[f64], look: &Arc<Look>) -> PyResult<Option<Open>> {
        if self.surroundings.is_none() {
            return Ok(None);
        }
        Ok(self.open_with(self.parts_at(theta)?, theta, look))
    }

    /// The open system of a run from its parts; `None` if it is closed.
    pub(crate) fn open_with(&self, parts: Parts, theta: &[f64], look: &Arc<Look>) -> Option<Open> {
        let surroundings = self.surroundings.as_ref()?;
        Some(surroundings.around(self.supervised(parts, look), &theta.into()))
    }

    pub(crate) fn ledger_names(&self) -> Option<Names> {
        self.surroundings.as_ref().map(|surroundings| surroundings.names())
    }

    pub(crate) fn has_noise(&self) -> bool {
        self.noise.is_some()
    }

    pub(crate) fn events(&self, events: &[Event<'_>]) -> PyResult<Vec<Watched>> {
        events.iter().map(|event| event.read(&self.theta)).collect()
    }

    /// Runs the system, of whatever kind it is.
    fn run_any(
        &self,
        chosen: &Chosen,
        method: AnyMethod,
        request: &Request,
    ) -> Result<Output, Failed> {
        let failed = |error| Failed { error, partial: None };
        let names = self.ledger_names();
        let names = names.as_ref();
        let open = self.open(&self.theta, &request.look).map_err(failed)?;
        match (open, self.noise) {
            (None, None) => {
                let closed = self.closed(&self.theta, &request.look).map_err(failed)?;
                run(&closed, names, method, request)
            }
            (Some(open), None) => run(&open, names, method, request),
            (None, Some(k_b)) => {
                let closed = self.closed(&self.theta, &request.look).map_err(failed)?;
                sampled(&closed.with_noise(Boltzmann(k_b)), names, (chosen, method), request)
            }
            (Some(open), Some(k_b)) => {
                let n = self.sizes().map_err(failed)?[1];
                let contacts =
                    self.surroundings.as_ref().map_or_else(Vec::new, |of| of.contacts(n));
                let noisy = open.with_noise(Boltzmann(k_b), &contacts);
                sampled(&noisy, names, (chosen, method), request)
            }
        }
    }

    fn sizes(&self) -> PyResult<[usize; 2]> {
        let sizes = self.parts_at(&self.theta)?.sizes();
        Ok([sizes.entries, sizes.directions])
    }
}

/// Samples a system with noise.
fn sampled<F>(
    flow: &Noisy<F, Uniform>,
    names: Option<&Names>,
    (chosen, method): (&Chosen, AnyMethod),
    request: &Request,
) -> Result<Output, Failed>
where
    Noisy<F, Uniform>: Kind,
    Sampler<RandomFlow<AnyMethod>>: Stepper<Noisy<F, Uniform>>,
    Sampler<NinomiyaVictoir<AnyMethod>>: Stepper<Noisy<F, Uniform>>,
{
    macro_rules! by {
        ($sampling:expr) => {{
            let sampler = $sampling.seed(chosen.seed).path(chosen.path);
            let sampler = if chosen.three_point { sampler.three_point() } else { sampler };
            run(flow, names, sampler, request)
        }};
    }
    match chosen.sampler() {
        "random-flow" => by!(RandomFlow(method)),
        "ninomiya-victoir" => by!(NinomiyaVictoir(method)),
        other => {
            let message =
                format!("there is no sampler \"{other}\"; there are random-flow, ninomiya-victoir");
            Err(Failed { error: bad(message), partial: None })
        }
    }
}

#[pymethods]
impl RawSystem {
    /// A system of recorded functions.
    #[new]
    #[pyo3(signature = (definition, theta, ports, baths, is_open, noise, is_verified))]
    fn new(
        definition: &Bound<'_, PyAny>,
        theta: Vec<f64>,
        ports: Vec<(String, Bound<'_, PyAny>)>,
        baths: Vec<(String, Bound<'_, PyAny>, Bound<'_, PyAny>)>,
        is_open: bool,
        noise: Option<f64>,
        is_verified: bool,
    ) -> PyResult<Self> {
        caught(|| {
            let (definition, names) = super::definition::read(definition)?;
            let made = Self {
                definition: Arc::new(definition),
                theta: theta.into(),
                surroundings: None,
                noise,
                is_verified,
                names: names.into(),
            };
            let [entries, directions] = made.sizes()?;
            let is_open = is_open || !ports.is_empty() || !baths.is_empty();
            let surroundings = if is_open {
                let lengths = [entries, directions, made.theta.len()];
                Some(Arc::new(Surroundings::read(&ports, &baths, lengths)?))
            } else {
                None
            };
            Ok(Self { surroundings, ..made })
        })
    }

    /// The system at other values of its parameters, which is not verified. No function is recorded again.
    fn at(&self, theta: Vec<f64>) -> PyResult<Self> {
        if theta.len() != self.theta.len() {
            return Err(bad(format!(
                "there are {} parameters, not {}",
                self.theta.len(),
                theta.len()
            )));
        }
        self.parts_at(&theta)?;
        Ok(Self {
            definition: Arc::clone(&self.definition),
            theta: theta.into(),
            surroundings: self.surroundings.clone(),
            noise: self.noise,
            is_verified: false,
            names: Arc::clone(&self.names),
        })
    }

    /// The numbers of a state, and the directions of its chart.
    #[getter]
    fn lengths(&self) -> PyResult<[usize; 2]> {
        self.sizes()
    }

    /// Verifies the laws around a start, and returns the system with this certificate.
    fn verified(
        &self,
        py: Python<'_>,
        start: PyReadonlyArray1<'_, f64>,
        time: f64,
    ) -> PyResult<Self> {
        let start = start.as_array().to_vec();
        caught(|| py.detach(|| self.verify(&start, time)))?;
        Ok(Self {
            definition: Arc::clone(&self.definition),
            theta: Arc::clone(&self.theta),
            surroundings: self.surroundings.clone(),
            noise: self.noise,
            is_verified: true,
            names: Arc::clone(&self.names),
        })
    }

    /// Lists the residual of each law around a start: rows of the law, the residual and what is allowed, and the verdict.
    fn report(
        &self,
        py: Python<'_>,
        start: PyReadonlyArray1<'_, f64>,
        time: f64,
    ) -> PyResult<Reported> {
        let start = start.as_array().to_vec();
        let report = caught(|| py.detach(|| self.reported(&start, time)))?;
        let text =
            in_python(&report.verdict.as_ref().err().map_or_else(String::new, ToString::to_string));
        let rows =
            report.laws.iter().map(|law| (law.law, law.size, law.allowed, law.point.clone()));
        let verdict = report.verdict.is_err().then_some(text);
        Ok((rows.collect(), verdict, report.to_string()))
    }

    /// Evaluates the energy, the entropy and the further invariants at states, row by row.
    fn laws<'py>(
        &self,
        py: Python<'py>,
        states: numpy::PyReadonlyArray2<'_, f64>,
        times: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<Bound<'py, numpy::PyArray2<f64>>> {
        let parts = self.parts_at(&self.theta)?;
        let sizes = parts.sizes();
        let (states, times) = (states.as_array(), times.as_array());
        if states.ncols() != sizes.entries || times.len() != states.nrows() {
            return Err(bad("a row of numbers is expected for each state, and a time"));
        }
        let mut all = Vec::with_capacity(states.nrows() * sizes.laws);
        for (row, t) in states.rows().into_iter().zip(times) {
            let mut values = vec![0.0; sizes.laws];
            parts.values(*t, &row.to_vec(), &mut values);
            all.extend(values);
        }
        all.into_pyarray(py).reshape([states.nrows(), sizes.laws])
    }

    /// Runs the system, without the interpreter.
    #[pyo3(signature = (chosen, start, times, events, progress))]
    fn run<'py>(
        &self,
        py: Python<'py>,
        chosen: Chosen,
        start: PyReadonlyArray1<'_, f64>,
        times: Times,
        events: Vec<Event<'_>>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let request = Request {
            start: start.as_array().to_vec(),
            schedule: times.schedule()?,
            events: self.events(&events)?,
            look: Look::new(progress),
        };
        let method = chosen.method()?;
        let work = || py.detach(|| Ok(self.run_any(&chosen, method, &request)));
        let outcome = caught(work).unwrap_or_else(|error| Err(Failed { error, partial: None }));
        handed(py, outcome, &request.look)
    }

    /// Runs many paths of a system with noise, or one run from each start, on so many threads. Runs come out in their order, and
    /// an exception in place of one that failed.
    #[pyo3(signature = (chosen, starts, times, events, threads))]
    fn runs<'py>(
        &self,
        py: Python<'py>,
        chosen: Chosen,
        starts: numpy::PyReadonlyArray2<'_, f64>,
        times: Times,
        events: Vec<Event<'_>>,
        threads: usize,
    ) -> PyResult<Vec<Bound<'py, PyAny>>> {
        let look = Look::new(None);
        let (schedule, events, method) =
            (times.schedule()?, self.events(&events)?, chosen.method()?);
        let starts: Vec<Vec<f64>> =
            starts.as_array().rows().into_iter().map(|row| row.to_vec()).collect();
        let next = AtomicUsize::new(0);
        let one = |k: usize| {
            let request = Request {
                start: starts[k].clone(),
                schedule: schedule.clone(),
                events: events.clone(),
                look: Arc::clone(&look),
            };
            let chosen = Chosen { path: chosen.path + k as u64, ..chosen.clone() };
            let done = caught(|| Ok(self.run_any(&chosen, method, &request)));
            done.unwrap_or_else(|error| Err(Failed { error, partial: None }))
        };
        let worker = || {
            let mut done = Vec::new();
            loop {
                let k = next.fetch_add(1, Ordering::Relaxed);
                if k >= starts.len() {
                    return done;
                }
                done.push((k, one(k)));
            }
        };
        let mut all: Vec<(usize, Result<Output, Failed>)> = py.detach(|| {
            std::thread::scope(|scope| {
                // This thread works too: it is the one that signals come to.
                let others: Vec<_> = (1..threads.max(1)).map(|_| scope.spawn(worker)).collect();
                let mine = worker();
                let theirs = others.into_iter().filter_map(|other| other.join().ok()).flatten();
                mine.into_iter().chain(theirs).collect()
            })
        });
        if let Some(error) = look.take_error() {
            return Err(error);
        }
        all.sort_by_key(|(k, _)| *k);
        let object = |outcome| match handed(py, outcome, &look) {
            Ok(run) => run.into_any(),
            Err(error) => error.into_value(py).into_bound(py).into_any(),
        };
        Ok(all.into_iter().map(|(_, outcome)| object(outcome)).collect())
    }
}

impl RawSystem {
    fn verify(&self, start: &[f64], time: f64) -> PyResult<()> {
        let report = self.reported(start, time)?;
        report.verdict.map_err(|error| of_model(&error))
    }

    fn reported(&self, start: &[f64], time: f64) -> PyResult<Report> {
        let look = Look::new(None);
        let closed = self.closed(&self.theta, &look)?;
        let refused = |error| of_model(&Broken::Start(error));
        let x0 = metriplectic_integrators::Flow::element(&closed, start).map_err(refused)?;
        match self.open(&self.theta, &look)? {
            None => Ok(closed.report(&x0)),
            Some(open) => {
                let mut state = open.start(x0);
                state.time = time;
                Ok(open.report(&state))
            }
        }
    }
}
