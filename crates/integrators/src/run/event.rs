//! Where a function of the state changes its sign.
//!
//! The function is known at both ends of a step. Inside it is looked at on the cubic of Hermite
//! ([`dense`](crate::step::dense)), at a few points and without their projection onto the laws, which is what makes
//! an output expensive. Where that shows a change of sign, the states of the output decide: first at the points
//! around the change, then in a bracket that is narrowed to the last digits of the time.

use std::any::{Any, type_name};
use std::fmt;
use std::sync::Arc;

use crate::run::departure::{self, Departure, Seen, Sides};
use crate::run::jump::{Jump, JumpOn, JumpRequest};
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
    /// The change of the state, if one was [asked for](crate::Watched::jump).
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub jump: Option<Jump<M>>,
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
    pub(crate) jump: Option<JumpRequest>,
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
            jump: None,
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
        let jumps = match (&self.jump, &other.jump) {
            (Some(a), Some(b)) => a.is(b),
            (a, b) => a.is_none() && b.is_none(),
        };
        self.name == other.name
            && jumps
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
    jump: Option<JumpOn<M>>,
    /// How the state leaves the event at which it has jumped, as long as the function is round-off there.
    departure: Option<Departure>,
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
    departure: Option<Departure>,
}

/// The events of a run.
pub(crate) struct Events<M: StateSpace>(Vec<Watched<M>>);

/// The fractions of a step at which the functions are looked at inside it.
/// A factor of four fails `tests/events.rs::an_event_across_a_nan_at_the_end_of_a_step_is_found_by_every_method`.
const INSIDE: [f64; 4] = [0.2, 0.4, 0.6, 0.8];

/// The width of a bracket, as a fraction of the step, at which an event is found.
const WIDTH: f64 = 2.0 * f64::EPSILON;

/// Where a run goes on after a jump.
pub(crate) struct Restart<'a, M: StateSpace> {
    /// The state after the jump.
    pub(crate) state: &'a State<M>,
    /// The point a little later, along the velocity.
    pub(crate) ahead: &'a dyn Fn(f64) -> M::Element,
    /// The size of the last step.
    pub(crate) h: f64,
}

/// The events of a step.
pub(crate) struct Found<M: StateSpace> {
    pub(crate) events: Vec<Event<M>>,
    /// The action of the last of them.
    pub(crate) end: Option<Interruption>,
}

/// The effect of an event on the run.
pub(crate) enum Interruption {
    Stop,
    /// The state jumps. Other events at the same time are found again after it, with their directions.
    Jump {
        with_it: Vec<(usize, bool)>,
    },
}

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
            let same = |last: &&LastNumber| last.index == index && *last.name == *request.name;
            let last = last.iter().find(same);
            let value = last.map_or(here, |last| last.value.0);
            let departure = last.and_then(|last| last.departure);
            let jump = match request.jump.clone() {
                Some(jump) => Some(jump.on(index)?),
                None => None,
            };
            Ok(Watched { request, function, value, jump, departure })
        };
        requests.into_iter().enumerate().map(watched).collect::<Result<_, _>>().map(Self)
    }

    /// The last numbers of the functions that have no value at the state of the run, or another one after a jump.
    pub(crate) fn last_numbers(&self, state: &State<M>) -> Vec<LastNumber> {
        let mut numbers = Vec::new();
        for (index, watched) in self.0.iter().enumerate() {
            let here = watched.at(state);
            let differs = !watched.value.is_nan() && watched.value.to_bits() != here.to_bits();
            if differs || watched.departure.is_some() {
                let (name, value) = (watched.request.name.to_string(), Exact(watched.value));
                let departure = watched.departure;
                numbers.push(LastNumber { index, name, value, departure });
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

    /// The events of a step in the order of their times, up to the first that stops the run or changes the state. `None` if
    /// a state inside the step is not known and is needed.
    pub(crate) fn of_step<F: Flow<Space = M> + ?Sized>(
        &mut self,
        step: &StepEnds<'_, F>,
        ends: [&State<M>; 2],
        output: &mut Output<'_, M>,
    ) -> Option<Found<M>> {
        let curve = if step.x == step.end { None } else { Hermite::through(step) };
        let flow = step.flow;
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
    ) -> Option<Found<M>> {
        let (mut thetas, mut found) = (Vec::new(), Vec::new());
        for (index, watched) in self.0.iter_mut().enumerate() {
            for Change { theta, rises, state } in watched.look(inside, ends, output)? {
                let name = Arc::clone(&watched.request.name);
                thetas.push(theta);
                found.push(Some(Event { name, index, rises, state, jump: None }));
            }
        }
        let order = in_order(&thetas);
        let mut events: Vec<Event<M>> = order.iter().filter_map(|&i| found[i].take()).collect();
        let end = events.iter().position(|event| self.0[event.index].interrupts());
        let Some(end) = end else { return Some(Found { events, end: None }) };
        if self.0[events[end].index].request.stops {
            events.truncate(end + 1);
            return Some(Found { events, end: Some(Interruption::Stop) });
        }
        let at = thetas[order[end]];
        let (later, same_time) = (end + 1.., |i: &usize| thetas[order[*i]] <= at + 4.0 * WIDTH);
        let with_it = later.take_while(|i| *i < order.len()).take_while(same_time);
        let with_it = with_it.map(|i| (events[i].index, events[i].rises)).collect();
        events.truncate(end + 1);
        Some(Found { events, end: Some(Interruption::Jump { with_it }) })
    }

    /// The jump at an event.
    pub(crate) fn jump(&self, index: usize) -> Option<JumpOn<M>> {
        self.0[index].jump.clone()
    }

    /// Goes on after a jump at an event.
    pub(crate) fn after_jump(
        &mut self,
        event: &Event<M>,
        with_it: &[(usize, bool)],
        from: &Restart<'_, M>,
    ) {
        let &Restart { state: after, ahead, h } = from;
        for (index, watched) in self.0.iter_mut().enumerate() {
            let [before, here] = [&event.state, after].map(|state| watched.at(state));
            watched.value = if here.is_nan() { before } else { here };
            watched.departure = None;
            if index == event.index {
                let value =
                    |later: f64, x: &M::Element| (watched.function.0)(after.time + later, x);
                let sides = Sides { earlier: if event.rises { -1.0 } else { 1.0 }, before, here };
                watched.departure =
                    departure::find(sides, after.time, h, |later| value(later, &ahead(later)));
            } else if let Some((_, rises)) = with_it.iter().find(|(other, _)| *other == index) {
                // It is found again at once.
                let earlier = if *rises { -1.0 } else { 1.0 };
                if earlier * here <= 0.0 {
                    watched.value = earlier * f64::MIN_POSITIVE;
                }
            }
        }
    }

    /// An event to which the state returns at once, for ever.
    pub(crate) fn piled_up(&self) -> Option<&Arc<str>> {
        let stuck = |watched: &&Watched<M>| watched.departure.is_some_and(|leaves| leaves.fails);
        self.0.iter().find(stuck).map(|watched| &watched.request.name)
    }
}

/// The indices of times in their order. A sort of the events themselves is compiled for each space.
fn in_order(times: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..times.len()).collect();
    order.sort_by(|&i, &j| times[i].total_cmp(&times[j]));
    order
}

impl<M: StateSpace> Watched<M> {
    /// Whether the run stops at the event, or the state jumps there.
    const fn interrupts(&self) -> bool {
        self.request.stops || self.jump.is_some()
    }

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
        let mut first = 0.0;
        if let Some(departure) = self.departure {
            match departure.seen([start.time, end.time], |theta| Some(self.at(&output(theta)?)))? {
                Seen::NotYet => return Some(Vec::new()),
                Seen::At { theta, value } => {
                    (nodes, first) = (vec![node(theta, value, None)], theta);
                    self.departure = None;
                }
                Seen::Never => {
                    self.departure = Some(departure.failed());
                    return Some(Vec::new());
                }
            }
        }
        for Inside { theta, point } in inside.iter().filter(|inside| inside.theta > first) {
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
