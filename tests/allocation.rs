//! A step allocates nothing. A program of its own, because the allocator counts for the whole process,
//! and the threads of a test harness allocate too.

use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Guarantee};

#[global_allocator]
static ALLOCATOR: dhat::Alloc = dhat::Alloc;

/// Blocks allocated while a run of the Weyl midpoint takes a thousand steps.
fn blocks<Y: Metriplectic>(
    system: &Y,
    x0: <Y::Manifold as metriplectic::fields::Space>::Point<f64>,
) -> u64
where
    WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
{
    blocks_of(Scheme::new(WeylMidpoint), system, x0)
}

/// The same with another method.
fn blocks_of<Y: Metriplectic, M: Method<Y>>(
    scheme: M,
    system: &Y,
    x0: <Y::Manifold as metriplectic::fields::Space>::Point<f64>,
) -> u64 {
    let mut run = scheme.steps(system, x0, 0.05).expect("the model keeps its laws");
    let before = dhat::HeapStats::get().total_blocks;
    for _ in 0..1000 {
        run.advance().expect("every step is solved");
    }
    dhat::HeapStats::get().total_blocks - before
}

fn main() {
    let _profiler = dhat::Profiler::builder().testing().build();
    // The counter counts.
    let before = dhat::HeapStats::get().total_blocks;
    drop(std::hint::black_box(vec![1.0_f64; 10]));
    assert!(dhat::HeapStats::get().total_blocks > before);

    let body = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x.powi(2) * 0.5 + p.y.powi(2) * 0.25 + p.z.powi(4))
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .build()
        .expect("it is a system");
    assert_eq!(blocks(&body, vector![0.5, -0.3, 0.1]), 0);
    assert_eq!(blocks_of(Gauss::<4>, &body, vector![0.5, -0.3, 0.1]), 0);
    assert_eq!(blocks_of(Radau::<3>, &body, vector![0.5, -0.3, 0.1]), 0);

    // A run allocates its record and nothing else: as much for 2000 steps as for 20.
    let verified = body.verified(&vector![0.5, -0.3, 0.1]).expect("a model");
    let of_run = |steps: usize| {
        let before = dhat::HeapStats::get().total_blocks;
        let span = Span::steps(0.05, steps).at_most(2);
        drop(WeylMidpoint.run(&verified, vector![0.5, -0.3, 0.1], span).expect("a run"));
        dhat::HeapStats::get().total_blocks - before
    };
    let [short, long] = [20, 2000].map(of_run);
    println!("{short} blocks in a run of 20 steps, {long} in one of 2000");
    assert_eq!(short, long);
    assert!(short <= 30, "{short}");

    let top = System::on(LieDual::se3())
        .energy(|x: &Vector6<Real>| {
            let weights = [1.0, 0.5, 0.25, 0.2, 0.15, 0.1];
            (0..6).map(|i| x[i].powi(2) * weights[i]).sum()
        })
        .entropy(|x: &Vector6<Real>| (3..6).map(|i| x[i].powi(2) * 0.5).sum())
        .casimir(|x: &Vector6<Real>| (0..3).map(|i| x[i] * x[i + 3]).sum())
        .build()
        .expect("it is a system");
    assert_eq!(blocks(&top, vector![0.1, 0.2, 1.0, 0.0, 0.6, 0.8]), 0);

    let metric = Matrix6::<f64>::identity() * 2.0 + Matrix6::from_element(0.1);
    let spring = System::on(Euclidean::<6>)
        .metric(Metric::constant(metric).expect("it is a system"))
        .bracket(Poisson::field(|_: &Vector6<Real>| {
            Matrix6::from_fn(|i, j| Real::from(f64::from(j == i + 3) - f64::from(i == j + 3)))
        }))
        .energy(|x: &Vector6<Real>| x.norm_squared() * 0.5 + x[0].powi(4))
        .build()
        .expect("it is a system");
    assert_eq!(blocks(&spring, vector![0.3, 0.2, 0.1, 0.0, 0.1, 0.2]), 0);

    // With an entropy that the closure bracket, of rank four, leaves alone.
    let bath = System::on(Euclidean::<6>)
        .metric(Metric::constant(metric).expect("it is a system"))
        .bracket(Poisson::field(|_: &Vector6<Real>| {
            let pair = |i: usize, j: usize| f64::from(i < 2 && j == i + 2);
            Matrix6::from_fn(|i, j| Real::from(pair(i, j) - pair(j, i)))
        }))
        .energy(|x: &Vector6<Real>| x.norm_squared() * 0.5 + x[0].powi(4))
        .entropy(|x: &Vector6<Real>| x[4] - x[5].powi(2) * 0.5)
        .build()
        .expect("it is a system");
    assert_eq!(blocks(&bath, vector![0.3, 0.2, 0.1, 0.0, 0.1, 0.2]), 0);

    let sphere = System::on(Sphere::<2>::round())
        .energy(|x: &Vector3<Real>| x.x.powi(2) + x.y.powi(3) * 0.5)
        .entropy(|x: &Vector3<Real>| x.z)
        .build()
        .expect("it is a system");
    assert_eq!(blocks(&sphere, vector![0.6, 0.0, 0.8]), 0);
    let projected = Scheme::new(Projection).gradient(MeanValue);
    assert_eq!(blocks_of(projected, &sphere, vector![0.6, 0.0, 0.8]), 0);

    let group = System::on(Rotations::bi_invariant())
        .bracket(Nambu::default())
        .energy(|r: &Matrix3<Real>| r.m11 + r.m22 * 2.0 + r.m12 * r.m23 * 0.5)
        .entropy(|r: &Matrix3<Real>| r.m13 - r.m21 * 0.5)
        .build()
        .expect("it is a system");
    assert_eq!(blocks(&group, Matrix3::identity()), 0);
    let cayley = Scheme::new(Cayley).gradient(SymmetricItohAbe);
    assert_eq!(blocks_of(cayley, &group, Matrix3::identity()), 0);

    // A product, with a momentum: a spring in the plane, which warms up.
    type Warm = (Vector4<Real>, Vector1<Real>);
    let spring = System::on(Product(Euclidean::<4>, Euclidean::<1>))
        .bracket((Symplectic, Zero))
        .energy(|(x, s): &Warm| x.norm_squared() * 0.5 + x.xy().norm_squared().powi(2) + s.x.exp())
        .entropy(|(_, s): &Warm| s.x)
        .momentum(|(x, _): &Warm| x.x * x.w - x.y * x.z)
        .dissipation(MetricDissipation::scaled(|_: &Warm| Real::from(1e-4)))
        .build()
        .expect("it is a system");
    assert_eq!(blocks(&spring, (vector![0.6, 0.0, 0.1, 0.8], vector![0.0])), 0);

    // Geodesics integrated numerically, of the half plane.
    let plane = System::on(Euclidean::<2>)
        .metric(Metric::field(|q: &Vector2<Real>| Matrix2::from_diagonal_element(q.y.powi(-2))))
        .bracket(AreaForm)
        .energy(|q: &Vector2<Real>| q.x.powi(2) + q.y.powi(2))
        .build()
        .expect("it is a system");
    assert_eq!(blocks(&plane, vector![0.3, 1.2]), 0);

    Claim::new(
        Guarantee::Allocation,
        "nine systems on flat spaces, duals, S², SO(3), products and the half plane",
        "WeylMidpoint, Projection, Cayley, Gauss::<4>, Radau::<3>",
    )
    .against("the counter of a profiler of the heap")
    .record("0 blocks", "0 blocks");
}
