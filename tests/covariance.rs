//! The Weyl-Gonzalez step is intrinsic: computed in two charts, with the metric pulled back, it is
//! the same step. Without `√det g` in the bracket, or with geodesics that are straight lines of the
//! chart, it is another one.

mod models;

use metriplectic::fields::{ChartPoint, Matrix};
use metriplectic::manifolds::{GeodesicEnd, MetricError, Riemannian, StepPathJet};
use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Either, Guarantee, Order, scientific};
use models::{boxed, top};

/// Either of both geodesic retractions: each system compiles its run once.
type Geodesic = Either<WeylMidpoint, Exponential>;
const WEYL: Geodesic = Either::First(WeylMidpoint);
const EXPONENTIAL: Geodesic = Either::Second(Exponential);

/// A point of the sphere from colatitude and longitude, at any scalar.
fn on_sphere<D: Scalar>(q: &Vector2<D>) -> Vector3<D> {
    let ((sine, cosine), (s, c)) = (q.x.sin_cos(), q.y.sin_cos());
    Vector3::new(sine * c, sine * s, cosine)
}

/// The round metric in these coordinates, `diag(1, sin²θ)`.
fn round(q: &Vector2<Real>) -> Matrix2<Real> {
    Matrix2::from_diagonal(&Vector2::new(1.0.into(), q.x.sin().powi(2)))
}

/// `S = x₃ + 0.3 x₁x₂`.
fn hill(x: &Vector3<Real>) -> Real {
    x.z + x.x * x.y * 0.3
}

#[test]
fn a_step_on_the_sphere_is_the_same_in_colatitude_and_longitude() {
    let start = vector![1.1, 0.7];
    let embedded = System::on(Sphere::<2>::round())
        .bracket(AreaForm)
        .energy(top)
        .entropy(hill)
        .second_law(SecondLaw::Published)
        .build()
        .unwrap();
    let chart = System::on(Euclidean::<2>)
        .metric(Metric::field(round))
        .bracket(AreaForm)
        .energy(boxed(|q: &Vector2<Real>| top(&on_sphere(q))))
        .entropy(boxed(|q: &Vector2<Real>| hill(&on_sphere(q))))
        .second_law(SecondLaw::Published)
        .build()
        .unwrap();
    let span = Span::steps(0.2, 1);
    let mut off = Vec::new();
    let there = Scheme::new(WEYL).run(&embedded, on_sphere(&start), span).unwrap().last().point;
    let here = Scheme::new(WEYL).run(&chart, start, span).unwrap().last().point;
    assert!((on_sphere(&here) - there).amax() < 1e-11, "{:e}", (on_sphere(&here) - there).amax());
    off.push((on_sphere(&here) - there).amax());
    // The step is long enough for the test to mean something.
    assert!((there - on_sphere(&start)).norm() > 0.05);

    let there =
        Scheme::new(EXPONENTIAL).run(&embedded, on_sphere(&start), span).unwrap().last().point;
    let here = Scheme::new(EXPONENTIAL).run(&chart, start, span).unwrap().last().point;
    off.push((on_sphere(&here) - there).amax());
    chart_claim("S², in colatitude and longitude").record(listed(&off), "1e-11");
    assert!(off[1] < 1e-11, "{off:?}");
}

/// A point of R³ from bent coordinates, at any scalar: `(u, v, w) ↦ (u, v + u²/2, w + uv/2)`.
fn unbend<D: Scalar>(q: &Vector3<D>) -> Vector3<D> {
    Vector3::new(q.x * 2.0, q.y + q.x * q.x * 0.5, q.z + q.x * q.y * 0.5)
}

/// The flat metric in the bent coordinates, `JᵀJ`.
fn bent(q: &Vector3<Real>) -> Matrix3<Real> {
    let (zero, one, half) = (Real::from(0.0), Real::from(1.0), Real::from(0.5));
    let jacobian = Matrix3::new(one * 2.0, zero, zero, q.x, one, zero, q.y * half, q.x * half, one);
    jacobian.tr_mul(&jacobian)
}

/// A nonlinear energy and an entropy that is not quadratic.
fn energy(p: &Vector3<Real>) -> Real {
    p.x.powi(2) * 0.5 + p.y.powi(2) * 0.25 + p.z.powi(2) + p.x.powi(3) * 0.2
}

fn entropy(p: &Vector3<Real>) -> Real {
    p.norm_squared() * 0.5 + p.z.powi(3) * 0.1
}

/// `dH` and `dS` by hand, and `p' = dS × dH + |dH|² dS − (dH·dS) dH`.
fn by_hand(p: &Vector3<f64>) -> Vector3<f64> {
    let w = vector![p.x + 0.6 * p.x * p.x, 0.5 * p.y, 2.0 * p.z];
    let s = vector![p.x, p.y, p.z + 0.3 * p.z * p.z];
    s.cross(&w) + s * w.norm_squared() - w * w.dot(&s)
}

#[test]
fn a_run_with_numerical_geodesics_has_order_two_and_keeps_the_energy() {
    let system = System::on(Euclidean::<3>)
        .metric(Metric::field(bent))
        .bracket(Nambu::default())
        .energy(boxed(|q: &Vector3<Real>| energy(&unbend(q))))
        .entropy(boxed(|q: &Vector3<Real>| entropy(&unbend(q))))
        .build()
        .unwrap();
    let start = vector![0.3, -0.4, 0.5];
    // The exact flow in flat coordinates, by a classical Runge-Kutta method with gradients by hand.
    let (time, fine) = (1.0, 4000);
    let h = time / f64::from(fine);
    let exact = (0..fine).fold(unbend(&start), |x, _| {
        let a = by_hand(&x);
        let b = by_hand(&(x + a * (0.5 * h)));
        let c = by_hand(&(x + b * (0.5 * h)));
        x + (a + (b + c) * 2.0 + by_hand(&(x + c * h))) * (h / 6.0)
    });
    let steps = [5_usize, 10, 20, 40];
    let sizes = steps.map(|n| time / n as f64);
    let errors = steps.map(|n| {
        let run = WeylMidpoint.run(&system, start, Span::steps(time / n as f64, n)).unwrap();
        assert!(run.certificate().keeps_energy(), "{}", run.certificate());
        (unbend(&run.last().point) - exact).norm()
    });
    let order = Order::fit(&sizes, &errors).unwrap();
    Claim::new(Guarantee::Order, "R³ with a flat metric in bent coordinates", "WeylMidpoint")
        .against("a Runge-Kutta flow in flat coordinates")
        .record(&order, "2 ± 0.05");
    assert!(order.agrees(2.0, 0.05), "{order} from {errors:?}");
}

/// How far one step on a manifold is off the same step in a chart of it, `point`: with the Weyl
/// midpoint, and with the exponential.
fn discrepancies<Y, Z, const N: usize>(
    embedded: &Y,
    chart: &Z,
    start: SVector<f64, N>,
    point: impl Fn(&SVector<f64, N>) -> metriplectic::dynamics::Point<Y>,
) -> [f64; 2]
where
    Y: Metriplectic,
    Z: Metriplectic<Manifold = Euclidean<N>>,
{
    fn ends<Y, Z, R, const N: usize>(
        (embedded, chart, retraction): (&Y, &Z, R),
        (x, q): (metriplectic::dynamics::Point<Y>, SVector<f64, N>),
    ) -> (metriplectic::dynamics::Point<Y>, SVector<f64, N>)
    where
        Y: Metriplectic,
        Z: Metriplectic<Manifold = Euclidean<N>>,
        R: Retraction<Y::Manifold, Y::Metric> + Retraction<Euclidean<N>, Z::Metric> + Copy,
    {
        let (scheme, span) = (Scheme::new(retraction), Span::steps(0.2, 1));
        let there = scheme.run(embedded, x, span).expect("a step").last().point.clone();
        (there, scheme.run(chart, q, span).expect("a step").last().point)
    }
    let distance = |x: &metriplectic::dynamics::Point<Y>, y: &metriplectic::dynamics::Point<Y>| {
        let (x, y) = (Y::Manifold::entries(x), Y::Manifold::entries(y));
        x.iter().zip(y).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    [
        ends((embedded, chart, WEYL), (point(&start), start)),
        ends((embedded, chart, EXPONENTIAL), (point(&start), start)),
    ]
    .map(|(there, here)| {
        // The step is long enough for the comparison to mean something.
        assert!(distance(&there, &point(&start)) > 0.05);
        distance(&point(&here), &there)
    })
}

/// One step of both geodesic retractions is the same in the chart.
fn same_in_the_chart<Y, Z, const N: usize>(
    name: &str,
    embedded: &Y,
    chart: &Z,
    start: SVector<f64, N>,
    point: impl Fn(&SVector<f64, N>) -> metriplectic::dynamics::Point<Y>,
) where
    Y: Metriplectic,
    Z: Metriplectic<Manifold = Euclidean<N>>,
{
    let off = discrepancies(embedded, chart, start, point);
    chart_claim(name).record(listed(&off), "1e-11");
    assert!(off.iter().all(|&off| off < 1e-11), "{off:?}");
}

#[track_caller]
fn chart_claim(problem: &str) -> Claim {
    Claim::new(Guarantee::Charts, problem, "WeylMidpoint, Exponential").against("the other chart")
}

fn listed(figures: &[f64]) -> String {
    figures.iter().map(|figure| scientific(*figure)).collect::<Vec<_>>().join(", ")
}

/// Stereographic coordinates of S³ from the pole `−e₀`: `x = (1 − |q|²/4, q)/(1 + |q|²/4)`, in which
/// the round metric is conformal, and which keep the orientation `det[x, a, b, c]`.
fn stereographic<D: Scalar>(q: &Vector3<D>) -> Vector4<D> {
    let s = q.dot(q) * 0.25;
    Vector4::new(-s + 1.0, q.x, q.y, q.z) * (s + 1.0).recip()
}

fn wavy(x: &Vector4<Real>) -> Real {
    x[0].powi(2) * 0.5 + x[1].powi(3) + x[2] * x[3] * 0.7 + x[1] * 0.5
}

fn tilted(x: &Vector4<Real>) -> Real {
    x[3] + x[0] * x[1] * 0.4 - x[2] * 0.6
}

/// The round metric in these coordinates; its `√det g` is `(1 + |q|²/4)⁻³`.
fn conformal(q: &Vector3<Real>) -> Matrix3<Real> {
    Matrix3::from_diagonal_element((q.dot(q) * 0.25 + 1.0).powi(-2))
}

/// The system in these coordinates, with a metric that ought to be the round one, and Nambu's bracket
/// times `(1 + |q|²/4)^power`.
fn in_stereographic_coordinates(
    metric: impl Riemannian<Euclidean<3>>,
    power: i32,
) -> impl Metriplectic<Manifold = Euclidean<3>> {
    System::on(Euclidean::<3>)
        .metric(metric)
        .bracket(
            Nambu::default().times(move |q: &Vector3<Real>| (q.dot(q) * 0.25 + 1.0).powi(power)),
        )
        .energy(boxed(|q: &Vector3<Real>| wavy(&stereographic(q))))
        .entropy(boxed(|q: &Vector3<Real>| tilted(&stereographic(q))))
        .build()
        .expect("a system")
}

/// A metric whose geodesics are wrong: straight lines of the chart.
struct Straight<G>(G);

impl<G: Riemannian<Euclidean<3>>> Riemannian<Euclidean<3>> for Straight<G> {
    type At<D: Scalar> = G::At<D>;

    fn at<D: Scalar>(&self, x: &ChartPoint<Euclidean<3>, D>) -> Result<Self::At<D>, MetricError> {
        self.0.at(x)
    }

    fn matrix<D: Scalar>(&self, x: &ChartPoint<Euclidean<3>, D>) -> Matrix<Euclidean<3>, D> {
        self.0.matrix(x)
    }

    fn exp<D: Scalar>(
        &self,
        x: &ChartPoint<Euclidean<3>, D>,
        v: &Vector3<D>,
    ) -> Result<GeodesicEnd<Euclidean<3>, D>, MetricError> {
        Riemannian::<Euclidean<3>>::exp(&Canonical, x, v)
    }

    fn along(
        &self,
        x: &Vector3<f64>,
        v: &Vector3<f64>,
        t: f64,
    ) -> Result<Vector3<Real>, MetricError> {
        Riemannian::<Euclidean<3>>::along(&Canonical, x, v, t)
    }

    fn log(&self, x: &Vector3<f64>, y: &Vector3<f64>) -> Result<Vector3<f64>, MetricError> {
        Riemannian::<Euclidean<3>>::log(&Canonical, x, y)
    }

    fn weyl_jet(
        &self,
        x: &Vector3<f64>,
        d: &Vector3<f64>,
    ) -> Result<StepPathJet<Euclidean<3>>, MetricError> {
        Riemannian::<Euclidean<3>>::weyl_jet(&Canonical, x, d)
    }

    fn volume_density<D: Scalar>(at: &Self::At<D>) -> Result<D, MetricError> {
        <G as Riemannian<Euclidean<3>>>::volume_density(at)
    }

    fn slopes(&self, x: &Vector3<f64>) -> Option<[Matrix3<f64>; 3]> {
        self.0.slopes(x)
    }
}

#[test]
fn a_nambu_step_on_the_three_sphere_is_the_same_in_stereographic_coordinates() {
    let embedded = System::on(Sphere::<3>::round())
        .bracket(Nambu::default())
        .energy(wavy)
        .entropy(tilted)
        .build()
        .unwrap();
    let start = vector![0.5, -0.4, 0.6];
    let round = || Metric::field(conformal);
    let chart = in_stereographic_coordinates(round(), 0);
    same_in_the_chart("S³, in stereographic coordinates", &embedded, &chart, start, stereographic);

    // With the factor that cancels 1/√det g, and with straight lines for geodesics, it is not.
    let dense = in_stereographic_coordinates(round(), -3);
    let straight = in_stereographic_coordinates(Straight(round()), 0);
    let off = [
        discrepancies(&embedded, &dense, start, stereographic),
        discrepancies(&embedded, &straight, start, stereographic),
    ];
    println!("without √det g, and with straight lines: {off:?}");
    chart_claim("S³ without √det g in the chart").record(listed(&off[0]), "> 1e-6");
    chart_claim("S³ with straight lines for geodesics").record(listed(&off[1]), "> 1e-6");
    assert!(off.iter().flatten().all(|&off| off > 1e-6), "{off:?}");
}

#[test]
fn a_nambu_step_on_rotations_is_the_same_in_rotation_vectors() {
    use metriplectic::manifolds::rotations::{dexp, exp};
    let energy = |r: &Matrix3<Real>| r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5;
    let entropy = |r: &Matrix3<Real>| r.m13 * 2.0 - r.m21 + (r.m31 + r.m32).powi(2) * 0.25;
    // Left-invariant on the group, and its pull-back by the exponential, `dexpᵀ J dexp`.
    let j = Matrix3::new(1.0, 0.2, 0.0, 0.2, 1.5, 0.1, 0.0, 0.1, 2.0);
    let embedded = System::on(Rotations)
        .metric(Metric::field(move |_: &Matrix3<Real>| j.cast::<Real>()))
        .bracket(Nambu::default())
        .energy(energy)
        .entropy(entropy)
        .build()
        .unwrap();
    let chart = System::on(Euclidean::<3>)
        .metric(Metric::field(move |q: &Vector3<Real>| {
            let theta = dexp(q);
            theta.transpose() * j.cast::<Real>() * theta
        }))
        .bracket(Nambu::default())
        .energy(boxed(move |q: &Vector3<Real>| energy(&exp(q))))
        .entropy(boxed(move |q: &Vector3<Real>| entropy(&exp(q))))
        .build()
        .unwrap();
    same_in_the_chart(
        "SO(3), in rotation vectors",
        &embedded,
        &chart,
        vector![0.3, -0.5, 0.4],
        exp,
    );
}

#[test]
fn a_nambu_step_is_the_same_in_bent_coordinates_with_both_retractions() {
    let flat = System::on(Euclidean::<3>)
        .bracket(Nambu::default())
        .energy(energy)
        .entropy(entropy)
        .build()
        .unwrap();
    let chart = System::on(Euclidean::<3>)
        .metric(Metric::field(bent))
        .bracket(Nambu::default())
        .energy(boxed(|q: &Vector3<Real>| energy(&unbend(q))))
        .entropy(boxed(|q: &Vector3<Real>| entropy(&unbend(q))))
        .build()
        .unwrap();
    same_in_the_chart("R³, in bent coordinates", &flat, &chart, vector![0.3, -0.7, 0.8], unbend);
}
