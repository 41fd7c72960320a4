//! The promises of a run as a table: promise × method × problem.
//!
//! | promise | what is compared |
//! |---|---|
//! | drift | both laws and the invariants after a hundred steps |
//! | outputs | their times, their laws, and their error with the error of the steps |
//! | events | their times, and their states with the outputs at these times |
//! | checkpoints | the bits of a run that was put down, and of the one that was not |
//! | refusals | the sentence of each input that no method takes |

use metriplectic::dynamics::system::Point;
use metriplectic::integrators::{Checkpoint, Event, RunError, Schedule};
use metriplectic::manifolds::Manifold;
use metriplectic::prelude::*;
use metriplectic_studies::problems::Problem;

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

impl<M: Manifold> From<&State<M>> for Recorded {
    fn from(state: &State<M>) -> Self {
        let &State { time, energy, entropy, ref point, .. } = state;
        Self { time, energy, entropy, entries: M::entries(point) }
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

fn recorded<'a, M: Manifold + 'a>(states: impl IntoIterator<Item = &'a State<M>>) -> Vec<Recorded> {
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
    fn events<M: Manifold>(&mut self, events: &[Event<M>], outputs: &[Recorded], at: f64) {
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
    fn of<Y: Metriplectic>(time: f64, ends: [&Point<Y>; 2]) -> Self
    where
        Point<Y>: 'static,
    {
        let (h, end) = (time / 40.0, 0.2 * time);
        let half = 0.5 * end;
        let [from, to] = ends.map(|x| Y::Manifold::entries(x)[0]);
        let level = level(from, to);
        let adaptive = Span::until(end)
            .tolerance(TOLERANCE)
            .output_at([0.0, 0.3 * end, half, end])
            .event_in_time("clock", move |t, _: &Point<Y>| t - half)
            .event("level", move |x: &Point<Y>| Y::Manifold::entries(x)[0] - level);
        Self {
            drift: Span::steps(h, 100).at_most(2).into(),
            inside: Span::steps(h, STEPS).output_every(h / PARTS as f64),
            adaptive: adaptive.into(),
            half,
        }
    }
}

/// The promises that a method does not keep on a problem, from a start.
pub(crate) fn promises<Y, M>(problem: &Problem<Y>, start: &Point<Y>, method: M) -> Vec<String>
where
    Y: Metriplectic,
    M: Method<Y> + Clone,
    Point<Y>: 'static,
{
    let Problem { system, time, .. } = problem;
    let mut broken = Broken::default();
    if let Err(error) = observe(&mut broken, system, *time, start, method) {
        broken.0.push(error.to_string());
    }
    broken.0
}

fn observe<Y, M>(
    broken: &mut Broken,
    system: &Y,
    time: f64,
    start: &Point<Y>,
    method: M,
) -> Result<(), RunError<Y::Manifold>>
where
    Y: Metriplectic,
    M: Method<Y> + Clone,
    Point<Y>: 'static,
{
    let run = |schedule: &Schedule| method.clone().run(system, start.clone(), schedule.clone());
    let has_second_law = system.second_law() == SecondLaw::Exact;
    let short: Schedule = Span::until(0.2 * time).tolerance(TOLERANCE).into();
    let end = run(&short)?.last().point.clone();
    let schedules = Schedules::of::<Y>(time, [start, &end]);

    let drift = run(&schedules.drift)?;
    let certificate = drift.certificate();
    let second = !has_second_law || certificate.keeps_entropy();
    broken.expect(certificate.keeps_energy() && second && certificate.keeps_invariants(), || {
        format!("a hundred steps: {certificate}")
    });

    let inside = recorded(&run(&schedules.inside)?);
    let fine = Span::until(time / 40.0 * STEPS as f64).tolerance(1e-12);
    let fine = fine.output_every(time / 40.0 / PARTS as f64);
    let exact = recorded(&DormandPrince8.run(system, start.clone(), fine)?);
    let scale = certificate_scale(&inside);
    broken.laws(&inside, has_second_law, scale);
    broken.accurate(&inside, &exact, scale);

    let adaptive = run(&schedules.adaptive)?;
    let outputs = recorded(&adaptive);
    broken.laws(&outputs, has_second_law, scale);
    broken.events(adaptive.events(), &outputs, schedules.half);

    for schedule in [&Schedule::from(Span::steps(time / 40.0, STEPS)), &short] {
        let whole = run(schedule)?;
        let mut steps = method.clone().steps(system, start.clone(), schedule.clone())?;
        for _ in 0..2 {
            steps.advance().map_err(|error| panic!("{error}")).ok();
        }
        let text = serde_json::to_string(&steps.checkpoint()).expect("it is written");
        let read: Checkpoint = serde_json::from_str(&text).expect("it is read");
        let resumed = method.clone().resume(system, &read).expect("it is the same system").run()?;
        let bits = [&whole, &resumed].map(|run| Recorded::from(run.last()).bits());
        let same = bits[0] == bits[1] && whole.certificate() == resumed.certificate();
        broken.expect(same, || "a resumed run is another one".to_owned());
    }

    for (h, reason) in [(0.0, "zero"), (f64::NAN, "NaN"), (f64::INFINITY, "inf")] {
        let refused = run(&Span::steps(h, 1).into());
        let sentence = refused.err().map(|error| error.to_string()).unwrap_or_default();
        broken.expect(sentence.contains("step size"), || format!("h = {reason}: {sentence:?}"));
    }
    Ok(())
}

/// The size of the energies, and at least the unit of the problems.
fn certificate_scale(states: &[Recorded]) -> f64 {
    states.iter().fold(1.0, |scale: f64, state| scale.max(state.energy.abs()))
}
