//! A run with its tangent, step by step.

use std::fmt;
use std::sync::Arc;

use nalgebra::DVector;

use super::certificate::Sensitivity;
use super::columns::{Carried, Moved};
use super::differentiated::Differentiated;
use super::error::{TangentError, Unlinearised};
use super::event::TangentEvent;
use super::part::{Again, Ended, Part, memory_before};
use super::pieces::propagate;
use super::state::TangentState;
use crate::run::certificate::Certificate;
use crate::run::ending::Ending;
use crate::run::event::Event;
use crate::run::jump::SmoothJump;
use crate::run::last_step::LastStep;
use crate::run::steps::Steps;
use crate::step::{Element, Flow, Scales, Stepper, Vector as _};

/// Does work in the room of the steps with derivatives.
pub(super) fn in_wide_room<F: Differentiated<M>, M: Stepper<F>, T>(
    system: &F,
    f: impl FnOnce() -> T,
) -> T {
    let (mut f, mut result) = (Some(f), None);
    system.wide_room(&mut || result = f.take().map(|f| f()));
    result.expect("a room calls the work in it")
}

/// The means to take the next step of a run again, if steps beside it give its derivatives. The largest sizes so far are kept.
pub(super) fn again<F: Differentiated<M>, M: Stepper<F>>(
    steps: &Steps<'_, F, M>,
    largest: &mut Option<F::Vector>,
) -> Option<Again<F::Vector>> {
    if !steps.flow().takes_steps_beside(steps.method()) {
        return None;
    }
    let known = steps.known_sizes();
    let sizes = match largest.take() {
        Some(largest) => F::Vector::zip([&largest, &known], |[largest, known]| largest.max(known)),
        None => known,
    };
    *largest = Some(sizes.clone());
    Some(Again { memory: steps.saved_memory(), sizes })
}

/// A run with its tangent, step by step; made by [`Tangents::tangent_steps`](crate::Tangents::tangent_steps).
///
/// The steps are those of the run without it, bit for bit.
pub struct TangentSteps<'a, F: Differentiated<M>, M: Stepper<F>> {
    pub(super) steps: Steps<'a, F, M>,
    pub(super) carried: Carried,
    pub(super) sensitivity: Sensitivity,
    /// The derivatives of the jumps, by the number of their event.
    pub(super) jumps: Jumps<F::MovingWide>,
    /// The largest sizes of the entries so far, if steps beside the others are taken.
    pub(super) largest: Option<F::Vector>,
}

/// The jumps of a schedule with their derivatives, at points of this type.
pub(super) type Jumps<P> = Vec<Option<Arc<SmoothJump<P>>>>;

impl<F: Differentiated<M>, M: Stepper<F>> fmt::Debug for TangentSteps<'_, F, M> {
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

impl<F, M> TangentSteps<'_, F, M>
where
    F: Differentiated<M>,
    M: Stepper<F>,
{
    /// The state reached so far, with its derivatives.
    pub fn state(&self) -> TangentState<F> {
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
        point: Element<F>,
        carried: Carried,
    ) -> TangentState<F> {
        let names = self.steps.flow().names().to_vec();
        TangentState { step, time, point, carried, names }
    }

    /// Takes one step. A run that has [ended](Self::ending) stays where it is.
    ///
    /// # Errors
    ///
    /// [`TangentError`]; the state is then the last one reached.
    pub fn advance(&mut self) -> Result<(), TangentError<F::Space>> {
        let flow = self.steps.flow();
        in_wide_room::<F, M, _>(flow, || self.take_step().map(drop))
    }

    /// Takes one step, and returns what was asked for inside it.
    pub(super) fn take_step(&mut self) -> Result<Inside<F>, TangentError<F::Space>> {
        let again = again(&self.steps, &mut self.largest);
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
        let flow = self.steps.flow();
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
        for &(step, time) in &asked[..at_end] {
            let (point, moved) = self.part((last, again), theta(time)).map_err(failed)?;
            inside.outputs.push(self.at(step, time, point, moved.carried));
        }
        let state = self.steps.state();
        let ended = Ended::of_run(&state.point, last).with_again(again);
        let next =
            propagate(self.steps.method(), &last.start, &ended, &self.carried).map_err(failed)?;
        let (rows, units) = (flow.wide_rows(&state.point), flow.units(&state.point));
        self.sensitivity.enter(&rows, &units, &next.carried).map_err(failed)?;
        // One column after the other, since the definition of the step at dual numbers is dear.
        if state.step.is_power_of_two() && !last.in_parts {
            let part = Part::new(&last.start, &ended);
            let j = state.step.trailing_zeros() as usize % self.carried.t.ncols();
            let [before, after] =
                [&self.carried.t, &next.carried.t].map(|t| t.column(j).into_owned());
            let law = flow.second_law_error(self.steps.method(), &part, [&before, &after]);
            self.sensitivity.enter_entropy(law);
        }
        self.sensitivity.frozen = self.steps.is_adaptive();
        self.sensitivity.undamped = self.steps.certificate().is_stiff();
        self.sensitivity.at_rest |=
            !flow.is_smooth_at_rest(self.steps.method()) && *last.start.x == state.point;
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

    /// The state at a fraction of the last step, by a step of that size, with its derivatives.
    pub(super) fn part(
        &self,
        (last, again): (&LastStep<'_, F>, Option<&Again<F::Vector>>),
        theta: f64,
    ) -> Result<(Element<F>, Moved), Unlinearised> {
        let (method, h) = (self.steps.method(), theta * last.h);
        let mut memory = memory_before::<F, M>(again)?;
        let taken = method.step(&last.start, h, &mut memory).map_err(|_| Unlinearised::Singular)?;
        let ended = Ended::new(&taken, h, &memory).with_again(again);
        let moved = propagate(method, &last.start, &ended, &self.carried)?;
        Ok((taken.x, moved))
    }

    /// An event of the last step with its derivatives, in the frame of its own state.
    pub(super) fn event(
        &self,
        last: (&LastStep<'_, F>, Option<&Again<F::Vector>>),
        scales: &Scales<F::Vector>,
        event: Event<F::Space>,
        theta: f64,
    ) -> Result<TangentEvent<F>, Unlinearised> {
        let (flow, n) = (self.steps.flow(), self.steps.flow().directions());
        let (reached, Moved { mut carried, along_h: mut velocity }) = self.part(last, theta)?;
        // The state of the output is not that of the step of this size, and may have another frame.
        if let Some(turn) = flow.turn(&reached, &event.state.point) {
            velocity = &turn * velocity;
            let turned = turn * carried.t.rows(0, n);
            carried.t.rows_mut(0, n).copy_from(&turned);
        }
        let (step, time) = (event.state.step, event.state.time);
        let state = self.at(step, time, event.state.point.clone(), carried);
        let (ends, reached) = (&scales.sizes, flow.units(&state.point));
        let sizes = DVector::from_fn(n, |i, _| ends.get(i).max(reached[i]));
        Ok(TangentEvent { event, state, velocity, sizes, after: None })
    }
}
