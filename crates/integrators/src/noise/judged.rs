//! The interface between the verification of a system with noise and the model below the noise.

use metriplectic_dynamics::{ModelError, Report};

use crate::step::{Element, Flow};

/// A flow whose model is judged around a state: a closed system or an open one. With it [`Noisy`](super::Noisy) has
/// [`verify`](super::Noisy::verify), [`report`](super::Noisy::report) and [`verified`](super::Noisy::verified).
pub trait Judged: Flow {
    /// Checks the laws of the model at `x0` and at states around it, each coordinate within `radius` times its size there.
    ///
    /// # Errors
    ///
    /// [`ModelError`] that names the law, the state and the size of the violation.
    fn verify_model(&self, x0: &Element<Self>, radius: f64) -> Result<(), ModelError>;

    /// Lists the residual of every law of the model around a state.
    fn report_model(&self, x0: &Element<Self>) -> Report;
}
