//! Where a function of the state changes its sign.
//!
//! The function is known at both ends of a step. Inside it is looked at on the cubic of Hermite
//! ([`dense`](crate::step::dense)), at a few points and without their projection onto the laws, which is what makes
//! an output expensive. Where that shows a change of sign, the states of the output decide: first at the points
//! around the change, then in a bracket that is narrowed to the last digits of the time.

use std::any::{Any, type_name};
use std::fmt;
use std::sync::Arc;

use crate::run::root::{Sample, narrow};
use crate::run::span_error::SpanError;
use crate::run::state::State;
use crate::step::dense::{Hermite, says_between};
use crate::step::digits::Digits;
use crate::step::exact::Exact;
use crate::step::{Flow, StateSpace, StepEnds};

/// A change of sign of a function of the state, found in a run; asked for by [`Watch::event`](crate::Watch::event).
///
/// It prints its name, its time and its direction. A table of [`Observables`](crate::Observables) takes its
/// [`state`](Self::state).
///
/// ```
/// # use metriplectic_dynamics::System;
/// # use metriplectic_fields::Real;
/// # use metriplectic_integrators::{Observables, Run, Span, Watch};
/// # use metriplectic_manifolds::{LieDual, WeylMidpoint};
/// # use nalgebra::Vector3;
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let body = System::on(LieDual::so3())
/// #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
/// #     .build()?;
/// let span = Span::until(10.0).event("node", |p: &Vector3<f64>| p.y);
/// let run = WeylMidpoint.run(&body, Vector3::new(0.4, 0.5, 0.3), span)?;
/// let watch = Observables::on(&body).of("p1", |p| p.x);
/// let mut table = watch.csv(Vec::new())?;
/// for event in run.events() {
///     println!("{event}"); // node falls at t = 1.268901
///     table.write(&event.state)?;
/// }
/// # assert!(run.events().len() > 1 && run.events()[0].to_string().starts_with("node falls at t ="));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(bound = "M: StateSpace"))]
#[non_exhaustive]
pub struct Event<M: StateSpace> {
    /// The name that it was given.
    #[cfg_attr(feature = "serde", serde(serialize_with = "name"))]
    pub name: Arc<str>,
    /// Which one of the events that were asked for, counted from 0.
    pub index: usize,
    /// Whether the function rises through zero.
    pub rises: bool,
    /// The state there. The function is zero or has its later sign.
    pub state: State<M>,
}

#[cfg(feature = "serde")]
fn name<S: serde::Serializer>(name: &Arc<str>, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(name)
}

impl<M: StateSpace> fmt::Display for Event<M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, rises, state, .. } = self;
        write!(f, "{name} {} at t = {}", if *rises { "rises" } else { "falls" }, Digits(state.time))
    }
}

/// A function of the time and of a point.
type OfPoint<P> = dyn Fn(f64, &P) -> f64 + Send + Sync;

/// A function of points as a type that can be recovered from `dyn Any`.
struct Function<P>(Box<OfPoint<P>>);

/// An event that was asked for.
#[derive(Clone)]
pub(crate) struct Request {
    name: Arc<str>,
    pub(crate) rising: bool,
    pub(crate) falling: bool,
    pub(crate) stops: bool,
    /// The type of the points, and the [`Function`] of them.
    point: &'static str,
    function: Arc<dyn Any + Send + Sync>,
}

impl Request {
    pub(crate) fn new<P: 'static>(
        name: String,
        function: impl Fn(f64, &P) -> f64 + Send + Sync + 'static,
    ) -> Self {
        Self {
            name: name.into(),
            rising: true,
            falling: true,
            stops: false,
            point: type_name::<P>(),
            function: Arc::new(Function::<P>(Box::new(function))),
        }
    }
}

impl fmt::Debug for Request {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, rising, falling, stops, .. } = self;
        f.debug_struct("Request")
            .field("name", name)
            .field("rising", rising)
            .field("falling", falling)
            .field("stops", stops)
            .finish_non_exhaustive()
    }
}

/// Compares the functions by identity, and their options.
impl PartialEq for Request {
    fn eq(&self, other: &Self) -> bool {
        let options = |r: &Self| (r.rising, r.falling, r.stops);
        self.name == other.name
            && options(self) == options(other)
            && Arc::ptr_eq(&self.function, &other.function)
    }
}

/// An event of a run.
struct Watched<M: StateSpace> {
    request: Request,
    function: Arc<Function<M::Element>>,
    /// The last value of the function that is a number: the one at the state of the run, or before it if it is NaN
    /// there.
    value: f64,
}

/// The last number of the function of an event that has no value where a run is put down.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub(crate) struct LastNumber {
    /// Which one of the events that were asked for.
    index: usize,
    name: String,
    value: Exact,
}

/// The events of a run.
pub(crate) struct Events<M: StateSpace>(Vec<Watched<M>>);

/// The fractions of a step at which the functions are looked at inside it.
const INSIDE: [f64; 4] = [0.2, 0.4, 0.6, 0.8];

/// The width of a bracket, as a fraction of the step, at which an event is found.
const WIDTH: f64 = 2.0 * f64::EPSILON;

/// A state on the output, at a fraction of a step; `None` if it is not known.
pub(crate) type Output<'a, M> = dyn FnMut(f64) -> Option<State<M>> + 'a;

/// A point of the cubic at a fraction of a step.
struct Inside<M: StateSpace> {
    theta: f64,
    point: M::Element,
}

/// A change of sign at a fraction of a step.
struct Change<M: StateSpace> {
    theta: f64,
    rises: bool,
    state: State<M>,
}

/// A point of a step at which the function of an event is known.
struct Node<M: StateSpace> {
    sample: Sample,
    /// The state there; `None` for a point of the cubic.
    state: Option<State<M>>,
}

impl<M: StateSpace> Events<M> {
    /// Watches the events that were asked for, from the start of a run, or where it was put down with these last numbers.
    pub(crate) fn new(
        requests: Vec<Request>,
        state: &State<M>,
        last: &[LastNumber],
    ) -> Result<Self, SpanError> {
        let watched = |(index, request): (usize, Request)| {
            let Ok(function) = Arc::clone(&request.function).downcast::<Function<M::Element>>()
            else {
                let expected = type_name::<M::Element>();
                return Err(SpanError::EventPoint { index, found: request.point, expected });
            };
            let here = (function.0)(state.time, &state.point);
            let before = || {
                let same = |last: &&LastNumber| last.index == index && *last.name == *request.name;
                last.iter().find(same).map_or(here, |last| last.value.0)
            };
            let value = if here.is_nan() { before() } else { here };
            Ok(Watched { request, function, value })
        };
        requests.into_iter().enumerate().map(watched).collect::<Result<_, _>>().map(Self)
    }

    /// The last numbers of the functions that have no value at the state of the run.
    pub(crate) fn last_numbers(&self, state: &State<M>) -> Vec<LastNumber> {
        let mut numbers = Vec::new();
        for (index, watched) in self.0.iter().enumerate() {
            if !watched.value.is_nan() && watched.at(state).is_nan() {
                let (name, value) = (watched.request.name.to_string(), Exact(watched.value));
                numbers.push(LastNumber { index, name, value });
            }
        }
        numbers
    }

    pub(crate) const fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns whether one of them ends the run.
    pub(crate) fn may_stop(&self) -> bool {
        self.0.iter().any(|watched| watched.request.stops)
    }

    /// The events of a step in the order of their times, up to the first that stops the run, and whether one
    /// does. `None` if a state inside the step is not known and is needed.
    pub(crate) fn of_step<F: Flow<Space = M>>(
        &mut self,
        flow: &F,
        step: &StepEnds<'_, F>,
        ends: [&State<M>; 2],
        output: &mut Output<'_, M>,
    ) -> Option<(Vec<Event<M>>, bool)> {
        let curve = if step.x == step.end { None } else { Hermite::through(flow, step) };
        let moves = step.x != step.end && (curve.is_some() || says_between(flow, step.x));
        let mut inside = Vec::with_capacity(INSIDE.len());
        for &theta in INSIDE.iter().filter(|_| moves) {
            let point = match &curve {
                Some(curve) => flow.moved(step.x, &curve.at(theta)),
                // The step is longer than a chart.
                None => output(theta)?.point,
            };
            inside.push(Inside { theta, point });
        }
        self.on_points(&inside, ends, output)
    }

    /// Looks for events at the points on the cubic.
    fn on_points(
        &mut self,
        inside: &[Inside<M>],
        ends: [&State<M>; 2],
        output: &mut Output<'_, M>,
    ) -> Option<(Vec<Event<M>>, bool)> {
        let (mut thetas, mut found) = (Vec::new(), Vec::new());
        for (index, watched) in self.0.iter_mut().enumerate() {
            for Change { theta, rises, state } in watched.look(inside, ends, output)? {
                let name = Arc::clone(&watched.request.name);
                thetas.push(theta);
                found.push(Some(Event { name, index, rises, state }));
            }
        }
        let order = in_order(&thetas);
        let mut events: Vec<Event<M>> = order.iter().filter_map(|&i| found[i].take()).collect();
        let stop = events.iter().position(|event| self.0[event.index].request.stops);
        if let Some(stop) = stop {
            events.truncate(stop + 1);
        }
        Some((events, stop.is_some()))
    }
}

/// The indices of times in their order. A sort of the events themselves is compiled for each space.
fn in_order(times: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..times.len()).collect();
    order.sort_by(|&i, &j| times[i].total_cmp(&times[j]));
    order
}

impl<M: StateSpace> Watched<M> {
    fn at(&self, state: &State<M>) -> f64 {
        (self.function.0)(state.time, &state.point)
    }

    /// Whether the function changes its sign between two points in a direction that was asked for.
    fn changes(&self, a: f64, b: f64) -> bool {
        self.request.rising && a < 0.0 && b >= 0.0 || self.request.falling && a > 0.0 && b <= 0.0
    }

    /// The changes of sign in a step; `None` as in [`Events::of_step`].
    fn look(
        &mut self,
        inside: &[Inside<M>],
        [start, end]: [&State<M>; 2],
        output: &mut Output<'_, M>,
    ) -> Option<Vec<Change<M>>> {
        let (before, after) = (self.value, self.at(end));
        let node = |at, value, state: Option<&State<M>>| Node {
            sample: Sample { at, value },
            state: state.cloned(),
        };
        let mut nodes = vec![node(0.0, before, Some(start))];
        for Inside { theta, point } in inside {
            let time = start.time + theta * (end.time - start.time);
            nodes.push(node(*theta, (self.function.0)(time, point), None));
        }
        nodes.push(node(1.0, after, Some(end)));
        nodes.retain(|node| !node.sample.value.is_nan());
        // At the points around a change the states of the output decide.
        loop {
            let unsure = nodes.windows(2).position(|pair| {
                self.changes(pair[0].sample.value, pair[1].sample.value)
                    && pair.iter().any(|node| node.state.is_none())
            });
            let Some(first) = unsure else { break };
            for node in &mut nodes[first..=first + 1] {
                if node.state.is_none() {
                    let state = output(node.sample.at)?;
                    node.sample.value = self.at(&state);
                    node.state = Some(state);
                }
            }
            nodes.retain(|node| !node.sample.value.is_nan());
        }
        // A change across a step that ends at a NaN is found in the next one.
        self.value = nodes.last().map_or(f64::NAN, |node| node.sample.value);
        let mut changes = Vec::new();
        for pair in nodes.windows(2) {
            let [a, b] = [pair[0].sample, pair[1].sample];
            if self.changes(a.value, b.value) {
                let rises = a.value < 0.0;
                let mut last = pair[1].state.clone();
                let theta = narrow([a, b], WIDTH, |theta| {
                    let state = output(theta)?;
                    let value = self.at(&state);
                    if (rises && value >= 0.0) || (!rises && value <= 0.0) {
                        last = Some(state);
                    }
                    Some(value)
                })?;
                changes.push(Change { theta, rises, state: last? });
            }
        }
        Some(changes)
    }
}
