//! The memory of a lattice, and what a step allocates of it.

#[path = "models/chain.rs"]
mod chain;

use chain::{chain, waves};
use metriplectic::integrators::{Element, Flow};
use metriplectic::prelude::*;

#[global_allocator]
static ALLOCATOR: dhat::Alloc = dhat::Alloc;

const SITES: usize = 100 * 1024;

/// The most bytes of a site in a run, and those that a step allocates for it.
fn bytes(eight: bool) -> [f64; 2] {
    fn of<F: Flow, M: Method<F>>(method: M, flow: &F, start: Element<F>) -> u64 {
        let mut run = method.steps(flow, start, 0.05).expect("a lattice");
        let mut total = 0;
        for step in 0..7 {
            run.advance().expect("a step");
            // The first steps fill the pools.
            if step == 2 {
                total = dhat::HeapStats::get().total_bytes;
            }
        }
        dhat::HeapStats::get().total_bytes - total
    }
    let _profiler = dhat::Profiler::builder().testing().build();
    let lattice = chain(Graph::ring(SITES));
    let start = lattice.points(waves);
    let total = if eight {
        of(DormandPrince8, &lattice, start)
    } else {
        of(DormandPrince5, &lattice, start)
    };
    let most = dhat::HeapStats::get().max_bytes;
    [most as f64 / SITES as f64, total as f64 / (4 * SITES) as f64]
}

#[test]
fn a_site_takes_few_bytes_and_a_step_allocates_partial_sums_alone() {
    for (eight, most) in [(false, 326.0), (true, 397.0)] {
        let [a_site, a_step] = bytes(eight);
        println!("order 8: {eight}: {a_site:.0} bytes a site, {a_step:.1} allocated in a step");
        assert!(a_site < most, "{a_site}");
        // Some hundred bytes for each chunk of 1024 sites in each loop.
        assert!(a_step < 8.0, "{a_step}");
    }
}
