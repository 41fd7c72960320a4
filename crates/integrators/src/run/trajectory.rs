//! The record of a run.

use approx::{AbsDiffEq, RelativeEq};

use crate::method::StateSpace;
use crate::run::certificate::Certificate;
use crate::run::checkpoint::Checkpoint;
use crate::run::event::Event;

/// A state of a run: time, point, and the two fields there.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(bound = "M: StateSpace"))]
#[non_exhaustive]
pub struct State<M: StateSpace> {
    /// Steps taken; for a state inside a step, those before it.
    pub step: usize,
    /// The time: `t₀ + step · h` in steps of one size, `t₀` and their sum in others.
    pub time: f64,
    /// The point; serialized as the list of its entries, in the order of
    /// [`StateSpace::numbers`].
    #[cfg_attr(feature = "serde", serde(serialize_with = "entries::<M, _>"))]
    pub point: M::Element,
    /// The energy `H` there.
    pub energy: f64,
    /// The entropy `S` there; 0 without an entropy.
    pub entropy: f64,
}

#[cfg(feature = "serde")]
fn entries<M: StateSpace, S: serde::Serializer>(
    point: &M::Element,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(M::numbers(point))
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
    /// It stopped at an [event](crate::Watched::stop).
    Event {
        /// Which one of the events that were asked for, counted from 0. Its name is that of the last one in
        /// [`Trajectory::events`].
        index: usize,
    },
    /// It stopped on the way: a step failed, or nobody asked for the next.
    Stopped,
}

impl Ending {
    /// Whether the state came to rest.
    pub const fn is_rest(&self) -> bool {
        matches!(self, Self::Rest { .. })
    }

    /// Whether the run stopped at an event.
    ///
    /// ```
    /// use metriplectic_integrators::Ending;
    /// assert!(Ending::Event { index: 0 }.is_event() && !Ending::Span.is_event());
    /// ```
    pub const fn is_event(self) -> bool {
        matches!(self, Self::Event { .. })
    }
}

/// Gives up the states between the first and the last that no multiple of `every` steps leads to, and
/// the last one too unless it is to be kept.
pub(super) fn thin_out<M: StateSpace>(states: &mut Vec<State<M>>, every: usize, keeps_last: bool) {
    let last = states.len() - 1;
    let mut index = 0..;
    states.retain(|state| {
        let index = index.next().unwrap_or(last);
        index == 0 || index == last && keeps_last || state.step.is_multiple_of(every)
    });
}

/// The record of a run: states and certificate.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(bound = "M: StateSpace"))]
pub struct Trajectory<M: StateSpace> {
    pub(super) states: Vec<State<M>>,
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Vec::is_empty"))]
    pub(super) events: Vec<Event<M>>,
    pub(super) certificate: Certificate,
    pub(super) ending: Ending,
    #[cfg_attr(feature = "serde", serde(skip))]
    pub(super) checkpoint: Checkpoint,
}

impl<M: StateSpace> Trajectory<M> {
    /// The recorded states, the start first.
    pub fn states(&self) -> &[State<M>] {
        &self.states
    }

    /// The [events](crate::Watch::event) that were asked for, in the order of their times.
    ///
    /// ```
    /// # use metriplectic_dynamics::System;
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_integrators::{Run, Span, Watch};
    /// # use metriplectic_manifolds::{LieDual, WeylMidpoint};
    /// # use nalgebra::Vector3;
    /// # fn main() -> Result<(), metriplectic_integrators::Error> {
    /// # let body = System::on(LieDual::so3())
    /// #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
    /// #     .build()?;
    /// let span = Span::steps(0.1, 100).event("node", |p: &Vector3<f64>| p.y);
    /// let run = WeylMidpoint.run(&body, Vector3::new(0.4, 0.5, 0.3), span)?;
    /// let times: Vec<f64> = run.events().iter().map(|event| event.state.time).collect();
    /// assert!(times.len() > 1 && times.is_sorted());
    /// # Ok(())
    /// # }
    /// ```
    pub fn events(&self) -> &[Event<M>] {
        &self.events
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

    /// The place where the run was put down: its end, the state before the step that failed, or the state at which the
    /// model broke a law. From here it goes on,
    /// with a later end ([`Checkpoint::with_steps`], [`Checkpoint::with_end`]) or other options of its method.
    pub const fn checkpoint(&self) -> &Checkpoint {
        &self.checkpoint
    }

    /// The recorded states in order.
    pub fn iter(&self) -> std::slice::Iter<'_, State<M>> {
        self.states.iter()
    }
}

impl<'a, M: StateSpace> IntoIterator for &'a Trajectory<M> {
    type Item = &'a State<M>;
    type IntoIter = std::slice::Iter<'a, State<M>>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

/// States are compared by their times and the entries of their points.
impl<M: StateSpace> AbsDiffEq for State<M>
where
    Self: PartialEq,
{
    type Epsilon = f64;

    fn default_epsilon() -> f64 {
        f64::default_epsilon()
    }

    fn abs_diff_eq(&self, other: &Self, epsilon: f64) -> bool {
        self.time.abs_diff_eq(&other.time, epsilon)
            && M::numbers(&self.point).abs_diff_eq(&M::numbers(&other.point), epsilon)
    }
}

impl<M: StateSpace> RelativeEq for State<M>
where
    Self: PartialEq,
{
    fn default_max_relative() -> f64 {
        f64::default_max_relative()
    }

    fn relative_eq(&self, other: &Self, epsilon: f64, max_relative: f64) -> bool {
        let (here, there) = (M::numbers(&self.point), M::numbers(&other.point));
        self.time.relative_eq(&other.time, epsilon, max_relative)
            && here.relative_eq(&there, epsilon, max_relative)
    }
}

/// Trajectories are compared state by state.
impl<M: StateSpace> AbsDiffEq for Trajectory<M>
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

impl<M: StateSpace> RelativeEq for Trajectory<M>
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

#[cfg(all(test, feature = "serde"))]
mod tests {
    use crate::{Run as _, Span};
    use metriplectic_dynamics::System;
    use metriplectic_fields::Real;
    use metriplectic_manifolds::{Manifold as _, Rotations, WeylMidpoint};
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
