//! Metrics from closures: the canonical ones again, and logarithms of far points.

use metriplectic::fields::{BrokenLaw, Space, Vector};
use metriplectic::manifolds::{InnerProduct, MetricAt, Riemannian, laws};
use metriplectic::prelude::*;
use proptest::prelude::*;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

/// Compares geodesics, logarithms, inner products and volumes of two metrics that should be one.
fn agree<M: Manifold>(
    field: &impl Riemannian<M>,
    canonical: &impl Riemannian<M>,
    x: &M::Point<f64>,
    u: &Vector<M>,
) -> Result<(), BrokenLaw> {
    use metriplectic::fields::{ChartPoint, Column};
    let centre = ChartPoint::<M>::centre(x);
    let exists = |_| BrokenLaw { law: "the metric exists", size: f64::NAN, bound: 0.0 };
    let unless = BrokenLaw::unless;
    let (left, velocity) = field.exp(&centre, u).map_err(exists)?;
    let (right, expected) = canonical.exp(&centre, u).map_err(exists)?;
    let off = M::coordinates(&left.point(), &right.point()).magnitude();
    unless("the same end", off, 1e-12)?;
    unless("the same velocity there", (velocity - expected).magnitude(), 1e-12)?;
    let log = field.log(x, &right.point()).map_err(exists)?;
    unless("the same logarithm", (log - *u).magnitude(), 1e-12)?;
    let (a, b) = (field.at(&left).map_err(exists)?, canonical.at(&right).map_err(exists)?);
    unless("the same inner product", (a.flat(u) - b.flat(u)).magnitude(), 1e-12)?;
    let volumes = MetricAt::new(field, &centre).volume_density().map_err(exists)?
        / MetricAt::new(canonical, &centre).volume_density().map_err(exists)?;
    unless("the same volume", (volumes - 1.0).abs(), 1e-12)
}

fn identity<M: Space, const A: usize>(_: &M::Point<Real>) -> SMatrix<Real, A, A> {
    SMatrix::identity()
}

/// The laws of a metric, and of the two retractions along its geodesics.
fn geodesic_laws<M: Manifold, G: Riemannian<M>>(
    g: &G,
    x: &M::Point<f64>,
    u: &Vector<M>,
) -> Result<(), BrokenLaw> {
    laws::metric(g, x, u)?;
    laws::retraction(&WeylMidpoint, g, x, u)?;
    laws::retraction(&Exponential, g, x, u)?;
    laws::symmetric_retraction(&WeylMidpoint, g, x, &M::chart(x, u))
}

/// A metric in the space around a sphere that is not the round one: `1 + a w wᵀ`, with `w_i = x_{i+1}`.
fn bent<const A: usize>(a: f64) -> impl Fn(&SVector<Real, A>) -> SMatrix<Real, A, A> {
    move |x| {
        let w = SVector::<Real, A>::from_fn(|i, _| x[(i + 1) % A]);
        SMatrix::identity() + w * w.transpose() * Real::from(a)
    }
}

/// The last number is that of the cases of the laws. One of a sphere of seven dimensions takes a hundred times as long
/// as one of three, by the same code, so the larger ones have one or two.
macro_rules! on_the_sphere {
    ($name:ident, $laws:ident, $n:literal, $a:literal, $cases:literal) => {
        proptest! {
            #![proptest_config(ProptestConfig::with_cases($cases))]

            #[test]
            fn $laws(
                seed in any::<u64>(), u in prop::array::uniform::<_, $n>(-0.7..0.7), a in 0.1..1.0_f64,
            ) {
                let x = Sphere::<$n>.random(&mut ChaCha8Rng::seed_from_u64(seed));
                let (g, u) = (Metric::field(bent::<$a>(a)), SVector::from(u));
                geodesic_laws::<Sphere<$n>, _>(&g, &x, &u)?;
                laws::retraction::<Sphere<$n>, _, _>(&Projection, &g, &x, &u)?;
                let y: SVector<f64, $a> = Sphere::<$n>::chart(&x, &u);
                laws::symmetric_retraction::<Sphere<$n>, _, _>(&Projection, &g, &x, &y)?;
            }
        }

        proptest! {
            #![proptest_config(ProptestConfig::with_cases(8))]

            #[test]
            fn $name(seed in any::<u64>(), u in prop::array::uniform::<_, $n>(-1.0..1.0)) {
                let sphere = Sphere::<$n>::round();
                let x = sphere.random(&mut ChaCha8Rng::seed_from_u64(seed));
                // Up to 2.5 radians.
                let u = SVector::<f64, $n>::from(u) * (2.5 / f64::from($n as u8).sqrt());
                let ambient = Metric::field(identity::<Sphere<$n>, $a>);
                agree::<Sphere<$n>>(&ambient, &Canonical, &x, &u)?;
            }
        }
    };
}

on_the_sphere!(
    the_ambient_identity_is_the_round_metric_of_the_circle,
    bent_metrics_of_the_circle_keep_the_laws,
    1,
    2,
    8
);
on_the_sphere!(
    the_ambient_identity_is_the_round_metric_of_the_sphere,
    bent_metrics_of_the_sphere_keep_the_laws,
    2,
    3,
    8
);
on_the_sphere!(
    the_ambient_identity_is_the_round_metric_of_the_three_sphere,
    bent_metrics_of_the_three_sphere_keep_the_laws,
    3,
    4,
    8
);
on_the_sphere!(
    the_ambient_identity_is_the_round_metric_of_the_four_sphere,
    bent_metrics_of_the_four_sphere_keep_the_laws,
    4,
    5,
    2
);
on_the_sphere!(
    the_ambient_identity_is_the_round_metric_of_the_five_sphere,
    bent_metrics_of_the_five_sphere_keep_the_laws,
    5,
    6,
    1
);
on_the_sphere!(
    the_ambient_identity_is_the_round_metric_of_the_six_sphere,
    bent_metrics_of_the_six_sphere_keep_the_laws,
    6,
    7,
    1
);
on_the_sphere!(
    the_ambient_identity_is_the_round_metric_of_the_seven_sphere,
    bent_metrics_of_the_seven_sphere_keep_the_laws,
    7,
    8,
    2
);

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn the_identity_in_the_body_is_the_bi_invariant_metric(
        seed in any::<u64>(), u in prop::array::uniform3(-1.4..1.4),
    ) {
        let x = Rotations.random(&mut ChaCha8Rng::seed_from_u64(seed));
        let field = Metric::field(identity::<Rotations, 3>);
        agree::<Rotations>(&field, &Canonical, &x, &Vector3::from(u))?;
    }

    /// Geodesics of a left-invariant metric are `R' = RΩ̂`, `JΩ' = JΩ × Ω` (Euler), here by the
    /// classical Runge-Kutta method.
    #[test]
    fn geodesics_of_a_left_invariant_metric_are_euler_s_rigid_body(
        seed in any::<u64>(), omega in prop::array::uniform3(-1.5..1.5),
    ) {
        let x = Rotations.random(&mut ChaCha8Rng::seed_from_u64(seed));
        let j = Matrix3::new(1.0, 0.2, 0.0, 0.2, 1.5, 0.1, 0.0, 0.1, 2.0);
        let field = Metric::field(move |_: &Matrix3<Real>| j.cast::<Real>());
        let omega = Vector3::from(omega);
        let end = Riemannian::<Rotations>::end(&field, &x, &omega).unwrap();
        let inverse = j.try_inverse().unwrap();
        let euler = |(r, w): (Matrix3<f64>, Vector3<f64>)| {
            (r * w.cross_matrix(), inverse * (j * w).cross(&w))
        };
        let steps = 2000;
        let h = 1.0 / f64::from(steps);
        let moved = |(r, w): (Matrix3<f64>, Vector3<f64>), (dr, dw): (Matrix3<f64>, Vector3<f64>), h: f64| {
            (r + dr * h, w + dw * h)
        };
        let exact = (0..steps).fold((x, omega), |y, _| {
            let a = euler(y);
            let b = euler(moved(y, a, 0.5 * h));
            let c = euler(moved(y, b, 0.5 * h));
            let d = euler(moved(y, c, h));
            let sum = (a.0 + (b.0 + c.0) * 2.0 + d.0, a.1 + (b.1 + c.1) * 2.0 + d.1);
            moved(y, sum, h / 6.0)
        });
        prop_assert!((end - exact.0).norm() < 1e-11, "{:e}", (end - exact.0).norm());
    }

    #[test]
    fn metrics_that_vary_keep_the_laws_on_charts_and_the_half_line(
        x in prop::array::uniform3(-1.0..1.0), u in prop::array::uniform3(-0.7..0.7), a in 0.1..1.0_f64,
    ) {
        let open = Metric::field(move |q: &Vector3<Real>| {
            let wave = Vector3::new(q.y.sin(), q.z.cos(), q.x * 0.5);
            Matrix3::identity() + wave * wave.transpose() * Real::from(a)
        });
        geodesic_laws::<Chart<3>, _>(&open, &Vector3::from(x), &Vector3::from(u))?;
        let stretched =
            Metric::field(move |s: &Vector1<Real>| Matrix1::new(s.x.powi(-2) + s.x * a));
        geodesic_laws::<HalfLine, _>(&stretched, &vector![x[0].exp()], &vector![u[0]])?;
    }

    #[test]
    fn closures_of_canonical_metrics_agree_on_the_half_line_and_on_products(
        seed in any::<u64>(), u in prop::array::uniform6(-0.8..0.8),
    ) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let half = Metric::field(|s: &Vector1<Real>| Matrix1::new(s.x.powi(-2)));
        agree::<HalfLine>(&half, &Canonical, &HalfLine.random(&mut rng), &vector![u[0]])?;
        let spin = Metric::field(|(_, s): &(Vector3<Real>, Vector1<Real>)| {
            let mut g = Matrix4::identity();
            g[(3, 3)] = s.x.powi(-2);
            g
        });
        let space = Product(Sphere::<2>, HalfLine);
        let (x, v) = (space.random(&mut rng), vector![u[0], u[1], u[2]]);
        agree::<Product<Sphere<2>, HalfLine>>(&spin, &Canonical, &x, &v)?;
        let body = Metric::field(|_: &(Matrix3<Real>, Vector3<Real>)| Matrix6::identity());
        let space = Product(Rotations, Euclidean::<3>);
        let (x, v) = (space.random(&mut rng), SVector::from(u));
        agree::<Product<Rotations, Euclidean<3>>>(&body, &Canonical, &x, &v)?;
    }

    /// A whole step, with its energy that rounding must not see.
    #[test]
    fn a_step_is_the_same_with_the_closure_of_the_canonical_metric(seed in any::<u64>()) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let sphere = System::on(Sphere::<3>)
            .bracket(Nambu::default())
            .energy(|x: &Vector4<Real>| x.x.powi(2) + x.y * x.z * 2.0)
            .entropy(|x: &Vector4<Real>| x.w + x.x * x.z);
        let field = Metric::field(identity::<Sphere<3>, 4>);
        let x = Sphere::<3>.random(&mut rng);
        let [a, b] = [
            one_step(&sphere.clone().build().unwrap(), x),
            one_step(&sphere.metric(field).build().unwrap(), x),
        ];
        prop_assert!((a - b).norm() <= 1e-12, "{:e}", (a - b).norm());
        let body = System::on(Rotations)
            .bracket(Nambu::default())
            .energy(|r: &Matrix3<Real>| r.m11 + r.m22 * 2.0 + r.m12 * r.m23 * 0.5)
            .entropy(|r: &Matrix3<Real>| r.m13 - r.m21 * 0.5);
        let field = Metric::field(identity::<Rotations, 3>);
        let x = Rotations.random(&mut rng);
        let [a, b] = [
            one_step(&body.clone().build().unwrap(), x),
            one_step(&body.metric(field).build().unwrap(), x),
        ];
        prop_assert!((a - b).norm() <= 1e-12, "{:e}", (a - b).norm());
    }
}

proptest! {
    // Each in six dimensions takes a second.
    #![proptest_config(ProptestConfig::with_cases(4))]

    #[test]
    fn metrics_that_vary_keep_the_laws_on_rotations_and_products(
        seed in any::<u64>(), u in prop::array::uniform6(-0.7..0.7), a in 0.1..1.0_f64,
    ) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let body = Metric::field(move |r: &Matrix3<Real>| {
            let lean = r.column(2).into_owned();
            Matrix3::from_diagonal(&vector![1.0, 1.5, 2.0]).cast::<Real>()
                + lean * lean.transpose() * Real::from(a)
        });
        let (x, v) = (Rotations.random(&mut rng), vector![u[0], u[1], u[2]]);
        geodesic_laws::<Rotations, _>(&body, &x, &v)?;
        laws::retraction::<Rotations, _, _>(&Cayley, &body, &x, &v)?;
        let y = Rotations::chart(&x, &v);
        laws::symmetric_retraction::<Rotations, _, _>(&Cayley, &body, &x, &y)?;

        let space = Product(Rotations, Euclidean::<3>);
        let coupled = Metric::field(move |(r, p): &(Matrix3<Real>, Vector3<Real>)| {
            let w = SVector::<Real, 6>::from_fn(|i, _| if i < 3 { r[(i, 2)] } else { p[i - 3].sin() });
            SMatrix::<Real, 6, 6>::identity() + w * w.transpose() * Real::from(a)
        });
        let (x, v) = (space.random(&mut rng), SVector::from(u));
        geodesic_laws::<Product<Rotations, Euclidean<3>>, _>(&coupled, &x, &v)?;
    }
}

/// Where a step of size 0.1 leads.
fn one_step<Y: Metriplectic>(
    system: &Y,
    x: <Y::Manifold as Space>::Point<f64>,
) -> <Y::Manifold as Space>::Point<f64>
where
    WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
{
    let mut steps = WeylMidpoint.steps(system, x, 0.1).expect("the model keeps its laws");
    steps.advance().expect("the step is solved").point.clone()
}

#[test]
fn geodesics_of_the_half_plane_end_where_their_circles_do() {
    // From i, at the angle a: the turn of i e^t by a − π/2 about i, a Möbius transformation.
    let field = Metric::field(|q: &Vector2<Real>| Matrix2::from_diagonal_element(q.y.powi(-2)));
    let mut worst = 0.0_f64;
    for k in 0..600_u32 {
        let (angle, length) = (0.0314 * f64::from(k % 200), f64::from(1 + k / 200));
        let v = vector![angle.cos(), angle.sin()] * length;
        let end = Riemannian::<Chart<2>>::end(&field, &vector![0.0, 1.0], &v).unwrap();
        let (sine, cosine) = (0.5 * (std::f64::consts::FRAC_PI_2 - angle)).sin_cos();
        let w = length.exp();
        let below = cosine * cosine + sine * sine * w * w;
        let across = sine * cosine * (w * w - 1.0) / below;
        let circle = vector![across, w / below];
        let size = circle.norm().max(1.0);
        worst = worst
            .max((end - circle).norm().min((end - vector![-circle.x, circle.y]).norm()) / size);
    }
    println!("geodesics of the half plane are {worst:.1e} off");
    assert!(worst <= 1e-13, "{worst:e}");
}

/// How many of `count` logarithms are found, each checked by `is_right`.
fn found<G: Riemannian<Euclidean<2>>>(
    metric: &G,
    count: u32,
    mut pair: impl FnMut(&mut ChaCha8Rng) -> (Vector2<f64>, Vector2<f64>),
    is_right: impl Fn(&Vector2<f64>, &Vector2<f64>, &Vector2<f64>) -> bool,
) -> u32 {
    let mut rng = ChaCha8Rng::seed_from_u64(2024);
    let mut found = 0;
    for _ in 0..count {
        let (x, y) = pair(&mut rng);
        match metric.log(&x, &y) {
            Ok(v) => {
                assert!(is_right(&x, &y, &v), "a wrong logarithm from {x} to {y}: {v}");
                found += 1;
            }
            Err(error) => println!("from {x:?} to {y:?}: {error}"),
        }
    }
    found
}

/// How many of `count` logarithms of the half plane are found, with the distance as their length.
fn found_in_the_half_plane(count: u32) -> u32 {
    let field = Metric::field(|q: &Vector2<Real>| Matrix2::from_diagonal_element(q.y.powi(-2)));
    let point = |rng: &mut ChaCha8Rng| {
        vector![rng.random_range(-3.0..3.0), 10.0_f64.powf(rng.random_range(-1.0..1.0))]
    };
    let found = found(
        &field,
        count,
        |rng| (point(rng), point(rng)),
        |x, y, v| {
            let distance = (1.0 + (y - x).norm_squared() / (2.0 * x.y * y.y)).acosh();
            (v.norm() / x.y - distance).abs() < 1e-10 * (1.0 + distance)
        },
    );
    println!("{found} of {count} logarithms of the half plane");
    found
}

#[test]
fn logarithms_of_the_half_plane_are_found() {
    assert_eq!(found_in_the_half_plane(1000), 1000);
}

#[test]
#[ignore = "slow study: 10⁴ logarithms, of which the test takes the first thousand"]
fn logarithms_of_ten_thousand_pairs_of_the_half_plane_are_found() {
    assert!(found_in_the_half_plane(10_000) >= 9990);
}

#[test]
fn logarithms_of_a_bumpy_conformal_metric_are_found() {
    let field = Metric::field(|q: &Vector2<Real>| {
        let bump = (q.x * 2.0).sin() * (q.y * 2.0).cos() * 0.5;
        Matrix2::from_diagonal_element(bump.exp())
    });
    // Its curvature is at most 4 e^½, so geodesics shorter than π/√K = 1.22 have no conjugate points.
    let mut start = |rng: &mut ChaCha8Rng| {
        let x = vector![rng.random_range(-3.0..3.0), rng.random_range(-3.0..3.0)];
        let direction: f64 = rng.random_range(0.0..std::f64::consts::TAU);
        let length: f64 = rng.random_range(0.0..0.9);
        (x, x + vector![direction.cos(), direction.sin()] * length)
    };
    let found = found(&field, 10_000, &mut start, |x, y, v| {
        let end = Riemannian::<Euclidean<2>>::end(&field, x, v).unwrap();
        (end - y).norm() < 1e-11
    });
    println!("{found} of 10000 logarithms of the bumpy metric");
    assert!(found >= 9990);
}

/// A numerical geodesic of two radians has an error of its own, of which the energy must see nothing.
#[test]
fn long_steps_along_numerical_geodesics_keep_the_energy() {
    let metric = |q: &Vector2<Real>| {
        let (a, b) = (q.x.sin() * 0.3 + 1.0, q.y.cos() * 0.3 + 1.2);
        Matrix2::new(a, a * b * 0.25, a * b * 0.25, b)
    };
    let energy = |x: f64, y: f64| 0.5 * x * x + 0.3 * y * y + 0.2 * x.cos();
    let system = System::on(Euclidean::<2>)
        .metric(Metric::field(metric))
        .bracket(AreaForm)
        .energy(|q: &Vector2<Real>| q.x.powi(2) * 0.5 + q.y.powi(2) * 0.3 + q.x.cos() * 0.2)
        .build()
        .unwrap();
    let (mut long, mut worst) = (0, 0.0_f64);
    for k in 0..20_u32 {
        let start = vector![1.5 + 0.1 * f64::from(k), -0.5 + 0.13 * f64::from(k)];
        for h in [1.5, 2.0, 2.5, 3.0, 4.0, 5.0] {
            let mut steps = WeylMidpoint.steps(&system, start, h).unwrap();
            let end = steps.advance().unwrap().point;
            let size = energy(start.x, start.y);
            worst = worst.max((energy(end.x, end.y) - size).abs() / size.max(1.0));
            // The eigenvalues of the metric are above 0.6.
            long += u32::from(steps.certificate().effort.splits == 0 && (end - start).norm() > 2.6);
        }
    }
    println!("{long} steps of two radians, |H − H₀| ≤ {worst:.1e}");
    assert!(long >= 50 && worst <= 50.0 * f64::EPSILON, "{long}, {worst:e}");
}
