//! The states of a run, of its tangent and of its adjoint are the same; data find theirs by time.

use metriplectic::dynamics::Parametrised;
use metriplectic::fields::{Column as _, Vector};
use metriplectic::fitting::Loss;
use metriplectic::integrators::{LinearisedAlong, Schedule, Unpaired};
use metriplectic::prelude::*;
use nalgebra::{Vector1, vector};

const START: Vector2<f64> = Vector2::new(1.0, 0.5);

/// `x' = −k x` at constant `y`: friction of the metric with `H = y` and `S = −k x²/2`. Above `y = 1` the model ends at `x = 10⁻³`.
fn decays() -> impl Parametrised<
    1,
    System: Differentiable<
        Manifold = Euclidean<2>,
        Wide: Metriplectic<Manifold = Product<Euclidean<2>, Euclidean<1>>>,
    >,
> {
    Family::on(Euclidean::<2>)
        .parameters(["k"])
        .energy(
            |x: &Vector2<Real>, _: &Vector1<Real>| {
                if x.x.re < 1e-3 && x.y.re > 1.0 { Real::from(f64::NAN) } else { x.y }
            },
        )
        .entropy(|x: &Vector2<Real>, k: &Vector1<Real>| -(x.x * x.x * k.x * 0.5))
        .build()
        .expect("a family")
}

/// Schedules with all that decides which states are recorded. None of them has an event.
fn schedules() -> Vec<(&'static str, Schedule)> {
    let fixed = || Span::steps(0.1, 100);
    let free = || Span::until(10.0).tolerance(1e-6);
    vec![
        ("plain", fixed().into()),
        ("plain, tolerance", free().into()),
        ("no outputs", fixed().output_at([])),
        ("no outputs, tolerance", free().output_at([])),
        ("one output", fixed().output_at([3.0])),
        ("one output, tolerance", free().output_at([3.0])),
        ("at steps, between them and at the start", fixed().output_at([0.0, 0.25, 0.3, 9.99])),
        ("every so often", free().starting_at(-2.0).output_every(0.7)),
        ("every 30", fixed().every(30).into()),
        ("every 4, tolerance", free().every(4).into()),
        ("at most 2", fixed().at_most(2).into()),
        ("at most 7", fixed().at_most(7).into()),
        ("at most 7, tolerance", free().at_most(7).into()),
        ("rest", free().until_rest(1e-2).into()),
        ("rest after outputs", free().until_rest(1e-2).output_every(1.0)),
        ("rest before an output", fixed().until_rest(1e-2).output_at([1.0, 9.0])),
    ]
}

/// Compares the records of a run, of its tangent and of its adjoint.
fn same_records<D, M>(name: &str, system: &D, method: M)
where
    D: Differentiable<Manifold = Euclidean<2>>,
    M: Copy + Stepper<D> + LinearisedAlong<D>,
{
    let whole = method.tangent(system, START, Span::steps(0.1, 100)).expect("a tangent");
    for (of, schedule) in schedules() {
        let name = format!("{name}, {of}");
        let run = method.run(system, START, schedule.clone()).expect(&name);
        let tangent = method.tangent(system, START, schedule.clone()).expect(&name);
        let times: Vec<f64> = run.iter().map(|state| state.time).collect();
        let of_tangent: Vec<f64> = tangent.states().iter().map(|state| state.time).collect();
        assert_eq!(times, of_tangent, "{name}");
        assert_eq!((run.ending(), run.last().point), (tangent.ending(), tangent.last().point));
        let steps: Vec<usize> = tangent.states().iter().map(|state| state.step).collect();
        assert!(run.iter().map(|state| state.step).eq(steps), "{name}");
        // The end of a run does not depend on what is recorded.
        if run.last().time == 10.0 && whole.last().step == run.last().step {
            assert_eq!(whole.last().matrix(), tangent.last().matrix(), "{name}");
        }
        // The derivative of the exact map, which the tangent of the last state must be near to.
        let t = run.last().time - run.states()[0].time;
        let along = tangent.last().along("k").expect("a parameter")[0];
        assert!((along + t * (-t).exp()).abs() < 2e-3, "{name}: {along} at {t}");

        for steps in [usize::MAX, 7] {
            let adjoint = method.adjoint_within(steps, system, START, schedule.clone());
            let adjoint = adjoint.expect(&name);
            let of_adjoint: Vec<f64> = adjoint.states().iter().map(|state| state.time).collect();
            assert_eq!(times, of_adjoint, "{name}");
            assert_eq!((run.ending(), run.last()), (adjoint.ending(), adjoint.last()), "{name}");
            // A covector at each state alone, and at all of them.
            let count = times.len();
            let weight = |k: usize| Vector::<Euclidean<2>>::from_index(|i| ((k + i) as f64).cos());
            let alone = (0..count).map(|k| vec![k]).take(3);
            for at in alone.chain([vec![count - 1], (0..count).collect()]) {
                let rows: Vec<_> = (0..count)
                    .map(|k| weight(k) * if at.contains(&k) { 1.0 } else { 0.0 })
                    .collect();
                let found = adjoint.pull_back(&rows).expect("a gradient");
                let sum = at
                    .iter()
                    .fold(0.0, |sum, &k| sum + tangent.states()[k].derivative_of(&weight(k))[2]);
                let off = (found.along_parameters()[0] - sum).abs();
                // A round-off for each of a hundred steps, of terms of size 1.
                assert!(off < 100.0 * f64::EPSILON * count as f64, "{name}, {at:?}: {off:e}");
            }
        }
    }
    // A run that stops at an event ends there, with outputs and without.
    let stop = |schedule: Schedule| -> Schedule {
        schedule.event("half", |x: &Vector2<f64>| x.x - 0.5).stop().into()
    };
    for (of, schedule) in schedules().into_iter().filter(|(of, _)| !of.contains("at most")) {
        let schedule = stop(schedule);
        let run = method.run(system, START, schedule.clone()).expect("a run");
        let tangent = method.tangent(system, START, schedule).expect("a tangent");
        let times: Vec<f64> = run.iter().map(|state| state.time).collect();
        let of_tangent: Vec<f64> = tangent.states().iter().map(|state| state.time).collect();
        assert_eq!(times, of_tangent, "{name}, {of}, stopped");
        assert!(run.ending().is_event() && tangent.ending() == run.ending());
        assert_eq!(tangent.last().point, run.last().point);
        let error = tangent.last().point.x - 0.5;
        assert!(error.abs() < 1e-12, "{name}, {of}: {error:e}");
    }
}

#[test]
fn runs_tangents_and_adjoints_record_the_same_states_and_end_at_the_same_one() {
    let family = decays();
    let system = family.at_parameters(vector![1.0]);
    same_records("order 8", &system, DormandPrince8);
    same_records("Gauss", &system, Gauss::<2>);
    same_records("Weyl", &system, Scheme::new(WeylMidpoint));
    // Outputs and a thinned record are two, as for runs.
    let two = Span::steps(0.1, 100).every(3).output_every(0.5);
    assert!(DormandPrince8.run(&system, START, two.clone()).is_err());
    assert!(DormandPrince8.tangent(&system, START, two.clone()).is_err());
    assert!(DormandPrince8.adjoint(&system, START, two).is_err());
}

/// Data `e^{−t}` at the times, exact at `k = 1`.
fn exact(times: &[f64]) -> Vec<Vector1<f64>> {
    times.iter().map(|t| vector![(-t).exp()]).collect()
}

/// Fits `k` from 1.2 to exact data of `x`.
fn fitted(times: &[f64], schedule: impl Into<Schedule>) -> Result<Fitted, FitError> {
    Fit::of(&decays())
        .observe(|x: &Vector2<Real>| vector![x.x])
        .data(times, &exact(times))
        .start_at(START)
        .run(DormandPrince8, schedule, vector![1.2])
}

fn up_to(end: i32) -> Vec<f64> {
    (1..=end).map(f64::from).collect()
}

#[test]
fn a_fit_pairs_states_with_data_by_time() {
    let span = || Span::until(20.0).tolerance(1e-9);
    let plain = fitted(&up_to(20), span()).expect("a fit").parameters[0];
    assert!((plain - 1.0).abs() < 1e-8, "{plain}");
    // A run until rest goes on to its last row.
    for rest in [1e-2, 1e-3, 1e-6] {
        let fit = fitted(&up_to(20), span().until_rest(rest)).expect("a fit");
        assert_eq!(fit.parameters[0].to_bits(), plain.to_bits(), "{rest}");
    }
    // Outputs of the schedule beside the data, a datum at the start and the end, times that are written otherwise.
    let times: Vec<f64> = (0..=20).map(|k| 0.1 * f64::from(k)).collect();
    let other: Vec<f64> = (0..=20).map(|k| f64::from(k) / 10.0).collect();
    for times in [times, other] {
        for schedule in [
            Span::until(2.0).tolerance(1e-9).output_every(0.3),
            Span::steps(0.1, 20).into(),
            Span::steps(0.01, 200).output_at([0.005, 0.1_f64.next_up(), 1.995]),
        ] {
            let fit = fitted(&times, schedule).expect("a fit");
            assert!((fit.parameters[0] - 1.0).abs() < 1e-8, "{}", fit.parameters[0]);
        }
    }
}

#[test]
fn a_fit_to_data_behind_the_end_of_its_run_names_the_datum_and_the_end() {
    let stopped = |level: f64| -> Schedule {
        let span = Span::until(20.0).tolerance(1e-9);
        span.event("low", move |x: &Vector2<f64>| x.x - level).stop().into()
    };
    // At k = 1.2 the level e^{−6} is reached at t = 5, beyond all data.
    let fit = fitted(&up_to(4), stopped((-6.0_f64).exp())).expect("a fit");
    assert!((fit.parameters[0] - 1.0).abs() < 1e-8, "{}", fit.parameters[0]);
    match fitted(&up_to(20), stopped(0.1)) {
        Err(FitError::Guess(error)) => {
            let text = error.to_string();
            // 1.2 t = ln 10 at t = 1.919, so the second datum, at t = 2, is the first one behind it.
            match error.downcast_ref::<Unpaired>() {
                Some(Unpaired::Ended { index: 1, time, reached, ending, event }) => {
                    assert!((reached - 10.0_f64.ln() / 1.2).abs() < 1e-8 && *time == 2.0);
                    assert!(ending.is_event() && event.as_deref() == Some("low"));
                }
                other => panic!("{other:?}: {text}"),
            }
            assert!(text.contains("low") && text.contains("t = 2"), "{text}");
        }
        other => panic!("{:?}", other.map(|fit| fit.parameters)),
    }
}

#[test]
fn a_loss_pairs_states_with_its_terms_by_time() {
    let (family, times) = (decays(), up_to(20));
    let value = |start: Vector2<f64>, times: &[f64], schedule: Schedule, k: f64| {
        let data = exact(times);
        let loss = Loss::of(&family)
            .starts(&[start])
            .times(times)
            .term(|_, k, x: &Vector2<Real>| (x.x - data[k].x).powi(2))
            .over(DormandPrince8, schedule);
        let theta = vector![k];
        loss.value(&theta).and_then(|value| Ok((value, loss.gradient_at(&theta)?)))
    };
    let span = || Span::until(20.0).tolerance(1e-9);
    let (plain, (same, _)) = value(START, &times, span().into(), 1.0).expect("a loss");
    // Values are by dense output, and those of gradients by steps of a fraction: both are under the tolerance.
    assert!(plain < 1e-15 && same < 1e-15, "{plain:e} {same:e}");
    // From the second start no run goes on far below the rest of 1e-2: then the state at rest stands for all later terms.
    let edge = vector![1.0, 2.0];
    assert!(value(edge, &times, span().into(), 1.0).is_err());
    let schedule = |rest: f64| -> Schedule { span().until_rest(rest).into() };
    for (start, rest, most) in [
        (START, 1e-2, 1e-15),
        (START, 1e-3, 1e-15),
        (START, 1e-6, 1e-15),
        // Sixteen terms are behind the rest, and each is off by it at most.
        (edge, 1e-2, 16.0 * 1e-4),
        (edge, 5e-3, 15.0 * 2.5e-5),
    ] {
        let [at, off] =
            [1.0, 1.2].map(|k| value(start, &times, schedule(rest), k).expect("a loss"));
        println!("rest {rest:e}: {:.2e}, and {:.2e} at k = 1.2", at.0, off.0);
        assert!(at.0 < most && off.0 > 1e-3 + at.0 && off.1.1[0] > 0.0, "{rest}: {:e}", at.0);
        for (value, (same, _)) in [at, off] {
            assert!((value - same).abs() < 1e-7 * value + 1e-15, "{value:e} {same:e}");
        }
    }
    // Terms in any order, twice at one time, at the start.
    let times = [3.0, 1.0, 0.0, 1.0, 20.0];
    let (odd, (same, slope)) = value(START, &times, schedule(1e-6), 1.0).expect("a loss");
    assert!(odd < 1e-15 && same < 1e-15 && slope[0].abs() < 1e-7, "{odd:e} {same:e} {slope}");
    let stopped = span().event("low", |x: &Vector2<f64>| x.x - 0.1).stop().into();
    let error = value(START, &up_to(20), stopped, 1.0).expect_err("the run ends before the data");
    let error = error.downcast_ref::<Unpaired>().expect("it is said how");
    assert!(matches!(error, Unpaired::Ended { index: 2, time: 3.0, .. }), "{error}");
}
