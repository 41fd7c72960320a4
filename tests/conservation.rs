//! Both laws over long runs, and what a run does at rest.

mod models;

use metriplectic::prelude::*;
use metriplectic_studies::Drift;
use models::{TUMBLING, UNSTABLE, free_body, relaxing_body, top};

const MILLION: usize = 1_000_000;

/// The energy error of every step of a run, relative to the start.
fn energy_drift<Y: Metriplectic>(
    system: &Y,
    x0: <Y::Manifold as metriplectic::fields::Space>::Point<f64>,
    h: f64,
    steps: usize,
) -> (Drift, Certificate)
where
    WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
{
    let mut run = WeylMidpoint.steps(system, x0, h).expect("the model keeps its laws");
    let start = run.state().energy;
    let mut drift = Drift::over(steps);
    for _ in 0..steps {
        let state = run.advance().expect("every step is solved");
        drift.push((state.energy - start) / start);
    }
    (drift, *run.certificate())
}

/// No drift: the worst of the last tenth is at most three times that of the first, or both are
/// within four units in the last place.
fn is_flat(drift: &Drift) -> bool {
    drift.last_tenth_worst() <= 3.0 * drift.first_tenth_worst().max(4.0 * f64::EPSILON)
}

#[test]
fn a_million_steps_of_the_relaxing_body_keep_the_energy() {
    let (drift, certificate) = energy_drift(&relaxing_body(), UNSTABLE, 0.1, MILLION);
    println!("{drift}\n{certificate}");
    assert!(drift.worst() <= 5e-15, "{drift}");
    assert!(is_flat(&drift), "{drift}");
    assert_eq!(certificate.retries, 0);
}

#[test]
fn a_million_steps_of_a_body_that_never_rests_keep_the_energy() {
    let (drift, certificate) = energy_drift(&free_body(), TUMBLING, 0.1, MILLION);
    println!("{drift}\n{certificate}");
    assert!(drift.worst() <= 5e-15, "{drift}");
    assert!(is_flat(&drift), "{drift}");
}

#[test]
fn a_hundred_thousand_steps_on_the_sphere_keep_energy_and_norm() {
    let system = System::on(Sphere::<2>::round()).bracket(AreaForm).energy(top).build().unwrap();
    let start = Vector3::from_element(3.0_f64.sqrt().recip());
    let (drift, certificate) = energy_drift(&system, start, 0.1, MILLION / 10);
    println!("{drift}\n{certificate}");
    assert!(certificate.keeps_energy() && is_flat(&drift), "{drift}");
    assert!(certificate.max_manifold_defect <= 1e-15);
}

#[test]
fn the_entropy_falls_on_no_step_by_more_than_its_round_off() {
    // S = |p|²/2 by hand at the stored points; ΔS ≥ −4ε(max(|S|, 1) + |dS||x|), and |dS| = |x| = |p|.
    let run = WeylMidpoint.run(&relaxing_body(), UNSTABLE, Span::steps(0.1, 100_000)).unwrap();
    let entropy: Vec<f64> = run.iter().map(|state| 0.5 * state.point.norm_squared()).collect();
    let falls = entropy.windows(2).filter(|pair| {
        let bound = 4.0 * f64::EPSILON * (pair[0].max(1.0) + 2.0 * pair[0]);
        pair[1] - pair[0] < -bound
    });
    assert_eq!(falls.count(), 0);
    assert!(run.certificate().keeps_entropy());
    // It is no vacuous bound: the entropy doubles.
    assert!(run.certificate().entropy_gained > 0.5);
}

#[test]
fn an_equilibrium_stays_where_it_is() {
    // Rotation about a principal axis: dH ∥ dS ∥ p.
    for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
        let start: Vector3<f64> = axis * 0.7;
        let run = WeylMidpoint.run(&relaxing_body(), start, Span::steps(0.1, 100)).unwrap();
        assert!(run.iter().all(|state| state.point == start));
        let certificate = run.certificate();
        assert!(certificate.keeps_energy() && certificate.keeps_entropy());
        assert_eq!((certificate.retries, certificate.sweeps), (0, 0));
    }
}

#[test]
fn the_origin_of_a_dual_is_an_equilibrium_too() {
    let run = WeylMidpoint.run(&relaxing_body(), Vector3::zeros(), Span::steps(0.1, 10)).unwrap();
    assert_eq!(run.last().point, Vector3::zeros());
}

#[test]
fn a_sparse_record_has_the_states_of_the_full_one() {
    let full = WeylMidpoint.run(&relaxing_body(), UNSTABLE, Span::steps(0.1, 103)).unwrap();
    let sparse =
        WeylMidpoint.run(&relaxing_body(), UNSTABLE, Span::steps(0.1, 103).every(10)).unwrap();
    let steps: Vec<usize> = sparse.iter().map(|state| state.step).collect();
    assert_eq!(steps, [0, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100, 103]);
    assert!(sparse.iter().all(|state| *state == full.states()[state.step]));
    assert_eq!(sparse.certificate(), full.certificate());
}

#[test]
fn the_iterator_takes_the_steps_of_the_run() {
    let body = relaxing_body();
    let run = WeylMidpoint.run(&body, UNSTABLE, Span::steps(0.1, 50)).unwrap();
    let steps = WeylMidpoint.steps(&body, UNSTABLE, 0.1).unwrap();
    for (state, step) in run.states()[1..].iter().zip(steps) {
        assert_eq!(*state, step.unwrap());
    }
}

#[test]
fn trajectories_are_compared_by_approx() {
    let body = relaxing_body();
    let run = |h: f64| WeylMidpoint.run(&body, UNSTABLE, Span::steps(h, 20)).unwrap();
    approx::assert_relative_eq!(run(0.1), run(0.1));
    approx::assert_abs_diff_ne!(run(0.1), run(0.2), epsilon = 1e-9);
    approx::assert_abs_diff_eq!(run(0.1), run(0.1 + 1e-12), epsilon = 1e-9);
}
