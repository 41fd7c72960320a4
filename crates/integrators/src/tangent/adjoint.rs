//! Gradients of losses over a run, by the transposed steps from its end to its start.

use std::fmt;
use std::ops::Index;

use metriplectic_fields::Real;
use nalgebra::DVector;

use super::differentiated::Differentiated;
use super::error::TangentError;
use super::product::{Product, pull_back};
use super::smooth::{FlowOf, SmoothFlow, SpaceOf, VectorOf};
use super::steps::in_wide_room;
use super::tape::{Segment, Tape, TapedStep};
use crate::run::certificate::Certificate;
use crate::run::ending::Ending;
use crate::run::paired::{Unpaired, paired};
use crate::run::schedule::Schedule;
use crate::run::state::State;
use crate::step::{Element, HasFlow, Stepper};

/// Runs whose losses have gradients, by every method whose steps are [differentiated](Differentiated).
///
/// A loss `ℓ = Σ_k ℓ_k(x_k)` over states of a run has the gradient `(∂ℓ/∂x₀, ∂ℓ/∂θ)`. Its costate goes from the end to the
/// start, by the transposed derivatives of the discrete steps:
///
/// ```math
/// \lambda_k = J_k^\top \lambda_{k+1} + \frac{\partial\ell_k}{\partial x_k} .
/// ```
///
/// It is the transpose of the [tangent](super::Tangents) of the same run: to round-off, or to the digits of differences where these are its
/// derivatives. No equation is integrated backwards, since friction would grow.
///
/// At an event with a [jump](crate::Watched::jump) the costate goes back by the transposed saltation matrix, since the time of the event
/// depends on the start. So does the end of a run at an event that [stops](crate::Watched::stop) it. Both need their derivatives
/// ([`Jumping::differentiable`](crate::Jumping::differentiable), [`Watched::differentiable`](crate::Watched::differentiable)).
///
/// ```
/// use metriplectic_dynamics::Family;
/// use metriplectic_fields::Real;
/// use metriplectic_integrators::{Adjoints, DormandPrince8, Span, Watch as _};
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
/// let span = Span::until(20.0).tolerance(1e-8).output_at([5.0, 10.0, 20.0]);
/// let run = DormandPrince8.adjoint(&system, vector![0.4, -1.0, 0.3], span)?;
///
/// // State 0 is the start, and states 1 to 3 are the outputs. The last state is the end of the run, asked for or not.
/// let data = vector![0.1, -0.9, 0.4];
/// let loss = run.gradient(|k, p: &Vector3<Real>| {
///     if k == 0 { 0.0.into() } else { (p - data.map(Real::from)).norm_squared() }
/// })?;
/// println!("ℓ = {:.4}, dℓ/dx₀ = {:.4}", loss.value, loss.along_start());
/// println!("dℓ/dγ = {:.4}", loss.along("friction").unwrap());
/// # assert!(loss.along_parameters().len() == 4);
/// # Ok(())
/// # }
/// ```
pub trait Adjoints: Sized {
    /// Runs a system over a schedule, and keeps the steps for gradients: those of the last [`WITHIN`] steps, and a checkpoint
    /// every so many.
    ///
    /// The states of the loss are those that a [run](crate::Method::run) records: after each step or every so many, or at the
    /// [times asked for](crate::Watch::output_at); and the last one always. An output inside a step is a step of that fraction of
    /// its size. [`AdjointRun::indices_at`] has the number of the state at a time.
    ///
    /// # Errors
    ///
    /// [`TangentError`]; [`TangentError::Broken`] if the schedule has jumps without
    /// [derivatives](crate::Jumping::differentiable), and [`TangentError::Grazing`] at an event whose time has none.
    fn adjoint<D>(
        self,
        system: &D,
        x0: Element<FlowOf<D>>,
        schedule: impl Into<Schedule>,
    ) -> Result<AdjointRun<'_, D, Self>, TangentError<SpaceOf<D>>>
    where
        D: Differentiated<Self>,
        Self: Clone + Stepper<FlowOf<D>>,
    {
        self.adjoint_within(WITHIN, system, x0, schedule)
    }

    /// Runs as [`adjoint`](Self::adjoint) does, and keeps at most `steps` steps. A run of `N` has a checkpoint every `steps`, from
    /// which a gradient takes them again: at `steps = √N` the memory is of order `√N`, for the price of one more run.
    ///
    /// Without outputs each state is recorded, whatever `steps` is; [`Until::at_most`](crate::Until::at_most) bounds them.
    ///
    /// # Errors
    ///
    /// The errors of [`adjoint`](Self::adjoint).
    fn adjoint_within<D>(
        self,
        steps: usize,
        system: &D,
        x0: Element<FlowOf<D>>,
        schedule: impl Into<Schedule>,
    ) -> Result<AdjointRun<'_, D, Self>, TangentError<SpaceOf<D>>>
    where
        D: Differentiated<Self>,
        Self: Clone + Stepper<FlowOf<D>>,
    {
        let schedule = schedule.into();
        in_wide_room::<D, Self, _>(system, || {
            let tape = Tape::record(self.clone(), system, (x0, schedule), steps.max(1))?;
            Ok(AdjointRun { system, method: self, tape })
        })
    }
}

impl<M> Adjoints for M {}

/// Steps that [`Adjoints::adjoint`] keeps.
pub const WITHIN: usize = 1 << 16;

/// A run whose losses have gradients; made by [`Adjoints::adjoint`].
pub struct AdjointRun<'a, D: HasFlow, M> {
    system: &'a D,
    method: M,
    tape: Tape<FlowOf<D>>,
}

impl<D: HasFlow, M> fmt::Debug for AdjointRun<'_, D, M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("AdjointRun").field("states", &self.tape.states).finish_non_exhaustive()
    }
}

/// A loss with its gradient along the start and the parameters of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct LossGradient {
    /// The loss.
    pub value: f64,
    pub(super) row: DVector<f64>,
    pub(super) start: usize,
    pub(super) names: Vec<&'static str>,
}

impl LossGradient {
    /// The derivative `∂ℓ/∂x₀` in the frame of the chart at the start.
    pub fn along_start(&self) -> DVector<f64> {
        self.row.rows(0, self.start).into_owned()
    }

    /// The derivative `∂ℓ/∂θ`, one entry a parameter.
    pub fn along_parameters(&self) -> DVector<f64> {
        self.row.rows(self.start, self.row.len() - self.start).into_owned()
    }

    /// The derivative along a parameter; `None` if there is none of this name.
    pub fn along(&self, parameter: &str) -> Option<f64> {
        let k = self.names.iter().position(|name| *name == parameter)?;
        Some(self.row[self.start + k])
    }
}

impl<D, M> AdjointRun<'_, D, M>
where
    D: Differentiated<M>,
    M: Clone + Stepper<FlowOf<D>>,
{
    /// The recorded states, the start first.
    pub fn states(&self) -> &[State<SpaceOf<D>>] {
        &self.tape.states
    }

    /// The state at the end of the run.
    pub fn last(&self) -> &State<SpaceOf<D>> {
        &self.tape.states[self.tape.states.len() - 1]
    }

    /// The numbers of the states at some times, as [`Trajectory::indices_at`](crate::Trajectory::indices_at).
    ///
    /// # Errors
    ///
    /// [`Unpaired`].
    pub fn indices_at(&self, times: &[f64]) -> Result<Vec<usize>, Unpaired> {
        let recorded: Vec<f64> = self.states().iter().map(|state| state.time).collect();
        paired(times, &recorded, (self.ending(), None))
    }

    /// The balance of the run.
    pub const fn certificate(&self) -> &Certificate {
        &self.tape.certificate
    }

    /// How the run ended.
    pub const fn ending(&self) -> Ending {
        self.tape.ending
    }

    /// Computes the loss `Σ_k ℓ_k(x_k)` and its gradient, by a closure `|k, x|` over the numbers and the points of the
    /// [states](Self::states).
    ///
    /// # Errors
    ///
    /// [`TangentError::NotLinearised`] if a step has no derivative, and [`TangentError::Broken`] if the loss has a term at the event that
    /// ended the run and its function has [no derivatives](crate::Watched::differentiable).
    pub fn gradient(
        &self,
        loss: impl Fn(usize, &<FlowOf<D> as SmoothFlow>::Moving) -> Real,
    ) -> Result<LossGradient, TangentError<SpaceOf<D>>> {
        let mut value = 0.0;
        let mut rows = Vec::with_capacity(self.states().len());
        for (k, state) in self.states().iter().enumerate() {
            let (here, df) = self.system.as_flow().differential(&|x| loss(k, x), &state.point);
            value += here;
            rows.push(df);
        }
        Ok(LossGradient { value, ..self.pull_back(&rows)? })
    }

    /// Computes the gradient of a loss from its derivatives along the [states](Self::states), in the frames there. States
    /// without one are those behind the list; the value is 0.
    ///
    /// # Errors
    ///
    /// The errors of [`gradient`](Self::gradient).
    pub fn pull_back<R: Index<usize, Output = f64>>(
        &self,
        rows: &[R],
    ) -> Result<LossGradient, TangentError<SpaceOf<D>>> {
        in_wide_room::<D, M, _>(self.system, || self.backwards(rows, 0.0))
    }

    /// Computes the gradient of the time at which the run has ended: zero, unless it has ended at an
    /// [event](crate::Watched::stop).
    ///
    /// # Errors
    ///
    /// The errors of [`gradient`](Self::gradient).
    pub fn gradient_of_end(&self) -> Result<LossGradient, TangentError<SpaceOf<D>>> {
        let none: &[DVector<f64>] = &[];
        let found = in_wide_room::<D, M, _>(self.system, || self.backwards(none, 1.0))?;
        Ok(LossGradient { value: self.last().time, ..found })
    }

    /// The gradient of a loss with these derivatives along the states and along the time of the end.
    fn backwards<R: Index<usize, Output = f64>>(
        &self,
        rows: &[R],
        along_end: f64,
    ) -> Result<LossGradient, TangentError<SpaceOf<D>>> {
        let (n, names) = (self.system.as_flow().directions(), self.system.names().to_vec());
        let all = n + names.len();
        let row = |k: usize| {
            let row = rows.get(k);
            DVector::from_fn(all, |i, _| row.filter(|_| i < n).map_or(0.0, |row| row[i]))
        };
        let mut costate = row(rows.len());
        for (k, segment) in self.tape.segments.iter().enumerate().rev() {
            let is_last = k + 1 == self.tape.segments.len();
            let again =
                if is_last { None } else { Some(self.again(segment, &self.tape.segments[k + 1])?) };
            for step in again.as_ref().unwrap_or(&self.tape.steps).iter().rev() {
                costate = self.before(step, costate, (&row, along_end))?;
            }
        }
        let row = costate + row(0);
        Ok(LossGradient { value: 0.0, row, start: n, names })
    }

    /// The steps of a segment, taken again.
    fn again(
        &self,
        segment: &Segment<VectorOf<D>>,
        next: &Segment<VectorOf<D>>,
    ) -> Result<Vec<TapedStep<FlowOf<D>>>, TangentError<SpaceOf<D>>> {
        self.tape.again(self.method.clone(), self.system, [segment, next])
    }

    /// The costate at the start of a step from that at its end.
    fn before(
        &self,
        step: &TapedStep<FlowOf<D>>,
        costate: DVector<f64>,
        (row, along_end): (&impl Fn(usize) -> DVector<f64>, f64),
    ) -> Result<DVector<f64>, TangentError<SpaceOf<D>>> {
        let time = step.time;
        let through = |product: &Product<FlowOf<D>>, costate: DVector<f64>| {
            let pulled = pull_back((self.system, &self.method), product, costate);
            pulled.map_err(|cause| TangentError::NotLinearised { time, cause })
        };
        let [inside, at_end] = self.tape.recorded(step);
        let costate = at_end.fold(costate, |sum, k| sum + row(k));
        let mut before = through(&step.product, step.end.pull_back(costate, along_end)?)?;
        for (k, output) in inside.zip(&step.outputs) {
            before += through(output, row(k))?;
        }
        Ok(before)
    }
}
