//! Where a function of the state changes its sign.
//!
//! The function is known at both ends of a step. Inside it is looked at on the cubic of Hermite
//! ([`dense`](crate::step::dense)), without the projection onto the laws, which is what makes an output expensive: at four
//! points, and at as many more as the values ask for (`run/looks.rs`). A function of the time alone has no
//! need of a point, and is looked at more often. Where that shows a change of sign, the states of the output decide: first at
//! the points around the change, then in a bracket that is narrowed to the last digits of the time.

pub(crate) mod path;

use std::any::{Any, type_name};
use std::fmt;
use std::sync::Arc;

use crate::run::certificate::EventCount;
use crate::run::departure::{self, Departure, Seen, Sides};
use crate::run::jump::{Jump, JumpOn, JumpRequest, SmoothEvent};
use crate::run::looks::{self, Looked};
use crate::run::root::{Sample, narrow};
use crate::run::rounding::rounding;
use crate::run::span_error::SpanError;
use crate::run::state::State;
use crate::step::dense::{Hermite, says_between};
use crate::step::digits::Digits;
use crate::step::exact::Exact;
use crate::step::{Element, Entries, Flow, Listed, StateSpace, StepEnds, Vector as _};

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
    /// The state there. The function is zero or has its later sign, but on a path with noise that was [beyond
    /// zero](crate::Watched::bridged) between two looks.
    pub state: State<M>,
    /// The change of the state, if one was [asked for](crate::Watched::jump).
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub jump: Option<Jump<M>>,
}

#[cfg(feature = "serde")]
fn name<S: serde::Serializer>(name: &Arc<str>, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(name)
}

impl<M: StateSpace> Event<M> {
    /// The time of the event.
    pub const fn time(&self) -> f64 {
        self.state.time
    }
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
    /// At every how manieth time the run stops, if it does.
    pub(crate) stops_after: Option<usize>,
    pub(crate) jump: Option<JumpRequest>,
    /// The longest time between two looks, if one was asked for.
    pub(crate) resolution: Option<f64>,
    /// Whether changes of sign between two looks at a path with noise count that come in pairs.
    pub(crate) bridged: bool,
    /// Whether the function was given with the time.
    is_in_time: bool,
    /// The type of the points, and the [`Function`] of them.
    point: &'static str,
    /// The type that the points should have, if it is another one than that of the run.
    expected: Option<&'static str>,
    function: Arc<dyn Any + Send + Sync>,
    /// The [`SmoothEvent`] with its derivatives, if they were given.
    smooth: Option<Arc<dyn Any + Send + Sync>>,
}

impl Request {
    pub(crate) fn new<P: 'static>(
        name: String,
        is_in_time: bool,
        function: impl Fn(f64, &P) -> f64 + Send + Sync + 'static,
    ) -> Self {
        Self {
            name: name.into(),
            rising: true,
            falling: true,
            stops_after: None,
            jump: None,
            resolution: None,
            bridged: false,
            is_in_time,
            point: type_name::<P>(),
            expected: None,
            function: Arc::new(Function::<P>(Box::new(function))),
            smooth: None,
        }
    }

    /// Adds the derivatives.
    pub(crate) fn differentiate<P: 'static>(&mut self, smooth: SmoothEvent<P>) {
        self.smooth = Some(Arc::new(smooth));
    }

    /// The derivatives, if they were given at points of this type.
    pub(crate) fn smooth<P: 'static>(&self) -> Option<Arc<SmoothEvent<P>>> {
        Arc::clone(self.smooth.as_ref()?).downcast().ok()
    }
}

impl Request {
    /// Translates the event to states in plain numbers. One that was asked for at other states stays as it is, and a run of plain
    /// numbers refuses it by the name of its own states.
    pub(crate) fn in_numbers<F: Listed>(&self, flow: &F) -> Self {
        let expected = Some(type_name::<Element<F>>());
        let jump = self.jump.as_ref().map(|jump| jump.in_numbers(flow));
        let Ok(function) = Arc::clone(&self.function).downcast::<Function<Element<F>>>() else {
            return Self { expected, jump, ..self.clone() };
        };
        let layout = flow.layout().clone();
        let read = F::read as fn(&F::Layout, &[f64]) -> Element<F>;
        let function = move |time: f64, x: &Entries| (function.0)(time, &read(&layout, x));
        let function = Arc::new(Function::<Entries>(Box::new(function)));
        Self { expected, jump, function, ..self.clone() }
    }

    /// Translates an event at states in plain numbers to those of a flow. One that was asked for at other states stays as it is.
    pub(crate) fn in_types<F: Listed>(&self, flow: &F) -> Self {
        let expected = Some(type_name::<Entries>());
        let jump = self.jump.as_ref().map(|jump| jump.in_types(flow));
        let Ok(function) = Arc::clone(&self.function).downcast::<Function<Entries>>() else {
            return Self { expected, jump, ..self.clone() };
        };
        let write = F::write as fn(&Element<F>) -> Entries;
        let function = move |time: f64, x: &Element<F>| (function.0)(time, &write(x));
        let function = Arc::new(Function::<Element<F>>(Box::new(function)));
        Self { expected, jump, function, ..self.clone() }
    }

    /// The function of it on the states of a run.
    fn on<M: StateSpace>(&self, index: usize) -> Result<Arc<Function<M::Element>>, SpanError> {
        Arc::clone(&self.function).downcast().map_err(|_| {
            let expected = self.expected.unwrap_or(type_name::<M::Element>());
            SpanError::EventPoint { index, found: self.point, expected }
        })
    }
}

impl fmt::Debug for Request {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, rising, falling, stops_after, .. } = self;
        f.debug_struct("Request")
            .field("name", name)
            .field("rising", rising)
            .field("falling", falling)
            .field("stops_after", stops_after)
            .finish_non_exhaustive()
    }
}

/// Compares the functions by identity, and their options.
impl PartialEq for Request {
    fn eq(&self, other: &Self) -> bool {
        let options = |r: &Self| (r.rising, r.falling, r.stops_after, r.resolution, r.bridged);
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
    /// How often it has happened in the run.
    count: usize,
    /// All three before the last step.
    before: (f64, Option<Departure>, usize),
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

/// The fractions of a step at which the functions are looked at inside it in any case. They are not quite its fifths, so that a
/// function with their period does not look constant.
/// A factor of four fails `tests/events.rs::an_event_across_a_nan_at_the_end_of_a_step_is_found_by_every_method`.
const INSIDE: [f64; 4] = [0.188_8, 0.412_1, 0.595_3, 0.814_7];

/// The looks inside a step at a function of the time alone.
/// A factor of four fails `tests/trust/events.rs::looks_are_few_where_the_function_is_simple`.
const OF_TIME: usize = 16;

/// The looks of a [resolution](crate::Watched::resolution) that are held at once.
const PIECE: usize = 64;

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
    /// The functions whose looks did not agree up to there, with the first such times.
    pub(crate) unsure: Vec<(Arc<str>, f64)>,
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
    /// Watches the events that were asked for, from the start of a run, or where it was put down with these last numbers and
    /// counts.
    pub(crate) fn new(
        requests: Vec<Request>,
        state: &State<M>,
        last: &[LastNumber],
        counts: &[EventCount],
    ) -> Result<Self, SpanError> {
        let watched = |(index, request): (usize, Request)| {
            let function = request.on::<M>(index)?;
            let here = (function.0)(state.time, &state.point);
            let same = |last: &&LastNumber| last.index == index && *last.name == *request.name;
            let last = last.iter().find(same);
            let value = last.map_or(here, |last| last.value.0);
            let departure = last.and_then(|last| last.departure);
            let jump = match request.jump.clone() {
                Some(jump) => Some(jump.on(index)?),
                None => None,
            };
            let counted = counts.get(index).filter(|counted| *counted.name == *request.name);
            let count = counted.map_or(0, |counted| counted.count);
            let before = (value, departure, count);
            Ok(Watched { request, function, value, jump, departure, count, before })
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

    /// Enters how often each of them has happened.
    pub(crate) fn enter(&self, counts: &mut [EventCount]) {
        for (counted, watched) in counts.iter_mut().zip(&self.0) {
            counted.count = watched.count;
        }
    }

    /// How often each of them has happened, by their names.
    pub(crate) fn counts(&self) -> Vec<EventCount> {
        let counted = |watched: &Watched<M>| EventCount {
            name: watched.request.name.to_string(),
            count: watched.count,
        };
        self.0.iter().map(counted).collect()
    }

    /// Returns whether one of them ends the run.
    pub(crate) fn may_stop(&self) -> bool {
        self.0.iter().any(|watched| watched.request.stops_after.is_some())
    }

    /// Begins a run at a state. A function that is zero there, but for the rounding of the time, has no event there. Returns the
    /// names of those with a jump.
    pub(crate) fn begin(&mut self, state: &State<M>) -> Vec<Arc<str>> {
        let mut names = Vec::new();
        for watched in &mut self.0 {
            if watched.is_zero(state) {
                watched.value = 0.0;
                if watched.jump.is_some() {
                    names.push(Arc::clone(&watched.request.name));
                }
            }
        }
        names
    }

    /// The events of a step in the order of their times, up to the first that stops the run or changes the state. `None` if
    /// a state inside the step is not known and is needed.
    pub(crate) fn of_step<F: Flow<Space = M> + ?Sized>(
        &mut self,
        step: &StepEnds<'_, F>,
        ends: [&State<M>; 2],
        output: &mut Output<'_, M>,
    ) -> Option<Found<M>> {
        let &StepEnds { flow, x, end, h, .. } = step;
        let curve = if x == end { None } else { Hermite::through(step) };
        let moves = x != end && (curve.is_some() || says_between(flow, x));
        let mut point = |theta: f64, output: &mut Output<'_, M>| match &curve {
            Some(curve) => Some(flow.moved(x, &curve.at(theta))),
            // The step is longer than a chart.
            None => Some(output(theta)?.point),
        };
        let mut inside = Vec::with_capacity(INSIDE.len());
        for &theta in INSIDE.iter().filter(|_| moves) {
            inside.push(Inside { theta, point: point(theta, output)? });
        }
        let mut ahead = |later: f64| match flow.rates(end, &flow.sizes(end).zero()) {
            Some(v) => flow.moved(end, &v.map(|v| later * v)),
            None => end.clone(),
        };
        let mut step =
            InStep { ends, h, moves, inside: &inside, point: &mut point, ahead: &mut ahead };
        let times = ends.map(|state| state.time);
        self.in_step(times, &mut |watched, limit| watched.look(&mut step, limit, output))
    }

    /// Looks for events in a step between two times.
    fn in_step(&mut self, [start, end]: [f64; 2], look: &mut Look<'_, M>) -> Option<Found<M>> {
        // Those that end the step first: behind them no other one is looked for.
        let mut indices: Vec<usize> = (0..self.0.len()).collect();
        indices.sort_by_key(|&index| !self.0[index].interrupts());
        let (mut limit, mut unsure) = (1.0_f64, Vec::new());
        let (mut thetas, mut found) = (Vec::new(), Vec::new());
        let (mut stops, mut interrupts) = (Vec::new(), Vec::new());
        for index in indices {
            let watched = &mut self.0[index];
            let Changes { changes, unsure: first } = look(watched, limit)?;
            let name = &watched.request.name;
            unsure.extend(first.map(|theta| (Arc::clone(name), theta)));
            for (before, Change { theta, rises, state }) in changes.into_iter().enumerate() {
                let name = Arc::clone(name);
                thetas.push((theta, index));
                found.push(Some(Event { name, index, rises, state, jump: None }));
                stops.push(watched.stops_in() == Some(before + 1));
                interrupts.push(watched.is_over_after(before + 1));
                if watched.is_over_after(before + 1) {
                    limit = limit.min(theta);
                }
            }
        }
        unsure.retain(|(_, theta)| *theta <= limit);
        let time = |theta: f64| start + theta * (end - start);
        let unsure = unsure.into_iter().map(|(name, theta)| (name, time(theta))).collect();
        let order = in_order(&thetas);
        let mut events: Vec<Event<M>> = order.iter().filter_map(|&i| found[i].take()).collect();
        let Some(end) = order.iter().position(|&i| interrupts[i]) else {
            self.count(&events);
            return Some(Found { events, end: None, unsure });
        };
        let at = thetas[order[end]].0;
        let same_time = |i: &usize| thetas[order[*i]].0 <= at + SAME_TIME;
        let with_it = (end..order.len()).take_while(same_time);
        // A stop comes before the jumps at its time, which do not happen.
        if let Some(stop) = with_it.clone().find(|i| stops[order[*i]]) {
            events.truncate(stop + 1);
            let mut i = 0..;
            events.retain(|_| {
                i.next().is_none_or(|i| i < end || stops[order[i]] || !interrupts[order[i]])
            });
            self.count(&events);
            return Some(Found { events, end: Some(Interruption::Stop), unsure });
        }
        let with_it = with_it.skip(1).map(|i| (events[i].index, events[i].rises)).collect();
        events.truncate(end + 1);
        self.count(&events);
        Some(Found { events, end: Some(Interruption::Jump { with_it }), unsure })
    }

    /// Counts the events of a step.
    fn count(&mut self, events: &[Event<M>]) {
        events.iter().for_each(|event| self.0[event.index].count += 1);
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

    /// Forgets a step that is taken back.
    pub(crate) fn take_back(&mut self) {
        for watched in &mut self.0 {
            (watched.value, watched.departure, watched.count) = watched.before;
        }
    }

    /// An event to which the state returns at once, for ever.
    pub(crate) fn piled_up(&self) -> Option<&Arc<str>> {
        let stuck = |watched: &&Watched<M>| watched.departure.is_some_and(|leaves| leaves.fails);
        self.0.iter().find(stuck).map(|watched| &watched.request.name)
    }
}

/// The indices of events in the order of their times, and at one time in that in which they were asked for. A sort of the events
/// themselves is compiled for each space.
fn in_order(times: &[(f64, usize)]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..times.len()).collect();
    let key = |i: usize| times[i];
    order.sort_by(|&i, &j| key(i).0.total_cmp(&key(j).0).then(key(i).1.cmp(&key(j).1)));
    order
}

/// How far two events at one time may be apart, as a fraction of the step.
const SAME_TIME: f64 = 4.0 * WIDTH;

/// A step in which functions are looked at.
struct InStep<'a, M: StateSpace> {
    ends: [&'a State<M>; 2],
    /// The size of the step.
    h: f64,
    /// Whether the state moves, and the flow says what lies between the ends.
    moves: bool,
    /// The points at the looks that are taken in any case; none where the state does not move.
    inside: &'a [Inside<M>],
    /// The point at a fraction.
    point: &'a mut PointAt<'a, M>,
    /// The point at a time after the end, along the velocity.
    ahead: &'a mut dyn FnMut(f64) -> M::Element,
}

/// Looks at a function in a step up to a fraction, for its changes of sign.
type Look<'a, M> = dyn FnMut(&mut Watched<M>, f64) -> Option<Changes<M>> + 'a;

/// A point at a fraction of a step; `None` if it is not known.
type PointAt<'a, M> = dyn FnMut(f64, &mut Output<'_, M>) -> Option<<M as StateSpace>::Element> + 'a;

impl<M: StateSpace> InStep<'_, M> {
    fn time(&self, theta: f64) -> f64 {
        self.ends[0].time + theta * (self.ends[1].time - self.ends[0].time)
    }
}

/// The changes of sign in a step, and the fraction at which the looks first did not agree.
struct Changes<M: StateSpace> {
    changes: Vec<Change<M>>,
    unsure: Option<f64>,
}

impl<M: StateSpace> Watched<M> {
    /// Whether the run may stop at the event, or the state jumps there.
    const fn interrupts(&self) -> bool {
        self.request.stops_after.is_some() || self.jump.is_some()
    }

    /// After how many more times the run stops.
    fn stops_in(&self) -> Option<usize> {
        self.request.stops_after.map(|n| n - self.count % n)
    }

    /// Whether so many times in a step end it.
    fn is_over_after(&self, times: usize) -> bool {
        times > 0 && (self.jump.is_some() || self.stops_in().is_some_and(|left| times >= left))
    }

    fn at(&self, state: &State<M>) -> f64 {
        (self.function.0)(state.time, &state.point)
    }

    /// Whether the function is zero at a state, or, if it was given with the time, within the rounding of the time.
    fn is_zero(&self, state: &State<M>) -> bool {
        let here = self.at(state);
        let rounding = rounding(state.time, state.time);
        let beside = |time: f64| (self.function.0)(time, &state.point);
        here == 0.0
            || self.request.is_in_time
                && beside(state.time - rounding) * beside(state.time + rounding) < 0.0
    }

    /// Whether the function changes its sign between two points in a direction that was asked for.
    fn changes(&self, a: f64, b: f64) -> bool {
        self.request.rising && a < 0.0 && b >= 0.0 || self.request.falling && a > 0.0 && b <= 0.0
    }

    /// Whether the function is one of the time alone, as far as the states of a step tell.
    fn is_of_time(&self, step: &InStep<'_, M>) -> bool {
        let [start, end] = step.ends;
        let same = |time: f64, point: &M::Element| {
            let values = [&start.point, point].map(|point| (self.function.0)(time, point));
            values[0].to_bits() == values[1].to_bits()
        };
        let inside = || INSIDE.iter().map(|&theta| step.time(theta));
        self.request.is_in_time
            && same(end.time, &end.point)
            && if step.inside.is_empty() {
                inside().all(|time| same(time, &end.point))
            } else {
                inside().zip(step.inside).all(|(time, inside)| same(time, &inside.point))
            }
    }

    /// The sign that the function has soon after the end of a step; 0 if it stays zero.
    fn later_sign(&self, step: &mut InStep<'_, M>) -> f64 {
        let (time, direction) = (step.ends[1].time, step.h.signum());
        let mut later = rounding(time, step.h);
        while later < step.h.abs() {
            let ahead = direction * later;
            let value = (self.function.0)(time + ahead, &(step.ahead)(ahead));
            if value != 0.0 && !value.is_nan() {
                return value.signum();
            }
            later *= 2.0;
        }
        0.0
    }

    /// The changes of sign in a step, in the order of their times; `None` as in [`Events::of_step`]. Those after `limit` are of no
    /// interest, and those after the first one if the event ends the step.
    fn look(
        &mut self,
        step: &mut InStep<'_, M>,
        limit: f64,
        output: &mut Output<'_, M>,
    ) -> Option<Changes<M>> {
        let [start, end] = step.ends;
        let (before, after) = (self.value, self.at(end));
        self.before = (before, self.departure, self.count);
        let node = |at, value, state: Option<&State<M>>| Node {
            sample: Sample { at, value },
            state: state.cloned(),
        };
        let mut nodes = vec![node(0.0, before, Some(start))];
        let (mut changes, mut unsure) = (Vec::new(), None);
        let mut first = 0.0;
        if let Some(departure) = self.departure {
            match departure.seen([start.time, end.time], |theta| Some(self.at(&output(theta)?)))? {
                Seen::NotYet => return Some(Changes { changes, unsure }),
                Seen::At { theta, value } => {
                    (nodes, first) = (vec![node(theta, value, None)], theta);
                    self.departure = None;
                }
                Seen::Never => {
                    self.departure = Some(departure.failed());
                    return Some(Changes { changes, unsure });
                }
            }
        }
        let of_time = self.is_of_time(step);
        let looks =
            Looks::new(self.request.resolution, (end.time - start.time).abs(), of_time, step.moves);
        for piece in 0..looks.pieces {
            let mut samples: Vec<Sample> = nodes.iter().map(|node| node.sample).collect();
            let mut value = |theta: f64, output: &mut Output<'_, M>| {
                let time = step.time(theta);
                if of_time {
                    return Some((self.function.0)(time, &start.point));
                }
                let known =
                    step.inside.iter().find(|inside| inside.theta.to_bits() == theta.to_bits());
                Some(match known {
                    Some(Inside { point, .. }) => (self.function.0)(time, point),
                    None => (self.function.0)(time, &(step.point)(theta, output)?),
                })
            };
            for theta in looks.of_piece(piece).filter(|theta| *theta > first) {
                samples.push(Sample { at: theta, value: value(theta, output)? });
            }
            let is_last = piece + 1 == looks.pieces;
            if is_last {
                samples.push(Sample { at: 1.0, value: after });
            }
            samples.retain(|sample| !sample.value.is_nan());
            let Looked { mut samples, unsure: here } =
                looks::closer(samples, &mut |theta| value(theta, output))?;
            unsure = unsure.or(here);
            looks::turns(&mut samples, &mut |theta| {
                // The cubic is not near enough for a turn near zero.
                if of_time { value(theta, output) } else { Some(self.at(&output(theta)?)) }
            })?;
            nodes.truncate(1);
            let known = nodes.pop().filter(|node| !node.sample.value.is_nan());
            nodes = samples.into_iter().map(|Sample { at, value }| node(at, value, None)).collect();
            if let (Some(known), Some(node)) = (known, nodes.first_mut()) {
                node.state = known.state;
            }
            if let Some(last) = nodes.last_mut().filter(|last| last.sample.at >= 1.0) {
                last.state = Some(end.clone());
            }
            if !of_time {
                self.confirm(&mut nodes, output)?;
            }
            let sign = if is_last && nodes.last().is_some_and(|node| node.sample.value == 0.0) {
                self.later_sign(step)
            } else {
                0.0
            };
            leave_out_touches(&mut nodes, sign, is_last);
            for pair in nodes.windows(2) {
                let [a, b] = [pair[0].sample, pair[1].sample];
                if a.at > limit + SAME_TIME || self.is_over_after(changes.len()) {
                    break;
                }
                if self.changes(a.value, b.value) {
                    let rises = a.value < 0.0;
                    let is_later = |value: f64| if rises { value >= 0.0 } else { value <= 0.0 };
                    let mut last = pair[1].state.clone();
                    let theta = narrow([a, b], WIDTH, |theta| {
                        if of_time {
                            return Some((self.function.0)(step.time(theta), &start.point));
                        }
                        let state = output(theta)?;
                        let value = self.at(&state);
                        if is_later(value) {
                            last = Some(state);
                        }
                        Some(value)
                    })?;
                    let state = if of_time { output(theta)? } else { last? };
                    changes.push(Change { theta, rises, state });
                }
            }
            // A change across a step that ends at a NaN is found in the next one.
            self.value = nodes.last().map_or(f64::NAN, |node| node.sample.value);
            let over = nodes.last().is_some_and(|node| node.sample.at > limit + SAME_TIME);
            if over || self.is_over_after(changes.len()) {
                if !is_last && !after.is_nan() {
                    self.value = after;
                }
                break;
            }
            nodes.drain(..nodes.len().saturating_sub(1));
        }
        Some(Changes { changes, unsure })
    }

    /// Lets the states of the output decide at the points around a change.
    fn confirm(&self, nodes: &mut Vec<Node<M>>, output: &mut Output<'_, M>) -> Option<()> {
        loop {
            let unsure = nodes.windows(2).position(|pair| {
                self.changes(pair[0].sample.value, pair[1].sample.value)
                    && pair.iter().any(|node| node.state.is_none())
            });
            let Some(first) = unsure else { return Some(()) };
            for node in &mut nodes[first..=first + 1] {
                if node.state.is_none() {
                    let state = output(node.sample.at)?;
                    node.sample.value = self.at(&state);
                    node.state = Some(state);
                }
            }
            nodes.retain(|node| !node.sample.value.is_nan());
        }
    }
}

/// The looks inside a step that are taken in any case.
struct Looks {
    /// The parts of the step that are looked at one after the other.
    pieces: usize,
    /// The gaps of equal size, if there are.
    gaps: Option<usize>,
    of_time: bool,
    /// Whether there are any.
    are_taken: bool,
}

impl Looks {
    /// The looks of a step of this length.
    fn new(resolution: Option<f64>, length: f64, of_time: bool, moves: bool) -> Self {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "it is a whole number that is positive, and saturates"
        )]
        let asked = resolution.map_or(0, |resolution| (length / resolution).ceil() as usize);
        let without = if of_time { OF_TIME } else { INSIDE.len() };
        let are_taken = of_time || moves;
        let gaps = Some(asked).filter(|gaps| *gaps > without && are_taken);
        Self { pieces: gaps.map_or(1, |gaps| gaps.div_ceil(PIECE)), gaps, of_time, are_taken }
    }

    /// The looks in a part of the step, as fractions of the step.
    fn of_piece(&self, piece: usize) -> impl Iterator<Item = f64> + use<> {
        let &Self { gaps, of_time, are_taken, .. } = self;
        let (first, last) = match gaps {
            Some(gaps) => {
                (piece.saturating_mul(PIECE).max(1), ((piece + 1).saturating_mul(PIECE)).min(gaps))
            }
            None if !are_taken => (0, 0),
            None if of_time => (0, OF_TIME),
            None => (0, INSIDE.len()),
        };
        (first..last).map(move |k| match gaps {
            Some(gaps) => k as f64 / gaps as f64,
            // Not quite even, for the sake of periods.
            None if of_time => {
                (k as f64 + 0.25 + 0.5 * (k as f64 * UNEVEN).fract()) / OF_TIME as f64
            }
            None => INSIDE[k],
        })
    }
}

/// The golden section: its multiples are spread evenly between whole numbers.
const UNEVEN: f64 = 0.618_033_988_749_894_9;

/// Leaves out the points at which a function touches zero and goes back. `later` is its sign after the last one, 0 if it stays
/// zero; the end of a part of a step waits for the next one.
fn leave_out_touches<M: StateSpace>(nodes: &mut Vec<Node<M>>, later: f64, is_last: bool) {
    let sign = |value: f64| if value == 0.0 { 0.0 } else { value.signum() };
    let (mut side, mut zeros) = (0.0, 0);
    let mut i = 0;
    while i < nodes.len() {
        let here = sign(nodes[i].sample.value);
        if here == 0.0 && side != 0.0 {
            zeros += 1;
        } else if here != 0.0 {
            if zeros > 0 && here * side > 0.0 {
                nodes.drain(i - zeros..i);
                i -= zeros;
            }
            (side, zeros) = (here, 0);
        }
        i += 1;
    }
    if zeros > 0 && (!is_last || later * side > 0.0) {
        nodes.truncate(nodes.len() - zeros);
    }
}
