//! The tangent at an event.

use std::fmt;

use metriplectic_dynamics::Differentiable;
use metriplectic_fields::{Column as _, Dimension as _, ScalarField, Vector};
use nalgebra::DVector;

use super::error::TangentError;
use super::state::TangentState;
use crate::run::event::Event;
use crate::step::Dim;

/// An [event](crate::Watch::event) of a run with its derivatives.
pub struct TangentEvent<D: Differentiable> {
    /// The event.
    pub event: Event<D::Manifold>,
    /// The state there, with its derivatives at a fixed time.
    pub state: TangentState<D>,
    /// The velocity of the state along the size of the last step. It is that of the discrete map.
    pub velocity: Vector<D::Manifold>,
    /// The largest size that each entry has had in the run, or soon has from its start; zero for one that stays zero.
    pub sizes: Vector<D::Manifold>,
    /// The state after its [jump](crate::Watched::jump), with its derivatives at the same fixed time.
    pub after: Option<TangentState<D>>,
}

impl<D: Differentiable> fmt::Debug for TangentEvent<D> {
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

impl<D: Differentiable> TangentEvent<D> {
    /// The derivative of the time of the event along start and parameters, by the function `g` of the event as a field:
    ///
    /// ```math
    /// \delta t^* = -\frac{dg\, T}{dg\, v} .
    /// ```
    ///
    /// # Errors
    ///
    /// [`TangentError::Grazing`] if `|dg·v| ≤ 10⁻⁶ |dg||v|`, with the entries in units of their [`sizes`](Self::sizes).
    pub fn time_along(
        &self,
        g: &impl ScalarField<D::Manifold>,
    ) -> Result<DVector<f64>, TangentError<D::Manifold>> {
        let df = g.jet1(&self.state.point).df;
        let rate = df.dot(&self.velocity);
        self.crosses(rate, |i| df[i])?;
        Ok(self.state.derivative_of(&df) * -rate.recip())
    }

    /// Refuses an event whose function changes by `rate` along the motion, which is less than its differential makes possible.
    pub(super) fn crosses(
        &self,
        rate: f64,
        df: impl Fn(usize) -> f64,
    ) -> Result<(), TangentError<D::Manifold>> {
        let (dg, speed) = self.lengths(&Vector::<D::Manifold>::from_index(df));
        let slope = rate.abs() / (dg * speed);
        if slope.is_nan() || slope <= GRAZING {
            let (event, time) = (self.event.name.to_string(), self.state.time);
            return Err(TangentError::Grazing { event, time, slope });
        }
        Ok(())
    }

    /// The derivative of the state at the event along start and parameters, `T + v δt*`, with a row for each direction of
    /// the frame there.
    ///
    /// # Errors
    ///
    /// The errors of [`time_along`](Self::time_along).
    pub fn state_along(
        &self,
        g: &impl ScalarField<D::Manifold>,
    ) -> Result<nalgebra::DMatrix<f64>, TangentError<D::Manifold>> {
        let time = self.time_along(g)?;
        let velocity = DVector::from_fn(Dim::<D>::LEN, |i, _| self.velocity[i]);
        Ok(self.state.matrix() + velocity * time.transpose())
    }

    /// The lengths of a differential and of the velocity, in units of the sizes of the entries.
    ///
    /// An entry without a size does not move.
    fn lengths(&self, df: &Vector<D::Manifold>) -> (f64, f64) {
        let entries = (0..Dim::<D>::LEN).filter(|&i| self.sizes[i] > 0.0);
        let (dg, speed) = entries.fold((0.0, 0.0), |(dg, speed), i| {
            let size = self.sizes[i];
            (dg + (df[i] * size).powi(2), speed + (self.velocity[i] / size).powi(2))
        });
        (dg.sqrt(), speed.sqrt())
    }
}
