//! Events and outputs along noisy paths: first passage, reset, and states between the ends of steps.

use metriplectic::integrators::noise::{Counter, Numbers};
use metriplectic::integrators::{Schedule, TangentError};
use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Guarantee};
use nalgebra::{Vector1, vector};
use rayon::prelude::*;

/// `k_B T` and the mobility of a particle without a momentum in the trap `U = x²/2`: `dx = −μ x dt + √(2 μ k_B T) dW`.
const THERMAL: f64 = 0.8;
const MOBILITY: f64 = 1.5;
const START: Vector3<f64> = vector![0.9, 0.5, 0.3];

type Particle = OpenState<Vector1<f64>>;

/// A rigid body with friction of its own.
macro_rules! body {
    () => {
        System::on(LieDual::so3())
            .energy(|p: &Vector3<Real>| p.x * p.x / 6.0 + p.y * p.y / 4.0 + p.z * p.z * 0.5)
            .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
            .noise(Boltzmann(0.3))
            .build()
            .unwrap()
    };
}

macro_rules! trapped {
    () => {
        System::on(Euclidean::<1>)
            .energy(|x: &Vector1<Real>| x.x * x.x * 0.5)
            .bath(
                "water",
                Bath::at(THERMAL).friction(|_: Real, _: &Vector1<Real>, _: &Vector1<Real>| {
                    [Contact { rate: MOBILITY.into(), along: vector![1.0.into()] }]
                }),
            )
            .noise(Boltzmann(1.0))
            .build()
            .unwrap()
    };
}

/// A particle with a momentum in a trap, in a bath.
macro_rules! massive {
    () => {
        System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| (x.y * x.y + x.x * x.x) * 0.5)
            .bath(
                "water",
                Bath::at(THERMAL).friction(|_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                    [Contact { rate: 0.7.into(), along: vector![0.0.into(), 1.0.into()] }]
                }),
            )
            .noise(Boltzmann(1.0))
            .build()
            .unwrap()
    };
}

/// The thermal energy of a particle that is pulled across a level, and its mobility, which depends on the place.
const COLD: f64 = 0.25;
fn mobility(x: f64) -> f64 {
    1.0 + 0.5 * x * x
}

/// A particle without a momentum in the trap `U = (x − 3)²/2`, with the mobility `1 + x²/2`.
macro_rules! pulled {
    () => {
        System::on(Euclidean::<1>)
            .energy(|x: &Vector1<Real>| (x.x - 3.0).powi(2) * 0.5)
            .bath(
                "water",
                Bath::at(COLD).friction(|_: Real, x: &Vector1<Real>, _: &Vector1<Real>| {
                    [Contact { rate: x.x * x.x * 0.5 + 1.0, along: vector![1.0.into()] }]
                }),
            )
            .noise(Boltzmann(1.0))
            .build()
            .unwrap()
    };
}

/// The mean time of the first passage of the pulled particle from 0 to 1, by Simpson's rule for
/// `T = ∫₀¹ e^{U(y)/kT}/(μ(y) kT) ∫_{−∞}^y e^{−U(z)/kT} dz dy` (Gardiner 2009, eq. 5.5.22).
fn mean_passage() -> f64 {
    let simpson = |[a, b]: [f64; 2], f: &dyn Fn(f64) -> f64| {
        let n = 1000_u32;
        let h = (b - a) / f64::from(n);
        let at = |k: u32| f(a + f64::from(k) * h);
        let inner: f64 = (1..n).map(|k| if k % 2 == 1 { 4.0 } else { 2.0 } * at(k)).sum();
        (at(0) + inner + at(n)) * h / 3.0
    };
    let energy = |x: f64| (x - 3.0).powi(2) * 0.5;
    let outer = |y: f64| {
        let weight = |z: f64| ((energy(y) - energy(z)) / COLD).exp();
        simpson([y - 4.0, y], &weight) / (mobility(y) * COLD)
    };
    simpson([0.0, 1.0], &outer)
}

/// A run with events that never happen, looked at in every way, and one with outputs between its steps have the bits of one without.
macro_rules! leaves_the_bits {
    ($system:expr, $start:expr, $method:expr, ($point:ty) $number:expr) => {{
        let (system, start, span) = (&$system, $start, Span::steps(0.05, 40));
        let plain = $method.run(system, start.clone(), span).unwrap();
        let far = span
            .event("far", move |x: &$point| $number(x) - 1e6)
            .event("bridged", move |x: &$point| $number(x) - 1e6)
            .bridged()
            .event("often", move |x: &$point| $number(x) - 1e6)
            .resolution(0.011)
            .event_in_time("late", |t, _: &$point| t - 1e6)
            .jump(|_, x: &$point| x.clone());
        let watched = $method.run(system, start.clone(), far).unwrap();
        assert!(watched.events().is_empty() && watched.states() == plain.states());
        let mut counted = watched.certificate().clone();
        assert!(counted.event_counts.iter().all(|event| event.count == 0));
        counted.event_counts.clear();
        assert_eq!(&counted, plain.certificate());
        let with_outputs = $method.run(system, start, span.output_every(0.03)).unwrap();
        assert_eq!(with_outputs.last(), plain.last());
        // Those at the ends of steps are the states there.
        let at = |time: f64| {
            let mut states = with_outputs.states().iter();
            states.find(|state| (state.time - time).abs() < 1e-12).unwrap().point.clone()
        };
        assert_eq!(at(0.15), plain.states()[3].point);
        assert_eq!(with_outputs.states().len(), 68);
    }};
}

#[test]
fn an_event_that_never_happens_leaves_the_bits() {
    let (body, trapped, massive) = (body!(), trapped!(), massive!());
    let of_body = |p: &Vector3<f64>| p.z;
    let of_particle = |x: &Particle| x.x.x;
    let of_massive = |x: &OpenState<Vector2<f64>>| x.x.x;
    leaves_the_bits!(body, START, RandomFlow(DormandPrince5).seed(1), (Vector3<f64>) of_body);
    leaves_the_bits!(body, START, RandomFlow(WeylMidpoint).seed(1), (Vector3<f64>) of_body);
    leaves_the_bits!(body, START, NinomiyaVictoir(Gauss::<2>).seed(1), (Vector3<f64>) of_body);
    let start = || trapped.flow().start(vector![0.3]);
    leaves_the_bits!(trapped, start(), RandomFlow(RungeKuttaChebyshev).seed(2), (Particle) of_particle);
    leaves_the_bits!(trapped, start(), NinomiyaVictoir(DormandPrince8).seed(2), (Particle) of_particle);
    let start = || massive.flow().start(vector![0.3, -0.2]);
    leaves_the_bits!(massive, start(), RandomFlow(Gauss::<2>).seed(3), (OpenState<Vector2<f64>>) of_massive);
    leaves_the_bits!(massive, start(), NinomiyaVictoir(DormandPrince5).seed(3), (OpenState<Vector2<f64>>) of_massive);
}

/// The sums of products of two numbers over paths, against an expected mean.
fn covariance(pairs: &[[f64; 2]], expected: f64) {
    let product = Estimate::of(pairs.iter().map(|[a, b]| a * b));
    assert!(product.errors_from(expected) < 4.5, "{product} is not {expected}");
    assert!(product.standard_error < 0.02 * expected.abs().max(0.1), "{product}");
}

#[test]
fn outputs_between_steps_are_on_the_path() {
    // A step of RandomFlow is x₁ = e^{−μh} x₀ + √(2 μ kT h) ξ, so the law of all states is known at every step size.
    let (trapped, h) = (trapped!(), 0.25);
    let decay = |t: f64| (-MOBILITY * t).exp();
    let spread = 2.0 * MOBILITY * THERMAL;
    let x0 = 0.6;
    let paths: Vec<[f64; 4]> = (0..60_000)
        .into_par_iter()
        .map(|path| {
            let method = RandomFlow(DormandPrince8).seed(11).path(path);
            let span = Span::steps(h, 2).output_at([0.3, 0.37, 0.5]);
            let run = method.run(&trapped, trapped.flow().start(vector![x0]), span).unwrap();
            let times: Vec<f64> = run.iter().map(|state| state.time).collect();
            assert_eq!(times, [0.0, 0.3, 0.37, 0.5]);
            assert!(run.iter().all(|state| (state.point.time - state.time).abs() == 0.0));
            let at = |k: usize| run.states()[k].point.x.x;
            // Heat and work balance in each state.
            let ledger = &run.states()[1].point.ledger;
            let heat = ledger.heat("water").unwrap();
            assert!((0.5 * (at(1) * at(1) - x0 * x0) - heat).abs() < 1e-13);
            [at(1), at(2), at(3), 0.0]
        })
        .collect();
    let mean = |t: f64| x0 * decay(t);
    let first = spread * h;
    let law = [(0, 0, 0.3, 0.3), (0, 1, 0.3, 0.37), (0, 2, 0.3, 0.5), (1, 2, 0.37, 0.5)];
    for (i, j, s, t) in law {
        let pairs: Vec<[f64; 2]> = paths.iter().map(|x| [x[i] - mean(s), x[j] - mean(t)]).collect();
        let expected = decay(s - h) * decay(t - h) * first + spread * (s - h);
        covariance(&pairs, expected);
    }
    // Beside a mean that decays, the noise is that of the same numbers: what the ends of steps alone would give is 20 % off.
    let mean_at_output = Estimate::of(paths.iter().map(|x| x[0]));
    assert!(mean_at_output.errors_from(mean(0.3)) < 4.5, "{mean_at_output}");
}

#[test]
fn outputs_do_not_depend_on_those_beside_them() {
    let massive = massive!();
    let method = NinomiyaVictoir(DormandPrince5).seed(4);
    let run = |times: &[f64]| {
        let span = Span::steps(0.1, 10).output_at(times.iter().copied());
        method.run(&massive, massive.flow().start(vector![0.3, -0.2]), span).unwrap()
    };
    let (few, many) = (run(&[0.33]), run(&[0.31, 0.32, 0.33, 0.34, 0.77]));
    assert_eq!(few.states()[1], many.states()[3]);
    let mut steps = method
        .steps(&massive, massive.flow().start(vector![0.3, -0.2]), Span::steps(0.1, 10))
        .unwrap();
    while steps.state().time < 0.35 {
        steps.advance().unwrap();
    }
    assert_eq!(steps.at(0.33).unwrap(), few.states()[1]);
    // The path is continuous.
    let [a, b] = [0.33, 0.33 + 1e-9].map(|t| steps.at(t).unwrap().point.x);
    assert!((a - b).norm() < 1e-3 && a != b);
}

/// The slope of `ln |off|` over `ln h` by least squares, with its standard error from those of `off`.
fn slope(found: &[(f64, Estimate)], exact: f64) -> Estimate {
    let logs: Vec<[f64; 3]> = found
        .iter()
        .map(|(h, e)| {
            let off = (e.mean - exact).abs();
            [h.ln(), off.ln(), (off / e.standard_error).powi(2)]
        })
        .collect();
    let sum = |f: &dyn Fn(&[f64; 3]) -> f64| logs.iter().map(f).sum::<f64>();
    let weights = sum(&|l| l[2]);
    let [mx, my] = [sum(&|l| l[2] * l[0]) / weights, sum(&|l| l[2] * l[1]) / weights];
    let squares = sum(&|l| l[2] * (l[0] - mx).powi(2));
    let slope = sum(&|l| l[2] * (l[0] - mx) * (l[1] - my)) / squares;
    let mut estimate = found[0].1;
    (estimate.mean, estimate.standard_error) = (slope, squares.sqrt().recip());
    estimate
}

/// Times of first passages of the pulled particle from 0 to 1 in steps of size `h`.
macro_rules! passages {
    ($method:expr, $paths:expr, $h:expr, |$watched:ident| $with:expr) => {{
        let pulled = pulled!();
        let start = pulled.flow().start(vector![0.0]);
        let pulled = pulled.verified(&start).unwrap();
        let times: Vec<f64> = (0..$paths)
            .into_par_iter()
            .map(|path| {
                let level = |x: &Particle| x.x.x - 1.0;
                let span = Span::steps($h, 1_000_000).at_most(2);
                let $watched = span.event("level", level).rising();
                let start = start.clone();
                let run = $method.path(path).run(&pulled, start, $with.stop()).unwrap();
                assert_eq!(run.ending(), Ending::Event { index: 0 });
                run.last().time
            })
            .collect();
        Estimate::of(times)
    }};
}

/// Asserts the order of the error of a mean, within a fifth and three standard errors: half a step, by which an event is late, adds to the
/// order 1/2.
fn assert_order(name: &str, found: &[(f64, Estimate)], exact: f64, expected: f64) {
    for (h, estimate) in found {
        println!("{name}, h = {h}: {estimate}, off by {:+.4}", estimate.mean - exact);
    }
    let order = slope(found, exact);
    println!("{name}: order {order}");
    assert!((order.mean - expected).abs() < 0.2 + 3.0 * order.standard_error, "{name}: {order}");
    assert!(order.standard_error < 0.12, "{name}: {order}");
    Claim::new(Guarantee::Noise, "mean time of a first passage: order in h", name)
        .against("the integral of Gardiner (2009), eq. 5.5.22")
        .record(format!("{order}"), format!("{expected}"));
}

#[test]
fn first_passages_have_the_orders_one_half_and_one() {
    let (exact, paths) = (mean_passage(), 20_000_u64);
    println!("exact {exact:.6}");
    let sizes = [0.16, 0.08, 0.04, 0.02];
    let flow = RandomFlow(DormandPrince5).seed(21);
    let found = sizes.map(|h| (h, passages!(flow, paths, h, |event| event)));
    assert_order("RandomFlow, ends of steps", &found, exact, 0.5);
    let found = sizes.map(|h| (h, passages!(flow, paths, h, |event| event.bridged())));
    assert_order("RandomFlow, bridged", &found, exact, 1.0);
    let splitting = NinomiyaVictoir(DormandPrince5).seed(22);
    let found = sizes.map(|h| (h, passages!(splitting, paths, h, |event| event)));
    assert_order("NinomiyaVictoir, ends of steps", &found, exact, 0.5);
    let found = sizes.map(|h| (h, passages!(splitting, paths, h, |event| event.bridged())));
    assert_order("NinomiyaVictoir, bridged", &found, exact, 1.0);
    // Looks inside a step are as good as shorter steps.
    let [seldom, often] =
        [0.08, 0.02].map(|dt| passages!(splitting, paths, 0.08, |event| event.resolution(dt)));
    let short = passages!(splitting, paths, 0.02, |event| event);
    println!("{seldom} {often} {short}");
    assert!((often.mean - short.mean).abs() < 0.01 && seldom.mean - short.mean > 0.02);
}

#[test]
fn a_particle_is_reset_at_each_passage() {
    // Each reset begins a passage anew, so the times between them are those of first passages.
    let (pulled, h) = (pulled!(), 0.01);
    let reset = |_: f64, x: &Particle| x.at(vector![0.0]);
    let mut times = Vec::new();
    for path in 0..8 {
        let span = Span::steps(h, 20_000).at_most(2);
        let span = span.event("level", |x: &Particle| x.x.x - 1.0).rising().bridged().jump(reset);
        let start = pulled.flow().start(vector![0.0]);
        let run = RandomFlow(DormandPrince5).seed(5).path(path).run(&pulled, start, span).unwrap();
        let certificate = run.certificate();
        assert!(certificate.keeps_energy(), "{certificate}");
        let [jumps] = certificate.jumps.as_slice() else { panic!("{certificate}") };
        assert!(jumps.count == run.events().len() && jumps.count > 400);
        let state = &run.last().point;
        let [work, heat] = [state.ledger.event_work(), state.ledger.heat("water").unwrap()];
        let change = pulled.flow().energy_at(state) - 4.5;
        assert!((change - work - heat).abs() < 1e-10 * work, "{change} {work} {heat}");
        let mut before = 0.0;
        for event in run.events() {
            assert!(event.rises && event.jump.as_ref().unwrap().after.point.x.x == 0.0);
            // An event is at the end of a step.
            assert!((event.state.time / h - (event.state.time / h).round()).abs() < 1e-9);
            times.push(event.state.time - before);
            before = event.state.time;
        }
    }
    let mean = Estimate::of(times);
    // Order 1: half a step late, and the error of the steps.
    println!("{mean} of {}", mean_passage());
    assert!((mean.mean - mean_passage()).abs() < h + 4.0 * mean.standard_error, "{mean}");
}

#[test]
fn a_kick_at_a_time_is_at_that_time() {
    let (trapped, h, at, kick) = (trapped!(), 0.1, 0.337, 2.0);
    let decay = |t: f64| (-MOBILITY * t).exp();
    let ends: Vec<f64> = (0..20_000)
        .into_par_iter()
        .map(|path| {
            let span = Span::steps(h, 5)
                .event_in_time("kick", move |t, _: &Particle| t - at)
                .jump(move |_, x: &Particle| x.at(vector![x.x.x + kick]));
            let start = trapped.flow().start(vector![0.6]);
            let method = RandomFlow(DormandPrince8).seed(31).path(path);
            let run = method.run(&trapped, start, span).unwrap();
            assert!((run.events()[0].state.time - at).abs() < 1e-14 && run.events().len() == 1);
            assert!(run.states().len() == 6 && (run.last().time - 0.5).abs() < 1e-15);
            assert!(run.certificate().keeps_energy());
            run.last().point.x.x
        })
        .collect();
    let mean = 0.6 * decay(0.5) + kick * decay(0.5 - at);
    assert!(Estimate::of(ends.iter().copied()).errors_from(mean) < 4.5);
    // The steps from the start to the kick and from there to the end are cut.
    let parts = [0.1, 0.1, 0.1, 0.037, 0.063, 0.1];
    let mut variance = 0.0;
    for part in parts {
        variance = variance * decay(part).powi(2) + 2.0 * MOBILITY * THERMAL * part;
    }
    let squares = Estimate::of(ends.iter().map(|x| (x - mean).powi(2)));
    assert!(squares.errors_from(variance) < 4.5, "{squares} {variance}");
}

#[test]
fn events_of_one_time_come_one_after_the_other() {
    let massive = massive!();
    let run = |span: Schedule| {
        let start = massive.flow().start(vector![0.3, 0.2]);
        NinomiyaVictoir(DormandPrince5).seed(3).run(&massive, start, span).unwrap()
    };
    type Plane = OpenState<Vector2<f64>>;
    let level = |x: &Plane| x.x.x - 0.35;
    // A jump that leads nowhere, of two events with one function; and a stop, which comes first.
    let span = Span::steps(0.05, 400).event("a", level).jump(|_, x: &Plane| x.clone());
    let span = span.event("b", level).jump(|_, x: &Plane| x.clone());
    let both = run(span.clone().into());
    let names: Vec<&str> = both.events().iter().map(|event| &*event.name).collect();
    assert!(names.len() > 10 && names.chunks(2).all(|pair| pair == ["a", "b"]), "{names:?}");
    assert!(both.events().chunks(2).all(|e| e[0].state.point.x == e[1].state.point.x));
    let stopped = run(span.event("c", level).stop().into());
    assert_eq!(stopped.ending(), Ending::Event { index: 2 });
    assert_eq!(stopped.last(), &both.events()[0].state);
    // The signs differ at the ends of the step before each of them.
    let all = run(Span::steps(0.05, 400).event("level", level).into());
    let third = run(Span::steps(0.05, 400).event("level", level).stop_after(3).into());
    assert_eq!((third.ending(), third.count("level")), (Ending::Event { index: 0 }, Some(3)));
    assert!(third.events() == &all.events()[..3] && third.last() == &all.events()[2].state);
    let signs = all.states().windows(2).filter(|w| {
        let [a, b] = [level(&w[0].point), level(&w[1].point)];
        a * b < 0.0
    });
    let ends: Vec<f64> = signs.map(|w| w[1].time).collect();
    let times: Vec<f64> = all.events().iter().map(|event| event.state.time).collect();
    assert!(times == ends && 2 * times.len() == names.len(), "{times:?} {ends:?}");
}

#[test]
fn a_path_with_events_is_put_down_and_taken_up() {
    let pulled = pulled!();
    let method = NinomiyaVictoir(DormandPrince5).seed(9);
    let span = || -> Schedule {
        let event = Span::steps(0.03, 200).event("level", |x: &Particle| x.x.x - 1.0);
        let event = event.rising().bridged().resolution(0.01);
        event.jump(|_, x: &Particle| x.at(vector![0.0])).into()
    };
    let whole = method.run(&pulled, pulled.flow().start(vector![0.0]), span()).unwrap();
    let mut steps = method.steps(&pulled, pulled.flow().start(vector![0.0]), span()).unwrap();
    while steps.state().time < 3.0 {
        steps.advance().unwrap();
    }
    let first = steps.take_events().len();
    let resumed = method.resume(&pulled, &steps.checkpoint()).unwrap();
    let resumed = resumed.watching(span()).unwrap().run().unwrap();
    assert_eq!(resumed.events(), &whole.events()[first..]);
    assert!(first > 2 && resumed.events().len() > 2);
    assert_eq!(resumed.last(), whole.last());
    assert_eq!(resumed.certificate(), whole.certificate());
}

/// A ring of bodies that exchange heat with their neighbours.
macro_rules! ring {
    () => {
        Lattice::on(Graph::ring(5), Euclidean::<1>)
            .energy(|u: &Vector1<Real>| u.x)
            .entropy(|u: &Vector1<Real>| u.x.ln())
            .bond_onsager(|bond| {
                let [u, v] = bond.x.map(|u| u.x);
                [Onsager { rate: u * v, b: [vector![bond.w[1].x], vector![-bond.w[0].x]] }]
            })
            .build()
            .unwrap()
            .with_noise(Boltzmann(0.05))
    };
}

type Sites = Points<Euclidean<1>>;

#[test]
fn a_noisy_lattice_has_events_and_outputs_between_steps() {
    let ring = ring!();
    let start = || ring.flow().points(|_| vector![1.0]);
    let span = Span::steps(0.02, 200);
    let run =
        |span: Schedule| RandomFlow(DormandPrince5).seed(3).run(&ring, start(), span).unwrap();
    let plain = run(span.into());
    let level = |x: &Sites| x[0].x - 1.0;
    let watched = run(span.event("level", level).into());
    assert_eq!(watched.states(), plain.states());
    let crossed =
        plain.states().windows(2).filter(|w| level(&w[0].point) * level(&w[1].point) < 0.0);
    let ends: Vec<f64> = crossed.map(|w| w[1].time).collect();
    let times: Vec<f64> = watched.events().iter().map(|event| event.state.time).collect();
    assert!(times == ends && times.len() > 3, "{times:?} {ends:?}");
    // The bridge sees the returns too, and the path is the same one.
    let bridged = run(span.event("level", level).bridged().into());
    assert!(bridged.states() == plain.states() && bridged.events().len() > times.len());
    // An exchange of all heat is no work.
    let even = start();
    let turned = span.event("level", |x: &Sites| x[0].x - 1.3).rising();
    let turned = turned.jump(move |_, _: &Sites| even.clone());
    let turned = run(turned.may_lower_entropy().into());
    assert!(turned.certificate().jumps[0].count > 0 && turned.certificate().keeps_energy());
    // Outputs have the energy of the path.
    let outputs = run(span.output_every(0.013));
    assert_eq!(outputs.last(), plain.last());
    assert!(outputs.iter().all(|state| (state.energy - 5.0).abs() < 1e-13));
    let between = outputs.iter().find(|state| (state.time - 0.039).abs() < 1e-12).unwrap();
    assert!(between.point != plain.states()[1].point && between.point != plain.states()[2].point);
}

/// Numbers of one's own, without those between the ends of steps.
#[derive(Clone, Debug)]
struct Plain(Counter);

impl Numbers for Plain {
    fn number(&self, step: u64, term: usize) -> f64 {
        self.0.number(step, term)
    }

    fn is_backward(&self, step: u64) -> bool {
        self.0.is_backward(step)
    }

    fn name(&self) -> String {
        "plain".to_owned()
    }
}

#[test]
fn what_numbers_do_not_say_is_refused() {
    let trapped = trapped!();
    let start = || trapped.flow().start(vector![0.3]);
    let own = RandomFlow(DormandPrince5).numbers(Plain(Counter::new(1)));
    let span = Span::steps(0.1, 20);
    let level = |x: &Particle| x.x.x - 0.31;
    let fault = |run: Result<Trajectory<_>, RunError<_>>| match run.expect_err("it is refused") {
        RunError::Step { cause: StepError::Method { error, .. }, .. } => {
            *error.downcast_ref::<NoiseError>().expect("it is a fault of noise")
        }
        other => panic!("another error: {other}"),
    };
    let no = NoiseError::HasNoBetween;
    assert_eq!(fault(own.clone().run(&trapped, start(), span.output_at([0.12]))), no);
    let often = span.event("level", level).resolution(0.01);
    assert_eq!(fault(own.clone().run(&trapped, start(), often)), no);
    let bridged = || span.event("level", level).bridged();
    assert_eq!(fault(own.clone().run(&trapped, start(), bridged())), no);
    // At the ends of steps all numbers have events and outputs.
    let at_ends = span.event("level", level).output_at([0.2]);
    let run = own.run(&trapped, start(), at_ends).unwrap();
    assert!(!run.events().is_empty());
    let three = RandomFlow(DormandPrince5).seed(1).three_point();
    assert_eq!(fault(three.run(&trapped, start(), bridged())), no);
    assert!(three.run(&trapped, start(), span.output_at([0.12])).is_ok());
    // A step that a corner cuts has its ends alone.
    let cut = span.corners([0.15]).output_at([0.12]);
    assert_eq!(fault(RandomFlow(DormandPrince5).seed(1).run(&trapped, start(), cut)), no);
    let cut = span.corners([0.15]).output_at([0.22]);
    assert!(RandomFlow(DormandPrince5).seed(1).run(&trapped, start(), cut).is_ok());
}

#[test]
fn tangents_of_paths_have_no_events() {
    let body = body!();
    let method = NinomiyaVictoir(DormandPrince5).seed(1);
    let refused = |span: Schedule| match method.tangent(&body, START, span).err().unwrap() {
        TangentError::Broken { what } => what,
        other => panic!("another error: {other}"),
    };
    let span = Span::steps(0.05, 40);
    let event = span.event("level", |p: &Vector3<f64>| p.z - 0.4);
    assert_eq!(refused(event.into()), "events on a path with noise");
    assert_eq!(refused(span.output_at([0.12])), "outputs inside steps of a path with noise");
    assert!(method.tangent(&body, START, span.output_at([0.1])).is_ok());
}
