//! Ports and baths as Python says them.

use std::sync::Arc;

use metriplectic_dynamics::exchange::Temperature;
use metriplectic_integrators::FromEquations;
use metriplectic_recording::Tape;
use pyo3::prelude::*;

use super::errors::bad;
use super::interrupt::Interruptible;
use super::kinds::Open;
use super::output::Names;
use super::tapes::tape;

/// A port: the velocity `F(x, t, θ)`.
#[derive(Clone, Debug)]
struct Port {
    name: Arc<str>,
    velocity: Arc<Tape>,
}

/// The temperature of a bath.
#[derive(Clone, Debug)]
enum Warmth {
    Number(f64),
    /// `T(x, t, θ)`, which does not depend on the state.
    Function(Arc<Tape>),
}

/// A bath: its temperature and, for each contact, the rate and the direction as functions of `(x, w, t, θ)`.
#[derive(Clone, Debug)]
struct Bath {
    name: Arc<str>,
    temperature: Warmth,
    contacts: Arc<Tape>,
}

/// The surroundings of an open system, as functions of parameters.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surroundings {
    ports: Vec<Port>,
    baths: Vec<Bath>,
}

/// A temperature at values of parameters.
struct WarmthAt {
    warmth: Warmth,
    theta: Arc<[f64]>,
}

impl Temperature for WarmthAt {
    fn at(&self, t: f64) -> f64 {
        match &self.warmth {
            Warmth::Number(number) => *number,
            Warmth::Function(tape) => {
                let mut inputs = vec![0.0; tape.inputs()];
                let clock = tape.inputs() - self.theta.len() - 1;
                inputs[clock] = t;
                inputs[clock + 1..].copy_from_slice(&self.theta);
                tape.value(&inputs)
            }
        }
    }
}

impl Surroundings {
    /// Reads ports `(name, velocity)` and baths `(name, temperature, contacts)` of a system with so many entries, directions and
    /// parameters.
    ///
    /// # Errors
    ///
    /// `ValueError` if a recording has other lengths.
    pub(crate) fn read(
        ports: &[(String, Bound<'_, PyAny>)],
        baths: &[(String, Bound<'_, PyAny>, Bound<'_, PyAny>)],
        [entries, directions, parameters]: [usize; 3],
    ) -> PyResult<Self> {
        let mut read = Self::default();
        let expect = |what: &str, found: usize, expected: usize| {
            if found == expected {
                Ok(())
            } else {
                Err(bad(format!("{what} has {found} numbers, and {expected} are expected")))
            }
        };
        for (name, velocity) in ports {
            let velocity = tape(velocity)?;
            expect(
                &format!("the input of the port `{name}`"),
                velocity.inputs(),
                entries + 1 + parameters,
            )?;
            expect(
                &format!("the velocity of the port `{name}`"),
                velocity.outputs().len(),
                directions,
            )?;
            read.ports.push(Port { name: name.as_str().into(), velocity });
        }
        for (name, temperature, contacts) in baths {
            let temperature = match temperature.extract::<f64>() {
                Ok(number) => Warmth::Number(number),
                Err(_) => Warmth::Function(tape(temperature)?),
            };
            if let Warmth::Function(tape) = &temperature {
                expect(
                    &format!("the input of the temperature of `{name}`"),
                    tape.inputs(),
                    entries + 1 + parameters,
                )?;
                expect(&format!("the temperature of `{name}`"), tape.outputs().len(), 1)?;
            }
            let contacts = tape(contacts)?;
            let (inputs, outputs) =
                (entries + directions + 1 + parameters, contacts.outputs().len());
            expect(&format!("the input of the contacts of `{name}`"), contacts.inputs(), inputs)?;
            if outputs == 0 || !outputs.is_multiple_of(directions + 1) {
                return Err(bad(format!(
                    "a contact of the bath `{name}` has a rate and {directions} numbers, and {outputs} numbers are no list of such"
                )));
            }
            read.baths.push(Bath { name: name.as_str().into(), temperature, contacts });
        }
        Ok(read)
    }

    /// The names of ports and baths.
    pub(crate) fn names(&self) -> Names {
        Names {
            ports: self.ports.iter().map(|port| port.name.to_string()).collect(),
            baths: self.baths.iter().map(|bath| bath.name.to_string()).collect(),
        }
    }

    /// How many contacts each bath has in `n` directions.
    pub(crate) fn contacts(&self, n: usize) -> Vec<usize> {
        self.baths.iter().map(|bath| bath.contacts.outputs().len() / (n + 1)).collect()
    }

    /// The system in these surroundings, at values of the parameters.
    pub(crate) fn around(&self, system: Interruptible, theta: &Arc<[f64]>) -> Open {
        let mut open = FromEquations(system).opened();
        for Port { name, velocity } in &self.ports {
            let (velocity, theta) = (Arc::clone(velocity), Arc::clone(theta));
            open = open.work(Arc::clone(name), move |t, x, v| {
                let inputs: Vec<f64> =
                    x.iter().copied().chain([t]).chain(theta.iter().copied()).collect();
                velocity.evaluate(&inputs, v);
            });
        }
        for Bath { name, temperature, contacts } in &self.baths {
            let warmth = WarmthAt { warmth: temperature.clone(), theta: Arc::clone(theta) };
            let (contacts, theta) = (Arc::clone(contacts), Arc::clone(theta));
            open = open.bath(Arc::clone(name), warmth, move |at, contact| {
                let state = at.x.iter().chain(at.w).copied();
                let inputs: Vec<f64> = state.chain([at.t]).chain(theta.iter().copied()).collect();
                let mut outputs = vec![0.0; contacts.outputs().len()];
                contacts.evaluate(&inputs, &mut outputs);
                for one in outputs.chunks_exact(at.w.len() + 1) {
                    let along = one[1..].iter().copied().enumerate();
                    let along: Vec<(usize, f64)> = along.filter(|(_, b)| *b != 0.0).collect();
                    contact(one[0], &along);
                }
            });
        }
        open
    }
}
