//! The exact derivatives of the steps of a flow.

use metriplectic_equations::ModelError;
use nalgebra::DVector;

use super::columns::{Carried, LawRows, Moved};
use super::error::Unlinearised;
use super::part::Part;
use crate::step::{Compiled, Element, Flow};

/// A flow whose steps by some methods have exact derivatives along their start, and along the parameters that it
/// [knows](Self::known_parameters).
///
/// The parameters are further directions behind those of a state, all that are known or none.
pub trait ExactSteps<F: Flow> {
    /// Returns whether the steps of a method have exact derivatives along their start.
    fn has_steps(&self, method: Option<Compiled>) -> bool;

    /// Returns the number of parameters along which derivatives are known; 0 if there are none.
    fn known_parameters(&self) -> usize;

    /// Computes the differentials of the laws at a state, along it and along so many parameters.
    fn rows(&self, x: &Element<F>, parameters: usize) -> LawRows<DVector<f64>>;

    /// Computes the derivatives at the end of a step from those at its start.
    ///
    /// # Errors
    ///
    /// [`Unlinearised`] if the step has no derivative.
    fn carry(
        &self,
        method: Option<Compiled>,
        step: &Part<F>,
        carried: &Carried,
    ) -> Result<Moved, Unlinearised>;

    /// Computes the derivative of a loss along the start of a step, and along the parameters, from that along its end.
    ///
    /// # Errors
    ///
    /// [`Unlinearised`] if the step has no derivative.
    fn pull(
        &self,
        method: Option<Compiled>,
        step: &Part<F>,
        costate: &DVector<f64>,
    ) -> Result<DVector<f64>, Unlinearised>;

    /// Computes the error of the second law of tangents in a step; `None` if it is not known.
    fn entropy_error(
        &self,
        method: Option<Compiled>,
        step: &Part<F>,
        column: [&DVector<f64>; 2],
    ) -> Option<f64>;

    /// Compares the derivatives along the parameters at a state with the values of the flows at which they are displaced.
    ///
    /// # Errors
    ///
    /// [`ModelError`] with the derivative that is not that of the values.
    fn check_parameters(
        &self,
        x: &Element<F>,
        values: &[f64],
        displaced: &dyn Fn(&[f64]) -> Option<F>,
    ) -> Result<(), ModelError>;
}
