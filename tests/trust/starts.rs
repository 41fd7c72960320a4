//! Where a run begins: in a state of another run, or where one was put down.

use metriplectic::integrators::{Error, Schedule, StartError};
use metriplectic::prelude::*;
use nalgebra::{Vector2, vector};

use crate::model::{FREE, From, METHODS, Model, run};

fn twice(t: Real) -> Real {
    (t * 2.0).sin()
}

fn ramp(t: Real) -> Real {
    t
}

/// A state goes on where its clock stands, with its ledger; elsewhere the run is refused, by the two times.
#[test]
fn a_start_at_another_time_than_that_of_its_clock_is_an_error() {
    let model = Model { stiffness: 1.0, force: ramp, port: twice, ..FREE };
    for method in METHODS {
        let tolerance = if ["Weyl", "Gauss1", "RKC"].contains(&method) { 1e-4 } else { 1e-8 };
        let from = |from, span: Schedule| run(method, model, from, span, None);
        let again = From::EndOf([1.0, 0.0], 2.0);
        let error =
            from(again, Span::until(4.0).tolerance(1e-8).into()).err().expect("it contradicts");
        let both = error.contains("shows t = 2.000000") && error.contains("starts at t = 0.000000");
        assert!(both && error.contains(".starting_at(2.0)"), "{method}: {error}");
        let on = Span::until(4.0).starting_at(2.0).tolerance(tolerance);
        let on = from(again, on.into()).unwrap_or_else(|error| panic!("{method}: {error}"));
        let whole = from(From::Point([1.0, 0.0]), Span::until(4.0).tolerance(tolerance).into());
        let whole = whole.unwrap_or_else(|error| panic!("{method}: {error}"));
        let off = |a: &[f64], b: &[f64]| {
            a.iter().zip(b).fold(0.0, |most, (a, b)| f64::max(most, (a - b).abs()))
        };
        let bound = 100.0 * tolerance;
        assert!(off(&on.end(), &whole.end()) < bound, "{method}: {:?} {:?}", on.end(), whole.end());
        assert!(off(&on.ledger, &whole.ledger) < bound, "{method}: {:?}", on.ledger);
        assert!(on.certificate.keeps_energy(), "{method}");
        // q = t + cos t − ⅓ sin t − ⅓ sin 2t.
        let t = 4.0_f64;
        let right = [
            t + t.cos() - (t.sin() + (2.0 * t).sin()) / 3.0,
            1.0 - t.sin() - (t.cos() + 2.0 * (2.0 * t).cos()) / 3.0,
        ];
        assert!(off(&whole.end(), &right) < bound, "{method}: {:?}", whole.end());
    }
}

/// The errors of clock and ledger by their types, with noise and on a lattice too.
#[test]
fn a_start_that_contradicts_is_a_typed_error_everywhere() {
    macro_rules! with_a_bath {
        () => {
            System::on(Euclidean::<2>)
                .bracket(Symplectic)
                .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5)
                .bath(
                    "bath",
                    Bath::at(1.0).friction(|_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                        [Contact { rate: 0.3.into(), along: vector![0.0.into(), 1.0.into()] }]
                    }),
                )
        };
    }
    let (one, other) = (with_a_bath!().build().expect("a system"), {
        System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5)
            .work("port", |_: Real, _: &Vector2<Real>| vector![0.0.into(), 1.0.into()])
            .build()
            .expect("a system")
    });
    let start = one.start(vector![1.0, 0.0]);
    let end = DormandPrince5.run(&one, start.clone(), Span::steps(0.1, 10)).expect("a run");
    let end = end.last().point.clone();
    let error = |result: Result<_, _>| match result {
        Err(error) => Error::from(error),
        Ok(_) => panic!("the start contradicts the run"),
    };
    let clocked = |error: Error| {
        matches!(
            error,
            Error::Start(StartError::Clock { clock, start }) if clock == 1.0 && start == 0.5
        )
    };
    let span = Span::steps(0.1, 10).starting_at(0.5);
    assert!(clocked(error(DormandPrince5.run(&one, end.clone(), span))));
    let noisy = with_a_bath!().noise(Boltzmann(0.1)).build().expect("a system");
    let sampler = NinomiyaVictoir(DormandPrince5).seed(1);
    assert!(clocked(error(sampler.run(&noisy, end.clone(), span))));
    let of_other = error(DormandPrince5.run(&other, start, Span::steps(0.1, 10)));
    assert!(matches!(of_other, Error::Start(StartError::Ledger { found: 2, expected: 1 })));
}

/// A jump takes the point of the state that its closure returns: the clock and the ledger are those of the run.
#[test]
fn a_jump_takes_the_point_of_a_state_with_another_ledger() {
    macro_rules! oscillator {
        () => {
            System::on(Euclidean::<2>)
                .bracket(Symplectic)
                .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5)
        };
    }
    let push = |_: Real, _: &Vector2<Real>| vector![0.0.into(), 0.5.into()];
    let one = oscillator!().work("one", push).build().unwrap();
    let two = oscillator!().work("two", push).work("three", push).build().unwrap();
    let run = |other: bool| {
        let elsewhere = two.start(vector![0.0, 0.0]);
        let kick = move |_: f64, x: &OpenState<Vector2<f64>>| {
            let there = if other { &elsewhere } else { x };
            there.at(vector![x.x.x, -x.x.y])
        };
        let span =
            Span::steps(0.1, 40).event_in_time("kick", |t, _: &OpenState<Vector2<f64>>| t - 1.23);
        DormandPrince8.run(&one, one.start(vector![1.0, 0.0]), span.jump(kick)).unwrap()
    };
    assert_eq!(run(true).last(), run(false).last());
    assert!(run(true).last().point.ledger.work("one").is_some_and(|work| work != 0.0));
}

fn chirp(t: Real) -> Real {
    (t * 1.3).sin() * 0.4
}

/// A run that is put down after any of its steps and taken up goes on bit for bit, with all that takes the time in it. A velocity
/// that a method keeps is one of the state whose clock a run has set by a rounding.
#[test]
fn a_resumed_run_is_the_run_after_every_step() {
    let model =
        Model { stiffness: 1.0, quartic: 0.4, port: chirp, temperature: 0.7, rate: 0.1, ..FREE };
    let kick = |span: Schedule| {
        span.event_in_time("kick", |t, _: &OpenState<Vector2<f64>>| t - 1.23)
            .jump(|_, x: &OpenState<Vector2<f64>>| x.at(x.x + vector![0.0, 0.3]))
            .corners([0.77, 2.0])
    };
    for method in METHODS.into_iter().chain(["Radau2", "Radau3", "Radau4"]) {
        let coarse = ["Weyl", "Gauss1", "RKC"].contains(&method);
        let tolerance = if coarse { 1e-3 } else { 1e-7 };
        let spans: [Schedule; 3] = [
            Span::steps(0.05, 60).into(),
            kick(Span::steps(1.0 / 16.0, 48).into()),
            kick(Span::until(3.0).tolerance(tolerance).into()),
        ];
        for span in spans {
            let ran = |from: From<'_>, steps| {
                run(method, model, from, span.clone(), steps)
                    .unwrap_or_else(|error| panic!("{method}: {error}"))
            };
            let whole = ran(From::Point([1.0, 0.0]), None);
            for steps in 1..whole.certificate.steps {
                let put_down = ran(From::Point([1.0, 0.0]), Some(steps));
                let resumed = ran(From::Checkpoint(&put_down.checkpoint), None);
                assert_eq!(resumed.end(), whole.end(), "{method} after {steps} steps");
                assert_eq!(resumed.ledger, whole.ledger, "{method} after {steps} steps");
                assert_eq!(resumed.certificate, whole.certificate, "{method} after {steps} steps");
            }
        }
    }
}
