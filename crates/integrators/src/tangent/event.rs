//! The tangent at an event.

use std::fmt;

use metriplectic_dynamics::Differentiable;
use metriplectic_fields::{Column as _, ScalarField, Vector};
use nalgebra::{DMatrix, DVector};

use super::error::TangentError;
use super::state::TangentState;
use crate::run::event::Event;
use crate::step::Flow;

/// An [event](crate::Watch::event) of a run with its derivatives.
pub struct TangentEvent<F: Flow> {
    /// The event.
    pub event: Event<F::Space>,
    /// The state there, with its derivatives at a fixed time.
    pub state: TangentState<F>,
    /// The velocity of the state along the size of the last step. It is that of the discrete map.
    pub velocity: DVector<f64>,
    /// The largest size that each entry has had in the run, or soon has from its start; zero for one that stays zero.
    pub sizes: DVector<f64>,
    /// The state after its [jump](crate::Watched::jump), with its derivatives at the same fixed time.
    pub after: Option<TangentState<F>>,
}

impl<F: Flow> fmt::Debug for TangentEvent<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TangentEvent")
            .field("event", &self.event)
            .field("state", &self.state)
            .field("velocity", &self.velocity)
            .finish()
    }
}

/// The slope of a function along the motion, relative to what it could be, below which its event is grazing.
/// A factor of four fails `tests/tangent/explicit.rs::times_of_events_have_derivatives`.
const GRAZING: f64 = 1e-6;

impl<F: Flow> TangentEvent<F> {
    /// The derivative of the time of the event along start and parameters, from the differential of the function `g` of the event, in
    /// the frame of the chart there:
    ///
    /// ```math
    /// \delta t^* = -\frac{dg\, T}{dg\, v} .
    /// ```
    ///
    /// # Errors
    ///
    /// [`TangentError::Grazing`] if `|dg·v| ≤ 10⁻⁶ |dg||v|`, with the entries in units of their [`sizes`](Self::sizes).
    pub fn time_by(&self, dg: &DVector<f64>) -> Result<DVector<f64>, TangentError<F::Space>> {
        // The function does not depend on a ledger.
        let dg = &dg.clone().resize_vertically(self.velocity.len(), 0.0);
        let rate = dg.dot(&self.velocity);
        self.located().crosses(rate, dg)?;
        Ok(self.state.derivative_of(dg) * -rate.recip())
    }

    /// The derivative of the state at the event along start and parameters, `T + v δt*`, with a row for each direction of
    /// the frame there, from the differential of the function of the event. An open system has further rows, of its clock and its ledger.
    ///
    /// # Errors
    ///
    /// The errors of [`time_by`](Self::time_by).
    pub fn state_by(&self, dg: &DVector<f64>) -> Result<DMatrix<f64>, TangentError<F::Space>> {
        Ok(self.state.matrix() + &self.velocity * self.time_by(dg)?.transpose())
    }

    /// The event without its derivatives.
    pub(super) const fn located(&self) -> Located<'_, F> {
        Located { event: &self.event, velocity: &self.velocity, sizes: &self.sizes }
    }
}

/// An event of a run, with the velocity of the discrete map there and the sizes of the entries.
pub(super) struct Located<'a, F: Flow> {
    pub(super) event: &'a Event<F::Space>,
    pub(super) velocity: &'a DVector<f64>,
    pub(super) sizes: &'a DVector<f64>,
}

impl<F: Flow> Located<'_, F> {
    /// Refuses an event whose function changes by `rate` along the motion, which is less than its differential makes possible.
    pub(super) fn crosses(
        &self,
        rate: f64,
        dg: &DVector<f64>,
    ) -> Result<(), TangentError<F::Space>> {
        let (dg, speed) = self.lengths(dg);
        let slope = rate.abs() / (dg * speed);
        if slope.is_nan() || slope <= GRAZING {
            let (event, time) = (self.event.name.to_string(), self.event.state.time);
            return Err(TangentError::Grazing { event, time, slope });
        }
        Ok(())
    }

    /// The lengths of a differential and of the velocity, in units of the sizes of the entries.
    ///
    /// An entry without a size does not move.
    pub(super) fn lengths(&self, dg: &DVector<f64>) -> (f64, f64) {
        let entries = (0..self.sizes.len()).filter(|&i| self.sizes[i] > 0.0);
        let (dg, speed) = entries.fold((0.0, 0.0), |(sum, speed), i| {
            let size = self.sizes[i];
            (sum + (dg[i] * size).powi(2), speed + (self.velocity[i] / size).powi(2))
        });
        (dg.sqrt(), speed.sqrt())
    }
}

impl<D: Differentiable> TangentEvent<D> {
    /// The derivative of the [time](Self::time_by) of the event along start and parameters, by its function as a field.
    ///
    /// # Errors
    ///
    /// The errors of [`time_by`](Self::time_by).
    pub fn time_along(
        &self,
        g: &impl ScalarField<D::Manifold>,
    ) -> Result<DVector<f64>, TangentError<D::Manifold>> {
        self.time_by(&self.differential(g))
    }

    /// The derivative of the [state](Self::state_by) at the event along start and parameters, by its function as a field.
    ///
    /// # Errors
    ///
    /// The errors of [`time_by`](Self::time_by).
    pub fn state_along(
        &self,
        g: &impl ScalarField<D::Manifold>,
    ) -> Result<DMatrix<f64>, TangentError<D::Manifold>> {
        self.state_by(&self.differential(g))
    }

    fn differential(&self, g: &impl ScalarField<D::Manifold>) -> DVector<f64> {
        let df = g.jet1(&self.state.point).df;
        DVector::from_fn(Vector::<D::Manifold>::LEN, |i, _| df[i])
    }
}
