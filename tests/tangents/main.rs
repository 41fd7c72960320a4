//! Tangents of systems of any kind: in plain numbers, and by differences of steps.

mod beside;
mod corners;
mod exact;
mod families;
mod in_numbers;
mod parameters;

use nalgebra::DMatrix;

/// The largest difference relative to the largest entry.
pub(crate) fn off(a: &DMatrix<f64>, b: &DMatrix<f64>) -> f64 {
    (a - b).amax() / b.amax()
}
