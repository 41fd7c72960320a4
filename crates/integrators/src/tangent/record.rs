//! Runs with tangents, and their record.

use std::fmt;

use metriplectic_dynamics::Metriplectic;
use metriplectic_fields::Matrix;

use super::certificate::Sensitivity;
use super::columns::Carried;
use super::differentiated::Differentiated;
use super::error::TangentError;
use super::event::TangentEvent;
use super::refined::{REFINEMENTS, difference, refined};
use super::smooth::{FlowOf, SpaceOf};
use super::state::TangentState;
use super::steps::{Inside, TangentSteps, in_wide_room, smooth_events};
use crate::round_off::bound::SUMMED;
use crate::run::SpanError;
use crate::run::certificate::Certificate;
use crate::run::ending::Ending;
use crate::run::error::RunError;
use crate::run::method::Method as _;
use crate::run::paired::{Unpaired, paired};
use crate::run::recording::Numbered;
use crate::run::schedule::Schedule;
use crate::step::{Element, Flow, Stepper};

/// Runs with their derivatives, by every method whose steps are [differentiated](Differentiated).
///
/// ```
/// use metriplectic_dynamics::Family;
/// use metriplectic_fields::Real;
/// use metriplectic_integrators::{DormandPrince8, Span, Tangents};
/// use metriplectic_manifolds::LieDual;
/// use nalgebra::{Vector3, Vector4, vector};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let body = Family::on(LieDual::so3())
///     .parameters(["I1", "I2", "I3", "friction"])
///     .energy(|p: &Vector3<Real>, t: &Vector4<Real>| {
///         (p.x * p.x / t.x + p.y * p.y / t.y + p.z * p.z / t.z) * 0.5
///     })
///     .entropy(|p: &Vector3<Real>, t: &Vector4<Real>| p.norm_squared() * t.w * 0.5)
///     .build()?;
/// let system = body.at(vector![3.0, 2.0, 1.0, 0.05]);
/// let span = Span::until(20.0).tolerance(1e-8);
/// let run = DormandPrince8.tangent(&system, vector![0.4, -1.0, 0.3], span)?;
/// let friction = run.last().along("friction").unwrap();
/// println!("dx/dγ = {friction:.4}\n{}", run.sensitivity());
/// assert!(run.sensitivity().energy < 1e-12 && friction.norm() > 0.1);
/// # Ok(())
/// # }
/// ```
pub trait Tangents: Sized {
    /// Verifies the model, and starts a run with its tangent.
    ///
    /// Events of the schedule are found, and [`advance`](TangentSteps::advance) passes over outputs.
    ///
    /// # Errors
    ///
    /// [`TangentError`] if the model breaks a law, the schedule cannot be run, or it has jumps without
    /// [derivatives](crate::Jumping::differentiable).
    fn tangent_steps<D>(
        self,
        system: &D,
        x0: Element<FlowOf<D>>,
        schedule: impl Into<Schedule>,
    ) -> Result<TangentSteps<'_, D, Self>, TangentError<SpaceOf<D>>>
    where
        D: Differentiated<Self>,
        Self: Stepper<FlowOf<D>>,
    {
        let schedule: Schedule = schedule.into();
        let jumps = smooth_events((system, &self), &schedule)?;
        let steps = self.steps(system.as_flow(), x0, schedule)?;
        system.check_parameters(&steps.state().point).map_err(RunError::from)?;
        let laws = in_wide_room::<D, Self, _>(system, || system.wide_rows(&steps.state().point));
        let (carried, sensitivity) = (Carried::start(laws), Sensitivity::default());
        Ok(TangentSteps { system, steps, carried, sensitivity, jumps, largest: None })
    }

    /// Runs a system over a schedule, and records the states that a [run](crate::Method::run) records, with their derivatives:
    /// after each step or every so many, or at the [times asked for](crate::Watch::output_at); and the last one always. An output
    /// inside a step is a step of that fraction of the size.
    ///
    /// # Errors
    ///
    /// [`TangentError`].
    fn tangent<D>(
        self,
        system: &D,
        x0: Element<FlowOf<D>>,
        schedule: impl Into<Schedule>,
    ) -> Result<TangentRun<FlowOf<D>>, TangentError<SpaceOf<D>>>
    where
        D: Differentiated<Self>,
        Self: Stepper<FlowOf<D>>,
    {
        let steps = self.tangent_steps(system, x0, schedule)?;
        in_wide_room::<D, Self, _>(system, || record(steps))
    }

    /// Runs a system with its derivatives until they are as exact as `accuracy`.
    ///
    /// The tolerance that steps follow bounds the errors of the state, and a tangent is often some ten times less exact. So the
    /// run is made again with a tenth of its tolerance, or with halves of its steps, until the derivatives `T`, `T'` at the ends of two
    /// runs agree: `|T_j − T'_j| ≤ accuracy |T'_j|` for each column `j`, with entries in units of the
    /// [sizes](metriplectic_manifolds::Manifold::scales) of the state. That of the finer run is returned, and its
    /// [`Sensitivity::difference`] is the largest ratio. It is an error over the whole run, not in a step, so it includes what
    /// grows along the run; and every method has it.
    ///
    /// # Errors
    ///
    /// [`TangentError::Accuracy`] if the accuracy is not between `1.5e-14`, which is round-off, and 1, [`TangentError::Inexact`] if it is not reached with the smallest
    /// tolerance of the method or after twelve runs, and those of [`tangent`](Self::tangent).
    fn tangent_to<D>(
        self,
        system: &D,
        x0: Element<FlowOf<D>>,
        schedule: impl Into<Schedule>,
        accuracy: f64,
    ) -> Result<TangentRun<FlowOf<D>>, TangentError<SpaceOf<D>>>
    where
        D: Differentiated<Self>,
        Self: Clone + Stepper<FlowOf<D>>,
    {
        if !(SUMMED..1.0).contains(&accuracy) {
            return Err(TangentError::Accuracy { accuracy });
        }
        let mut schedule: Schedule = schedule.into();
        let mut coarse = self.clone().tangent(system, x0.clone(), schedule.clone())?;
        let mut reached = f64::INFINITY;
        for _ in 0..REFINEMENTS {
            let largest = coarse.certificate().largest_step;
            schedule = refined(&schedule, Stepper::<FlowOf<D>>::order(&self), largest);
            let fine = self.clone().tangent(system, x0.clone(), schedule.clone());
            let mut fine = match fine {
                Err(TangentError::Run(RunError::Span(SpanError::Tolerance { .. }))) => break,
                fine => fine?,
            };
            let ends = [coarse.last(), fine.last()];
            reached = difference::<D, Self>(system, &fine.states[0], ends);
            fine.sensitivity.difference = Some(reached);
            if reached <= accuracy {
                return Ok(fine);
            }
            coarse = fine;
        }
        Err(TangentError::Inexact { accuracy, reached })
    }
}

impl<M> Tangents for M {}

/// Takes all steps that are left.
fn record<D, M>(
    mut steps: TangentSteps<'_, D, M>,
) -> Result<TangentRun<FlowOf<D>>, TangentError<SpaceOf<D>>>
where
    D: Differentiated<M>,
    M: Stepper<FlowOf<D>>,
{
    let mut recording = steps.steps.recording(steps.state()).map_err(RunError::from)?;
    let mut events = Vec::new();
    while steps.ending().is_none() {
        let Inside { outputs, events: found } = steps.take_step()?;
        events.extend(found);
        if steps.steps.replaces_steps() {
            recording.states.extend(outputs);
        } else {
            let (step, over) = (steps.steps.state().step, steps.ending().is_some());
            recording.end_of_step(step, [over, false], || steps.state());
        }
    }
    let (certificate, sensitivity) = (steps.steps.certificate().clone(), steps.sensitivity);
    let ending = steps.ending().unwrap_or(Ending::Stopped);
    Ok(TangentRun { states: recording.states, events, certificate, ending, sensitivity })
}

impl<F: Flow> Numbered for TangentState<F> {
    fn step(&self) -> usize {
        self.step
    }
}

/// The record of a run with its tangent.
pub struct TangentRun<F: Flow> {
    states: Vec<TangentState<F>>,
    events: Vec<TangentEvent<F>>,
    certificate: Certificate,
    ending: Ending,
    sensitivity: Sensitivity,
}

impl<F: Flow> fmt::Debug for TangentRun<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TangentRun")
            .field("states", &self.states)
            .field("sensitivity", &self.sensitivity)
            .finish_non_exhaustive()
    }
}

impl<Y: Metriplectic> TangentRun<Y> {
    /// The matrix `∂x/∂x₀` at the end of the run, of the size that the compiler knows: the
    /// [derivative](TangentState::derivative) of its last state.
    ///
    /// ```
    /// # use metriplectic_dynamics::System;
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_integrators::{Span, Tangents, DormandPrince5};
    /// # use metriplectic_manifolds::LieDual;
    /// # use nalgebra::{Vector3, vector};
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # let body = System::on(LieDual::so3())
    /// #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
    /// #     .build()?;
    /// let run = DormandPrince5.tangent(&body, vector![0.4, 0.5, 0.3], Span::steps(0.1, 20))?;
    /// let mut v = Vector3::x();
    /// v = run.derivative() * v;
    /// assert!(v.norm() > 0.1);
    /// # Ok(())
    /// # }
    /// ```
    pub fn derivative(&self) -> Matrix<Y::Manifold> {
        self.last().derivative()
    }
}

impl<F: Flow> TangentRun<F> {
    /// The recorded states, the start first.
    pub fn states(&self) -> &[TangentState<F>] {
        &self.states
    }

    /// The state at the end of the run.
    pub fn last(&self) -> &TangentState<F> {
        &self.states[self.states.len() - 1]
    }

    /// The events with their derivatives.
    pub fn events(&self) -> &[TangentEvent<F>] {
        &self.events
    }

    /// The numbers of the states at some times, as [`Trajectory::indices_at`](crate::Trajectory::indices_at).
    ///
    /// # Errors
    ///
    /// [`Unpaired`].
    pub fn indices_at(&self, times: &[f64]) -> Result<Vec<usize>, Unpaired> {
        let recorded: Vec<f64> = self.states.iter().map(|state| state.time).collect();
        paired(times, &recorded, (self.ending, self.events.last().map(|event| &event.event.name)))
    }

    /// The balance of the run.
    pub const fn certificate(&self) -> &Certificate {
        &self.certificate
    }

    /// How the run ended.
    pub const fn ending(&self) -> Ending {
        self.ending
    }

    /// The laws of the tangent.
    pub const fn sensitivity(&self) -> &Sensitivity {
        &self.sensitivity
    }
}
