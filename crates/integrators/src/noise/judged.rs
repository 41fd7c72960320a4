//! The interface between the verification of a system with noise and the model below the noise.

use crate::step::{Element, Flow};

/// A flow whose model is judged around a state: a closed system, an open one, or a lattice. With it
/// [`Noisy`](super::Noisy) has [`verify`](super::Noisy::verify), [`report`](super::Noisy::report) and
/// [`verified`](super::Noisy::verified).
pub trait Judged: Flow {
    /// The law that is broken.
    type Broken: std::error::Error + 'static;

    /// The list of the laws.
    type Report;

    /// Returns the radius of [`verify_model`](Self::verify_model) before a run.
    fn radius() -> f64;

    /// Checks the laws of the model at `x0` and at states around it, each coordinate within `radius` times its size there.
    ///
    /// # Errors
    ///
    /// The first law that is broken, with the place and the size of the violation.
    fn verify_model(&self, x0: &Element<Self>, radius: f64) -> Result<(), Self::Broken>;

    /// Lists the residual of every law of the model around a state.
    fn report_model(&self, x0: &Element<Self>) -> Self::Report;

    /// Returns whether the model of a report keeps its laws.
    fn is_sound(report: &Self::Report) -> bool;
}
