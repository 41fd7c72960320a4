//! The promises of a run as a table: promise × method × problem.
//!
//! | promise | what is compared |
//! |---|---|
//! | drift | both laws and the invariants after a hundred steps |
//! | record | a sparse record, the iterator and the trajectory; the end with the time that was asked for |
//! | outputs | their times, their laws, and their error with the error of the steps; the steps with and without them |
//! | events | their times, and their states with the outputs at these times |
//! | checkpoints | the states, outputs, events and the certificate of a run that was put down, and of the one that was not |
//! | another method | a checkpoint is refused by every other method |
//! | refusals | the sentence of each span that no method takes |

use metriplectic::integrators::{
    Checkpoint, Element, Event, Flow, ResumeError, RunError, Schedule, StageFlow, StateSpace, Steps,
};
use metriplectic::prelude::*;
use metriplectic_studies::checkpoints::reread;

/// The relative tolerance of the runs with steps that follow the motion.
const TOLERANCE: f64 = 1e-5;
/// The steps of a fixed size, and the outputs in each.
const STEPS: usize = 6;
const PARTS: usize = 4;

/// What a run has recorded, without its type.
#[derive(Clone, Debug, PartialEq)]
struct Recorded {
    time: f64,
    energy: f64,
    entropy: f64,
    entries: Vec<f64>,
}

impl<M: StateSpace> From<&State<M>> for Recorded {
    fn from(state: &State<M>) -> Self {
        let &State { time, energy, entropy, ref point, .. } = state;
        Self { time, energy, entropy, entries: M::numbers(point) }
    }
}

impl Recorded {
    /// The largest difference of entries.
    fn distance(&self, other: &Self) -> f64 {
        let pairs = self.entries.iter().zip(&other.entries);
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    fn bits(&self) -> Vec<u64> {
        let laws = [self.time, self.energy, self.entropy];
        laws.into_iter().chain(self.entries.iter().copied()).map(f64::to_bits).collect()
    }
}

fn recorded<'a, M: StateSpace>(states: impl IntoIterator<Item = &'a State<M>>) -> Vec<Recorded> {
    states.into_iter().map(Recorded::from).collect()
}

/// The promises that are not kept.
#[derive(Debug, Default)]
pub(crate) struct Broken(Vec<String>);

impl Broken {
    fn expect(&mut self, kept: bool, what: impl FnOnce() -> String) {
        if !kept {
            self.0.push(what());
        }
    }

    /// The laws of recorded states: the energy to round-off, and an entropy that never falls.
    fn laws(&mut self, states: &[Recorded], has_second_law: bool, scale: f64) {
        let start = &states[0];
        for state in states {
            let off = (state.energy - start.energy).abs();
            let bound = 32.0 * f64::EPSILON * scale;
            self.expect(off <= bound, || format!("|ΔH| = {off:e} at t = {}", state.time));
        }
        for pair in states.windows(2).filter(|_| has_second_law) {
            let fall = pair[0].entropy - pair[1].entropy;
            let bound = 32.0 * f64::EPSILON * scale.max(pair[0].entropy.abs());
            self.expect(fall <= bound, || format!("S falls by {fall:e} at t = {}", pair[1].time));
        }
    }

    /// Outputs inside steps of a fixed size are about as accurate as their ends.
    fn accurate(&mut self, states: &[Recorded], exact: &[Recorded], scale: f64) {
        self.expect(states.len() == STEPS * PARTS + 1, || format!("{} outputs", states.len()));
        let errors: Vec<f64> = states.iter().zip(exact).map(|(a, b)| a.distance(b)).collect();
        let mut end = 0.0_f64;
        for (step, errors) in errors[1..].chunks(PARTS).enumerate() {
            let inside = errors.iter().fold(0.0_f64, |a, b| a.max(*b));
            end = end.max(errors[PARTS - 1]);
            // States inside a step may have one order less than its end.
            let allowed = 50.0 * scale * (end / scale).powf(5.0 / 6.0);
            // The reference has an error of its own.
            self.expect(inside <= allowed + 1e-10 * scale, || {
                format!("an output in step {step} is off by {inside:e}, its end by {end:e}")
            });
        }
    }

    /// Events at given times are there, with the states of the outputs at these times.
    fn events<M: StateSpace>(&mut self, events: &[Event<M>], outputs: &[Recorded], at: f64) {
        let clock = events.iter().find(|event| &*event.name == "clock");
        let off = clock.map_or(f64::INFINITY, |event| (event.state.time - at).abs());
        self.expect(off <= 4.0 * f64::EPSILON * at, || format!("the clock is off by {off:e}"));
        let state = clock.map(|event| Recorded::from(&event.state));
        let output = outputs.iter().find(|output| output.time.to_bits() == at.to_bits());
        let apart = state.zip(output).map_or(f64::INFINITY, |(state, output)| {
            let scale = output.entries.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
            state.distance(output) / scale.max(f64::MIN_POSITIVE)
        });
        self.expect(apart <= 1e-13, || format!("event and output differ by {apart:e}"));
        let crossing = events.iter().find(|event| &*event.name == "level");
        let (from, to) = (outputs[0].entries[0], outputs[outputs.len() - 1].entries[0]);
        let crosses = (from - to).abs() > 1e-3;
        let level = level(from, to);
        let off = crossing.map(|event| (Recorded::from(&event.state).entries[0] - level).abs());
        self.expect(!crosses || off.is_some_and(|off| off <= 1e-13 * (1.0 + level.abs())), || {
            format!("the level {level} is crossed, and the event is off by {off:?}")
        });
    }
}

/// A level between the first entries of two states.
fn level(from: f64, to: f64) -> f64 {
    0.6_f64.mul_add(from, 0.4 * to)
}

/// The schedules of a problem.
struct Schedules {
    drift: Schedule,
    inside: Schedule,
    adaptive: Schedule,
    half: f64,
}

impl Schedules {
    fn of<F: Flow>(time: f64, ends: [&Element<F>; 2]) -> Self
    where
        Element<F>: 'static,
    {
        let (h, end) = (time / 40.0, 0.2 * time);
        let half = 0.5 * end;
        let [from, to] = ends.map(|x| F::Space::numbers(x)[0]);
        let level = level(from, to);
        let adaptive = Span::until(end)
            .tolerance(TOLERANCE)
            .output_at([0.0, 0.3 * end, half, end])
            .event_in_time("clock", move |t, _: &Element<F>| t - half)
            .event("level", move |x: &Element<F>| F::Space::numbers(x)[0] - level);
        Self {
            drift: Span::steps(h, 100).at_most(2).into(),
            inside: Span::steps(h, STEPS).output_every(h / PARTS as f64),
            adaptive: adaptive.into(),
            half,
        }
    }
}

/// What an iterator yields from where it is, and what it has noted at its end.
#[derive(Debug, PartialEq)]
struct Course {
    outputs: Vec<Vec<u64>>,
    events: Vec<(String, Vec<u64>)>,
    certificate: Certificate,
}

impl Course {
    /// Takes some steps, puts the run down if there is something to resume it with, and goes on to the end.
    fn of<'a, F: Flow, M: Method<F>>(
        mut steps: Steps<'a, F, M>,
        put_down: usize,
        resume: impl FnOnce(&Checkpoint) -> Option<Steps<'a, F, M>>,
    ) -> Self {
        let event =
            |event: &Event<F::Space>| (event.to_string(), Recorded::from(&event.state).bits());
        let (mut outputs, mut events) = (Vec::new(), Vec::new());
        for _ in 0..put_down {
            if steps.ending().is_some() {
                break;
            }
            steps.advance().expect("a step is taken");
            outputs.extend(steps.outputs().map(|state| Recorded::from(state).bits()));
            events.extend(steps.take_events().iter().map(event));
        }
        let mut steps = resume(&steps.checkpoint()).unwrap_or(steps);
        for state in steps.by_ref() {
            outputs.push(Recorded::from(&state.expect("a step is taken")).bits());
        }
        events.extend(steps.take_events().iter().map(event));
        Self { outputs, events, certificate: steps.certificate().clone() }
    }
}

/// A flow with a start and a time in which it moves.
#[derive(Debug)]
pub(crate) struct Case<'a, F: Flow> {
    pub(crate) flow: &'a F,
    pub(crate) start: &'a Element<F>,
    pub(crate) time: f64,
}

/// The promises that the first of some methods does not keep.
pub(crate) fn promises<F, M>(case: &Case<'_, F>, methods: &[M]) -> Vec<String>
where
    F: StageFlow,
    M: Method<F> + Clone,
    Element<F>: 'static,
{
    let mut broken = Broken::default();
    if let Err(error) = observe(&mut broken, case, methods) {
        broken.0.push(error.to_string());
    }
    broken.0
}

fn observe<F, M>(
    broken: &mut Broken,
    &Case { flow, start, time }: &Case<'_, F>,
    methods: &[M],
) -> Result<(), RunError<F::Space>>
where
    F: StageFlow,
    M: Method<F> + Clone,
    Element<F>: 'static,
{
    let method = || methods[0].clone();
    let run = |schedule: &Schedule| method().run(flow, start.clone(), schedule.clone());
    let has_second_law = flow.entropy_law() == SecondLaw::Exact;
    let end_time = 0.2 * time;
    let short: Schedule = Span::until(end_time).tolerance(TOLERANCE).into();
    let plain = run(&short)?;
    let end = plain.last().point.clone();
    let schedules = Schedules::of::<F>(time, [start, &end]);

    let drift = run(&schedules.drift)?;
    let certificate = drift.certificate();
    let second = !has_second_law || certificate.keeps_entropy();
    broken.expect(certificate.keeps_energy() && second && certificate.keeps_invariants(), || {
        format!("a hundred steps: {certificate}")
    });

    let fixed = Span::steps(time / 40.0, STEPS);
    let full = run(&fixed.into())?;
    let sparse = recorded(&run(&fixed.every(4).into())?);
    let states = recorded(&full);
    let chosen = [0, 4, STEPS].map(|step| states[step].clone());
    broken.expect(sparse == chosen, || "a sparse record has other states".to_owned());
    broken.expect(plain.last().time.to_bits() == end_time.to_bits(), || {
        format!("the end is at {}, not at {end_time}", plain.last().time)
    });

    let inside = run(&schedules.inside)?;
    broken.expect(inside.certificate() == full.certificate(), || "outputs change steps".to_owned());
    let inside = recorded(&inside);
    let fine = Span::until(time / 40.0 * STEPS as f64).tolerance(1e-12);
    let fine = fine.output_every(time / 40.0 / PARTS as f64);
    let exact = recorded(&DormandPrince8.run(flow, start.clone(), fine)?);
    let scale = certificate_scale(&inside);
    broken.laws(&inside, has_second_law, scale);
    broken.accurate(&inside, &exact, scale);

    let adaptive = run(&schedules.adaptive)?;
    let mut uncounted = adaptive.certificate().clone();
    uncounted.event_counts.clear();
    broken
        .expect(&uncounted == plain.certificate(), || "outputs and events change steps".to_owned());
    let outputs = recorded(&adaptive);
    broken.laws(&outputs, has_second_law, scale);
    broken.events(adaptive.events(), &outputs, schedules.half);

    for schedule in [&schedules.inside, &schedules.adaptive] {
        let steps = || method().steps(flow, start.clone(), schedule.clone());
        let whole = Course::of(steps()?, 0, |_| None);
        let yielded: Vec<_> = recorded(&run(schedule)?)[1..].iter().map(Recorded::bits).collect();
        broken.expect(whole.outputs == yielded, || "the iterator yields other states".to_owned());
        for put_down in [0, 1, 2] {
            let resumed = Course::of(steps()?, put_down, |checkpoint| {
                let resumed = method().resume(flow, &reread(checkpoint));
                let resumed = resumed.expect("it is the same system");
                Some(resumed.watching(schedule.clone()).expect("it is the same schedule"))
            });
            broken.expect(resumed == whole, || {
                format!("resumed after {put_down} steps, a run is another one")
            });
        }
    }
    for other in &methods[1..] {
        let names = [plain.checkpoint().method().to_owned(), other.name()];
        match other.clone().resume(flow, plain.checkpoint()).err() {
            Some(ResumeError::AnotherMethod { stored, found }) if [&*stored, &*found] == names => {}
            answer => broken.0.push(format!("its checkpoint, for {}: {answer:?}", names[1])),
        }
    }

    for (schedule, part) in impossible(time) {
        let refused = method().steps(flow, start.clone(), schedule).err();
        let sentence = refused.map(|error| error.to_string()).unwrap_or_default();
        broken.expect(sentence.contains(part), || format!("not {part:?}: {sentence:?}"));
    }
    Ok(())
}

/// Spans that no method takes, and a part of the sentence in which they are refused.
fn impossible(time: f64) -> Vec<(Schedule, &'static str)> {
    let mut refused: Vec<(Schedule, &'static str)> = Vec::new();
    let until = Span::until(time);
    for h in [0.0, -0.1, f64::NAN, f64::INFINITY] {
        refused.push((Span::steps(h, 1).into(), "step size"));
        refused.push((h.into(), "step size"));
        refused.push((Span::until(h).into(), "end"));
        refused.push((until.output_every(h), "interval"));
    }
    for h in [0.0, -0.1, f64::NAN] {
        let steps = [until.first_step(h), until.least_step(h), until.largest_step(h)];
        refused.extend(steps.map(|span| (span.into(), "step size")));
    }
    for tolerance in [0.0, -1e-6, f64::NAN, 1.1, 1e-300] {
        refused.push((until.tolerance(tolerance).into(), "tolerance"));
    }
    for tolerance in [0.0, 1.0, f64::NAN] {
        refused.push((until.until_rest(tolerance).into(), "rest"));
    }
    refused.extend([
        (Span::steps(0.1, 0).into(), "no steps"),
        (Span::steps(0.1, 3).every(0).into(), "record"),
        (until.every(0).into(), "record"),
        (until.least_step(0.2 * time).largest_step(0.1 * time).into(), "largest"),
        (until.output_at([2.0 * time]), "output"),
        (until.output_at([f64::NAN]), "output"),
        (until.every(2).output_every(0.1 * time), "in place of steps"),
    ]);
    refused
}

/// The size of the energies, and at least the unit of the problems.
fn certificate_scale(states: &[Recorded]) -> f64 {
    states.iter().fold(1.0, |scale: f64, state| scale.max(state.energy.abs()))
}
