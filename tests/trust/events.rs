//! Events are found where the motion is simple and where steps are long, and what happens at the time of a jump.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use metriplectic::integrators::{Schedule, SpanError};
use metriplectic::prelude::*;

type Plane = Vector2<f64>;

/// A wheel that turns at one rate, `H = w p`; a free particle, an oscillator, and a ball that falls.
#[derive(Clone, Copy, Debug)]
enum Motion {
    Wheel(f64),
    Free,
    Oscillator,
    Ball,
}

fn system(motion: Motion) -> impl Metriplectic<Manifold = Euclidean<2>, Metric = Canonical> {
    System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(move |x: &Vector2<Real>| match motion {
            Motion::Wheel(rate) => x.y * rate,
            Motion::Free => x.y * x.y * 0.5,
            Motion::Oscillator => x.norm_squared() * 0.5,
            Motion::Ball => x.y * x.y * 0.5 + x.x,
        })
        .build()
        .expect("the parts make a system")
}

/// A run by each method that follows this tolerance.
fn all(motion: Motion, x: Plane, schedule: &Schedule, least: f64) -> Vec<(&'static str, Vec<f64>)> {
    fn times<Y: Metriplectic<Manifold = Euclidean<2>>>(
        (name, method): (&'static str, impl Method<Y>),
        system: &Y,
        (x, schedule): (Plane, &Schedule),
    ) -> (&'static str, Vec<f64>) {
        let run = method.run(system, x, schedule.clone()).expect(name);
        assert!(run.certificate().unsure_events.is_empty(), "{name}: {}", run.certificate());
        (name, run.events().iter().map(|event| event.state.time).collect())
    }
    let (system, of) = (system(motion), (x, schedule));
    let mut found = vec![
        times(("Gauss", Gauss::<3>), &system, of),
        times(("Radau", Radau::<3>), &system, of),
        times(("order 5", DormandPrince5), &system, of),
        times(("order 8", DormandPrince8), &system, of),
    ];
    if least >= 1e-10 {
        found.push(times(("midpoint", Scheme::new(WeylMidpoint)), &system, of));
        found.push(times(("Chebyshev", RungeKuttaChebyshev), &system, of));
    }
    found
}

#[track_caller]
fn agree(what: &str, found: &[(&str, Vec<f64>)], expected: &[f64], allowed: f64) {
    for (name, times) in found {
        let near = times.len() == expected.len()
            && times.iter().zip(expected).all(|(time, exact)| (time - exact).abs() <= allowed);
        assert!(near, "{what}, {name}: {times:?} and not {expected:?}");
    }
}

#[test]
fn a_function_of_the_time_is_looked_at_densely() {
    // Beside a linear motion, which has one step, and at rest; in units of the time that are far from 1.
    let roots = [2.690_565_841_793_530_8, 3.592_619_465_386_055_6];
    let expected = [roots[0], roots[1], TAU + roots[0], TAU + roots[1]];
    for unit in [1.0, 1e-30, 1e30] {
        let cosine = move |t: f64, _: &Plane| (t / unit).cos() + 0.9;
        let span = Span::until(10.0 * unit).event_in_time("cosine", cosine).into();
        let expected = expected.map(|time| time * unit);
        let wheel = Motion::Wheel(1.0 / unit);
        agree("a wheel", &all(wheel, vector![0.0, 0.0], &span, 1e-6), &expected, 1e-14 * unit);
        agree("rest", &all(Motion::Free, vector![0.3, 0.0], &span, 1e-6), &expected, 1e-14 * unit);
    }
    // Steps of one size, with none of the periods beside them.
    let span = Span::steps(1.25, 8).event_in_time("t", |t, _: &Plane| (TAU * t).cos() + 0.5).into();
    let expected: Vec<f64> =
        (0..10).flat_map(|k| [1.0, 2.0].map(|third| f64::from(k) + third / 3.0)).collect();
    agree("fixed", &all(Motion::Oscillator, START, &span, 1e-6), &expected, 1e-14);
}

const START: Plane = Plane::new(1.0, 0.0);

#[test]
fn a_function_of_the_state_is_looked_at_as_often_as_it_asks() {
    let chebyshev = |x: &Plane| {
        let q = x.x - 1.05;
        ((16.0 * q * q - 20.0) * q * q + 5.0) * q
    };
    let wheel = Motion::Wheel(1.0);
    for tolerance in [1e-3, 1e-10] {
        let span = Span::until(2.1).tolerance(tolerance).event("T5", chebyshev).into();
        let angle = |k: u32| 1.05 - (PI * (f64::from(k) + 0.5) / 5.0).cos();
        let expected: Vec<f64> = (0..5).map(angle).collect();
        agree("T5", &all(wheel, vector![0.0, 0.0], &span, tolerance), &expected, 1e-14);
    }
    // The period of the looks that are taken in any case, and one that is shorter by far.
    for period in [2.0, 1.0, 0.1] {
        let cosine = move |x: &Plane| (TAU * x.x / period).cos() + 0.5;
        let span = Span::until(10.0).event("cosine", cosine).into();
        let third = |k: u32| {
            period * (f64::from(k / 2) + if k.is_multiple_of(2) { 1.0 } else { 2.0 } / 3.0)
        };
        let count = (20.0_f64 / period).round() as u32;
        let expected: Vec<f64> = (0..count).map(third).collect();
        agree("cosine", &all(wheel, vector![0.0, 0.0], &span, 1e-6), &expected, 1e-13);
    }
    // A ball is near the top of its way for a short time of its one step.
    let height = 12.5 - 1e-6;
    let span = Span::until(10.0).event("top", move |x: &Plane| x.x - height).into();
    let expected = [5.0 - 2e-6_f64.sqrt(), 5.0 + 2e-6_f64.sqrt()];
    agree("top", &all(Motion::Ball, vector![0.0, 5.0], &span, 1e-6), &expected, 1e-9);
}

#[test]
fn a_thin_detector_has_a_resolution() {
    let inside = |x: &Plane| if (x.x - 3.0).abs() < 0.05 { 1.0 } else { -1.0 };
    let wheel = Motion::Wheel(1.0);
    let plain = Span::until(10.0).event("slit", inside);
    assert!(
        all(wheel, vector![0.0, 0.0], &plain.clone().into(), 1e-6)
            .iter()
            .all(|(_, t)| t.is_empty())
    );
    let expected = [2.95, 3.05];
    for dt in [0.099, 1e-4] {
        let fine: Schedule = plain.clone().resolution(dt).into();
        agree("slit", &all(wheel, vector![0.0, 0.0], &fine, 1e-6), &expected, 1e-14);
    }
    // In any order of words, and with a jump and a stop.
    let ask = || Span::until(10.0).event("slit", inside);
    let spans: [Schedule; 4] = [
        ask().rising().resolution(0.05).into(),
        ask().resolution(0.05).rising().stop().into(),
        ask().rising().jump(|_, x: &Plane| *x).resolution(0.05).into(),
        ask().jump(|_, x: &Plane| *x).rising().resolution(0.05).into(),
    ];
    for span in spans {
        agree("in any order", &all(wheel, vector![0.0, 0.0], &span, 1e-6), &expected[..1], 1e-14);
    }
    // A function of the time, and one that asks for more by itself.
    let pulse = |t: f64, _: &Plane| if (t - 3.0).abs() < 0.05 { 1.0 } else { -1.0 };
    let span = Span::until(10.0).event_in_time("pulse", pulse).resolution(0.05).into();
    agree("pulse", &all(Motion::Oscillator, START, &span, 1e-6), &expected, 1e-13);
    let cosine = |x: &Plane| (TAU * 20.0 * x.x).cos() + 0.5;
    let span = Span::until(1.0).event("cosine", cosine).resolution(0.02).into();
    for (name, times) in all(wheel, vector![0.0, 0.0], &span, 1e-6) {
        assert_eq!(times.len(), 40, "{name}");
    }
    for dt in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-16] {
        let span = Span::until(10.0).event("slit", inside).event("no", inside).resolution(dt);
        let error = DormandPrince8.run(&system(wheel), START, span).unwrap_err();
        let refused = matches!(error, RunError::Span(SpanError::EventResolution { index: 1, .. }));
        assert!(refused, "{dt}: {error}");
    }
}

#[test]
fn all_kicks_of_a_period_are_found() {
    let kick = |t: f64, _: &Plane| (PI * (t - 0.37)).sin();
    let expected: Vec<f64> = (0..12).map(|k| f64::from(k) + 0.37).collect();
    for tolerance in [1e-3, 1e-6, 1e-8, 1e-10, 1e-12] {
        let span = Span::until(12.0)
            .tolerance(tolerance)
            .event_in_time("kick", kick)
            .jump(|_, x: &Plane| vector![x.x, x.y + 0.3 * x.x.sin()])
            .into();
        let found = all(Motion::Free, vector![0.0, 1.0], &span, tolerance);
        agree(&format!("tolerance {tolerance:.0e}"), &found, &expected, 1e-14);
    }
    // Twice and more in a step of one size, by a jump that changes nothing and by one that does.
    for h in [0.1, 1.2, 1.5, 3.0, 12.0] {
        for by in [0.0, 0.3] {
            let span = Span::steps(h, (12.0 / h).round() as usize)
                .event_in_time("kick", kick)
                .jump(move |_, x: &Plane| vector![x.x, x.y + by * x.x.sin()])
                .into();
            let found = all(Motion::Free, vector![0.0, 1.0], &span, 1e-6);
            agree(&format!("h = {h}, by {by}"), &found, &expected, 1e-14);
        }
    }
    // A thousand of them.
    let span = Span::until(1000.0).event_in_time("kick", kick).jump(|_, x: &Plane| *x);
    let run = DormandPrince8.run(&system(Motion::Free), vector![0.0, 1.0], span).expect("it runs");
    assert!(run.events().len() == 1000 && run.certificate().steps < 1100);
}

#[test]
fn looks_are_few_where_the_function_is_simple() {
    let oscillator = system(Motion::Oscillator);
    let evaluations = |in_time: bool| {
        let count = Arc::new(AtomicUsize::new(0));
        let counted = Arc::clone(&count);
        let span = Span::steps(0.05, 1000);
        let span = if in_time {
            span.event_in_time("t", move |t: f64, _: &Plane| {
                counted.fetch_add(1, Relaxed);
                t.sin() - 0.3
            })
        } else {
            span.event("x", move |x: &Plane| {
                counted.fetch_add(1, Relaxed);
                x.x - 0.3
            })
        };
        let run = DormandPrince8.run(&oscillator, START, span).expect("it runs");
        let plain = DormandPrince8.run(&oscillator, START, Span::steps(0.05, 1000)).unwrap();
        assert!(run.events().len() == 16 && run.states() == plain.states());
        count.load(Relaxed) as f64 / 1000.0
    };
    // Four looks and the end, and a function of the time ten to know it and sixteen more.
    let [of_state, of_time] = [evaluations(false), evaluations(true)];
    println!("{of_state} and {of_time} evaluations in a step");
    assert!((5.0..5.2).contains(&of_state) && (27.0..27.5).contains(&of_time));
}

#[test]
fn looks_that_do_not_agree_are_named() {
    let noise = |x: &Plane| (1e9 * x.x).sin() * 1e-16;
    let run = DormandPrince8
        .run(
            &system(Motion::Wheel(1.0)),
            vector![0.0, 0.0],
            Span::until(10.0).event("noise", noise),
        )
        .expect("it runs");
    let [unsure] = &run.certificate().unsure_events[..] else { panic!("{}", run.certificate()) };
    assert!(&*unsure.name == "noise" && unsure.steps > 0 && unsure.first < 0.1);
    let text = run.certificate().to_string();
    assert!(text.contains("noise varies faster than looks at it tell, in"), "{text}");
    // The certificate is put down and taken up.
    let read = metriplectic_studies::checkpoints::reread(run.checkpoint());
    assert_eq!(&read, run.checkpoint());
}

#[test]
fn touching_zero_changes_no_sign() {
    // The steps end at 1/2, or pass it.
    for h in [0.1, 0.125, 0.25, 0.3, 0.5] {
        let of_time = |t: f64, _: &Plane| (t - 0.5) * (t - 0.5);
        let span = Span::steps(h, 8)
            .event_in_time("below", move |t, x: &Plane| -of_time(t, x))
            .event_in_time("above", of_time)
            .event("state", |x: &Plane| (x.x - 0.5) * (x.x - 0.5))
            .event("cubic", |x: &Plane| (x.x - 0.5).powi(3))
            .into();
        agree(
            &format!("h = {h}"),
            &all(Motion::Wheel(1.0), vector![0.0, 0.0], &span, 1e-6),
            &[0.5],
            1e-5,
        );
    }
    // A function that comes to zero and stays there, at the end of a step and inside it, and one that is zero at the end of the run.
    for h in [0.1, 0.125, 0.3] {
        let span =
            Span::steps(h, 8).event_in_time("empty", |t, _: &Plane| (0.5 - t).max(0.0)).into();
        agree(
            &format!("h = {h}"),
            &all(Motion::Wheel(1.0), vector![0.0, 0.0], &span, 1e-6),
            &[0.5],
            1e-14,
        );
    }
    let span = Span::until(0.5).event_in_time("end", |t, _: &Plane| t - 0.5).into();
    agree("the end", &all(Motion::Wheel(1.0), vector![0.0, 0.0], &span, 1e-6), &[0.5], 0.0);
}

#[test]
fn what_happens_at_the_time_of_a_jump() {
    let kicked = |span: Schedule| {
        let run =
            DormandPrince8.run(&system(Motion::Free), vector![0.0, 1.0], span).expect("it runs");
        let speeds: Vec<[f64; 2]> = run.iter().map(|s| [s.time, s.point.y]).collect();
        (run, speeds)
    };
    let kick = |at: f64| move |t: f64, _: &Plane| t - at;
    let up = |_: f64, x: &Plane| vector![x.x, x.y + 1.0];
    // An output at that time is the state before it, wherever steps end.
    let spans: [Schedule; 3] =
        [Span::until(1.0).into(), Span::steps(0.25, 4).into(), Span::steps(0.4, 2).into()];
    for span in spans {
        let span =
            span.output_at([0.25, 0.5, 0.75]).event_in_time("kick", kick(0.5)).jump(up).into();
        let (_, speeds) = kicked(span);
        assert_eq!(speeds[..4], [[0.0, 1.0], [0.25, 1.0], [0.5, 1.0], [0.75, 2.0]]);
    }
    // At the start it does not happen, and the certificate says so; within a rounding of the start too.
    for (start, at) in [(0.0, 0.0), (0.3, 0.1 + 0.2), (0.1 + 0.2, 0.3)] {
        let span = Span::until(1.0).event_in_time("kick", kick(at)).jump(up).starting_at(start);
        let (run, speeds) = kicked(span);
        assert!(run.events().is_empty() && speeds.last().unwrap()[1] == 1.0);
        assert_eq!(run.certificate().events_at_start, ["kick"]);
        assert!(run.certificate().to_string().contains("kick is zero at the start"));
        let span = Span::until(1.0).event_in_time("seen", kick(at)).starting_at(start);
        assert!(kicked(span).0.certificate().events_at_start.is_empty());
    }
    // A stop comes first, in any order.
    let ask = || Span::until(1.0);
    let orders: [Schedule; 2] = [
        ask()
            .event_in_time("stop", kick(0.5))
            .stop()
            .event_in_time("kick", kick(0.5))
            .jump(up)
            .into(),
        ask()
            .event_in_time("kick", kick(0.5))
            .jump(up)
            .event_in_time("stop", kick(0.5))
            .stop()
            .into(),
    ];
    for span in orders {
        let (run, speeds) = kicked(span);
        assert!(run.ending().is_event() && speeds.last() == Some(&[0.5, 1.0]));
        let names: Vec<&str> = run.events().iter().map(|event| &*event.name).collect();
        assert_eq!(names, ["stop"]);
    }
    // Two jumps come in the order of the list.
    let twice = |_: f64, x: &Plane| vector![x.x, 2.0 * x.y];
    let first =
        ask().event_in_time("a", kick(0.5)).jump(up).event_in_time("b", kick(0.5)).jump(twice);
    assert_eq!(kicked(first.into()).1.last().unwrap()[1], 4.0);
    let first =
        ask().event_in_time("b", kick(0.5)).jump(twice).event_in_time("a", kick(0.5)).jump(up);
    assert_eq!(kicked(first.into()).1.last().unwrap()[1], 3.0);
}

#[test]
fn an_interval_ends_where_the_run_ends() {
    let times = |span: Schedule| -> Vec<f64> {
        let run = DormandPrince8.run(&system(Motion::Oscillator), START, span).expect("it runs");
        run.iter().map(|state| state.time).collect()
    };
    assert_eq!(times(Span::until(0.9).output_every(0.3)), [0.0, 0.3, 0.6, 0.9]);
    assert_eq!(times(Span::steps(0.1, 9).output_every(0.3)), [0.0, 0.3, 0.6, 0.9]);
    // The words come in any order.
    let expected = [2.0, 2.3, 2.6, 2.9];
    assert_eq!(times(Span::until(2.9).output_every(0.3).starting_at(2.0)), expected);
    assert_eq!(times(Span::until(2.9).starting_at(2.0).output_every(0.3)), expected);
    let at = |t: f64, _: &Plane| t - 2.5;
    let span = Span::steps(0.1, 9).event_in_time("at", at).stop().starting_at(2.0);
    assert!((times(span).last().unwrap() - 2.5).abs() < 1e-15);
    let sparse = Span::steps(0.1, 9).event_in_time("at", at).every(3).starting_at(2.0);
    assert_eq!(times(sparse).len(), 4);
    assert_eq!(times(Span::steps(0.1, 9).corners([]).at_most(4)).len(), 4);
}

#[test]
fn an_attitude_keeps_its_order_across_kicks() {
    let body = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| (p.x * p.x + p.y * p.y / 2.0 + p.z * p.z / 3.0) * 0.5)
        .build()
        .expect("a body");
    let start = vector![1.0, 0.3, 0.8];
    let spin = |t: f64, _: &Vector3<f64>| t - 1.52;
    let kick = |_: f64, p: &Vector3<f64>| vector![p.x, p.y, p.z + 0.5];
    let ask = |span: Schedule| span.event_in_time("kick", spin).jump(kick);
    let end = |schedule: Schedule| {
        let run = WeylMidpoint.run(&body, start, schedule.clone()).expect("it runs");
        let all = Attitude::along(&body, &run, Matrix3::identity()).expect("attitudes");
        // From step to step, in constant memory.
        let mut steps = WeylMidpoint.steps(&body, start, schedule).expect("it runs");
        let mut one = Attitude::start(&body, steps.state(), Matrix3::identity()).expect("a start");
        while steps.ending().is_none() {
            let next = steps.advance().expect("a step").clone();
            for event in steps.take_events() {
                one.jump(&event).expect("an event");
            }
            one.advance(&next).expect("the next step");
        }
        assert_eq!(Some(one.rotation()), all.last());
        // The momentum in space changes at the kick alone, by that of the body there; and by the error of the state inside a
        // step.
        let before = run.events()[0].state.point;
        let moved = (all[all.len() - 1] * run.last().point - start).norm();
        let off = (moved - (kick(0.0, &before) - before).norm()).abs();
        let h = run.certificate().largest_step;
        println!("h = {h}: the momentum is off by {off:.1e}, {:.1e} h³", off / h.powi(3));
        assert!(off < h.powi(3));
        all[all.len() - 1]
    };
    let exact = end(ask(Span::until(3.0).tolerance(1e-9).into()).into());
    let sizes = [60, 120, 240, 480];
    let errors = sizes.map(|n| {
        let span: Schedule = Span::steps(3.0 / f64::from(n), n as usize).into();
        (end(ask(span).into()) - exact).norm()
    });
    println!("{errors:?}");
    for pair in errors.windows(2) {
        assert!((3.5..4.5).contains(&(pair[0] / pair[1])), "{errors:?}");
    }
    assert!(errors[3] < 1e-5);
    // A kick at the end of a step, one at the time of an output, and a run that stops inside a step.
    let at = |time: f64| move |t: f64, _: &Vector3<f64>| t - time;
    let on_grid = Span::steps(0.25, 12).event_in_time("kick", at(1.5)).jump(kick).into();
    assert!((end(on_grid) - exact).norm() < 0.05);
    let schedules: [Schedule; 2] = [
        Span::steps(0.01, 300).event_in_time("end", at(1.515)).stop().into(),
        Span::steps(0.01, 160)
            .output_every(0.01)
            .event_in_time("kick", at(1.515))
            .jump(kick)
            .event_in_time("end", at(1.515))
            .stop()
            .into(),
    ];
    let ends = schedules.map(|schedule| {
        let run = WeylMidpoint.run(&body, start, schedule).expect("it runs");
        let all = Attitude::along(&body, &run, Matrix3::identity()).expect("attitudes");
        all[all.len() - 1] * run.last().point
    });
    assert!(ends.iter().all(|p| (p - start).norm() < 1e-7), "{ends:?}");
}
