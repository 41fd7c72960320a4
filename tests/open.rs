//! Open systems: work, heat and both laws, by every method.

use metriplectic::dynamics::exchange::Entries;
use metriplectic::prelude::*;

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
macro_rules! pendulum {
    () => {
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
            .unwrap()
    };
}

fn start() -> (Vector2<f64>, Vector1<f64>) {
    (vector![1.0, 0.3], vector![1.5])
}

/// The state and the ledger at the end of a run: two coordinates, the energy of the bearing, and what has flowed in.
fn numbers<E: Entries>(state: &OpenState<(Vector2<f64>, Vector1<f64>), E>) -> [f64; 7] {
    let OpenState { x: (x, u), ledger, .. } = state;
    [
        x.x,
        x.y,
        u.x,
        ledger.parameter_work(),
        ledger.work("torque").unwrap(),
        ledger.heat("air").unwrap(),
        ledger.bath_entropy("air").unwrap(),
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
        let system = pendulum!();
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
    let system = pendulum!();
    let span = Span::until(4.0).tolerance(1e-13);
    let run = DormandPrince8.run(&system, system.start(start()), span).unwrap();
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
    let mean_value = orders!(
        Scheme::new(WeylMidpoint).gradient(MeanValue::default()),
        [80, 160, 320, 640],
        reference
    );
    within("mean value", mean_value, 2.0);
    within("Gauss 1", orders!(Gauss::<1>, [80, 160, 320, 640], reference), 2.0);
    within("Gauss 2", orders!(Gauss::<2>, [20, 40, 80, 160], reference), 4.0);
    within("Gauss 3", orders!(Gauss::<3>, [10, 20, 40], reference), 6.0);
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
    assert!(state.x.norm() < 1e-12, "{}", state.x);
    let [heat, entropy] =
        [state.ledger.heat("air").unwrap(), state.ledger.bath_entropy("air").unwrap()];
    assert!((heat + 0.5).abs() < 1e-15 && (entropy - 0.5 / 300.0).abs() < 1e-17);
    assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
}

#[test]
fn resistor_and_capacitor_in_si_units() {
    // 1 MΩ, 1 nF, 5 V, 300 K: half of the battery's energy is stored, half is heat.
    const R: f64 = 1e6;
    const C: f64 = 1e-9;
    const V: f64 = 5.0;
    let circuit = System::on(Euclidean::<1>)
        .bracket(Zero)
        .energy(|q: &Vector1<Real>| q.x * q.x * (0.5 / C) - q.x * V)
        .bath(
            "resistor",
            Bath::at(300.0).friction(|_: Real, _: &Vector1<Real>, _: &Vector1<Real>| {
                [Contact { rate: (1.0 / R).into(), along: vector![1.0.into()] }]
            }),
        )
        .build()
        .unwrap();
    let run =
        WeylMidpoint.run(&circuit, circuit.start(vector![0.0]), Span::steps(1e-4, 600)).unwrap();
    println!("{}", run.certificate());
    let heat = run.last().point.ledger.heat("resistor").unwrap();
    assert!((heat / -1.25e-8 - 1.0).abs() < 1e-12, "{heat:e}");
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
