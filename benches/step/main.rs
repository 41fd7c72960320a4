//! One step from closures against the same step written by hand.
//!
//! Both sides solve the same equation from the same guess to the same floor, and both take a
//! hundred steps from the same moving state, so that guesses are extrapolated as in a run. Before
//! they are timed, they are checked to arrive at the same point.
//!
//! `closure_metric` is the step from closures once more, with the canonical metric given by a closure
//! too, so that its geodesics are integrated.

use std::cell::Cell;
use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use metriplectic::dynamics::system::Point;
use metriplectic::integrators::residual::Recall;
use metriplectic::integrators::step::{Memory, Start};
use metriplectic::prelude::*;

mod chord;
mod rigid_body;
mod so3_nambu;
mod spinning_top;

/// Steps in one measurement.
const STEPS: usize = 100;

/// A step that is written out by hand.
trait Step: Clone {
    type Point: Copy;

    /// One step of size `h`; the displacement is kept for the next guess.
    fn step(&mut self, x: &Self::Point, h: f64) -> Self::Point;

    /// The entries of a point, in the order of [`Manifold::entries`].
    fn entries(x: &Self::Point) -> Vec<f64>;
}

/// `STEPS` steps of a system from its closures.
fn run<Y: Metriplectic>(system: &Y, start: &Point<Y>, h: f64) -> Point<Y>
where
    WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
{
    let scheme = Scheme::new(WeylMidpoint);
    let (mut memory, mut x) = (Memory::new(), start.clone());
    for _ in 0..STEPS {
        let energy = system.energy_at(&x);
        let left_over = Recall::nothing();
        let invariants = left_over.invariants;
        let start = Start { x: &x, time: 0.0, h, energy, invariants, left_over };
        let Ok((end, _)) = scheme.step(system, &start, &mut memory) else { break };
        x = end;
    }
    x
}

/// The largest difference between the entries of two points.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Times `STEPS` steps of a system from its closures, and by hand, each from its start.
fn compare<Y: Metriplectic, B: Step>(
    criterion: &mut Criterion,
    name: &str,
    h: f64,
    (system, start): (&Y, Point<Y>),
    (hand, hand_start): (B, B::Point),
) where
    WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
{
    let by_hand = |hand: &B, start: &B::Point| {
        let mut hand = hand.clone();
        (0..STEPS).fold(*start, |x, _| hand.step(&x, h))
    };

    let off = distance(
        &Y::Manifold::entries(&run(system, &start, h)),
        &B::entries(&by_hand(&hand, &hand_start)),
    );
    assert!(off <= 1e-12, "{name}: the two ends are {off:.1e} apart");

    let mut group = criterion.benchmark_group(name);
    group.throughput(Throughput::Elements(STEPS as u64));
    group.bench_function("closure", |bencher| {
        bencher.iter(|| black_box(run(system, black_box(&start), h)));
    });
    group.bench_function("hand_coded", |bencher| {
        bencher.iter(|| black_box(by_hand(black_box(&hand), black_box(&hand_start))));
    });
    group.finish();
}

/// Times the steps of a system whose canonical metric is a closure that counts its `evaluations`.
fn compare_metric<Y: Metriplectic, C: Metriplectic<Manifold = Y::Manifold>>(
    criterion: &mut Criterion,
    name: &str,
    h: f64,
    (canonical, start): (&C, Point<C>),
    (system, evaluations): (&Y, &Cell<u64>),
) where
    WeylMidpoint: Retraction<Y::Manifold, Y::Metric> + Retraction<C::Manifold, C::Metric>,
{
    evaluations.set(0);
    let end = Y::Manifold::entries(&run(system, &start, h));
    let each = evaluations.get() as f64 / STEPS as f64;
    println!("{name}/closure_metric: {each:.0} evaluations of the metric in a step");
    let off = distance(&C::Manifold::entries(&run(canonical, &start, h)), &end);
    assert!(off <= 1e-10, "{name}: the ends of both metrics are {off:.1e} apart");

    let mut group = criterion.benchmark_group(name);
    group.throughput(Throughput::Elements(STEPS as u64));
    group.bench_function("closure_metric", |bencher| {
        bencher.iter(|| black_box(run(system, black_box(&start), h)));
    });
    group.finish();
}

criterion_group!(benches, rigid_body::bench, spinning_top::bench, so3_nambu::bench);
criterion_main!(benches);
