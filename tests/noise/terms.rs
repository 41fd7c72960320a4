//! The terms of the table: they add up to the dissipation, and those that are said to have no kinetic drift have none.

use metriplectic::dynamics::noise::{NoiseTerms, Uniform, mismatch, noise_drift};
use metriplectic::integrators::Flow as _;
use metriplectic::manifolds::Riemannian;
use metriplectic::prelude::*;
use nalgebra::vector;

/// Checks the terms of a system at points along its motion.
fn check<Y>(name: &str, system: &Y, start: &metriplectic::dynamics::Point<Y>)
where
    Y: Metriplectic<Dissipation: NoiseTerms<Y::Manifold, Y::Metric>>,
    Canonical: Riemannian<Y::Manifold>,
{
    let mut x = start.clone();
    for k in 0..5 {
        let units = Y::Manifold::scales(&x);
        let [off, size] = mismatch(system, &x, &units).expect("a place on the manifold");
        assert!(off <= 1e-13 * size, "{name}: the terms are off by {off} of {size}");
        let drift = noise_drift(system, &x, &Uniform).expect("a place on the manifold");
        let largest = metriplectic::fields::Column::magnitude(&drift);
        if system.dissipation().is_closed() {
            assert!(largest <= 1e-12 * size, "{name}: the drift is {largest}");
        } else {
            assert!(largest > 1e-6 * size, "{name}: the drift is {largest}");
        }
        let zero = system.sizes(&x);
        let d =
            metriplectic::integrators::Vector::with(&zero, |i| 0.3 * f64::sin((i + 3 * k) as f64));
        x = system.moved(&x, &d);
    }
}

#[test]
fn the_table_of_terms() {
    let h = |x: &Vector3<Real>| x.x.powi(4) + x.y * x.z * 0.7 + x.z.exp() - x.x * x.y * x.y;
    let s = |x: &Vector3<Real>| x.norm_squared() * 0.5;
    let metric =
        || Metric::constant(Matrix3::new(2.0, 0.3, 0.0, 0.3, 1.0, -0.2, 0.0, -0.2, 0.7)).unwrap();
    let space = System::on(Euclidean::<3>).metric(metric()).energy(h).entropy(s).build().unwrap();
    check("a constant metric", &space, &vector![0.4, -0.3, 0.8]);
    let kappa = |x: &Vector3<Real>| x.x * x.x + 0.5;
    let scaled = System::on(Euclidean::<3>)
        .energy(h)
        .entropy(s)
        .dissipation(MetricDissipation::scaled(kappa))
        .build()
        .unwrap();
    check("a scaled metric", &scaled, &vector![0.4, -0.3, 0.8]);
    // The closed form is K d(½ ln κ).
    let x = vector![0.4, -0.3, 0.8];
    let found = noise_drift(&scaled, &x, &Uniform).unwrap();
    let logarithm = System::on(Euclidean::<3>)
        .energy(h)
        .entropy(move |x: &Vector3<Real>| kappa(x).ln() * 0.5)
        .dissipation(MetricDissipation::scaled(kappa))
        .build()
        .unwrap();
    let centre = metriplectic::fields::ChartPoint::centre(&x);
    let expected: Vector3<f64> = VectorField::velocity(&logarithm, &centre).unwrap();
    assert!((found - expected).norm() < 1e-13 * expected.norm(), "{found} {expected}");
    let sphere = System::on(Sphere::<2>::round()).energy(h).entropy(s).build().unwrap();
    check("a sphere", &sphere, &vector![0.6, 0.0, 0.8]);
    let rotations = System::on(Rotations)
        .energy(|r: &Matrix3<Real>| r[(0, 1)].powi(3) + r[(2, 2)] * r[(0, 0)])
        .entropy(|r: &Matrix3<Real>| r[(1, 1)])
        .build()
        .unwrap();
    check("rotations", &rotations, &Matrix3::identity());
    type Spin = (Vector3<Real>, Vector1<Real>);
    let spin = System::on(Product(Sphere::<2>::round(), HalfLine))
        .energy(move |x: &Spin| h(&x.0) * x.1.x + x.1.x.powi(2))
        .entropy(|x: &Spin| x.1.x.ln())
        .build()
        .unwrap();
    check("a sphere and a half line", &spin, &(vector![0.6, 0.0, 0.8], vector![1.3]));
    let curved = |x: &Vector3<Real>| {
        Matrix3::from_diagonal(&vector![x.y * x.y + 1.0, x.x.exp(), x.x * x.x + x.z * x.z + 2.0])
    };
    let field = System::on(Euclidean::<3>)
        .metric(Metric::field(curved))
        .energy(h)
        .entropy(s)
        .build()
        .unwrap();
    check("a metric from a closure", &field, &vector![0.4, -0.3, 0.8]);
    let se3 = LieDual::se3();
    let form = SMatrix::<f64, 6, 6>::from_fn(|i, j| if i == j { 0.3 } else { 0.05 });
    let friction = CasimirDissipation::new(se3.algebra(), form).unwrap();
    let top = System::on(se3)
        .energy(|x: &Vector6<Real>| x.norm_squared() * 0.5 + x[2].powi(3) * x[5])
        .entropy(|x: &Vector6<Real>| (3..6).map(|i| x[i] * x[i]).sum::<Real>() * 0.5)
        .dissipation(friction)
        .build()
        .unwrap();
    check("a Casimir dissipation", &top, &vector![0.4, -0.3, 0.8, 0.1, 0.2, 0.9]);
}
