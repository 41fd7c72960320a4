//! Logarithms and distances against data in high precision, made by `tests/data/logarithms.py`, and on
//! random pairs of points.

use metriplectic_fields::{Column as _, Vector};
use metriplectic_manifolds::{
    Canonical, Euclidean, HalfLine, Manifold, Product, Riemannian, Rotations, Sphere, rotations,
};
use nalgebra::{Matrix3, SVector, Vector1, vector};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use serde_json::Value;

const EPSILON: f64 = f64::EPSILON;

/// The cases of one space.
fn cases(space: &str) -> Vec<Value> {
    let mut data: Value =
        serde_json::from_str(include_str!("data/logarithms.json")).expect("the data are JSON");
    serde_json::from_value(data[space].take()).expect("the space has cases")
}

/// A number is text, because not every reader of JSON rounds its digits to the nearest.
fn number(digits: &Value) -> f64 {
    digits.as_str().and_then(|digits| digits.parse().ok()).expect("a number")
}

fn column<const N: usize>(entries: &Value) -> SVector<f64, N> {
    SVector::from_fn(|i, _| number(&entries[i]))
}

/// The angle to `4ε`, the vector to `8ε/(π − θ)`, both relative for near points. Of points far
/// apart half of that is kept, because a short `y + x` has digits that `y − x` has not.
macro_rules! logarithms_of_the_sphere {
    ($name:ident, $n:literal in $a:literal) => {
        #[test]
        fn $name() {
            for case in cases(stringify!($n)) {
                let (x, y) = (column::<$a>(&case["x"]), column::<$a>(&case["y"]));
                let (angle, gap) = (number(&case["angle"]), number(&case["gap"]));
                let distance = Riemannian::<Sphere<$n>>::distance(&Canonical, &x, &y).unwrap();
                let error = (distance - angle).abs() / EPSILON;
                assert!(error <= 4.0 * angle.min(1.0), "θ = {angle}: off by {error:.2} ε");
                let log = Riemannian::<Sphere<$n>>::log(&Canonical, &x, &y).unwrap();
                let error = (log - column::<$n>(&case["log"])).norm() * gap / EPSILON;
                let bound = if angle < 2.0 { 8.0 * angle.min(1.0) } else { 4.0 };
                assert!(error <= bound, "θ = {angle}: off by {error:.2} ε/(π − θ)");
            }
        }
    };
}
logarithms_of_the_sphere!(logarithms_of_the_circle_have_their_digits, 1 in 2);
logarithms_of_the_sphere!(logarithms_of_the_sphere_have_their_digits, 2 in 3);
logarithms_of_the_sphere!(logarithms_of_the_three_sphere_have_their_digits, 3 in 4);
logarithms_of_the_sphere!(logarithms_of_the_five_sphere_have_their_digits, 5 in 6);
logarithms_of_the_sphere!(logarithms_of_the_seven_sphere_have_their_digits, 7 in 8);

#[test]
fn logarithms_of_rotations_have_their_digits_up_to_half_a_turn() {
    for case in cases("rotations") {
        let r = Matrix3::from_row_slice(column::<9>(&case["rows"]).as_slice());
        let exact = column::<3>(&case["log"]);
        let error = (rotations::log(&r) - exact).norm() / (exact.norm() * EPSILON);
        assert!(error <= 4.0, "θ = {}: off by {error:.2} ε", exact.norm());
        let log = Riemannian::<Rotations>::log(&Canonical, &Matrix3::identity(), &r).unwrap();
        assert_eq!(log, rotations::log(&r));
    }
}

/// Every random pair has a logarithm, and a geodesic that ends where it should.
macro_rules! random_pairs {
    ($name:ident, $n:literal) => {
        #[test]
        fn $name() {
            let mut rng = ChaCha8Rng::seed_from_u64(2401);
            for _ in 0..10_000 {
                let [x, y] = [0, 1].map(|_| Sphere::<$n>.random(&mut rng));
                let log = Riemannian::<Sphere<$n>>::log(&Canonical, &x, &y).unwrap();
                let end = Riemannian::<Sphere<$n>>::end(&Canonical, &x, &log).unwrap();
                assert!((end - y).norm() < 16.0 * EPSILON, "{x} and {y}");
            }
        }
    };
}
random_pairs!(random_pairs_of_the_circle_have_logarithms, 1);
random_pairs!(random_pairs_of_the_sphere_have_logarithms, 2);
random_pairs!(random_pairs_of_the_three_sphere_have_logarithms, 3);
random_pairs!(random_pairs_of_the_five_sphere_have_logarithms, 5);
random_pairs!(random_pairs_of_the_seven_sphere_have_logarithms, 7);

#[test]
fn distances_are_their_closed_forms() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for _ in 0..1000 {
        let [x, y] = [0, 1].map(|_| Sphere::<3>.random(&mut rng));
        let angle = x.dot(&y).acos();
        let on_sphere = Riemannian::<Sphere<3>>::distance(&Canonical, &x, &y).unwrap();
        // The arc cosine has lost as many digits as its slope says.
        assert!((on_sphere - angle).abs() < 4.0 * EPSILON / angle.sin());

        let [r, s] = [0, 1].map(|_| Rotations.random(&mut rng));
        let turn = (0.5 * (r.tr_mul(&s).trace() - 1.0)).acos();
        let on_group = Riemannian::<Rotations>::distance(&Canonical, &r, &s).unwrap();
        assert!((on_group - turn).abs() < 8.0 * EPSILON / turn.sin());

        let [a, b] = [0, 1].map(|_| Vector1::<f64>::new(rng.random_range(0.1..10.0)));
        let ratio = (b.x / a.x).ln();
        let on_line = Riemannian::<HalfLine>::distance(&Canonical, &a, &b).unwrap();
        assert!((on_line - ratio.abs()).abs() < 8.0 * EPSILON);

        // Pythagoras on a product.
        type Spin = Product<Product<Sphere<3>, Rotations>, HalfLine>;
        let (here, there) = (((x, r), a), ((y, s), b));
        let all = Riemannian::<Spin>::distance(&Canonical, &here, &there).unwrap();
        let expected = on_sphere.hypot(on_group).hypot(on_line);
        assert!((all - expected).abs() < 8.0 * EPSILON * expected);
    }
    let [x, y] = [vector![1.0, 2.0], vector![4.0, 6.0]];
    assert_eq!(Riemannian::<Euclidean<2>>::distance(&Canonical, &x, &y), Ok(5.0));
}

/// No point of the manifold is nearer to an array of numbers than its projection.
fn nearest<M: Manifold>(
    space: &M,
    rng: &mut ChaCha8Rng,
    apart: impl Fn(&M::Point<f64>) -> f64,
    x: &M::Point<f64>,
) {
    let projected = space.project(x);
    assert_eq!(space.check(&projected), Ok(()));
    let least = apart(&projected);
    for _ in 0..200 {
        assert!(apart(&space.random(rng)) >= least);
        for size in [1e-2, 1e-5] {
            let v = Vector::<M>::from_index(|_| rng.random_range(-size..size));
            assert!(apart(&M::chart(&projected, &v)) >= least * (1.0 - EPSILON));
        }
    }
}

#[test]
fn projections_are_the_nearest_points() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    for _ in 0..50 {
        let x = SVector::<f64, 4>::from_fn(|_, _| rng.random_range(-2.0..2.0));
        nearest(&Sphere::<3>, &mut rng, |y| (y - x).norm(), &x);
        let a = Matrix3::from_fn(|_, _| rng.random_range(-2.0..2.0));
        nearest(&Rotations, &mut rng, |r| (r - a).norm(), &a);
        // Of the polar factor R of A, RᵀA is symmetric, and positive where det A is.
        let symmetric = Rotations.project(&a).tr_mul(&a);
        assert!((symmetric - symmetric.transpose()).amax() < 1e-14);
        let lowest = symmetric.symmetric_eigenvalues().min();
        assert_eq!(lowest > 0.0, a.determinant() > 0.0, "{a}");
        let s = Vector1::new(rng.random_range(-2.0..2.0));
        nearest(&HalfLine, &mut rng, |t| (t - s).norm(), &s);
    }
    // What is on the manifold stays where it is.
    for _ in 0..100 {
        let x = Sphere::<7>.random(&mut rng);
        assert!((Sphere::<7>.project(&x) - x).norm() <= 2.0 * EPSILON);
        let r = Rotations.random(&mut rng);
        assert!((Rotations.project(&r) - r).norm() <= 8.0 * EPSILON);
    }
}
