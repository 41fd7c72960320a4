//! What every explicit method promises, on lattices: oscillators with heat, and spins with heat.

use metriplectic::integrators::{Element, StageFlow};
use metriplectic::prelude::*;

use crate::chain::{chain, waves};
use crate::lattices::helix;
use crate::methods::Explicit;
use crate::promises::{Case, promises};

fn broken<F: StageFlow>(name: &str, case: &Case<'_, F>) -> Vec<String>
where
    Element<F>: 'static,
{
    let (mut methods, mut all) = (Explicit::ALL, Vec::new());
    for _ in 0..methods.len() {
        let label = format!("{name}, {:?}", methods[0]);
        all.extend(promises(case, &methods).into_iter().map(|what| format!("{label}: {what}")));
        methods.rotate_left(1);
    }
    all
}

#[test]
fn every_explicit_method_keeps_its_promises_on_lattices() {
    let ring = chain(Graph::ring(40));
    let start = ring.points(waves);
    let mut all = broken("chain with heat", &Case { flow: &ring, start: &start, time: 4.0 });
    let spins = helix::lattice(12, [1.0, 1.0]);
    let start = spins.points(|i| helix::at(12, i, 0.0));
    all.extend(broken("helix of spins", &Case { flow: &spins, start: &start, time: 4.0 }));
    assert!(all.is_empty(), "{}", all.join("\n"));
}
