//! The problems.

use std::f64::consts::FRAC_1_SQRT_2;

use metriplectic_dynamics::{
    AreaForm, MetricDissipation, Metriplectic, Nambu, Scaled, SecondLaw, Symplectic, System, Zero,
};
use metriplectic_fields::Real;
use metriplectic_manifolds::{
    Canonical, Cayley, ChartMidpoint, Euclidean, Exponential, HalfLine, LieDual, Metric, Product,
    Projection, Retraction, Rotations, Sphere, WeylMidpoint, rotations,
};
use nalgebra::{Matrix2, Matrix3, Matrix6, SVector, Vector1, Vector2, Vector3, Vector6, vector};
use num_dual::DualNum;

use super::{Constants, Problem, Study};
use crate::Either;

/// The spinning top's energy on S² (Celledoni, Eidnes, Owren, Ringholm 2019, example 1).
fn top(x: &Vector3<Real>) -> Real {
    let weights = [1.0, 0.5, 0.25];
    (0..3).map(|i| (x[i].powi(2) + x[i].powi(3) * (2.0 / 3.0)) * (0.5 * weights[i])).sum()
}

fn hill(x: &Vector3<Real>) -> Real {
    x.z + x.x * x.y * 0.3
}

fn tilt(x: &Vector3<Real>) -> Real {
    x.x - x.y * x.z * 0.2
}

/// `Σ a_i x_i² + b_i x_i³` with coefficients that no symmetry relates.
fn bumpy<const A: usize>(x: &SVector<Real, A>) -> Real {
    (0..A)
        .map(|i| {
            let k = i as f64;
            x[i].powi(2) * (0.5 + 0.3 * k) + x[i].powi(3) * (0.3 - 0.1 * k)
        })
        .sum()
}

/// `x_n + ⅓ Σ x_i x_{i+1}`.
fn slope<const A: usize>(x: &SVector<Real, A>) -> Real {
    (0..A - 1).map(|i| x[i] * x[i + 1] * (1.0 / 3.0)).sum::<Real>() + x[A - 1]
}

/// Two Casimirs on S⁵.
fn first_twist(x: &Vector6<Real>) -> Real {
    x[0] * x[3] - x[1] * x[4] * 0.5
}

fn second_twist(x: &Vector6<Real>) -> Real {
    x[2] + x[1] * x[5]
}

fn body_energy(p: &Vector3<Real>) -> Real {
    p.x.powi(2) * 0.05 + p.y.powi(2) * 0.1 + p.z.powi(2) * 0.5
}

fn heavy_energy((r, p): &(Matrix3<Real>, Vector3<Real>)) -> Real {
    p.x.powi(2) * 0.5 + p.y.powi(2) * 0.25 + p.z.powi(2) * (1.0 / 6.0) + r.m33 * 0.7 + r.m31 * 0.2
}

fn rotation_energy(r: &Matrix3<Real>) -> Real {
    r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5
}

fn rotation_entropy(r: &Matrix3<Real>) -> Real {
    r.m13 - r.m21 * 0.5 + (r.m31 + r.m32).powi(2) * 0.25
}

/// A field with a constant. Its type names no study: a closure in a function of a study would be compiled with each.
fn plus<X>(f: fn(&X) -> Real, constant: f64) -> impl Fn(&X) -> Real + Copy {
    move |x| f(x) + constant
}

/// A metric of SO(3) in the frame of the body, which may depend on the attitude.
fn inertia(full: Matrix3<f64>, leaning: f64) -> impl Fn(&Matrix3<Real>) -> Matrix3<Real> + Copy {
    move |r| {
        let lean = r.column(2).into_owned();
        full.cast::<Real>() + lean * lean.transpose() * Real::from(leaning)
    }
}

/// A metric of SO(3) × R³ that leans with the attitude.
fn leaning_metric((r, _): &(Matrix3<Real>, Vector3<Real>)) -> Matrix6<Real> {
    let mut g = Matrix6::identity();
    let lean = Vector6::new(r.m13, r.m23, r.m33, Real::from(0.5), r.m31, Real::from(0.0));
    g += lean * lean.transpose() * Real::from(0.3);
    g
}

/// A point of norm 1 off every axis.
fn off_axis<const A: usize>() -> SVector<f64, A> {
    SVector::<f64, A>::from_fn(|i, _| 1.0 + 0.3 * i as f64).normalize()
}

/// A point at which `Σ a_i x_i² + b_i x_i³` has no slope along the sphere.
fn last_axis<const A: usize>() -> SVector<f64, A> {
    SVector::<f64, A>::from_fn(|i, _| if i + 1 == A { 1.0 } else { 0.0 })
}

fn attitude() -> Matrix3<f64> {
    rotations::exp(&vector![0.3, -0.2, 0.5])
}

const CANONICAL: &str = "canonical";

/// Visits every problem.
pub fn each(study: &mut impl Study) {
    each_with(study, Constants::default());
}

/// Visits every problem, with these constants in its energy and entropy: they change no motion.
pub fn each_with(study: &mut impl Study, constants: Constants) {
    canonical(study, constants);
    closures(study, constants);
    products(study, constants);
}

/// Both geodesic retractions, as one type: the code of a study is made once for each problem.
fn geodesic<Y: Metriplectic>(study: &mut impl Study, problem: &Problem<Y>) {
    type Geodesic = Either<WeylMidpoint, Exponential>;
    study.visit(problem, "Weyl midpoint", Geodesic::First(WeylMidpoint), 2.0);
    study.visit(problem, "exponential", Geodesic::Second(Exponential), 1.0);
}

/// A retraction under its name in a study.
#[derive(Clone, Copy)]
struct Named<R> {
    scheme: &'static str,
    retraction: R,
}

/// Both geodesic retractions, and further ones of order 2, as one type.
fn with<Y: Metriplectic, R>(study: &mut impl Study, problem: &Problem<Y>, further: &[Named<R>])
where
    R: Retraction<Y::Manifold, Y::Metric> + Copy,
{
    type Any<R> = Either<Either<WeylMidpoint, Exponential>, R>;
    let first = |retraction| Any::<R>::First(retraction);
    study.visit(problem, "Weyl midpoint", first(Either::First(WeylMidpoint)), 2.0);
    study.visit(problem, "exponential", first(Either::Second(Exponential)), 1.0);
    for &Named { scheme, retraction } in further {
        study.visit(problem, scheme, Any::Second(retraction), 2.0);
    }
}

/// The retractions for a metric from a closure: those of its geodesics, the chart midpoint, and one of the
/// manifold's own.
fn all<Y: Metriplectic, R>(
    study: &mut impl Study,
    problem: &Problem<Y>,
    scheme: &'static str,
    retraction: R,
) where
    R: Retraction<Y::Manifold, Y::Metric> + Copy,
{
    type Cheap<R> = Either<ChartMidpoint, R>;
    let chart = Named { scheme: BY_THE_CHART.scheme, retraction: Cheap::First(ChartMidpoint) };
    let own = Named { scheme, retraction: Cheap::Second(retraction) };
    with(study, problem, &[chart, own]);
}

const BY_THE_CHART: Named<ChartMidpoint> =
    Named { scheme: "chart midpoint", retraction: ChartMidpoint };

/// Canonical metrics.
pub(super) fn canonical(study: &mut impl Study, constants: Constants) {
    let Constants { energy: h, entropy: s } = constants;
    let problem = |name, manifold, time| (name, manifold, CANONICAL, time);
    macro_rules! visit {
        ($labels:expr, $start:expr, $rest:expr, $strides:expr, $system:expr, $scheme:literal by $retraction:expr) => {
            visit!(@ $labels, $start, $rest, $strides, $system, |study, problem| {
                with(study, problem, &[Named { scheme: $scheme, retraction: $retraction }])
            })
        };
        ($labels:expr, $start:expr, $rest:expr, $strides:expr, $system:expr) => {
            visit!(@ $labels, $start, $rest, $strides, $system, geodesic)
        };
        (@ $labels:expr, $start:expr, $rest:expr, $strides:expr, $system:expr, $all:expr) => {{
            let (name, manifold, metric, time) = $labels;
            let system = $system.build().expect("a problem is a system");
            let (start, rest, strides) = ($start, $rest, $strides.to_vec());
            let problem = Problem { name, manifold, metric, system, start, rest, time, strides };
            $all(study, &problem);
        }};
    }
    visit!(
        problem("rigid body", "so(3)*", 10.0),
        vector![0.1, -1.0, 0.2],
        Vector3::zeros(),
        [(vector![1.0, -0.3, -0.8], 2.0)],
        System::on(LieDual::so3())
            .energy(plus(body_energy, h))
            .entropy(plus(|p: &Vector3<Real>| p.norm_squared() * 0.5, s))
    );
    let sphere = || System::on(Sphere::<2>::round()).energy(plus(top, h));
    let diagonal = Vector3::from_element(3.0_f64.sqrt().recip());
    visit!(
        problem("spinning top", "S²", 5.0),
        diagonal,
        Vector3::z(),
        [(vector![0.6, -1.2], 4.0)],
        sphere().bracket(AreaForm),
        "projection" by Projection
    );
    visit!(
        problem("relaxation", "S²", 3.0),
        diagonal,
        Vector3::z(),
        [(vector![-0.4, 1.1], 4.0)],
        System::on(Sphere::<2>::round())
            .energy(plus(hill, h))
            .entropy(plus(tilt, s)),
        "projection" by Projection
    );
    visit!(
        problem("no Casimir", "S²", 3.0),
        diagonal,
        Vector3::z(),
        [(vector![0.3, 1.0], 8.0)],
        sphere()
            .bracket(AreaForm)
            .entropy(plus(hill, s))
            .second_law(SecondLaw::Published),
        "projection" by Projection
    );
    visit!(
        problem("Nambu", "S³", 2.0),
        off_axis::<4>(),
        last_axis::<4>(),
        [(vector![-1.1, -1.0, 0.1], 8.0)],
        System::on(Sphere::<3>::round())
            .bracket(Nambu::default())
            .energy(plus(bumpy, h))
            .entropy(plus(slope, s)),
        "projection" by Projection
    );
    visit!(
        problem("Nambu", "S⁵", 2.0),
        off_axis::<6>(),
        last_axis::<6>(),
        [ (vector![0.4, 0.0, -1.2, 0.6, 0.2], 4.0), (vector![-0.1, -0.2, -0.7, 1.8, 0.2], 8.0)],
        System::on(Sphere::<5>::round())
            .bracket(Nambu::default().and(first_twist).and(second_twist))
            .energy(plus(bumpy, h))
            .entropy(plus(slope, s)),
        "projection" by Projection
    );
    visit!(
        problem("Nambu", "SO(3)", 1.0),
        attitude(),
        Matrix3::identity(),
        [(vector![1.1, -1.2, 1.1], 2.0)],
        System::on(Rotations::bi_invariant())
            .bracket(Nambu::default())
            .energy(plus(rotation_energy, h))
            .entropy(plus(rotation_entropy, s)),
        "Cayley" by Cayley
    );
}

/// Metrics from closures, with numerical geodesics.
pub(super) fn closures(study: &mut impl Study, constants: Constants) {
    let Constants { energy: h, entropy: s } = constants;
    let ambient: fn(&Vector3<Real>) -> Matrix3<Real> = |x| {
        let mut g = Matrix3::from_diagonal(&vector![1.0, 1.5, 2.0]).cast::<Real>();
        g[(0, 1)] = x.z * 0.2;
        g[(1, 0)] = x.z * 0.2;
        g
    };
    let system = System::on(Sphere::<2>::round())
        .metric(Metric::field(ambient))
        .energy(plus(top, h))
        .entropy(plus(hill, s))
        .build()
        .expect("a problem is a system");
    let start = Vector3::from_element(3.0_f64.sqrt().recip());
    let strides = vec![(vector![0.7, -1.5], 32.0)];
    let (name, manifold, metric) = ("relaxation", "S²", "ambient closure");
    let problem =
        Problem { name, manifold, metric, system, start, time: 2.0, rest: Vector3::z(), strides };
    all(study, &problem, "projection", Projection);

    // One closure for both, and so one type.
    let diagonal = Matrix3::from_diagonal(&vector![1.0, 1.5, 2.0]);
    let full = Matrix3::new(1.0, 0.2, 0.0, 0.2, 1.5, 0.1, 0.0, 0.1, 2.0);
    for (metric, full, leaning, strides) in [
        ("left-invariant", full, 0.0, [(vector![-0.2, 1.4, -0.3], 2.0)]),
        ("depends on R", diagonal, 0.5, [(vector![-0.2, 1.4, -0.3], 2.0)]),
    ] {
        let system = System::on(Rotations)
            .metric(Metric::field(inertia(full, leaning)))
            .bracket(Nambu::default())
            .dissipation(Scaled(0.1, MetricDissipation))
            .energy(plus(rotation_energy, h))
            .entropy(plus(rotation_entropy, s))
            .build()
            .expect("a problem is a system");
        let (name, manifold, strides) = ("Nambu", "SO(3)", strides.to_vec());
        let (start, rest, time) = (attitude(), Matrix3::identity(), 1.0);
        let problem = Problem { name, manifold, metric, system, start, rest, time, strides };
        all(study, &problem, "Cayley", Cayley);
    }

    let leaning: fn(&Vector2<Real>) -> Matrix2<Real> = |q| {
        let across = q.x.sin() * 0.4;
        Matrix2::new(q.y.powi(2) + 1.0, across, across, q.x.powi(2) * 0.5 + 1.0)
    };
    let system = System::on(Euclidean::<2>)
        .metric(Metric::field(leaning))
        .bracket(AreaForm)
        .energy(plus(|q: &Vector2<Real>| q.x.powi(2) * 0.5 + q.y.powi(2) + q.x.powi(3) * 0.1, h))
        .build()
        .expect("a problem is a system");
    let strides = vec![(vector![0.0, 0.55], 2.0)];
    let (name, manifold, metric) = ("area form", "2-chart", "non-diagonal");
    let (start, rest, time) = (vector![0.6, 0.4], Vector2::zeros(), 2.0);
    let problem = Problem { name, manifold, metric, system, start, rest, time, strides };
    with(study, &problem, &[BY_THE_CHART]);

    let leaning: fn(&Vector3<Real>) -> Matrix3<Real> = |q| {
        let wave = Vector3::new(q.y.sin(), q.z.cos(), q.x * 0.5);
        Matrix3::identity() + wave * wave.transpose() * Real::from(0.4)
    };
    let system = System::on(Euclidean::<3>)
        .metric(Metric::field(leaning))
        .bracket(Nambu::default())
        .dissipation(Scaled(0.1, MetricDissipation))
        .energy(plus(bumpy, h))
        .entropy(plus(|q: &Vector3<Real>| q.norm_squared() * 0.5 + q.z.powi(3) * 0.1, s))
        .build()
        .expect("a problem is a system");
    let strides = vec![(vector![-1.1, 0.8, 0.9], 2.0)];
    let (name, manifold, metric) = ("Nambu", "3-chart", "non-diagonal");
    let (start, rest, time) = (vector![0.5, -0.4, 0.3], Vector3::zeros(), 2.0);
    let problem = Problem { name, manifold, metric, system, start, rest, time, strides };
    with(study, &problem, &[BY_THE_CHART]);
}

/// Products.
pub(super) fn products(study: &mut impl Study, constants: Constants) {
    let Constants { energy: h, entropy: s } = constants;
    // H = h(n) + e(s) with the entropy itself as the second factor: a spin in a bath.
    let system = System::on(Product(Sphere::<2>::round(), Euclidean::<1>))
        .bracket((AreaForm, Zero))
        .energy(plus(|(n, s): &(Vector3<Real>, Vector1<Real>)| top(n) + s.x.exp(), h))
        .entropy(plus(|(_, s): &(Vector3<Real>, Vector1<Real>)| s.x, s))
        .build()
        .expect("a problem is a system");
    let start = (Vector3::from_element(3.0_f64.sqrt().recip()), Vector1::new(0.1));
    let strides = vec![(vector![1.3, 0.2, 1.5], 2.0)];
    let (name, manifold, metric) = ("spin in a bath", "S² × R", CANONICAL);
    let (rest, time) = ((Vector3::z(), Vector1::new(0.1)), 2.0);
    geodesic(study, &Problem { name, manifold, metric, system, start, rest, time, strides });

    let system = System::on(Product(Sphere::<2>::round(), HalfLine))
        .metric((Canonical, Canonical))
        .bracket((AreaForm, Zero))
        .energy(plus(|(n, e): &(Vector3<Real>, Vector1<Real>)| top(n) + e.x, h))
        .entropy(plus(|(_, e): &(Vector3<Real>, Vector1<Real>)| e.x.ln(), s))
        .build()
        .expect("a problem is a system");
    let start = (Vector3::new(FRAC_1_SQRT_2, 0.5, 0.5), Vector1::new(0.8));
    let strides = vec![(vector![-0.2, 0.1, -0.6], 8.0)];
    let (name, manifold) = ("spin in a bath", "S² × R₊");
    let rest = (Vector3::z(), Vector1::new(0.8));
    geodesic(study, &Problem { name, manifold, metric, system, start, rest, time, strides });

    let start = (attitude(), vector![0.4, -0.6, 0.8]);
    let rest = (attitude(), Vector3::zeros());
    let system = System::on(Product(Rotations, Euclidean::<3>))
        .bracket(Symplectic)
        .energy(plus(heavy_energy, h))
        .build()
        .expect("a problem is a system");
    let strides = vec![(vector![-0.9, 0.8, 1.0, 0.6, 1.4, 0.9], 1.0)];
    let (name, manifold) = ("heavy body", "SO(3) × R³");
    geodesic(study, &Problem { name, manifold, metric, system, start, rest, time, strides });

    let system = System::on(Product(Rotations, Euclidean::<3>))
        .metric(Metric::field(leaning_metric))
        .energy(plus(heavy_energy, h))
        .entropy(plus(|(r, p): &(Matrix3<Real>, Vector3<Real>)| r.m12 - p.norm_squared() * 0.3, s))
        .build()
        .expect("a problem is a system");
    let away = vector![0.2, -0.3, 1.5, -1.3, -0.9, 0.3];
    let strides = vec![(away, 4.0), (away, 2.0)];
    let (name, metric) = ("relaxation", "full closure");
    let problem = Problem { name, manifold, metric, system, start, rest, time: 1.0, strides };
    with(study, &problem, &[BY_THE_CHART]);
}
