//! A run with its tangent, step by step.

use std::fmt;
use std::sync::Arc;

use metriplectic_dynamics::Differentiable;
use metriplectic_fields::{Column as _, Dimension as _, Space as _, Square as _, Vector};
use metriplectic_manifolds::Manifold as _;

use super::along::LinearisedAlong;
use super::certificate::Sensitivity;
use super::columns::Columns;
use super::duals::Hyperdual;
use super::error::{TangentError, Unlinearised};
use super::event::TangentEvent;
use super::frames::between;
use super::linearised::{Linearised, Propagated};
use super::part::{Ended, Part, Wide};
use super::pieces::propagate;
use super::state::TangentState;
use crate::run::certificate::Certificate;
use crate::run::ending::Ending;
use crate::run::event::Event;
use crate::run::jump::SmoothJump;
use crate::run::last_step::LastStep;
use crate::run::steps::Steps;
use crate::step::{Dim, Flow, Scales, Stepper, in_room};

/// A run with its tangent, step by step; made by [`Tangents::tangent_steps`](crate::Tangents::tangent_steps).
///
/// The steps are those of the run without it, bit for bit.
pub struct TangentSteps<'a, D: Differentiable, M: Stepper<D>> {
    pub(super) steps: Steps<'a, D, M>,
    pub(super) columns: Columns<Wide<D>>,
    pub(super) sensitivity: Sensitivity,
    /// The derivatives of the jumps, by the number of their event.
    pub(super) jumps: Jumps<D>,
}

/// The jumps of a schedule with their derivatives.
pub(super) type Jumps<D> = Vec<Option<Arc<SmoothJump<Hyperdual<Wide<D>>>>>>;

impl<D: Differentiable, M: Stepper<D>> fmt::Debug for TangentSteps<'_, D, M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TangentSteps")
            .field("sensitivity", &self.sensitivity)
            .finish_non_exhaustive()
    }
}

/// The state that a step has reached, and the events in it.
pub(super) struct Inside<D: Differentiable> {
    /// The states that the run yields in place of the one at the end of the step.
    pub(super) outputs: Vec<TangentState<D>>,
    pub(super) events: Vec<TangentEvent<D>>,
}

impl<D, M> TangentSteps<'_, D, M>
where
    D: Differentiable,
    M: Stepper<D> + LinearisedAlong<D>,
{
    /// The state reached so far, with its derivatives.
    pub fn state(&self) -> TangentState<D> {
        let state = self.steps.state();
        self.at(state.step, state.time, state.point.clone(), self.columns.clone())
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
        point: <D::Manifold as metriplectic_fields::Space>::Point<f64>,
        columns: Columns<Wide<D>>,
    ) -> TangentState<D> {
        let names = self.steps.flow().parameters().to_vec();
        TangentState { step, time, point, columns, names }
    }

    /// Takes one step. A run that has [ended](Self::ending) stays where it is.
    ///
    /// # Errors
    ///
    /// [`TangentError`]; the state is then the last one reached.
    pub fn advance(&mut self) -> Result<(), TangentError<D::Manifold>> {
        let flow = self.steps.flow();
        in_room(flow.wide(), || self.take_step().map(drop))
    }

    /// Takes one step, and returns what was asked for inside it.
    pub(super) fn take_step(&mut self) -> Result<Inside<D>, TangentError<D::Manifold>> {
        let scales = self.steps.scales();
        let before = self.steps.state().clone();
        self.steps.advance()?;
        let mut inside = Inside { outputs: Vec::new(), events: Vec::new() };
        let found = self.steps.take_events();
        if found.last().is_some_and(|event| event.jump.is_some()) {
            return self.cross(&scales, found);
        }
        if self.steps.state().step == before.step {
            return Ok(inside);
        }
        let failed = |cause| TangentError::NotLinearised { time: before.time, cause };
        let flow = self.steps.flow();
        let last = self.steps.last_step(&scales);
        let end = self.steps.state();
        let theta = |time: f64| (time - before.time) / (end.time - before.time);
        for event in found {
            let theta = theta(event.state.time);
            inside.events.push(self.event(&last, &scales, event, theta).map_err(failed)?);
        }
        let mut asked = self.asked();
        // The run has ended at the event, not at the end of the step.
        let stop = match (self.steps.ending(), inside.events.last()) {
            (Some(Ending::Event { .. }), Some(event)) => asked.pop().map(|_| event.state.clone()),
            _ => None,
        };
        let at_end = asked.iter().position(|(step, _)| *step == end.step).unwrap_or(asked.len());
        for &(step, time) in &asked[..at_end] {
            let (point, moved) = self.part(&last, theta(time)).map_err(failed)?;
            inside.outputs.push(self.at(step, time, point, moved.columns));
        }
        let state = self.steps.state();
        let ended = Ended::of_run(&state.point, &last);
        let next =
            propagate(self.steps.method(), &last.start, &ended, &self.columns).map_err(failed)?;
        let wide = flow.widened(&state.point);
        self.sensitivity.enter(flow.wide(), &wide, &next.columns).map_err(failed)?;
        // One column after the other, since the definition of the step at dual numbers is dear.
        if state.step.is_power_of_two() && !last.in_parts {
            let part = Part::new(&last.start, &ended);
            let j = state.step.trailing_zeros() as usize % Dim::<Wide<D>>::LEN;
            let column = [&self.columns.t, &next.columns.t].map(|t| t.column_at(j));
            let law = part.with(flow, |piece| {
                self.steps.method().entropy_law(flow.wide(), piece, [&column[0], &column[1]])
            });
            self.sensitivity.enter_entropy(law);
        }
        self.sensitivity.frozen = self.steps.is_adaptive();
        self.sensitivity.undamped = self.steps.certificate().is_stiff();
        self.sensitivity.at_rest |=
            !<M as Linearised<Wide<D>>>::SMOOTH_AT_REST && *last.start.x == state.point;
        self.columns = next.columns;
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
    #[allow(
        clippy::type_complexity,
        reason = "a point and its derivatives, which the caller takes apart at once"
    )]
    pub(super) fn part(
        &self,
        last: &LastStep<'_, D>,
        theta: f64,
    ) -> Result<
        (<D::Manifold as metriplectic_fields::Space>::Point<f64>, Propagated<Wide<D>>),
        Unlinearised,
    > {
        let (method, h, mut memory) = (self.steps.method(), theta * last.h, M::Memory::default());
        let taken = method.step(&last.start, h, &mut memory).map_err(|_| Unlinearised::Singular)?;
        let ended = Ended::new(&taken, h, &memory);
        let moved = propagate(method, &last.start, &ended, &self.columns)?;
        Ok((taken.x, moved))
    }

    /// An event of the last step with its derivatives, in the frame of its own state.
    pub(super) fn event(
        &self,
        last: &LastStep<'_, D>,
        scales: &Scales<<D as Flow>::Vector>,
        event: Event<D::Manifold>,
        theta: f64,
    ) -> Result<TangentEvent<D>, Unlinearised> {
        let n = Dim::<D>::LEN;
        let (reached, Propagated { mut columns, along_h }) = self.part(last, theta)?;
        let mut velocity = Vector::<D::Manifold>::from_index(|i| along_h[i]);
        // The state of the output is not that of the step of this size, and may have another frame.
        if D::Manifold::coordinates(&event.state.point, &reached).is_finite()
            && let Some(turn) = between::<D::Manifold>(&reached, &event.state.point)
        {
            velocity = turn * velocity;
            let t = columns.t;
            for j in 0..Dim::<Wide<D>>::LEN {
                let column = turn * Vector::<D::Manifold>::from_index(|i| t[(i, j)]);
                for i in 0..n {
                    columns.t[(i, j)] = column[i];
                }
            }
        }
        let (step, time) = (event.state.step, event.state.time);
        let state = self.at(step, time, event.state.point.clone(), columns);
        let (ends, reached) = (&scales.sizes, D::Manifold::scales(&state.point));
        let sizes = Vector::<D::Manifold>::from_index(|i| ends.0[i].max(reached[i]));
        Ok(TangentEvent { event, state, velocity, sizes, after: None })
    }
}
