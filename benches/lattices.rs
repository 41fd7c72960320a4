//! The cost of a step of a lattice, as ratios in one run: over the number of sites, beside derivatives by hand, beside a
//! step without the laws, and on two threads.
//!
//! `cargo bench -p metriplectic-benches --bench lattices` prints a table; `-- N ORDER STEPS` runs one case, for a profiler,
//! and `-- N ORDER STEPS plain` the same without the laws.

#[path = "../tests/models/chain.rs"]
mod chain;

use std::time::Instant;

use chain::{CANONICAL, chain, onsager, waves};
use metriplectic::fields::{Jet1, Scalar};
use metriplectic::integrators::explicit::{Projected, ProjectionError, Target};
use metriplectic::integrators::{Element, Flow, Laws, StageFlow};
use metriplectic::lattices::Model;
use metriplectic::manifolds::PointError;
use metriplectic::prelude::*;

/// The functions of the chain with their derivatives by hand.
struct ByHand;

impl ScalarField<Euclidean<3>> for ByHand {
    fn at<D: Scalar>(&self, x: &SVector<D, 3>) -> D {
        x.y * x.y * 0.5 + (x.z * 0.5).exp() * 2.0
    }

    #[inline]
    fn jet1(&self, x: &Vector3<f64>) -> Jet1<Euclidean<3>> {
        let t = (0.5 * x.z).exp();
        Jet1 { value: 0.5 * x.y * x.y + 2.0 * t, df: vector![0.0, x.y, t] }
    }
}

struct BondByHand;

impl ScalarField<Product<Euclidean<3>, Euclidean<3>>> for BondByHand {
    fn at<D: Scalar>(&self, (x, y): &(SVector<D, 3>, SVector<D, 3>)) -> D {
        let r = y.x - x.x;
        r * r * (r * r * 0.25 + r * (0.25 / 3.0) + 0.5) - r * (x.z + y.z) * 0.025
    }

    #[inline]
    fn jet1(
        &self,
        (x, y): &(Vector3<f64>, Vector3<f64>),
    ) -> Jet1<Product<Euclidean<3>, Euclidean<3>>> {
        let (r, heat) = (y.x - x.x, 0.025 * (x.z + y.z));
        let value = r * r * (r * r * 0.25 + r * (0.25 / 3.0) + 0.5) - r * heat;
        let force = r * (1.0 + r * (0.25 + r)) - heat;
        Jet1 { value, df: vector![-force, 0.0, -0.025 * r, force, 0.0, -0.025 * r] }
    }
}

struct Entry(usize);

impl ScalarField<Euclidean<3>> for Entry {
    fn at<D: Scalar>(&self, x: &SVector<D, 3>) -> D {
        x[self.0]
    }

    #[inline]
    fn jet1(&self, x: &Vector3<f64>) -> Jet1<Euclidean<3>> {
        let mut df = Vector3::zeros();
        df[self.0] = 1.0;
        Jet1 { value: x[self.0], df }
    }
}

fn by_hand(n: usize) -> Lattice<impl Model<Manifold = Euclidean<3>>> {
    Lattice::on(Graph::ring(n), Euclidean::<3>)
        .bracket(Poisson::constant(CANONICAL).expect("a skew matrix"))
        .energy(ByHand)
        .bond_energy(BondByHand)
        .entropy(Entry(2))
        .bond_onsager(onsager)
        .conserved(Entry(1))
        .build()
        .expect("the parts make a lattice")
}

/// A lattice without laws: its steps are those of the plain Runge-Kutta method.
struct Plain<'a, F>(&'a F);

impl<F: StageFlow<Numbers = Vec<f64>>> Flow for Plain<'_, F> {
    type Space = F::Space;
    type Numbers = Vec<f64>;
    type Vector = F::Vector;

    fn laws(&self, _: &Element<Self>) -> Laws<Vec<f64>> {
        Laws { energy: 0.0, entropy: 0.0, invariants: Vec::new() }
    }

    fn term_sizes(&self, x: &Element<Self>) -> Laws<Vec<f64>> {
        self.laws(x)
    }

    fn rates(&self, x: &Element<Self>, d: &F::Vector) -> Option<F::Vector> {
        self.0.rates(x, d)
    }

    fn sizes(&self, x: &Element<Self>) -> F::Vector {
        self.0.sizes(x)
    }

    fn moved(&self, x: &Element<Self>, d: &F::Vector) -> Element<Self> {
        self.0.moved(x, d)
    }

    fn element(&self, entries: &[f64]) -> Result<Element<Self>, PointError> {
        self.0.element(entries)
    }
}

impl<F: StageFlow<Numbers = Vec<f64>>> StageFlow for Plain<'_, F> {
    type Gradients = ();

    fn gradients(&self, _: &Element<Self>) -> Option<()> {
        Some(())
    }

    fn values(&self, (): &()) -> Laws<Vec<f64>> {
        Laws { energy: 0.0, entropy: 0.0, invariants: Vec::new() }
    }

    fn velocity(&self, x: &Element<Self>, (): &()) -> Option<(F::Vector, f64)> {
        self.0.motion(x)
    }

    fn stage(&self, x: &Element<Self>, q: &F::Vector) -> Option<Element<Self>> {
        self.0.stage(x, q)
    }

    fn stage_rates(
        &self,
        x: &Element<Self>,
        at: (&F::Vector, &Element<Self>),
        v: &F::Vector,
    ) -> F::Vector {
        self.0.stage_rates(x, at, v)
    }

    fn stage_coordinates(&self, x: &Element<Self>, y: &Element<Self>) -> F::Vector {
        self.0.stage_coordinates(x, y)
    }

    fn project(
        &self,
        x: Element<Self>,
        _: &Target<'_, Self>,
    ) -> Result<Projected<Self>, ProjectionError> {
        Ok(Projected { x, gradients: (), entropy: 0.0, entropy_round_off: 0.0 })
    }
}

/// Takes steps of size 0.05.
fn steps<F: StageFlow>(order: usize, flow: &F, start: &Element<F>, count: usize) {
    fn of<F: StageFlow, M: Method<F>>(method: M, flow: &F, start: &Element<F>, count: usize) {
        let mut run = method.steps(flow, start.clone(), 0.05).expect("the lattice has its laws");
        for _ in 0..count {
            run.advance().expect("every step is taken");
        }
    }
    match order {
        5 => of(DormandPrince5, flow, start, count),
        _ => of(DormandPrince8, flow, start, count),
    }
}

/// Nanoseconds for a site and a step: the least of five differences between a long run and a short one.
fn time<F: StageFlow>(order: usize, flow: &F, start: &Element<F>, sites: usize) -> f64 {
    let count = (1_000_000 / sites).clamp(3, 200);
    let clocked = |count| {
        let clock = Instant::now();
        steps(order, flow, start, count);
        clock.elapsed().as_secs_f64()
    };
    let times = (0..5).map(|_| clocked(1 + count) - clocked(1));
    times.fold(f64::INFINITY, f64::min) * 1e9 / (count * sites) as f64
}

fn on<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> R {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("threads start").install(work)
}

fn main() {
    let case: Vec<usize> = std::env::args().skip(1).filter_map(|arg| arg.parse().ok()).collect();
    if let [n, order, count] = case[..] {
        let lattice = chain(Graph::ring(n));
        if std::env::args().any(|arg| arg == "plain") {
            return steps(order, &Plain(&lattice), &lattice.points(waves), count);
        }
        return steps(order, &lattice, &lattice.points(waves), count);
    }
    println!("ns for a site and a step on one thread; ratios to the closures");
    println!("   sites order  closures  by hand (ratio)  without laws (ratio)  two threads (gain)");
    for order in [5, 8] {
        for n in [1000, 10_000, 100_000, 1_000_000] {
            let (lattice, hand) = (chain(Graph::ring(n)), by_hand(n));
            let start = lattice.points(waves);
            let closures = on(1, || time(order, &lattice, &start, n));
            let hand = on(1, || time(order, &hand, &start, n));
            let plain = on(1, || time(order, &Plain(&lattice), &start, n));
            let two = on(2, || time(order, &lattice, &start, n));
            println!(
                "{n:8} {order:5} {closures:9.0} {hand:8.0} ({:.2}) {plain:13.0} ({:.2}) {two:12.0} ({:.2})",
                closures / hand,
                closures / plain,
                closures / two
            );
        }
    }
    let n = 1_000_000;
    let clock = Instant::now();
    let lattice = chain(Graph::ring(n));
    let built = clock.elapsed().as_secs_f64();
    let start = lattice.points(waves);
    let clock = Instant::now();
    lattice.verify(&start).expect("the lattice has its laws");
    println!(
        "{n} sites are built in {built:.2} s and verified in {:.2} s",
        clock.elapsed().as_secs_f64()
    );
}
