//! The cost of an explicit step of a lattice: a ring of a hundred and twenty oscillators with heat.

use metriplectic::prelude::*;

use crate::Row;
use crate::chain::{chain, waves};

pub(crate) fn rows() -> Vec<Row> {
    let ring = || chain(Graph::ring(120));
    let start = ring().points(waves);
    vec![
        Row::by("step/lattice/order_5", DormandPrince5, ring(), start.clone(), 0.05),
        Row::by("step/lattice/order_8", DormandPrince8, ring(), start, 0.05),
    ]
}
