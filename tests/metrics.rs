//! Metrics from closures: the canonical ones again, and logarithms of far points.

use metriplectic::fields::{BrokenLaw, Space, Vector};
use metriplectic::manifolds::{InnerProduct, Riemannian, laws};
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
    unless("the same logarithm", (log - *u).magnitude(), 1e-11)?;
    let (a, b) = (field.at(&left).map_err(exists)?, canonical.at(&right).map_err(exists)?);
    unless("the same inner product", (a.flat(u) - b.flat(u)).magnitude(), 1e-12)?;
    let volumes =
        field.volume(&centre).map_err(exists)? / canonical.volume(&centre).map_err(exists)?;
    unless("the same volume", (volumes - 1.0).abs(), 1e-12)
}

fn identity<M: Space, const A: usize>(_: &M::Point<Real>) -> SMatrix<Real, A, A> {
    SMatrix::identity()
}

macro_rules! on_the_sphere {
    ($name:ident, $n:literal, $a:literal) => {
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

on_the_sphere!(the_ambient_identity_is_the_round_metric_of_the_circle, 1, 2);
on_the_sphere!(the_ambient_identity_is_the_round_metric_of_the_sphere, 2, 3);
on_the_sphere!(the_ambient_identity_is_the_round_metric_of_the_three_sphere, 3, 4);
on_the_sphere!(the_ambient_identity_is_the_round_metric_of_the_four_sphere, 4, 5);
on_the_sphere!(the_ambient_identity_is_the_round_metric_of_the_five_sphere, 5, 6);
on_the_sphere!(the_ambient_identity_is_the_round_metric_of_the_six_sphere, 6, 7);
on_the_sphere!(the_ambient_identity_is_the_round_metric_of_the_seven_sphere, 7, 8);

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
    fn metrics_that_vary_keep_the_laws_on_the_sphere_and_on_rotations(
        seed in any::<u64>(), u in prop::array::uniform3(-0.7..0.7), a in 0.1..1.0_f64,
    ) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let ambient = Metric::field(move |x: &Vector3<Real>| {
            Matrix3::from_diagonal(&vector![1.0, 1.5, 2.0]).cast::<Real>()
                + x.yzx() * x.yzx().transpose() * Real::from(a)
        });
        let (x, v) = (Sphere::<2>.random(&mut rng), vector![u[0], u[1]]);
        laws::metric::<Sphere<2>, _>(&ambient, &x, &v)?;
        laws::retraction::<Sphere<2>, _, _>(&WeylMidpoint, &ambient, &x, &v)?;
        laws::retraction::<Sphere<2>, _, _>(&Exponential, &ambient, &x, &v)?;
        laws::retraction::<Sphere<2>, _, _>(&Projection, &ambient, &x, &v)?;
        laws::symmetric_retraction::<Sphere<2>, _, _>(
            &WeylMidpoint, &ambient, &x, &Sphere::<2>::chart(&x, &v),
        )?;
        let body = Metric::field(move |r: &Matrix3<Real>| {
            let lean = r.column(2).into_owned();
            Matrix3::from_diagonal(&vector![1.0, 1.5, 2.0]).cast::<Real>()
                + lean * lean.transpose() * Real::from(a)
        });
        let (x, v) = (Rotations.random(&mut rng), Vector3::from(u));
        laws::metric::<Rotations, _>(&body, &x, &v)?;
        laws::retraction::<Rotations, _, _>(&WeylMidpoint, &body, &x, &v)?;
        laws::retraction::<Rotations, _, _>(&Cayley, &body, &x, &v)?;
        laws::symmetric_retraction::<Rotations, _, _>(
            &WeylMidpoint, &body, &x, &Rotations::chart(&x, &v),
        )?;
    }
}

/// How many of 10⁴ logarithms are found, each checked by `length`.
fn found<G: Riemannian<Euclidean<2>>>(
    metric: &G,
    mut pair: impl FnMut(&mut ChaCha8Rng) -> (Vector2<f64>, Vector2<f64>),
    is_right: impl Fn(&Vector2<f64>, &Vector2<f64>, &Vector2<f64>) -> bool,
) -> u32 {
    let mut rng = ChaCha8Rng::seed_from_u64(2024);
    let mut found = 0;
    for _ in 0..10_000 {
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

#[test]
fn logarithms_of_the_half_plane_are_found() {
    let field = Metric::field(|q: &Vector2<Real>| Matrix2::from_diagonal_element(q.y.powi(-2)));
    let point = |rng: &mut ChaCha8Rng| {
        vector![rng.random_range(-3.0..3.0), 10.0_f64.powf(rng.random_range(-1.0..1.0))]
    };
    let found = found(
        &field,
        |rng| (point(rng), point(rng)),
        |x, y, v| {
            let distance = (1.0 + (y - x).norm_squared() / (2.0 * x.y * y.y)).acosh();
            (v.norm() / x.y - distance).abs() < 1e-10 * (1.0 + distance)
        },
    );
    println!("{found} of 10000 logarithms of the half plane");
    assert!(found >= 9990);
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
    let found = found(&field, &mut start, |x, y, v| {
        let end = Riemannian::<Euclidean<2>>::end(&field, x, v).unwrap();
        (end - y).norm() < 1e-11
    });
    println!("{found} of 10000 logarithms of the bumpy metric");
    assert!(found >= 9990);
}
