//! Fits: estimates, their errors, and what the data do not say.

use metriplectic::dynamics::Parametrised as _;
use metriplectic::fitting::{FitError, Fitted};
use metriplectic::prelude::*;
use nalgebra::{DVector, vector};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt as _, SeedableRng as _};

use crate::body;

const START: Vector3<f64> = Vector3::new(0.4, -1.0, 0.3);
const THETA: Vector4<f64> = Vector4::new(3.0, 2.0, 1.0, 0.05);
const NOISE: f64 = 1e-3;

/// Eighty rows of a run, with noise.
struct Data {
    times: Vec<f64>,
    truth: Vec<Vector3<f64>>,
    span: Span,
}

fn data(theta: Vector4<f64>) -> Data {
    let times: Vec<f64> = (1..=80).map(|k| 0.25 * f64::from(k)).collect();
    let span = Span::steps(0.25, 80);
    let run = DormandPrince8.run(&body().at_parameters(theta), START, span).expect("it runs");
    Data { times, truth: run.states()[1..].iter().map(|state| state.point).collect(), span }
}

/// The rows with Gaussian noise (Box and Muller).
fn noisy(truth: &[Vector3<f64>], rng: &mut ChaCha8Rng) -> Vec<Vector3<f64>> {
    let mut normal = || {
        let (a, b): (f64, f64) = (rng.random(), rng.random());
        (-2.0 * (1.0 - a).ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    };
    truth.iter().map(|x| x + Vector3::from_fn(|_, _| normal() * NOISE)).collect()
}

/// `(φ̂ − φ)ᵀ C⁻¹ (φ̂ − φ)` in the logarithms of the parameters.
fn distance(fit: &Fitted, theta: &Vector4<f64>) -> f64 {
    let off = DVector::from_fn(4, |k, _| (fit.parameters[k] / theta[k]).ln());
    off.dot(&fit.covariance.matrix.clone().lu().solve(&off).expect("a covariance"))
}

#[test]
fn a_fit_finds_the_parameters_within_their_errors() {
    let (family, Data { times, truth, span }) = (body(), data(THETA));
    let rows = noisy(&truth, &mut ChaCha8Rng::seed_from_u64(7));
    let fit = Fit::of(&family)
        .observe(|p: &Vector3<Real>| *p)
        .data(&times, &rows)
        .positive_all()
        .start_at(START)
        .run(DormandPrince8, span, vector![2.6, 2.3, 1.2, 0.03])
        .unwrap();
    println!("{fit}");
    let joint = distance(&fit, &THETA);
    println!("joint χ²₄ = {joint:.2}");
    assert!(joint < 12.8 && fit.runs <= 30, "{joint} in {} runs", fit.runs);
    assert!((fit.noise / NOISE - 1.0).abs() < 0.15 && fit.degrees == 236);
    assert!(fit.to_string().contains("correlated"));
    assert!(fit.not_told_apart().is_empty());
    let [low, high] = fit.estimate("I1").unwrap().interval(4.0);
    assert!(low < 3.0 && 3.0 < high);
}

/// The joint ellipsoid of 95 % holds the truth for 88 to 99 of 100 noises.
#[test]
fn ellipsoids_hold_the_truth_as_often_as_they_say() {
    let (family, Data { times, truth, span }) = (body(), data(THETA));
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let (mut inside, mut sum) = (0, 0.0);
    for _ in 0..100 {
        let rows = noisy(&truth, &mut rng);
        let fit = Fit::of(&family)
            .observe(|p: &Vector3<Real>| *p)
            .data(&times, &rows)
            .noise(NOISE)
            .positive_all()
            .start_at(START)
            .run(DormandPrince8, span, THETA)
            .unwrap();
        let joint = distance(&fit, &THETA);
        sum += joint;
        // The quantile of χ²₄ at 95 %.
        inside += usize::from(joint < 9.488);
    }
    println!("inside {inside} of 100, mean χ² {:.2} of 4", sum / 100.0);
    assert!((88..=99).contains(&inside), "{inside}");
}

/// A friction that is not there has no minimum in its logarithm. Without friction the motion depends on differences of `1/I`
/// alone, so one inertia is fixed.
#[test]
fn a_parameter_at_its_bound_is_said_to_be_there() {
    let (family, Data { times, truth, span }) = (body(), data(vector![3.0, 2.0, 1.0, 1e-9]));
    // The opposite of a noise for which the best friction is positive by 2.5 errors.
    let noisy = noisy(&truth, &mut ChaCha8Rng::seed_from_u64(5));
    let rows: Vec<_> = truth.iter().zip(&noisy).map(|(truth, row)| truth * 2.0 - row).collect();
    let fit = Fit::of(&family)
        .observe(|p: &Vector3<Real>| *p)
        .data(&times, &rows)
        .noise(NOISE)
        .positive_all()
        .free(["I1", "I2", "friction"])
        .start_at(START)
        .run(DormandPrince8, span, vector![3.1, 2.1, 1.0, 1e-3])
        .unwrap();
    println!("{fit}");
    assert!(fit.estimate("friction").unwrap().at_bound && !fit.estimate("I1").unwrap().at_bound);
    assert!(fit.to_string().contains("friction is at its bound"));
}

/// Two parameters that enter as a product are not told apart.
#[test]
fn combinations_that_no_datum_sees_are_named() {
    let family = Family::on(Euclidean::<2>)
        .parameters(["a", "b", "stiffness"])
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>, t: &Vector3<Real>| {
            x.y * x.y * 0.5 * t.x * t.y + x.x * x.x * 0.5 * t.z
        })
        .build()
        .unwrap();
    let truth = vector![1.5, 2.0, 0.7];
    let span = Span::steps(0.1, 60).output_every(0.5);
    let run = DormandPrince5.run(&family.at(truth), vector![1.0, 0.0], span.clone()).unwrap();
    let times: Vec<f64> = run.states()[1..].iter().map(|state| state.time).collect();
    let rows: Vec<_> = run.states()[1..].iter().map(|state| state.point.add_scalar(1e-4)).collect();
    let fit = Fit::of(&family)
        .observe(|x: &Vector2<Real>| *x)
        .data(&times, &rows)
        .start_at(vector![1.0, 0.0])
        .run(DormandPrince5, Span::steps(0.1, 60), vector![1.4, 2.2, 0.72])
        .unwrap();
    println!("{fit}");
    assert_eq!(fit.not_told_apart(), ["a", "b"]);
    assert!(fit.to_string().contains("do not tell apart: a, b"));
    // The third is known in spite of them.
    assert!(fit.estimate("a").unwrap().standard_error.is_infinite());
    assert!(fit.estimate("stiffness").unwrap().standard_error < 1e-3);
}

/// A start that is measured with the same noise is fitted too, on a sphere.
#[test]
fn a_start_is_fitted_with_the_parameters() {
    let family = Family::on(Sphere::<2>::round())
        .parameters(["field", "anisotropy", "damping"])
        .bracket(AreaForm)
        .energy(|n: &Vector3<Real>, t: &Vector3<Real>| -(n.z * t.x) - n.x * n.x * t.y)
        .entropy(|n: &Vector3<Real>, t: &Vector3<Real>| n.z * t.z)
        .second_law(SecondLaw::Published)
        .build();
    // The published scheme needs no Casimir; explicit methods then keep the energy alone.
    let family = family.unwrap();
    let (truth, n0) = (vector![1.0, 0.3, 0.1], vector![0.6, 0.0, 0.8]);
    let times: Vec<f64> = (1..=40).map(|k| 0.2 * f64::from(k)).collect();
    let span = Span::steps(0.1, 80);
    let run = DormandPrince8.run(&family.at(truth), n0, span.output_every(0.2)).unwrap();
    let rows: Vec<_> = run.states()[1..].iter().map(|state| state.point).collect();
    let rows = noisy(&rows, &mut ChaCha8Rng::seed_from_u64(3));
    let guess = vector![0.62, 0.05, 0.78].normalize();
    let fit = Fit::of(&family)
        .observe(|n: &Vector3<Real>| *n)
        .data(&times, &rows)
        .noise(NOISE)
        .free_start(guess)
        .run(DormandPrince8, span, vector![1.1, 0.25, 0.05])
        .unwrap();
    println!("{fit}");
    assert_eq!(fit.degrees, 120 - 5);
    assert!(fit.chi_squared / 115.0 < 1.5);
    for (k, name) in ["field", "anisotropy", "damping"].into_iter().enumerate() {
        let estimate = fit.estimate(name).unwrap();
        let off = (estimate.value - truth[k]) / estimate.standard_error;
        assert!(off.abs() < 4.0, "{name}: {off}");
    }
    assert!((Vector3::from_row_slice(&fit.start) - n0).norm() < 4e-3);
}

#[test]
fn bad_data_are_named() {
    let family = body();
    let fit = |times: &[f64], rows: &[Vector3<f64>]| {
        Fit::of(&family)
            .observe(|p: &Vector3<Real>| *p)
            .data(times, rows)
            .start_at(START)
            .run(DormandPrince8, Span::steps(0.25, 8), THETA)
            .unwrap_err()
    };
    let row = vector![0.1, 0.2, 0.3];
    assert!(matches!(fit(&[1.0], &[row, row]), FitError::Rows { rows: 2, times: 1 }));
    assert!(matches!(fit(&[1.0], &[row]), FitError::TooFewData { data: 3, unknowns: 4 }));
    assert!(matches!(fit(&[1.0, 0.5], &[row, row]), FitError::Times { row: 1, .. }));
    let nan = vector![0.1, f64::NAN, 0.3];
    assert!(matches!(fit(&[1.0, 1.5], &[row, nan]), FitError::NotFinite { row: 1, column: 1, .. }));
    // A time beyond the run.
    assert!(matches!(fit(&[1.0, 5.0], &[row, row]), FitError::Guess(_)));
    let none = Fit::of(&family)
        .observe(|p: &Vector3<Real>| *p)
        .data(&[1.0, 2.0], &[row, row])
        .free(["J1"])
        .start_at(START)
        .run(DormandPrince8, Span::steps(0.25, 8), THETA);
    assert!(matches!(none, Err(FitError::UnknownParameter { .. })));
}

/// A metric that is indefinite at the guess has no fit, and one that is so at a trial is left.
#[test]
fn trials_outside_of_the_domain_are_left() {
    let family = Family::on(LieDual::so3())
        .parameters(["along", "across"])
        .field_metric(|_: &Vector3<Real>, t: &Vector2<Real>| {
            Matrix3::from_diagonal(&Vector3::new(t.x, t.y, 1.0.into()))
        })
        .energy(|p: &Vector3<Real>, _: &Vector2<Real>| {
            p.x * p.x / 6.0 + p.y * p.y / 4.0 + p.z * p.z * 0.5
        })
        .entropy(|p: &Vector3<Real>, _: &Vector2<Real>| p.norm_squared() * 0.5)
        .build()
        .unwrap();
    let (truth, span) = (vector![1.5, 0.4], Span::steps(0.25, 40));
    let run = DormandPrince8.run(&family.at(truth), START, span).unwrap();
    let times: Vec<f64> = run.states()[1..].iter().map(|state| state.time).collect();
    let rows: Vec<_> = run.states()[1..].iter().map(|state| state.point).collect();
    let fit = |guess| {
        let fit = Fit::of(&family).observe(|p: &Vector3<Real>| *p).data(&times, &rows);
        fit.start_at(START).run(DormandPrince8, span, guess)
    };
    let found = fit(vector![4.0, 2.0]).unwrap();
    println!("{found}");
    assert!((Vector2::from_column_slice(&found.parameters) - truth).amax() < 1e-6);
    let refused = fit(vector![-1.0, 1.0]).unwrap_err();
    assert!(matches!(refused, FitError::Guess(_)));
    assert!(refused.to_string().contains("not positive"), "{refused}");
}

/// The book's program of a fit is as short as it says.
#[test]
fn a_fit_is_a_short_program() {
    let book = include_str!("../../book/src/sensitivities.md");
    let start = book.find("use metriplectic::prelude::*;\n\nfn main").expect("a program");
    let lines = book[start..].lines().take_while(|line| !line.starts_with("```")).count();
    println!("{lines} lines");
    assert!(lines <= 40);
}
