//! States at any time of a run: they keep the laws, they are as accurate as the steps, and they change no step.

mod models;

use metriplectic::dynamics::system::Point;
use metriplectic::integrators::{
    DormandPrince5, DormandPrince8, Element, Evidence, Flow, Laws, Promises, Schedule, SpanError,
    StepStart, Taken, Vector,
};
use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Guarantee, scientific};
use models::{TUMBLING, UNSTABLE, free_body, relaxing_body};

/// The bits of a state.
fn bits<M: Manifold>(state: &State<M>) -> Vec<u64> {
    let laws = [state.time, state.energy, state.entropy];
    let numbers = M::entries(&state.point).into_iter().chain(laws).map(f64::to_bits);
    numbers.chain([state.step as u64]).collect()
}

/// A spin with a bath.
fn spin() -> impl Metriplectic<Manifold = Product<Sphere<2>, Euclidean<1>>, Metric = Canonical> {
    System::on(Product(Sphere::<2>::round(), Euclidean::<1>))
        .bracket((AreaForm, Zero))
        .energy(|(n, s): &(Vector3<Real>, Vector1<Real>)| {
            n.x.powi(2) * 0.25 - n.z + (s.x * 0.05).exp()
        })
        .entropy(|(_, s): &(Vector3<Real>, Vector1<Real>)| s.x)
        .build()
        .expect("the parts make a system")
}

const SPIN: (Vector3<f64>, Vector1<f64>) = (Vector3::new(0.48, 0.36, -0.8), Vector1::new(0.0));

fn group() -> impl Metriplectic<Manifold = Rotations> {
    System::on(Rotations::bi_invariant())
        .bracket(Nambu::default())
        .energy(|r: &Matrix3<Real>| r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5)
        .entropy(|r: &Matrix3<Real>| r.m13 - r.m21 * 0.5 + (r.m31 + r.m32).powi(2) * 0.25)
        .build()
        .expect("the parts make a system")
}

fn attitude() -> Matrix3<f64> {
    Rotations::bi_invariant().from_quaternion([0.8, 0.3, -0.4, 0.33]).expect("a quaternion")
}

/// A top with friction on se(3)*, with a Casimir.
fn heavy_top() -> impl Metriplectic<Manifold = LieDual<6>, Metric = Canonical> {
    System::on(LieDual::se3())
        .energy(|x: &Vector6<Real>| {
            let weights = [1.0, 0.5, 0.25, 0.2, 0.15, 0.1];
            (0..6).map(|i| x[i].powi(2) * weights[i]).sum()
        })
        .entropy(|x: &Vector6<Real>| (3..6).map(|i| x[i].powi(2) * 0.5).sum())
        .casimir(|x: &Vector6<Real>| (0..3).map(|i| x[i] * x[i + 3]).sum())
        .build()
        .expect("the parts make a system")
}

const TOP: Vector6<f64> = Vector6::new(0.1, 0.2, 1.0, 0.0, 0.6, 0.8);

/// Runs with twenty outputs in each step, and compares with the run that has none.
fn keeps_the_laws<Y: Metriplectic, M: Method<Y> + Clone>(
    name: &str,
    (system, x0): (&Y, &Point<Y>),
    method: M,
    schedule: impl Into<Schedule>,
    interval: f64,
) {
    let schedule = schedule.into();
    let plain = method.clone().run(system, x0.clone(), schedule.clone()).expect("it runs");
    let run = method.run(system, x0.clone(), schedule.output_every(interval)).expect("it runs");
    assert_eq!(run.certificate(), plain.certificate(), "{name}");
    assert_eq!(run.last().point, plain.last().point, "{name}");
    assert!(run.states().len() > 300, "{name}: {} states", run.states().len());
    let start = &run.states()[0];
    let laws = system.laws(x0);
    let (mut energy, mut invariants, mut fall, mut defect) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
    for pair in run.states().windows(2) {
        let [before, state] = pair else { unreachable!("windows of two") };
        assert!(state.time > before.time, "{name}");
        energy = energy.max((state.energy - start.energy).abs() / start.energy.abs());
        let here = system.laws(&state.point);
        assert_eq!((here.energy, here.entropy), (state.energy, state.entropy));
        for (a, b) in laws.invariants.as_ref().iter().zip(here.invariants.as_ref()) {
            invariants = invariants.max((a - b).abs());
        }
        let round_off = system.entropy_round_off([&before.point, &state.point]);
        fall = fall.max((before.entropy - state.entropy) / round_off);
        defect = defect.max(system.defect(&state.point));
    }
    println!(
        "{name}: {} outputs of {} steps, |H − H₀| ≤ {energy:.1e} H₀, |L − L₀| ≤ {invariants:.1e}, falls of S ≤ {fall:.2} \
         of round-off, defect {defect:.1e}",
        run.states().len(),
        run.certificate().steps
    );
    let method = match name.rsplit_once(", order ") {
        Some((_, "8")) => "DormandPrince8",
        Some((_, "5")) => "DormandPrince5",
        _ => "WeylMidpoint",
    };
    Claim::new(Guarantee::Outputs, format!("{name}, {} outputs: H", run.states().len()), method)
        .against("H at the start, relative; the run without outputs has the same bits")
        .record(scientific(energy), "5e-15");
    assert!(energy <= 5e-15, "{name}: {energy:.1e}");
    assert!(invariants <= 1e-14, "{name}: {invariants:.1e}");
    assert!(fall <= 1.0, "{name}: S falls by {fall} of its round-off");
    assert!(defect <= 1e-15, "{name}: {defect:.1e}");
}

#[test]
fn outputs_keep_the_laws_and_change_no_step() {
    let scheme = Scheme::new(WeylMidpoint);
    let (body, spin, group, top) = (relaxing_body(), spin(), group(), heavy_top());
    for (h, count) in [(0.05, 200), (0.7, 60), (2.0, 60)] {
        let span = Span::steps(h, count);
        let name = |space| format!("{space}, h = {h}");
        keeps_the_laws(&name("so(3)*"), (&body, &UNSTABLE), scheme, span, h / 20.0);
        keeps_the_laws(&name("so(3)*"), (&body, &vector![0.2, -1.0, 0.3]), scheme, span, h / 20.0);
        keeps_the_laws(&name("se(3)*"), (&top, &TOP), scheme, span, h / 20.0);
        if h < 1.0 {
            keeps_the_laws(&name("S² × R"), (&spin, &SPIN), scheme, span, h / 20.0);
            // The group is fast: steps of at most a right angle have a chart.
            let span = Span::steps(h / 5.0, count);
            keeps_the_laws(
                &name("SO(3), five times"),
                (&group, &attitude()),
                scheme,
                span,
                h / 100.0,
            );
        }
    }
    // To the rest of the body, where the entropy hardly grows.
    for tolerance in [1e-2, 1e-4] {
        let span = Span::until(400.0).tolerance(tolerance);
        keeps_the_laws("so(3)*, adaptive", (&body, &UNSTABLE), scheme, span, 0.013);
        keeps_the_laws("so(3)*, order 8", (&body, &UNSTABLE), DormandPrince8, span, 0.013);
        keeps_the_laws("so(3)*, order 5", (&body, &UNSTABLE), DormandPrince5, span, 0.013);
    }
    let span = Span::until(100.0).tolerance(1e-3);
    keeps_the_laws("se(3)*, order 8", (&top, &TOP), DormandPrince8, span, 0.013);
}

/// The largest ratio of the error inside a step to that at its end, over the first steps.
fn accuracy<Y: Metriplectic, M: Method<Y> + Clone>(
    name: &str,
    (system, x0): (&Y, &Point<Y>),
    method: M,
    (h, count): (f64, usize),
) {
    const PARTS: usize = 8;
    let fine = Span::until(h * count as f64).tolerance(1e-10).output_every(h / PARTS as f64);
    let fine = DormandPrince8.run(system, x0.clone(), fine).expect("it runs");
    let span = Span::steps(h, count).output_every(h / PARTS as f64);
    let run = method.run(system, x0.clone(), span).expect("it runs");
    assert_eq!(run.states().len(), count * PARTS + 1);
    let errors: Vec<f64> = run
        .iter()
        .zip(&fine)
        .map(|(a, b)| {
            let both =
                Y::Manifold::entries(&a.point).into_iter().zip(Y::Manifold::entries(&b.point));
            both.map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
        })
        .collect();
    let worst = errors[1..]
        .chunks(PARTS)
        .map(|step| step.iter().fold(0.0_f64, |most, e| most.max(*e)) / step[PARTS - 1])
        .fold(0.0, f64::max);
    let last = errors[errors.len() - 1];
    println!(
        "{name}, h = {h}: error at the end {last:.1e}, inside a step up to {worst:.2} times that at its end"
    );
    assert!(worst <= 50.0, "{name}, h = {h}: {worst}");
}

#[test]
fn outputs_are_as_accurate_as_the_steps() {
    let scheme = Scheme::new(WeylMidpoint);
    for h in [0.4, 0.1, 0.025] {
        accuracy("so(3)*", (&relaxing_body(), &vector![0.2, -1.0, 0.3]), scheme, (h, 20));
        accuracy("S² × R", (&spin(), &SPIN), scheme, (h, 20));
        accuracy("SO(3)", (&group(), &attitude()), scheme, (h / 5.0, 20));
        accuracy("se(3)*", (&heavy_top(), &TOP), scheme, (h, 20));
    }
}

#[test]
fn stiff_friction_keeps_the_laws_of_its_outputs() {
    // Two bodies that exchange heat a thousand times as fast as a step resolves.
    let bodies = System::on(Euclidean::<2>)
        .energy(|e: &Vector2<Real>| e.x + e.y)
        .entropy(|e: &Vector2<Real>| e.x.ln() + e.y.ln())
        .dissipation(FieldDissipation(|_: &Vector2<Real>, w: &Vector2<Real>| {
            let b = Vector2::new(w.y, -w.x);
            b * b.transpose() * Real::from(1e3)
        }))
        .build()
        .unwrap();
    let span = Span::steps(0.5, 40);
    keeps_the_laws("stiff", (&bodies, &vector![1.0, 3.0]), Scheme::new(WeylMidpoint), span, 0.025);
    // An explicit method takes these steps in many halves, and knows its stages of the last one alone.
    keeps_the_laws("stiff, order 5", (&bodies, &vector![1.0, 3.0]), DormandPrince5, span, 0.025);
}

/// Energy `1 + 3` in two bodies that exchange heat a thousand times faster than a step, which is taken in parts.
#[test]
fn the_states_inside_a_step_in_parts_are_those_of_the_motion() {
    let system = System::on(Euclidean::<2>)
        .energy(|e: &Vector2<Real>| e.x + e.y)
        .entropy(|e: &Vector2<Real>| e.x.ln() + e.y.ln())
        .dissipation(FieldDissipation(|_: &Vector2<Real>, w: &Vector2<Real>| {
            let b = vector![w.y, -w.x];
            b * b.transpose() * Real::from(1e3)
        }))
        .build()
        .unwrap();
    let span = Span::steps(0.5, 1).output_every(0.0625).event("warm", |e: &Vector2<f64>| e.x - 1.9);
    let run = DormandPrince5.run(&system, vector![1.0, 3.0], span).unwrap();
    assert!(run.certificate().effort.splits > 0);
    for state in run.iter().skip(1) {
        assert!((state.point.x - 2.0).abs() < 1e-10, "{state:?}");
    }
    // With e = 2 − d the motion is d' = −2000 d/(4 − d²).
    let exact = ((0.1_f64.ln() * -4.0) - 0.5 * (1.0 - 0.01)) / 2000.0;
    let [event] = run.events() else { panic!("{:?}", run.events()) };
    let error = (event.state.time - exact).abs();
    assert!(error < 0.5 * exact, "{} instead of {exact}", event.state.time);
}

/// The attitude and the angular momentum of a body.
type Turning = Product<Rotations, Euclidean<3>>;

/// A free body with its attitude.
fn turning(inertia: Vector3<f64>) -> impl Metriplectic<Manifold = Turning> {
    System::on(Product(Rotations::bi_invariant(), Euclidean::<3>))
        .bracket(Symplectic)
        .energy(move |(_, p): &(Matrix3<Real>, Vector3<Real>)| models::kinetic(inertia)(p))
        .build()
        .expect("the parts make a system")
}

/// A body with the spin 8 about its third axis turns by more than a right angle in a step of 0.25.
#[test]
fn a_certificate_speaks_of_the_accuracy_of_a_run_that_is_off() {
    let body = turning(vector![2.0, 2.0, 1.0]);
    let start = (Matrix3::identity(), vector![0.5, 0.0, 8.0]);
    let exact = DormandPrince8.run(&body, start, Span::until(10.0).tolerance(1e-12)).unwrap();
    let mut silent = 0;
    for (h, count) in [(2.0, 5), (0.25, 40), (0.1, 100), (0.01, 1000)] {
        let mut check = |name: &str, run: Result<Trajectory<Turning>, RunError<Turning>>| {
            let run = run.unwrap_or_else(|error| panic!("{name}: {error}"));
            let off = (run.last().point.0 - exact.last().point.0).norm();
            let (c, longest) = (run.certificate(), 8.0 * h > 0.5 * std::f64::consts::PI);
            let line =
                c.to_string().lines().find(|line| line.starts_with("accuracy:")).map(str::to_owned);
            println!("{name}, h = {h}: off by {off:.1e}, {:?}: {line:?}", c.local_error);
            assert!(line.is_some() || off < 1e-2, "{name}, h = {h}: off by {off:e}\n{c}");
            silent += usize::from(line.is_none());
            if longest && c.effort.splits > 0 {
                assert_eq!(c.local_error, Some(f64::INFINITY), "{name}, h = {h}");
            }
        };
        let span = || Span::steps(h, count).every(count);
        check("midpoint", WeylMidpoint.run(&body, start, span()));
        check("order 5", DormandPrince5.run(&body, start, span()));
        check("order 8", DormandPrince8.run(&body, start, span()));
        check("Gauss", Gauss::<4>.run(&body, start, span()));
        check("Radau", Radau::<4>.run(&body, start, span()));
    }
    // The steps of 0.01 are fine with all of them.
    assert!(silent >= 5, "{silent}");
}

/// A body that turns by 1.8 in a step, beyond its chart.
#[test]
fn the_states_inside_a_step_that_is_longer_than_a_chart_are_those_of_the_motion() {
    let body = turning(vector![1.0, 1.0, 1.0]);
    let start = (Matrix3::identity(), vector![0.0, 0.0, 1.0]);
    // sin φ = 0.98 twice in the step, and at neither of its ends.
    let (h, angle) = (1.8, 0.98_f64.asin());
    let span = Span::steps(h, 1)
        .output_every(0.45)
        .event("height", |(r, _): &(Matrix3<f64>, Vector3<f64>)| r.m21 - 0.98);
    let check = |name: &str, bound: f64, run: Result<Trajectory<Turning>, RunError<Turning>>| {
        let run = run.unwrap_or_else(|error| panic!("{name}: {error}"));
        let angles = run.iter().map(|State { time, point: (r, _), .. }| {
            (r.m11 - time.cos()).abs().max((r.m21 - time.sin()).abs())
        });
        let times = run.events().iter().zip([angle, std::f64::consts::PI - angle]);
        let times = times.map(|(event, exact)| (event.state.time - exact).abs());
        let (off, late) = (angles.fold(0.0, f64::max), times.fold(0.0, f64::max));
        println!("{name}: angles off by {off:.1e}, events by {late:.1e}");
        assert_eq!((run.states().len(), run.events().len()), (5, 2), "{name}");
        // At the events sin φ is flat: cos φ = 0.2.
        assert!(off < bound && late < 5.0 * bound, "{name}: {off:e}, {late:e}");
    };
    check("midpoint", 1e-12, WeylMidpoint.run(&body, start, span.clone()));
    check("order 5", 1e-2, DormandPrince5.run(&body, start, span.clone()));
    check("order 8", 1e-2, DormandPrince8.run(&body, start, span.clone()));
    check("Gauss", 1e-2, Gauss::<4>.run(&body, start, span.clone()));
    check("Radau", 1e-2, Radau::<4>.run(&body, start, span));
}

/// A run goes in plain numbers, its steps in types. A start beside the space makes a frame that is the identity but for rounding.
#[test]
fn a_run_on_a_curved_space_has_the_outputs_of_its_steps() {
    fn same<Y: Metriplectic>(
        name: &str,
        system: &Y,
        start: &Point<Y>,
        method: impl Method<Y> + Copy,
    ) {
        let span = Span::until(2.0).tolerance(1e-5).output_every(0.013);
        let run = method.run(system, start.clone(), span.clone()).unwrap();
        let steps = method.steps(system, start.clone(), span).unwrap();
        let yielded: Vec<_> = steps.map(|state| bits(&state.unwrap())).collect();
        assert!(yielded.len() > 150, "{name}: {}", yielded.len());
        assert_eq!(yielded, run.states()[1..].iter().map(bits).collect::<Vec<_>>(), "{name}");
    }
    let (spin, (n, heat)) = (spin(), SPIN);
    let beside = (n * (1.0 + 4e-11), heat);
    same("spin, midpoint", &spin, &beside, WeylMidpoint);
    same("spin, order 8", &spin, &beside, DormandPrince8);
    same("spin, Gauss", &spin, &beside, Gauss::<2>);
    same("rotations, midpoint", &group(), &attitude(), WeylMidpoint);
    same("rotations, order 5", &group(), &attitude(), DormandPrince5);
    same("top, midpoint", &heavy_top(), &TOP, WeylMidpoint);
    same("top, order 8", &heavy_top(), &TOP, DormandPrince8);
}

#[test]
fn the_iterator_the_trajectory_and_a_step_have_the_same_outputs() {
    let body = free_body();
    let span = Span::until(3.0).tolerance(1e-4).output_at([2.5, 0.1, 0.1, 0.0, 3.0, 1.0]);
    let run = WeylMidpoint.run(&body, TUMBLING, span.clone()).unwrap();
    let times: Vec<f64> = run.iter().map(|state| state.time).collect();
    assert_eq!(times, [0.0, 0.1, 1.0, 2.5, 3.0]);
    let steps = WeylMidpoint.steps(&body, TUMBLING, span.clone()).unwrap();
    let yielded: Vec<_> = steps.map(|state| bits(&state.unwrap())).collect();
    assert_eq!(yielded, run.states()[1..].iter().map(bits).collect::<Vec<_>>());
    let mut steps = WeylMidpoint.steps(&body, TUMBLING, span).unwrap();
    let mut seen = Vec::new();
    while steps.ending().is_none() {
        steps.advance().unwrap();
        let outputs: Vec<_> = steps.outputs().cloned().collect();
        for state in &outputs {
            let again = steps.at(state.time).unwrap();
            assert_eq!(bits(&again), bits(state));
        }
        seen.extend(outputs.iter().map(bits));
    }
    assert_eq!(seen, yielded);
    assert!(steps.at(f64::NAN).is_none() && steps.at(4.0).is_none() && steps.at(0.0).is_none());

    // A run that comes to rest ends there.
    let relaxing = relaxing_body();
    let span = Span::until(1e4).tolerance(1e-4).until_rest(1e-8).output_every(100.0);
    let run = WeylMidpoint.run(&relaxing, UNSTABLE, span).unwrap();
    let last = &run.states()[run.states().len() - 2..];
    assert!(run.ending().is_rest() && last[1].time - last[0].time < 100.0);
}

#[test]
fn times_that_are_not_of_the_run_are_errors() {
    let body = free_body();
    let refused = |schedule: Schedule| match WeylMidpoint.run(&body, TUMBLING, schedule) {
        Err(RunError::Span(error)) => error,
        other => panic!("{other:?}"),
    };
    let (span, until) = (Span::steps(0.1, 3), Span::until(1.0).starting_at(0.5));
    let error = refused(span.output_at([0.2, 0.31]));
    assert!(matches!(error, SpanError::Output { .. }), "{error}");
    // The end in another expression is the end: 3 · 0.1 > 0.3.
    let run = WeylMidpoint.run(&body, TUMBLING, Span::until(0.3).output_at([3.0 * 0.1])).unwrap();
    assert_eq!((run.states().len(), run.last().time), (2, 0.3));
    assert!(matches!(refused(until.output_at([0.2])), SpanError::Output { .. }));
    assert!(matches!(refused(until.output_at([f64::NAN])), SpanError::Output { .. }));
    for interval in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = refused(span.output_every(interval));
        assert!(matches!(error, SpanError::OutputInterval { .. }), "{error}");
    }
    // Intervals that change no time of the run: the outputs would have no end, or equal times.
    let late = Span::until(1e10 + 1e-3).starting_at(1e10);
    let early = Span::until(1e-3).starting_at(-1e10);
    for (schedule, time) in [
        (span.output_every(1e-18), 3.0_f64 * 0.1),
        (Span::until(1.0).output_every(1e-18), 1.0),
        (late.output_every(1e-7), 1e10 + 1e-3),
        (early.output_every(1e-7), -1e10),
    ] {
        let error = refused(schedule);
        let SpanError::OutputStandstill { time: found, .. } = error else { panic!("{error}") };
        assert_eq!(found.to_bits(), time.to_bits());
    }
    let endless = WeylMidpoint.steps(&body, TUMBLING, 0.1.output_every(1e-18)).map(|_| ());
    let Err(RunError::Span(error)) = endless else { panic!("{endless:?}") };
    assert!(matches!(error, SpanError::OutputStandstill { .. }), "{error}");
    // No interval is too short in itself, and outputs that differ have different times.
    let short = Span::steps(1e-30, 3).output_every(2e-31);
    assert_eq!(WeylMidpoint.run(&body, TUMBLING, short).unwrap().states().len(), 16);
    let run = WeylMidpoint.run(&body, TUMBLING, late.output_every(1e-5)).unwrap();
    assert!(run.states().len() > 90 && run.states().is_sorted_by(|a, b| a.time < b.time));
    assert_eq!(refused(span.every(2).output_at([])), SpanError::TwoRecords);
    assert_eq!(refused(span.every(2).output_every(0.1)), SpanError::TwoRecords);
    assert_eq!(refused(until.at_most(9).output_at([0.7])), SpanError::TwoRecords);
}

#[test]
fn a_run_with_outputs_at_no_time_has_its_start_and_its_end() {
    let body = free_body();
    for schedule in [Span::steps(0.1, 10).output_at([]), Span::until(1.0).output_at([])] {
        let run = WeylMidpoint.run(&body, TUMBLING, schedule.clone()).unwrap();
        let times: Vec<f64> = run.iter().map(|state| state.time).collect();
        assert_eq!(times, [0.0, 1.0]);
        let steps = WeylMidpoint.steps(&body, TUMBLING, schedule).unwrap();
        assert_eq!(steps.map(|state| state.unwrap().time).collect::<Vec<_>>(), [1.0]);
    }
    // An iterator without an end yields what was asked for, and then nothing.
    for times in [vec![], vec![0.05, 0.3]] {
        let steps = WeylMidpoint.steps(&body, TUMBLING, 0.1.output_at(times.clone())).unwrap();
        assert_eq!(steps.map(|state| state.unwrap().time).collect::<Vec<_>>(), times);
    }
}

/// The explicit midpoint rule, which keeps no law.
#[derive(Clone, Copy, Debug)]
struct ExplicitMidpoint;

impl<F: Flow> Stepper<F> for ExplicitMidpoint {
    type Memory = ();

    fn order(&self) -> u32 {
        2
    }

    fn promises(&self, _: &F) -> Promises {
        Promises::nothing()
    }

    fn step(&self, start: &StepStart<'_, F>, h: f64, (): &mut ()) -> Result<Taken<F>, StepError> {
        let flow = start.flow;
        let outside = StepError::OutOfDomain { time: start.time, h, tried: Default::default() };
        let rates = |d: &F::Vector| flow.rates(start.x, d).ok_or_else(|| outside.clone());
        let first = rates(&flow.sizes(start.x).map(|_| 0.0))?;
        let middle = rates(&first.map(|v| 0.5 * h * v))?;
        let x = flow.moved(start.x, &middle.map(|v| h * v));
        let (values, evidence) = (flow.laws(&x), Evidence::default());
        Ok(Taken { x, values, evidence, effort: Default::default() })
    }
}

/// An oscillator whose flow does not say what lies between two states.
struct Oscillator;

impl Flow for Oscillator {
    type Space = Euclidean<2>;
    type Numbers = [f64; 0];
    type Vector = Vec<f64>;

    fn laws(&self, x: &Element<Self>) -> Laws<[f64; 0]> {
        Laws { energy: 0.5 * x.norm_squared(), entropy: 0.0, invariants: [] }
    }

    fn term_sizes(&self, x: &Element<Self>) -> Laws<[f64; 0]> {
        Laws { energy: 1.5 * x.norm_squared(), entropy: 0.0, invariants: [] }
    }

    fn rates(&self, x: &Element<Self>, d: &Vec<f64>) -> Option<Vec<f64>> {
        Some(vec![x.y + d[1], -x.x - d[0]])
    }

    fn sizes(&self, x: &Element<Self>) -> Vec<f64> {
        vec![x.x.abs(), x.y.abs()]
    }

    fn moved(&self, x: &Element<Self>, d: &Vec<f64>) -> Vector2<f64> {
        x + Vector2::new(d[0], d[1])
    }

    fn element(
        &self,
        entries: &[f64],
    ) -> Result<Vector2<f64>, metriplectic::manifolds::PointError> {
        Euclidean::<2>.from_entries(entries)
    }
}

#[test]
fn a_method_without_laws_has_outputs_of_its_order() {
    accuracy("explicit midpoint, so(3)*", (&free_body(), &TUMBLING), ExplicitMidpoint, (0.1, 20));
    accuracy("explicit midpoint, SO(3)", (&group(), &attitude()), ExplicitMidpoint, (0.02, 20));
}

#[test]
fn a_flow_that_does_not_say_what_lies_between_is_an_error() {
    let (span, start) = (Span::steps(0.1, 10), vector![1.0, 0.0]);
    let run = ExplicitMidpoint.run(&Oscillator, start, span.output_every(0.2)).unwrap();
    assert_eq!(run.states().len(), 6); // at the ends of steps
    let error = ExplicitMidpoint.run(&Oscillator, start, span.output_at([0.25, 0.5])).unwrap_err();
    let RunError::Step { cause: StepError::NothingBetween { .. }, trajectory } = error else {
        panic!("{error}")
    };
    assert!((trajectory.last().time - 0.3).abs() < 1e-15);
}
