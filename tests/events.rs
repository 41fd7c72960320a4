//! Events: their times against closed forms, their states on the laws, their cost, and what becomes of a run.

use std::f64::consts::PI;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use metriplectic::integrators::{
    Control, DormandPrince8, Element, Flow, Promises, Refusal, Schedule, SpanError, StepEnds,
    StepStart, Taken, Watched,
};
use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Guarantee, scientific};

type Plane = Vector2<f64>;

/// `H = (q² + p²)/2`, with `x(t) = (cos t, −sin t)`.
fn oscillator() -> impl Metriplectic<Manifold = Euclidean<2>, Metric = Canonical> {
    System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5)
        .build()
        .expect("the parts make a system")
}

const START: Plane = Plane::new(1.0, 0.0);

/// A method that counts how often its dense output is evaluated.
#[derive(Clone, Debug)]
struct Counted<'a, M>(M, &'a AtomicUsize);

impl<F: Flow, M: Method<F>> Stepper<F> for Counted<'_, M> {
    type Memory = M::Memory;

    fn order(&self) -> u32 {
        self.0.order()
    }

    fn promises(&self, flow: &F) -> Promises {
        self.0.promises(flow)
    }

    fn step(
        &self,
        start: &StepStart<'_, F>,
        h: f64,
        memory: &mut M::Memory,
    ) -> Result<Taken<F>, StepError> {
        self.0.step(start, h, memory)
    }

    fn attempt(
        &self,
        start: &StepStart<'_, F>,
        h: f64,
        memory: &mut M::Memory,
    ) -> Result<Taken<F>, Refusal> {
        self.0.attempt(start, h, memory)
    }

    fn control(&self) -> Control {
        self.0.control()
    }

    fn error(
        &self,
        step: &StepEnds<'_, F>,
        memory: &M::Memory,
        norm: impl Fn(&F::Vector) -> f64,
    ) -> Option<f64> {
        self.0.error(step, memory, norm)
    }

    fn between(
        &self,
        step: &StepEnds<'_, F>,
        memory: &mut M::Memory,
        theta: f64,
    ) -> Option<Element<F>> {
        self.1.fetch_add(1, Relaxed);
        self.0.between(step, memory, theta)
    }
}

/// The times of the events, after checks of their states.
fn times<M: Method<Y> + Clone, Y: Metriplectic<Manifold = Euclidean<2>>>(
    name: &str,
    method: M,
    system: &Y,
    schedule: impl Into<Schedule>,
) -> Vec<f64> {
    let schedule = schedule.into().event("node", |x: &Plane| x.x);
    let count = AtomicUsize::new(0);
    let run = Counted(method, &count).run(system, START, schedule).expect("it runs");
    let found = run.events().len();
    let evaluations = count.load(Relaxed) as f64 / found as f64;
    let worst = run.events().iter().map(|event| event.state.point.x.abs()).fold(0.0, f64::max);
    let energy = run.events().iter().map(|event| (event.state.energy - 0.5).abs() / 0.5);
    let energy = energy.fold(0.0, f64::max);
    println!(
        "{name}: {found} events, |g| ≤ {worst:.1e}, |H − H₀| ≤ {energy:.1e} H₀, {evaluations:.1} evaluations an event"
    );
    Claim::new(Guarantee::Outputs, format!("oscillator, {found} events g = 0: |g| and H"), name)
        .against("H at the start, relative")
        .record(format!("{}, {}", scientific(worst), scientific(energy)), "1e-14, 5e-15");
    assert!(worst <= 1e-14 && energy <= 5e-15 && evaluations <= 10.0, "{name}");
    for event in run.events() {
        // The state has the later sign.
        assert!(if event.rises { event.state.point.x >= 0.0 } else { event.state.point.x <= 0.0 });
    }
    run.events().iter().map(|event| event.state.time).collect()
}

#[test]
fn events_of_an_oscillator_are_at_the_times_of_its_closed_form() {
    let system = oscillator();
    // The scheme turns by 2 atan(h/2) in a step; its dense output is off by h³/100 of that or less.
    for (h, count) in [(1e-3, 40_000_u32), (0.01, 4000), (0.1, 400), (0.3, 133), (1.0, 40)] {
        let rate = 2.0 * (0.5_f64 * h).atan() / h;
        let name = format!("midpoint, h = {h}");
        let found =
            times(&name, Scheme::new(WeylMidpoint), &system, Span::steps(h, count as usize));
        let all = (h * f64::from(count) * rate / PI + 0.5).floor();
        assert!((found.len() as f64 - all).abs() < 0.5, "h = {h}: {} events", found.len());
        for (k, time) in found.iter().enumerate() {
            let exact = (k as f64 + 0.5) * PI / rate;
            let off = (time - exact).abs();
            assert!(off < 0.02 * h.powi(3) + 4e-13, "h = {h}: {off:.1e} at {exact}");
        }
    }
    for tolerance in [1e-4, 1e-8, 1e-12] {
        let name = format!("order 8, tolerance {tolerance:.0e}");
        let span = Span::until(40.0).tolerance(tolerance);
        let found = times(&name, DormandPrince8, &system, span);
        assert_eq!(found.len(), 13);
        let off = |(k, time): (usize, &f64)| (time - (k as f64 + 0.5) * PI).abs();
        let worst = found.iter().enumerate().map(off).fold(0.0, f64::max);
        println!("   off by {worst:.1e}");
        assert!(worst < 1e3 * tolerance, "{worst:.1e}");
    }
}

/// The events of a short run from `START` in steps of 0.1, by a function of the position.
fn events(steps: usize, ask: impl Fn(Span) -> Watched) -> Vec<(String, f64)> {
    let run =
        WeylMidpoint.run(&oscillator(), START, ask(Span::steps(0.1, steps))).expect("it runs");
    run.events().iter().map(|event| (event.to_string(), event.state.time)).collect()
}

#[test]
fn directions_names_and_two_changes_in_one_step() {
    // Up at 3π/2, down at π/2 and 5π/2.
    let found = events(100, |span| {
        let node = |x: &Plane| x.x;
        span.event("up", node).rising().event("down", node).falling().event("both", node)
    });
    let names: Vec<_> = found.iter().map(|(text, _)| text.split(" at").next().unwrap()).collect();
    let expected =
        ["down falls", "both falls", "up rises", "both rises", "down falls", "both falls"];
    assert_eq!(names, expected);
    assert!(found.iter().map(|(_, t)| t).is_sorted());
    // The speed −p = sin t passes 0.9999 twice, 0.028 apart, within the step from 1.5 to 1.6 of the scheme.
    let found = events(20, |span| span.event("fast", |x: &Plane| -x.y - 0.9999));
    println!("{found:?}");
    assert_eq!(found.len(), 2);
    let (apart, rate) = (found[1].1 - found[0].1, 2.0 * 0.05_f64.atan() / 0.1);
    assert!((apart - 2.0 * 0.9999_f64.acos() / rate).abs() < 1e-5, "{apart}");
    // Three functions of one step in the order of their times.
    let found = events(20, |span| {
        span.event("b", |x: &Plane| x.x - 0.54).event("a", |x: &Plane| x.x - 0.55)
    });
    assert!(found[0].0.starts_with('a') && found[1].0.starts_with('b'), "{found:?}");
}

#[test]
fn an_event_that_stops_ends_the_run_there() {
    let system = oscillator();
    let until = Span::until(50.0).tolerance(1e-5);
    let span = until
        .output_every(0.5)
        .event("other", |x: &Plane| x.y)
        .event("node", |x: &Plane| x.x)
        .rising()
        .stop();
    let run = WeylMidpoint.run(&system, START, span.clone()).unwrap();
    assert_eq!(run.ending(), Ending::Event { index: 1 });
    assert!((run.last().time - 1.5 * PI).abs() < 1e-4 && run.last().point.x.abs() < 1e-15);
    assert_eq!(run.last(), &run.events().last().unwrap().state);
    assert_eq!(&*run.events().last().unwrap().name, "node");
    // 0, 0.5, …, 4.5, and the event at 4.71.
    assert_eq!(run.states().len(), 11);
    let steps = WeylMidpoint.steps(&system, START, span).unwrap();
    let yielded: Vec<_> = steps.map(Result::unwrap).collect();
    assert_eq!(yielded, run.states()[1..]);
    // Without outputs: the steps, and the event in place of the end of the last one.
    let span = Span::steps(0.1, 100).event("node", |x: &Plane| x.x).stop();
    let run = WeylMidpoint.run(&system, START, span.clone()).unwrap();
    let times: Vec<f64> = run.iter().map(|state| state.time).collect();
    assert!(
        times.len() == 17 && (times[16] - 0.5 * PI).abs() < 2e-3 && (times[15] - 1.5).abs() < 1e-15
    );
    let mut steps = WeylMidpoint.steps(&system, START, span).unwrap();
    let yielded: Vec<_> = (&mut steps).map(Result::unwrap).collect();
    assert_eq!(yielded, run.states()[1..]);
    assert!(steps.state().time > times[16] && steps.certificate() == run.certificate());
    // From the checkpoint the steps go on as if nothing had stopped them.
    let later = run.checkpoint().clone().with_steps(40).unwrap();
    let resumed = WeylMidpoint.resume(&system, &later).unwrap().run().unwrap();
    let whole = WeylMidpoint.run(&system, START, Span::steps(0.1, 40)).unwrap();
    assert_eq!(resumed.last(), whole.last());
    // A stop within the last step of a run, through a file.
    let span = Span::steps(0.1, 16).event("node", |x: &Plane| x.x).stop();
    let run = WeylMidpoint.run(&system, START, span).unwrap();
    let checkpoint = metriplectic_studies::checkpoints::reread(run.checkpoint());
    let resumed = WeylMidpoint.resume(&system, &checkpoint).unwrap();
    assert_eq!(resumed.ending(), Some(Ending::Event { index: 0 }));
    let json = serde_json::to_value(&run).unwrap();
    assert_eq!(json["events"][0]["name"], "node");
}

#[test]
fn an_event_at_the_start_does_not_fire_again() {
    let system = oscillator();
    let ask = || Span::until(7.0).event("node", |x: &Plane| x.x).stop();
    let mut x = vector![0.0, 1.0]; // exactly zero
    for _ in 0..5 {
        let run = WeylMidpoint.run(&system, x, ask()).unwrap();
        assert!(run.ending().is_event() && run.events().len() == 1);
        assert!((run.last().time - PI).abs() < 1e-4, "{}", run.last().time);
        x = run.last().point; // zero to the last digit
    }
    // Exactly zero at the ends of steps: once each.
    let found = events(100, |span| {
        span.event_in_time("tick", |t, _: &Plane| (t - 0.35).abs() - 0.25 + 0.1 * 0.5)
    });
    assert_eq!(found.len(), 2, "{found:?}");
    let found = events(100, |span| span.event("equilibrium", |_: &Plane| 0.0));
    assert!(found.is_empty(), "{found:?}");
}

#[test]
fn functions_without_a_value_are_left_out() {
    // √ of a negative number, and one that is never a number.
    let found = events(63, |span| {
        span.event("root", |x: &Plane| x.x.sqrt() - 0.5).event("none", |_: &Plane| f64::NAN)
    });
    assert_eq!(found.len(), 2, "{found:?}");
    assert!((found[0].1 - 0.25_f64.acos()).abs() < 2e-3, "{found:?}");
    // A jump, and an infinite value.
    let found = events(30, |span| {
        span.event("jump", |x: &Plane| if x.x > 0.2 { 1.0 } else { -3.0 })
            .event("pole", |x: &Plane| 1.0 / x.x)
            .event(
                "infinite",
                |x: &Plane| if x.x > 0.2 { f64::INFINITY } else { f64::NEG_INFINITY },
            )
    });
    assert_eq!(found.len(), 3, "{found:?}");
    assert!((found[0].1 - 0.2_f64.acos()).abs() < 2e-3, "{found:?}");
}

#[test]
fn a_function_of_other_points_is_an_error() {
    let span = Span::steps(0.1, 9).event("a", |x: &Plane| x.x).event("b", |x: &Vector3<f64>| x.x);
    let error = WeylMidpoint.run(&oscillator(), START, span).unwrap_err();
    assert!(matches!(error, RunError::Span(SpanError::EventPoint { index: 1, .. })), "{error}");
    let text = error.to_string();
    assert!(
        text.contains("a function of Vector3<f64>") && text.contains("are Vector2<f64>;"),
        "{text}"
    );
    println!("{error}");
}

#[test]
fn an_event_across_a_nan_where_a_run_was_put_down_is_found() {
    let system = oscillator();
    let gap = |t: f64, _: &Plane| if t > 0.35 && t < 0.65 { f64::NAN } else { t - 0.5 };
    let falls = |t: f64, _: &Plane| if t > 0.35 && t < 0.65 { f64::NAN } else { 0.5 - t };
    let span = Span::steps(0.1, 20).event_in_time("gap", gap).event_in_time("falls", falls);
    let whole = DormandPrince5.run(&system, START, span.clone()).expect("it runs");
    assert_eq!(whole.events().len(), 2);
    for put_down in 1..10 {
        let mut steps = DormandPrince5.steps(&system, START, span.clone()).expect("it runs");
        let mut seen = Vec::new();
        for _ in 0..put_down {
            steps.advance().expect("it runs");
            seen.extend(steps.take_events());
        }
        // Through a file, and put down once more before the events are said again.
        let read = metriplectic_studies::checkpoints::reread(&steps.checkpoint());
        let again = DormandPrince5.resume(&system, &read).expect("it is resumed").checkpoint();
        assert_eq!(again, read);
        let resumed = DormandPrince5.resume(&system, &again).expect("it is resumed");
        let resumed = resumed.watching(span.clone()).expect("it watches").run().expect("it runs");
        seen.extend(resumed.events().iter().cloned());
        assert_eq!(seen, whole.events(), "after {put_down} steps");
    }
}

/// The times of the events of two functions that are NaN at the end of a step, for one step and for three.
fn across_nan<M: Method<Y>, Y: Metriplectic<Manifold = Euclidean<2>>>(
    method: M,
    system: &Y,
) -> Vec<f64> {
    let nan_from = |from: f64, to: f64| {
        move |t: f64, _: &Plane| {
            if t > from && t < to { f64::NAN } else { t - 0.5 }
        }
    };
    let span = Span::steps(0.1, 20)
        .event_in_time("one end", nan_from(0.499, 0.501))
        .event_in_time("three ends", nan_from(0.35, 0.65))
        // It has risen before the NaN, and does not rise again after it.
        .event_in_time(
            "before",
            |t: f64, _: &Plane| {
                if t > 0.58 && t < 0.62 { f64::NAN } else { t - 0.55 }
            },
        );
    let run = method.run(system, START, span).expect("it runs");
    run.events().iter().map(|event| event.state.time).collect()
}

#[test]
fn an_event_across_a_nan_at_the_end_of_a_step_is_found_by_every_method() {
    let system = oscillator();
    let all = [
        ("midpoint", across_nan(Scheme::new(WeylMidpoint), &system)),
        ("Gauss", across_nan(Gauss::<2>, &system)),
        ("Radau", across_nan(Radau::<3>, &system)),
        ("order 5", across_nan(DormandPrince5, &system)),
        ("order 8", across_nan(DormandPrince8, &system)),
        ("Chebyshev", across_nan(RungeKuttaChebyshev, &system)),
    ];
    for (name, times) in all {
        println!("{name}: {times:?}");
        // The first time after the points that are left out, to the width of a bracket in a step of 0.1.
        let expected = [0.501, 0.55, 0.65];
        assert_eq!(times.len(), expected.len(), "{name}: {times:?}");
        let near = |(time, exact): (&f64, &f64)| (time - exact).abs() < 1e-14;
        assert!(times.iter().zip(&expected).all(near), "{name}: {times:?}");
    }
}

/// A run that is put down after each of its steps ends where the whole one does, with its counts.
fn counted_across_files<Y, M>(system: &Y, method: &M, span: &Schedule, n: usize)
where
    Y: Flow,
    M: Method<Y> + Clone,
    Element<Y>: Clone,
{
    let start = || system.element(&[1.0, 0.0]).expect("a point");
    let whole = method.clone().run(system, start(), span.clone()).expect("it runs");
    assert_eq!((whole.ending(), whole.count("up")), (Ending::Event { index: 1 }, Some(n)));
    for put_down in [1, 17, 40] {
        let mut steps = method.clone().steps(system, start(), span.clone()).expect("it runs");
        for _ in 0..put_down {
            steps.advance().expect("it runs");
        }
        let read = metriplectic_studies::checkpoints::reread(&steps.checkpoint());
        let resumed = method.clone().resume(system, &read).expect("it is resumed");
        let resumed = resumed.watching(span.clone()).expect("it watches").run().expect("it runs");
        assert_eq!(resumed.last(), whole.last(), "after {put_down} steps");
        assert_eq!(resumed.certificate(), whole.certificate());
        assert_eq!(resumed.checkpoint(), whole.checkpoint());
    }
}

#[test]
fn a_run_stops_at_the_nth_event_by_every_method() {
    let system = oscillator();
    let turns = 5;
    let asked = |span: Schedule| -> Schedule {
        // The others are counted up to the stop, in whatever order they were asked for.
        span.event("node", |x: &Plane| x.x)
            .event("up", |x: &Plane| x.x)
            .rising()
            .stop_after(turns)
            .event("never", |x: &Plane| x.x - 2.0)
            .into()
    };
    // It rises at 3π/2 + 2πk.
    let exact = 2.0 * PI * (turns as f64 - 0.25);
    macro_rules! stops {
        ($($method:expr, $tolerance:expr, $allowed:expr);+) => {$({
            for span in [
                asked(Span::until(100.0).tolerance($tolerance).into()),
                asked(Span::steps(0.05, 2000).into()),
            ] {
                let run = $method.run(&system, START, span.clone()).unwrap();
                assert!(run.ending() == Ending::Event { index: 1 }, "{:?}", run.ending());
                let counts = ["node", "up", "never", "other"].map(|name| run.count(name));
                assert_eq!(counts, [Some(2 * turns), Some(turns), Some(0), None]);
                let off = (run.last().time - exact).abs();
                println!("{}: off by {off:.1e}", stringify!($method));
                assert!(off < $allowed && run.events().len() == 3 * turns, "{off:.1e}");
                assert_eq!(run.last(), &run.events().last().unwrap().state);
                let text = run.certificate().to_string();
                assert!(text.contains("events:      up 5 times") && text.contains("never 0 times"), "{text}");
            }
            counted_across_files(&system, &$method, &asked(Span::steps(0.05, 2000).into()), turns);
            counted_across_files(&system, &$method, &asked(Span::until(100.0).tolerance($tolerance).into()), turns);
        })+};
    }
    // The midpoint rule is late by h²/12 of the time.
    stops!(
        Scheme::new(WeylMidpoint), 1e-6, 0.01;
        Gauss::<2>, 1e-8, 1e-4;
        Radau::<2>, 1e-8, 1e-3;
        DormandPrince5, 1e-8, 1e-5;
        DormandPrince8, 1e-8, 1e-6;
        RungeKuttaChebyshev, 1e-6, 0.1
    );
    // The first time is `stop`; several times in one step, and no times.
    let first = |span: Watched| DormandPrince8.run(&system, START, span).unwrap();
    let node = || Span::until(100.0).tolerance(1e-8).event("node", |x: &Plane| x.x);
    assert_eq!(first(node().stop_after(1)), first(node().stop()));
    let fast = |n| Span::steps(1.0, 40).event("f", |x: &Plane| (9.0 * x.x).sin()).stop_after(n);
    let all = first(Span::steps(1.0, 40).event("f", |x: &Plane| (9.0 * x.x).sin()));
    for n in [1, 2, 3, 4, 7, 20] {
        let run = first(fast(n));
        assert_eq!((run.count("f"), run.events()), (Some(n), &all.events()[..n]));
    }
    let none = DormandPrince8.run(&system, START, node().stop_after(0)).unwrap_err();
    assert!(matches!(none, RunError::Span(SpanError::StopAfterNone { index: 0 })), "{none}");
    println!("{none}");
    // From its end a run goes on to the next multiple.
    let run = first(node().stop_after(3));
    let resumed = DormandPrince8.resume(&system, &run.checkpoint().clone().with_end(99.0).unwrap());
    let resumed = resumed.unwrap().watching(node().stop_after(3)).unwrap().run().unwrap();
    assert_eq!((resumed.count("node"), resumed.events().len()), (Some(6), 3));
    assert!((resumed.last().time - 5.5 * PI).abs() < 1e-5);
}

#[test]
fn a_lattice_closed_or_open_stops_at_the_nth_event() {
    // Two oscillators without a bond, of which the second one turns as `START` does.
    let closed = || {
        Lattice::on(Graph::from_bonds(2, []), Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5)
            .build()
            .unwrap()
    };
    let exact = 2.0 * PI * 2.75;
    let span = || Span::until(100.0).tolerance(1e-9);
    let lattice = closed();
    let start = lattice.points(|i| START * i as f64);
    let asked = span().event("up", |x: &Points<Euclidean<2>>| x[1].x).rising().stop_after(3);
    let run = DormandPrince8.run(&lattice, start, asked).unwrap();
    assert_eq!(run.count("up"), Some(3));
    assert!((run.last().time - exact).abs() < 1e-6, "{}", run.last().time);
    let open = closed().opened().energy_in_time(|t, site, x: &Vector2<Real>| {
        x.x * (t * 3.0).sin() * if site == 0 { 0.1 } else { 0.0 }
    });
    let start = open.start(open.lattice().points(|i| START * i as f64));
    type Open = OpenState<Points<Euclidean<2>>>;
    let asked = span().event("up", |x: &Open| x.x[1].x).rising().stop_after(3);
    let run = DormandPrince8.run(&open, start, asked).unwrap();
    assert_eq!((run.ending(), run.count("up")), (Ending::Event { index: 0 }, Some(3)));
    assert!((run.last().time - exact).abs() < 1e-6, "{}", run.last().time);
}

#[test]
fn a_run_stops_before_the_nth_bounce() {
    // A ball falls for one unit of time, and is at the wall again after each two.
    let ball = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.y * x.y * 0.5 + x.x)
        .build()
        .unwrap();
    for span in [Schedule::from(Span::until(99.0).tolerance(1e-10)), Span::steps(0.3, 330).into()] {
        let span = span
            .event("wall", |x: &Plane| x.x)
            .falling()
            .jump(|_, x: &Plane| vector![x.x, -x.y])
            .stop_after(4);
        let run = DormandPrince8.run(&ball, vector![0.5, 0.0], span).unwrap();
        assert_eq!((run.ending(), run.count("wall")), (Ending::Event { index: 0 }, Some(4)));
        assert!((run.last().time - 7.0).abs() < 1e-8, "{}", run.last().time);
        // Three jumps, and the state before the fourth one.
        assert_eq!(run.certificate().jumps[0].count, 3);
        assert!(run.last().point.y < 0.0 && run.events()[3].jump.is_none());
    }
}
