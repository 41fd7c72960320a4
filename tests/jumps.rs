//! Events that change the state: walls, kicks and switches, with their work and heat.

use std::f64::consts::PI;

use metriplectic::integrators::{Jump, JumpError, Jumping, Schedule};
use metriplectic::prelude::*;

type Plane = Vector2<f64>;

/// `H = (q² + p²)/2`.
fn oscillator() -> impl Metriplectic<Manifold = Euclidean<2>, Metric = Canonical> {
    System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5)
        .build()
        .expect("it is a system")
}

/// A wall at `q = −1/2` that gives back the fraction `e` of the momentum.
fn wall(span: impl Watch, e: f64) -> Jumping {
    span.event("wall", |x: &Plane| x.x + 0.5)
        .falling()
        .jump(move |_, x: &Plane| vector![x.x, -e * x.y])
}

/// The state at `t` between elastic walls, from `q = 1`: it meets the wall at `2π/3`, and again after each `4π/3`.
fn between_walls(t: f64) -> Plane {
    let period = 4.0 * PI / 3.0;
    let phase = (t + 0.5 * period).rem_euclid(period) - 0.5 * period;
    vector![phase.cos(), -phase.sin()]
}

fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let logs = points.iter().map(|(h, e)| (h.ln(), e.ln()));
    let [sx, sy, sxx, sxy] = logs
        .fold([0.0; 4], |[sx, sy, sxx, sxy], (x, y)| [sx + x, sy + y, sxx + x * x, sxy + x * y]);
    (n * sxy - sx * sy) / (n * sxx - sx * sx)
}

#[test]
fn an_elastic_wall_keeps_the_energy_and_the_order_of_every_method() {
    let system = oscillator();
    let end = 11.0;
    macro_rules! order {
        ($($method:expr, $counts:expr, $expected:expr);*) => {$({
            let points: Vec<(f64, f64)> = $counts.iter().map(|&count| {
                let h = end / f64::from(count);
                let span = wall(Span::steps(h, count as usize), 1.0);
                let run = $method.run(&system, vector![1.0, 0.0], span).unwrap();
                assert!(run.certificate().keeps_energy(), "{}", run.certificate());
                assert_eq!(run.states().len(), count as usize + 1);
                assert_eq!(run.last().time.to_bits(), end.to_bits());
                assert_eq!(run.certificate().jumps[0].count, 3);
                assert!(run.certificate().jumps[0].work.abs() == 0.0);
                (h, (run.last().point - between_walls(end)).norm())
            }).collect();
            let order = slope(&points);
            println!("{}: {order}, {points:?}", stringify!($method));
            assert!((order - $expected).abs() < 0.5, "{order}");
        })*};
    }
    order!(
        WeylMidpoint, [100_i32, 200, 400, 800], 2.0;
        Gauss::<2>, [20_i32, 40, 80, 160], 4.0;
        Gauss::<3>, [16_i32, 24, 36, 54], 6.0;
        DormandPrince5, [40_i32, 80, 160, 320], 5.3;
        // Of the output between its steps.
        DormandPrince8, [12_i32, 18, 27, 40], 7.0
    );
    macro_rules! tolerance {
        ($($method:expr, $tolerance:expr);*) => {$({
            let span = wall(Span::until(end).tolerance($tolerance), 1.0);
            let run = $method.run(&system, vector![1.0, 0.0], span).unwrap();
            let off = (run.last().point - between_walls(end)).norm();
            println!("{}: {off:e}", stringify!($method));
            assert!(off < 100.0 * $tolerance, "{off:e}");
            // The time of an event is the end of a step, and the next one starts after the jump.
            for event in run.events() {
                let Jump { after, .. } = event.jump.as_ref().unwrap();
                assert_eq!(after.time.to_bits(), event.state.time.to_bits());
                assert_eq!(after.point, vector![event.state.point.x, -event.state.point.y]);
                assert!(run.iter().any(|state| state == after));
            }
            assert!(run.certificate().keeps_energy());
        })*};
    }
    tolerance!(
        WeylMidpoint, 1e-5;
        Gauss::<2>, 1e-8;
        DormandPrince5, 1e-8;
        DormandPrince8, 1e-10
    );
}

/// A ball with the heat `U` of a body: `H = p²/2 + q + U`, `S = ln U`, with drag that warms it.
macro_rules! ball {
    () => {
        System::on(Product(Euclidean::<2>, Euclidean::<1>))
            .bracket((Symplectic, Zero))
            .energy(|(x, u): &(Vector2<Real>, Vector1<Real>)| x.y * x.y * 0.5 + x.x + u.x)
            .entropy(|(_, u): &(Vector2<Real>, Vector1<Real>)| u.x.ln())
            .dissipation(FieldDissipation(
                |_: &(Vector2<Real>, Vector1<Real>), w: &Vector3<Real>| {
                    let b = Vector3::new(0.0.into(), w.z, -w.y);
                    b * b.transpose() * (w.z.recip() * 0.02)
                },
            ))
    };
}

fn ball() -> impl Metriplectic<Manifold = Product<Euclidean<2>, Euclidean<1>>, Metric = Canonical> {
    ball!().build().expect("it is a system")
}

type Ball = (Vector2<f64>, Vector1<f64>);

#[test]
fn what_a_jump_changes_is_work_or_heat() {
    let system = ball();
    let start = (vector![1.0, 0.0], vector![2.0]);
    macro_rules! balances {
        ($($method:expr, $tolerance:expr);*) => {$(
            for adaptive in [false, true] {
                let schedule = |bounce: fn(f64, &Ball) -> Ball| -> Jumping {
                    let of = |x: &Ball| x.0.x;
                    if adaptive {
                        Span::until(4.0).tolerance($tolerance).event("floor", of).falling().jump(bounce)
                    } else {
                        Span::steps(0.05, 80).event("floor", of).falling().jump(bounce)
                    }
                };
                let energy = |x: &Ball| x.0.y * x.0.y * 0.5 + x.0.x + x.1.x;
                // Half of the momentum is lost: work.
                let lossy = schedule(|_, (x, u)| (vector![x.x, -0.5 * x.y], *u));
                let run = $method.run(&system, start, lossy).unwrap();
                let certificate = run.certificate();
                println!("{certificate}");
                assert!(certificate.keeps_energy() && certificate.keeps_entropy());
                let jumps = &certificate.jumps[0];
                assert!(jumps.count > 1 && jumps.work < -0.5 && jumps.heat == 0.0);
                let change = energy(&run.last().point) - energy(&start);
                assert!((change - jumps.work).abs() < 1e-14, "{change} {}", jumps.work);
                let each: f64 =
                    run.events().iter().map(|event| event.jump.as_ref().unwrap().exchange.work).sum();
                assert!((each - jumps.work).abs() < 1e-15);
                // The same as heat of a floor.
                let warm = schedule(|_, (x, u)| (vector![x.x, -0.5 * x.y], *u)).heat_at(0.5);
                let run = $method.run(&system, start, warm).unwrap();
                let certificate = run.certificate();
                assert!(certificate.keeps_energy() && certificate.keeps_entropy());
                let jumps = &certificate.jumps[0];
                assert!(jumps.work == 0.0 && jumps.heat < -0.5 && jumps.least_rise > 0.0);
                let of_the_floor = -jumps.heat / 0.5;
                let gained = run.last().entropy - 2.0_f64.ln() + of_the_floor;
                assert!((certificate.entropy_gained - gained).abs() < 1e-14);
                // What is lost warms the ball: no exchange, and its entropy rises.
                let inside = schedule(|_, (x, u)| {
                    let lost = 0.375 * x.y * x.y;
                    (vector![x.x, -0.5 * x.y], vector![u.x + lost])
                });
                let run = $method.run(&system, start, inside).unwrap();
                let jumps = &run.certificate().jumps[0];
                assert!(jumps.work.abs() < 1e-14 && jumps.least_rise > 1e-3);
                assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
            }
        )*};
    }
    // At the tolerance of the others those of order 2 would take most of the time.
    balances!(
        WeylMidpoint, 1e-4;
        Gauss::<2>, 1e-6;
        Radau::<2>, 1e-6;
        DormandPrince5, 1e-6;
        DormandPrince8, 1e-6;
        RungeKuttaChebyshev, 1e-4
    );
}

#[test]
fn an_open_system_has_the_jumps_in_its_ledger() {
    // A clock: a weight that is kicked whenever it falls through the middle, in air.
    let clock = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5)
        .bath(
            "air",
            Bath::at(0.7).friction(|_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                [Contact { rate: 0.1.into(), along: vector![0.0.into(), 1.0.into()] }]
            }),
        )
        .build()
        .unwrap();
    macro_rules! kicked {
        ($($method:expr, $tolerance:expr);*) => {$(
            let span = Span::until(40.0)
                .tolerance($tolerance)
                .event("kick", |s: &OpenState<Plane>| s.x.x)
                .falling()
                .jump(|_, s: &OpenState<Plane>| s.at(vector![s.x.x, s.x.y - 0.25]));
            let run = $method.run(&clock, clock.start(vector![1.0, 0.0]), span).unwrap();
            let certificate = run.certificate();
            println!("{certificate}");
            assert!(certificate.keeps_energy() && certificate.keeps_entropy());
            let state = &run.last().point;
            let [work, heat] = [state.ledger.event_work(), state.ledger.heat("air").unwrap()];
            assert!(certificate.jumps[0].count > 5 && work > 1.0 && heat < -1.0);
            let change = clock.energy_at(state) - 0.5;
            assert!((change - work - heat).abs() < 1e-14, "{change} {work} {heat}");
            assert!((run.last().energy - 0.5).abs() < 1e-14);
            let sum: f64 =
                run.events().iter().map(|event| event.jump.as_ref().unwrap().exchange.work).sum();
            assert!((sum - work).abs() < 1e-14);
        )*};
    }
    // At the tolerance of the others those of order 2 would take most of the time.
    kicked!(
        WeylMidpoint, 1e-4;
        Gauss::<2>, 1e-6;
        Radau::<2>, 1e-6;
        DormandPrince5, 1e-6;
        DormandPrince8, 1e-6;
        RungeKuttaChebyshev, 1e-4
    );
}

#[test]
fn a_switch_goes_on_to_the_other_side() {
    // A room is heated from 0.4 on below and until 0.6 above: the rate r is a coordinate of its own.
    let room = System::on(Euclidean::<2>)
        .bracket(Zero)
        .energy(|x: &Vector2<Real>| x.x)
        .work("heater", |_: Real, x: &Vector2<Real>| vector![x.y, 0.0.into()])
        .build()
        .unwrap();
    let span = Span::until(10.0)
        .tolerance(1e-9)
        .event("cold", |s: &OpenState<Plane>| s.x.x - 0.4)
        .falling()
        .jump(|_, s: &OpenState<Plane>| s.at(vector![s.x.x, 0.5]))
        .event("warm", |s: &OpenState<Plane>| s.x.x - 0.6)
        .rising()
        .jump(|_, s: &OpenState<Plane>| s.at(vector![s.x.x, -0.1]));
    let run = DormandPrince8.run(&room, room.start(vector![0.5, -0.1]), span).unwrap();
    let times: Vec<f64> = run.events().iter().map(|event| event.state.time).collect();
    println!("{times:?}");
    // Down in 1, up in 0.4, down in 2, up in 0.4, …
    for (time, exact) in times.iter().zip([1.0, 1.4, 3.4, 3.8, 5.8, 6.2, 8.2, 8.6]) {
        assert!((time - exact).abs() < 1e-12, "{times:?}");
    }
    assert_eq!(times.len(), 8);
    // A switch whose function stays on its later side is met once in a passage.
    let system = oscillator();
    let span = Span::until(20.0)
        .tolerance(1e-9)
        .event("gate", |x: &Plane| x.x)
        .falling()
        .jump(|_, x: &Plane| vector![x.x, 1.01 * x.y]);
    let run = DormandPrince8.run(&system, vector![1.0, 0.0], span).unwrap();
    assert_eq!(run.events().len(), 3);
    assert!((run.last().energy - 0.5 * 1.01_f64.powi(6)).abs() < 1e-12);
}

#[test]
fn two_walls_in_one_corner_both_act() {
    let particle = System::on(Euclidean::<4>)
        .bracket(Symplectic)
        .energy(|x: &Vector4<Real>| (x.z * x.z + x.w * x.w) * 0.5)
        .build()
        .unwrap();
    type Four = Vector4<f64>;
    for h in [0.3, 0.25] {
        let span = Span::steps(h, 12)
            .event("left", |x: &Four| x.x)
            .falling()
            .jump(|_, x: &Four| Four::new(x.x, x.y, -x.z, x.w))
            .event("floor", |x: &Four| x.y)
            .falling()
            .jump(|_, x: &Four| Four::new(x.x, x.y, x.z, -x.w));
        let run = WeylMidpoint.run(&particle, Four::new(1.0, 1.0, -1.0, -1.0), span).unwrap();
        assert_eq!(run.events().len(), 2);
        let t = 12.0 * h;
        let exact = Four::new(t - 1.0, t - 1.0, 1.0, 1.0);
        assert!((run.last().point - exact).norm() < 1e-13, "{}", run.last().point);
    }
}

#[test]
fn outputs_lie_on_both_sides_of_a_jump() {
    let system = oscillator();
    let span = wall(Span::until(11.0).tolerance(1e-11).output_every(0.1), 1.0);
    let run = DormandPrince8.run(&system, vector![1.0, 0.0], span).unwrap();
    assert_eq!(run.states().len(), 111);
    for state in &run {
        let off = (state.point - between_walls(state.time)).norm();
        assert!(off < 1e-8, "{off:e} at {}", state.time);
        assert!((state.energy - 0.5).abs() < 1e-15);
    }
    let mut steps = DormandPrince8
        .steps(&system, vector![1.0, 0.0], wall(Span::until(11.0).tolerance(1e-11), 1.0))
        .unwrap();
    while let Some(state) = steps.next() {
        let (time, point) = {
            let state = state.unwrap();
            (state.time, state.point)
        };
        assert!((point - between_walls(time)).norm() < 1e-8 || steps.take_events().len() == 1);
        assert_eq!(steps.at(time).unwrap().point, point);
    }
}

#[test]
fn a_run_that_is_resumed_jumps_as_before() {
    let closed = ball();
    let open = ball!()
        .bath(
            "air",
            Bath::at(0.7).friction(
                |_: Real, _: &(Vector2<Real>, Vector1<Real>), _: &Vector3<Real>| {
                    [Contact { rate: 0.1.into(), along: Vector3::y() }]
                },
            ),
        )
        .build()
        .unwrap();
    let start = (vector![1.0, 0.0], vector![2.0]);
    macro_rules! resumed {
        ($system:expr, $start:expr, $point:ty, $x:ident => $floor:expr, $bounce:expr; $($method:expr, $tolerance:expr);*) => {$(
            for fixed in [true, false] {
                let schedule = || -> Jumping {
                    let of = |$x: &$point| $floor;
                    let bounce = |_: f64, $x: &$point| $bounce;
                    if fixed {
                        Span::steps(0.1, 80).event("floor", of).falling().jump(bounce).heat_at(0.5)
                    } else {
                        let span = Span::until(8.0).tolerance($tolerance);
                        span.event("floor", of).falling().jump(bounce).heat_at(0.5)
                    }
                };
                let whole = $method.run(&$system, $start, schedule()).unwrap();
                assert!(whole.events().len() > 2);
                let mut steps = $method.steps(&$system, $start, schedule()).unwrap();
                let (mut count, mut after_a_jump) = (0, 0);
                while let Some(state) = steps.next() {
                    state.unwrap();
                    count += 1;
                    let jumped = !steps.take_events().is_empty();
                    after_a_jump += usize::from(jumped);
                    // Right after a jump, and at some other steps.
                    if jumped || count % 17 == 0 {
                        let checkpoint = metriplectic_studies::checkpoints::reread(&steps.checkpoint());
                        let resumed = $method.resume(&$system, &checkpoint).unwrap();
                        let resumed = resumed.watching(schedule()).unwrap().run().unwrap();
                        assert_eq!(resumed.last(), whole.last());
                        assert_eq!(resumed.certificate(), whole.certificate());
                    }
                }
                assert!(after_a_jump > 2);
            }
        )*};
    }
    resumed!(
        closed, start, Ball, x => x.0.x, (vector![x.0.x, -0.8 * x.0.y], x.1);
        WeylMidpoint, 1e-3; Gauss::<2>, 1e-5; DormandPrince5, 1e-5
    );
    resumed!(
        open, open.start(start), OpenState<Ball>, s => s.x.0.x, s.at((vector![s.x.0.x, -0.8 * s.x.0.y], s.x.1));
        Gauss::<2>, 1e-5; DormandPrince8, 1e-5
    );
}

#[test]
fn jumps_that_no_model_has_are_refused() {
    let system = ball();
    let start = (vector![1.0, 0.0], vector![2.0]);
    let refused = |schedule: Jumping| match WeylMidpoint.run(&system, start, schedule).unwrap_err()
    {
        RunError::Step { cause: StepError::Jump { error, time, event }, trajectory } => {
            assert!((time - 2.0_f64.sqrt()).abs() < 0.05 && &*event == "floor");
            assert!(trajectory.last().time <= time);
            error
        }
        other => panic!("{other}"),
    };
    let floor = || Span::steps(0.1, 50).event("floor", |x: &Ball| x.0.x).falling();
    // What the ball loses in heat is its own.
    let cooled =
        |_: f64, x: &Ball| (vector![x.0.x, -1.1 * x.0.y], vector![x.1.x - 0.105 * x.0.y * x.0.y]);
    let error = refused(floor().jump(cooled));
    assert!(matches!(error, JumpError::LowersEntropy { fall } if fall > 0.05), "{error}");
    let run = WeylMidpoint.run(&system, start, floor().jump(cooled).may_lower_entropy()).unwrap();
    let jumps = &run.certificate().jumps[0];
    assert!(jumps.least_rise < -0.05 && jumps.work.abs() < 1e-14, "{}", run.certificate());
    // Heat from a floor: the entropy that it loses is more than the ball gains.
    let kicked = |_: f64, x: &Ball| (vector![x.0.x, -1.5 * x.0.y], x.1);
    assert!(matches!(refused(floor().jump(kicked).heat_at(1.0)), JumpError::LowersEntropy { .. }));
    WeylMidpoint.run(&system, start, floor().jump(kicked)).unwrap();
    // No value of S, and no number.
    let error = refused(floor().jump(|_, x: &Ball| (x.0, vector![-1.0])));
    assert!(matches!(error, JumpError::OutOfDomain { .. }), "{error}");
    let error = refused(floor().jump(|_, x: &Ball| (vector![f64::NAN, 0.0], x.1)));
    assert!(matches!(error, JumpError::NoPoint(_) | JumpError::OutOfDomain { .. }), "{error}");
    let schedule = floor().jump(|_, x: &Ball| *x).heat_at(-1.0);
    let error = WeylMidpoint.run(&system, start, schedule).unwrap_err();
    assert!(matches!(error, RunError::Span(SpanError::JumpTemperature { .. })), "{error}");
    let schedule = floor().jump(|_, x: &Plane| *x);
    let error = WeylMidpoint.run(&system, start, schedule).unwrap_err();
    assert!(matches!(error, RunError::Span(SpanError::EventPoint { .. })), "{error}");
    // A momentum that a wall turns round.
    let free = System::on(Euclidean::<4>)
        .bracket(Symplectic)
        .energy(|x: &Vector4<Real>| (x.z * x.z + x.w * x.w) * 0.5)
        .momentum(|x: &Vector4<Real>| x.w)
        .build()
        .unwrap();
    let span = Span::steps(0.1, 30)
        .event("wall", |x: &Vector4<f64>| x.x)
        .falling()
        .jump(|_, x: &Vector4<f64>| Vector4::new(x.x, x.y, -x.z, -x.w));
    let error = WeylMidpoint.run(&free, Vector4::new(1.0, 0.0, -1.0, -1.0), span).unwrap_err();
    let RunError::Step { cause: StepError::Jump { error, .. }, .. } = error else {
        panic!("{error}")
    };
    assert!(
        matches!(error, JumpError::BreaksInvariant { index: 0, change } if (change - 2.0).abs() < 1e-12),
        "{error}"
    );
}

#[test]
fn a_ball_that_comes_to_rest_does_not_fall_through_the_floor() {
    let ball = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.y * x.y * 0.5 + x.x)
        .build()
        .unwrap();
    // The bounces pile up at √2 (1 + e)/(1 − e).
    for (e, least) in [(0.5, 20), (0.8, 70)] {
        let end = 2.0_f64.sqrt() * (1.0 + e) / (1.0 - e);
        macro_rules! piles_up {
            ($($method:expr),*) => {$(
                for fixed in [true, false] {
                    let floor = |span: Schedule| span.event("floor", |x: &Plane| x.x).falling().jump(move |_, x: &Plane| vector![x.x, -e * x.y]);
                    let span = if fixed { floor(Span::steps(0.1, 1000).into()) } else { floor(Span::until(100.0).tolerance(1e-6).into()) };
                    match $method.run(&ball, vector![1.0, 0.0], span).unwrap_err() {
                        RunError::Step { cause: StepError::Jump { error: JumpError::PilesUp, time, .. }, trajectory } => {
                            println!("{} {e}: {time}, {} bounces", stringify!($method), trajectory.events().len());
                            assert!((time - end).abs() < 1e-6, "{time} {end}");
                            assert!(trajectory.events().len() > least);
                            assert!(trajectory.iter().all(|state| state.point.x > -1e-9));
                        }
                        other => panic!("{other}"),
                    }
                }
            )*};
        }
        piles_up!(WeylMidpoint, DormandPrince8);
    }
}
