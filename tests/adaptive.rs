//! Steps of a size that follows the motion.

mod models;

use metriplectic::integrators::{Flow, Laws, Schedule, SpanError, StepError, StepStart};
use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Guarantee, Order, scientific};
use models::{TUMBLING, UNSTABLE, free_body, half_square, relaxing_body, top};

/// One step of the classical Runge-Kutta method, which shares nothing with the scheme.
fn runge_kutta<const N: usize>(
    f: impl Fn(&SVector<f64, N>) -> SVector<f64, N>,
    x: &SVector<f64, N>,
    h: f64,
) -> SVector<f64, N> {
    let a = f(x);
    let b = f(&(x + a * (0.5 * h)));
    let c = f(&(x + b * (0.5 * h)));
    x + (a + (b + c) * 2.0 + f(&(x + c * h))) * (h / 6.0)
}

/// The flow over a time, in steps of at most `h`.
fn flow<const N: usize>(
    f: impl Fn(&SVector<f64, N>) -> SVector<f64, N>,
    x: &SVector<f64, N>,
    (time, h): (f64, f64),
) -> SVector<f64, N> {
    let steps = (time / h).ceil().max(1.0);
    let (mut x, mut step) = (*x, 0.0);
    while step < steps {
        x = runge_kutta(&f, &x, time / steps);
        step += 1.0;
    }
    x
}

/// The relaxing body by hand.
fn relaxing(p: &Vector3<f64>) -> Vector3<f64> {
    let dh = p.component_div(&vector![10.0, 5.0, 1.0]);
    p.cross(&dh) + p * dh.norm_squared() - dh * dh.dot(p)
}

/// The spinning top by hand.
fn spinning(x: &Vector3<f64>) -> Vector3<f64> {
    x.cross(&(x + x.component_mul(x)).component_mul(&vector![1.0, 0.5, 0.25]))
}

#[test]
fn the_error_is_proportional_to_the_tolerance() {
    let tolerances = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8];
    let body = relaxing_body();
    let exact = flow(relaxing, &UNSTABLE, (40.0, 1e-3));
    let errors = tolerances.map(|tolerance| {
        let run = WeylMidpoint.run(&body, UNSTABLE, Span::until(40.0).tolerance(tolerance));
        (run.expect("it runs").last().point - exact).norm()
    });
    let order = Order::fit(&tolerances, &errors).expect("six errors");
    println!("relaxing body: {errors:?}, slope {order}");
    let claim = |problem: &str, order: &Order| {
        Claim::new(Guarantee::Tolerance, format!("{problem}: error ~ toleranceᵖ"), "WeylMidpoint")
            .against("a Runge-Kutta flow with gradients by hand")
            .record(format!("p = {order}"), "1 ± 0.1");
    };
    claim("relaxing rigid body, so(3)*", &order);
    assert!(order.agrees(1.0, 0.1), "{order}");

    let system = System::on(Sphere::<2>::round()).bracket(AreaForm).energy(top).build().unwrap();
    let start = Vector3::from_element(3.0_f64.sqrt().recip());
    let exact = flow(spinning, &start, (20.0, 1e-3));
    let errors = tolerances.map(|tolerance| {
        let run = WeylMidpoint.run(&system, start, Span::until(20.0).tolerance(tolerance));
        (run.expect("it runs").last().point - exact).norm()
    });
    let order = Order::fit(&tolerances, &errors).expect("six errors");
    println!("top: {errors:?}, slope {order}");
    claim("spinning top, S²", &order);
    assert!(order.agrees(1.0, 0.1), "{order}");
    // The tolerance is about the error that is collected in a turn; here it is some turns.
    assert!(errors[3] < 20.0 * tolerances[3], "{errors:?}");
}

#[test]
fn the_laws_hold_in_steps_of_random_sizes() {
    let (body, scheme) = (relaxing_body(), Scheme::new(WeylMidpoint));
    let (mut x, mut time, mut memory) = (UNSTABLE, 0.0, Default::default());
    let energy = |p: &Vector3<f64>| 0.5 * p.component_div(&vector![10.0, 5.0, 1.0]).dot(p);
    let (start, mut worst) = (energy(&x), 0.0_f64);
    // Weyl's sequence: the fractions of the multiples of the golden section.
    for step in 1..100_000 {
        let fraction = (f64::from(step) * 0.618_033_988_749_894_9).fract();
        let h = 1e-4 * 1e4_f64.powf(fraction);
        let values = Flow::laws(&body, &x);
        let reference = Laws { energy: start, ..values };
        let from = StepStart { flow: &body, x: &x, time, values, reference, allowed: None };
        let taken = scheme.step(&from, h, &mut memory).expect("the step is solved");
        let end = taken.x;
        let (before, after) = (0.5 * x.norm_squared(), 0.5 * end.norm_squared());
        let round_off = 4.0 * f64::EPSILON * (before.max(1.0) + 2.0 * before);
        assert!(after - before >= -round_off, "at t = {time}: {:.1e}", after - before);
        worst = worst.max((energy(&end) - start).abs());
        (x, time) = (end, time + h);
    }
    println!("|H − H₀| ≤ {worst:.1e}");
    assert!(worst <= 16.0 * f64::EPSILON, "{worst:.1e}");
}

#[test]
fn the_laws_hold_in_steps_of_a_controller() {
    for tolerance in [1e-1, 1e-3, 1e-6] {
        let span = Span::until(300.0).tolerance(tolerance);
        let run = WeylMidpoint.run(&relaxing_body(), UNSTABLE, span).unwrap();
        let certificate = run.certificate();
        println!("{tolerance:.0e}:\n{certificate}");
        assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
        let problem = format!("relaxing rigid body, T = 300, tolerance {tolerance:.0e}: H");
        Claim::new(Guarantee::Tolerance, problem, "WeylMidpoint")
            .against("H at the start")
            .record(scientific(certificate.max_energy_error), "16 ε");
        assert!(certificate.max_energy_error <= 16.0 * f64::EPSILON, "{certificate}");
        // The motion is slow, quick and slow again.
        assert!(certificate.largest_step > 5.0 * certificate.smallest_step, "{certificate}");
    }
}

/// Three bodies with the energies `e_i` and `S = Σ ln e_i`: the first two exchange heat `rate` times as
/// fast as the last two.
fn bodies(rate: f64) -> impl Metriplectic<Manifold = Euclidean<3>, Metric = Canonical> {
    System::on(Euclidean::<3>)
        .energy(|e: &Vector3<Real>| e.sum())
        .entropy(|e: &Vector3<Real>| e.x.ln() + e.y.ln() + e.z.ln())
        .dissipation(FieldDissipation(move |_: &Vector3<Real>, w: &Vector3<Real>| {
            let fast = Vector3::new(w.y, -w.x, 0.0.into());
            let slow = Vector3::new(0.0.into(), w.z, -w.y);
            fast * fast.transpose() * Real::from(rate) + slow * slow.transpose()
        }))
        .build()
        .expect("the parts make a system")
}

const RATE: f64 = 1e3;
const ENERGIES: Vector3<f64> = Vector3::new(1.0, 3.0, 5.0);

/// The same by hand.
fn exchange(e: &Vector3<f64>) -> Vector3<f64> {
    let fast = RATE * (1.0 / e.x - 1.0 / e.y);
    let slow = 1.0 / e.y - 1.0 / e.z;
    vector![fast, slow - fast, -slow]
}

/// The number of steps, and the largest error at any of their ends.
fn steps_and_error(run: &Trajectory<Euclidean<3>>) -> (usize, f64) {
    let (mut exact, mut time, mut worst) = (ENERGIES, 0.0, 0.0_f64);
    for state in run {
        if state.step > 0 {
            exact = flow(exchange, &exact, (state.time - time, 1e-4));
        }
        time = state.time;
        worst = worst.max((state.point - exact).norm());
    }
    (run.certificate().steps, worst)
}

#[test]
fn a_stiff_start_of_a_slow_motion_takes_few_steps() {
    let system = bodies(RATE);
    let end = 10.0;
    let run = WeylMidpoint.run(&system, ENERGIES, Span::until(end).tolerance(1e-3)).unwrap();
    println!("{}", run.certificate());
    assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
    let (steps, error) = steps_and_error(&run);
    let mut fixed = Vec::new();
    for count in (0..7).map(|k| 1000 << (2 * k)) {
        let span = Span::steps(end / count as f64, count);
        let run = WeylMidpoint.run(&system, ENERGIES, span).unwrap();
        fixed.push(steps_and_error(&run));
        if fixed.last().is_some_and(|last| last.1 <= error) {
            break;
        }
    }
    println!("adaptive {steps} steps, error {error:.1e}; fixed {fixed:?}");
    let coarser = fixed.iter().filter(|fixed| fixed.1 > error).map(|fixed| fixed.0).max();
    let coarser = coarser.expect("one of them");
    Claim::new(Guarantee::Tolerance, "stiff start of a slow exchange of heat", "WeylMidpoint")
        .against("steps of one size with no less error")
        .record(format!("{steps} steps for {coarser}"), "200 times fewer");
    assert!(coarser > 200 * steps, "{steps} {error:.1e} {fixed:?}");
}

#[test]
fn the_end_is_the_time_that_was_asked_for() {
    let body = free_body();
    for end in [1e-3, 0.1, 1.0 / 3.0, 7.3, 50.0, 123.456_789] {
        for tolerance in [1e-1, 1e-4] {
            let span = Span::until(end).tolerance(tolerance).every(7);
            let run = WeylMidpoint.run(&body, TUMBLING, span).unwrap();
            assert_eq!(run.last().time.to_bits(), end.to_bits());
            assert_eq!(run.ending(), Ending::Span);
            let recorded: Vec<_> = run.iter().map(|state| state.step).collect();
            let last = run.certificate().steps;
            let expected = (0..last).filter(|step| step % 7 == 0).chain([last]);
            assert_eq!(recorded, expected.collect::<Vec<_>>());
            assert!(run.states().windows(2).all(|pair| pair[0].time < pair[1].time));
        }
        // The iterator ends there too, and stays.
        let mut steps = WeylMidpoint.steps(&body, TUMBLING, Span::until(end)).unwrap();
        assert_eq!(steps.by_ref().last().map(|state| state.unwrap().time), Some(end));
        assert!(steps.next().is_none());
        assert_eq!(steps.advance().unwrap().time.to_bits(), end.to_bits());
    }
}

/// At these starts the frequency vanishes, and the time that is asked for is the only one known.
#[test]
fn the_states_do_not_depend_on_the_end() {
    type Force = fn(f64) -> f64;
    type Potential = fn(Real) -> Real;
    let problems: [(&str, Potential, Force, Vector2<f64>); 2] = [
        ("pendulum", |q| -q.cos(), |q| -q.sin(), vector![std::f64::consts::FRAC_PI_2, 0.0]),
        ("quartic", |q| q.powi(4) * 0.25, |q| -q.powi(3), vector![0.0, 1.0]),
    ];
    for (name, potential, force, start) in problems {
        let system = System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy(move |x: &Vector2<Real>| x.y.powi(2) * 0.5 + potential(x.x))
            .build()
            .unwrap();
        let exact = flow(|x| vector![x.y, force(x.x)], &start, (20.0, 1e-3));
        for end in [21.0, 1e3, 1e5] {
            let span = Span::until(end)
                .tolerance(1e-8)
                .at_most(2)
                .event_in_time("time", |t: f64, _: &Vector2<f64>| t - 20.0)
                .stop();
            let run = DormandPrince5.run(&system, start, span).unwrap();
            let error = (run.last().point - exact).norm();
            assert!(error < 1e-6, "{name}, until {end}: {error:e}");
        }
    }
}

#[test]
fn the_steps_asked_for_are_respected() {
    let body = free_body();
    let span = Span::until(10.0).tolerance(1e-3).first_step(1e-3).largest_step(0.02);
    let run = WeylMidpoint.run(&body, TUMBLING, span).unwrap();
    assert!((run.states()[1].time - 1e-3).abs() < 1e-15);
    assert!(run.certificate().largest_step <= 0.02 * 1.01);
    // A first step that is far too large is rejected.
    let span = Span::until(1e3).tolerance(1e-3).first_step(500.0);
    let run = WeylMidpoint.run(&body, TUMBLING, span).unwrap();
    assert!(run.certificate().rejected > 2 && run.certificate().keeps_energy());
    // The automatic one is not, nor is it timid.
    let run = WeylMidpoint.run(&body, TUMBLING, Span::until(10.0)).unwrap();
    let certificate = run.certificate();
    assert!(certificate.rejected == 0, "{certificate}");
    assert!(run.states()[1].time > 0.05 * certificate.largest_step, "{certificate}");
}

/// `x' = −1`, `y' = 1/x` along `H = ln x + y`: the flow from (1, 0) reaches the edge at t = 1.
fn doomed() -> impl Metriplectic<Manifold = Euclidean<2>, Metric = Canonical> {
    System::on(Euclidean::<2>)
        .bracket(Poisson::constant(Matrix2::new(0.0, -1.0, 1.0, 0.0)).expect("it is skew"))
        .energy(|x: &Vector2<Real>| x.x.ln() + x.y)
        .build()
        .expect("the parts make a system")
}

#[test]
fn a_step_that_fails_is_retried_smaller() {
    let span = Span::until(0.9).tolerance(1e-3).first_step(0.9);
    let run = WeylMidpoint.run(&doomed(), vector![1.0, 0.0], span).unwrap();
    let (certificate, end) = (run.certificate(), run.last().point);
    assert!(certificate.rejected > 0 && certificate.effort.splits == 0, "{certificate}");
    assert!((end.x - 0.1).abs() < 0.01 && (end.y + 0.1_f64.ln()).abs() < 0.03, "{end}");
}

#[test]
fn a_motion_that_ends_is_an_error_with_what_there_is() {
    for span in [Span::until(2.0).tolerance(1e-4), Span::until(2.0).least_step(1e-3)] {
        let error = WeylMidpoint.run(&doomed(), vector![1.0, 0.0], span).unwrap_err();
        let RunError::Step { cause: StepError::TooSmall { time, h, least }, trajectory } = &error
        else {
            panic!("another error: {error}");
        };
        assert!(*time < 1.001 && *time > 0.5 && h < least, "{error}");
        assert_eq!(trajectory.last().time.to_bits(), time.to_bits());
        assert_eq!(trajectory.ending(), Ending::Stopped);
        assert!(error.to_string().contains("coarser tolerance"), "{error}");
    }
}

/// Asks for tolerances in and out of the bounds of a method.
fn has_bounds<F: Flow<Space = LieDual<3>>>(
    body: &F,
    method: impl Method<F> + Copy,
    [least, largest]: [f64; 2],
) {
    let run = |tolerance| {
        let span = Span::until(1.0).tolerance(tolerance);
        method.steps(body, TUMBLING, span).map(|steps| steps.ending())
    };
    let below = [0.0, -0.0, -1e-6, f64::NEG_INFINITY, 0.9 * least, 1e-300];
    for asked in below.into_iter().chain([f64::NAN, f64::INFINITY, 1.1, 1e300]) {
        let error = run(asked).expect_err("it is out of bounds");
        let RunError::Span(SpanError::Tolerance { tolerance, least: a, largest: b }) = error else {
            panic!("{error}");
        };
        assert_eq!(tolerance.to_bits(), asked.to_bits());
        assert_eq!([a, b].map(f64::to_bits), [least, largest].map(f64::to_bits), "{error}");
        assert!(error.to_string().contains(&format!("from {least:.0e} to {largest}")), "{error}");
    }
    assert!(run(least).is_ok() && run(largest).is_ok());
}

#[test]
fn a_tolerance_has_the_bounds_of_its_method() {
    let body = free_body();
    // The table of `Until::tolerance`.
    has_bounds(&body, Scheme::new(WeylMidpoint), [1e-10, 1.0]);
    has_bounds(&body, Scheme::new(Exponential), [1e-10, 1.0]);
    has_bounds(&body, RungeKuttaChebyshev, [1e-10, 1.0]);
    has_bounds(&body, DormandPrince5, [1e-15, 1.0]);
    has_bounds(&body, DormandPrince8, [1e-15, 1.0]);
    has_bounds(&body, Gauss::<1>, [1e-15, 1.0]);
    has_bounds(&body, Gauss::<2>, [1e-15, 1.0]);
    has_bounds(&body, Gauss::<4>, [1e-15, 1.0]);
    has_bounds(&body, Radau::<2>, [1e-15, 1.0]);
    has_bounds(&body, Radau::<4>, [1e-15, 1.0]);
}

#[test]
fn bad_courses_are_refused() {
    let body = free_body();
    let refused = |span| match WeylMidpoint.run(&body, TUMBLING, span) {
        Err(RunError::Span(error)) => error,
        other => panic!("another answer: {:?}", other.err()),
    };
    let error = refused(Span::until(1.0).least_step(0.1).largest_step(0.01));
    assert_eq!(error, SpanError::StepSizes { least: 0.1, largest: 0.01 });
    let endless = WeylMidpoint.run(&body, TUMBLING, 0.1);
    assert!(matches!(endless, Err(RunError::Span(SpanError::Endless))));
}

#[test]
fn a_relaxing_body_comes_to_rest() {
    let body = relaxing_body();
    let rests = |run: Trajectory<LieDual<3>>| {
        let Ending::Rest { speed, largest } = run.ending() else {
            panic!("{:?} at t = {}", run.ending(), run.last().time)
        };
        assert!(speed <= 1e-9 * largest, "{:?}", run.ending());
        let axis = (2.0 * run.certificate().initial_energy * 10.0).sqrt();
        assert!((run.last().point.x.abs() - axis).abs() < 1e-8, "{}", run.last().point);
        assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
        run.certificate().steps
    };
    let span = Span::until(1e6).tolerance(1e-4).until_rest(1e-9);
    let adaptive = rests(WeylMidpoint.run(&body, UNSTABLE, span).unwrap());
    let span = Span::steps(0.1, 1_000_000).every(1000).until_rest(1e-9);
    let fixed = rests(WeylMidpoint.run(&body, UNSTABLE, span).unwrap());
    println!("at rest after {adaptive} steps that follow the motion, {fixed} of size 0.1");

    // An equilibrium is at rest before the first step; a body without friction never is.
    let run = WeylMidpoint.run(&body, Vector3::x(), Span::until(1.0).until_rest(1e-9)).unwrap();
    assert!(run.ending().is_rest() && run.states().len() == 1);
    let span = Span::until(20.0).tolerance(1e-3).until_rest(1e-9);
    let run = WeylMidpoint.run(&free_body(), TUMBLING, span).unwrap();
    assert_eq!((run.ending(), run.last().time), (Ending::Span, 20.0));
}

#[test]
fn a_state_that_no_step_moves_is_at_rest() {
    // Beside the axis the displacement underflows. (At 10⁻¹⁷ it is round-off of the point as a whole, but
    // not of the entry that moves.)
    let start = vector![0.7, 1e-310, 0.0];
    let run =
        WeylMidpoint.run(&relaxing_body(), start, Span::steps(0.1, 100).until_rest(1e-9)).unwrap();
    assert!(run.ending().is_rest() && run.certificate().steps <= 1, "{:?}", run.ending());
}

/// The state at t = 0.3 with a tolerance, on SO(3) with Nambu's bracket, and the balance.
fn rotated<R, W>(
    scheme: Scheme<R, W>,
    law: SecondLaw,
    tolerance: f64,
) -> (Matrix3<f64>, Certificate)
where
    R: Retraction<Rotations, Canonical>,
    W: metriplectic::integrators::DiscreteGradient,
{
    let system = System::on(Rotations::bi_invariant())
        .bracket(Nambu::default())
        .energy(|r: &Matrix3<Real>| r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5)
        .entropy(|r: &Matrix3<Real>| r.m13 - r.m21 * 0.5 + (r.m31 + r.m32).powi(2) * 0.25)
        .second_law(law)
        .build()
        .expect("the parts make a system");
    let start =
        Rotations::bi_invariant().from_quaternion([0.8, 0.3, -0.4, 0.33]).expect("it is one");
    let run = scheme.run(&system, start, Span::until(0.3).tolerance(tolerance)).expect("it runs");
    (run.last().point, run.certificate().clone())
}

#[test]
fn every_scheme_follows_the_tolerance() {
    let (exact, _) = rotated(Scheme::new(WeylMidpoint), SecondLaw::Exact, 1e-8);
    let check = |name, (end, certificate): (Matrix3<f64>, Certificate)| {
        let error = (end - exact).norm();
        println!("{name}: error {error:.1e}\n{certificate}");
        assert!(certificate.keeps_energy(), "{name}: {certificate}");
        assert!(error < 1e-3, "{name}: {error:.1e}");
    };
    let (weyl, exact_law) = (Scheme::new(WeylMidpoint), SecondLaw::Exact);
    check("Weyl", rotated(weyl, exact_law, 1e-4));
    check("published", rotated(weyl, SecondLaw::Published, 1e-4));
    check("mean value", rotated(weyl.gradient(MeanValue), exact_law, 1e-4));
    check("Itoh-Abe", rotated(weyl.gradient(ItohAbe), exact_law, 1e-4));
    check("Cayley", rotated(Scheme::new(Cayley), exact_law, 1e-4));
    check("exponential", rotated(Scheme::new(Exponential), exact_law, 1e-4));
}

#[test]
fn a_further_invariant_and_a_metric_from_a_closure_change_nothing() {
    let metric = |p: &Vector3<Real>| Matrix3::from_diagonal_element(p.norm_squared() + 1.0);
    let body = System::on(LieDual::so3())
        .metric(Metric::field(metric))
        .energy(|p: &Vector3<Real>| p.x.powi(2) + p.y.powi(2) * 0.5 + p.z.powi(2) * 0.25)
        .entropy(half_square)
        .build()
        .unwrap();
    let span = Span::until(2.0).tolerance(1e-3);
    let run = WeylMidpoint.run(&body, vector![0.4, 0.5, 0.3], span).unwrap();
    assert!(run.certificate().keeps_energy() && run.certificate().entropy_falls == 0);
    let free = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x.powi(2) * 0.5 + p.y.powi(2) * 0.25 + p.z.powi(4) * 0.2)
        .casimir(half_square)
        .build()
        .unwrap();
    let run = WeylMidpoint.run(&free, TUMBLING, Span::until(50.0).tolerance(1e-3)).unwrap();
    let certificate = run.certificate();
    assert!(certificate.keeps_energy() && certificate.keeps_invariants(), "{certificate}");
}

#[test]
fn an_attitude_follows_steps_of_any_size() {
    let body = relaxing_body();
    let end = |course: Schedule| {
        let run = WeylMidpoint.run(&body, UNSTABLE, course).expect("it runs");
        let attitudes = Attitude::along(&body, &run, Matrix3::identity()).expect("it follows");
        attitudes[attitudes.len() - 1]
    };
    let fixed = end(Span::steps(4e-3, 10_000).into());
    let errors = [1e-3, 1e-5]
        .map(|tolerance| (end(Span::until(40.0).tolerance(tolerance).into()) - fixed).norm());
    println!("attitudes off by {errors:?}");
    assert!(errors[1] < 1e-3 && errors[1] < 0.1 * errors[0], "{errors:?}");
}
