//! Steps in a row, with their certificate.

use approx::{AbsDiffEq, RelativeEq};
use metriplectic_dynamics::velocity::{Covectors, Gradient, independence};
use metriplectic_dynamics::{Dissipation, Invariants, Metriplectic, system::Point};
use metriplectic_fields::{ChartPoint, Column, Dimension, ScalarField, Space, Vector};
use metriplectic_manifolds::{Cayley, Exponential, Manifold, Projection, Retraction, WeylMidpoint};

use crate::certificate::{Certificate, Kept};
use crate::discrete_gradient::{DiscreteGradient, Gonzalez};
use crate::error::{RunError, StepError};
use crate::residual::{Dim, Numbers, Recall};
use crate::span::{Span, check_step_size};
use crate::step::{Memory, Scheme, Start, Work};

/// A state of a run: time, point, and the two fields there.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(bound = "M: Manifold"))]
pub struct State<M: Space> {
    /// Steps taken.
    pub step: usize,
    /// The time `step · h`.
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

/// An endless iterator over the states of a run, in constant memory; ended by an error.
///
/// Made by [`Scheme::steps`] or [`Run::steps`].
#[derive(Debug)]
pub struct Steps<'a, Y: Metriplectic, R, W = Gonzalez> {
    scheme: Scheme<R, W>,
    system: &'a Y,
    h: f64,
    state: State<Y::Manifold>,
    invariants: Numbers<Y>,
    memory: Memory<Vector<Y::Manifold>>,
    certificate: Certificate,
    failed: bool,
}

impl<'a, Y, R, W> Steps<'a, Y, R, W>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    fn start(scheme: Scheme<R, W>, system: &'a Y, x0: Point<Y>, h: f64) -> Self {
        let energy = system.energy_at(&x0);
        let entropy = system.entropy_at(&x0);
        let certificate = Certificate {
            initial_energy: energy,
            max_energy_error: 0.0,
            initial_entropy: entropy,
            min_entropy_increment: 0.0,
            entropy_gained: 0.0,
            entropy_falls: 0,
            min_entropy_slope: f64::INFINITY,
            invariants: Kept::of(system, &x0),
            max_manifold_defect: system.manifold().defect(&x0),
            steps: 0,
            sweeps: 0,
            worst_sweeps: 0,
            retries: 0,
            globalised: 0,
            second_law: system.second_law(),
            projected: system.dissipation().is_projected(),
        };
        let invariants = values(system, &x0);
        let state = State { step: 0, time: 0.0, point: x0, energy, entropy };
        Self {
            scheme,
            system,
            h,
            state,
            invariants,
            memory: Memory::new(),
            certificate,
            failed: false,
        }
    }

    /// The state reached so far.
    pub const fn state(&self) -> &State<Y::Manifold> {
        &self.state
    }

    /// The balance of the steps taken so far.
    pub const fn certificate(&self) -> &Certificate {
        &self.certificate
    }

    /// Takes one step.
    ///
    /// # Errors
    ///
    /// [`StepError`]; the state is then the last one reached.
    pub fn advance(&mut self) -> Result<&State<Y::Manifold>, StepError> {
        let start = Start {
            x: &self.state.point,
            time: self.state.time,
            h: self.h,
            energy: self.state.energy,
            invariants: self.invariants,
            left_over: Recall {
                energy: self.state.energy - self.certificate.initial_energy,
                invariants: Dim::<Y>::array(|k| {
                    let kept = self.certificate.invariants.get(k);
                    kept.map_or(0.0, |kept| self.invariants[k] - kept.initial)
                }),
            },
        };
        let (point, work) = self.scheme.step(self.system, &start, &mut self.memory)?;
        let step = self.state.step + 1;
        let next = State {
            step,
            time: step as f64 * self.h,
            energy: self.system.energy_at(&point),
            entropy: self.system.entropy_at(&point),
            point,
        };
        self.account(&next, work);
        let before = std::mem::replace(&mut self.state, next);
        if Y::Invariants::COUNT > 0 {
            self.account_invariants(&before)?;
        }
        Ok(&self.state)
    }

    /// Enters the further invariants into the certificate.
    ///
    /// # Errors
    ///
    /// [`StepError::DependentInvariants`] if one was lost because its differential depends on those
    /// of the others.
    fn account_invariants(&mut self, before: &State<Y::Manifold>) -> Result<(), StepError> {
        let last = std::mem::replace(&mut self.invariants, values(self.system, &self.state.point));
        for (index, kept) in self.certificate.invariants.iter_mut().enumerate() {
            let value = self.invariants[index];
            kept.max_error = kept.max_error.max((value - kept.initial).abs());
            let change = (value - last[index]).abs();
            if change > LOST * kept.initial.abs().max(1.0) {
                let x = ChartPoint::centre(&before.point);
                let shares = independence(self.system, &x).unwrap_or_default();
                if let Some(&share) = shares.get(index)
                    && share < DEPENDENT
                {
                    let time = before.time;
                    return Err(StepError::DependentInvariants { time, index, change, share });
                }
            }
        }
        Ok(())
    }

    /// Enters a step into the certificate.
    fn account(&mut self, next: &State<Y::Manifold>, work: Work) {
        let c = &mut self.certificate;
        c.max_energy_error = c.max_energy_error.max((next.energy - c.initial_energy).abs());
        let increment = next.entropy - self.state.entropy;
        c.min_entropy_increment =
            if c.steps == 0 { increment } else { c.min_entropy_increment.min(increment) };
        c.entropy_gained = next.entropy - c.initial_entropy;
        if increment < 0.0 && increment < -entropy_round_off(self.system, &self.state) {
            c.entropy_falls += 1;
        }
        c.min_entropy_slope = c.min_entropy_slope.min(work.entropy_slope);
        c.max_manifold_defect =
            c.max_manifold_defect.max(self.system.manifold().defect(&next.point));
        c.steps += 1;
        c.sweeps += work.sweeps;
        c.worst_sweeps = c.worst_sweeps.max(work.sweeps);
        c.retries += work.splits;
        c.globalised += work.globalised;
    }
}

/// The change of a further invariant in one step that is more than round-off.
const LOST: f64 = 1e-12;
/// The independent share of a further invariant's differential that explains such a change.
const DEPENDENT: f64 = 1e-6;

/// The further invariants of a system at a point.
fn values<Y: Metriplectic>(system: &Y, x: &Point<Y>) -> Numbers<Y> {
    struct Values<'a, M: Space>(&'a M::Point<f64>);
    impl<M: Space> Gradient<M> for Values<'_, M> {
        type Covector = f64;

        fn of(&mut self, f: &impl ScalarField<M>) -> f64 {
            f.at(self.0)
        }
    }
    let values = Covectors::new([0.0; 2], system.invariants(), &mut Values::<Y::Manifold>(x));
    Dim::<Y>::array(|k| values.invariants[k].map_or(0.0, |(_, value)| value))
}

/// The round-off `4ε (max(|S|, 1) + |dS||x|)` of an entropy increment: `S` is evaluated twice, at
/// points whose entries are rounded.
fn entropy_round_off<Y: Metriplectic>(system: &Y, state: &State<Y::Manifold>) -> f64 {
    let ds = system.entropy().jet1(&state.point).df.magnitude();
    let position = Y::Manifold::magnitude(&state.point);
    4.0 * f64::EPSILON * (state.entropy.abs().max(1.0) + ds * position)
}

impl<Y, R, W> Iterator for Steps<'_, Y, R, W>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    type Item = Result<State<Y::Manifold>, StepError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.failed {
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

impl<M: Manifold> AbsDiffEq for Trajectory<M>
where
    Self: PartialEq,
{
    type Epsilon = f64;

    fn default_epsilon() -> f64 {
        f64::default_epsilon()
    }

    fn abs_diff_eq(&self, other: &Self, epsilon: f64) -> bool {
        self.states.len() == other.states.len()
            && self
                .iter()
                .zip(other)
                .all(|(a, b)| M::entries(&a.point).abs_diff_eq(&M::entries(&b.point), epsilon))
    }
}

impl<M: Manifold> RelativeEq for Trajectory<M>
where
    Self: PartialEq,
{
    fn default_max_relative() -> f64 {
        f64::default_max_relative()
    }

    fn relative_eq(&self, other: &Self, epsilon: f64, max_relative: f64) -> bool {
        self.states.len() == other.states.len()
            && self.iter().zip(other).all(|(a, b)| {
                M::entries(&a.point).relative_eq(&M::entries(&b.point), epsilon, max_relative)
            })
    }
}

impl<R, W: DiscreteGradient> Scheme<R, W> {
    /// Verifies the model and starts an endless run in steps of size `h`.
    ///
    /// # Errors
    ///
    /// [`RunError`] if the model breaks a law or `h` is not a positive finite number.
    pub fn steps<Y>(
        self,
        system: &Y,
        x0: Point<Y>,
        h: f64,
    ) -> Result<Steps<'_, Y, R, W>, RunError<Y::Manifold>>
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric>,
    {
        check_step_size(h)?;
        system.report(&x0).verdict?;
        Ok(Steps::start(self, system, x0, h))
    }

    /// Verifies the model, runs it over a span, and records the states.
    ///
    /// # Errors
    ///
    /// [`RunError`]; if a step failed, the trajectory so far is in it.
    pub fn run<Y>(
        self,
        system: &Y,
        x0: Point<Y>,
        span: Span,
    ) -> Result<Trajectory<Y::Manifold>, RunError<Y::Manifold>>
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric>,
    {
        span.check()?;
        let mut steps = self.steps(system, x0, span.step_size())?;
        let mut states = Vec::with_capacity(span.room());
        states.push(steps.state().clone());
        for step in 1..=span.count() {
            match steps.advance() {
                Ok(state) if span.records(step) => states.push(state.clone()),
                Ok(_) => {}
                Err(cause) => {
                    if states.last().is_none_or(|last| last.step != steps.state().step) {
                        states.push(steps.state().clone());
                    }
                    let certificate = steps.certificate().clone();
                    let trajectory = Box::new(Trajectory { states, certificate });
                    return Err(RunError::Step { cause, trajectory });
                }
            }
        }
        Ok(Trajectory { states, certificate: steps.certificate().clone() })
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
        span: Span,
    ) -> Result<Trajectory<Y::Manifold>, RunError<Y::Manifold>>
    where
        Y: Metriplectic,
        Self: Retraction<Y::Manifold, Y::Metric>,
    {
        Scheme::new(self).run(system, x0, span)
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
        h: f64,
    ) -> Result<Steps<'_, Y, Self>, RunError<Y::Manifold>>
    where
        Y: Metriplectic,
        Self: Retraction<Y::Manifold, Y::Metric>,
    {
        Scheme::new(self).steps(system, x0, h)
    }
}

impl Run for WeylMidpoint {}
impl Run for Exponential {}
impl Run for Projection {}
impl Run for Cayley {}

#[cfg(all(test, feature = "serde"))]
mod tests {
    use super::*;
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
