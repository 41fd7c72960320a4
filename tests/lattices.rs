//! Lattices: both laws, orders, closed forms, and the same bits on every number of threads.

#[path = "models/chain.rs"]
mod chain;

use chain::{chain, waves};
use metriplectic::prelude::*;

#[test]
fn first() {
    let lattice = chain(Graph::ring(3000));
    let start = lattice.points(waves);
    let run = DormandPrince5.run(&lattice, start.clone(), Span::steps(0.05, 100).every(100)).unwrap();
    println!("{}", run.certificate());
    println!("{:?}", run.certificate());
    let run = DormandPrince8
        .run(&lattice, start, Span::until(5.0).tolerance(1e-8).at_most(2))
        .unwrap();
    println!("{}", run.certificate());
    println!("{:?}", run.certificate());
}
