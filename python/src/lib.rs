//! The Python package `metriplectic`: functions that are recorded once, and runs without an interpreter.

mod door;
pub mod model;

use pyo3::prelude::*;

/// The extension module.
#[pymodule]
mod _metriplectic {
    #[pymodule_export]
    use super::door::derivatives::{evaluate, gradient, jacobian, pull_back, tangent};
    #[pymodule_export]
    use super::door::errors::{Error, ModelError, RunError, SpanError, TraceError};
    #[pymodule_export]
    use super::door::fits::least_squares;
    #[pymodule_export]
    use super::door::system::RawSystem;
}
