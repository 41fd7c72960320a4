//! Recorded functions as they come from Python.

use std::sync::Arc;

use metriplectic_recording::Tape;
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use metriplectic_fields::Scalar;

use super::errors::TraceError;

/// Reads a recording: an object with the attributes `inputs`, `ops`, `operands`, `constants` and `outputs`.
///
/// # Errors
///
/// `TraceError` if the numbers are no recording.
pub(crate) fn tape(program: &Bound<'_, PyAny>) -> PyResult<Arc<Tape>> {
    let inputs: usize = program.getattr("inputs")?.extract()?;
    let ops: PyReadonlyArray1<'_, u32> = program.getattr("ops")?.extract()?;
    let operands: PyReadonlyArray2<'_, u32> = program.getattr("operands")?.extract()?;
    let constants: PyReadonlyArray1<'_, f64> = program.getattr("constants")?.extract()?;
    let outputs: PyReadonlyArray1<'_, u32> = program.getattr("outputs")?.extract()?;
    let (ops, operands, constants) = (ops.as_array(), operands.as_array(), constants.as_array());
    if operands.shape() != [ops.len(), 3] || constants.len() != ops.len() {
        return Err(TraceError::new_err(
            "a recording needs three operands and a constant for each operation",
        ));
    }
    let code = (0..ops.len())
        .map(|k| (ops[k], [0, 1, 2].map(|i| operands[[k, i]]), constants[k]))
        .collect::<Vec<_>>();
    let tape = Tape::from_parts(inputs, code, outputs.as_array().to_vec());
    tape.map(Arc::new).map_err(|error| TraceError::new_err(error.to_string()))
}

/// A recorded function of a state, of the time and of parameters at values of these: `f(x, t, θ)`, or `f(x, w, t, θ)`.
#[derive(Clone, Debug)]
pub(crate) struct Function {
    pub(crate) tape: Arc<Tape>,
    pub(crate) theta: Arc<[f64]>,
}

impl Function {
    /// Evaluates all outputs.
    pub(crate) fn outputs<D: Scalar>(&self, x: &[D], t: D) -> Vec<D> {
        let theta: Vec<D> = self.theta.iter().map(|&value| D::from(value)).collect();
        self.outputs_at(x, t, &theta)
    }

    /// Evaluates all outputs at other parameters.
    pub(crate) fn outputs_at<D: Scalar>(&self, x: &[D], t: D, theta: &[D]) -> Vec<D> {
        let inputs: Vec<D> = x.iter().copied().chain([t]).chain(theta.iter().copied()).collect();
        let mut outputs = vec![D::zero(); self.tape.outputs().len()];
        self.tape.evaluate(&inputs, &mut outputs);
        outputs
    }

    /// Evaluates the one output.
    pub(crate) fn value(&self, x: &[f64], t: f64) -> f64 {
        self.outputs(x, t).first().copied().unwrap_or(f64::NAN)
    }
}
