//! The tangent at an event.

use std::fmt;

use metriplectic_dynamics::Differentiable;
use metriplectic_fields::{Column as _, ScalarField, Vector};
use nalgebra::{DMatrix, DVector};

use super::error::TangentError;
use super::explicit::NEAR;
use super::state::TangentState;
use crate::round_off::bound::SUMMED;
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
    /// The largest size that each entry has had in the run, or soon has from its start; zero for one that stays zero, for the clock and for
    /// the ledger.
    pub sizes: DVector<f64>,
    /// The velocity behind a corner at this time, less that before it.
    pub(super) across: Option<DVector<f64>>,
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
    /// [`TangentError::Grazing`] if `|dg·v| ≤ 10⁻⁶ |dg||v|`, with the entries in units of their [`sizes`](Self::sizes), and
    /// [`TangentError::EventAtCorner`] at a [corner](crate::Watch::corners) across which the velocity changes.
    pub fn time_by(&self, dg: &DVector<f64>) -> Result<DVector<f64>, TangentError<F::Space>> {
        // The function does not depend on a ledger.
        let dg = &dg.clone().resize_vertically(self.velocity.len(), 0.0);
        let rate = dg.dot(&self.velocity);
        self.located().crosses(rate, dg)?;
        let along = self.state.derivative_of(dg) * -rate.recip();
        self.located().has_velocity(&along, |_| 0.0)?;
        Ok(along)
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
        let Self { event, velocity, sizes, across, .. } = self;
        Located { event, velocity, sizes, across: across.as_ref() }
    }
}

/// An event of a run, with the velocity of the discrete map there and the sizes of the entries.
pub(super) struct Located<'a, F: Flow> {
    pub(super) event: &'a Event<F::Space>,
    pub(super) velocity: &'a DVector<f64>,
    pub(super) sizes: &'a DVector<f64>,
    /// The velocity behind a corner at this time, less that before it.
    pub(super) across: Option<&'a DVector<f64>>,
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

    /// Refuses an event at a corner across which the velocity changes, if the event leaves it: where its time changes by `along` in a
    /// direction in which the clock of the state is `late`.
    pub(super) fn has_velocity(
        &self,
        along: &DVector<f64>,
        late: impl Fn(usize) -> f64,
    ) -> Result<(), TangentError<F::Space>> {
        let leaves = |k: usize| (along[k] + late(k)).abs() > SUMMED * along[k].abs();
        let v = self.velocity;
        let changes = |across: &&DVector<f64>| {
            let mut unsized_rates = (0..v.len()).filter(|&i| self.sizes[i] == 0.0);
            self.speed(across) > NEAR * self.speed(v)
                || unsized_rates.any(|i| across[i].abs() > NEAR * v[i].abs())
        };
        if self.across.filter(changes).is_some() && (0..along.len()).any(leaves) {
            let (event, time) = (self.event.name.to_string(), self.event.state.time);
            return Err(TangentError::EventAtCorner { event, time });
        }
        Ok(())
    }

    /// The lengths of a differential and of the velocity, in units of the sizes of the entries.
    pub(super) fn lengths(&self, dg: &DVector<f64>) -> (f64, f64) {
        let squares = self.sized().map(|i| (dg[i] * self.sizes[i]).powi(2));
        (squares.sum::<f64>().sqrt(), self.speed(self.velocity))
    }

    /// The length of a velocity, in units of the sizes of the entries.
    fn speed(&self, v: &DVector<f64>) -> f64 {
        self.sized().map(|i| (v[i] / self.sizes[i]).powi(2)).sum::<f64>().sqrt()
    }

    /// The entries with a size: one without does not move.
    fn sized(&self) -> impl Iterator<Item = usize> {
        (0..self.sizes.len()).filter(|&i| self.sizes[i] > 0.0)
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
