//! Runs in units of every size: lengths of 10⁻⁹, times of 10⁻¹⁵, temperatures of 300.

mod models;

use metriplectic::dynamics::ModelError;
use metriplectic::integrators::{Schedule, SpanError, StepError, Until};
use metriplectic::manifolds::Constant;
use metriplectic::prelude::*;
use models::boxed;

/// A pendulum of energy `H = p²/2 + 1 − cos q`, in a unit of length and momentum.
fn pendulum(unit: f64) -> impl Metriplectic<Manifold = Euclidean<2>, Metric = Canonical> {
    System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(boxed(move |x: &Vector2<Real>| {
            x.y.powi(2) * 0.5 + (-(x.x / unit).cos() + 1.0) * unit.powi(2)
        }))
        .build()
        .expect("the parts make a system")
}

#[test]
fn lengths_of_a_billionth_are_followed_as_well_as_those_of_one() {
    let end = |unit: f64| {
        let span = Span::until(20.0).tolerance(1e-6);
        let run = WeylMidpoint.run(&pendulum(unit), vector![unit, 0.0], span).expect("it runs");
        (run.last().point / unit, run.certificate().steps)
    };
    let (one, steps) = end(1.0);
    for unit in [1e-9, 1e-30, 1e11] {
        let (other, count) = end(unit);
        let off = (other - one).norm();
        println!("unit {unit:.0e}: off by {off:.1e}, {count} steps for {steps}");
        assert!(off < 1e-5, "unit {unit:.0e}: off by {off:.1e} after {count} steps");
    }
}

/// Morse's molecule with friction in a bath of 300 K, in SI units: a length, a momentum, an entropy.
fn molecule() -> impl Metriplectic<Manifold = Euclidean<3>, Metric = Canonical> {
    System::on(Euclidean::<3>)
        .bracket(
            Poisson::constant(Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
                .expect("it is skew"),
        )
        .energy(boxed(|x: &Vector3<Real>| {
            let stretch = -((-(x.x - LENGTH) * STIFFNESS).exp()) + 1.0;
            x.y.powi(2) / (2.0 * MASS) + stretch.powi(2) * DEPTH + x.z * 300.0
        }))
        .entropy(boxed(|x: &Vector3<Real>| x.z))
        .dissipation(FieldDissipation(|_: &Vector3<Real>, w: &Vector3<Real>| {
            let b = Vector3::new(Real::from(0.0), w.z, -w.y);
            b * b.transpose() * (w.z.recip() * FRICTION)
        }))
        .build()
        .expect("the parts make a system")
}

const LENGTH: f64 = 7.4e-11;
const STIFFNESS: f64 = 1.95e10;
const DEPTH: f64 = 7.6e-19;
const MASS: f64 = 8.4e-28;
const FRICTION: f64 = 7e-15;

#[test]
fn a_molecule_in_si_units_keeps_its_laws_at_the_default_tolerance() {
    let (system, start, end) = (molecule(), vector![9.0e-11, 0.0, 0.0], 2e-13);
    let run = WeylMidpoint.run(&system, start, Span::until(end)).expect("it runs");
    let certificate = run.certificate();
    println!("{certificate}");
    // By the classical Runge-Kutta method, in 2000 steps for each turn of 10⁻¹⁴ seconds.
    let flow = |x: &Vector3<f64>| {
        let stretch = (-(x.x - LENGTH) * STIFFNESS).exp();
        let force = -2.0 * DEPTH * STIFFNESS * (1.0 - stretch) * stretch;
        let v = x.y / MASS;
        vector![v, force - FRICTION * v, FRICTION * v * v / 300.0]
    };
    let (mut x, h) = (start, end / 40_000.0);
    for _ in 0..40_000 {
        let a = flow(&x);
        let b = flow(&(x + a * (0.5 * h)));
        let c = flow(&(x + b * (0.5 * h)));
        x += (a + (b + c) * 2.0 + flow(&(x + c * h))) * (h / 6.0);
    }
    let (last, sizes) = (run.last().point, vector![1e-10, 1e-22, 1e-21]);
    let off = (last - x).component_div(&sizes);
    println!("{last:e} {x:e} off {off:e}");
    assert!(certificate.max_energy_error <= 1e-14 * certificate.initial_energy, "{certificate}");
    assert!(off.amax() < 1e-4, "{off:e}");
}

#[test]
fn a_collision_ends_in_an_error_however_small_the_least_step() {
    let fall = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(boxed(|x: &Vector2<Real>| x.y.powi(2) * 0.5 - x.x.recip()))
        .build()
        .unwrap();
    let end = |span: Until| {
        let error = WeylMidpoint.run(&fall, vector![1.0, 0.0], span.tolerance(1e-3)).unwrap_err();
        match error {
            RunError::Step { cause, trajectory } => (cause, trajectory.last().time),
            error => panic!("another error: {error}"),
        }
    };
    let collision = std::f64::consts::PI / 8.0_f64.sqrt();
    let (cause, time) = end(Span::until(2.0));
    assert!(matches!(cause, StepError::TooSmall { .. }), "{cause}");
    assert!((time - collision).abs() < 1e-3, "{time}");
    // Below the last digit of the time no step size is left.
    let (cause, time) = end(Span::until(2.0).least_step(1e-300));
    let StepError::Standstill { time: at, h } = cause else { panic!("another error: {cause}") };
    assert!(
        h < f64::EPSILON * at && at.to_bits() == time.to_bits() && (time - collision).abs() < 1e-3,
        "{cause}"
    );
    assert!(cause.to_string().contains("below the last digit of the time"), "{cause}");
}

#[test]
fn a_field_of_tiny_slope_moves() {
    let tiny = |size: f64| {
        System::on(LieDual::so3())
            .energy(boxed(move |p: &Vector3<Real>| {
                (p.x.powi(2) * 0.5 + p.y.powi(2) + p.z.powi(2) * 1.5) * size
            }))
            .build()
            .unwrap()
    };
    let start = vector![0.4, 0.5, 0.3];
    let one = WeylMidpoint.run(&tiny(1.0), start, Span::until(10.0).tolerance(1e-4)).unwrap();
    for exponent in [-520, -560, 400] {
        let size = 2_f64.powi(exponent);
        let span = Span::until(10.0 / size).tolerance(1e-4);
        let run = WeylMidpoint.run(&tiny(size), start, span.until_rest(1e-9)).unwrap();
        let off = (run.last().point - one.last().point).norm();
        println!(
            "2^{exponent}: {:?}, {} steps, off {off:.1e}",
            run.ending(),
            run.certificate().steps
        );
        assert_eq!(run.ending(), Ending::Span);
        assert!(off < 1e-12, "{off:.1e}");
    }
}

#[test]
fn a_uniform_motion_far_away_is_no_rest() {
    let free = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(boxed(|x: &Vector2<Real>| x.y.powi(2) * 0.5))
        .build()
        .unwrap();
    let span = Span::steps(1.0, 1000).until_rest(1e-9);
    let run = WeylMidpoint.run(&free, vector![1e17, 1.0], span).unwrap();
    println!("{:?} {}", run.ending(), run.last().point.x - 1e17);
    assert_eq!(run.ending(), Ending::Span);
    assert!((run.last().point.x - 1e17 - 1000.0).abs() <= 16.0);
}

/// A damped nonlinear oscillator in a bath, `H = p²/2 + q²/2 + q⁴/4 + s`, in units of its entries, of the
/// time and of the energy that are powers of two.
fn damped(
    [q, p, s]: [f64; 3],
    time: f64,
    energy: f64,
) -> impl Metriplectic<Manifold = Euclidean<3>, Metric = Constant<3>> {
    let skew = q * p / (time * energy);
    System::on(Euclidean::<3>)
        .metric(
            Metric::constant(Matrix3::from_diagonal(&vector![
                1.0 / (q * q),
                1.0 / (p * p),
                1.0 / (s * s)
            ]))
            .expect("it is positive"),
        )
        .bracket(
            Poisson::constant(Matrix3::new(0.0, skew, 0.0, -skew, 0.0, 0.0, 0.0, 0.0, 0.0))
                .expect("it is skew"),
        )
        .energy(boxed(move |x: &Vector3<Real>| {
            let (q, p) = (x.x / q, x.y / p);
            (p * p * 0.5 + q * q * 0.5 + q.powi(4) * 0.25 + x.z / s) * energy
        }))
        .entropy(boxed(move |x: &Vector3<Real>| x.z))
        .dissipation(FieldDissipation(move |_: &Vector3<Real>, w: &Vector3<Real>| {
            // b = (0, w_s, −w_p), each with the unit of its entry.
            let b = Vector3::new(Real::from(0.0), w.z * (s * p / energy), -w.y * (s * p / energy));
            b * b.transpose() * ((w.z * (s / energy)).recip() * (0.125 / (time * s)))
        }))
        .build()
        .expect("the parts make a system")
}

/// The states of an adaptive run to t = 20, in the units given.
fn damped_run([q, p, s]: [f64; 3], time: f64, energy: f64) -> (Vec<[f64; 5]>, Certificate) {
    let system = damped([q, p, s], time, energy);
    let span = Span::until(20.0 * time).tolerance(1e-5).until_rest(1e-9);
    let run = WeylMidpoint.run(&system, vector![q, 0.0, 0.0], span).expect("it runs");
    let rows = run.iter().map(|state| {
        let x = state.point;
        [state.time / time, x.x / q, x.y / p, x.z / s, state.energy / energy]
    });
    (rows.collect(), run.certificate().clone())
}

#[test]
fn a_run_in_scaled_units_has_the_same_bits() {
    let (one, certificate) = damped_run([1.0; 3], 1.0, 1.0);
    assert!(certificate.keeps_energy() && one.len() > 1000, "{certificate}");
    for [length, time, energy] in [[10, 0, 0], [0, 20, 0], [-30, -50, 0], [40, 7, 3]] {
        let [length, time, energy] = [length, time, energy].map(|k| 2_f64.powi(k));
        let (other, _) = damped_run([length; 3], time, energy);
        let same = one
            .iter()
            .zip(&other)
            .take_while(|(a, b)| a.map(f64::to_bits) == b.map(f64::to_bits))
            .count();
        println!(
            "{length:e} {time:e} {energy:e}: {same} states of {} and {}",
            one.len(),
            other.len()
        );
        assert!(
            same == one.len() && one.len() == other.len(),
            "{length:e} {time:e} {energy:e}: {same} states are the same"
        );
    }
}

#[test]
fn each_entry_may_have_a_unit_of_its_own() {
    let (one, _) = damped_run([1.0; 3], 1.0, 1.0);
    for [q, p, s] in [[-30, 0, 0], [0, 13, -20], [12, -30, 7]] {
        let (other, certificate) = damped_run([q, p, s].map(|k| 2_f64.powi(k)), 1.0, 1.0);
        assert_eq!(one.len(), other.len(), "{q} {p} {s}: {certificate}");
        // At the end both times are the same; on the way the last digits of an error move a step.
        let ends =
            one.iter().zip(&other).next_back().map(|(a, b)| (0..4).map(|i| (a[i] - b[i]).abs()));
        let off = ends.into_iter().flatten().fold(0.0, f64::max);
        println!("2^{q}, 2^{p}, 2^{s}: off by {off:.1e}");
        assert!(off < 1e-9, "2^{q}, 2^{p}, 2^{s}: off by {off:.1e}");
    }
}

#[test]
fn the_size_of_an_entry_can_be_said() {
    // A weight far from the origin: heights of a metre at the top of a tower.
    let radius = 1e3;
    let system = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(boxed(move |x: &Vector2<Real>| {
            let height = x.x - radius;
            x.y.powi(2) * 0.5 + height.powi(2) * 0.5 + height.powi(4) * 0.25
        }))
        .build()
        .unwrap();
    let start = vector![radius + 1.0, 0.0];
    let end = |course: Schedule| {
        let run = WeylMidpoint.run(&system, start, course).expect("it runs");
        (run.last().point, run.certificate().steps)
    };
    let (exact, _) = end(Span::steps(1e-4, 100_000).into());
    let span = Span::until(10.0).tolerance(1e-4);
    let (automatic, _) = end(span.into());
    let (known, steps) = end(span.scale([0.1, 0.1]).into());
    let (allowed, more) = end(span.scale([1.0, 1.0]).into());
    println!("{automatic} {known} {allowed} {exact}: {steps} and {more} steps");
    // A tenth of the size is 10^{2/3} times as accurate.
    assert!((known - exact).norm() < 0.3 * (allowed - exact).norm());
    assert!((known - exact).norm() < 0.3 * (automatic - exact).norm());
    assert!((known - exact).norm() < 2e-3 && (allowed - exact).norm() < 2e-3);
    // Errors in addition to the relative ones.
    let (coarse, fewer) = end(span.tolerance(1e-6).absolute([1e-4, 1e-4]).into());
    let (_, many) = end(span.tolerance(1e-6).into());
    println!("{coarse}: {fewer} steps, {many} without absolute errors");
    assert!(fewer < many);
    for (given, expected) in [
        (Schedule::from(span.scale([1.0])), SpanError::Entries { found: 1, expected: 2 }),
        (span.scale([1.0, -2.0]).into(), SpanError::Entry { index: 1, value: -2.0 }),
        (
            span.absolute([f64::INFINITY, 1.0]).into(),
            SpanError::Entry { index: 0, value: f64::INFINITY },
        ),
    ] {
        match WeylMidpoint.run(&system, start, given) {
            Err(RunError::Span(error)) => assert_eq!(error, expected),
            other => panic!("another answer: {:?}", other.err()),
        }
    }
}

/// The size that was misjudged in a run by each method.
fn misjudged(
    system: &impl Metriplectic<Manifold = Euclidean<2>>,
    start: Vector2<f64>,
    schedule: &Schedule,
) -> [Option<[f64; 3]>; 6] {
    let of = |certificate: &Certificate| {
        println!("{certificate}");
        certificate.misjudged_size.map(|size| [size.direction as f64, size.judged, size.reached])
    };
    macro_rules! of {
        ($method:expr) => {
            of($method.run(system, start, schedule.clone()).expect("it runs").certificate())
        };
    }
    [
        of!(WeylMidpoint),
        of!(Gauss::<2>),
        of!(Radau::<2>),
        of!(DormandPrince5),
        of!(DormandPrince8),
        of!(RungeKuttaChebyshev),
    ]
}

#[test]
fn the_certificate_says_which_size_was_misjudged() {
    let oscillator = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5)
        .build()
        .unwrap();
    let start = vector![1e-9, 0.0];
    let span = Span::until(13.0).tolerance(1e-4);
    assert_eq!(misjudged(&oscillator, start, &span.into()), [None; 6]);
    // A size of the user that is not reached.
    let unreached = [Some([0.0, 1.0, 1e-9]); 6];
    assert_eq!(misjudged(&oscillator, start, &span.scale([1.0, 0.0]).into()), unreached);
    // Unstable, with p from 0 to 10⁻⁹ sinh 13 = 2.2e-4.
    let saddle = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| (x.y.powi(2) - x.x.powi(2)) * 0.5)
        .build()
        .unwrap();
    for grown in misjudged(&saddle, start, &span.into()) {
        let [direction, judged, reached] = grown.expect("a size that has grown");
        assert!(direction > 0.5 && judged < 1e-9 && reached > 1e-4, "{grown:?}");
    }
}

#[test]
fn an_entry_that_stays_at_zero_but_for_noise_stops_nothing() {
    // Two equal weights on springs: the sum of their momenta is zero, but for rounding.
    let matrix = Matrix4::from_fn(|i, j| f64::from(j == i + 2) - f64::from(i == j + 2));
    let system = System::on(Euclidean::<4>)
        .bracket(Poisson::constant(matrix).unwrap())
        .energy(boxed(|x: &Vector4<Real>| {
            // The second position is the centre: forces of 10³ on it cancel.
            let (a, b) = (x.y + x.x, x.y - x.x);
            (x.z.powi(2) + x.w.powi(2)) * 0.5
                + (a.cosh() + b.cosh()) * 1e3
                + (a * 3.0 + b * 3.0).sin()
                - (a * 3.0).sin()
                - (b * 3.0).sin()
        }))
        .build()
        .unwrap();
    let start = vector![0.7, 0.0, 0.3, 0.0];
    let run = WeylMidpoint.run(&system, start, Span::until(1.0).tolerance(1e-5)).unwrap();
    println!("{}\n{}", run.certificate(), run.last().point);
    assert!(run.certificate().keeps_energy());
    assert!(run.certificate().rejected < 20 && run.certificate().steps < 20_000);
}

#[test]
fn a_run_starts_when_it_is_told() {
    let (system, start) = (pendulum(1.0), vector![1.0, 0.0]);
    // Numbers of few digits, so that no time is rounded.
    let early = WeylMidpoint.run(&system, start, Span::steps(0.125, 80)).unwrap();
    let late = WeylMidpoint.run(&system, start, Span::steps(0.125, 80).starting_at(64.0)).unwrap();
    for (a, b) in early.iter().zip(&late) {
        assert_eq!((a.step, a.time + 64.0, a.point), (b.step, b.time, b.point));
    }
    let span = Span::until(-7.0).starting_at(-10.0).tolerance(1e-5);
    let run = WeylMidpoint.run(&system, start, span).unwrap();
    let same = WeylMidpoint.run(&system, start, Span::until(3.0).tolerance(1e-5)).unwrap();
    assert_eq!((run.states()[0].time, run.last().time), (-10.0, -7.0));
    assert!((run.last().point - same.last().point).norm() < 1e-12);
    let watch = Observables::on(&system).of("q", |x: &Vector2<f64>| x.x);
    let row: Vec<f64> = watch.row(late.last()).collect();
    assert!((row[0] - 74.0).abs() < 1e-15);
    for (course, late) in [
        (Schedule::from(Span::until(1.0).starting_at(1.0)), true),
        (Span::until(1.0).starting_at(f64::NAN).into(), true),
        (Span::steps(0.1, 10).starting_at(f64::INFINITY).into(), true),
        (Span::steps(1e-9, 10).starting_at(1e12).into(), false),
        (Span::steps(1e-9, 10).starting_at(-1e12).into(), false),
    ] {
        match WeylMidpoint.run(&system, start, course) {
            Err(RunError::Span(SpanError::End { .. })) if late => {}
            Err(RunError::Span(SpanError::Standstill { .. })) if !late => {}
            other => panic!("another answer: {:?}", other.err()),
        }
    }
    // A step that fails says when.
    let fall = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(boxed(|x: &Vector2<Real>| x.y.powi(2) * 0.5 - x.x.recip()))
        .build()
        .unwrap();
    let span = Span::until(102.0).starting_at(100.0).tolerance(1e-3);
    let error = WeylMidpoint.run(&fall, start, span).unwrap_err();
    assert!(error.to_string().contains("t = 101.11"), "{error}");
}

#[test]
fn a_record_of_steps_of_any_size_is_bounded() {
    let (system, start) = (pendulum(1.0), vector![1.0, 0.0]);
    let span = Span::until(20.0).tolerance(1e-5);
    let whole = WeylMidpoint.run(&system, start, span).unwrap();
    for most in [0, 2, 3, 7, 100, whole.states().len(), 1_000_000] {
        let run = WeylMidpoint.run(&system, start, span.at_most(most)).unwrap();
        assert_eq!((run.certificate(), run.last()), (whole.certificate(), whole.last()));
        let (states, allowed) = (run.states(), most.max(2));
        assert!(states.len() <= allowed, "{} of {most}", states.len());
        assert!(2 * states.len() + 2 >= allowed.min(whole.states().len()), "{}", states.len());
        assert_eq!(states[0], whole.states()[0]);
        // Evenly spaced, but for the last.
        let spacing = states[1].step;
        let even = states.iter().enumerate().take(states.len() - 1);
        assert!(even.into_iter().all(|(k, state)| state.step == k * spacing), "{most}");
    }
}

#[test]
fn an_overflow_is_called_one() {
    for size in [1e150, 1e152] {
        let body = models::relaxing_body();
        let start = vector![0.4, 0.5, 0.3] * size;
        let error = WeylMidpoint.run(&body, start, Span::steps(0.1 / size, 10)).unwrap_err();
        let RunError::Model(ModelError::Overflow { point, .. }) = &error else {
            panic!("another error: {error}");
        };
        assert_eq!(point.len(), 3);
        assert!(error.to_string().contains("overflow"), "{error}");
    }
}

#[test]
fn an_underflow_is_called_one() {
    // ½(q² + p²) is 10⁻³²⁰, which has three digits left.
    let oscillator = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(boxed(|x: &Vector2<Real>| x.norm_squared() * 0.5))
        .build()
        .unwrap();
    // At 10⁻²⁰⁰ it is zero, and so are the products ∂ᵢH xᵢ, at rest as in motion.
    for size in [1e-300, 1e-200, 1e-165, 1e-160, 1e-150] {
        for start in [vector![1.0, 0.5] * size, vector![size, 0.0], vector![0.0, -size]] {
            let span = Span::until(1.0).until_rest(1e-9);
            let refuses = |error: RunError<Euclidean<2>>| {
                let RunError::Model(ModelError::Underflow { field: "energy", .. }) = &error else {
                    panic!("another error: {error}");
                };
                assert!(error.to_string().contains("smaller units"), "{error}");
            };
            refuses(WeylMidpoint.run(&oscillator, start, span).unwrap_err());
            refuses(WeylMidpoint.run(&oscillator, start, Span::steps(0.1, 10)).unwrap_err());
            refuses(DormandPrince8.run(&oscillator, start, span).unwrap_err());
            refuses(Gauss::<2>.run(&oscillator, start, span).unwrap_err());
        }
    }
    // All digits are there at 10⁻¹⁴⁰, and none is needed at the equilibrium.
    for size in [1e-140, 0.0] {
        let start = vector![1.0, 0.5] * size;
        let run = WeylMidpoint.run(&oscillator, start, Span::steps(0.1, 100)).unwrap();
        assert!(run.certificate().keeps_energy(), "{}", run.certificate());
    }
}
