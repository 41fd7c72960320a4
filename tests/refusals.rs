//! Models and starts that every method refuses, with a sentence that names the numbers, and motions that end on their
//! way.

#[path = "models/methods.rs"]
mod methods;
#[path = "models/stages.rs"]
mod stages;

use metriplectic::dynamics::system::Point;
use metriplectic::integrators::RunError;
use metriplectic::prelude::*;

use methods::Any;

type Field3 = Box<dyn Fn(&Vector3<Real>) -> Real>;
type Form3 = Box<dyn Fn(&Vector3<Real>) -> Matrix3<Real>>;

/// Boxes, so that one system serves all choices of its functions.
fn field(f: impl Fn(&Vector3<Real>) -> Real + 'static) -> Field3 {
    Box::new(f)
}

fn form(f: impl Fn(&Vector3<Real>) -> Matrix3<Real> + 'static) -> Form3 {
    Box::new(f)
}

fn energy() -> Field3 {
    field(|p| p.x * p.x * 0.05 + p.y * p.y * 0.1 + p.z * p.z * 0.5)
}

fn entropy() -> Field3 {
    field(|p| p.norm_squared() * 0.5)
}

const MOVING: Vector3<f64> = Vector3::new(0.001, -1.0, 0.001);
const ORIGIN: Vector3<f64> = Vector3::new(0.0, 0.0, 0.0);

/// Starts a run by every method, each of which refuses in a sentence with these parts.
fn refuses<Y: Metriplectic>(system: &Y, start: &Point<Y>, parts: &[&str]) {
    for method in Any::all(WeylMidpoint) {
        let steps = method.steps(system, start.clone(), Span::steps(0.1, 10));
        let sentence = match steps {
            Err(error) => error.to_string(),
            Ok(_) => panic!("{method:?} does not refuse: {parts:?}"),
        };
        for part in parts {
            assert!(sentence.contains(part), "{method:?}: no {part:?} in {sentence:?}");
        }
    }
}

#[test]
fn functions_and_starts_without_sense_are_refused_by_every_method() {
    let nan = || field(|p| p.x * f64::NAN);
    let body = |energy, entropy| {
        System::on(LieDual::so3()).energy(energy).entropy(entropy).build().expect("it is built")
    };
    let sound = body(energy(), entropy());
    for (bad, name) in [(f64::NAN, "NaN"), (f64::INFINITY, "inf"), (f64::NEG_INFINITY, "-inf")] {
        refuses(&sound, &vector![0.1, bad, 0.2], &["the start: entry 1", name]);
    }
    refuses(&body(nan(), entropy()), &MOVING, &["the energy is NaN at", "0.001"]);
    refuses(&body(energy(), nan()), &MOVING, &["the entropy is NaN at", "0.001"]);
    let pointed = body(field(|p| p.norm() + p.x), entropy());
    refuses(&pointed, &ORIGIN, &["the energy has a finite value", "norm_squared"]);
    let leaning = body(energy(), field(|p| p.x * 0.1));
    refuses(&leaning, &MOVING, &["not a Casimir", "SecondLaw::Published"]);
}

#[test]
fn metrics_and_brackets_without_sense_are_refused_by_every_method() {
    let with_metric = |g: Form3| {
        let body = System::on(LieDual::so3()).metric(Metric::field(g));
        body.energy(energy()).entropy(entropy()).build().expect("it is built")
    };
    let with_bracket = |tensor: Form3| {
        let body = System::on(LieDual::so3()).bracket(Poisson::field(tensor));
        body.energy(energy()).build().expect("it is built")
    };
    let one = |factor: Real| Matrix3::from_diagonal_element(factor);
    let hat = |factor: Real| Vector3::x().cross_matrix() * factor;
    let indefinite = |_: &_| Matrix3::from_diagonal(&vector![1.0, -1.0, 1.0]).cast();
    refuses(&with_metric(form(indefinite)), &MOVING, &["pivot 1", "-1"]);
    let asymmetric = |_: &_| Matrix3::new(1.0, 0.3, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0).cast();
    refuses(&with_metric(form(asymmetric)), &MOVING, &["symmetric"]);
    refuses(&with_metric(form(move |p| one(p.x * f64::NAN))), &ORIGIN, &["the metric is NaN"]);
    let pointed = form(move |p| one(p.norm() + 1.0));
    refuses(&with_metric(pointed), &ORIGIN, &["the metric has a finite value", "[0.0, 0.0, 0.0]"]);
    refuses(&with_bracket(form(move |p| hat(p.x * f64::NAN))), &ORIGIN, &["the bracket is NaN"]);
    let pointed = form(move |p| hat(p.norm() + 1.0));
    refuses(&with_bracket(pointed), &ORIGIN, &["the bracket has a finite value"]);
    refuses(&with_bracket(form(move |p| one(p.y))), &MOVING, &["not skew"]);
    // hat(v) is Poisson only if v · curl v = 0; here it is p₃ · 1.
    let rolling = |p: &Vector3<Real>| Vector3::new(-p.y, p.z * 0.0, 1.0.into()).cross_matrix();
    refuses(&with_bracket(form(rolling)), &MOVING, &["Jacobi identity", "AlmostPoisson"]);
}

#[test]
fn a_dissipation_that_changes_an_invariant_is_refused_by_every_method() {
    // K = |w|² − w wᵀ annihilates w, and nothing else.
    let friction = |_: &Vector3<Real>, w: &Vector3<Real>| {
        Matrix3::from_diagonal_element(w.norm_squared()) - w * w.transpose()
    };
    let system = System::on(Euclidean::<3>)
        .energy(field(|x| x.x))
        .entropy(field(|x| x.y))
        .casimir(field(|x| x.z))
        .dissipation(FieldDissipation(friction))
        .build()
        .expect("it is built");
    // K = diag(0, 1, 1), and K dL has the norm 1.
    refuses(
        &system,
        &vector![0.1, 0.2, 0.3],
        &["the dissipation changes an invariant", "K dL is 1.0e0"],
    );
}

/// `x' = −1`, `y' = 1/x` along `H = ln x + y`: the flow from (1, 0) reaches the edge of the logarithm at t = 1.
#[test]
fn a_run_into_the_edge_of_a_logarithm_ends_there_by_every_method() {
    let system = System::on(Euclidean::<2>)
        .energy(|x: &Vector2<Real>| x.x.ln() + x.y)
        .entropy(|x: &Vector2<Real>| -x.x)
        .build()
        .expect("it is a system");
    let spans = [
        Span::steps(0.1, 100).every(7).into(),
        Span::until(2.0).tolerance(1e-4).least_step(1e-6).into(),
    ];
    for (method, span) in Any::all(WeylMidpoint).into_iter().flat_map(|method| {
        spans.iter().map(move |span: &metriplectic::integrators::Schedule| (method, span))
    }) {
        let error = match method.run(&system, vector![1.0, 0.0], span.clone()) {
            Err(error @ RunError::Step { .. }) => error,
            other => panic!("{method:?}: {other:?}"),
        };
        let trajectory = error.trajectory().expect("it has started");
        let (end, certificate) = (trajectory.last(), trajectory.certificate());
        println!("{method:?}: {error}");
        // The last state is there although seven does not divide its number.
        assert!(end.step == certificate.steps && end.step > 7, "{method:?}: {error}");
        assert!(end.point.x > 0.0 && end.point.x < 0.2, "{method:?}: {error} at {}", end.point);
        assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{method:?}: {error}");
        let taken = format!("{} steps were taken", end.step);
        assert!(error.to_string().contains(&taken), "{method:?}: {error}");
    }
    refuses(&system, &vector![-2.5, 1.0], &["energy", "-2.5", "start where"]);
}

/// A pendulum beside an entropy at the temperature 300, in a unit of momentum, energy and entropy.
fn insulated(unit: f64) -> impl Metriplectic<Manifold = Product<Euclidean<2>, Euclidean<1>>> {
    System::on(Product(Euclidean::<2>, Euclidean::<1>))
        .bracket((Symplectic, Zero))
        .energy(move |(x, s): &(Vector2<Real>, Vector1<Real>)| {
            x.y * x.y * (0.5 / unit) - x.x.cos() * unit + s.x * 300.0
        })
        .entropy(|(_, s): &(Vector2<Real>, Vector1<Real>)| s.x)
        .dissipation(NoDissipation)
        .build()
        .expect("it is built")
}

#[test]
fn an_entropy_that_nothing_produces_is_a_constant_of_every_method() {
    for unit in [1.0, 1e-23] {
        let system = insulated(unit);
        // A swing, rest below, and a start where the energy is zero.
        for (q, s) in [(1.5_f64, 0.1), (0.0, 0.1), (0.7, 0.7_f64.cos() / 300.0)] {
            let start = (vector![q, 0.0], vector![s * unit]);
            let swing = unit_pendulum(q, 2.0);
            for method in Any::all(WeylMidpoint) {
                let run = method.run(&system, start, Span::steps(0.01, 200));
                let run = run.unwrap_or_else(|error| panic!("{method:?} of {q}: {error}"));
                let certificate = run.certificate();
                assert!(certificate.keeps_energy(), "{method:?} of {q}: {certificate}");
                assert!(certificate.keeps_entropy(), "{method:?} of {q}: {certificate}");
                let (x, s) = &run.last().point;
                let moved = (s - start.1).amax(); // by the last digits of the energy, H/300
                assert!(moved <= 8.0 * f64::EPSILON * start.1.x, "{method:?} of {q}: {moved:e}");
                assert!((x.x - swing).abs() < 2e-3, "{method:?} of {q}: {} {swing}", x.x);
            }
        }
    }
}

/// The angle of a pendulum `q'' = −sin q` that starts at rest, after a time: Störmer's rule in small steps.
fn unit_pendulum(q: f64, time: f64) -> f64 {
    let (steps, mut q, mut p) = (20_000, q, 0.0);
    let h = time / f64::from(steps);
    for _ in 0..steps {
        p -= 0.5 * h * q.sin();
        q += h * p;
        p -= 0.5 * h * q.sin();
    }
    q
}
