//! Logarithms of metrics from closures, where the geodesics are long and bend much.

use metriplectic::fields::MatrixField;
use metriplectic::manifolds::Riemannian;
use metriplectic::prelude::*;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

/// A plane with hills and hollows, `g = eᶠ 1` with `f = a sin 2x cos 2y`, of curvature `4f e⁻ᶠ`: points
/// farther apart than `π/√K` may be beyond conjugate points of each other.
fn bumps(height: f64) -> impl MatrixField<Euclidean<2>> {
    move |q: &Vector2<Real>| {
        let bump = (q.x * 2.0).sin() * (q.y * 2.0).cos() * height;
        Matrix2::from_diagonal_element(bump.exp())
    }
}

/// Whether a logarithm is found; one that is leads to its point.
fn is_found(height: f64, x: &Vector2<f64>, y: &Vector2<f64>) -> bool {
    let metric = Metric::field(bumps(height));
    let log = Riemannian::<Euclidean<2>>::log(&metric, x, y);
    if let Ok(v) = &log {
        let end = Riemannian::<Euclidean<2>>::end(&metric, x, v).expect("it was followed");
        assert!((end - y).norm() < 1e-10, "from {x} to {y}: {:e}", (end - y).norm());
    }
    log.is_ok()
}

/// Neither Newton's method from the straight line nor the continuation from near points reaches
/// these; the relaxation of a path, which comes with argmin, does.
#[test]
fn a_relaxed_path_leads_to_points_that_shooting_alone_misses() {
    for (height, x, y) in [
        (0.5, vector![2.4, -1.1], vector![6.4, 1.6]),
        (0.5, vector![1.3, 0.0], vector![3.4, 3.4]),
        (1.0, vector![0.3, 0.1], vector![3.5, -1.9]),
        (1.0, vector![0.7, 2.3], vector![1.1, 6.0]),
        (2.0, vector![1.3, 1.2], vector![4.5, 4.7]),
        (3.0, vector![-2.1, 0.0], vector![-3.5, 0.1]),
    ] {
        assert!(is_found(height, &x, &y), "{height}: {x} {y}");
    }
}

#[test]
fn logarithms_over_many_bumps_are_found() {
    let mut rng = ChaCha8Rng::seed_from_u64(2024);
    for _ in 0..500 {
        let x = vector![rng.random_range(-3.0..3.0), rng.random_range(-3.0..3.0)];
        let angle: f64 = rng.random_range(0.0..std::f64::consts::TAU);
        let y = x + vector![angle.cos(), angle.sin()] * rng.random_range(1.0..4.0);
        assert!(is_found(0.5, &x, &y), "from {x} to {y}");
    }
}
