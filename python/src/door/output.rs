//! Runs as arrays.

use metriplectic_integrators::{Certificate, Ending, Event, InvariantBalance, State, Trajectory};
use numpy::{IntoPyArray, PyArrayMethods as _};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use super::kinds::{Kind, Recorded as _};
use super::schedule::{PROGRESS, Point as _};

/// The names of ports and baths.
#[derive(Clone, Debug, Default)]
pub(crate) struct Names {
    pub(crate) ports: Vec<String>,
    pub(crate) baths: Vec<String>,
}

/// States as rows of numbers.
#[derive(Debug, Default)]
struct Rows {
    step: Vec<usize>,
    t: Vec<f64>,
    y: Vec<f64>,
    /// The energy and the entropy of the system.
    fields: [Vec<f64>; 2],
    /// The balance of the energy, and the entropy with that of the baths.
    laws: [Vec<f64>; 2],
    /// The columns of the ledger, with their names.
    ledger: Vec<(String, Vec<f64>)>,
}

impl Rows {
    /// The rows of a system with these ports and baths.
    fn new(names: Option<&Names>) -> Self {
        let column = |name: String| (name, Vec::new());
        let ledger = names.map_or_else(Vec::new, |names| {
            let whole = ["work", "event work", "event heat"].map(str::to_owned);
            let ports = names.ports.iter().map(|name| format!("work of {name}"));
            let baths = names.baths.iter();
            let baths =
                baths.flat_map(|name| [format!("heat of {name}"), format!("entropy of {name}")]);
            whole.into_iter().chain(ports).chain(baths).map(column).collect()
        });
        Self { ledger, ..Self::default() }
    }

    fn push<F: Kind>(&mut self, flow: &F, names: Option<&Names>, state: &State<F::Space>) {
        self.step.push(state.step);
        self.t.push(state.time);
        self.y.extend_from_slice(state.point.entries());
        let here = flow.fields(state);
        self.fields.iter_mut().zip(here).for_each(|(column, number)| column.push(number));
        let laws = [state.energy, state.entropy];
        self.laws.iter_mut().zip(laws).for_each(|(column, number)| column.push(number));
        let (Some(ledger), Some(names)) = (state.point.ledger(), names) else { return };
        let whole = [ledger.parameter_work(), ledger.event_work(), ledger.event_heat()];
        let ports = names.ports.iter().map(|name| ledger.work(name));
        let baths = names.baths.iter();
        let baths = baths.flat_map(|name| [ledger.heat(name), ledger.bath_entropy(name)]);
        let numbers = whole.into_iter().chain(ports.chain(baths).map(|x| x.unwrap_or(f64::NAN)));
        self.ledger.iter_mut().zip(numbers).for_each(|((_, column), number)| column.push(number));
    }

    fn into_dict<'py>(self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let Self { step, t, y, fields: [energy, entropy], laws: [balance, total], ledger } = self;
        let (rows, dict) = (t.len(), PyDict::new(py));
        let entries = y.len() / rows.max(1);
        let step: Vec<i64> =
            step.into_iter().map(|k| i64::try_from(k).unwrap_or(i64::MAX)).collect();
        dict.set_item("step", step.into_pyarray(py))?;
        dict.set_item("t", t.into_pyarray(py))?;
        dict.set_item("y", y.into_pyarray(py).reshape([rows, entries])?)?;
        dict.set_item("energy", energy.into_pyarray(py))?;
        dict.set_item("entropy", entropy.into_pyarray(py))?;
        dict.set_item("balance", balance.into_pyarray(py))?;
        dict.set_item("total_entropy", total.into_pyarray(py))?;
        let columns = PyDict::new(py);
        for (name, column) in ledger {
            columns.set_item(name, column.into_pyarray(py))?;
        }
        dict.set_item("ledger", columns)?;
        Ok(dict)
    }
}

/// An event, and the state after its jump.
#[derive(Debug)]
struct Found {
    name: String,
    index: usize,
    rises: bool,
    time: f64,
    y: Vec<f64>,
    after: Option<Vec<f64>>,
    work: f64,
    heat: f64,
}

/// A run as numbers and words: what is left of it without the types of the library.
#[derive(Debug)]
pub(crate) struct Output {
    rows: Rows,
    events: Vec<Found>,
    certificate: Box<Certificate>,
    ending: (&'static str, String),
}

impl Output {
    /// Writes a run down.
    pub(crate) fn of<F: Kind>(flow: &F, names: Option<&Names>, run: &Trajectory<F::Space>) -> Self {
        let of = (flow, names);
        Self::from_parts(of, run.states(), run.events(), (run.certificate(), run.ending()))
    }

    /// Writes down what a run has recorded.
    pub(crate) fn from_parts<F: Kind>(
        (flow, names): (&F, Option<&Names>),
        states: &[State<F::Space>],
        events: &[Event<F::Space>],
        (certificate, ending): (&Certificate, Ending),
    ) -> Self {
        let mut rows = Rows::new(names);
        states.iter().for_each(|state| rows.push(flow, names, state));
        let found = |event: &Event<F::Space>| {
            let jump = event.jump.as_ref();
            Found {
                name: event.name.to_string(),
                index: event.index,
                rises: event.rises,
                time: event.state.time,
                y: event.state.point.entries().to_vec(),
                after: jump.map(|jump| jump.after.point.entries().to_vec()),
                work: jump.map_or(0.0, |jump| jump.exchange.work),
                heat: jump.map_or(0.0, |jump| jump.exchange.heat),
            }
        };
        let events: Vec<Found> =
            events.iter().filter(|event| &*event.name != PROGRESS).map(found).collect();
        let ending = match ending {
            Ending::Span => ("end", String::new()),
            Ending::Rest { .. } => ("rest", String::new()),
            Ending::Event { .. } => {
                ("event", events.last().map_or_else(String::new, |event| event.name.clone()))
            }
            _ => ("stopped", String::new()),
        };
        Self { rows, events, certificate: Box::new(certificate.clone()), ending }
    }

    /// The number of states and of their entries.
    pub(crate) fn rows(&self) -> (usize, usize) {
        let states = self.rows.t.len();
        (states, self.rows.y.len() / states.max(1))
    }

    /// Hands a run over to Python.
    ///
    /// # Errors
    ///
    /// Errors of the interpreter.
    pub(crate) fn into_dict<'py>(self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let Self { rows, events, certificate, ending } = self;
        let dict = rows.into_dict(py)?;
        let list = PyList::empty(py);
        for event in events {
            let Found { name, index, rises, time, y, after, work, heat } = event;
            let one = PyDict::new(py);
            one.set_item("name", name)?;
            one.set_item("index", index)?;
            one.set_item("rises", rises)?;
            one.set_item("t", time)?;
            one.set_item("y", y.into_pyarray(py))?;
            one.set_item("after", after.map(|after| after.into_pyarray(py)))?;
            one.set_item("work", work)?;
            one.set_item("heat", heat)?;
            list.append(one)?;
        }
        dict.set_item("events", list)?;
        dict.set_item("certificate", written(py, &certificate)?)?;
        dict.set_item("ending", ending)?;
        Ok(dict)
    }
}

/// The words and the numbers of a certificate.
pub(crate) fn written<'py>(py: Python<'py>, of: &Certificate) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let mut of = of.clone();
    of.event_counts.retain(|event| event.name != PROGRESS);
    dict.set_item("text", of.to_string())?;
    let counts = PyDict::new(py);
    for event in &of.event_counts {
        counts.set_item(&event.name, event.count)?;
    }
    dict.set_item("events", counts)?;
    dict.set_item("steps", of.steps)?;
    dict.set_item("rejected", of.rejected)?;
    dict.set_item("keeps_energy", of.keeps_energy())?;
    dict.set_item("keeps_entropy", of.keeps_entropy())?;
    dict.set_item("keeps_invariants", of.keeps_invariants())?;
    dict.set_item("initial_energy", of.initial_energy)?;
    dict.set_item("max_energy_error", of.max_energy_error)?;
    dict.set_item("max_relative_energy_error", of.max_relative_energy_error())?;
    dict.set_item("initial_entropy", of.initial_entropy)?;
    dict.set_item("entropy_gained", of.entropy_gained)?;
    dict.set_item("entropy_falls", of.entropy_falls)?;
    dict.set_item("min_entropy_increment", of.min_entropy_increment)?;
    dict.set_item("smallest_step", of.smallest_step)?;
    dict.set_item("largest_step", of.largest_step)?;
    dict.set_item("local_error", of.local_error)?;
    dict.set_item("max_manifold_defect", of.max_manifold_defect)?;
    dict.set_item("friction", of.friction)?;
    dict.set_item("is_stiff", of.is_stiff())?;
    dict.set_item("verified_before", of.verified_before)?;
    dict.set_item("newton_iterations", of.effort.iterations)?;
    let invariants = PyList::empty(py);
    for InvariantBalance { kind, initial, max_error, scale, .. } in &of.invariants {
        invariants.append((kind.to_string(), *initial, *max_error, *scale))?;
    }
    dict.set_item("invariants", invariants)?;
    Ok(dict)
}
