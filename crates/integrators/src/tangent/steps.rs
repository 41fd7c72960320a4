//! A run with its tangent, step by step.

use std::fmt;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::beside;
use super::certificate::Sensitivity;
use super::columns::{Carried, Moved};
use super::differentiated::Differentiated;
use super::error::{TangentError, Unlinearised};
use super::event::TangentEvent;
use super::part::Again;
use super::product::{Product, Reach, Step, product, propagate};
use super::smooth::{FlowOf, SmoothFlow as _, SpaceOf, VectorOf};
use super::state::TangentState;
use crate::round_off::bound::SUMMED;
use crate::run::certificate::Certificate;
use crate::run::ending::Ending;
use crate::run::event::{Event, Request};
use crate::run::jump::SmoothEvent;
use crate::run::schedule::Schedule;
use crate::run::steps::Steps;
use crate::step::{Element, Flow, Scales, Stepper, Vector as _};

/// Does work in the room of the steps with derivatives.
pub(super) fn in_wide_room<D: Differentiated<M>, M: Stepper<FlowOf<D>>, T>(
    system: &D,
    f: impl FnOnce() -> T,
) -> T {
    let (mut f, mut result) = (Some(f), None);
    system.wide_room(&mut || result = f.take().map(|f| f()));
    result.expect("a room calls the work in it")
}

/// The means to take the next step of a run again, if steps beside it give its derivatives. The largest sizes so far are kept.
pub(super) fn again<D: Differentiated<M>, M: Stepper<FlowOf<D>>>(
    system: &D,
    steps: &Steps<'_, FlowOf<D>, M>,
    largest: &mut Option<VectorOf<D>>,
) -> Option<Again<VectorOf<D>>> {
    if !system.takes_steps_beside(steps.method()) {
        return None;
    }
    let known = steps.known_sizes();
    let sizes = match largest.take() {
        Some(largest) => {
            VectorOf::<D>::zip([&largest, &known], |[largest, known]| largest.max(known))
        }
        None => known,
    };
    *largest = Some(sizes.clone());
    Some(Again { memory: steps.saved_memory(), sizes, whole: f64::NAN, is_still: false })
}

/// The sizes of the entries at an event: the largest ones of the run, and those there. Its function does not depend on a ledger, whose
/// entries may be small and fast.
pub(super) fn sizes_at<D: Differentiated<M>, M: Stepper<FlowOf<D>>>(
    (system, _): (&D, &M),
    scales: &Scales<VectorOf<D>>,
    x: &Element<FlowOf<D>>,
) -> DVector<f64> {
    let (ends, reached) = (&scales.sizes, system.units(x));
    let size = |i: usize| if i < ends.len() { ends.get(i).max(reached[i]) } else { 0.0 };
    DVector::from_fn(system.as_flow().directions(), |i, _| size(i))
}

/// The sizes of all directions after a step of size `h`, which is that of a clock.
pub(super) fn units_at<D: Differentiated<M>, M: Stepper<FlowOf<D>>>(
    (system, _): (&D, &M),
    x: &Element<FlowOf<D>>,
    h: f64,
) -> DVector<f64> {
    let mut units = system.units(x);
    if let Some(clock) = system.as_flow().clock() {
        units[clock] = h.abs();
    }
    units
}

/// The round-off of the laws of a tangent, relative to their terms.
pub(super) fn rounding<D: Differentiated<M>, M: Stepper<FlowOf<D>>>(
    (system, method): (&D, &M),
) -> f64 {
    if system.takes_steps_beside(method) { beside::rounding() } else { SUMMED }
}

/// Turns the rows of a tangent to another frame. Those of parameters have none.
pub(super) fn turn_rows(turn: &DMatrix<f64>, t: &mut DMatrix<f64>) {
    let turned = turn * t.rows(0, turn.nrows());
    t.rows_mut(0, turn.nrows()).copy_from(&turned);
}

/// A run with its tangent, step by step; made by [`Tangents::tangent_steps`](crate::Tangents::tangent_steps).
///
/// The steps are those of the run without it, bit for bit.
pub struct TangentSteps<'a, D: Differentiated<M>, M: Stepper<FlowOf<D>>> {
    pub(super) system: &'a D,
    pub(super) steps: Steps<'a, FlowOf<D>, M>,
    pub(super) carried: Carried,
    pub(super) sensitivity: Sensitivity,
    /// The derivatives of the jumps, by the number of their event.
    pub(super) jumps: Jumps<D::MovingWide>,
    /// The largest sizes of the entries so far, if steps beside the others are taken.
    pub(super) largest: Option<VectorOf<D>>,
}

/// The events of a schedule with their derivatives, at points of this type.
pub(super) type Jumps<P> = Vec<Option<Arc<SmoothEvent<P>>>>;

/// The events of a schedule over which derivatives are carried.
///
/// # Errors
///
/// [`TangentError::Broken`] if a jump has no derivatives, or a path with noise has events.
pub(super) fn smooth_events<D: Differentiated<M>, M: Stepper<FlowOf<D>>>(
    (system, method): (&D, &M),
    schedule: &Schedule,
) -> Result<Jumps<D::MovingWide>, TangentError<SpaceOf<D>>> {
    let events = &schedule.watch.events;
    let smooth: Jumps<D::MovingWide> = events.iter().map(Request::smooth).collect();
    let has_map = |smooth: &SmoothEvent<D::MovingWide>| smooth.map.is_some();
    let lacks_map = |(event, smooth): (&Request, &Option<Arc<SmoothEvent<D::MovingWide>>>)| {
        event.jump.is_some() && !smooth.as_deref().is_some_and(has_map)
    };
    let what = if events.iter().zip(&smooth).any(lacks_map) {
        "jumps without derivatives"
    } else if schedule.backward {
        "a run back in time"
    } else if method.noise(system.as_flow()).is_some() && !events.is_empty() {
        // Where a path ends a step beyond the event, the time of the event has no derivative.
        "events on a path with noise"
    } else {
        return Ok(smooth);
    };
    Err(TangentError::Broken { what })
}

impl<D: Differentiated<M>, M: Stepper<FlowOf<D>>> fmt::Debug for TangentSteps<'_, D, M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TangentSteps")
            .field("sensitivity", &self.sensitivity)
            .finish_non_exhaustive()
    }
}

/// The state that a step has reached, and the events in it.
pub(super) struct Inside<F: Flow> {
    /// The states that the run yields in place of the one at the end of the step.
    pub(super) outputs: Vec<TangentState<F>>,
    pub(super) events: Vec<TangentEvent<F>>,
}

impl<D, M> TangentSteps<'_, D, M>
where
    D: Differentiated<M>,
    M: Stepper<FlowOf<D>>,
{
    /// The state reached so far, with its derivatives.
    pub fn state(&self) -> TangentState<FlowOf<D>> {
        let state = self.steps.state();
        self.at(state.step, state.time, state.point.clone(), self.carried.clone())
    }

    /// The laws that the tangent has kept so far.
    pub const fn sensitivity(&self) -> &Sensitivity {
        &self.sensitivity
    }

    /// How the run ended; `None` as long as there are steps to take.
    pub const fn ending(&self) -> Option<Ending> {
        self.steps.ending()
    }

    /// The balance of the run itself.
    pub const fn certificate(&self) -> &Certificate {
        self.steps.certificate()
    }

    pub(super) fn at(
        &self,
        step: usize,
        time: f64,
        point: Element<FlowOf<D>>,
        carried: Carried,
    ) -> TangentState<FlowOf<D>> {
        let names = self.system.names().to_vec();
        TangentState { step, time, point, carried, names }
    }

    /// Takes one step. A run that has [ended](Self::ending) stays where it is.
    ///
    /// # Errors
    ///
    /// [`TangentError`]; the state is then the last one reached.
    pub fn advance(&mut self) -> Result<(), TangentError<SpaceOf<D>>> {
        in_wide_room::<D, M, _>(self.system, || self.take_step().map(drop))
    }

    /// Takes one step, and returns what was asked for inside it.
    pub(super) fn take_step(&mut self) -> Result<Inside<FlowOf<D>>, TangentError<SpaceOf<D>>> {
        let again = again(self.system, &self.steps, &mut self.largest);
        let scales = self.steps.scales();
        let before = self.steps.state().clone();
        self.steps.advance()?;
        let mut inside = Inside { outputs: Vec::new(), events: Vec::new() };
        let found = self.steps.take_events();
        if found.last().is_some_and(|event| event.jump.is_some()) {
            return self.cross(&scales, again.as_ref(), found);
        }
        if self.steps.state().step == before.step {
            return Ok(inside);
        }
        let failed = |cause| TangentError::NotLinearised { time: before.time, cause };
        let system = self.system;
        let last = &self.steps.last_step(&scales);
        let again = again.as_ref();
        let end = self.steps.state();
        let theta = |time: f64| (time - before.time) / (end.time - before.time);
        for event in found {
            let theta = theta(event.state.time);
            inside.events.push(self.event((last, again), &scales, event, theta).map_err(failed)?);
        }
        let mut asked = self.asked();
        // The run has ended at the event, not at the end of the step.
        let stop = match (self.steps.ending(), inside.events.last()) {
            (Some(Ending::Event { .. }), Some(event)) => asked.pop().map(|_| event.state.clone()),
            _ => None,
        };
        let at_end = asked.iter().position(|(step, _)| *step == end.step).unwrap_or(asked.len());
        if at_end > 0 && self.certificate().noise.is_some() {
            // A step of that fraction has other numbers than the path.
            return Err(TangentError::Broken { what: "outputs inside steps of a path with noise" });
        }
        for &(step, time) in &asked[..at_end] {
            let (part, moved) = self.part((last, again), (theta(time), time)).map_err(failed)?;
            inside.outputs.push(self.at(step, time, part.end, moved.carried));
        }
        let state = self.steps.state();
        let of = (system, self.steps.method());
        let whole = product(of, (last, again), &Reach::End(&state.point)).map_err(failed)?;
        let next = propagate(of, &whole, &self.carried).map_err(failed)?;
        let (rows, units) = (system.wide_rows(&state.point), self.units(&state.point, last.h));
        let rests = self.is_same_point(last.start.x, &state.point);
        if rests && system.takes_steps_beside(self.steps.method()) {
            // The differentials vanish there, and differences of an even energy have no digits.
            self.sensitivity.steps += 1;
        } else {
            let rounding = self.rounding();
            self.sensitivity.enter(&rows, &units, &next.carried, rounding).map_err(failed)?;
        }
        // One column after the other, since the definition of the step at dual numbers is dear.
        if let Some(part) = whole.single()
            && state.step.is_power_of_two()
            && !last.in_parts
        {
            let j = state.step.trailing_zeros() as usize % self.carried.t.ncols();
            let [before, after] =
                [&self.carried.t, &next.carried.t].map(|t| t.column(j).into_owned());
            let law = system.second_law_error(self.steps.method(), part, [&before, &after]);
            self.sensitivity.enter_entropy(law);
        }
        self.sensitivity.frozen = self.steps.is_adaptive();
        self.sensitivity.undamped = self.steps.certificate().is_stiff();
        self.sensitivity.at_rest |= !system.is_smooth_at_rest(self.steps.method()) && rests;
        self.carried = next.carried;
        for &(_, time) in &asked[at_end..] {
            inside.outputs.push(TangentState { time, ..self.state() });
        }
        inside.outputs.extend(stop);
        Ok(inside)
    }

    /// The steps and the times of the states that the run yields in place of the one at the end of the last step.
    pub(super) fn asked(&self) -> Vec<(usize, f64)> {
        self.steps.outputs().map(|state| (state.step, state.time)).collect()
    }

    /// The sizes of all directions after a step of size `h`, which is that of a clock.
    pub(super) fn units(&self, x: &Element<FlowOf<D>>, h: f64) -> DVector<f64> {
        units_at((self.system, self.steps.method()), x, h)
    }

    /// Returns whether two states are the same but for the time and what is booked.
    fn is_same_point(&self, x: &Element<FlowOf<D>>, y: &Element<FlowOf<D>>) -> bool {
        let apart = self.system.as_flow().between(x, y);
        apart.is_some_and(|d| (0..d.len()).all(|i| d.get(i) == 0.0))
    }

    /// The round-off of the laws of the tangent, relative to their terms.
    pub(super) fn rounding(&self) -> f64 {
        rounding((self.system, self.steps.method()))
    }

    /// The state at a fraction of the last step, by a step of that size, with its derivatives.
    pub(super) fn part(
        &self,
        step: Step<'_, FlowOf<D>>,
        (theta, time): (f64, f64),
    ) -> Result<(Product<FlowOf<D>>, Moved), Unlinearised> {
        let of = (self.system, self.steps.method());
        let part = product(of, step, &Reach::Inside { theta, time })?;
        let moved = propagate(of, &part, &self.carried)?;
        Ok((part, moved))
    }

    /// An event of the last step with its derivatives, in the frame of its own state.
    pub(super) fn event(
        &self,
        step: Step<'_, FlowOf<D>>,
        scales: &Scales<VectorOf<D>>,
        event: Event<SpaceOf<D>>,
        theta: f64,
    ) -> Result<TangentEvent<FlowOf<D>>, Unlinearised> {
        let flow = self.steps.flow();
        let place = (theta, event.state.time);
        let (Product { end, across, .. }, Moved { mut carried, along_h: mut velocity }) =
            self.part(step, place)?;
        if velocity.iter().any(|v| v.is_nan()) {
            return Err(Unlinearised::Branch);
        }
        // The state of the output is not that of the step of this size, and may have another frame.
        if let Some(turn) = flow.turn(&end, &event.state.point) {
            velocity = &turn * velocity;
            turn_rows(&turn, &mut carried.t);
        }
        let (step, time) = (event.state.step, event.state.time);
        let state = self.at(step, time, event.state.point.clone(), carried);
        let sizes = sizes_at((self.system, self.steps.method()), scales, &state.point);
        Ok(TangentEvent { event, state, velocity, sizes, across, after: None })
    }
}
