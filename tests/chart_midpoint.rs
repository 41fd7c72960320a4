//! The chart midpoint with metrics from closures: how often the metric is evaluated, both laws, and manifolds
//! whose charts are not normal.

mod models;

use std::sync::atomic::{AtomicU64, Ordering};

use metriplectic::dynamics::bracket::NaturalBracket;
use metriplectic::fields::{ChartPoint, Space};
use metriplectic::manifolds::rand::{Rng, RngExt};
use metriplectic::manifolds::{laws, rotations};
use metriplectic::nalgebra::Const;
use metriplectic::prelude::*;
use metriplectic_studies::Order;
use models::{Globe, boxed, top};

/// The evaluations of a metric so far. The number is atomic, because a system is `Sync`.
#[derive(Default)]
struct Evaluations(AtomicU64);

impl Evaluations {
    fn counted<'a, Q, A>(&'a self, metric: impl Fn(&Q) -> A + 'a) -> impl Fn(&Q) -> A + 'a {
        move |x| {
            self.0.fetch_add(1, Ordering::Relaxed);
            metric(x)
        }
    }

    /// Checks a run of 500 steps: both laws hold, and a step evaluates the metric at most `allowed` times.
    fn check<Y: Metriplectic + Sync>(
        &self,
        name: &str,
        system: &Y,
        start: &<Y::Manifold as Space>::Point<f64>,
        h: f64,
        allowed: f64,
    ) {
        const STEPS: u32 = 500;
        let mut steps = ChartMidpoint.steps(system, start.clone(), h).expect("the model is valid");
        self.0.store(0, Ordering::Relaxed);
        for _ in 0..STEPS {
            steps.advance().expect("every step is solved");
        }
        let each = self.0.load(Ordering::Relaxed) as f64 / f64::from(STEPS);
        let certificate = steps.certificate();
        let effort = certificate.effort;
        println!("{name}: {each:.2} evaluations of the metric in a step, {effort:?}");
        assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{name}: {certificate}");
        assert!(each <= allowed, "{name}: {each}");
    }
}

/// Each residual evaluates the metric once, and each Jacobian ⌈n/2⌉ times: 1 to 3 residuals a step. Without
/// handing the metric on, bracket and dissipation evaluate it again, and these figures double.
#[test]
fn a_step_evaluates_the_metric_at_most_four_times() {
    let count = Evaluations::default();
    let bent = count.counted(|x: &Vector3<Real>| {
        let a = Vector3::new(x.y, x.z, x.x);
        Matrix3::<Real>::identity() + a * a.transpose() * Real::from(0.5)
    });
    let system = System::on(Sphere::<2>::round())
        .metric(Metric::field(bent))
        .bracket(AreaForm)
        .energy(top)
        .build()
        .expect("the top is a system");
    count.check("S²", &system, &Vector3::repeat(3.0_f64.sqrt().recip()), 0.1, 4.5);

    let inertia = count.counted(|_: &Matrix3<Real>| {
        Matrix3::from_diagonal(&vector![2.0, 1.5, 1.0]).cast::<Real>()
    });
    let system = System::on(Rotations)
        .metric(Metric::field(inertia))
        .bracket(Nambu::default())
        .energy(boxed(|r: &Matrix3<Real>| r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5))
        .entropy(boxed(|r: &Matrix3<Real>| r.m13 - r.m21 * 0.5 + (r.m31 + r.m32).powi(2) * 0.25))
        .build()
        .expect("a frame is a system");
    count.check("SO(3)", &system, &rotations::exp(&vector![0.3, -0.2, 0.5]), 0.005, 4.5);

    let skewed = count.counted(|p: &Vector3<Real>| {
        let a = Vector3::new(p.y, p.z, p.x) * Real::from(0.5);
        Matrix3::<Real>::identity() + a * a.transpose()
    });
    let system = System::on(LieDual::so3())
        .metric(Metric::field(skewed))
        .energy(boxed(|p: &Vector3<Real>| p.x * p.x * 0.05 + p.y * p.y * 0.1 + p.z * p.z * 0.5))
        .entropy(boxed(|p: &Vector3<Real>| p.norm_squared() * 0.5))
        .build()
        .expect("the body is a system");
    count.check("R³", &system, &vector![-0.6, -0.84, 0.15], 0.1, 4.5);

    let coupled = count.counted(|(m, s): &(Vector3<Real>, Vector1<Real>)| {
        let mut g = Matrix4::<Real>::identity();
        g[(3, 3)] = s.x * s.x * 0.5 + 1.0;
        (g[(0, 3)], g[(3, 0)]) = (m.z * 0.25, m.z * 0.25);
        g
    });
    let system = System::on(Product(Sphere::<2>::round(), Euclidean::<1>))
        .metric(Metric::field(coupled))
        .energy(boxed(|(m, s): &(Vector3<Real>, Vector1<Real>)| top(m) + s.x.exp()))
        .entropy(boxed(|(_, s): &(Vector3<Real>, Vector1<Real>)| s.x))
        .build()
        .expect("the spin is a system");
    count.check("S² × R", &system, &(vector![0.6, 0.0, 0.8], vector![0.1]), 0.02, 4.5);
}

/// The plane with the charts `φ_x(q) = x + q + ¼|q|² e₁`, which are normal for no metric.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sheared;

impl Space for Sheared {
    type Dim = Const<2>;
    type Velocity = Const<2>;
    type Point<D: Scalar> = Vector2<D>;

    fn constant<D: Scalar>(x: &Vector2<f64>) -> Vector2<D> {
        x.map(D::from)
    }

    fn real<D: Scalar>(x: &Vector2<D>) -> Vector2<f64> {
        x.map(|entry| entry.re())
    }

    fn chart<D: Scalar>(x: &Vector2<f64>, q: &Vector2<D>) -> Vector2<D> {
        Vector2::new(q.x + (q.x * q.x + q.y * q.y) * 0.25 + x.x, q.y + x.y)
    }

    fn coordinates<D: Scalar>(x: &Vector2<f64>, y: &Vector2<D>) -> Vector2<D> {
        let (dx, dy) = (y.x - x.x, y.y - x.y);
        // The root of q + ¼q² = dx − ¼dy² near zero, without cancellation.
        let c = dx - dy * dy * 0.25;
        Vector2::new(c * 2.0 / ((c + 1.0).sqrt() + 1.0), dy)
    }

    fn embed<D: Scalar>(at: &ChartPoint<Self, D>, v: &Vector2<D>) -> Vector2<D> {
        Vector2::new(v.x + (at.q.x * v.x + at.q.y * v.y) * 0.5, v.y)
    }

    fn is_near(q: &Vector2<f64>) -> bool {
        q.norm() < 0.5
    }
}

impl Manifold for Sheared {
    fn defect(&self, x: &Vector2<f64>) -> f64 {
        x.sum() * 0.0
    }

    fn entries(x: &Vector2<f64>) -> Vec<f64> {
        vec![x.x, x.y]
    }

    fn assemble(next: &mut impl FnMut() -> f64) -> Vector2<f64> {
        Vector2::from_fn(|_, _| next())
    }

    fn magnitude(x: &Vector2<f64>) -> f64 {
        x.norm()
    }

    fn project(&self, x: &Vector2<f64>) -> Vector2<f64> {
        *x
    }

    fn random(&self, rng: &mut impl Rng) -> Vector2<f64> {
        Vector2::from_fn(|_, _| rng.random_range(-1.0..1.0))
    }
}

impl NaturalBracket for Sheared {
    type Bracket = AreaForm;

    fn natural_bracket(&self) -> AreaForm {
        AreaForm
    }
}

/// The order of runs over one unit of time, each of which keeps the energy to round-off.
fn order<Y: Metriplectic>(
    system: &Y,
    start: &<Y::Manifold as Space>::Point<f64>,
    exact: &<Y::Manifold as Space>::Point<f64>,
) -> Order {
    let counts = [16_u32, 32, 64, 128];
    let errors = counts.map(|n| {
        let span = Span::steps(1.0 / f64::from(n), n as usize);
        let run = ChartMidpoint.run(system, start.clone(), span).expect("the run ends");
        assert!(run.certificate().keeps_energy(), "{}", run.certificate());
        let (x, y) = (Y::Manifold::entries(&run.last().point), Y::Manifold::entries(exact));
        x.iter().zip(y).map(|(x, y)| (x - y).powi(2)).sum::<f64>().sqrt()
    });
    let order = Order::fit(&counts.map(|n| f64::from(n).recip()), &errors).expect("an order");
    println!("order {order}: {errors:?}");
    order
}

#[test]
fn charts_that_are_not_normal_have_order_two_and_keep_the_energy() {
    let pendulum = |q: &Vector2<Real>| q.y * q.y * 0.5 - q.x.cos();
    let flat = |_: &Vector2<Real>| Matrix2::<Real>::identity();
    let sheared =
        System::on(Sheared).metric(Metric::field(flat)).energy(pendulum).build().expect("a system");
    let start = vector![0.3, 0.9];
    // The same flow on the plane by a method of order 8.
    let plane = System::on(Euclidean::<2>).bracket(AreaForm).energy(pendulum).build().expect("one");
    let fine = DormandPrince8.run(&plane, start, Span::steps(0.01, 100)).expect("the run ends");
    let order = order(&sheared, &start, &fine.last().point);
    assert!(order.agrees(2.0, 0.05), "{order}");

    // The pair of a tangent vector is found by iteration where the chart is not normal.
    let metric = Metric::field(flat);
    laws::retraction::<Sheared, _, _>(&ChartMidpoint, &metric, &start, &vector![0.3, -0.4])
        .unwrap();
    let swapped = laws::symmetric_retraction::<Sheared, _, _>(
        &ChartMidpoint,
        &metric,
        &start,
        &vector![0.5, 0.4],
    );
    assert!(swapped.is_err(), "the charts are normal for some metric");
}

#[test]
fn a_manifold_of_your_own_has_order_two() {
    let form = |_: &Vector3<Real>| Matrix3::<Real>::identity();
    let energy = |x: &Vector3<Real>| x.z * x.x * 0.5 + x.y * x.y * 0.3 + x.z;
    let globe =
        System::on(Globe).metric(Metric::field(form)).energy(energy).build().expect("a system");
    let start = Globe::point(vector![0.6, 0.0, 0.8]);
    let fine = DormandPrince8.run(&globe, start, Span::steps(0.01, 100)).expect("the run ends");
    let order = order(&globe, &start, &fine.last().point);
    assert!(order.agrees(2.0, 0.05), "{order}");
}
