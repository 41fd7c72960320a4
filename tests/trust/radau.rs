//! Radau's methods where the temperature is infinite inside a step, and where a stiff state follows the time.

use metriplectic::integrators::{Element, Flow, Schedule, Stepper};
use metriplectic::prelude::*;

type Plane = Vector2<Real>;

/// The end of a run of the Radau method with so many stages.
fn end<F: Flow>(stages: usize, flow: &F, x: Element<F>, span: Schedule) -> Element<F>
where
    Radau<2>: Stepper<F>,
    Radau<3>: Stepper<F>,
    Radau<4>: Stepper<F>,
{
    let run = match stages {
        2 => Radau::<2>.run(flow, x, span),
        3 => Radau::<3>.run(flow, x, span),
        _ => Radau::<4>.run(flow, x, span),
    };
    let run = run.unwrap_or_else(|error| panic!("Radau::<{stages}>: {error}"));
    let c = run.certificate();
    assert!(c.keeps_energy() && c.keeps_entropy(), "Radau::<{stages}>: {c}");
    run.last().point.clone()
}

/// `H = u_h (X² + Y)` and `S = u_s (a Y − X)` with `x = u_x X` and `y = u_y Y`: the motion `X' = −1 − 2aX`.
fn parabola(
    a: f64,
    [x, y, h, s]: [f64; 4],
) -> impl Metriplectic<Manifold = Euclidean<2>, Metric = Canonical> {
    System::on(Euclidean::<2>)
        .energy(move |p: &Plane| (p.x * p.x * x.powi(-2) + p.y * y.recip()) * h)
        .entropy(move |p: &Plane| (p.y * y.recip() * a - p.x * x.recip()) * s)
        .dissipation(FieldDissipation(move |_: &Plane, w: &Plane| {
            let b = Vector2::new(w.y, -w.x) * Real::from(x * y / h);
            b * b.transpose() * Real::from(s.recip())
        }))
        .build()
        .expect("it is a system")
}

/// The temperature is infinite at `x = 0`, where one term alone changes the sign of `⟨dH, ♯dS⟩`.
#[test]
fn an_infinite_temperature_inside_a_step_stops_nothing() {
    let system = parabola(0.0, [1.0; 4]);
    let check = |stages, x: Vector2<f64>, span: Schedule, t: f64, bound: f64| {
        let reached = end(stages, &system, x, span);
        let right = Vector2::new(x.x - t, x.y + x.x.powi(2) - (x.x - t).powi(2));
        assert!((reached - right).norm() <= bound, "Radau::<{stages}>, from {x}: {reached}");
    };
    for stages in [2, 3, 4] {
        // The steps are exact, but for some roundings each.
        for n in 2..=64 {
            let span = Span::steps(1.0 / n as f64, n).into();
            check(stages, Vector2::new(0.5, 1.0), span, 1.0, 1e-12);
        }
        for tolerance in [1e-3, 1e-9] {
            let span = Span::until(1.0).tolerance(tolerance).into();
            check(stages, Vector2::new(0.5, 1.0), span, 1.0, 1e-12);
        }
        for size in (0..7).map(|k| 0.01 * 3_f64.powi(k) / 7.0) {
            for beyond in (0..7).map(|k| 0.03 + 0.3 * f64::from(k)) {
                let h = size * (1.0 + beyond);
                check(stages, Vector2::new(size, 1.25), Span::steps(h, 1).into(), h, 1e-12);
            }
        }
    }
}

#[test]
fn units_and_a_second_entry_in_the_entropy_change_nothing_at_an_infinite_temperature() {
    for a in [0.0, 0.01] {
        // X' = −1 − 2aX, and H is constant.
        let decay = (-2.0 * a * 1.0_f64).exp();
        let x = if a > 0.0 { (0.5 + 0.5 / a) * decay - 0.5 / a } else { -0.5 };
        let right = Vector2::new(x, 1.25 - x * x);
        for units in [[1e30, 1e-30, 1.0, 1.0], [1e-30, 1e-30, 1e30, 1e-30], [1e9, 1e-9, 1e5, 1e-7]]
        {
            let system = parabola(a, units);
            let start = Vector2::new(0.5 * units[0], units[1]);
            for stages in [2, 3, 4] {
                let reached = end(stages, &system, start, Span::steps(0.125, 8).into());
                let off = Vector2::new(reached.x / units[0], reached.y / units[1]) - right;
                assert!(off.norm() <= 1e-7, "Radau::<{stages}>, {a}, {units:?}: {off}");
            }
        }
    }
}

/// `x = tanh t` on the circle, through the infinite temperature at `x = 0`.
#[test]
fn a_circle_is_followed_through_its_infinite_temperature() {
    let system = System::on(Euclidean::<2>)
        .energy(|p: &Plane| p.norm_squared() * 0.5)
        .entropy(|p: &Plane| p.x)
        .dissipation(MetricDissipation)
        .build()
        .expect("it is a system");
    let start = Vector2::new((-2.0_f64).tanh(), 2.0_f64.cosh().recip());
    for stages in [2, 3, 4] {
        let counts = [16, 32, 64, 128];
        let errors = counts.map(|n| {
            let reached = end(stages, &system, start, Span::steps(4.0 / n as f64, n).into());
            (reached.x - 2.0_f64.tanh()).abs()
        });
        // The order is 3, 5 or 7; each halving gains at least a factor of 4 down to some roundings.
        let falls = errors.windows(2).all(|pair| pair[1] <= (pair[0] / 4.0).max(1e-12));
        assert!(errors[0] <= 2e-5 && falls, "Radau::<{stages}>: {errors:?}");
    }
}

/// A particle in a trap that moves, the first model of stochastic thermodynamics: `W → ∫ sin² t dt` as `λ → ∞`.
#[test]
fn the_work_of_a_trap_that_is_stiff_is_that_of_its_slow_motion() {
    let slow = 0.5 - 2.0_f64.sin() / 4.0;
    for (lambda, off) in [(1e3, 1e-3), (1e4, 1e-4), (1e5, 3e-5), (1e6, 3e-5)] {
        let system = System::on(Euclidean::<1>)
            .energy_in_time(move |t: Real, x: &Vector1<Real>| {
                let d = x.x - t.cos();
                d * d * (0.5 * lambda)
            })
            .bath("water", Bath::at(1.0).isotropic(1.0))
            .build()
            .expect("it is a system");
        let start = || system.start(Vector1::new(1.0));
        let span = || Span::steps(0.1, 10);
        let runs = [
            Radau::<2>.run(&system, start(), span()),
            Radau::<3>.run(&system, start(), span()),
            Radau::<4>.run(&system, start(), span()),
        ];
        for (run, stages) in runs.into_iter().zip(2..) {
            let run = run.unwrap_or_else(|error| panic!("λ = {lambda:e}, {stages}: {error}"));
            let ledger = &run.last().point.ledger;
            let (work, heat) = (ledger.parameter_work(), ledger.heat("water").unwrap_or(0.0));
            // Up to 1/λ, and the error of ten steps of order 3.
            assert!((work - slow).abs() <= off, "λ = {lambda:e}, {stages}: {work}");
            assert!((work + heat).abs() <= 3.0 / lambda, "λ = {lambda:e}, {stages}: {heat}");
        }
    }
}
