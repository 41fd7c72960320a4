//! The tangent across an event at which the state jumps.
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
//! wide system, so they enter `g` and `r` like the state.

use metriplectic_fields::Real;
use nalgebra::DVector;

use super::certificate::worse;
use super::columns::Carried;
use super::differentiated::Differentiated;
use super::error::{TangentError, Unlinearised};
use super::event::TangentEvent;
use super::explicit::NEAR;
use super::part::Again;
use super::smooth::{FlowOf, SmoothFlow as _, SpaceOf, VectorOf};
use super::steps::{Inside, TangentSteps};
use crate::run::event::Event;
use crate::step::{Scales, Stepper};

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
            let (point, moved) = self.part((&last, again), (time - start) / h).map_err(failed)?;
            inside.outputs.push(self.at(step, time, point, moved.carried));
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
        let (system, flow, time) = (self.system, self.steps.flow(), event.state.time);
        let Some(Some(smooth)) = self.jumps.get(event.event.index) else {
            return Err(TangentError::Broken { what: "jumps without derivatives" });
        };
        let [x, y] = [&event.state.point, &self.steps.state().point];
        let at = |change: f64| Real::new(time, change, 0.0, 0.0);
        let slope = |change: f64, v: &DVector<f64>| {
            (smooth.event)(at(change), &system.moved_along(x, v)).eps1
        };
        let map = |change: f64, v: &DVector<f64>| {
            system.coordinates_around(y, &(smooth.map)(at(change), &system.moved_along(x, v)))
        };
        let (n, all) = (flow.directions(), event.state.carried.t.ncols());
        self.same_jump(event, &map(0.0, &DVector::zeros(all)))?;
        let before = event.velocity.clone().resize_vertically(all, 0.0);
        let rate = slope(1.0, &before);
        let unit = |k: usize| DVector::from_fn(all, |i, _| if i == k { 1.0 } else { 0.0 });
        event.crosses(rate, &DVector::from_fn(n, |i, _| slope(0.0, &unit(i))))?;
        let after = system
            .velocity_at(y)
            .ok_or(TangentError::NotLinearised { time, cause: Unlinearised::Singular })?;
        let powers = (flow.power_of_time(x), flow.power_of_time(y));
        let mut carried = event.state.carried.clone();
        for j in 0..all {
            let column = event.state.carried.t.column(j).into_owned();
            let late = flow.clock().map_or(0.0, |row| column[row]);
            let change = -slope(late, &column) / rate;
            let column = column + &before * change;
            let landed = map(late + change, &column);
            for i in 0..all {
                // The jump leaves the clock and the ledger as they are.
                let landed = landed.get(i).map_or(column[i], |entry| entry[1]);
                carried.t[(i, j)] = landed - after[i] * change;
            }
            if let Some(clock) = flow.clock() {
                carried.t[(clock, j)] = late;
            }
            // A later jump leaves the power of the time at one state for that at another.
            if let (Some((work, before)), Some((_, after))) = powers {
                carried.t[(work, j)] += (before - after) * (late + change);
            }
        }
        let rows = system.wide_rows(y);
        carried.laws.energy = carried.t.tr_mul(&rows.energy);
        carried.laws.entropy = carried.t.tr_mul(&rows.entropy);
        for (law, df) in carried.laws.invariants.iter_mut().zip(&rows.invariants) {
            *law = carried.t.tr_mul(df);
        }
        Ok(carried)
    }

    /// Refuses derivatives of another map than the one by which the state has jumped, entry by entry in units of the sizes of the run.
    fn same_jump(
        &self,
        event: &TangentEvent<FlowOf<D>>,
        off: &[[f64; 2]],
    ) -> Result<(), TangentError<SpaceOf<D>>> {
        let after = self.system.units(&self.steps.state().point);
        let sizes: Vec<f64> = event.sizes.iter().zip(&after).map(|(a, b)| a.max(*b)).collect();
        let largest = sizes.iter().fold(0.0, |most: f64, size| most.max(*size));
        // An entry that has been zero has no size of its own.
        let size = |i: usize| if sizes[i] > 0.0 { sizes[i] } else { largest };
        let moved = off.iter().enumerate().filter(|(_, entry)| entry[0] != 0.0);
        let off = moved.map(|(i, entry)| entry[0].abs() / size(i)).fold(0.0, worse);
        if off <= NEAR {
            return Ok(());
        }
        let (event, time) = (event.event.name.to_string(), event.state.time);
        Err(TangentError::OtherJump { event, time, off })
    }
}
