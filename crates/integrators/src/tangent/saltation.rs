//! The derivative across an event at which the state jumps or the run ends.
//!
//! The time `t*` of the event depends on the start, and so does the state from which it jumps. With the function `g` of the event,
//! the map `r` and the velocities before and after,
//!
//! ```math
//! \delta t^* = -\frac{dg\, T}{dg\, v^- + \partial_t g}, \qquad
//! T^+ = dr\,(T + v^-\, \delta t^*) + \partial_t r\, \delta t^* - v^+\, \delta t^* .
//! ```
//!
//! `T` and `T⁺` are derivatives at the fixed time of the event (Aizerman and Gantmakher 1958). Parameters are directions of the
//! wide system, so they enter `g` and `r` like the state. `T⁺ = C T` with the saltation matrix `C`, and costates go back by `Cᵀ`.
//!
//! The end of a run at an event is `x(t*)`, which nothing moves on: `C = 1 + v⁻ δt*`.

use metriplectic_fields::Real;
use nalgebra::{DMatrix, DVector};

use super::certificate::worse;
use super::columns::Carried;
use super::differentiated::Differentiated;
use super::error::{TangentError, Unlinearised};
use super::event::{Located, TangentEvent};
use super::explicit::NEAR;
use super::part::Again;
use super::smooth::{FlowOf, SmoothFlow as _, SpaceOf, VectorOf};
use super::steps::{Inside, TangentSteps};
use crate::run::event::Event;
use crate::run::jump::SmoothEvent;
use crate::step::{Element, Scales, Stepper};

/// The derivatives across an event.
pub(super) struct Crossing {
    /// The derivative `C` of the state after it along that before it, in all directions.
    pub(super) matrix: DMatrix<f64>,
    /// The derivative `δt*` of its time along the state before it.
    pub(super) time: DVector<f64>,
}

/// The derivatives across an event, to the state `y` if it has jumped there.
pub(super) fn crossing<D, M>(
    (system, _): (&D, &M),
    at: &Located<'_, FlowOf<D>>,
    smooth: &SmoothEvent<D::MovingWide>,
    y: Option<&Element<FlowOf<D>>>,
) -> Result<Crossing, TangentError<SpaceOf<D>>>
where
    D: Differentiated<M>,
    M: Stepper<FlowOf<D>>,
{
    let (flow, x, time) = (system.as_flow(), &at.event.state.point, at.event.state.time);
    let (n, all) = (flow.directions(), flow.directions() + system.names().len());
    let instant = |change: f64| Real::new(time, change, 0.0, 0.0);
    let function = |change: f64, v: &DVector<f64>| {
        (smooth.function)(instant(change), &system.moved_along(x, v))
    };
    let unit = |k: usize| DVector::from_fn(all, |i, _| if i == k { 1.0 } else { 0.0 });
    let dg = DVector::from_fn(n, |k, _| function(0.0, &unit(k)).eps1);
    let before = at.velocity.clone().resize_vertically(all, 0.0);
    let landing = match (y, &smooth.map) {
        (Some(y), Some(map)) => {
            let map = move |change: f64, v: &DVector<f64>| {
                system.coordinates_around(y, &map(instant(change), &system.moved_along(x, v)))
            };
            at.same_jump(&map(0.0, &DVector::zeros(all)), &system.units(y))?;
            Some((y, map))
        }
        (None, _) => None,
        (Some(_), None) => return Err(TangentError::Broken { what: "jumps without derivatives" }),
    };
    let zero = function(1.0, &before);
    at.crosses(zero.eps1, &dg)?;
    at.same_function(zero.re, &dg)?;
    let late = |k: usize| if flow.clock() == Some(k) { 1.0 } else { 0.0 };
    let along = DVector::from_fn(all, |k, _| -function(late(k), &unit(k)).eps1 / zero.eps1);
    at.has_velocity(&along, late)?;
    let mut matrix = DMatrix::identity(all, all) + &before * along.transpose();
    let Some((y, map)) = landing else { return Ok(Crossing { matrix, time: along }) };
    let after = system
        .velocity_at(y)
        .ok_or(TangentError::NotLinearised { time, cause: Unlinearised::Singular })?;
    let powers = (flow.power_of_time(x), flow.power_of_time(y));
    for k in 0..all {
        let (late, change) = (late(k), along[k]);
        let column = matrix.column(k).into_owned();
        let landed = map(late + change, &column);
        for i in 0..all {
            // The jump leaves the clock and the ledger as they are.
            let landed = landed.get(i).map_or(column[i], |entry| entry[1]);
            matrix[(i, k)] = landed - after[i] * change;
        }
        if let Some(clock) = flow.clock() {
            matrix[(clock, k)] = late;
        }
        // A later jump leaves the power of the time at one state for that at another.
        if let (Some((work, before)), Some((_, after))) = powers {
            matrix[(work, k)] += (before - after) * (late + change);
        }
    }
    Ok(Crossing { matrix, time: along })
}

impl<D, M> TangentSteps<'_, D, M>
where
    D: Differentiated<M>,
    M: Stepper<FlowOf<D>>,
{
    /// Carries the tangent across the jump at the last of the events that were found.
    pub(super) fn cross(
        &mut self,
        scales: &Scales<VectorOf<D>>,
        again: Option<&Again<VectorOf<D>>>,
        mut found: Vec<Event<SpaceOf<D>>>,
    ) -> Result<Inside<FlowOf<D>>, TangentError<SpaceOf<D>>> {
        let mut inside = Inside { outputs: Vec::new(), events: Vec::new() };
        let Some(last) = self.steps.cut_step(scales) else { return Ok(inside) };
        let Some(event) = found.pop() else { return Ok(inside) };
        let (start, h) = (last.start.time, last.h);
        let failed = |cause| TangentError::NotLinearised { time: start, cause };
        let mut asked = self.asked();
        // A run that is over ends with the state after the jump.
        let is_over = self.steps.ending().is_some() && asked.pop().is_some();
        for (step, time) in asked {
            let place = ((time - start) / h, time);
            let (part, moved) = self.part((&last, again), place).map_err(failed)?;
            inside.outputs.push(self.at(step, time, part.end, moved.carried));
        }
        for event in found {
            let theta = (event.state.time - start) / h;
            inside.events.push(self.event((&last, again), scales, event, theta).map_err(failed)?);
        }
        let theta = (event.state.time - start) / h;
        let mut event = self.event((&last, again), scales, event, theta).map_err(failed)?;
        let before = &event.state.point;
        let (rows, units) = (self.system.wide_rows(before), self.units(before, last.h));
        let rounding = self.rounding();
        self.sensitivity.enter(&rows, &units, &event.state.carried, rounding).map_err(failed)?;
        let carried = self.after(&event)?;
        let reached = self.steps.state();
        let (step, time, point) = (reached.step, event.state.time, reached.point.clone());
        event.after = Some(self.at(step, time, point, carried.clone()));
        inside.events.push(event);
        self.carried = carried;
        if is_over {
            inside.outputs.push(self.state());
        }
        Ok(inside)
    }

    /// The tangent after the jump at an event.
    fn after(&self, event: &TangentEvent<FlowOf<D>>) -> Result<Carried, TangentError<SpaceOf<D>>> {
        let Some(Some(smooth)) = self.jumps.get(event.event.index) else {
            return Err(TangentError::Broken { what: "jumps without derivatives" });
        };
        let (of, y) = ((self.system, self.steps.method()), &self.steps.state().point);
        let Crossing { matrix, .. } = crossing(of, &event.located(), smooth, Some(y))?;
        let mut carried = event.state.carried.clone();
        carried.t = matrix * carried.t;
        let rows = self.system.wide_rows(y);
        carried.laws.energy = carried.t.tr_mul(&rows.energy);
        carried.laws.entropy = carried.t.tr_mul(&rows.entropy);
        for (law, df) in carried.laws.invariants.iter_mut().zip(&rows.invariants) {
            *law = carried.t.tr_mul(df);
        }
        Ok(carried)
    }
}

impl<F: crate::step::Flow> Located<'_, F> {
    /// Refuses derivatives of another map than the one by which the state has jumped, entry by entry in units of the sizes of the run
    /// and of those after the jump.
    fn same_jump(
        &self,
        off: &[[f64; 2]],
        after: &DVector<f64>,
    ) -> Result<(), TangentError<F::Space>> {
        let sizes: Vec<f64> = self.sizes.iter().zip(after).map(|(a, b)| a.max(*b)).collect();
        let largest = sizes.iter().fold(0.0, |most: f64, size| most.max(*size));
        // An entry that has been zero has no size of its own.
        let size = |i: usize| if sizes[i] > 0.0 { sizes[i] } else { largest };
        let moved = off.iter().enumerate().filter(|(_, entry)| entry[0] != 0.0);
        let off = moved.map(|(i, entry)| entry[0].abs() / size(i)).fold(0.0, worse);
        if off <= NEAR {
            return Ok(());
        }
        let (event, time) = (self.event.name.to_string(), self.event.state.time);
        Err(TangentError::OtherJump { event, time, off })
    }

    /// Refuses derivatives of a function that is not zero where the event is.
    fn same_function(&self, value: f64, dg: &DVector<f64>) -> Result<(), TangentError<F::Space>> {
        let off = value.abs() / self.lengths(dg).0;
        if off <= NEAR {
            return Ok(());
        }
        let (event, time) = (self.event.name.to_string(), self.event.state.time);
        Err(TangentError::OtherFunction { event, time, off })
    }
}
