//! Open systems: work, heat and both laws, by every method.

use metriplectic::dynamics::exchange::Exchange;
use metriplectic::integrators::open::{AtTime, InTime};
use metriplectic::prelude::*;

type Space = Product<Euclidean<2>, Euclidean<1>>;
type State = (Vector2<Real>, Vector1<Real>);

/// The constants of the driven pendulum: heat capacity, temperature and frictions of the bath, friction inside, torque and
/// its frequency, modulation of the string and its frequency.
const CAPACITY: f64 = 2.0;
const TEMPERATURE: f64 = 0.7;
const RATES: [f64; 2] = [0.08, 0.1];
const FRICTION: f64 = 0.15;
const TORQUE: [f64; 2] = [0.4, 1.3];
const STRING: [f64; 2] = [0.3, 0.9];

/// A pendulum whose string is pulled, with a torque, a bearing of the energy `U` and the entropy `C ln U`, friction inside, and
/// a bath on its momentum and on `U`. Nothing is quadratic.
#[allow(
    clippy::type_complexity,
    reason = "a type with parts that have no names cannot be given one"
)]
fn pendulum() -> OpenSystem<
    impl Metriplectic<
        Manifold = Space,
        Metric = Canonical,
        Energy = AtTime<impl Fn(Real, &State) -> Real>,
    >,
    InTime,
    impl Exchange<Space, Canonical>,
> {
    System::on(Product(Euclidean::<2>, Euclidean::<1>))
        .bracket((Symplectic, Zero))
        .energy_in_time(|t: Real, (x, u): &State| {
            x.y * x.y * 0.5 - x.x.cos() * ((t * STRING[1]).cos() * STRING[0] + 1.0)
                + u.x
                + u.x * u.x * 0.05
        })
        .entropy(|(_, u): &State| u.x.ln() * CAPACITY)
        .dissipation(FieldDissipation(|_: &State, w: &Vector3<Real>| {
            let b = Vector3::new(0.0.into(), w.z, -w.y);
            b * b.transpose() * (w.z.recip() * FRICTION)
        }))
        .work("torque", |t: Real, (x, _): &State| {
            let torque = (t * TORQUE[1]).sin() * TORQUE[0] * (x.x.cos() * 0.2 + 1.0);
            vector![0.0.into(), torque, 0.0.into()]
        })
        .bath(
            "air",
            Bath::at(TEMPERATURE).friction(|_: Real, (_, u): &State, _: &Vector3<Real>| {
                [
                    Contact { rate: RATES[0].into(), along: Vector3::y() },
                    Contact { rate: u.x * RATES[1], along: Vector3::z() },
                ]
            }),
        )
        .build()
        .expect("it is a system")
}

#[path = "../models/tables.rs"]
mod tables;
mod traps;

fn start() -> (Vector2<f64>, Vector1<f64>) {
    (vector![1.0, 0.3], vector![1.5])
}

/// The state and the ledger at the end of a run: two coordinates, the energy of the bearing, and what has flowed in.
fn numbers(state: &OpenState<(Vector2<f64>, Vector1<f64>)>) -> [f64; 7] {
    let OpenState { x: (x, u), ledger, .. } = state;
    [
        x.x,
        x.y,
        u.x,
        ledger.parameter_work(),
        ledger.work("torque").expect("a column of the ledger"),
        ledger.heat("air").expect("a column of the ledger"),
        ledger.bath_entropy("air").expect("a column of the ledger"),
    ]
}

/// The slope of `ln error` over `ln h`.
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let logs = points.iter().map(|(h, e)| (h.ln(), e.ln()));
    let [sx, sy, sxx, sxy] = logs
        .fold([0.0; 4], |[sx, sy, sxx, sxy], (x, y)| [sx + x, sy + y, sxx + x * x, sxy + x * y]);
    (n * sxy - sx * sy) / (n * sxx - sx * sx)
}

/// The errors of the state and of each entry of the ledger in runs of `counts` steps, and their orders.
macro_rules! orders {
    ($method:expr, $counts:expr, $reference:expr) => {{
        let system = pendulum();
        let mut errors: Vec<(f64, [f64; 5])> = Vec::new();
        for count in $counts {
            let h = 4.0 / f64::from(count);
            let run = $method
                .run(&system, system.start(start()), Span::steps(h, count as usize))
                .unwrap();
            let certificate = run.certificate();
            assert!(certificate.keeps_energy(), "{certificate}");
            assert!(certificate.keeps_entropy(), "{certificate}");
            assert!(certificate.min_entropy_increment > 0.0, "{certificate}");
            let found = numbers(&run.last().point);
            let off = |i: usize| (found[i] - $reference[i]).abs();
            errors.push((h, [off(0).max(off(1)).max(off(2)), off(3), off(4), off(5), off(6)]));
        }
        println!("{}: {errors:?}", stringify!($method));
        let order = |k: usize| {
            let points: Vec<(f64, f64)> = errors.iter().map(|(h, e)| (*h, e[k])).collect();
            slope(&points)
        };
        [order(0), order(1), order(2), order(3), order(4)]
    }};
}

fn reference() -> [f64; 7] {
    let system = pendulum();
    let span = Span::until(4.0).tolerance(1e-13);
    let run = DormandPrince8.run(&system, system.start(start()), span).expect("it runs");
    println!("{}", run.certificate());
    assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
    numbers(&run.last().point)
}

#[test]
fn the_state_and_every_entry_of_the_ledger_have_the_order_of_the_method() {
    let reference = reference();
    println!("reference {reference:?}");
    let within = |name: &str, orders: [f64; 5], expected: f64| {
        println!("{name}: {orders:?}");
        for order in orders {
            assert!((order - expected).abs() < 0.1, "{name}: {orders:?}");
        }
    };
    within("Weyl midpoint", orders!(WeylMidpoint, [80, 160, 320, 640], reference), 2.0);
    within("chart midpoint", orders!(ChartMidpoint, [80, 160, 320, 640], reference), 2.0);
    let mean_value =
        orders!(Scheme::new(WeylMidpoint).gradient(MeanValue), [80, 160, 320, 640], reference);
    within("mean value", mean_value, 2.0);
    within("Gauss 1", orders!(Gauss::<1>, [80, 160, 320, 640], reference), 2.0);
    within("Gauss 2", orders!(Gauss::<2>, [20, 40, 80, 160], reference), 4.0);
    within("Gauss 3", orders!(Gauss::<3>, [10, 20, 40], reference), 6.0);
    let chebyshev = orders!(RungeKuttaChebyshev, [80, 160, 320, 640], reference);
    println!("Runge-Kutta-Chebyshev {chebyshev:?}");
    within("Runge-Kutta-Chebyshev", chebyshev, 2.0);
    // The entries of explicit methods are within the error of the state.
    let five = orders!(DormandPrince5, [40, 80, 160], reference);
    let eight = orders!(DormandPrince8, [10, 20, 40], reference);
    println!("order 5: {five:?}, order 8: {eight:?}");
    assert!(five[0] > 4.8 && eight[0] > 7.5);
}

#[test]
fn a_system_without_entropy_is_isothermal() {
    // An oscillator in air relaxes to its minimum, and the bath gains what it loses.
    let oscillator = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5 + 1.0)
        .bath(
            "air",
            Bath::at(300.0).friction(|_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                [Contact { rate: 0.2.into(), along: Vector2::y() }]
            }),
        )
        .build()
        .unwrap();
    let span = Span::until(300.0).tolerance(1e-8);
    let run = DormandPrince8.run(&oscillator, oscillator.start(vector![1.0, 0.0]), span).unwrap();
    println!("{}", run.certificate());
    let state = &run.last().point;
    // A correction onto H₀ as it was written down would stall at √ε.
    assert!(state.x.norm() < 1e-10, "{}", state.x);
    let [heat, entropy] =
        [state.ledger.heat("air").unwrap(), state.ledger.bath_entropy("air").unwrap()];
    assert!((heat + 0.5).abs() < 1e-15 && (entropy - 0.5 / 300.0).abs() < 1e-17);
    assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
}

#[test]
fn resistor_and_capacitor_in_si_units() {
    // 1 MΩ, 1 nF, 5 V, 300 K: half of the battery's energy is stored, half is heat. Switched off at a corner, the
    // capacitor turns its half into heat as well.
    const R: f64 = 1e6;
    const C: f64 = 1e-9;
    const V: f64 = 5.0;
    let switched = 0.03;
    let voltage = move |t: f64| if t < switched { V } else { 0.0 };
    let circuit = System::on(Euclidean::<1>)
        .bracket(Zero)
        .energy_in_time(move |t: Real, q: &Vector1<Real>| {
            q.x * q.x * (0.5 / C) - q.x * voltage(t.re)
        })
        .bath(
            "resistor",
            Bath::at(300.0).friction(|_: Real, _: &Vector1<Real>, _: &Vector1<Real>| {
                [Contact { rate: (1.0 / R).into(), along: vector![1.0.into()] }]
            }),
        )
        .build()
        .unwrap();
    let span = Span::steps(1e-4, 600).corners([switched]);
    let run = WeylMidpoint.run(&circuit, circuit.start(vector![0.0]), span).unwrap();
    println!("{}", run.certificate());
    // What is left after 300 steps of 0.1 RC is e⁻³⁰ of the charge, and its square of the energy.
    for (state, exact) in [(&run.states()[300], -0.5 * C * V * V), (run.last(), -C * V * V)] {
        let heat = state.point.ledger.heat("resistor").unwrap();
        assert!((heat / exact - 1.0).abs() < 1e-12, "{heat:e}");
    }
    let work = run.last().point.ledger.parameter_work();
    assert!((work / (C * V * V) - 1.0).abs() < 1e-12, "{work:e}");
    assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
}

#[test]
fn a_fast_bath_is_damped_and_its_heat_is_booked() {
    // p = 1 at γh = 10³: one step of Radau leaves a thousandth, and half of p² is heat.
    let slider = System::on(Euclidean::<1>)
        .bracket(Zero)
        .energy(|p: &Vector1<Real>| p.x * p.x * 0.5)
        .bath(
            "air",
            Bath::at(2.0).friction(|_: Real, _: &Vector1<Real>, _: &Vector1<Real>| {
                [Contact { rate: 1e3.into(), along: vector![1.0.into()] }]
            }),
        )
        .build()
        .unwrap();
    let run = Radau::<2>.run(&slider, slider.start(vector![1.0]), Span::steps(1.0, 2)).unwrap();
    println!("{}", run.certificate());
    let states = run.states();
    assert!(states[1].point.x.x.abs() < 3e-3 && states[2].point.x.x.abs() < 1e-5);
    let heat = run.last().point.ledger.heat("air").unwrap();
    assert!((heat + 0.5).abs() < 1e-10, "{heat}");
    assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
    assert!(run.certificate().stages.unwrap().surplus > -1.0);
}

#[test]
fn what_several_baths_would_share_is_refused() {
    // Which of them has damped a step is not known.
    let contact = |_: Real, _: &Vector1<Real>, _: &Vector1<Real>| {
        [Contact { rate: 1e3.into(), along: vector![1.0.into()] }]
    };
    let slider = System::on(Euclidean::<1>)
        .bracket(Zero)
        .energy(|p: &Vector1<Real>| p.x * p.x * 0.5)
        .bath("one", Bath::at(2.0).friction(contact))
        .bath("two", Bath::at(0.5).friction(contact))
        .build()
        .unwrap();
    let error = Radau::<2>.run(&slider, slider.start(vector![1.0]), Span::steps(1.0, 2));
    assert!(error.unwrap_err().to_string().contains("one bath"));
}

/// `H = ½q² + ½p² + sin 3t`: the time changes the energy and moves nothing.
macro_rules! beside_a_clock {
    () => {
        System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy_in_time(|t: Real, x: &Vector2<Real>| x.norm_squared() * 0.5 + (t * 3.0).sin())
            .build()
            .unwrap()
            .erased()
    };
}

/// A spring whose stiffness jumps from 1 to 4 at this time.
const JUMP: f64 = 0.5;

macro_rules! spring {
    () => {
        System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy_in_time(|t: Real, x: &Vector2<Real>| {
                let stiffness = if t.re < JUMP { 1.0 } else { 4.0 };
                (x.y * x.y + x.x * x.x * stiffness) * 0.5
            })
            .build()
            .unwrap()
            .erased()
    };
}

/// The state of the spring at `t = 1`, from `q = 1`.
fn after_the_jump() -> Vector2<f64> {
    let [q, p, rest] = [JUMP.cos(), -JUMP.sin(), 2.0 * (1.0 - JUMP)];
    vector![q * rest.cos() + 0.5 * p * rest.sin(), p * rest.cos() - 2.0 * q * rest.sin()]
}

#[test]
fn work_of_the_time_moves_no_state_near_rest() {
    // The quadrature of ∂_tH alone is off by O(h^{2s+1}), which a correction along a tiny velocity turns into a motion.
    let system = beside_a_clock!();
    let x0 = 1e-4;
    let exact = |t: f64| vector![x0 * t.cos(), -x0 * t.sin()];
    macro_rules! near {
        ($method:expr, $h:expr, $steps:expr, $bound:expr) => {{
            let span = Span::steps($h, $steps);
            let run = $method.run(&system, system.start(vector![x0, 0.0]), span).unwrap();
            let off = (run.last().point.x - exact(run.last().time)).norm();
            println!("{}: {off:e}", stringify!($method));
            assert!(off < $bound * x0, "{off:e}");
            assert!(run.certificate().keeps_energy(), "{}", run.certificate());
            let work = run.last().point.ledger.parameter_work();
            assert!((work - (3.0 * run.last().time).sin()).abs() < 1e-15);
        }};
    }
    near!(Gauss::<2>, 0.1, 1, 1e-6);
    near!(Gauss::<2>, 0.1, 10, 1e-6);
    near!(DormandPrince5, 0.1, 10, 1e-7);
    near!(DormandPrince8, 0.1, 10, 1e-11);
    near!(WeylMidpoint, 0.01, 100, 1e-4);
    near!(RungeKuttaChebyshev, 0.01, 100, 1e-3);
}

#[test]
fn the_clock_is_no_coordinate() {
    let system = pendulum();
    macro_rules! agree {
        ($($method:expr),*) => {$(
            let run = $method
                .run(&system, system.start(start()), Span::until(4.0).tolerance(1e-5))
                .unwrap();
            for state in &run {
                assert_eq!(state.time.to_bits(), state.point.time.to_bits());
            }
            let fixed =
                $method.run(&system, system.start(start()), Span::steps(0.03, 100)).unwrap();
            for state in &fixed {
                assert_eq!(state.time.to_bits(), state.point.time.to_bits());
            }
        )*};
    }
    agree!(WeylMidpoint, Gauss::<2>, DormandPrince5, DormandPrince8);
}

#[test]
fn a_protocol_that_jumps_has_corners() {
    let system = spring!();
    let x0 = || system.start(vector![1.0, 0.0]);
    let off =
        |run: &Trajectory<OpenSpace<Euclidean<2>>>| (run.last().point.x - after_the_jump()).norm();
    let work = 1.5 * JUMP.cos().powi(2);
    macro_rules! with_corners {
        ($($method:expr, $steps:expr, $bound:expr);*) => {$(
            // On the grid of the steps, and inside a step.
            for steps in [$steps, $steps + 3] {
                let span = Span::steps(1.0 / f64::from(steps), steps as usize).corners([JUMP]);
                let run = $method.run(&system, x0(), span).unwrap();
                println!("{} {steps}: {:e}", stringify!($method), off(&run));
                assert!(off(&run) < $bound, "{:e}", off(&run));
                let booked = run.last().point.ledger.parameter_work();
                assert!((booked - work).abs() < 10.0 * $bound, "{booked}");
                assert!(run.certificate().keeps_energy(), "{}", run.certificate());
            }
            let span = Span::until(1.0).tolerance(1e-9).corners([JUMP]);
            let run = $method.run(&system, x0(), span).unwrap();
            assert!(off(&run) < 1e-7, "{:e}", off(&run));
        )*};
    }
    with_corners!(
        WeylMidpoint, 100_u32, 1e-4;
        Gauss::<2>, 10_u32, 1e-5;
        DormandPrince5, 10_u32, 1e-6;
        DormandPrince8, 10_u32, 1e-10
    );
    // Without corners, steps of one size end in an error that names the remedy, and others become small.
    let error = DormandPrince5.run(&system, x0(), Span::steps(0.3, 5)).unwrap_err();
    assert!(
        matches!(error, RunError::Step { cause: StepError::ProtocolJumps { .. }, .. }),
        "{error}"
    );
    assert!(error.to_string().contains(".corners("));
    let run = DormandPrince5.run(&system, x0(), Span::until(1.0).tolerance(1e-8)).unwrap();
    assert!(off(&run) < 1e-6, "{:e}", off(&run));
}

#[test]
fn a_sampled_control_has_corners_of_its_own() {
    // u = k held over 0.1, on a free particle: p = Σ u.
    let particle = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.y * x.y * 0.5)
        .work("control", |t: Real, _: &Vector2<Real>| {
            let sample = (t.re * 10.0).floor();
            vector![0.0.into(), Real::from(sample)]
        })
        .build()
        .unwrap();
    let span = Span::until(1.0).tolerance(1e-8).sampled(0.1);
    let run = DormandPrince8.run(&particle, particle.start(vector![0.0, 0.0]), span).unwrap();
    assert!((run.last().point.x.y - 4.5).abs() < 1e-12, "{}", run.last().point.x);
    assert!(run.certificate().keeps_energy());
}

#[test]
fn what_flows_through_takes_no_digits_of_the_balance() {
    // A motor that works against friction for a long time: the entries grow, the balance does not.
    let system = pendulum();
    macro_rules! long {
        ($method:expr, $h:expr) => {{
            let span = Span::steps($h, 20_000).every(1000);
            let run = $method.run(&system, system.start(start()), span).unwrap();
            println!("{}", run.certificate());
            assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
            let ledger = &run.last().point.ledger;
            let throughput = ledger.heat("air").unwrap().abs();
            assert!(throughput > 10.0, "{throughput}");
            // All in one sum, and each entry in its own.
            let entries = [
                ledger.parameter_work(),
                ledger.work("torque").unwrap(),
                ledger.heat("air").unwrap(),
            ];
            let apart = entries.iter().sum::<f64>() - ledger.net();
            assert!(apart.abs() <= 2.0 * f64::EPSILON * throughput, "{apart:e}");
            assert!(run.certificate().max_energy_error < 2e-14);
        }};
    }
    long!(WeylMidpoint, 0.1);
    long!(Gauss::<2>, 0.2);
    long!(DormandPrince5, 0.1);
    long!(DormandPrince8, 0.2);
}

#[test]
fn a_run_that_starts_late_keeps_the_balance() {
    let system = pendulum();
    for time in [2000.0, 1e6] {
        macro_rules! late {
            ($($method:expr),*) => {$(
                let span = Span::steps(0.1, 1000).starting_at(time);
                let run = $method.run(&system, system.start(start()), span).unwrap();
                // At t = 10⁶ the energy in time has 10⁻¹⁰ of its rate as round-off, and a step of Gauss compares its
                // values with an integral.
                let certificate = run.certificate();
                let kept = certificate.keeps_energy() || time > 1e5;
                assert!(kept && certificate.max_energy_error < 1e-12, "{certificate}");
                assert!(certificate.keeps_entropy(), "{certificate}");
            )*};
        }
        late!(WeylMidpoint, Gauss::<2>, DormandPrince5, DormandPrince8);
    }
}

#[test]
fn a_state_at_rest_leaves_when_its_drive_begins() {
    // A spring at its minimum whose end is pulled from t = 1 on.
    let spring = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy_in_time(|t: Real, x: &Vector2<Real>| {
            let pulled = if t.re > 1.0 { t - 1.0 } else { t * 0.0 };
            let stretched = x.x - pulled;
            (x.y * x.y + stretched * stretched) * 0.5
        })
        .build()
        .unwrap()
        .erased();
    // q = (t − 1) − sin(t − 1).
    let exact = 2.0 - 2.0_f64.sin();
    macro_rules! leaves {
        ($($method:expr, $bound:expr);*) => {$(
            let span = Span::steps(0.05, 60).corners([1.0]);
            let run = $method.run(&spring, spring.start(vector![0.0, 0.0]), span).unwrap();
            let q = run.last().point.x.x;
            println!("{}: {:e}", stringify!($method), q - exact);
            assert!((q - exact).abs() < $bound, "{q} {exact}");
            assert!(run.certificate().keeps_energy(), "{}", run.certificate());
            assert!(run.states()[19].point.x.norm() == 0.0);
        )*};
    }
    leaves!(
        WeylMidpoint, 1e-3;
        Gauss::<2>, 1e-6;
        Gauss::<3>, 1e-8;
        DormandPrince5, 1e-8;
        DormandPrince8, 1e-11
    );
}

#[test]
fn a_bath_whose_temperature_changes_books_its_entropy_stage_by_stage() {
    // Heat at a constant rate into a bath at T = 1 + t/2: S_b = ∫ Q'/T.
    let slider = System::on(Euclidean::<1>)
        .bracket(Zero)
        .energy(|p: &Vector1<Real>| p.x)
        .bath(
            "air",
            Bath::in_time(|t: Real| t * 0.5 + 1.0).friction(
                |_: Real, _: &Vector1<Real>, _: &Vector1<Real>| {
                    [Contact { rate: 1.0.into(), along: vector![1.0.into()] }]
                },
            ),
        )
        .build()
        .unwrap();
    let exact = 2.0 * 1.5_f64.ln();
    macro_rules! books {
        ($($method:expr, $bound:expr);*) => {$(
            let run =
                $method.run(&slider, slider.start(vector![5.0]), Span::steps(0.1, 10)).unwrap();
            let entropy = run.last().point.ledger.bath_entropy("air").unwrap();
            println!("{}: {:e}", stringify!($method), entropy - exact);
            assert!((entropy - exact).abs() < $bound, "{entropy} {exact}");
        )*};
    }
    books!(WeylMidpoint, 1e-3; Gauss::<2>, 1e-7; DormandPrince5, 1e-9; DormandPrince8, 1e-13);
}

#[test]
fn outputs_events_and_checkpoints_have_the_ledger() {
    let system = pendulum();
    let end = 8.0;
    macro_rules! whole {
        ($($method:expr, $bound:expr);*) => {$(
            let span = Span::until(end).tolerance(1e-7).output_every(0.1);
            let run = $method.run(&system, system.start(start()), span.clone()).unwrap();
            let h0 = run.certificate().initial_energy;
            for state in &run {
                let change = system.energy_at(&state.point) - h0;
                let OpenState { ledger, .. } = &state.point;
                let flowed = ledger.parameter_work()
                    + ledger.work("torque").unwrap()
                    + ledger.heat("air").unwrap();
                assert!((change - flowed).abs() < 1e-14, "{change} {flowed}");
            }
            assert!(run.states().windows(2).all(|pair| pair[1].entropy >= pair[0].entropy));
            // At t = 4 as a run that ends there.
            let middle = $method
                .run(&system, system.start(start()), Span::until(0.5 * end).tolerance(1e-9))
                .unwrap();
            let [a, b] = [&run.states()[40].point, &middle.last().point].map(numbers);
            for (a, b) in a.iter().zip(b) {
                assert!((a - b).abs() < $bound, "{}: {a} {b}", stringify!($method));
            }
            // An event of the ledger.
            let spent = Span::until(end).tolerance(1e-7).event(
                "spent",
                |s: &OpenState<(Vector2<f64>, Vector1<f64>)>| s.ledger.heat("air").unwrap() + 0.15,
            );
            let run = $method.run(&system, system.start(start()), spent.stop()).unwrap();
            assert!(run.ending().is_event());
            assert!((run.last().point.ledger.heat("air").unwrap() + 0.15).abs() < 1e-14);
            // Bit for bit.
            let span = Span::until(end).tolerance(1e-6);
            let whole = $method.run(&system, system.start(start()), span).unwrap();
            let mut steps = $method.steps(&system, system.start(start()), span).unwrap();
            for _ in 0..10 {
                steps.advance().unwrap();
            }
            let checkpoint = metriplectic_studies::checkpoints::reread(&steps.checkpoint());
            let resumed = $method.resume(&system, &checkpoint).unwrap().run().unwrap();
            assert_eq!(resumed.last(), whole.last());
            assert_eq!(resumed.certificate(), whole.certificate());
        )*};
    }
    whole!(WeylMidpoint, 1e-3; Gauss::<2>, 1e-5; DormandPrince5, 1e-6; DormandPrince8, 1e-6);
    tables::are_those_of_the_run(&system, || {
        let span = Span::until(end).tolerance(1e-6);
        Ok(DormandPrince8.run(&system, system.start(start()), span)?)
    });
}

#[test]
fn surroundings_that_break_a_law_are_refused() {
    type Pair = (Vector2<Real>, Vector1<Real>);
    let builder = || {
        System::on(Product(Euclidean::<2>, Euclidean::<1>))
            .bracket((Symplectic, Zero))
            .energy(|(x, s): &Pair| x.norm_squared() * 0.5 + s.x)
            .entropy(|(_, s): &Pair| s.x)
    };
    let start = || (vector![1.0, 0.0], vector![0.0]);
    let along = |x: f64, s: f64| Vector3::new(0.0.into(), Real::from(x), Real::from(s));
    let span = Span::steps(0.1, 20);

    let pushes = builder().work("push", move |_: Real, _: &Pair| along(0.1, 0.1)).build().unwrap();
    let error = WeylMidpoint.run(&pushes, pushes.start(start()), span).unwrap_err();
    assert!(matches!(error, RunError::Model(ModelError::WorkCarriesEntropy { .. })), "{error}");
    assert!(error.to_string().contains("push"));
    // On the way, and not at the start.
    let later = builder()
        .work("push", move |t: Real, _: &Pair| along(0.1, if t.re > 0.55 { 0.1 } else { 0.0 }))
        .build()
        .unwrap();
    for error in [
        WeylMidpoint.run(&later, later.start(start()), span).unwrap_err(),
        Gauss::<2>.run(&later, later.start(start()), span).unwrap_err(),
        DormandPrince5.run(&later, later.start(start()), span).unwrap_err(),
    ] {
        let RunError::Step { cause: StepError::Model { time, law }, .. } = error else {
            panic!("{error}")
        };
        assert!(matches!(*law, ModelError::WorkCarriesEntropy { .. }));
        assert!((time - 0.6).abs() < 1e-12, "{time}");
    }

    let contact = |rate: f64| {
        move |_: Real, _: &Pair, _: &Vector3<Real>| {
            [Contact { rate: rate.into(), along: Vector3::y() }]
        }
    };
    let negative = builder().bath("air", Bath::at(1.0).friction(contact(-0.1))).build().unwrap();
    let error = DormandPrince8.run(&negative, negative.start(start()), span).unwrap_err();
    assert!(matches!(error, RunError::Model(ModelError::FrictionNotPositive { .. })), "{error}");
    let cold = builder().bath("air", Bath::at(-1.0).friction(contact(0.1))).build().unwrap();
    let error = DormandPrince8.run(&cold, cold.start(start()), span).unwrap_err();
    assert!(matches!(error, RunError::Model(ModelError::BathNotPositive { .. })), "{error}");
    let nan = builder()
        .bath("air", Bath::in_time(|t: Real| (-t + 0.5).sqrt()).friction(contact(0.1)))
        .build()
        .unwrap();
    let error = WeylMidpoint.run(&nan, nan.start(start()), span).unwrap_err();
    assert!(matches!(error, RunError::Step { .. }), "{error}");

    // A torque that is no rotation about p changes |p|².
    let body = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x * p.x + p.y * p.y * 0.5 + p.z * p.z * 0.2)
        .casimir(|p: &Vector3<Real>| p.norm_squared())
        .work("jet", |_: Real, _: &Vector3<Real>| Vector3::x())
        .build()
        .unwrap();
    let error = WeylMidpoint.run(&body, body.start(vector![1.0, 0.2, 0.1]), span).unwrap_err();
    assert!(matches!(error, RunError::Model(ModelError::PortBreaksInvariant { .. })), "{error}");

    // No rest, and no damping of a system with an entropy of its own.
    let pushed = builder().bath("air", Bath::at(1.0).friction(contact(0.1))).build().unwrap();
    let error =
        WeylMidpoint.run(&pushed, pushed.start(start()), span.until_rest(1e-3)).unwrap_err();
    assert!(matches!(error, RunError::Span(SpanError::NoRestInTime)), "{error}");
    let error = Radau::<2>.run(&pushed, pushed.start(start()), span).unwrap_err();
    assert!(error.to_string().contains("Gauss"), "{error}");
}

#[test]
fn an_energy_that_loses_its_time_is_refused() {
    let lost = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy_in_time(|t: Real, x: &Vector2<Real>| {
            (x.y * x.y + x.x * x.x * (t.re * 0.7).exp()) * 0.5
        })
        .build()
        .unwrap();
    for time in [0.0, 1e3, 1e-9] {
        let span = Span::steps(0.01, 10).starting_at(time);
        let error = WeylMidpoint.run(&lost, lost.start(vector![1.0, 0.0]), span).unwrap_err();
        assert!(matches!(error, RunError::Model(ModelError::LostTimeDerivative { .. })), "{error}");
    }
}

#[test]
fn a_bath_at_zero_is_plain_damping() {
    let oscillator = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5)
        .bath(
            "damper",
            Bath::at(0.0).friction(|_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                [Contact { rate: 0.2.into(), along: Vector2::y() }]
            }),
        )
        .build()
        .unwrap();
    let run =
        Gauss::<2>.run(&oscillator, oscillator.start(vector![1.0, 0.0]), Span::steps(0.1, 100));
    let run = run.unwrap();
    assert!(run.certificate().keeps_energy());
    assert!(run.certificate().to_string().contains("not promised"), "{}", run.certificate());
    // x'' + 0.2 x' + x = 0.
    let (rate, omega) = (0.1, 0.99_f64.sqrt());
    let exact =
        (-rate * 10.0_f64).exp() * ((omega * 10.0).cos() + rate / omega * (omega * 10.0).sin());
    assert!((run.last().point.x.x - exact).abs() < 1e-6);
}

#[test]
fn units_that_are_powers_of_two_give_the_same_bits() {
    // Lengths, times and energies in other units.
    let run = |[length, time, energy]: [f64; 3], method: usize| {
        let mass = energy * time * time / (length * length);
        let stiffness = energy / (length * length);
        let system = System::on(Euclidean::<2>)
            .bracket(
                Poisson::constant(matrix![0.0, 1.0; -1.0, 0.0] * (length / (energy * time)))
                    .unwrap(),
            )
            .metric(
                Metric::constant(Matrix2::from_diagonal(&vector![length.powi(-2), 1.0])).unwrap(),
            )
            .energy_in_time(move |t: Real, x: &Vector2<Real>| {
                let swing = (t * (0.5 / time)).cos() * 0.25 + 1.0;
                // The second entry is the momentum over the unit of an action per length.
                let p = x.y * (energy * time / length);
                p * p * (0.5 / mass) + x.x * x.x * swing * (0.5 * stiffness)
            })
            .bath(
                "air",
                Bath::at(0.5 * energy).friction(
                    move |_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                        let rate = 0.25 / (energy * time);
                        [Contact { rate: rate.into(), along: Vector2::y() }]
                    },
                ),
            )
            .build()
            .unwrap();
        let start = system.start(vector![length, 0.0]);
        let numbers = |run: Trajectory<OpenSpace<Euclidean<2>>>| {
            let state = run.last().clone();
            let OpenState { x, ledger, .. } = &state.point;
            [
                x.x / length,
                x.y,
                ledger.parameter_work() / energy,
                ledger.heat("air").unwrap() / energy,
                ledger.bath_entropy("air").unwrap(),
            ]
            .map(f64::to_bits)
        };
        let span = Span::steps(0.125 * time, 40);
        let end = Span::until(5.0 * time).tolerance(1e-6);
        match method {
            0 => numbers(WeylMidpoint.run(&system, start, span).unwrap()),
            1 => numbers(Gauss::<2>.run(&system, start, span).unwrap()),
            2 => numbers(DormandPrince5.run(&system, start, end).unwrap()),
            _ => numbers(DormandPrince8.run(&system, start, end).unwrap()),
        }
    };
    for method in 0..4 {
        let one = run([1.0; 3], method);
        for units in [[-30, 0, 0], [0, 20, 0], [0, 0, -60], [-33, -17, -70]] {
            let units = units.map(|exponent| 2_f64.powi(exponent));
            let other = run(units, method);
            if method > 0 {
                assert_eq!(other, one, "method {method} in units of {units:?}");
            }
            // The inverse that the midpoint scheme learns has a norm without units, with or without surroundings.
            for (a, b) in
                other.into_iter().zip(one).map(|(a, b)| (f64::from_bits(a), f64::from_bits(b)))
            {
                assert!((a - b).abs() < 1e-13, "{a} {b}");
            }
        }
    }
}

#[test]
fn curved_spaces_are_driven_as_flat_ones() {
    // A spin in a field that turns, and a body with a torque: both laws, and the orders.
    let spin = System::on(Sphere::<2>::round())
        .bracket(AreaForm)
        .energy_in_time(|t: Real, n: &Vector3<Real>| {
            n.z * n.z * -0.5 - n.x * t.cos() - n.y * t.sin() * 0.7
        })
        .bath("lattice", Bath::at(0.3).isotropic(0.2))
        .build()
        .unwrap();
    let start = Vector3::new(0.48, 0.6, 0.64);
    let at = |n: &OpenState<Vector3<f64>>| n.x;
    let fine = DormandPrince8.run(&spin, spin.start(start), Span::until(2.0).tolerance(1e-13));
    let exact = at(&fine.unwrap().last().point);
    macro_rules! order {
        ($method:expr, $counts:expr, $expected:expr) => {{
            let points: Vec<(f64, f64)> = $counts
                .iter()
                .map(|&count| {
                    let h = 2.0 / f64::from(count);
                    let span = Span::steps(h, count as usize);
                    let run = $method.run(&spin, spin.start(start), span).unwrap();
                    assert!(run.certificate().keeps_energy(), "{}", run.certificate());
                    assert!(run.certificate().keeps_entropy(), "{}", run.certificate());
                    (h, (at(&run.last().point) - exact).norm())
                })
                .collect();
            let order = slope(&points);
            println!("{} on S²: {order}, {points:?}", stringify!($method));
            // The projection may add to the order of an explicit method.
            let above = order - f64::from($expected);
            assert!((-0.25..0.6).contains(&above), "{order}");
        }};
    }
    order!(WeylMidpoint, [40, 80, 160, 320], 2);
    order!(Projection, [40, 80, 160, 320], 2);
    order!(Gauss::<2>, [20, 40, 80], 4);
    order!(Gauss::<3>, [10, 20, 40], 6);
    order!(Radau::<2>, [40, 80, 160], 3);
    order!(DormandPrince5, [40, 80, 160], 5);
    order!(DormandPrince8, [4, 8, 16], 8);
}
