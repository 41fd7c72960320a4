//! The cost of a step of a lattice, as ratios in one run.

#[path = "../tests/models/chain.rs"]
mod chain;

use chain::{chain, waves};
use metriplectic::integrators::Method;
use metriplectic::prelude::*;

fn run<M: Method<F>, F: metriplectic::integrators::Flow>(
    method: M,
    flow: &F,
    start: &metriplectic::integrators::Element<F>,
    steps: usize,
) {
    let mut run = method.steps(flow, start.clone(), 0.05).unwrap();
    for _ in 0..steps {
        run.advance().unwrap();
    }
}

fn main() {
    let args: Vec<usize> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let [n, order, steps] = args[..] else { return };
    let lattice = chain(Graph::ring(n));
    let start = lattice.points(waves);
    let clock = std::time::Instant::now();
    if order == 5 {
        run(DormandPrince5, &lattice, &start, steps)
    } else {
        run(DormandPrince8, &lattice, &start, steps)
    }
    println!("{:.0} ns", clock.elapsed().as_secs_f64() * 1e9 / (n * steps) as f64);
}
