//! The memory of a lattice, and what a step allocates of it.

#[path = "models/chain.rs"]
mod chain;

use chain::{chain, waves};
use metriplectic::prelude::*;

#[global_allocator]
static ALLOCATOR: dhat::Alloc = dhat::Alloc;

#[test]
fn a_site_takes_few_bytes_and_a_step_allocates_partial_sums_alone() {
    let sites = 100 * 1024;
    let _profiler = dhat::Profiler::builder().testing().build();
    let lattice = chain(Graph::ring(sites));
    let start = lattice.points(waves);
    let mut run = DormandPrince5.steps(&lattice, start, 0.05).unwrap();
    for _ in 0..3 {
        run.advance().unwrap();
    }
    let before = dhat::HeapStats::get();
    for _ in 0..4 {
        run.advance().unwrap();
    }
    let after = dhat::HeapStats::get();
    let a_site = after.max_bytes as f64 / sites as f64;
    let a_step = (after.total_bytes - before.total_bytes) as f64 / 4.0 / sites as f64;
    println!("{a_site:.0} bytes a site at most, {a_step:.1} allocated for it in a step");
    assert!(a_site < 500.0);
    assert!(a_step < 8.0);
}
