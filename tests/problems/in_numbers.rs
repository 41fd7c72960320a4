//! Every problem in plain numbers: the same bits as its types have, and the laws of an implementation.

use std::collections::BTreeSet;

use metriplectic::dynamics::InNumbers;
use metriplectic::dynamics::system::Point;
use metriplectic::equations::{Equations, Sizes, laws};
use metriplectic::integrators::{Flow, StageFlow, Vector};
use metriplectic::manifolds::Manifold;
use metriplectic::prelude::*;
use metriplectic_studies::problems::{Problem, Study, each};

/// The names, metrics and types of the problems that were compared.
#[derive(Default)]
struct Compared(BTreeSet<[&'static str; 3]>);

/// Compares all problems.
pub(crate) fn compare() {
    let mut compared = Compared::default();
    each(&mut compared);
    assert_eq!(compared.0.len(), 16);
}

/// A displacement that moves every entry by some part of its size.
fn direction(sizes: &[f64]) -> Vec<f64> {
    sizes.iter().enumerate().map(|(i, size)| 0.01 * size * (1.0 + 2.0 * i as f64).sin()).collect()
}

impl Study for Compared {
    fn visit<Y, R>(&mut self, problem: &Problem<Y>, _: &'static str, _: R, _: f64)
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric> + Copy,
    {
        if !self.0.insert([problem.name, problem.metric, std::any::type_name::<Y>()]) {
            return;
        }
        let (system, start) = (&problem.system, &problem.start);
        let (numbers, x) = (InNumbers(system), Y::Manifold::entries(start));
        let Sizes { directions: n, laws: count, entries } = numbers.sizes();
        let (mut values, mut v, mut rates) = (vec![0.0; count], vec![0.0; n], vec![0.0; n]);
        let (mut sizes, mut y) = (vec![0.0; n], vec![0.0; entries]);
        let name = problem.name;

        numbers.values(0.0, &x, &mut values);
        let typed = Flow::laws(system, start);
        let listed = typed.invariants.as_ref();
        assert_eq!(values, [&[typed.energy, typed.entropy], listed].concat(), "{name}");

        numbers.scales(&x, &mut sizes);
        let u = direction(&sizes);
        assert_eq!(sizes, numbers_of(&Flow::sizes(system, start)), "{name}");

        let production = numbers.velocity(0.0, &x, &mut v).expect("it has a velocity");
        let (typed, of_types) = motion(system, start);
        assert_eq!((&v, production), (&typed, of_types), "{name}");

        numbers.chart(&x, &u, &mut y);
        let q = Flow::sizes(system, start).with(|i| u[i]);
        assert_eq!(y, Y::Manifold::entries(&system.moved(start, &q)), "{name}");
        let there = StageFlow::stage(system, start, &q).expect("it is a stage");
        let mut of_stage = vec![0.0; entries];
        assert!(numbers.stage_state(&x, &u, &mut of_stage), "{name}");
        let production = numbers.velocity(0.0, &of_stage, &mut v).expect("it has a velocity");
        numbers.stage_rates(&x, &u, &of_stage, &v, &mut rates);
        let (at_stage, of_types) = StageFlow::motion(system, &there).expect("it has a velocity");
        let typed = StageFlow::stage_rates(system, start, (&q, &there), &at_stage);
        assert_eq!((rates, production), (numbers_of(&typed), of_types), "{name}");

        // The laws of an implementation, near the start, where nothing vanishes by symmetry.
        laws::equations(&numbers, 0.0, &y, &u).unwrap_or_else(|law| panic!("{name}: {law}"));
        laws::model(&numbers, 0.0, &y, &u).unwrap_or_else(|law| panic!("{name}: {law}"));
    }
}

/// The numbers of a vector of a flow.
fn numbers_of<V: Vector>(v: &V) -> Vec<f64> {
    (0..v.len()).map(|i| v.get(i)).collect()
}

fn motion<Y: Metriplectic>(system: &Y, x: &Point<Y>) -> (Vec<f64>, f64) {
    let (v, production) = StageFlow::motion(system, x).expect("it has a velocity");
    (numbers_of(&v), production)
}
