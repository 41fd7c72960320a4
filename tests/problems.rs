//! Every manifold, bracket and kind of metric: the velocity by hand, the energy where one step spans two radians, and
//! what each method promises.
//!
//! The order of each retraction on the same problems is the example `convergence`.

use metriplectic_studies::problems::{LargeSteps, Strides};

#[path = "problems/by_hand.rs"]
mod by_hand;
#[path = "models/chain.rs"]
mod chain;
#[path = "problems/every_method.rs"]
mod every_method;
#[path = "problems/in_numbers.rs"]
mod in_numbers;
#[path = "models/lattices.rs"]
#[allow(dead_code, reason = "one of the lattices is in the table")]
mod lattices;
#[path = "models/methods.rs"]
mod methods;
#[path = "problems/on_lattices.rs"]
mod on_lattices;
#[path = "problems/promises.rs"]
mod promises;
#[path = "problems/released.rs"]
mod released;
#[path = "models/stages.rs"]
mod stages;

#[test]
fn the_energy_is_kept_where_a_step_spans_two_radians() {
    let study = LargeSteps::of_every_problem();
    for Strides { label, longest, energy_error } in &study.rows {
        println!("{label}: {longest:.2} radians, energy error {energy_error:.1e}");
    }
    for Strides { label, longest, energy_error } in &study.rows {
        assert!(*energy_error <= 50.0 * f64::EPSILON, "{label}: {energy_error:e}");
        assert!(*longest >= 2.0, "{label}: {longest}");
    }
    // Two retractions on each of sixteen problems, the chart midpoint on six with closures, and the cheap ones on
    // nine of them.
    assert_eq!(study.rows.len(), 47);
}

#[test]
fn every_problem_answers_in_numbers_as_it_does_in_types() {
    in_numbers::compare();
}

#[test]
fn the_velocity_of_each_problem_is_the_one_by_hand() {
    by_hand::compare();
}
