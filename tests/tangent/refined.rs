//! Derivatives as exact as asked for: against those of another method with small steps.

use metriplectic::dynamics::{Parametrised as _, Point};
use metriplectic::integrators::{LinearisedAlong, Schedule, TangentError};
use metriplectic::prelude::*;
use nalgebra::{DMatrix, vector};

use crate::{body, off};

const START: Vector3<f64> = Vector3::new(0.4, -1.0, 0.3);
const THETA: Vector4<f64> = Vector4::new(3.0, 2.0, 1.0, 0.05);

/// The errors of a run, and of one to an accuracy.
fn errors<D, M>(
    system: &D,
    method: M,
    x0: &Point<D>,
    schedule: impl Into<Schedule>,
    accuracy: f64,
    exact: &DMatrix<f64>,
) -> [f64; 2]
where
    D: Differentiable,
    M: Clone + Stepper<D> + LinearisedAlong<D>,
{
    let schedule: Schedule = schedule.into();
    let plain = method.clone().tangent(system, x0.clone(), schedule.clone()).expect("a tangent");
    assert_eq!(plain.sensitivity().difference, None);
    let run = method.tangent_to(system, x0.clone(), schedule, accuracy).expect("it is reached");
    let difference = run.sensitivity().difference.expect("two runs");
    assert!(difference <= accuracy, "{difference:e}");
    [&plain, &run].map(|run| off(&run.last().matrix(), exact))
}

#[test]
fn derivatives_reach_the_accuracy_by_every_method() {
    let family = body();
    let system = family.at_parameters(THETA);
    let exact = Gauss::<3>.tangent(&system, START, Span::steps(0.02, 500)).unwrap();
    let exact = exact.last().matrix();
    let end = Span::until(10.0);
    let rows = [
        ("order 8", errors(&system, DormandPrince8, &START, end.tolerance(1e-5), 1e-8, &exact)),
        ("order 5", errors(&system, DormandPrince5, &START, end.tolerance(1e-5), 1e-7, &exact)),
        (
            "midpoint",
            errors(&system, Scheme::new(WeylMidpoint), &START, Span::steps(0.1, 100), 1e-4, &exact),
        ),
        ("Gauss", errors(&system, Gauss::<2>, &START, end.tolerance(1e-4), 1e-6, &exact)),
        ("Radau", errors(&system, Radau::<3>, &START, end.tolerance(1e-4), 1e-7, &exact)),
    ];
    for ((name, [plain, error]), accuracy) in rows.into_iter().zip([1e-8, 1e-7, 1e-4, 1e-6, 1e-7]) {
        println!("{name}: {plain:.1e} before, {error:.1e} to {accuracy:.0e}");
        assert!(plain > accuracy && error < accuracy, "{name}: {plain:e} {error:e}");
    }
}

#[test]
fn derivatives_reach_the_accuracy_on_a_sphere_whose_frame_turns() {
    let system = System::on(Sphere::<2>::round())
        .energy(|n: &Vector3<Real>| n.x * n.x * 0.5 + n.y * n.y + n.z.powi(3) * 0.4)
        .entropy(|n: &Vector3<Real>| n.z + n.x * n.y * 0.3)
        .build()
        .unwrap();
    let x0 = vector![0.6, 0.8, -0.0];
    let exact = Gauss::<3>.tangent(&system, x0, Span::steps(0.01, 300)).unwrap();
    let exact = exact.last().embedded();
    let run = DormandPrince5.tangent_to(&system, x0, Span::until(3.0).tolerance(1e-4), 1e-7);
    let error = off(&run.unwrap().last().embedded(), &exact);
    println!("S²: {error:.1e}");
    assert!(error < 1e-7);
}

#[test]
fn an_accuracy_that_is_not_reached_is_an_error() {
    let system = body().at_parameters(THETA);
    let span = Span::until(1.0).tolerance(1e-12);
    for accuracy in [0.0, -1e-8, 1.0, 1e-18, 1e-14, f64::NAN, f64::INFINITY] {
        match DormandPrince8.tangent_to(&system, START, span, accuracy) {
            Err(TangentError::Accuracy { .. }) => {}
            other => panic!("{accuracy}: {other:?}"),
        }
    }
    let scheme = Scheme::new(WeylMidpoint);
    match scheme.tangent_to(&system, START, Span::steps(0.5, 2), 1e-13) {
        Err(TangentError::Inexact { reached, .. }) => assert!(reached > 1e-13 && reached < 1e-6),
        other => panic!("{other:?}"),
    }
}

/// A state at rest follows any tolerance with one step, and its derivatives do not.
#[test]
fn derivatives_of_a_state_at_rest_reach_the_accuracy() {
    let system = body().at_parameters(THETA);
    for x0 in [Vector3::x(), Vector3::y(), Vector3::z()] {
        let exact = Gauss::<3>.tangent(&system, x0, Span::steps(0.02, 250)).unwrap();
        let exact = exact.last().matrix();
        let end = Span::until(5.0).tolerance(1e-4);
        let rows = [
            ("order 8", errors(&system, DormandPrince8, &x0, end, 1e-8, &exact)),
            ("order 5", errors(&system, DormandPrince5, &x0, end, 1e-7, &exact)),
            ("Gauss", errors(&system, Gauss::<2>, &x0, end, 1e-6, &exact)),
            ("Radau", errors(&system, Radau::<3>, &x0, end, 1e-6, &exact)),
        ];
        for ((name, [plain, error]), accuracy) in rows.into_iter().zip([1e-8, 1e-7, 1e-6, 1e-6]) {
            println!("{name} at rest: {plain:.1e} before, {error:.1e} to {accuracy:.0e}");
            assert!(plain > accuracy && error < accuracy, "{name}: {plain:e} {error:e}");
        }
    }
}
