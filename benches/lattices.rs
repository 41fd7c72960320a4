//! The cost of a step of a lattice, as ratios in one run.

#[path = "../tests/models/chain.rs"]
mod chain;

use std::time::Instant;

use chain::{chain, waves};
use metriplectic::integrators::Method;
use metriplectic::prelude::*;

/// Nanoseconds for a site and a step.
fn time<M: Method<F> + Copy, F: metriplectic::integrators::Flow>(
    method: M,
    flow: &F,
    start: &metriplectic::integrators::Element<F>,
    sites: usize,
) -> f64 {
    let steps = (2_000_000 / sites).clamp(4, 400);
    let mut run = method.steps(flow, start.clone(), 0.05).unwrap();
    for _ in 0..2 {
        run.advance().unwrap();
    }
    let clock = Instant::now();
    for _ in 0..steps {
        run.advance().unwrap();
    }
    let elapsed = clock.elapsed().as_secs_f64();
    let c = run.certificate();
    eprintln!("   {:.1e} {} {:?}", c.max_relative_energy_error(), c.entropy_falls, c.projected_steps);
    elapsed * 1e9 / (steps * sites) as f64
}

fn main() {
    for n in [1000, 10_000, 100_000, 1_000_000] {
        let lattice = chain(Graph::ring(n));
        let start = lattice.points(waves);
        println!("{n}: 5: {:.0} ns", time(DormandPrince5, &lattice, &start, n));
        println!("{n}: 8: {:.0} ns", time(DormandPrince8, &lattice, &start, n));
    }
}
