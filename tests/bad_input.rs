//! Bad input: each kind has its error, which names the numbers. The models and spans that every method refuses are in
//! `refusals.rs` and `problems/promises.rs`.

mod models;

use std::time::{Duration, Instant};

use metriplectic::dynamics::{BuildError, PoissonError};
use metriplectic::integrators::{RunError, StepError};
use metriplectic::manifolds::{AlgebraError, MetricError, PointError};
use metriplectic::prelude::*;
use models::{TUMBLING, UNSTABLE, boxed, free_body, half_square, kinetic, relaxing_body};

const INERTIA: Vector3<f64> = Vector3::new(10.0, 5.0, 1.0);
/// Function pointers and boxes, so that one compiled system serves all choices of the fields.
type Field3 = fn(&Vector3<Real>) -> Real;

fn body_energy(p: &Vector3<Real>) -> Real {
    kinetic(INERTIA)(p)
}

type Form3 = Box<dyn Fn(&Vector3<Real>) -> Matrix3<Real>>;

fn form(f: impl Fn(&Vector3<Real>) -> Matrix3<Real> + 'static) -> Form3 {
    Box::new(f)
}

const TEN_STEPS: Span = Span::steps(0.1, 10);

/// What a run of the model says that it should refuse.
fn refused<Y: Metriplectic<Manifold = LieDual<3>>>(system: &Y, x0: Vector3<f64>) -> ModelError
where
    WeylMidpoint: Retraction<LieDual<3>, Y::Metric>,
{
    match WeylMidpoint.run(system, x0, TEN_STEPS) {
        Err(RunError::Model(error)) => error,
        Err(other) => panic!("another error: {other}"),
        Ok(_) => panic!("the run should be refused"),
    }
}

#[test]
fn bad_metrics_are_refused() {
    let indefinite = Matrix3::from_diagonal(&vector![1.0, -1.0, 1.0]);
    let asymmetric = Matrix3::new(1.0, 0.3, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    assert!(matches!(Metric::constant(indefinite), Err(MetricError::NotPositive(_))));
    assert!(matches!(Metric::constant(asymmetric), Err(MetricError::NotSymmetric { .. })));
    assert!(matches!(
        Metric::constant(Matrix3::repeat(f64::NAN)),
        Err(MetricError::EntryNotFinite { row: 0, column: 0, value }) if value.is_nan()
    ));
    let with = |g: Matrix3<f64>| {
        let system = System::on(LieDual::so3())
            .metric(Metric::field(form(move |_: &Vector3<Real>| g.cast::<Real>())))
            .energy(body_energy as Field3)
            .entropy(half_square as Field3)
            .build()
            .unwrap();
        match refused(&system, UNSTABLE) {
            ModelError::Metric { source, .. } => source,
            other => panic!("another error: {other}"),
        }
    };
    assert!(matches!(with(indefinite), MetricError::NotPositive(_)));
    assert!(matches!(with(asymmetric), MetricError::NotSymmetric { row: 1, column: 0, .. }));
}

#[test]
fn a_metric_that_ends_nearby_stops_the_run_with_what_it_has() {
    // g = 1 + 2p₁ is positive at the start and for p₁ > −½, and the body turns towards −1.41.
    let system = System::on(LieDual::so3())
        .metric(Metric::field(form(|p| Matrix3::from_diagonal_element(p.x * 2.0 + 1.0))))
        .energy(body_energy as Field3)
        .entropy(half_square as Field3)
        .build()
        .unwrap();
    let error = WeylMidpoint.run(&system, UNSTABLE, Span::steps(0.1, 2000)).unwrap_err();
    let Some(trajectory) = error.trajectory() else { panic!("no trajectory: {error}") };
    let end = trajectory.last();
    assert!(end.point.x > -0.5 && end.point.x < -0.3, "{error} at {}", end.point);
    assert!(trajectory.certificate().keeps_energy());
}

#[test]
fn an_absurd_step_ends_soon_in_an_error_with_the_trajectory_so_far() {
    let begin = Instant::now();
    let error = WeylMidpoint.run(&relaxing_body(), UNSTABLE, Span::steps(1e300, 10)).unwrap_err();
    assert!(begin.elapsed() < Duration::from_secs(10));
    let RunError::Step { cause, trajectory } = &error else { panic!("another error: {error}") };
    let h = match cause {
        StepError::NotConverged { h, .. } | StepError::OutOfDomain { h, .. } => *h,
        other => panic!("another cause: {other}"),
    };
    assert!(h > 1e299);
    assert_eq!(trajectory.last().point, UNSTABLE);
    // The same error arrives as the one type that programs pass on.
    let passed_on = Error::from(error.clone());
    assert_eq!(passed_on.to_string(), error.to_string());
}

#[test]
fn a_run_that_fails_on_its_way_keeps_what_it_has() {
    // The entropy climbs without bound along H = 1, and blows up in finite time.
    let system = System::on(LieDual::so3())
        .energy((|p: &Vector3<Real>| p.x.powi(2) * 0.5 + p.y.powi(2) * 0.25 + p.z.exp()) as Field3)
        .entropy((|p: &Vector3<Real>| p.norm_squared().powi(2)) as Field3)
        .build()
        .unwrap();
    let start = vector![0.5, -0.3, -0.1];
    let error = WeylMidpoint.run(&system, start, Span::steps(0.1, 100_000)).unwrap_err();
    let Some(trajectory) = error.trajectory() else { panic!("no trajectory: {error}") };
    let taken = trajectory.certificate().steps;
    assert!(taken > 0 && trajectory.last().step == taken, "{error}");
    assert!(trajectory.certificate().keeps_energy());
    let RunError::Step { cause, .. } = &error else { panic!("another error: {error}") };
    assert!(cause.to_string().contains(&format!("t = {:.6}", trajectory.last().time)), "{cause}");
}

/// `x' = −1`, `y' = 1/x` along `H = ln x + y`: the exact flow from (1, 0) reaches the edge of the
/// logarithm at t = 1.
fn doomed() -> impl Metriplectic<Manifold = Euclidean<2>, Metric = Canonical> {
    System::on(Euclidean::<2>)
        .energy(boxed(|x: &Vector2<Real>| x.x.ln() + x.y))
        .entropy(boxed(|x: &Vector2<Real>| -x.x))
        .build()
        .expect("the doomed system is a system")
}

#[test]
fn a_run_into_the_edge_of_a_logarithm_ends_there() {
    let error =
        WeylMidpoint.run(&doomed(), vector![1.0, 0.0], Span::steps(0.1, 100).every(7)).unwrap_err();
    let Some(trajectory) = error.trajectory() else { panic!("no trajectory: {error}") };
    // The last state is there although seven does not divide its number.
    let end = trajectory.last();
    assert!((8..=12).contains(&end.step) && end.step == trajectory.certificate().steps, "{error}");
    assert!(end.point.x > 0.0 && end.point.x < 0.2, "{error} at {}", end.point);
    assert!((end.point.x.ln() + end.point.y).abs() <= 50.0 * f64::EPSILON);
    assert!(trajectory.certificate().keeps_energy() && trajectory.certificate().keeps_entropy());
    assert!(error.to_string().contains(&format!("{} steps were taken", end.step)), "{error}");
    // The iterator gives the same states, the error once, and then ends.
    let system = doomed();
    let mut steps = WeylMidpoint.steps(&system, vector![1.0, 0.0], 0.1).unwrap();
    let taken = steps.by_ref().take_while(Result::is_ok).count();
    assert_eq!(taken, end.step);
    assert!(steps.next().is_none());
}

#[test]
fn no_step_ends_on_the_edge_of_a_logarithm() {
    // q' = 1 for H = p + ln(1 − q): the flow reaches q = 1 at t = 1, in the middle of a step.
    let system = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(boxed(|x: &Vector2<Real>| x.y + (-x.x + 1.0).ln()))
        .build()
        .unwrap();
    for h in [0.15, 0.3, 0.7] {
        let error = WeylMidpoint.run(&system, vector![0.0, 1.0], Span::steps(h, 10)).unwrap_err();
        let Some(trajectory) = error.trajectory() else { panic!("no trajectory: {error}") };
        let (end, certificate) = (trajectory.last(), trajectory.certificate());
        assert!(end.point.x < 1.0, "h = {h}: {error}");
        // As far as H has digits there: ε |dH| is the rounding of x.
        let steep = (1.0 - end.point.x).recip();
        let allowed = 50.0 * f64::EPSILON * steep.max(1.0);
        assert!(certificate.max_energy_error <= allowed, "h = {h}: {certificate}");
    }
}

#[test]
fn a_span_without_end_is_run_until_the_model_ends() {
    // How many states a run will record is no reason to ask for the memory beforehand.
    for span in [Span::steps(0.1, usize::MAX), Span::steps(0.1, usize::MAX).every(1000)] {
        let error = WeylMidpoint.run(&doomed(), vector![1.0, 0.0], span).unwrap_err();
        assert!(error.trajectory().is_some_and(|trajectory| trajectory.last().step > 7), "{error}");
    }
}

#[test]
fn a_state_as_small_or_large_as_a_number_can_be_is_integrated() {
    // The free body has no scale: from s p₀ with steps h/s it takes the steps of p₀, times s.
    let unit = WeylMidpoint.run(&free_body(), TUMBLING, Span::steps(0.1, 10)).unwrap();
    for s in [1e-100, 1e-60, 1e60, 1e100] {
        let run = WeylMidpoint.run(&free_body(), TUMBLING * s, Span::steps(0.1 / s, 10));
        let end = run.unwrap_or_else(|error| panic!("at scale {s:e}: {error}")).last().point;
        // Ten steps, each with a few roundings of |p|.
        let off = (end / s - unit.last().point).norm();
        assert!(off <= 50.0 * f64::EPSILON, "at scale {s:e}: off by {off:.1e}");
    }
}

#[test]
fn an_entropy_that_is_no_casimir_is_refused_unless_the_published_scheme_is_asked_for() {
    let builder = || {
        System::on(LieDual::so3())
            .energy(body_energy as Field3)
            .entropy((|p: &Vector3<Real>| p.x * 0.1) as Field3)
    };
    let error = refused(&builder().build().unwrap(), UNSTABLE);
    let ModelError::EntropyNotCasimir { point, size } = &error else { panic!("{error}") };
    assert!(point.len() == 3 && *size > 0.1);
    assert!(error.to_string().contains("SecondLaw::Published"));

    let published = builder().second_law(SecondLaw::Published).build().unwrap();
    let run = WeylMidpoint.run(&published, UNSTABLE, Span::steps(0.1, 100)).unwrap();
    assert!(run.certificate().to_string().contains("second law: not promised"));
    assert!(run.certificate().keeps_energy());
}

#[test]
fn bad_brackets_are_refused() {
    assert!(matches!(
        Poisson::constant(Matrix2::new(0.0, 1.0, 1.0, 0.0)),
        Err(PoissonError::NotSkew { .. })
    ));
}

#[test]
fn bad_structure_constants_are_refused() {
    let mut constants = [[[0.0; 3]; 3]; 3];
    constants[0][1][2] = 1.0;
    let error = LieDual::new(&constants).unwrap_err();
    assert!(matches!(error, AlgebraError::NotAntisymmetric { a: 0, b: 1, d: 2, .. }));
    constants[1][0][2] = f64::NAN;
    let error = LieDual::new(&constants).unwrap_err();
    assert!(matches!(error, AlgebraError::NotFinite { a: 1, b: 0, d: 2, .. }));
    // [e₀, e₁] = e₂, [e₀, e₂] = e₀: antisymmetric, but [[e₀, e₁], e₂] + cyclic = −[e₀, e₁] = −e₂ ≠ 0.
    let mut constants = [[[0.0; 3]; 3]; 3];
    (constants[0][1][2], constants[1][0][2]) = (1.0, -1.0);
    (constants[0][2][0], constants[2][0][0]) = (1.0, -1.0);
    let error = LieDual::new(&constants).unwrap_err();
    assert_eq!(error, AlgebraError::NoJacobiIdentity { a: 0, b: 1, c: 2, d: 2, size: 1.0 });
    // Matrices that are no basis, and matrices whose commutators leave their span.
    let [a, b] = [Matrix2::new(0.0, 1.0, 0.0, 0.0), Matrix2::new(0.0, 0.0, 1.0, 0.0)];
    let error = LieAlgebra::of_matrices(&[a, a * 2.0]).unwrap_err();
    assert_eq!(error, AlgebraError::NotIndependent);
    let error = LieAlgebra::of_matrices(&[a, b]).unwrap_err();
    assert!(matches!(error, AlgebraError::NotClosed { a: 0, b: 1, .. }), "{error}");
}

#[test]
fn a_system_in_which_nothing_moves_is_not_built() {
    let error =
        System::on(Euclidean::<2>).energy(boxed(|x: &Vector2<Real>| x.x)).build().unwrap_err();
    assert_eq!(error, BuildError::NothingMoves);
    let error = System::on(LieDual::so3())
        .energy(body_energy as Field3)
        .second_law(SecondLaw::Exact)
        .build()
        .unwrap_err();
    assert_eq!(error, BuildError::SecondLawWithoutEntropy);
}

#[test]
fn a_model_is_judged_only_inside_its_domain() {
    // The start is closer to the edge of the logarithm than the samples reach, a tenth of an entry.
    let system = System::on(Euclidean::<2>)
        .energy(boxed(|x: &Vector2<Real>| x.x + x.y))
        .entropy(boxed(|x: &Vector2<Real>| (x.x - 1.0).ln() + x.y.ln()))
        .build()
        .unwrap();
    let start = vector![1.01, 2.0];
    let report = system.report(&start);
    assert!(report.passed_over > 0 && report.verdict.is_ok(), "{report}");
    assert_eq!(report.judged, 17);
    let run = WeylMidpoint.run(&system, start, Span::steps(1e-3, 100)).unwrap();
    assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
    // Nor is it judged beyond the edge of an open chart, where this metric is not positive.
    let chart = Chart::<2>::new(|q| q.x > 1.0);
    let metric =
        |q: &Vector2<Real>| Matrix2::new((q.x - 1.0).recip(), 0.0.into(), 0.0.into(), 1.0.into());
    let plane = System::on(chart)
        .metric(Metric::field(metric))
        .bracket(AreaForm)
        .energy(boxed(|q: &Vector2<Real>| q.x.powi(2) + q.y.powi(2)))
        .build()
        .unwrap();
    let report = plane.report(&vector![1.05, 1.0]);
    assert!(report.passed_over > 0 && report.judged == 17 && report.verdict.is_ok(), "{report}");
    // Outside the domain altogether it is refused.
    let error = WeylMidpoint.run(&system, vector![-1.0, 2.0], TEN_STEPS).unwrap_err();
    let RunError::Model(ModelError::ValueNotFinite { field, .. }) = &error else {
        panic!("another error: {error}")
    };
    assert_eq!(*field, "entropy");
}

#[test]
fn a_point_off_its_manifold_says_how_far() {
    let system = System::on(Sphere::<2>::round())
        .bracket(AreaForm)
        .energy(boxed(|x: &Vector3<Real>| x.x))
        .build()
        .unwrap();
    let error = WeylMidpoint.run(&system, vector![1.0, 0.1, 0.0], TEN_STEPS).unwrap_err();
    let RunError::Model(ModelError::Start(PointError::OffManifold { defect, .. })) = error else {
        panic!("another error: {error}")
    };
    assert!((defect - (1.01_f64.sqrt() - 1.0)).abs() < 1e-15);
}

#[test]
fn every_error_passes_on_with_a_question_mark() {
    fn program(h: f64) -> Result<Certificate, Error> {
        let metric = Metric::constant(Matrix3::identity())?;
        let algebra = LieDual::new(&[[[0.0; 3]; 3]; 3])?;
        let system = System::on(algebra)
            .metric(metric)
            .bracket(Poisson::constant(Vector3::x().cross_matrix())?)
            .energy(half_square)
            .build()?;
        Ok(WeylMidpoint.run(&system, UNSTABLE, Span::steps(h, 10))?.certificate().clone())
    }
    assert!(program(0.1).is_ok());
    assert!(matches!(program(-0.1), Err(Error::Span(_))));
    // A run that stopped arrives with its trajectory.
    let stopped = WeylMidpoint.run(&doomed(), vector![1.0, 0.0], Span::steps(0.1, 100));
    let Err(Error::Run(source)) = stopped.map_err(Error::from) else { panic!("the run stops") };
    let error = source.downcast::<RunError<Euclidean<2>>>().unwrap();
    assert!(error.trajectory().is_some_and(|trajectory| trajectory.last().step > 7));
}

#[test]
fn a_step_that_fails_passes_on_with_a_question_mark() {
    fn program(h: f64) -> Result<Vector3<f64>, Error> {
        let body = relaxing_body();
        let mut steps = WeylMidpoint.steps(&body, UNSTABLE, h)?;
        Ok(steps.advance()?.point)
    }
    assert!(program(0.1).is_ok());
    // No domain has an edge here: it is the solver that finds nothing.
    assert!(matches!(program(1e300), Err(Error::Step(StepError::NotConverged { .. }))));
}

#[test]
fn errors_returned_from_main_are_printed_as_sentences() {
    let run = |h: f64| WeylMidpoint.run(&relaxing_body(), UNSTABLE, Span::steps(h, 10));
    let same = |debug: String, display: String| assert_eq!(debug, display);
    let error = run(1e300).unwrap_err();
    same(format!("{error:?}"), error.to_string());
    let RunError::Step { cause, .. } = &error else { panic!("another error: {error}") };
    same(format!("{cause:?}"), cause.to_string());
    let error = Error::from(error);
    same(format!("{error:?}"), error.to_string());
    let error = refused(&relaxing_body(), vector![0.1, f64::NAN, 0.2]);
    same(format!("{error:?}"), error.to_string());
    let error: Box<dyn std::error::Error> = Error::from(error).into();
    assert!(format!("{error:?}").starts_with("the start: entry 1 of the point is NaN"));
}

#[test]
fn errors_are_sentences_with_the_numbers() {
    let run = |h: f64| WeylMidpoint.run(&relaxing_body(), UNSTABLE, Span::steps(h, 10));
    let indefinite = Matrix3::from_diagonal(&vector![1.0, -3.0, 1.0]);
    let skew = Matrix2::new(0.0, 1.0, -0.75, 0.0);
    let not_a_number = WeylMidpoint.run(&relaxing_body(), vector![0.1, f64::NAN, 0.2], TEN_STEPS);
    let outside = WeylMidpoint.run(&doomed(), vector![-2.5, 1.0], TEN_STEPS);
    let mut constants = [[[0.0; 2]; 2]; 2];
    constants[0][1][1] = 0.125;
    let table: [(Error, &[&str]); 7] = [
        (run(-0.25).unwrap_err().into(), &["step size", "-0.25", "positive"]),
        (run(1e300).unwrap_err().into(), &["1.000e300", "t = 0", "smaller step"]),
        (Metric::constant(indefinite).unwrap_err().into(), &["pivot 1", "-3.000e0"]),
        (Poisson::constant(skew).unwrap_err().into(), &["(0, 1)", "2.500e-1"]),
        (not_a_number.unwrap_err().into(), &["entry 1", "NaN"]),
        (outside.unwrap_err().into(), &["energy", "-2.5", "start where"]),
        (LieDual::new(&constants).unwrap_err().into(), &["C_(0,1)^1", "1.250e-1", "antisymmetric"]),
    ];
    for (error, parts) in table {
        let text = error.to_string();
        for part in parts {
            assert!(text.contains(part), "\"{part}\" is missing in: {text}");
        }
    }
}

#[test]
fn a_step_out_of_an_open_chart_is_an_error_with_the_trajectory_so_far() {
    // x' = −1 towards the edge x = 0 of the chart, where the fields themselves go on.
    let system = System::on(Chart::<2>::new(|q| q.x > 0.0))
        .energy(boxed(|q: &Vector2<Real>| q.y))
        .entropy(boxed(|q: &Vector2<Real>| -q.x))
        .build()
        .unwrap();
    let error = WeylMidpoint.run(&system, vector![1.0, 0.5], Span::steps(0.1, 100)).unwrap_err();
    let end = error.trajectory().expect("a trajectory").last();
    assert!(end.point.x > 0.0 && end.point.x < 0.2 && end.step >= 8, "{error}");
    let outside = WeylMidpoint.run(&system, vector![-1.0, 0.5], TEN_STEPS).unwrap_err();
    assert!(outside.to_string().contains("chart"), "{outside}");
}
