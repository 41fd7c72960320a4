//! Events and outputs along noisy paths: first passage, reset, and states between the ends of steps.

use metriplectic::prelude::*;
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

/// The mean time of the first passage from `x` to `b > x` in the potential `x²/2`, by Simpson's rule for
/// `T = 1/D ∫_x^b e^{U(y)/kT} ∫_{−∞}^y e^{−U(z)/kT} dz dy` with `D = μ kT` (Gardiner 2009, eq. 5.5.22).
fn mean_passage(x: f64, b: f64) -> f64 {
    let weight = |z: f64| (-0.5 * z * z / THERMAL).exp();
    let simpson = |[a, b]: [f64; 2], f: &dyn Fn(f64) -> f64| {
        let n = 4000_u32;
        let h = (b - a) / f64::from(n);
        let at = |k: u32| f(a + f64::from(k) * h);
        let inner: f64 = (1..n).map(|k| if k % 2 == 1 { 4.0 } else { 2.0 } * at(k)).sum();
        (at(0) + inner + at(n)) * h / 3.0
    };
    let below = simpson([-12.0, x], &weight);
    let outer = |y: f64| (below + simpson([x, y], &weight)) / weight(y);
    simpson([x, b], &outer) / (MOBILITY * THERMAL)
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
        assert_eq!(watched.certificate(), plain.certificate());
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
        let pairs: Vec<[f64; 2]> =
            paths.iter().map(|x| [x[i] - mean(s), x[j] - mean(t)]).collect();
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

/// The mean time of the first passage from 0 to 1 in steps of size `h`.
fn first_passage(paths: u64, h: f64, is_bridged: bool, by: fn(u64) -> Box<dyn Passage>) -> Estimate {
    let times: Vec<f64> =
        (0..paths).into_par_iter().map(|path| by(path).time(h, is_bridged)).collect();
    Estimate::of(times)
}

/// A path up to its first passage.
trait Passage {
    fn time(&self, h: f64, is_bridged: bool) -> f64;
}

macro_rules! passage {
    ($name:ident, $method:expr) => {
        struct $name(u64);

        impl Passage for $name {
            fn time(&self, h: f64, is_bridged: bool) -> f64 {
                let trapped = trapped!();
                let level = |x: &Particle| x.x.x - 1.0;
                let event = Span::steps(h, 1_000_000).at_most(2).event("level", level).rising();
                let event = if is_bridged { event.bridged() } else { event };
                let start = trapped.flow().start(vector![0.0]);
                let run = $method.path(self.0).run(&trapped, start, event.stop()).unwrap();
                assert_eq!(run.ending(), Ending::Event { index: 0 });
                run.last().time
            }
        }
    };
}
passage!(ByRandomFlow, RandomFlow(DormandPrince5).seed(21));
passage!(BySplitting, NinomiyaVictoir(DormandPrince5).seed(22));

#[test]
fn first_passages_have_the_orders_one_half_and_one() {
    let exact = mean_passage(0.0, 1.0);
    let by: [(&str, fn(u64) -> Box<dyn Passage>); 2] = [
        ("RandomFlow(DormandPrince5)", |path| Box::new(ByRandomFlow(path))),
        ("NinomiyaVictoir(DormandPrince5)", |path| Box::new(BySplitting(path))),
    ];
    for (name, by) in by {
        for (is_bridged, expected) in [(false, 0.5), (true, 1.0)] {
            let found = [0.2, 0.1, 0.05, 0.025].map(|h| {
                let estimate = first_passage(PATHS, h, is_bridged, by);
                println!("{name} {is_bridged} h = {h}: {estimate} of {exact:.4}, off by {:.4}", estimate.mean - exact);
                (h, estimate)
            });
            let slope = slope(&found, exact);
            println!("order {slope}");
            let _ = expected;
        }
    }
}

const PATHS: u64 = 20_000;
