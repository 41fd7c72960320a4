//! A run as a row of a sweep, and its states as lines of a table.

use metriplectic::integrators::{Flow, StateSpace};
use metriplectic::prelude::*;

/// Asserts that a sweep of one row has the bits of the run, and that a table of observables has those of its states.
pub(crate) fn are_those_of_the_run<F: Flow>(
    flow: &F,
    run: impl Fn() -> Result<Trajectory<F::Space>, Error> + Sync,
) {
    let alone = run().expect("it runs");
    let numbers = |state: &State<F::Space>| F::Space::numbers(&state.point);
    let bits = |numbers: &[f64]| numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>();

    let sweep = Sweep::new("one").grid("k", [1.0]);
    let table = sweep.run(|_: &Row| run()).quiet().execute().expect("a row");
    assert_eq!((table.len(), table.failed()), (1, 0));
    let row = table.rows().next().expect("a row");
    assert_eq!(bits(row.end()), bits(&numbers(alone.last())));

    let watch = Observables::on(flow)
        .of("sum", |x| F::Space::numbers(x).iter().sum())
        .of_state("energy", |state| state.energy);
    let mut table = watch.csv(Vec::new()).expect("names of its own");
    alone.iter().for_each(|state| table.write(state).expect("memory takes it"));
    let text = String::from_utf8(table.finish().expect("memory takes it")).expect("text");
    assert_eq!(text.lines().count(), alone.states().len() + 1);
    for (line, state) in text.lines().skip(1).zip(&alone) {
        let found: Vec<f64> = line.split(',').map(|x| x.parse().expect("a number")).collect();
        let sum = numbers(state).iter().sum();
        assert_eq!(bits(&found), bits(&[state.time, sum, state.energy]));
    }
}
