//! Tangents of runs, and gradients of losses by the transposed steps.

use std::cell::RefCell;
use std::collections::HashMap;
use std::sync::Arc;

use metriplectic_dynamics::ModelError as Broken;
use metriplectic_fields::Real;
use metriplectic_integrators::tangent::SmoothFlow;
use metriplectic_integrators::{
    Adjoints as _, Differentiated, Element, Listed, Schedule, Sensitivity, Stepper, SystemAt,
    TangentRun, Tangents as _,
};
use nalgebra::DMatrix;
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods as _, PyReadonlyArray1,
    PyReadonlyArray2,
};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use super::errors::{bad, caught, in_python, of_model, of_tangent};
use super::interrupt::Look;
use super::kinds::{Closed, Kind, Open, Recorded as _};
use super::method::AnyMethod;
use super::output::{Names, Output, written};
use super::schedule::{Derivatives, Event, Point as _, Times, Watched, noting, watching};
use super::system::{Chosen, Parts, RawSystem};
use super::tapes::tape;

/// A kind of system whose runs have derivatives, at moving points that are lists of numbers.
trait Smooth: Kind + SmoothFlow<Moving = Vec<Real>> {}

impl Smooth for Closed {}
impl Smooth for Open {}

/// The parameters along which derivatives are asked for.
#[derive(Clone, Debug)]
struct Along {
    /// Their places among all parameters.
    places: Vec<usize>,
    /// The sizes by which they are displaced.
    sizes: Vec<f64>,
    names: Vec<&'static str>,
}

/// Systems at parameters beside those of a run, by the bits of these.
type Beside = RefCell<HashMap<Vec<u64>, Parts>>;

/// The most systems that are kept.
const MOST_KEPT: usize = 4096;

/// The derivatives of the time of an event and of the state there, along the start and along the parameters, or why there are none.
type AlongEvent = Result<[Vec<f64>; 4], String>;

/// A run with its tangent, as arrays.
#[derive(Debug)]
struct Tangent {
    t: Vec<f64>,
    y: Vec<f64>,
    entries: usize,
    /// The derivatives of the entries, and of the ledger: of each state, along the start and along the parameters.
    along_start: Vec<f64>,
    along_parameters: Vec<f64>,
    ledger: Vec<(String, Vec<f64>, Vec<f64>)>,
    events: Vec<(String, f64, AlongEvent)>,
    certificate: Box<metriplectic_integrators::Certificate>,
    sensitivity: Sensitivity,
    lengths: [usize; 2],
}

/// Takes the derivatives of the entries from the matrix of all directions, along the start and along the parameters.
fn parts<F: Smooth>(
    flow: &F,
    x: &Element<F>,
    whole: &DMatrix<f64>,
    [n, p]: [usize; 2],
) -> [Vec<f64>; 2] {
    let all = flow.directions();
    let entries = |columns: std::ops::Range<usize>| {
        let moved: Vec<Vec<Real>> =
            columns.map(|j| flow.moving(x, &whole.column(j).rows(0, all).into_owned())).collect();
        let rows = moved.first().map_or(0, Vec::len);
        (0..rows).flat_map(|i| moved.iter().map(move |column| column[i].eps1)).collect::<Vec<f64>>()
    };
    [entries(0..n), entries(all..all + p)]
}

impl Tangent {
    fn of<F: Smooth>(
        flow: &F,
        n: usize,
        p: usize,
        names: Option<&Names>,
        run: &TangentRun<F>,
        events: &[Watched],
    ) -> Self {
        let all = flow.directions();
        let mut tangent = Self {
            t: Vec::new(),
            y: Vec::new(),
            entries: 0,
            along_start: Vec::new(),
            along_parameters: Vec::new(),
            ledger: Vec::new(),
            events: Vec::new(),
            certificate: Box::new(run.certificate().clone()),
            sensitivity: *run.sensitivity(),
            lengths: [n, p],
        };
        if let Some(names) = names {
            let column = |name: String| (name, Vec::new(), Vec::new());
            let ports = names.ports.iter().map(|name| column(format!("work of {name}")));
            let baths = names.baths.iter();
            let baths =
                baths.flat_map(|name| [format!("heat of {name}"), format!("entropy of {name}")]);
            tangent.ledger = std::iter::once(column("work".to_owned()))
                .chain(ports)
                .chain(baths.map(column))
                .collect();
        }
        for state in run.states() {
            tangent.t.push(state.time);
            let entries = state.point.entries();
            tangent.entries = entries.len();
            tangent.y.extend_from_slice(entries);
            let whole = state.matrix();
            let [start, parameters] = parts(flow, &state.point, &whole, [n, p]);
            tangent.along_start.extend(start);
            tangent.along_parameters.extend(parameters);
            if state.point.ledger().is_none() {
                continue;
            }
            // The rows behind the clock are what was booked, the work of the time first.
            for (k, (_, start, parameters)) in tangent.ledger.iter_mut().enumerate() {
                let row = n + 1 + k;
                start.extend((0..n).map(|j| whole[(row, j)]));
                parameters.extend((all..all + p).map(|j| whole[(row, j)]));
            }
        }
        for event in run.events() {
            let found = &event.event;
            let Some(watched) = events.get(found.index) else { continue };
            let t = found.state.time;
            let g = |x: &Vec<Real>| watched.value_at(x, t);
            let (_, dg) = flow.differential(&g, &event.state.point);
            let along = event.time_by(&dg).and_then(|time| Ok((time, event.state_by(&dg)?)));
            let along = match along {
                Ok((time, state)) => {
                    let [start, parameters] = parts(flow, &event.state.point, &state, [n, p]);
                    let [time_start, time_parameters] =
                        [0..n, all..all + p].map(|columns| columns.map(|j| time[j]).collect());
                    Ok([time_start, time_parameters, start, parameters])
                }
                Err(error) => Err(in_python(&error.to_string())),
            };
            tangent.events.push((found.name.to_string(), t, along));
        }
        tangent
    }

    fn into_dict<'py>(self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (dict, rows, [n, p]) = (PyDict::new(py), self.t.len(), self.lengths);
        dict.set_item("t", self.t.into_pyarray(py))?;
        dict.set_item("y", self.y.into_pyarray(py).reshape([rows, self.entries])?)?;
        dict.set_item(
            "along_start",
            self.along_start.into_pyarray(py).reshape([rows, self.entries, n])?,
        )?;
        let along = self.along_parameters.into_pyarray(py).reshape([rows, self.entries, p])?;
        dict.set_item("along_parameters", along)?;
        let ledger = PyDict::new(py);
        for (name, start, parameters) in self.ledger {
            let start = start.into_pyarray(py).reshape([rows, n])?;
            let parameters = parameters.into_pyarray(py).reshape([rows, p])?;
            ledger.set_item(name, (start, parameters))?;
        }
        dict.set_item("ledger", ledger)?;
        let events = PyList::empty(py);
        for (name, time, along) in self.events {
            let one = PyDict::new(py);
            one.set_item("name", name)?;
            one.set_item("t", time)?;
            match along {
                Ok([time_start, time_parameters, start, parameters]) => {
                    one.set_item("time_along_start", time_start.into_pyarray(py))?;
                    one.set_item("time_along_parameters", time_parameters.into_pyarray(py))?;
                    one.set_item(
                        "along_start",
                        start.into_pyarray(py).reshape([self.entries, n])?,
                    )?;
                    one.set_item(
                        "along_parameters",
                        parameters.into_pyarray(py).reshape([self.entries, p])?,
                    )?;
                }
                Err(message) => one.set_item("error", message)?,
            }
            events.append(one)?;
        }
        dict.set_item("events", events)?;
        dict.set_item("certificate", written(py, &self.certificate)?)?;
        let Sensitivity { steps, energy, invariants, entropy, frozen, undamped, at_rest, .. } =
            self.sensitivity;
        let laws = PyDict::new(py);
        laws.set_item("text", self.sensitivity.to_string())?;
        laws.set_item("steps", steps)?;
        laws.set_item("energy", energy)?;
        laws.set_item("invariants", invariants)?;
        laws.set_item("entropy", entropy)?;
        laws.set_item("frozen", frozen)?;
        laws.set_item("undamped", undamped)?;
        laws.set_item("at_rest", at_rest)?;
        dict.set_item("sensitivity", laws)?;
        Ok(dict)
    }
}

/// A request for a run with derivatives.
struct Asked {
    start: Vec<f64>,
    schedule: Schedule,
    events: Vec<Watched>,
    method: AnyMethod,
    accuracy: Option<f64>,
    look: Arc<Look>,
}

impl Asked {
    fn schedule<F: Smooth>(&self, derivatives: Derivatives) -> Schedule {
        let schedule = watching::<Element<F>>(self.schedule.clone(), &self.events, derivatives);
        noting::<Element<F>>(schedule, &self.look)
    }

    fn begin<F: Listed>(&self, flow: &F) -> PyResult<Element<F>> {
        flow.at_start(&self.start).map_err(|error| of_model(&Broken::Start(error)))
    }

    /// Runs with a tangent.
    fn tangent<F, D>(
        &self,
        system: &D,
        flow: &F,
        p: usize,
        names: Option<&Names>,
        derivatives: Derivatives,
    ) -> PyResult<Tangent>
    where
        F: Smooth,
        AnyMethod: Stepper<F>,
        D: Differentiated<AnyMethod, Flow = F>,
    {
        let x0 = self.begin(flow)?;
        let n = directions(flow);
        let schedule = self.schedule::<F>(derivatives);
        let run = match self.accuracy {
            Some(accuracy) => self.method.tangent_to(system, x0, schedule, accuracy),
            None => self.method.tangent(system, x0, schedule),
        };
        let run = run.map_err(|error| of_tangent(&error))?;
        Ok(Tangent::of(flow, n, p, names, &run, &self.events))
    }

    /// Runs, asks for the weights of the recorded states, and pulls them back to the start.
    fn gradient<F, D>(
        &self,
        system: &D,
        flow: &F,
        p: usize,
        names: Option<&Names>,
        (weigh, derivatives): (&Py<PyAny>, Derivatives),
    ) -> PyResult<Gradient>
    where
        F: Smooth,
        AnyMethod: Stepper<F>,
        D: Differentiated<AnyMethod, Flow = F>,
    {
        let x0 = self.begin(flow)?;
        let n = directions(flow);
        let schedule = self.schedule::<F>(derivatives);
        let run = self.method.adjoint(system, x0, schedule).map_err(|error| of_tangent(&error))?;
        let output =
            Output::from_parts((flow, names), run.states(), &[], (run.certificate(), run.ending()));
        let (value, weights) = weighed(output, weigh)?;
        let entries = weights.len() / run.states().len().max(1);
        let row = |k: usize| &weights[k * entries..][..entries];
        let term = |k: usize, x: &Vec<Real>| {
            x.iter().zip(row(k)).fold(Real::from(0.0), |sum, (x, w)| sum + *x * *w)
        };
        let pulled = run.gradient(term).map_err(|error| of_tangent(&error))?;
        let start = pulled.along_start();
        Ok(Gradient {
            value,
            along_start: start.rows(0, n).iter().copied().collect(),
            along_parameters: pulled.along_parameters().rows(0, p).iter().copied().collect(),
        })
    }
}

/// The directions of the chart at a point, without the clock and the ledger.
fn directions<F: SmoothFlow>(flow: &F) -> usize {
    flow.clock().unwrap_or_else(|| flow.directions())
}

/// A loss with its gradient.
#[derive(Debug)]
struct Gradient {
    value: f64,
    along_start: Vec<f64>,
    along_parameters: Vec<f64>,
}

/// Calls `weigh` with the recorded run: it returns the loss, and its derivatives along the entries of each state.
fn weighed(output: Output, weigh: &Py<PyAny>) -> PyResult<(f64, Vec<f64>)> {
    Python::attach(|py| {
        let rows = output.rows();
        let run = output.into_dict(py)?;
        let (value, weights): (f64, PyReadonlyArray2<'_, f64>) =
            weigh.call1(py, (run,))?.extract(py)?;
        if weights.as_array().dim() != rows {
            let (found, expected) = (weights.as_array().dim(), rows);
            return Err(bad(format!(
                "the weights have the shape {found:?}, and the states {expected:?}"
            )));
        }
        Ok((value, weights.as_array().iter().copied().collect()))
    })
}

/// Runs a system with the derivatives of its states.
#[pyfunction]
#[pyo3(signature = (system, chosen, start, times, events, along, sizes, accuracy, progress))]
#[expect(clippy::too_many_arguments, reason = "they are the arguments of Python")]
pub(crate) fn tangent<'py>(
    py: Python<'py>,
    system: &Bound<'py, RawSystem>,
    chosen: Chosen,
    start: PyReadonlyArray1<'_, f64>,
    times: Times,
    events: Vec<Event<'_>>,
    along: Vec<usize>,
    sizes: Vec<f64>,
    accuracy: Option<f64>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let system = system.get();
    let asked = system.asked(&chosen, &start, &times, &events, accuracy, progress)?;
    let along = system.along(along, sizes)?;
    let done = caught(|| py.detach(|| system.tangent_of(&asked, &along)));
    if let Some(error) = asked.look.take_error() {
        return Err(error);
    }
    done?.into_dict(py)
}

/// A loss, and its derivatives along the start and the parameters.
type Graded<'py> = (f64, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>);

/// Runs a system, and pulls a loss over its states back to the start and the parameters.
#[pyfunction]
#[pyo3(signature = (system, chosen, start, times, events, weigh, along, sizes))]
#[expect(clippy::too_many_arguments, reason = "they are the arguments of Python")]
pub(crate) fn pull_back<'py>(
    py: Python<'py>,
    system: &Bound<'py, RawSystem>,
    chosen: Chosen,
    start: PyReadonlyArray1<'_, f64>,
    times: Times,
    events: Vec<Event<'_>>,
    weigh: Py<PyAny>,
    along: Vec<usize>,
    sizes: Vec<f64>,
) -> PyResult<Graded<'py>> {
    let system = system.get();
    let asked = system.asked(&chosen, &start, &times, &events, None, None)?;
    let along = system.along(along, sizes)?;
    let done = caught(|| py.detach(|| system.gradient_of(&asked, &along, &weigh)));
    if let Some(error) = asked.look.take_error() {
        return Err(error);
    }
    let Gradient { value, along_start, along_parameters } = done?;
    Ok((value, along_start.into_pyarray(py), along_parameters.into_pyarray(py)))
}

impl RawSystem {
    fn asked(
        &self,
        chosen: &Chosen,
        start: &PyReadonlyArray1<'_, f64>,
        times: &Times,
        events: &[Event<'_>],
        accuracy: Option<f64>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Asked> {
        if self.has_noise() {
            return Err(bad(
                "derivatives of runs with noise are not reachable from Python; leave the noise out",
            ));
        }
        Ok(Asked {
            start: start.as_array().to_vec(),
            schedule: times.schedule()?,
            events: self.events(events)?,
            method: chosen.method()?,
            accuracy,
            look: Look::new(progress),
        })
    }

    fn along(&self, places: Vec<usize>, sizes: Vec<f64>) -> PyResult<Along> {
        if sizes.len() != places.len() || places.iter().any(|&k| k >= self.theta.len()) {
            return Err(bad("a size is expected for each parameter, and a place among them"));
        }
        let names = places.iter().map(|&k| self.names.get(k).copied().unwrap_or("")).collect();
        Ok(Along { places, sizes, names })
    }

    /// The recorded system at these parameters. Steps beside others ask for the same ones again and again.
    fn kept(&self, kept: &Beside, theta: &[f64]) -> PyResult<Parts> {
        let bits: Vec<u64> = theta.iter().map(|value| value.to_bits()).collect();
        if let Some(parts) = kept.borrow().get(&bits) {
            return Ok(Arc::clone(parts));
        }
        let parts = self.parts_at(theta)?;
        let mut kept = kept.borrow_mut();
        if kept.len() >= MOST_KEPT {
            kept.clear();
        }
        kept.insert(bits, Arc::clone(&parts));
        Ok(parts)
    }

    fn tangent_of(&self, asked: &Asked, along: &Along) -> PyResult<Tangent> {
        let (names, look, p) = (self.ledger_names(), &asked.look, along.places.len());
        let names = names.as_ref();
        if let Some(open) = self.open(&self.theta, look)? {
            if p == 0 {
                return asked.tangent(&open, &open, p, names, Derivatives::Start);
            }
            let kept = Beside::default();
            let build = |theta: &[f64], _: bool| {
                let open = self.open_with(self.kept(&kept, theta)?, theta, look);
                open.ok_or_else(|| bad("the system is closed"))
            };
            return self.along_parameters(along, &build, &|system| {
                asked.tangent(system, &**system, p, names, Derivatives::Parameters)
            });
        }
        if p == 0 {
            let closed = self.closed(&self.theta, look)?;
            return asked.tangent(&closed, &closed, p, names, Derivatives::Start);
        }
        let kept = Beside::default();
        let build = |theta: &[f64], is_here: bool| {
            let parts = if is_here {
                self.parts_along(theta, &along.places)
            } else {
                self.kept(&kept, theta)
            };
            Ok(self.closed_with(parts?, look))
        };
        self.along_parameters(along, &build, &|system| {
            asked.tangent(system, &**system, p, names, Derivatives::Parameters)
        })
    }

    fn gradient_of(&self, asked: &Asked, along: &Along, weigh: &Py<PyAny>) -> PyResult<Gradient> {
        let (names, look, p) = (self.ledger_names(), &asked.look, along.places.len());
        let names = names.as_ref();
        if let Some(open) = self.open(&self.theta, look)? {
            if p == 0 {
                return asked.gradient(&open, &open, p, names, (weigh, Derivatives::Start));
            }
            let kept = Beside::default();
            let build = |theta: &[f64], _: bool| {
                let open = self.open_with(self.kept(&kept, theta)?, theta, look);
                open.ok_or_else(|| bad("the system is closed"))
            };
            return self.along_parameters(along, &build, &|system| {
                asked.gradient(system, &**system, p, names, (weigh, Derivatives::Parameters))
            });
        }
        if p == 0 {
            let closed = self.closed(&self.theta, look)?;
            return asked.gradient(&closed, &closed, p, names, (weigh, Derivatives::Start));
        }
        let kept = Beside::default();
        let build = |theta: &[f64], is_here: bool| {
            let parts = if is_here {
                self.parts_along(theta, &along.places)
            } else {
                self.kept(&kept, theta)
            };
            Ok(self.closed_with(parts?, look))
        };
        self.along_parameters(along, &build, &|system| {
            asked.gradient(system, &**system, p, names, (weigh, Derivatives::Parameters))
        })
    }

    /// Calls `work` with the system whose parameters have derivatives, from a function that builds the one at values of all parameters;
    /// it is told whether they are those of the run, and not beside these.
    fn along_parameters<F, T>(
        &self,
        along: &Along,
        build: &dyn Fn(&[f64], bool) -> PyResult<F>,
        work: &dyn Fn(&SystemAt<'_, F>) -> PyResult<T>,
    ) -> PyResult<T> {
        let Along { places, sizes, names } = along;
        // A parameter is its size, displaced by as much as the true one: so zero has a size too.
        let displaced = |phi: &[f64]| {
            let mut theta = self.theta.to_vec();
            for ((&place, phi), size) in places.iter().zip(phi).zip(sizes) {
                theta[place] += phi - size;
            }
            build(&theta, phi == sizes.as_slice())
        };
        work(&SystemAt::listed(names, sizes, displaced)?)
    }
}

/// Evaluates a recorded function of one list of numbers, and its gradient.
#[pyfunction]
pub(crate) fn gradient<'py>(
    py: Python<'py>,
    program: &Bound<'py, PyAny>,
    x: PyReadonlyArray1<'_, f64>,
) -> PyResult<(f64, Bound<'py, PyArray1<f64>>)> {
    let (tape, x) = (tape(program)?, x.as_array().to_vec());
    if tape.inputs() != x.len() || tape.outputs().len() != 1 {
        return Err(bad(
            "the gradient is that of a function with one number, at as many numbers as it was recorded with",
        ));
    }
    let mut df = vec![0.0; x.len()];
    let value = py.detach(|| tape.gradient(&x, &mut df));
    Ok((value, df.into_pyarray(py)))
}

/// Evaluates a recorded function.
#[pyfunction]
pub(crate) fn evaluate<'py>(
    py: Python<'py>,
    program: &Bound<'py, PyAny>,
    x: PyReadonlyArray2<'_, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (tape, x) = (tape(program)?, x.as_array());
    if x.ncols() != tape.inputs() {
        return Err(bad(format!(
            "rows of {} numbers are expected, not of {}",
            tape.inputs(),
            x.ncols()
        )));
    }
    let (rows, count) = (x.nrows(), tape.outputs().len());
    let mut all = vec![0.0; rows * count];
    for (k, row) in x.rows().into_iter().enumerate() {
        tape.evaluate(&row.to_vec(), &mut all[k * count..][..count]);
    }
    all.into_pyarray(py).reshape([rows, count])
}

/// The values of a recorded function at rows of numbers, and their derivatives.
type Slopes<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray3<f64>>);

/// Evaluates a recorded function and the derivatives of its outputs at rows of numbers.
#[pyfunction]
pub(crate) fn jacobian<'py>(
    py: Python<'py>,
    program: &Bound<'py, PyAny>,
    x: PyReadonlyArray2<'_, f64>,
) -> PyResult<Slopes<'py>> {
    let (tape, x) = (tape(program)?, x.as_array());
    if x.ncols() != tape.inputs() {
        return Err(bad(format!(
            "rows of {} numbers are expected, not of {}",
            tape.inputs(),
            x.ncols()
        )));
    }
    let [rows, inputs, outputs] = [x.nrows(), x.ncols(), tape.outputs().len()];
    let (mut values, mut slopes) = (vec![0.0; rows * outputs], vec![0.0; rows * outputs * inputs]);
    for (k, row) in x.rows().into_iter().enumerate() {
        let row = row.to_vec();
        for i in 0..outputs {
            let mut weights = vec![0.0; outputs];
            weights[i] = 1.0;
            let value = &mut values[k * outputs..][..outputs];
            tape.pull_back(
                &row,
                &weights,
                value,
                &mut slopes[(k * outputs + i) * inputs..][..inputs],
            );
        }
    }
    let values = values.into_pyarray(py).reshape([rows, outputs])?;
    Ok((values, slopes.into_pyarray(py).reshape([rows, outputs, inputs])?))
}
