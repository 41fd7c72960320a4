//! Both laws over long runs, and what a run does at rest.

mod models;

use metriplectic::fields::ChartPoint;
use metriplectic::integrators::Residual;
use metriplectic::manifolds::Tangent;
use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Drift, Growth, Guarantee, scientific};
use models::{
    PENDULUM, State10, TUMBLING, UNSTABLE, angular_momentum, free_body, half_square, heat_exchange,
    kinetic, pendulum_bracket, pendulum_energy, relaxing_body, top,
};

const MILLION: usize = 1_000_000;

/// A point of a system.
type Point<Y> = <<Y as Metriplectic>::Manifold as metriplectic::fields::Space>::Point<f64>;

/// The error of an energy by hand at the point of every step of a run, relative to the start. `look`
/// sees the points, too.
fn energy_drift<Y: Metriplectic>(
    system: &Y,
    x0: Point<Y>,
    energy: impl Fn(&Point<Y>) -> f64,
    mut look: impl FnMut(&Point<Y>),
) -> (Drift, Certificate)
where
    WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
{
    let start = energy(&x0);
    let mut run = WeylMidpoint.steps(system, x0, 0.1).expect("the model keeps its laws");
    let mut drift = Drift::over(MILLION);
    for _ in 0..MILLION {
        let state = run.advance().expect("every step is solved");
        drift.push((energy(&state.point) - start) / start);
        look(&state.point);
    }
    (drift, run.certificate().clone())
}

/// The claim that such a run keeps the energy.
fn energy_claim(problem: &str) -> Claim {
    let claim = Claim::new(Guarantee::Energy, problem, "WeylMidpoint");
    claim.against("H by hand, relative, 10⁶ steps of 0.1")
}

/// No drift: the worst of the last tenth is at most three times that of the first.
fn is_flat(drift: &Drift) -> bool {
    drift.last_tenth_worst() <= 3.0 * drift.first_tenth_worst()
}

/// `½ Σ p_i²/I_i`.
fn by_hand(inertia: Vector3<f64>) -> impl Fn(&Vector3<f64>) -> f64 {
    move |p| 0.5 * p.component_mul(p).component_div(&inertia).sum()
}

#[test]
fn a_million_steps_of_the_relaxing_body_keep_the_energy() {
    // S = |p|²/2 by hand; ΔS ≥ −4ε(max(|S|, 1) + |dS||x|) on every step, and |dS| = |x| = |p|.
    let (mut entropy, mut falls) = (0.5 * UNSTABLE.norm_squared(), 0);
    let (drift, certificate) =
        energy_drift(&relaxing_body(), UNSTABLE, by_hand(vector![10.0, 5.0, 1.0]), |p| {
            let next = 0.5 * p.norm_squared();
            let round_off = 4.0 * f64::EPSILON * (entropy.max(1.0) + 2.0 * entropy);
            falls += usize::from(next - entropy < -round_off);
            entropy = next;
        });
    println!("{drift}\n{certificate}");
    energy_claim("relaxing rigid body, so(3)*").record(scientific(drift.worst()), "5e-15");
    let claim = Claim::new(Guarantee::Entropy, "relaxing rigid body, so(3)*", "WeylMidpoint");
    let claim = claim.against("S by hand, 10⁶ steps of 0.1");
    claim.record(format!("{falls} falls"), "0 falls");
    assert_eq!((falls, certificate.entropy_falls), (0, 0));
    assert!(drift.worst() <= 5e-15, "{drift}");
    assert!(is_flat(&drift), "{drift}");
    assert_eq!(certificate.effort.splits, 0);
}

#[test]
fn a_million_steps_of_a_body_that_never_rests_keep_the_energy() {
    let inertia = vector![1.0, 2.0, 3.0];
    let (drift, certificate) = energy_drift(&free_body(), TUMBLING, by_hand(inertia), |_| ());
    println!("{drift}\n{certificate}");
    energy_claim("free rigid body, so(3)*").record(scientific(drift.worst()), "5e-15");
    assert!(drift.worst() <= 5e-15, "{drift}");
    assert!(is_flat(&drift), "{drift}");
    assert_eq!(drift.growth(), Some(Growth::Flat), "{drift}");
}

#[test]
fn a_million_steps_on_the_sphere_keep_energy_and_norm() {
    let system = System::on(Sphere::<2>::round()).bracket(AreaForm).energy(top).build().unwrap();
    let start = Vector3::from_element(3.0_f64.sqrt().recip());
    let by_hand = |x: &Vector3<f64>| {
        let terms = x.map(|x| x.powi(2) + x.powi(3) / 1.5);
        terms.dot(&vector![0.5, 0.25, 0.125])
    };
    let mut off = 0.0_f64;
    let (drift, certificate) = energy_drift(&system, start, by_hand, |x| {
        off = off.max((x.norm() - 1.0).abs());
    });
    println!("{drift}\n{certificate}");
    assert!(certificate.keeps_energy() && is_flat(&drift), "{drift}");
    assert!(off <= 1e-15 && certificate.max_manifold_defect <= 1e-15, "{off:.1e}");
}

#[test]
fn a_million_steps_of_a_heavy_body_keep_energy_and_orthogonality() {
    // Without an entropy to climb the frame never rests.
    let energy = |(r, p): &(Matrix3<Real>, Vector3<Real>)| {
        p.x.powi(2) * 0.5 + p.y.powi(2) * 0.25 + p.z.powi(2) * (1.0 / 6.0) + r.m33 * 0.7
    };
    let space = Product(Rotations::bi_invariant(), Euclidean::<3>);
    let system = System::on(space).bracket(Symplectic).energy(energy).build().unwrap();
    let start = (Matrix3::identity(), vector![0.4, -0.6, 0.8]);
    let by_hand = |(r, p): &(Matrix3<f64>, Vector3<f64>)| {
        0.5 * p.component_mul(p).dot(&vector![1.0, 0.5, 1.0 / 3.0]) + 0.7 * r.m33
    };
    let mut off = 0.0_f64;
    let (drift, certificate) = energy_drift(&system, start, by_hand, |(r, _)| {
        off = off.max((r.tr_mul(r) - Matrix3::identity()).norm());
    });
    println!("{drift}\n{certificate}");
    assert!(certificate.keeps_energy() && is_flat(&drift), "{drift}");
    assert!(off <= 1e-14 && certificate.max_manifold_defect <= 1e-14, "{off:.1e}");
}

#[test]
fn the_energy_of_a_forced_body_is_conserved_over_a_hundred_thousand_steps() {
    // The swirl changes its sign with the first component, and the motion goes on.
    let swirl = |xi: &Vector3<Real>| Vector3::new(-xi.y, xi.x, 0.0.into()) * (xi.x * 0.8);
    let inertia = vector![1.0, 2.0, 3.0];
    let system = System::on(LieDual::so3()).energy(kinetic(inertia)).force(swirl).build().unwrap();
    let start = vector![0.9, 0.4, -0.7];
    let run = WeylMidpoint.run(&system, start, Span::steps(0.1, 100_000).at_most(100)).unwrap();
    let certificate = run.certificate();
    println!("{certificate}");
    assert!(certificate.keeps_energy(), "{certificate}");
    let text = certificate.to_string();
    assert!(text.contains("second law:  no entropy") && !text.contains("Hamiltonian"), "{text}");
    // The motion does not die out: the last digits of H are those of a state that moves.
    let speed = system.velocity(&ChartPoint::<_, f64>::centre(&run.last().point)).unwrap().norm();
    assert!(speed > 1e-2, "{speed:.1e}");
}

#[test]
fn a_thermoelastic_pendulum_keeps_both_laws_and_its_momentum_over_a_hundred_thousand_steps() {
    let system = System::on(Euclidean::<10>)
        .bracket(Poisson::constant(pendulum_bracket()).unwrap())
        .energy(pendulum_energy)
        .entropy(|x: &State10| x[8] + x[9])
        .dissipation(FieldDissipation(heat_exchange))
        .momentum(angular_momentum)
        .build()
        .unwrap();
    let span = Span::steps(0.05, 100_000).at_most(2);
    let run = WeylMidpoint.run(&system, SVector::from(PENDULUM), span).unwrap();
    let certificate = run.certificate();
    println!("{certificate}");
    assert!(certificate.keeps_energy() && certificate.keeps_entropy(), "{certificate}");
    assert!(certificate.max_relative_energy_error() <= 50.0 * f64::EPSILON, "{certificate}");
    assert!(certificate.keeps_invariants(), "{certificate}");
    assert!(certificate.invariants[0].max_error <= 5e-14, "{certificate}");
}

#[test]
fn an_attitude_is_orthogonal_after_a_hundred_thousand_steps_and_the_momentum_does_not_drift() {
    let body = free_body();
    let mut steps = WeylMidpoint.steps(&body, TUMBLING, 0.1).unwrap();
    let mut attitude = Attitude::start(&body, steps.state(), Matrix3::identity()).unwrap();
    let (mut defect, mut drift) = (0.0_f64, 0.0_f64);
    let count: u32 = if cfg!(debug_assertions) { 100_000 } else { 1_000_000 };
    for _ in 0..count {
        let state = steps.advance().unwrap();
        let r = attitude.advance(state).unwrap();
        defect = defect.max(Rotations.defect(r));
        drift = drift.max((r * state.point - TUMBLING).norm());
    }
    println!("{count} steps: |RᵀR − 1| ≤ {defect:.1e}, |Rp − p₀| ≤ {drift:.1e}");
    assert!(defect <= 1e-14, "{defect:.1e}");
    // A random walk: each step solves for p within some ε, in a direction of its own.
    let walk = 8.0 * f64::EPSILON * f64::from(count).sqrt();
    assert!(drift <= walk, "{drift:.1e}");
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

/// The certificates of runs of a thousand steps, with step sizes from 0.1 to 1000.
fn large_steps<Y: Metriplectic<Manifold = LieDual<3>>>(
    system: &Y,
    x0: Vector3<f64>,
) -> impl Iterator<Item = (f64, Certificate)>
where
    WeylMidpoint: Retraction<LieDual<3>, Y::Metric>,
{
    (0..=40).map(move |k| {
        let h = 0.1 * 10.0_f64.powf(0.1 * f64::from(k));
        let run = WeylMidpoint.run(system, x0, Span::steps(h, 1000)).expect("every step is solved");
        (h, run.certificate().clone())
    })
}

#[test]
fn steps_far_too_large_keep_the_energy() {
    // The terms of a step are h|Π||w| in size, and so is the round-off of their sum: without the
    // last correction the energy is off by 3·10⁻¹² at h = 1000.
    let (relaxing, free) = (relaxing_body(), free_body());
    let runs = large_steps(&relaxing, UNSTABLE).chain(large_steps(&free, TUMBLING));
    let mut worst = 0.0_f64;
    for (h, certificate) in runs {
        assert!(certificate.keeps_energy(), "h = {h}: {certificate}");
        worst = worst.max(certificate.max_energy_error);
    }
    println!("|H − H₀| ≤ {worst:.1e}");
    Claim::new(Guarantee::Energy, "rigid bodies, steps of 0.1 to 1000", "WeylMidpoint")
        .against("H at the start")
        .record(scientific(worst), "16 ε");
    // Like H, its gradient and p are of size one.
    assert!(worst <= 16.0 * f64::EPSILON, "{worst:.1e}");
}

#[test]
fn a_quadratic_casimir_falls_on_no_step_under_any_energy() {
    // With Π dS = 0 and ⟨dS(z), d⟩ = ΔS for a quadratic S, ΔS = h K(dS, dS) ≥ 0 holds for every
    // energy; here a body that is not quadratic, in a metric that is not canonical.
    let metric = Matrix3::new(2.0, 0.3, 0.0, 0.3, 1.0, -0.2, 0.0, -0.2, 3.0);
    let system = System::on(LieDual::so3())
        .metric(Metric::constant(metric).unwrap())
        .energy(|p: &Vector3<Real>| {
            kinetic(vector![1.0, 2.0, 3.0])(p) + p.x.powi(4) * 0.3 + p.y.sin() * 0.25
        })
        .entropy(half_square)
        .build()
        .unwrap();
    let start = vector![0.2, 0.1, -0.7];
    let run = WeylMidpoint.run(&system, start, Span::steps(0.1, 5_000)).unwrap();
    for pair in run.states().windows(2) {
        let [before, after] = [0, 1].map(|i| 0.5 * pair[i].point.norm_squared());
        let round_off = 4.0 * f64::EPSILON * (before.max(1.0) + 2.0 * before);
        assert!(after - before >= -round_off, "at t = {}: {:.1e}", pair[1].time, after - before);
    }
    let energy = |p: &Vector3<f64>| {
        p.x * p.x / 2.0 + p.y * p.y / 4.0 + p.z * p.z / 6.0 + 0.3 * p.x.powi(4) + 0.25 * p.y.sin()
    };
    // H by hand at the stored points; its terms are below 1.
    let off = run.iter().map(|state| (energy(&state.point) - energy(&start)).abs());
    let worst = off.fold(0.0, f64::max);
    println!("{}, H by hand to {worst:.1e}", run.certificate());
    assert!(worst <= 50.0 * f64::EPSILON, "{worst:.1e}");
    assert!(run.certificate().entropy_gained > 0.01);
}

/// What is left of the equation of a step when its ends are swapped and `h` changes sign.
fn swapped<Y, R>(retraction: R, system: &Y, x0: Vector3<f64>, h: f64) -> f64
where
    Y: Metriplectic<Manifold = LieDual<3>>,
    R: Retraction<Y::Manifold, Y::Metric> + Copy,
{
    let mut steps = Scheme::new(retraction).steps(system, x0, h).expect("the model keeps its laws");
    let x = steps.advance().expect("the step is solved").point;
    let scheme = Scheme::new(retraction);
    let residual = Residual::new(system, &scheme, &x, -h);
    residual.at::<f64>(&(x0 - x)).expect("the residual is defined").norm()
}

#[test]
fn a_midpoint_step_backwards_leads_to_its_start() {
    // The residual is a difference of terms of size |p| ≈ 1, and d, w and the two products of Π w
    // and K dS are each rounded a few times.
    let round_off = 32.0 * f64::EPSILON;
    let free = swapped(WeylMidpoint, &free_body(), TUMBLING, 0.1);
    let relaxing = swapped(WeylMidpoint, &relaxing_body(), vector![0.7, -1.0, 0.4], 0.1);
    println!("residual of the swapped step: free {free:.1e}, relaxing {relaxing:.1e}");
    assert!(free <= round_off && relaxing <= round_off, "{free:.1e}, {relaxing:.1e}");
    // A step that is based at its start is not symmetric, by O(h²).
    assert!(swapped(Exponential, &free_body(), TUMBLING, 0.1) > 1e-4);
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
        assert_eq!((certificate.effort.splits, certificate.effort.iterations), (0, 0));
    }
}

#[test]
fn the_origin_of_a_dual_is_an_equilibrium_too() {
    let run = WeylMidpoint.run(&relaxing_body(), Vector3::zeros(), Span::steps(0.1, 10)).unwrap();
    assert_eq!(run.last().point, Vector3::zeros());
    assert_eq!((run.certificate().effort.splits, run.certificate().effort.iterations), (0, 0));
}

#[test]
fn a_body_at_its_greatest_entropy_stays_there_to_round_off() {
    // H = 1/4 and S = |p|²/2 have their common critical point on the axis of largest inertia, and
    // its coordinate √5 is not a number of the machine.
    let start = vector![-(5.0_f64.sqrt()), 0.0, 0.0];
    let run = WeylMidpoint.run(&relaxing_body(), start, Span::steps(0.1, 10_000)).unwrap();
    assert!(run.iter().all(|state| state.point == start));
    assert_eq!(run.certificate().effort.splits, 0);
    // Displaced by 10⁻⁹ across the axis it comes back, keeps H, and asks for no retry.
    let displaced = start + vector![0.0, 1e-9, 0.0];
    let run = WeylMidpoint.run(&relaxing_body(), displaced, Span::steps(0.1, 10_000)).unwrap();
    println!("{}", run.certificate());
    // It rests where its velocity, 0.2 |(y, z)| at least, is round-off: the terms of Π w and K dS are
    // of size 0.9 there, and 4ε · 0.9/0.2 = 4·10⁻¹⁵.
    assert!(run.last().point.yz().norm() < 1e-14, "{}", run.last().point);
    assert_eq!(run.certificate().effort.splits, 0);
    assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
}

#[test]
fn trajectories_are_compared_by_approx() {
    let body = relaxing_body();
    let run = |h: f64| WeylMidpoint.run(&body, UNSTABLE, Span::steps(h, 20)).unwrap();
    approx::assert_relative_eq!(run(0.1), run(0.1));
    approx::assert_abs_diff_ne!(run(0.1), run(0.2), epsilon = 1e-9);
    approx::assert_abs_diff_eq!(run(0.1), run(0.1 + 1e-12), epsilon = 1e-9);
    // At rest all points are the same, and the times are not.
    let rest = |h: f64| WeylMidpoint.run(&body, Vector3::x(), Span::steps(h, 20)).unwrap();
    approx::assert_relative_ne!(rest(0.1), rest(0.2));
    // Points of a product, in their states, and tangents.
    let space = Product(Rotations::bi_invariant(), Euclidean::<1>);
    let system = System::on(space)
        .energy(|(r, s): &(Matrix3<Real>, Vector1<Real>)| r.m33 + s.x)
        .entropy(|(_, s): &(Matrix3<Real>, Vector1<Real>)| s.x)
        .build()
        .unwrap();
    let start = (Matrix3::identity(), vector![0.3]);
    let run = WeylMidpoint.run(&system, start, Span::steps(0.1, 2)).unwrap();
    approx::assert_relative_eq!(run.last(), run.last());
    approx::assert_abs_diff_ne!(run.states()[0].clone(), run.last().clone(), epsilon = 1e-9);
    let tangent =
        |d: f64| Tangent::<Euclidean<2>> { base: vector![1.0, 2.0], vector: vector![d, 0.0] };
    approx::assert_relative_eq!(tangent(1.0), tangent(1.0 + 1e-16));
    approx::assert_abs_diff_ne!(tangent(1.0), tangent(1.1));
}

#[test]
fn a_certificate_has_the_figures_of_its_states() {
    // Of a system with entropy, far from rest, by hand from the recorded states.
    let run =
        WeylMidpoint.run(&relaxing_body(), vector![0.7, -1.0, 0.4], Span::steps(0.3, 60)).unwrap();
    let (certificate, energy) = (run.certificate(), by_hand(vector![10.0, 5.0, 1.0]));
    let energies: Vec<f64> = run.iter().map(|s| energy(&s.point)).collect();
    let entropies: Vec<f64> = run.iter().map(|s| 0.5 * s.point.norm_squared()).collect();
    let worst = energies.iter().map(|e| (e - energies[0]).abs()).fold(0.0, f64::max);
    let least = entropies.windows(2).map(|s| s[1] - s[0]).fold(f64::INFINITY, f64::min);
    // The fields of the closures are summed in another order.
    let round_off = 8.0 * f64::EPSILON;
    assert!((certificate.max_energy_error - worst).abs() <= round_off);
    assert!((certificate.min_entropy_increment - least).abs() <= round_off);
    let gained = entropies[60] - entropies[0];
    assert!((certificate.entropy_gained - gained).abs() <= round_off && gained > 0.1);
    assert_eq!((certificate.steps, certificate.entropy_falls), (60, 0));
}

#[test]
fn a_certificate_says_when_the_first_law_is_broken() {
    // A solver that is content with a residual of 10⁻⁴.
    let crude = Newton { tolerance: 1e12, ..Newton::default() };
    let scheme = Scheme::new(WeylMidpoint).newton(crude);
    let run = scheme.run(&free_body(), TUMBLING, Span::steps(0.5, 20)).unwrap();
    let (certificate, energy) = (run.certificate(), by_hand(vector![1.0, 2.0, 3.0]));
    let worst =
        run.iter().map(|s| (energy(&s.point) - energy(&TUMBLING)).abs()).fold(0.0, f64::max);
    assert!(worst > 1e-11 && !certificate.keeps_energy(), "{certificate}");
    assert!((certificate.max_energy_error - worst).abs() <= 8.0 * f64::EPSILON);
}
