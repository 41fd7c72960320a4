//! Traps of open systems. Each cure was removed once, and these tests failed:
//!
//! | what was changed | tests that failed |
//! |---|---|
//! | the clock is what steps add up, not the time that is recorded | `the_clock_is_no_coordinate`, `a_protocol_that_jumps_has_corners` |
//! | work of the time is a quadrature, not frozen | `work_of_the_time_moves_no_state_near_rest`, `a_protocol_that_jumps_has_corners` and ten more |
//! | work of a midpoint step is that at its start alone | `the_state_and_every_entry_of_the_ledger_have_the_order_of_the_method` and eight more |
//! | a step that is held, or a corner, books no work | `the_time_works_on_a_state_that_no_force_moves`, `a_protocol_that_jumps_has_corners` |
//! | a midpoint step at rest books nothing | `what_flows_through_a_state_at_rest_is_booked`, `the_time_works_on_a_state_that_no_force_moves` |
//! | the balance is kept by the sums of the entries, not by one | `what_flows_through_takes_no_digits_of_the_balance` |
//! | what `Radau` damps is not booked | `a_fast_bath_is_damped_and_its_heat_is_booked`, `curved_spaces_are_driven_as_flat_ones` |
//! | the entropy of a bath is `−Q/T` in the middle of a step | `a_bath_whose_temperature_changes_books_its_entropy_stage_by_stage` |
//! | jumps of a protocol are not looked for | `a_protocol_that_jumps_has_corners` |

use metriplectic::prelude::*;

use super::{State, slope, start};

/// A weight that a motor pulls through air at its final speed `F/γ`, which no step changes.
macro_rules! pulled_weight {
    () => {
        System::on(Euclidean::<2>)
            .bracket(Zero)
            .energy(|x: &Vector2<Real>| x.y * x.y * 0.5)
            .work("motor", |_: Real, _: &Vector2<Real>| vector![0.0.into(), 0.25.into()])
            .bath(
                "air",
                Bath::at(0.5).friction(|_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                    [Contact { rate: 0.125.into(), along: Vector2::y() }]
                }),
            )
            .build()
            .unwrap()
    };
}

#[test]
fn what_flows_through_a_state_at_rest_is_booked() {
    // p = F/γ = 2: the power F p = 1/2 goes in and out again, and the air gains the entropy t.
    let weight = pulled_weight!();
    macro_rules! flows {
        ($($method:expr),*) => {$(
            for fixed in [true, false] {
                let start = weight.start(vector![1.0, 2.0]);
                let run = if fixed {
                    $method.run(&weight, start, Span::steps(0.25, 40))
                } else {
                    $method.run(&weight, start, Span::until(10.0).tolerance(1e-6))
                };
                let run = run.unwrap();
                let OpenState { x, ledger, .. } = &run.last().point;
                assert_eq!(*x, vector![1.0, 2.0]);
                let entries = [
                    ledger.work("motor").unwrap() - 5.0,
                    ledger.heat("air").unwrap() + 5.0,
                    ledger.bath_entropy("air").unwrap() - 10.0,
                ];
                println!("{}: {entries:?}", stringify!($method));
                assert!(entries.iter().all(|off| off.abs() < 1e-13), "{entries:?}");
                assert!((run.certificate().entropy_gained - 10.0).abs() < 1e-13);
                assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
            }
        )*};
    }
    flows!(WeylMidpoint, Gauss::<2>, Radau::<2>, DormandPrince8, RungeKuttaChebyshev);
}

#[test]
fn the_time_works_on_a_state_that_no_force_moves() {
    // A pendulum at its minimum: the state stays and the work is sin 3t, while steps are held.
    let still = System::on(Product(Euclidean::<2>, Euclidean::<1>))
        .bracket((Symplectic, Zero))
        .energy_in_time(|t: Real, (x, u): &State| {
            (x.x * x.x * (t.sin() + 1.5) + x.y * x.y) * 0.5 + u.x + (t * 3.0).sin()
        })
        .entropy(|(_, u): &State| u.x.ln())
        .dissipation(FieldDissipation(|_: &State, w: &Vector3<Real>| {
            let b = Vector3::new(0.0.into(), w.z, -w.y);
            b * b.transpose() * (w.z.recip() * 0.15)
        }))
        .build()
        .unwrap();
    macro_rules! works {
        ($($method:expr),*) => {$(
            for fixed in [true, false] {
                let start = still.start((vector![0.0, 0.0], vector![0.7]));
                let run = if fixed {
                    $method.run(&still, start, Span::steps(0.01, 200))
                } else {
                    $method.run(&still, start, Span::until(2.0).tolerance(1e-6))
                };
                let run = run.unwrap();
                assert_eq!(run.last().point.x, (vector![0.0, 0.0], vector![0.7]));
                let off = run.last().point.ledger.parameter_work() - 6.0_f64.sin();
                assert!(off.abs() < 1e-14, "{}: {off:e}", stringify!($method));
                assert!(run.certificate().keeps_energy(), "{}", run.certificate());
            }
        )*};
    }
    works!(WeylMidpoint, Gauss::<2>, DormandPrince8);
}

#[test]
fn surroundings_that_do_nothing_change_no_bit() {
    // Neither the clock nor the ledger is in an equation, in a norm or in a projection.
    macro_rules! builder {
        () => {
            System::on(Product(Euclidean::<2>, Euclidean::<1>))
                .bracket((Symplectic, Zero))
                .energy(|(x, u): &State| x.y * x.y * 0.5 - x.x.cos() + u.x + u.x * u.x * 0.05)
                .entropy(|(_, u): &State| u.x.ln())
                .dissipation(FieldDissipation(|_: &State, w: &Vector3<Real>| {
                    let b = Vector3::new(0.0.into(), w.z, -w.y);
                    b * b.transpose() * (w.z.recip() * 0.15)
                }))
        };
    }
    let closed = builder!().build().unwrap();
    let open = builder!().work("nothing", |_: Real, _: &State| Vector3::zeros()).build().unwrap();
    let span = Span::steps(0.1, 60);
    let a = DormandPrince8.run(&closed, start(), span).unwrap();
    let b = DormandPrince8.run(&open, open.start(start()), span).unwrap();
    assert!(a.iter().zip(&b).all(|(a, b)| a.point == b.point.x));
    macro_rules! near {
        ($($method:expr),*) => {$(
            let a = $method.run(&closed, start(), span).unwrap();
            let b = $method.run(&open, open.start(start()), span).unwrap();
            let [a, b] = [a.last().point, b.last().point.x];
            let off = (a.0 - b.0).norm() + (a.1 - b.1).norm();
            println!("{}: {off:e}", stringify!($method));
            assert!(off < 1e-13, "{off:e}");
        )*};
    }
    near!(WeylMidpoint, Gauss::<2>);
}

/// The pendulum of the other tests whose protocol begins at a time.
macro_rules! from_a_time {
    ($zero:expr) => {{
        let zero = $zero;
        System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy_in_time(move |t: Real, x: &Vector2<Real>| {
                x.y * x.y * 0.5 - x.x.cos() * (((t - zero) * 0.9).cos() * 0.3 + 1.0)
            })
            .work("torque", move |t: Real, _: &Vector2<Real>| {
                vector![0.0.into(), ((t - zero) * 1.3).sin() * 0.4]
            })
            .bath(
                "air",
                Bath::in_time(move |t: Real| (t - zero).sin() * 0.1 + 0.7).friction(
                    |_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                        [Contact { rate: 0.08.into(), along: Vector2::y() }]
                    },
                ),
            )
            .build()
            .unwrap()
    }};
}

#[test]
fn a_shift_of_time_gives_the_same_run() {
    let shift = 2_f64.powi(20);
    let (here, later) = (from_a_time!(0.0), from_a_time!(shift));
    let numbers = |state: &OpenState<Vector2<f64>>| {
        let OpenState { x, ledger, .. } = state;
        [
            x.x,
            x.y,
            ledger.parameter_work(),
            ledger.work("torque").unwrap(),
            ledger.heat("air").unwrap(),
            ledger.bath_entropy("air").unwrap(),
        ]
    };
    macro_rules! shifted {
        ($($method:expr, $bound:expr);*) => {$(
            // Times that are sums of few powers of two are exact, and a time inside a step may be off by 2⁻³³.
            let span = Span::steps(2_f64.powi(-5), 256);
            let start = vector![1.0, 0.3];
            let a = $method.run(&here, here.start(start), span).unwrap();
            let b = $method.run(&later, later.start(start), span.starting_at(shift)).unwrap();
            for (a, b) in a.iter().zip(&b) {
                let [a, b] = [&a.point, &b.point].map(numbers);
                for (a, b) in a.iter().zip(b) {
                    assert!((a - b).abs() <= $bound, "{}: {a} {b}", stringify!($method));
                }
            }
            assert!(b.certificate().max_energy_error < 1e-12 && b.certificate().keeps_entropy());
        )*};
    }
    shifted!(
        WeylMidpoint, 0.0;
        Gauss::<2>, 1e-8;
        DormandPrince8, 1e-8
    );
}

#[test]
fn a_protocol_that_jumps_is_resolved_by_small_steps() {
    // A stiffness that jumps from 1 to 4 inside a step, without a corner: small steps of adaptive methods meet it.
    const JUMP: f64 = 0.511;
    let spring = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy_in_time(|t: Real, x: &Vector2<Real>| {
            let stiffness = if t.re < JUMP { 1.0 } else { 4.0 };
            (x.y * x.y + x.x * x.x * stiffness) * 0.5
        })
        .build()
        .unwrap()
        .erased();
    let [q, p, rest] = [JUMP.cos(), -JUMP.sin(), 2.0 * (1.0 - JUMP)];
    let exact =
        vector![q * rest.cos() + 0.5 * p * rest.sin(), p * rest.cos() - 2.0 * q * rest.sin()];
    macro_rules! resolves {
        ($($method:expr),*) => {$(
            for tolerance in [1e-3, 1e-5, 1e-7] {
                let span = Span::until(1.0).tolerance(tolerance);
                let run = $method.run(&spring, spring.start(vector![1.0, 0.0]), span).unwrap();
                let off = (run.last().point.x - exact).norm();
                println!("{} {tolerance:e}: {off:e}", stringify!($method));
                assert!(off < 100.0 * tolerance, "{off:e}");
                let work = run.last().point.ledger.parameter_work();
                assert!((work - 1.5 * q * q).abs() < 100.0 * tolerance, "{work}");
                assert!(run.certificate().keeps_energy());
            }
        )*};
    }
    resolves!(WeylMidpoint, Gauss::<2>, DormandPrince5, DormandPrince8);
    // In steps of one size from 0.1 to 10⁻³: an error without a corner, and the order of the method with it.
    macro_rules! corners {
        ($($method:expr, $bound:expr);*) => {$(
            for count in [10, 100, 1000] {
                let span = Span::steps(1.0 / f64::from(count), count as usize);
                let error = $method.run(&spring, spring.start(vector![1.0, 0.0]), span).unwrap_err();
                assert!(
                    matches!(error, RunError::Step { cause: StepError::ProtocolJumps { .. }, .. }),
                    "{error}"
                );
                let run = $method.run(&spring, spring.start(vector![1.0, 0.0]), span.corners([JUMP])).unwrap();
                let off = (run.last().point.x - exact).norm();
                println!("{} {count}: {off:e}", stringify!($method));
                assert!(off < $bound * f64::from(count).powi(-2) && run.certificate().keeps_energy());
            }
        )*};
    }
    corners!(WeylMidpoint, 1.0; Gauss::<2>, 1e-2; DormandPrince5, 1e-3; DormandPrince8, 1e-6);
}

#[test]
fn a_port_that_begins_to_carry_entropy_ends_a_run_of_any_step_size() {
    let builder = System::on(Product(Euclidean::<2>, Euclidean::<1>))
        .bracket((Symplectic, Zero))
        .energy(|(x, s): &State| x.norm_squared() * 0.5 + s.x)
        .entropy(|(_, s): &State| s.x)
        .work("push", |_: Real, (x, _): &State| {
            let carried = if x.x.re < 0.0 { 0.1 } else { 0.0 };
            vector![0.0.into(), 0.1.into(), carried.into()]
        });
    let system = builder.build().unwrap();
    macro_rules! ends {
        ($($method:expr),*) => {$(
            let span = Span::until(3.0).tolerance(1e-5);
            let start = system.start((vector![1.0, 0.0], vector![0.5]));
            match $method.run(&system, start, span).unwrap_err() {
                RunError::Step { cause: StepError::Model { law, time }, trajectory } => {
                    assert!(matches!(*law, ModelError::WorkCarriesEntropy { .. }));
                    assert!(trajectory.iter().all(|state| state.point.x.0.x >= 0.0));
                    assert!(time > 1.0 && time < 2.5, "{time}");
                }
                other => panic!("{other}"),
            }
        )*};
    }
    ends!(Gauss::<2>, DormandPrince8);
}

#[test]
fn stages_from_rest_lose_little_of_their_order() {
    // A drive that is switched on at an equilibrium: v = 0 and v' ≠ 0.
    let spring = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy_in_time(|t: Real, x: &Vector2<Real>| {
            x.y * x.y * 0.5 - x.x.cos() - x.x * t.sin() * 0.5
        })
        .build()
        .unwrap()
        .erased();
    let end = |run: &Trajectory<OpenSpace<Euclidean<2>>>| run.last().point.x;
    let fine = Span::until(2.0).tolerance(1e-13);
    let exact = end(&DormandPrince8.run(&spring, spring.start(vector![0.0, 0.0]), fine).unwrap());
    macro_rules! order {
        ($($method:expr, $counts:expr, $least:expr);*) => {$(
            let points: Vec<(f64, f64)> = $counts.iter().map(|&count| {
                let h = 2.0 / f64::from(count);
                let span = Span::steps(h, count as usize);
                let run = $method.run(&spring, spring.start(vector![0.0, 0.0]), span).unwrap();
                assert!(run.certificate().keeps_energy(), "{}", run.certificate());
                (h, (end(&run) - exact).norm())
            }).collect();
            let order = slope(&points);
            println!("{} from rest: {order}", stringify!($method));
            assert!(order > $least, "{order}");
        )*};
    }
    order!(
        Gauss::<2>, [10_i32, 20, 40, 80], 3.6;
        Gauss::<3>, [5_i32, 10, 20, 40], 5.4;
        // Its end is moved by the error of the work over |dH|, which is small near rest.
        DormandPrince5, [10_i32, 20, 40, 80], 3.8
    );
}
