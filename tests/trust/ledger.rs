//! Work, heat and the entropy of baths: under the tolerance of a run, and with their errors in the certificate.

use metriplectic::integrators::open::Ledger;
use metriplectic::integrators::{
    Certificate, Flow, Method, OpenState, RunError, Schedule, Stepper,
};
use metriplectic::prelude::*;

type Plane = Vector2<Real>;
type State = OpenState<Vector2<f64>>;

fn contact(rate: Real) -> [Contact<Vector2<Real>>; 1] {
    [Contact { rate, along: vector![Real::from(0.0), Real::from(1.0)] }]
}

/// The entries of interest, and the certificate.
struct Booked {
    entries: [f64; 2],
    certificate: Certificate,
}

/// A run of the oscillator from (1, ½) to 10.
fn booked<F, M>(
    method: M,
    flow: &F,
    start: State,
    span: Schedule,
    read: fn(&Ledger) -> [f64; 2],
) -> Booked
where
    F: Flow,
    F::Space: metriplectic::integrators::StateSpace<Element = State>,
    M: Stepper<F> + Method<F>,
    RunError<F::Space>: std::fmt::Display,
{
    let run = method.run(flow, start, span).unwrap_or_else(|error| panic!("{error}"));
    let certificate = run.certificate().clone();
    Booked { entries: read(&run.last().point.ledger), certificate }
}

/// Compares entries with the right ones, and their errors with the estimates of the certificate, which may be ten times smaller
/// where a step does not see what happens inside.
fn judge(what: &str, right: [f64; 2], bound: f64, Booked { entries, certificate }: &Booked) {
    let off = [0, 1].map(|i| (entries[i] - right[i]).abs());
    let off = off[0].max(off[1]);
    let errors = certificate.exchange_errors.expect("an open system has estimates");
    let estimate = errors.work.max(errors.heat).max(errors.entropy);
    println!("{what}: off by {off:e}, estimated {errors:?}, {} steps", certificate.steps);
    assert!(off <= bound, "{what}: {entries:?}, {certificate}");
    assert!(estimate >= 0.1 * off, "{what}: {off:e}, {certificate}");
    assert!(certificate.to_string().contains("ledger:      estimated errors: "), "{certificate}");
}

/// A bath whose temperature oscillates or has a cold pulse, faster than the state moves. The right values are those of
/// 5,000 steps of order 8.
#[test]
fn the_entropy_of_a_bath_whose_temperature_is_faster_than_the_state_is_under_the_tolerance() {
    let right = [[1.217_525_414_1, -0.532_125_828_7], [0.743_480_945_8, -0.532_125_828_7]];
    let read: fn(&Ledger) -> [f64; 2] =
        |ledger| [ledger.bath_entropy("bath").unwrap(), ledger.heat("bath").unwrap()];
    for (has_pulse, right) in [false, true].into_iter().zip(right) {
        let temperature = move |t: Real| {
            let cold = (-((t - 3.0) / 0.05).powi(2)).exp() * 50.0;
            if has_pulse { (cold + 1.0).recip() } else { (t * 40.0).sin() * 0.9 + 1.0 }
        };
        let bath = Bath::in_time(temperature)
            .friction(|_: Real, _: &Plane, _: &Plane| contact(Real::from(0.2)));
        let system = System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Plane| x.norm_squared() * 0.5)
            .bath("bath", bath)
            .build()
            .unwrap();
        let start = || system.start(vector![1.0, 0.5]);
        let follows = |tolerance: f64| Schedule::from(Span::until(10.0).tolerance(tolerance));
        let fixed = || Schedule::from(Span::steps(0.1, 100));
        // The local errors of some hundred steps add up.
        let runs = [
            ("order 8", 1e-5, booked(DormandPrince8, &system, start(), follows(1e-8), read)),
            ("order 5", 1e-5, booked(DormandPrince5, &system, start(), follows(1e-8), read)),
            ("Gauss", 1e-5, booked(Gauss::<3>, &system, start(), follows(1e-8), read)),
            (
                "midpoint",
                1e-3,
                booked(Scheme::new(WeylMidpoint), &system, start(), follows(1e-5), read),
            ),
            ("order 8, steps of 0.1", 0.1, booked(DormandPrince8, &system, start(), fixed(), read)),
            ("Gauss, steps of 0.1", 0.1, booked(Gauss::<3>, &system, start(), fixed(), read)),
            (
                "midpoint, steps of 0.1",
                0.1,
                booked(Scheme::new(WeylMidpoint), &system, start(), fixed(), read),
            ),
        ];
        for (method, bound, run) in &runs {
            judge(&format!("{method}, {has_pulse}"), right, *bound, run);
        }
    }
}

/// Two baths, or two ports, whose sum does not see that they take turns.
#[test]
fn work_and_heat_of_parts_that_take_turns_are_under_the_tolerance_each() {
    let right = [-0.266_684_321_2, -0.265_441_507_5];
    let rate = |sign: f64| move |t: Real| ((t * 40.0).sin() * sign + 1.0) * 0.1;
    let oscillator = || {
        System::on(Euclidean::<2>).bracket(Symplectic).energy(|x: &Plane| x.norm_squared() * 0.5)
    };
    let bath = |sign: f64| {
        let rate = rate(sign);
        Bath::at(1.0).friction(move |t: Real, _: &Plane, _: &Plane| contact(rate(t)))
    };
    let baths = oscillator().bath("a", bath(1.0)).bath("b", bath(-1.0)).build().unwrap();
    let port = |sign: f64| {
        let rate = rate(sign);
        move |t: Real, x: &Plane| vector![Real::from(0.0), -x.y * rate(t)]
    };
    let ports = oscillator().work("a", port(1.0)).work("b", port(-1.0)).build().unwrap();
    let heats: fn(&Ledger) -> [f64; 2] = |l| ["a", "b"].map(|name| l.heat(name).unwrap());
    let works: fn(&Ledger) -> [f64; 2] = |l| ["a", "b"].map(|name| l.work(name).unwrap());
    let x = vector![1.0, 0.5];
    let span = || Schedule::from(Span::until(10.0).tolerance(1e-8));
    let runs = [
        ("heats, order 8", booked(DormandPrince8, &baths, baths.start(x), span(), heats)),
        ("heats, Gauss", booked(Gauss::<3>, &baths, baths.start(x), span(), heats)),
        ("works, order 8", booked(DormandPrince8, &ports, ports.start(x), span(), works)),
        ("works, Gauss", booked(Gauss::<3>, &ports, ports.start(x), span(), works)),
    ];
    for (what, run) in &runs {
        judge(what, right, 1e-7, run);
    }
}
