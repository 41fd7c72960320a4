//! The Python package `metriplectic`: functions that are recorded once, and runs without an interpreter.

use pyo3::prelude::*;

/// The extension module.
#[pymodule]
mod _metriplectic {}
