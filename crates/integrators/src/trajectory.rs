//! Steps in a row, with their certificate.

use approx::{AbsDiffEq, RelativeEq};
use metriplectic_dynamics::velocity::{Covectors, Gradient};
use metriplectic_dynamics::{Dissipation, Invariants, Metriplectic, SecondLaw, system::Point};
use metriplectic_fields::{ChartPoint, Column, Dimension, ScalarField, Space, Vector};
use metriplectic_manifolds::{Cayley, Exponential, Manifold, Projection, Retraction, WeylMidpoint};

use crate::adaptive::{Controller, StepSize};
use crate::certificate::{Certificate, InvariantBalance, round_off};
use crate::checkpoint::{Checkpoint, ResumeError};
use crate::discrete_gradient::{DiscreteGradient, Gonzalez};
use crate::error::{RunError, StepError};
use crate::residual::{Dim, DriftCorrection, Numbers, size_of_terms};
use crate::scales::{Scales, larger};
use crate::span::{ROOM, Schedule, Size, SpanError};
use crate::step::{
    Effort, Fallbacks, Memory, Scheme, Start, breaks_first_law, dependent_invariant,
};

/// A state of a run: time, point, and the two fields there.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(bound = "M: Manifold"))]
#[non_exhaustive]
pub struct State<M: Space> {
    /// Steps taken.
    pub step: usize,
    /// The time: `t₀ + step · h` in steps of one size, `t₀` and their sum in others.
    pub time: f64,
    /// The point; serialized as the list of its entries, in the order of [`Manifold::entries`].
    #[cfg_attr(feature = "serde", serde(serialize_with = "entries::<M, _>"))]
    pub point: M::Point<f64>,
    /// The energy `H` there.
    pub energy: f64,
    /// The entropy `S` there; 0 without an entropy.
    pub entropy: f64,
}

#[cfg(feature = "serde")]
fn entries<M: Manifold, S: serde::Serializer>(
    point: &M::Point<f64>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(M::entries(point))
}

/// How a run ended.
///
/// ```
/// # use metriplectic_dynamics::System;
/// # use metriplectic_fields::Real;
/// # use metriplectic_integrators::{Ending, Run, Span};
/// # use metriplectic_manifolds::{LieDual, WeylMidpoint};
/// # use nalgebra::Vector3;
/// # fn main() -> Result<(), metriplectic_integrators::Error> {
/// # let body = System::on(LieDual::so3())
/// #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
/// #     .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
/// #     .build()?;
/// let span = Span::until(1e4).tolerance(1e-5).until_rest(1e-8);
/// let run = WeylMidpoint.run(&body, Vector3::new(0.4, 0.5, 0.3), span)?;
/// match run.ending() {
///     Ending::Rest { speed, .. } => println!("at rest at t = {}, speed {speed:.1e}", run.last().time),
///     Ending::Span => println!("still moving at t = {}", run.last().time),
///     _ => unreachable!("a run that stops is an error"),
/// }
/// # assert!(run.ending().is_rest() && run.last().time < 1e3);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Ending {
    /// It went the whole span.
    Span,
    /// The state came to rest: the speed fell below the tolerance times the one with the largest velocity of
    /// each entry, or a step changed neither an entry nor its lost digits.
    ///
    /// The speed is the norm of `(Π dH + K dS)_i / s_i`, each entry relative to its own size, in units of
    /// one over the time: `1/speed` is how long the state would take to move by its own size.
    Rest {
        /// The speed at the end.
        speed: f64,
        /// The largest speed of the run, to which the tolerance is relative.
        largest: f64,
    },
    /// It stopped on the way: a step failed, or nobody asked for the next.
    Stopped,
}

impl Ending {
    /// Whether the state came to rest.
    pub const fn is_rest(&self) -> bool {
        matches!(self, Self::Rest { .. })
    }
}

/// The iterator over the states of a run after its start, in constant memory; ended by an error, or
/// where its course ends. With a step size alone it is endless.
///
/// Made by [`Scheme::steps`] or [`Run::steps`].
#[derive(Debug)]
pub struct Steps<'a, Y: Metriplectic, R, W = Gonzalez> {
    pub(crate) scheme: Scheme<R, W>,
    pub(crate) system: &'a Y,
    pub(crate) progress: Progress<Dim<Y>>,
    pub(crate) state: State<Y::Manifold>,
    pub(crate) invariants: Numbers<Y>,
    /// The entropy after the last step that dissipated.
    pub(crate) entropy: f64,
    pub(crate) memory: Memory<Dim<Y>>,
    pub(crate) certificate: Certificate,
    pub(crate) failed: bool,
}

/// Where a run is on its course.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Progress<N: Dimension> {
    pub(crate) pace: StepSize<N>,
    /// The time at which the run started.
    pub(crate) start: f64,
    pub(crate) count: Option<usize>,
    pub(crate) every: usize,
    /// The most states to record.
    pub(crate) most: Option<usize>,
    /// The sizes of the entries so far, where errors or rest are judged by them.
    pub(crate) scales: Scales<N>,
    /// The tolerance of rest.
    pub(crate) rest: Option<f64>,
    /// The largest velocity of each entry so far, where rest is looked for.
    pub(crate) largest_velocity: N::Vector<f64>,
    pub(crate) ending: Option<Ending>,
}

impl<N: Dimension> Progress<N> {
    /// Whether errors or rest are judged by the sizes of the entries.
    pub(crate) const fn judges_sizes(&self) -> bool {
        self.rest.is_some() || matches!(self.pace, StepSize::Adaptive(_))
    }
}

impl<'a, Y, R, W> Steps<'a, Y, R, W>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    fn start(
        scheme: Scheme<R, W>,
        system: &'a Y,
        x0: Point<Y>,
        course: Schedule,
    ) -> Result<Self, SpanError> {
        let energy = system.energy_at(&x0);
        let entropy = system.entropy_at(&x0);
        let certificate = Certificate {
            initial_energy: energy,
            max_energy_error: 0.0,
            energy_scale: size_of_terms::<Y::Manifold>(system.energy(), &x0),
            initial_entropy: entropy,
            min_entropy_increment: 0.0,
            entropy_gained: 0.0,
            entropy_falls: 0,
            min_entropy_slope: f64::INFINITY,
            invariants: InvariantBalance::of(system, &x0),
            max_manifold_defect: system.manifold().defect(&x0),
            steps: 0,
            smallest_step: 0.0,
            largest_step: 0.0,
            rejected: 0,
            iterations: 0,
            worst_iterations: 0,
            retries: 0,
            continued: 0,
            globalised: 0,
            second_law: system.second_law(),
            friction: 0.0,
            projected: system.dissipation().is_projected(),
        };
        let scales = course.span().map_or_else(Scales::zero, |span| Scales::at(system, &x0, span));
        let Schedule { size, start, count, every, most, rest } = course;
        let pace = match size {
            Size::Fixed(h) => StepSize::Fixed(h),
            Size::Tolerance(adaptive) => {
                StepSize::Adaptive(adaptive.controller(system, (&x0, start), &scales)?)
            }
        };
        let (largest_velocity, ending) = (Column::zero(), None);
        let progress =
            Progress { pace, start, count, every, most, scales, rest, largest_velocity, ending };
        let invariants = values(system, &x0);
        let state = State { step: 0, time: start, point: x0, energy, entropy };
        let memory = Memory::new();
        let mut steps = Self {
            scheme,
            system,
            progress,
            state,
            invariants,
            entropy,
            memory,
            certificate,
            failed: false,
        };
        steps.rest(true);
        Ok(steps)
    }

    /// The state reached so far.
    pub const fn state(&self) -> &State<Y::Manifold> {
        &self.state
    }

    /// The balance of the steps taken so far.
    pub const fn certificate(&self) -> &Certificate {
        &self.certificate
    }

    /// How the run ended; `None` as long as there are steps to take.
    pub const fn ending(&self) -> Option<Ending> {
        if self.failed { Some(Ending::Stopped) } else { self.progress.ending }
    }

    /// Takes one step. A run that has [ended](Self::ending) stays where it is.
    ///
    /// # Errors
    ///
    /// [`StepError`]; the state is then the last one reached.
    pub fn advance(&mut self) -> Result<&State<Y::Manifold>, StepError> {
        if self.progress.ending.is_some() {
            return Ok(&self.state);
        }
        let step = self.state.step + 1;
        let Taken { point, work, h, time } = match self.progress.pace {
            StepSize::Fixed(h) => {
                let (scheme, system) = (&self.scheme, self.system);
                let kept = (&self.invariants, self.entropy);
                let start = from(&self.state, kept, &self.certificate, h);
                let (point, work) = scheme.step(system, &start, &mut self.memory)?;
                Taken { point, work, h, time: self.progress.start + step as f64 * h }
            }
            StepSize::Adaptive(controller) => self.controlled(controller)?,
        };
        let next = State { step, time, energy: work.energy, entropy: work.entropy, point };
        let change = next.energy - self.certificate.initial_energy;
        let ends = [&self.state.point, &next.point];
        if let Some(size) = breaks_first_law(self.system, change, ends, next.energy) {
            let time = self.state.time;
            return Err(StepError::FirstLawBroken { time, h, change, size });
        }
        self.account(&next, work, h);
        if work.dissipates {
            self.entropy = next.entropy;
        }
        let before = std::mem::replace(&mut self.state, next);
        if Y::Invariants::COUNT > 0 {
            self.account_invariants(&before)?;
        }
        let over = match self.progress.pace {
            StepSize::Fixed(_) => self.progress.count.is_some_and(|count| step >= count),
            StepSize::Adaptive(Controller { end, .. }) => self.state.time >= end,
        };
        if over {
            self.progress.ending = Some(Ending::Span);
        }
        if self.progress.judges_sizes() {
            let here = Y::Manifold::scales(&self.state.point);
            self.progress.scales = self.progress.scales.or(&here);
        }
        self.rest(!work.rests);
        Ok(&self.state)
    }

    /// Tries steps until the controller accepts one. Not part of the loop over steps of one size, which
    /// is compiled for every system.
    #[inline(never)]
    fn controlled(&mut self, mut controller: Controller<Dim<Y>>) -> Result<Taken<Y>, StepError> {
        let (system, time, mut work) = (self.system, self.state.time, Effort::default());
        let (mut tries, mut broken) = (0, None);
        loop {
            tries += 1;
            if tries == TRIES {
                // An entry that begins to move only now has no size yet.
                let here = Scales::at(system, &self.state.point, controller.end - time);
                self.progress.scales = self.progress.scales.and(&here);
            }
            let (h, last) = controller.attempt(time);
            if controller.next < controller.least() && !last {
                let (h, least) = (controller.next, controller.least());
                let too_small = StepError::TooSmall { time, h, least };
                let cause = broken.or_else(|| self.dependent(&self.state));
                return Err(cause.unwrap_or(too_small));
            }
            if time + h <= time {
                let standstill = StepError::Standstill { time, h: controller.next };
                return Err(broken.unwrap_or(standstill));
            }
            let ratio = controller.taken.map_or(1.0, |taken| h / taken);
            let mut memory = self.memory.rescaled(ratio);
            (work.entropy_slope, work.friction) = (f64::INFINITY, 0.0);
            let kept = (&self.invariants, self.entropy);
            let start = from::<Y>(&self.state, kept, &self.certificate, h);
            let end =
                self.scheme.attempt(system, &start, &mut memory, Fallbacks::NewtonOnly, &mut work);
            let end = end.map_err(|lost| broken = lost.first_law(time, h).or(broken)).ok();
            let error = end.as_ref().and_then(|end| {
                let scales = self.progress.scales.or(&Y::Manifold::scales(end));
                controller.error_of(system, (start.x, end), h, &scales)
            });
            match (end, error) {
                (Some(point), Some(error)) if error <= 1.0 => {
                    controller.accept(h, error);
                    self.memory = memory;
                    self.progress.pace = StepSize::Adaptive(controller);
                    let time = if last { controller.end } else { time + h };
                    return Ok(Taken { point, work, h, time });
                }
                (_, error) => {
                    controller.reject(h, error);
                    self.certificate.rejected += 1;
                }
            }
        }
    }

    /// Ends the run if the state is at rest.
    fn rest(&mut self, moved: bool) {
        let Some(tolerance) = self.progress.rest else { return };
        let x = &self.state.point;
        let Ok(v) = self.system.velocity(&ChartPoint::<Y::Manifold>::centre(x)) else { return };
        let Progress { scales, largest_velocity, .. } = &mut self.progress;
        *largest_velocity = larger(largest_velocity, &Column::from_index(|i| v[i].abs()));
        // In units of the same sizes: an entry has been smaller than it is.
        let (speed, largest) = (scales.speed(&v), scales.speed(largest_velocity));
        if !moved || speed <= tolerance * largest {
            self.progress.ending = Some(Ending::Rest { speed, largest });
        }
    }

    /// Takes all steps that are left, and records the states from here on.
    ///
    /// # Errors
    ///
    /// [`RunError::Step`] if a step failed, with the trajectory so far;
    /// [`SpanError::Endless`] if the course has no end.
    pub fn run(mut self) -> Result<Trajectory<Y::Manifold>, RunError<Y::Manifold>> {
        let Progress { count, mut every, most, pace, .. } = self.progress;
        if count.is_none() && matches!(pace, StepSize::Fixed(_)) {
            return Err(SpanError::Endless.into());
        }
        let room = count.map_or(ROOM, |count| (count - self.state.step.min(count)) / every);
        let mut states = Vec::with_capacity(room.min(ROOM) + 2);
        states.push(self.state.clone());
        let mut failure = None;
        while self.progress.ending.is_none() && failure.is_none() {
            failure = self.advance().err();
            let state = &self.state;
            let due = state.step.is_multiple_of(every) && failure.is_none();
            let over = self.progress.ending.is_some() || failure.is_some();
            if (due || over) && states.last().is_none_or(|last| last.step != state.step) {
                states.push(state.clone());
            }
            while most.is_some_and(|most| states.len() > most) {
                every = every.saturating_mul(2);
                thin_out(&mut states, every, over);
            }
        }
        let ending = self.progress.ending.unwrap_or(Ending::Stopped);
        let checkpoint = self.checkpoint();
        let trajectory = Trajectory { states, certificate: self.certificate, ending, checkpoint };
        match failure {
            Some(cause) => Err(RunError::Step { cause, trajectory: Box::new(trajectory) }),
            None => Ok(trajectory),
        }
    }

    /// The further invariant that depends on the other fields at a state, as an error.
    #[cold]
    fn dependent(&self, &State { time, ref point, .. }: &State<Y::Manifold>) -> Option<StepError> {
        let (index, fraction) = dependent_invariant(self.system, point)?;
        let change = self.certificate.invariants[index].max_error;
        Some(StepError::DependentInvariants { time, index, change, fraction })
    }

    /// Enters the further invariants into the certificate.
    ///
    /// # Errors
    ///
    /// [`StepError::DependentInvariants`] if one is no longer conserved because its differential depends
    /// on those of the others.
    fn account_invariants(&mut self, before: &State<Y::Manifold>) -> Result<(), StepError> {
        self.invariants = values(self.system, &self.state.point);
        let mut lost = false;
        for (index, kept) in self.certificate.invariants.iter_mut().enumerate() {
            kept.max_error = kept.max_error.max((self.invariants[index] - kept.initial).abs());
            // The terms are evaluated where the error asks for them, and not in every step.
            if kept.max_error > round_off(kept.scale) {
                let size = sizes::<Y>(self.system, &self.state.point)[index];
                kept.scale = kept.scale.max(size);
            }
            lost |= kept.max_error > LOST * kept.scale;
        }
        if lost { self.dependent(before).map_or(Ok(()), Err) } else { Ok(()) }
    }

    /// Enters a step into the certificate.
    fn account(&mut self, next: &State<Y::Manifold>, work: Effort, h: f64) {
        let c = &mut self.certificate;
        c.smallest_step = if c.steps == 0 { h } else { c.smallest_step.min(h) };
        c.largest_step = c.largest_step.max(h);
        let error = (next.energy - c.initial_energy).abs();
        c.max_energy_error = c.max_energy_error.max(error);
        // The terms of the energy are evaluated where the error asks for them, and not in every step.
        if error > round_off(c.energy_scale) {
            let size = size_of_terms::<Y::Manifold>(self.system.energy(), &next.point);
            c.energy_scale = c.energy_scale.max(size);
        }
        let increment = next.entropy - self.state.entropy;
        c.min_entropy_increment =
            if c.steps == 0 { increment } else { c.min_entropy_increment.min(increment) };
        c.entropy_gained = next.entropy - c.initial_entropy;
        if increment < 0.0
            && increment < -entropy_round_off(self.system, [&self.state.point, &next.point])
        {
            c.entropy_falls += 1;
        }
        c.min_entropy_slope = c.min_entropy_slope.min(work.entropy_slope);
        c.max_manifold_defect =
            c.max_manifold_defect.max(self.system.manifold().defect(&next.point));
        c.steps += 1;
        c.iterations += work.iterations;
        c.worst_iterations = c.worst_iterations.max(work.iterations);
        c.retries += work.splits;
        c.friction = c.friction.max(work.friction);
        c.continued += work.continued;
        c.globalised += work.globalised;
    }
}

/// Steps that are tried before the sizes of the entries are estimated anew.
const TRIES: usize = 3;

/// Gives up the states between the first and the last that no multiple of `every` steps leads to, and
/// the last one too unless it is to be kept.
fn thin_out<M: Space>(states: &mut Vec<State<M>>, every: usize, keeps_last: bool) {
    let last = states.len() - 1;
    let mut index = 0..;
    states.retain(|state| {
        let index = index.next().unwrap_or(last);
        index == 0 || index == last && keeps_last || state.step.is_multiple_of(every)
    });
}

/// A step that was taken.
struct Taken<Y: Metriplectic> {
    point: Point<Y>,
    work: Effort,
    h: f64,
    time: f64,
}

/// Where the next step starts, with the further invariants there and the entropy that is kept.
fn from<'a, Y: Metriplectic>(
    state: &'a State<Y::Manifold>,
    (invariants, entropy): (&Numbers<Y>, f64),
    certificate: &Certificate,
    h: f64,
) -> Start<'a, Y> {
    let exact = certificate.second_law == SecondLaw::Exact;
    Start {
        x: &state.point,
        time: state.time,
        h,
        energy: state.energy,
        entropy: state.entropy,
        invariants: *invariants,
        accumulated_error: DriftCorrection {
            energy: state.energy - certificate.initial_energy,
            entropy: if exact { state.entropy - entropy } else { 0.0 },
            invariants: Dim::<Y>::array(|k| {
                let kept = certificate.invariants.get(k);
                kept.map_or(0.0, |kept| invariants[k] - kept.initial)
            }),
        },
    }
}

/// The error of a further invariant, relative to its terms, above which it is no longer conserved. What
/// fades out of `Π̃` stays far below it: `10⁻⁴h²`.
const LOST: f64 = 1e-4;

/// The further invariants of a system at a point.
fn values<Y: Metriplectic>(system: &Y, x: &Point<Y>) -> Numbers<Y> {
    struct Values<'a, M: Space>(&'a M::Point<f64>);
    impl<M: Space> Gradient<M> for Values<'_, M> {
        type Covector = f64;

        fn of(&mut self, f: &impl ScalarField<M>) -> f64 {
            f.at(self.0)
        }
    }
    of_each::<Y>(system, &mut Values::<Y::Manifold>(x))
}

/// The sizes of the terms of the further invariants at a point.
fn sizes<Y: Metriplectic>(system: &Y, x: &Point<Y>) -> Numbers<Y> {
    struct Sizes<'a, M: Space>(&'a M::Point<f64>);
    impl<M: Manifold> Gradient<M> for Sizes<'_, M> {
        type Covector = f64;

        fn of(&mut self, f: &impl ScalarField<M>) -> f64 {
            size_of_terms::<M>(f, self.0)
        }
    }
    of_each::<Y>(system, &mut Sizes::<Y::Manifold>(x))
}

/// A number for each of the further invariants.
fn of_each<Y: Metriplectic>(
    system: &Y,
    number: &mut impl Gradient<Y::Manifold, Covector = f64>,
) -> Numbers<Y> {
    let numbers = Covectors::new([0.0; 2], system.invariants(), number);
    Dim::<Y>::array(|k| numbers.invariants[k].map_or(0.0, |(_, value)| value))
}

/// The round-off `4ε (|S| + Σ_i |∂_iS x_i|)` of an entropy increment, the larger one of the two ends. The
/// entries of `x' = x + u` are rounded in units of the larger end, so `x_i` is that of both.
pub(crate) fn entropy_round_off<Y: Metriplectic>(system: &Y, ends: [&Point<Y>; 2]) -> f64 {
    let [x, y] = ends.map(Y::Manifold::scales);
    let scales = Vector::<Y::Manifold>::from_index(|i| x[i].max(y[i]));
    let sizes = ends.map(|x| {
        let jet = system.entropy().jet1(x);
        jet.value.abs() + jet.df.abs().dot(&scales)
    });
    4.0 * f64::EPSILON * sizes[0].max(sizes[1])
}

impl<Y, R, W> Iterator for Steps<'_, Y, R, W>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    type Item = Result<State<Y::Manifold>, StepError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ending().is_some() {
            return None;
        }
        let advanced = self.advance().cloned();
        self.failed = advanced.is_err();
        Some(advanced)
    }
}

/// The record of a run: states and certificate.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(bound = "M: Manifold"))]
pub struct Trajectory<M: Manifold> {
    states: Vec<State<M>>,
    certificate: Certificate,
    ending: Ending,
    #[cfg_attr(feature = "serde", serde(skip))]
    checkpoint: Checkpoint,
}

impl<M: Manifold> Trajectory<M> {
    /// The recorded states, the start first.
    pub fn states(&self) -> &[State<M>] {
        &self.states
    }

    /// The state at the end of the run.
    pub fn last(&self) -> &State<M> {
        &self.states[self.states.len() - 1]
    }

    /// The balance of the run, over all of its steps, recorded or not.
    pub const fn certificate(&self) -> &Certificate {
        &self.certificate
    }

    /// How the run ended.
    pub const fn ending(&self) -> Ending {
        self.ending
    }

    /// Where the run was put down: at its end, or before the step that failed. From here it goes on,
    /// with a later end ([`Checkpoint::with_steps`], [`Checkpoint::with_end`]) or another scheme.
    pub const fn checkpoint(&self) -> &Checkpoint {
        &self.checkpoint
    }

    /// The recorded states in order.
    pub fn iter(&self) -> std::slice::Iter<'_, State<M>> {
        self.states.iter()
    }
}

impl<'a, M: Manifold> IntoIterator for &'a Trajectory<M> {
    type Item = &'a State<M>;
    type IntoIter = std::slice::Iter<'a, State<M>>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

/// States are compared by their times and the entries of their points.
impl<M: Manifold> AbsDiffEq for State<M>
where
    Self: PartialEq,
{
    type Epsilon = f64;

    fn default_epsilon() -> f64 {
        f64::default_epsilon()
    }

    fn abs_diff_eq(&self, other: &Self, epsilon: f64) -> bool {
        self.time.abs_diff_eq(&other.time, epsilon)
            && M::entries(&self.point).abs_diff_eq(&M::entries(&other.point), epsilon)
    }
}

impl<M: Manifold> RelativeEq for State<M>
where
    Self: PartialEq,
{
    fn default_max_relative() -> f64 {
        f64::default_max_relative()
    }

    fn relative_eq(&self, other: &Self, epsilon: f64, max_relative: f64) -> bool {
        let (here, there) = (M::entries(&self.point), M::entries(&other.point));
        self.time.relative_eq(&other.time, epsilon, max_relative)
            && here.relative_eq(&there, epsilon, max_relative)
    }
}

/// Trajectories are compared state by state.
impl<M: Manifold> AbsDiffEq for Trajectory<M>
where
    Self: PartialEq,
    State<M>: PartialEq,
{
    type Epsilon = f64;

    fn default_epsilon() -> f64 {
        f64::default_epsilon()
    }

    fn abs_diff_eq(&self, other: &Self, epsilon: f64) -> bool {
        self.states.abs_diff_eq(&other.states, epsilon)
    }
}

impl<M: Manifold> RelativeEq for Trajectory<M>
where
    Self: PartialEq,
    State<M>: PartialEq,
{
    fn default_max_relative() -> f64 {
        f64::default_max_relative()
    }

    fn relative_eq(&self, other: &Self, epsilon: f64, max_relative: f64) -> bool {
        self.states.relative_eq(&other.states, epsilon, max_relative)
    }
}

impl<R, W: DiscreteGradient> Scheme<R, W> {
    /// Verifies the model and starts a run: endless in steps of size `h`, or over a [`Span`](crate::Span) or
    /// [`Until`](crate::Until).
    ///
    /// # Errors
    ///
    /// [`RunError`] if the model breaks a law or the course cannot be run.
    pub fn steps<Y>(
        self,
        system: &Y,
        x0: Point<Y>,
        course: impl Into<Schedule>,
    ) -> Result<Steps<'_, Y, R, W>, RunError<Y::Manifold>>
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric>,
    {
        let course = course.into();
        course.check()?;
        system.check_start(&x0)?;
        Ok(Steps::start(self, system, x0, course)?)
    }

    /// Verifies the model, runs it over a [`Span`](crate::Span) or [`Until`](crate::Until), and records the states.
    ///
    /// # Errors
    ///
    /// [`RunError`]; if a step failed, the trajectory so far is in it.
    pub fn run<Y>(
        self,
        system: &Y,
        x0: Point<Y>,
        course: impl Into<Schedule>,
    ) -> Result<Trajectory<Y::Manifold>, RunError<Y::Manifold>>
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric>,
    {
        self.steps(system, x0, course)?.run()
    }
}

/// Runs a system with the default scheme of a retraction:
/// `WeylMidpoint.run(&system, x0, Span::steps(0.1, 1000))`.
///
/// A retraction of your own runs by `Scheme::new(mine).run(..)`.
pub trait Run: Sized {
    /// [`Scheme::run`] with the defaults.
    ///
    /// # Errors
    ///
    /// Those of [`Scheme::run`].
    fn run<Y>(
        self,
        system: &Y,
        x0: Point<Y>,
        course: impl Into<Schedule>,
    ) -> Result<Trajectory<Y::Manifold>, RunError<Y::Manifold>>
    where
        Y: Metriplectic,
        Self: Retraction<Y::Manifold, Y::Metric>,
    {
        Scheme::new(self).run(system, x0, course)
    }

    /// [`Scheme::steps`] with the defaults.
    ///
    /// # Errors
    ///
    /// Those of [`Scheme::steps`].
    fn steps<Y>(
        self,
        system: &Y,
        x0: Point<Y>,
        course: impl Into<Schedule>,
    ) -> Result<Steps<'_, Y, Self>, RunError<Y::Manifold>>
    where
        Y: Metriplectic,
        Self: Retraction<Y::Manifold, Y::Metric>,
    {
        Scheme::new(self).steps(system, x0, course)
    }

    /// [`Scheme::resume`] with the defaults.
    ///
    /// # Errors
    ///
    /// Those of [`Scheme::resume`].
    fn resume<'a, Y>(
        self,
        system: &'a Y,
        checkpoint: &Checkpoint,
    ) -> Result<Steps<'a, Y, Self>, ResumeError>
    where
        Y: Metriplectic,
        Self: Retraction<Y::Manifold, Y::Metric>,
    {
        Scheme::new(self).resume(system, checkpoint)
    }
}

impl Run for WeylMidpoint {}
impl Run for Exponential {}
impl Run for Projection {}
impl Run for Cayley {}

#[cfg(all(test, feature = "serde"))]
mod tests {
    use super::*;
    use crate::Span;
    use metriplectic_dynamics::System;
    use metriplectic_fields::Real;
    use metriplectic_manifolds::Rotations;
    use nalgebra::Matrix3;

    #[test]
    fn a_trajectory_is_written_with_the_entries_of_its_points() {
        let group = System::on(Rotations::bi_invariant())
            .energy(|r: &Matrix3<Real>| r.m11)
            .entropy(|r: &Matrix3<Real>| r.m12)
            .build()
            .unwrap();
        let run = WeylMidpoint.run(&group, Matrix3::identity(), Span::steps(0.1, 3)).unwrap();
        let json = serde_json::to_value(&run).unwrap();
        assert_eq!(json["certificate"]["steps"], 3);
        assert_eq!(json["certificate"]["initial_energy"], 1.0);
        assert_eq!(json["certificate"]["second_law"], "Exact");
        let states = json["states"].as_array().unwrap();
        assert_eq!(states.len(), 4);
        for (json, state) in states.iter().zip(&run) {
            let point: Vec<f64> = serde_json::from_value(json["point"].clone()).unwrap();
            assert_eq!(point, Rotations::entries(&state.point));
            assert_eq!(json["energy"].as_f64(), Some(state.energy));
        }
    }
}
