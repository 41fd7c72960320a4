//! Guesses, stopping rules and sizes: what is extrapolated, what is judged by itself, and numbers whose squares are none.

use metriplectic::integrators::Schedule;
use metriplectic::prelude::*;
use num_dual::DualNum;

use crate::methods::{Any, Explicit};

type Plane = Vector2<f64>;

fn turned(x: Plane, t: f64) -> Plane {
    let (sin, cos) = t.sin_cos();
    vector![cos * x.x + sin * x.y, cos * x.y - sin * x.x]
}

/// An oscillator with this frequency, which is the size of its energy too.
fn oscillator(w: f64) -> impl Metriplectic<Manifold = Euclidean<2>, Metric = Canonical> {
    System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(move |x: &Vector2<Real>| x.norm_squared() * (0.5 * w))
        .build()
        .expect("it is a system")
}

/// Times that are one in exact numbers: of the grid, in decimal digits, and a rounding beside it.
fn beside(k: usize, h: f64) -> [f64; 4] {
    let time = k as f64 * h;
    let digits = format!("{time:.3}").parse().expect("a number");
    [time, digits, time.next_up(), time.next_down()]
}

/// The end of a run of one size beside the closed form, with a kick of this size at each time beside each time of the grid.
fn is_kicked<F: Metriplectic<Manifold = Euclidean<2>>, M: Method<F> + Clone>(
    name: &str,
    method: &M,
    system: &F,
) {
    for (h, n) in [(0.1, 20), (0.3, 9)] {
        let start = vector![1.0, 0.0];
        let whole = method.clone().run(system, start, Span::steps(h, n)).expect("it runs");
        let plain = (whole.last().point - turned(start, whole.last().time)).norm();
        for time in (1..n).flat_map(|k| beside(k, h)) {
            for kick in [0.0, 0.5] {
                let span = Span::steps(h, n)
                    .event_in_time("kick", move |t, _: &Plane| t - time)
                    .jump(move |_, x: &Plane| vector![x.x, x.y + kick]);
                let run = method.clone().run(system, start, span).expect("it runs");
                let exact =
                    turned(turned(start, time) + vector![0.0, kick], run.last().time - time);
                let off = (run.last().point - exact).norm();
                // A kick changes the length of the state by at most a half, and the phase of its errors, which cancel in
                // some turns. A state that stands still is off by one.
                let most = (20.0 * plain).min(1e-3).max(4.0 * plain) + 1e-14 * n as f64;
                assert!(off <= most, "{name}: h = {h}, {kick} at {time:e}: {off:e} for {plain:e}");
                assert_eq!(run.events().len(), 1, "{name}: h = {h} at {time:e}");
            }
        }
    }
}

#[test]
fn a_kick_beside_a_time_of_the_grid_does_not_stop_the_motion() {
    let system = oscillator(1.0);
    for method in Any::all(WeylMidpoint) {
        is_kicked(&format!("{method:?}"), &method, &system);
    }
    is_kicked("mean value", &Scheme::new(WeylMidpoint).gradient(MeanValue), &system);
    is_kicked("Itoh, Abe", &Scheme::new(WeylMidpoint).gradient(SymmetricItohAbe), &system);
}

#[test]
fn a_corner_beside_a_time_of_the_grid_does_not_stop_the_motion() {
    // Nothing changes at the corners.
    let system = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy_in_time(|t: Real, x: &Vector2<Real>| (x.norm_squared() + t * 0.0) * 0.5)
        .build()
        .expect("it is a system");
    macro_rules! each {
        ($($method:expr),*) => {$({
            let (h, n, start) = (0.1, 20, vector![1.0, 0.0]);
            let end = |corners: &[f64]| {
                let span = Span::steps(h, n).corners(corners.iter().copied());
                let run = $method.run(&system, system.start(start), span).expect("it runs");
                let shortest = run.certificate().smallest_step;
                assert!(shortest > 0.0 && shortest <= h, "{shortest:e}");
                let off = (run.last().point.x - turned(start, run.last().time)).norm();
                (off, shortest)
            };
            let (plain, _) = end(&[]);
            for time in (1..n).flat_map(|k| beside(k, h)) {
                let (off, _) = end(&[time]);
                assert!(off <= 2.0 * plain + 1e-13, "{}: {time:e}: {off:e}", stringify!($method));
            }
            // The certificate knows the parts of a step.
            let (_, shortest) = end(&[0.53]);
            assert!((shortest - 0.03).abs() < 1e-12, "{shortest:e}");
        })*};
    }
    each!(WeylMidpoint, Gauss::<4>, DormandPrince8);
}

#[test]
fn a_jump_is_a_part_of_a_step_in_the_certificate() {
    let system = oscillator(1.0);
    let span = Span::steps(0.1, 20)
        .event_in_time("kick", |t, _: &Plane| t - 0.53)
        .jump(|_, x: &Plane| vector![x.x, x.y + 0.5]);
    let run = DormandPrince8.run(&system, vector![1.0, 0.0], span).expect("it runs");
    let shortest = run.certificate().smallest_step;
    assert!((shortest - 0.03).abs() < 1e-9, "{shortest:e}");
}

#[test]
fn rates_whose_squares_are_no_numbers_are_rates() {
    let (one, start) = (oscillator(1.0), vector![1.0, 0.0]);
    for w in [1e-250, 1e-200, 1e-160, 1e160, 1e200, 1e290] {
        let scaled = oscillator(w);
        for method in Any::all(WeylMidpoint) {
            let run = |system, h| method.run(system, start, Span::steps(h, 40));
            let expected = run(&one, 0.025).expect("it runs");
            let run = run(&scaled, 0.025 / w)
                .unwrap_or_else(|error| panic!("{w:e}, {method:?}: {error}"));
            let off = (run.last().point - expected.last().point).norm();
            assert!(off < 1e-13, "{w:e}, {method:?}: {off:e}");
            assert!(run.certificate().keeps_energy(), "{w:e}, {method:?}");
        }
    }
}

#[test]
fn a_lattice_that_comes_to_rest_is_followed_by_every_tolerance() {
    // Cells that exchange their energies by differences: u = ū ± δ e^{−2t} for two of them.
    let cells = |n: usize| {
        Lattice::on(Graph::chain(n), Euclidean::<1>)
            .energy(|u: &Vector1<Real>| u.x)
            .entropy(|u: &Vector1<Real>| u.x.ln())
            .bond_onsager(|bond| {
                let [u, v] = bond.x.map(|u| u.x);
                [Onsager { rate: u * v, b: [vector![1.0], vector![-1.0]] }]
            })
            .build()
            .expect("it is a lattice")
    };
    for (n, end, tolerance) in
        [(2, 6.0, 1e-7), (2, 400.0, 1e-7), (2, 40.0, 1e-8), (20, 1000.0, 1e-7)]
    {
        let lattice = cells(n);
        let start: Vec<_> = (0..n).map(|i| vector![1.0 + f64::from(u8::from(i == 0))]).collect();
        let mean = 1.0 + (n as f64).recip();
        let run = RungeKuttaChebyshev
            .run(&lattice, start.into(), Span::until(end).tolerance(tolerance))
            .unwrap_or_else(|error| panic!("{n}, {tolerance:e}: {error}"));
        let rest = if n == 2 { 0.5 * (-2.0 * end).exp() } else { 0.0 };
        let off = (run.last().point[0].x - mean - rest).abs();
        assert!(off < tolerance, "{n}, {tolerance:e}: {off:e}");
        assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
        println!("{n}, {tolerance:e}: {} steps, {off:e}", run.certificate().steps);
    }
}

#[test]
fn a_ramp_from_rest_asks_for_its_corner() {
    let system = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy_in_time(|t: Real, x: &Vector2<Real>| {
            let ramp = if t.re > 1.0 { t - 1.0 } else { Real::from(0.0) };
            x.y * x.y * 0.5 - x.x * ramp
        })
        .build()
        .expect("it is a system");
    let run = |corners: &[f64]| {
        let span = Span::until(3.0).tolerance(1e-8).corners(corners.iter().copied());
        let run =
            DormandPrince8.run(&system, system.start(vector![0.0, 0.0]), span).expect("it runs");
        let off = (run.last().point.x - vector![4.0 / 3.0, 2.0]).norm();
        (off, run.certificate().rejected, run.certificate().to_string())
    };
    let (off, rejected, text) = run(&[]);
    println!("{rejected} rejected, off by {off:e}");
    assert!(off < 1e-6, "{off:e}");
    assert!(rejected < 8 || text.contains("`.corners([..])`"), "{text}");
    let (off, rejected, text) = run(&[1.0]);
    assert!(off < 1e-13 && rejected < 8 && !text.contains("`.corners([..])`"), "{off:e}, {text}");
}

#[test]
fn a_run_back_in_time_is_refused_with_what_leads_back() {
    let system = oscillator(1.0);
    let spans = [Span::steps(-0.1, 10).into(), Schedule::from(Span::until(-1.0))];
    for span in spans {
        let error =
            DormandPrince8.run(&system, vector![1.0, 0.0], span).expect_err("it is refused");
        assert!(error.to_string().contains("`.backward()` leads back"), "{error}");
    }
    let forward =
        Explicit::Order8.run(&system, vector![1.0, 0.0], Span::steps(0.1, 10)).expect("it runs");
    let back = Explicit::Order8.run(&oscillator(-1.0), forward.last().point, Span::steps(0.1, 10));
    let off = (back.expect("it runs").last().point - vector![1.0, 0.0]).norm();
    assert!(off < 1e-13, "{off:e}");
}
