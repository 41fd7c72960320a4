//! Least squares, by the solver of the library.

use argmin::core::{Executor, State as _, TerminationReason};
use metriplectic_fitting::{LeastSquares, LevenbergMarquardt, Squares};
use nalgebra::{DMatrix, DVector};
use numpy::{IntoPyArray, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use super::errors::{RunError, caught};

/// Residuals and their Jacobian from a function of Python, which returns None outside of the domain.
struct Residuals<'a> {
    function: &'a Py<PyAny>,
    error: &'a std::sync::Mutex<Option<PyErr>>,
}

impl Residuals<'_> {
    fn evaluate(&self, phi: &[f64]) -> PyResult<Option<Squares>> {
        Python::attach(|py| {
            let found = self.function.call1(py, (phi.to_vec().into_pyarray(py),))?;
            if found.is_none(py) {
                return Ok(None);
            }
            let (residuals, jacobian): (PyReadonlyArray1<'_, f64>, PyReadonlyArray2<'_, f64>) =
                found.extract(py)?;
            let (residuals, jacobian) = (residuals.as_array(), jacobian.as_array());
            Ok(Some(Squares {
                residuals: DVector::from_iterator(residuals.len(), residuals.iter().copied()),
                jacobian: DMatrix::from_row_iterator(
                    jacobian.nrows(),
                    jacobian.ncols(),
                    jacobian.iter().copied(),
                ),
            }))
        })
    }
}

impl LeastSquares for Residuals<'_> {
    fn squares(&self, phi: &[f64]) -> Option<Squares> {
        let mut error = self.error.lock().ok()?;
        if error.is_some() {
            return None;
        }
        match self.evaluate(phi) {
            Ok(found) => found,
            Err(raised) => {
                *error = Some(raised);
                None
            }
        }
    }
}

/// Minimises a sum of squares from a guess by the method of Levenberg and Marquardt. Returns the point, and whether a minimum was
/// reached.
#[pyfunction]
pub(crate) fn least_squares<'py>(
    py: Python<'py>,
    function: Py<PyAny>,
    guess: Vec<f64>,
    limits: Vec<f64>,
    iterations: u64,
) -> PyResult<(Bound<'py, numpy::PyArray1<f64>>, bool)> {
    let error = std::sync::Mutex::new(None);
    let problem = Residuals { function: &function, error: &error };
    let solver = LevenbergMarquardt { limits, ..LevenbergMarquardt::default() };
    let (best, converged) = caught(|| {
        let executor = Executor::new(&problem, solver)
            .configure(|state| state.param(guess).max_iters(iterations));
        let found = executor.run().map_err(|error| RunError::new_err(error.to_string()))?;
        let converged =
            found.state().get_termination_reason() == Some(&TerminationReason::SolverConverged);
        Ok((found.state().get_best_param().cloned(), converged))
    })
    .map_err(|refused| error.lock().ok().and_then(|mut error| error.take()).unwrap_or(refused))?;
    if let Some(raised) = error.lock().ok().and_then(|mut error| error.take()) {
        return Err(raised);
    }
    let best =
        best.ok_or_else(|| RunError::new_err("the fit has found no parameters with a run"))?;
    Ok((best.into_pyarray(py), converged))
}
