//! The definition of a system as Python says it.

use std::collections::HashSet;
use std::sync::{Mutex, PoisonError};

use metriplectic_equations::Kind;
use metriplectic_recording::Tape;
use pyo3::prelude::*;

use super::errors::{ModelError, bad, in_python};
use super::tapes::tape;
use crate::model::{Bracket, Definition, DefinitionError, Friction, Space};

/// A part of a system: a word, and a recording or numbers with it.
type Part<'py> = (String, Option<Bound<'py, PyAny>>);

/// The parts of a system, which are attributes of an object.
#[derive(Debug, FromPyObject)]
struct Parts<'py> {
    factors: Vec<(String, usize, Vec<f64>)>,
    parameters: Vec<String>,
    energy: Bound<'py, PyAny>,
    entropy: Option<Bound<'py, PyAny>>,
    invariants: Vec<(String, Bound<'py, PyAny>)>,
    bracket: Part<'py>,
    friction: Part<'py>,
    metric: Option<Bound<'py, PyAny>>,
}

/// The exception of a definition.
pub(crate) fn refused(error: &DefinitionError) -> PyErr {
    ModelError::new_err(in_python(&error.to_string()))
}

/// Reads a definition, and the names of its parameters.
///
/// # Errors
///
/// The exception of the part that makes no sense.
pub(crate) fn read(parts: &Bound<'_, PyAny>) -> PyResult<(Definition, Vec<&'static str>)> {
    let parts: Parts<'_> = parts.extract()?;
    let owned = |program: &Bound<'_, PyAny>| tape(program).map(|tape| Tape::clone(&tape));
    let spaces = parts.factors.iter().map(|(kind, n, numbers)| factor(kind, *n, numbers));
    let mut spaces = spaces.collect::<PyResult<Vec<_>>>()?;
    let kinds: Vec<&str> = parts.factors.iter().map(|(kind, ..)| kind.as_str()).collect();
    let space = match spaces.len() {
        1 => spaces.remove(0),
        _ => Space::product(spaces).map_err(|error| refused(&error))?,
    };
    let invariants = parts.invariants.iter().map(|(kind, program)| {
        let kind = if kind == "momentum" { Kind::Momentum } else { Kind::Casimir };
        Ok((kind, owned(program)?))
    });
    let names = parts.parameters.iter().map(|name| kept(name)).collect();
    let definition = Definition {
        space,
        energy: owned(&parts.energy)?,
        entropy: parts.entropy.as_ref().map(owned).transpose()?,
        invariants: invariants.collect::<PyResult<_>>()?,
        bracket: bracket(&parts.bracket, &kinds)?,
        friction: friction(&parts.friction)?,
        metric: parts.metric.as_ref().map(owned).transpose()?,
        parameters: parts.parameters,
    };
    Ok((definition, names))
}

/// Makes a space that is no product.
fn factor(kind: &str, n: usize, numbers: &[f64]) -> PyResult<Space> {
    let made = match kind {
        "R" => Space::euclidean(n),
        "dual" => {
            let constant = |(k, value): (usize, &f64)| (k / (n * n), k / n % n, k % n, *value);
            let constants = numbers.iter().enumerate().map(constant);
            Space::lie_dual(n, &constants.filter(|(.., value)| *value != 0.0).collect::<Vec<_>>())
        }
        "sphere" => Space::sphere(n),
        "SO3" => Ok(Space::rotations()),
        "cotangent_so3" => Ok(Space::cotangent_rotations()),
        "half_line" => Ok(Space::half_line()),
        other => return Err(bad(format!("there is no space \"{other}\""))),
    };
    made.map_err(|error| refused(&error))
}

/// The bracket that a space of this kind has by itself.
fn own(kind: &str) -> Bracket {
    match kind {
        "dual" => Bracket::LiePoisson,
        "cotangent_so3" => Bracket::Canonical,
        _ => Bracket::None,
    }
}

fn bracket((word, given): &Part<'_>, kinds: &[&str]) -> PyResult<Bracket> {
    match (word.as_str(), given) {
        ("named", Some(names)) => {
            let names: Vec<String> = names.extract()?;
            let named = |(name, kind): (&String, &&str)| match name.as_str() {
                "own" => Ok(own(kind)),
                "symplectic" => Ok(Bracket::Canonical),
                "area" => Ok(Bracket::AreaForm),
                "none" => Ok(Bracket::None),
                other => Err(bad(format!("there is no bracket \"{other}\""))),
            };
            let mut brackets = names.iter().zip(kinds).map(named).collect::<PyResult<Vec<_>>>()?;
            Ok(if brackets.len() == 1 { brackets.remove(0) } else { Bracket::Sum(brackets) })
        }
        ("constant", Some(numbers)) => Ok(Bracket::Constant(numbers.extract()?)),
        (word, Some(program)) => {
            let tape = Tape::clone(&*tape(program)?);
            Ok(Bracket::Recorded { tape, is_poisson: word == "poisson" })
        }
        (word, None) => Err(bad(format!("the bracket \"{word}\" has no function"))),
    }
}

fn friction((word, program): &Part<'_>) -> PyResult<Friction> {
    let tape = program.as_ref().map(|program| tape(program).map(|tape| Tape::clone(&tape)));
    match (word.as_str(), tape.transpose()?) {
        ("metric", factor) => Ok(Friction::Metric { factor }),
        ("matrix", Some(tape)) => Ok(Friction::Recorded(tape)),
        ("contacts", Some(tape)) => Ok(Friction::Contacts(tape)),
        _ => Ok(Friction::None),
    }
}

/// Names that last as long as the program, each of them once.
static NAMES: Mutex<Option<HashSet<&'static str>>> = Mutex::new(None);

/// Keeps a name as long as the program: those of parameters are few, and systems that are made again have the same.
fn kept(name: &str) -> &'static str {
    let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    let names = names.get_or_insert_with(HashSet::new);
    if let Some(known) = names.get(name) {
        return known;
    }
    let new: &'static str = Box::leak(name.to_owned().into_boxed_str());
    names.insert(new);
    new
}
