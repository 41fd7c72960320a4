//! Every manifold, bracket and kind of metric: the order of each retraction, and the energy at every
//! step, also where a step spans two radians.

use metriplectic_studies::Convergence;
use metriplectic_studies::problems::{LargeSteps, Orders};

/// Every order is what theory says, and the energy is kept on the way.
fn check(orders: &Orders) {
    println!("{}", Convergence::table(&orders.studies));
    assert!(orders.failures.is_empty(), "{:?}", orders.failures);
    for (study, expected) in orders.studies.iter().zip(&orders.expected) {
        let Convergence { problem, manifold, metric, scheme, order, .. } = study;
        assert!(
            order.agrees(*expected, 0.05),
            "{problem} on {manifold} ({metric}), {scheme}: {order}"
        );
    }
    assert!(orders.energy_error <= 50.0 * f64::EPSILON, "{:e}", orders.energy_error);
}

#[test]
fn canonical_metrics_are_integrated_to_the_order_of_the_retraction() {
    check(&Orders::canonical());
}

#[test]
fn metrics_from_closures_are_integrated_to_the_order_of_the_retraction() {
    check(&Orders::closures());
}

#[test]
fn products_are_integrated_to_the_order_of_the_retraction() {
    check(&Orders::products());
}

#[test]
fn the_energy_is_kept_where_a_step_spans_two_radians() {
    let study = LargeSteps::of_every_problem();
    println!("{study:?}");
    assert!(study.worst.0 <= 50.0 * f64::EPSILON, "{study:?}");
    // The chord of two radians on a unit sphere.
    assert!(study.longest > 2.0 * 1_f64.sin() && study.steps > 10 * study.ended, "{study:?}");
}
