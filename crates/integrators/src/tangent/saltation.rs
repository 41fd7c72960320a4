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

use metriplectic_dynamics::{Differentiable, Metriplectic, VectorField as _};
use metriplectic_fields::{
    ChartPoint, Column as _, Dimension as _, Real, Space as _, Square as _, Vector,
};
use metriplectic_manifolds::Manifold as _;

use super::along::LinearisedAlong;
use super::certificate::worse;
use super::columns::{Columns, jets};
use super::error::{TangentError, Unlinearised};
use super::event::TangentEvent;
use super::explicit::NEAR;
use super::part::Wide;
use super::steps::{Inside, TangentSteps};
use crate::run::event::Event;
use crate::step::{Dim, Scales, Stepper};

/// Components of the wide system.
type Direction<D> = Vector<<Wide<D> as Metriplectic>::Manifold>;

impl<D, M> TangentSteps<'_, D, M>
where
    D: Differentiable,
    M: Stepper<D> + LinearisedAlong<D>,
{
    /// Carries the tangent across the jump at the last of the events that were found.
    pub(super) fn cross(
        &mut self,
        scales: &Scales<<D as crate::step::Flow>::Vector>,
        mut found: Vec<Event<D::Manifold>>,
    ) -> Result<Inside<D>, TangentError<D::Manifold>> {
        let mut inside = Inside { outputs: Vec::new(), events: Vec::new() };
        let Some(last) = self.steps.cut_step(scales) else { return Ok(inside) };
        let Some(event) = found.pop() else { return Ok(inside) };
        let (start, h) = (last.start.time, last.h);
        let failed = |cause| TangentError::NotLinearised { time: start, cause };
        let mut asked = self.asked();
        // A run that is over ends with the state after the jump.
        let is_over = self.steps.ending().is_some() && asked.pop().is_some();
        for (step, time) in asked {
            let (point, moved) = self.part(&last, (time - start) / h).map_err(failed)?;
            inside.outputs.push(self.at(step, time, point, moved.columns));
        }
        for event in found {
            let theta = (event.state.time - start) / h;
            inside.events.push(self.event(&last, scales, event, theta).map_err(failed)?);
        }
        let theta = (event.state.time - start) / h;
        let mut event = self.event(&last, scales, event, theta).map_err(failed)?;
        let flow = self.steps.flow();
        let before = flow.widened(&event.state.point);
        self.sensitivity.enter(flow.wide(), &before, &event.state.columns).map_err(failed)?;
        let columns = self.after(&event)?;
        let reached = self.steps.state();
        let (step, time, point) = (reached.step, event.state.time, reached.point.clone());
        event.after = Some(self.at(step, time, point, columns.clone()));
        inside.events.push(event);
        self.columns = columns;
        if is_over {
            inside.outputs.push(self.state());
        }
        Ok(inside)
    }

    /// The tangent after the jump at an event.
    fn after(
        &self,
        event: &TangentEvent<D>,
    ) -> Result<Columns<Wide<D>>, TangentError<D::Manifold>> {
        let (flow, time, all) = (self.steps.flow(), event.state.time, Dim::<Wide<D>>::LEN);
        let Some(Some(smooth)) = self.jumps.get(event.event.index) else {
            return Err(TangentError::Broken { what: "jumps without derivatives" });
        };
        let [x, y] = [&event.state.point, &self.steps.state().point].map(|x| flow.widened(x));
        let moved = |v: &Direction<D>| {
            let q = |i| Real::new(0.0, v[i], 0.0, 0.0);
            <Wide<D> as Metriplectic>::Manifold::chart(
                &x,
                &Vector::<<Wide<D> as Metriplectic>::Manifold, Real>::from_index(q),
            )
        };
        let at = |change: f64| Real::new(time, change, 0.0, 0.0);
        let slope = |change: f64, v: &Direction<D>| (smooth.event)(at(change), &moved(v)).eps1;
        let map = |change: f64, v: &Direction<D>| {
            let there = (smooth.map)(at(change), &moved(v));
            <Wide<D> as Metriplectic>::Manifold::coordinates(&y, &there)
        };
        self.same_jump(event, &map(0.0, &Direction::<D>::zero()))?;
        let before =
            Direction::<D>::from_index(|i| if i < Dim::<D>::LEN { event.velocity[i] } else { 0.0 });
        let rate = slope(1.0, &before);
        event.crosses(rate, |i| slope(0.0, &Direction::<D>::basis(i)))?;
        let after: Direction<D> = flow
            .wide()
            .velocity(&ChartPoint::centre(&y))
            .map_err(|_| TangentError::NotLinearised { time, cause: Unlinearised::Singular })?;
        let mut columns = event.state.columns.clone();
        for j in 0..all {
            let column = event.state.columns.t.column_at(j);
            let change = -slope(0.0, &column) / rate;
            let landed = map(change, &(column + before * change));
            for i in 0..all {
                columns.t[(i, j)] = landed[i].eps1 - after[i] * change;
            }
        }
        let jets = jets(flow.wide(), &y);
        columns.laws.energy = columns.t.transpose_times(&jets.energy.df);
        columns.laws.entropy = columns.t.transpose_times(&jets.entropy.df);
        let listed = jets.invariants.as_ref().iter().flatten();
        for (law, (_, jet)) in columns.laws.invariants.iter_mut().zip(listed) {
            *law = columns.t.transpose_times(&jet.df);
        }
        Ok(columns)
    }

    /// Refuses derivatives of another map than the one by which the state has jumped, entry by entry in units of the sizes of the run.
    fn same_jump(
        &self,
        event: &TangentEvent<D>,
        off: &Vector<<Wide<D> as Metriplectic>::Manifold, Real>,
    ) -> Result<(), TangentError<D::Manifold>> {
        let n = Dim::<D>::LEN;
        let after = D::Manifold::scales(&self.steps.state().point);
        let sizes = Vector::<D::Manifold>::from_index(|i| event.sizes[i].max(after[i]));
        let largest = (0..n).fold(0.0, |most: f64, i| most.max(sizes[i]));
        // An entry that has been zero has no size of its own.
        let size = |i: usize| if sizes[i] > 0.0 { sizes[i] } else { largest };
        let terms = (0..n).filter(|&i| off[i].re != 0.0).map(|i| off[i].re.abs() / size(i));
        let off = terms.fold(0.0, worse);
        if off <= NEAR {
            return Ok(());
        }
        let (event, time) = (event.event.name.to_string(), event.state.time);
        Err(TangentError::OtherJump { event, time, off })
    }
}
