//! Runs back in time: there and back by every method on every kind of system, and the reasons for a refusal.

use metriplectic::equations::{Equations, Sizes};
use metriplectic::integrators::{
    Element, Flow, FromEquations, Schedule, SpanError, StateSpace, TangentError,
};
use metriplectic::prelude::*;
use nalgebra::Vector1;

/// A pendulum in SI units: a mass of 2 g on a thread of 0.3 m, with its angle and its momentum.
const STIFFNESS: f64 = 0.002 * 9.81 * 0.3;
const INERTIA: f64 = 0.002 * 0.3 * 0.3;

fn pendulum() -> impl Metriplectic<Manifold = Euclidean<2>, Metric = Canonical> {
    System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.y * x.y / (2.0 * INERTIA) - x.x.cos() * STIFFNESS)
        .build()
        .expect("it is a system")
}

/// This pendulum in plain numbers.
struct Own;

impl Equations for Own {
    fn sizes(&self) -> Sizes {
        Sizes { entries: 2, directions: 2, laws: 2 }
    }

    fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
        values.copy_from_slice(&[x[1] * x[1] / (2.0 * INERTIA) - STIFFNESS * x[0].cos(), 0.0]);
    }

    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        self.values(t, x, values);
        w.copy_from_slice(&[STIFFNESS * x[0].sin(), x[1] / INERTIA, 0.0, 0.0]);
    }

    fn velocity(&self, _: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        v.copy_from_slice(&[x[1] / INERTIA, -STIFFNESS * x[0].sin()]);
        Some(0.0)
    }
}

/// The largest difference of the entries of two states, relative to their sizes.
fn off<F: Flow>(x: &Element<F>, y: &Element<F>) -> f64 {
    let [a, b] = [x, y].map(F::Space::numbers);
    let size = |i: usize| a[i].abs().max(b[i].abs()).max(f64::MIN_POSITIVE);
    // Entries that have come to zero are compared with the largest of their kind.
    let largest = (0..a.len()).map(size).fold(0.0, f64::max);
    let compared = |i: usize| (a[i] - b[i]).abs() / size(i).max(1e-3 * largest);
    (0..a.len()).map(compared).fold(0.0, f64::max)
}

/// Goes there and back, in steps of one size `h` and by a tolerance.
fn there_and_back<F: Flow, M: Method<F> + Clone>(
    (name, method): (&str, M),
    flow: &F,
    start: &Element<F>,
    (h, symmetric): (f64, bool),
) {
    let (begin, count) = (3.0 * h, 40);
    let end = begin + f64::from(count) * h;
    let fixed = Span::steps(h, count as usize);
    let spans: [(Schedule, Schedule); 2] = [
        (fixed.starting_at(begin).into(), fixed.starting_at(end).backward().into()),
        (
            Span::until(end).starting_at(begin).tolerance(1e-6).into(),
            Span::until(begin).starting_at(end).backward().tolerance(1e-6).into(),
        ),
    ];
    for (adaptive, (there, back)) in spans.into_iter().enumerate() {
        let run = method.clone().run(flow, start.clone(), there).expect("it runs");
        let ways = method.clone().run(flow, run.last().point.clone(), back).expect("it runs back");
        let times: Vec<f64> = ways.iter().map(|state| state.time).collect();
        assert!(times.is_sorted_by(|a, b| a > b), "{times:?}");
        assert_eq!(times[0].to_bits(), run.last().time.to_bits());
        assert!((ways.last().time - begin).abs() <= 4.0 * f64::EPSILON * end, "{name}");
        let certificate = ways.certificate();
        assert!(certificate.keeps_energy() && certificate.smallest_step > 0.0, "{certificate}");
        let moved = off::<F>(start, &run.last().point);
        let missed = off::<F>(start, &ways.last().point);
        println!("{name}: moved {moved:.1e}, missed by {missed:.1e}");
        assert!(moved > 0.05, "{name}: {moved}");
        // Forty steps each way, each solved to some roundings of its terms, which may be a thousand times an entry; those of another
        // method differ by `O(h⁴)` or less; and the error of both ways by the tolerance.
        let allowed = match (adaptive, symmetric) {
            (0, true) => 80.0 * 1e3 * f64::EPSILON,
            (0, false) => 1e-2,
            _ => 1e-3,
        };
        assert!(missed < allowed, "{name}: {missed:.1e}");
    }
}

macro_rules! by_every_method {
    ($flow:expr, $start:expr, $h:expr; $($method:expr, $symmetric:expr);+) => {{
        let (flow, start) = ($flow, $start);
        $(there_and_back((stringify!($method), $method), flow, &start, ($h, $symmetric));)+
    }};
}

macro_rules! there_and_back {
    ($flow:expr, $start:expr, $h:expr) => {
        by_every_method!(
            $flow, $start, $h;
            Scheme::new(WeylMidpoint), true;
            Gauss::<2>, true;
            Gauss::<3>, true;
            Radau::<2>, false;
            DormandPrince5, false;
            DormandPrince8, false;
            RungeKuttaChebyshev, false
        )
    };
}

#[test]
fn every_method_goes_back_the_way_it_came() {
    let pendulum = pendulum();
    // At rest at the zero of the forces but for a small angle, and swinging; a turn takes 1.1 s.
    there_and_back!(&pendulum, vector![0.7, 0.0], 0.02);
    let top = System::on(Sphere::<2>::round())
        .bracket(AreaForm)
        .energy(|x: &Vector3<Real>| x.x * x.x * 0.5 + x.y * x.z + x.z)
        .build()
        .unwrap();
    there_and_back!(&top, vector![0.6, 0.0, 0.8], 0.03);
    let body = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
        .casimir(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .build()
        .unwrap();
    there_and_back!(&body, vector![0.4, -1.0, 0.3], 0.03);
    // Two parts, one of them curved, which move each other.
    let pair = System::on(Product(Sphere::<2>::round(), Euclidean::<2>))
        .bracket((AreaForm, Symplectic))
        .energy(|(n, x): &(Vector3<Real>, Vector2<Real>)| {
            (x.x * x.x + x.y * x.y) * 0.5 + n.z * x.x + n.x
        })
        .build()
        .unwrap();
    there_and_back!(&pair, (vector![0.6, 0.0, 0.8], vector![0.3, 0.1]), 0.03);
    let chain = Lattice::on(Graph::chain(6), Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.y * x.y * 0.5)
        .bond_energy(|(x, y): &(Vector2<Real>, Vector2<Real>)| {
            let r = y.x - x.x;
            (-r).exp() + r - 1.0
        })
        .build()
        .unwrap();
    let start = chain.points(|i| vector![i as f64 * 0.2, (1.3 * i as f64).sin()]);
    there_and_back!(&chain, start, 0.03);
    by_every_method!(
        &FromEquations(Own), [0.7, 0.0].as_slice().into(), 0.02;
        DormandPrince5, false;
        DormandPrince8, false;
        RungeKuttaChebyshev, false
    );
}

#[test]
fn attitudes_go_back_by_the_methods_of_a_bracket() {
    // A heavy top in the bundle SO(3) × so(3)*.
    let top = System::on(Product(Rotations::bi_invariant(), Euclidean::<3>))
        .bracket(Symplectic)
        .energy(|(r, p): &(Matrix3<Real>, Vector3<Real>)| {
            p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5 + r.m33 + r.m13 * 0.3
        })
        .build()
        .unwrap();
    there_and_back!(&top, (Matrix3::identity(), vector![0.4, -1.0, 0.3]), 0.02);
}

#[test]
fn the_attitude_of_a_body_turns_back() {
    let body = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
        .build()
        .unwrap();
    let span = Span::steps(0.1, 50);
    let there = WeylMidpoint.run(&body, vector![0.4, -1.0, 0.3], span).unwrap();
    let back = span.starting_at(5.0).backward();
    let back = WeylMidpoint.run(&body, there.last().point, back).unwrap();
    let ahead = Attitude::along(&body, &there, Matrix3::identity()).unwrap();
    let behind = Attitude::along(&body, &back, ahead[50]).unwrap();
    let off = (behind[50] - Matrix3::identity()).norm();
    println!("off by {off:.1e}");
    assert!((ahead[50] - Matrix3::identity()).norm() > 0.5 && off < 1e-12, "{off:.1e}");
}

/// A body on a spring whose foot moves.
fn driven() -> impl Fn(Real, &Vector2<Real>) -> Real {
    |t, x| x.y * x.y * 0.5 + (x.x - (t * 2.0).sin()).powi(2) * 0.5
}

#[test]
fn the_time_of_a_driven_system_runs_back_too() {
    let open =
        System::on(Euclidean::<2>).bracket(Symplectic).energy_in_time(driven()).build().unwrap();
    // `q(t) = cos t + (2 sin t − sin 2t)/3` solves `q'' = sin 2t − q`, at negative times too.
    let q = |t: f64| t.cos() + (2.0 * t.sin() - (2.0 * t).sin()) / 3.0;
    macro_rules! back {
        ($($method:expr, $tolerance:expr, $allowed:expr);+) => {$({
            let span = Span::until(-4.0).backward().tolerance($tolerance);
            let run = $method.run(&open, open.start(vector![1.0, 0.0]), span).unwrap();
            let end = run.last();
            let off = (end.point.x.x - q(-4.0)).abs();
            println!("{}: off by {off:.1e}", stringify!($method));
            assert!((end.time + 4.0).abs() <= 0.0 && off < $allowed, "{off:.1e}");
            assert!(run.certificate().keeps_energy(), "{}", run.certificate());
            // What the foot has done on the way is the change of the energy.
            let energy = |t: f64, x: &Vector2<f64>| x.y * x.y * 0.5 + (x.x - (2.0 * t).sin()).powi(2) * 0.5;
            let change = energy(-4.0, &end.point.x) - energy(0.0, &vector![1.0, 0.0]);
            assert!((end.point.ledger.parameter_work() - change).abs() < 1e-12);
            // Back by steps of one size, which end where they began.
            let span = Span::steps(0.02, 200).starting_at(-4.0);
            let there = $method.run(&open, open.start(vector![q(-4.0), 0.0]), span).unwrap();
            let span = Span::steps(0.02, 200).backward();
            let start = open.start(there.last().point.x);
            let ways = $method.run(&open, start, span).unwrap();
            assert!((ways.last().point.x - vector![q(-4.0), 0.0]).norm() < $allowed);
        })+};
    }
    back!(
        WeylMidpoint, 1e-6, 1e-4;
        Gauss::<2>, 1e-9, 1e-6;
        DormandPrince5, 1e-9, 1e-6;
        DormandPrince8, 1e-11, 1e-8
    );
}

#[test]
fn outputs_and_events_lie_along_a_run_that_goes_back() {
    let oscillator = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5)
        .build()
        .unwrap();
    let start = vector![1.0, 0.0];
    // x(t) = cos t, −sin t: forward q falls at π/2 and rises at 3π/2; on the way back it falls first too.
    let asked = || {
        Span::until(-10.0)
            .backward()
            .tolerance(1e-10)
            .output_at([-0.5, -7.0])
            .output_every(2.0)
            .event("q", |x: &Vector2<f64>| x.x)
            .event_in_time("bell", |t, _: &Vector2<f64>| t + 6.0)
            .falling()
    };
    let run = DormandPrince8.run(&oscillator, start, asked()).unwrap();
    let times: Vec<f64> = run.iter().map(|state| state.time).collect();
    assert_eq!(times, [0.0, -0.5, -2.0, -4.0, -6.0, -7.0, -8.0, -10.0]);
    for state in &run {
        let exact = vector![state.time.cos(), -state.time.sin()];
        assert!((state.point - exact).norm() < 1e-8, "{state:?}");
    }
    assert!((run.at(-7.0).unwrap().time + 7.0).abs() <= 0.0);
    assert_eq!(run.indices_at(&[-10.0, -0.5]).unwrap(), [7, 1]);
    let half = 0.5 * std::f64::consts::PI;
    let events: Vec<(&str, bool, f64)> =
        run.events().iter().map(|event| (&*event.name, event.rises, event.time())).collect();
    let exact = [
        ("q", false, -half),
        ("q", true, -3.0 * half),
        ("bell", false, -6.0),
        ("q", false, -5.0 * half),
    ];
    assert_eq!(events.len(), exact.len(), "{events:?}");
    for (found, exact) in events.iter().zip(exact) {
        assert_eq!((found.0, found.1), (exact.0, exact.1));
        assert!((found.2 - exact.2).abs() < 1e-8, "{found:?}");
    }
    // Put down and taken up, through a file: the same bits.
    let mut steps = DormandPrince8.steps(&oscillator, start, asked()).unwrap();
    for _ in 0..5 {
        steps.advance().unwrap();
    }
    let read = metriplectic_studies::checkpoints::reread(&steps.checkpoint());
    let resumed = DormandPrince8.resume(&oscillator, &read).unwrap().watching(asked()).unwrap();
    let resumed = resumed.run().unwrap();
    assert_eq!(resumed.last(), run.last());
    assert_eq!(resumed.certificate(), run.certificate());
    // And on to an earlier end, in steps of both kinds.
    let later = run.checkpoint().clone().with_end(-11.0).unwrap();
    let run = DormandPrince8.resume(&oscillator, &later).unwrap().run().unwrap();
    assert!((run.last().time + 11.0).abs() <= 0.0);
    let first = DormandPrince8.run(&oscillator, start, Span::steps(0.1, 30).backward()).unwrap();
    let later = first.checkpoint().clone().with_steps(60).unwrap();
    let on = DormandPrince8.resume(&oscillator, &later).unwrap().run().unwrap();
    let whole = DormandPrince8.run(&oscillator, start, Span::steps(0.1, 60).backward()).unwrap();
    assert_eq!(on.last(), whole.last());
    assert!(matches!(later.with_end(3.0), Err(ResumeError::FixedSteps)));
}

/// The refusal of a run.
fn span<M: StateSpace>(run: Result<Trajectory<M>, RunError<M>>) -> SpanError {
    match run {
        Err(RunError::Span(error)) => error,
        other => panic!("{:?}", other.map(|run| run.last().time)),
    }
}

#[test]
fn what_has_no_way_back_says_why() {
    let back = || Span::steps(0.1, 10).backward();
    let warm = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .build()
        .unwrap();
    let p = vector![0.4, -1.0, 0.3];
    let entropy = span(DormandPrince8.run(&warm, p, back()));
    assert_eq!(entropy, SpanError::BackwardEntropy);
    assert!(entropy.to_string().contains("second law"), "{entropy}");
    let trapped = || {
        System::on(Euclidean::<1>).energy(|x: &Vector1<Real>| x.x * x.x * 0.5).bath(
            "water",
            Bath::at(0.8).friction(|_: Real, _: &Vector1<Real>, _: &Vector1<Real>| {
                [Contact { rate: 1.5.into(), along: vector![1.0.into()] }]
            }),
        )
    };
    let cold = trapped().build().unwrap();
    let exchange = span(WeylMidpoint.run(&cold, cold.start(vector![0.4]), back()));
    assert_eq!(exchange, SpanError::BackwardExchange);
    let noisy = trapped().noise(Boltzmann(1.0)).build().unwrap();
    let start = noisy.flow().start(vector![0.4]);
    let noise = span(RandomFlow(DormandPrince5).seed(1).run(&noisy, start, back()));
    assert_eq!(noise, SpanError::BackwardNoise);
    let pendulum = pendulum();
    let run = |schedule: Schedule| span(DormandPrince8.run(&pendulum, vector![0.7, 0.0], schedule));
    let jump = back().event("wall", |x: &Vector2<f64>| x.x).jump(|_, x: &Vector2<f64>| -x);
    assert_eq!(run(jump.into()), SpanError::BackwardJump);
    assert_eq!(run(back().corners([-0.3])), SpanError::BackwardCorners);
    let ends = run(Span::until(3.0).backward().into());
    assert_eq!(ends, SpanError::BackwardEnd { start: 0.0, end: 3.0 });
    let word = run(Span::until(-3.0).into());
    assert!(word.to_string().contains("`.backward()`"), "{word}");
    let outside = run(back().output_at([0.5]));
    assert!(matches!(outside, SpanError::Output { time: 0.5, .. }), "{outside}");
    // At t = 10¹⁰ no such step is seen in the time.
    let still = run(Span::steps(1e-9, 10).starting_at(1e10).backward().into());
    assert!(matches!(still, SpanError::Standstill { .. }), "{still}");
    let tangent = DormandPrince8.tangent(&warm, p, back());
    assert!(matches!(tangent, Err(TangentError::Broken { .. })));
    let adjoint = DormandPrince8.adjoint(&warm, p, back());
    assert!(matches!(adjoint, Err(TangentError::Broken { .. })));
    for error in [entropy, exchange, noise, run(back().corners([-0.3])), ends, word] {
        println!("{error}");
    }
}
