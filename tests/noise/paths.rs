//! Single paths: energy to round-off, the same bits, units, and what the certificate says.

use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Guarantee, scientific};
use nalgebra::vector;
use rayon::prelude::*;

use crate::body::{INERTIA, body};
use crate::tables;

const START: Vector3<f64> = vector![0.9, 0.5, 0.3];

/// Runs paths and returns the worst error of the energy, relative to it. Each certificate says that the energy is kept, and
/// that the entropy is not.
fn worst(paths: u64, run: impl Fn(u64) -> Certificate + Sync) -> f64 {
    let of_a_path = |path: u64| {
        let certificate = run(path);
        assert!(certificate.keeps_energy(), "path {path}: {certificate}");
        assert!(!certificate.keeps_entropy() && !certificate.promises.entropy, "{certificate}");
        assert!(certificate.entropy_falls > certificate.steps / 4, "path {path}: {certificate}");
        certificate.max_energy_error / certificate.initial_energy
    };
    (0..paths).into_par_iter().map(of_a_path).reduce(|| 0.0, f64::max)
}

#[test]
fn each_path_keeps_the_energy_to_round_off() {
    let body = body(0.3);
    let one = worst(20, |path| {
        let method = RandomFlow(DormandPrince5).seed(1).path(path);
        method.run(&body, START, Span::steps(0.05, 500)).unwrap().certificate().clone()
    });
    let two = worst(20, |path| {
        let method = NinomiyaVictoir(Gauss::<2>).seed(1).path(path);
        method.run(&body, START, Span::steps(0.1, 100)).unwrap().certificate().clone()
    });
    for (name, steps, worst) in
        [("RandomFlow(DormandPrince5)", 500, one), ("NinomiyaVictoir(Gauss::<2>)", 100, two)]
    {
        assert!(worst < 8e-15, "{name}: {worst}");
        let problem = format!("rigid body, 20 paths of {steps} steps: |H − H₀|/H₀");
        Claim::new(Guarantee::Noise, problem, name)
            .against("the start of each path")
            .record(scientific(worst), "8e-15");
    }
}

/// 10⁸ steps, on which the error has been 8.0e-16: that of the short paths.
#[test]
#[ignore = "nine minutes of one core"]
fn ten_thousand_paths_of_ten_thousand_steps_keep_the_energy_to_round_off() {
    let body = body(0.3);
    let worst = worst(10_000, |path| {
        let method = RandomFlow(DormandPrince5).seed(1).path(path);
        let span = Span::steps(0.05, 10_000).at_most(2);
        method.run(&body, START, span).unwrap().certificate().clone()
    });
    println!("|H − H₀|/H₀ ≤ {worst:.1e}");
    assert!(worst < 2e-15, "{worst}");
}

#[test]
fn the_certificate_says_that_the_entropy_fluctuates() {
    let run = NinomiyaVictoir(DormandPrince5)
        .seed(7)
        .path(3)
        .run(&body(0.15), START, Span::steps(0.05, 100))
        .unwrap();
    let text = run.certificate().to_string();
    for part in [
        "noise:       k_B = 0.15, 3 terms, seed 7, path 3, Gaussian; weak order 2",
        "second law:  in the mean: S fluctuates; it fell on ",
    ] {
        assert!(text.contains(part), "\"{part}\" is missing in: {text}");
    }
    let noise = run.certificate().noise.as_ref().unwrap();
    assert_eq!((noise.terms, noise.weak_order), (3, 2));
}

#[test]
fn no_path_promises_a_second_law() {
    let body = body(0.3);
    let certificates = (0..20).map(|path| {
        let method = RandomFlow(DormandPrince5).seed(1).path(path);
        method.run(&body, START, Span::steps(0.05, 1)).unwrap().certificate().clone()
    });
    let mut rose = 0;
    for certificate in certificates {
        rose += usize::from(certificate.entropy_falls == 0);
        assert!(!certificate.keeps_entropy(), "{certificate}");
    }
    assert!((2..19).contains(&rose), "{rose}");
}

#[test]
fn a_path_that_is_put_down_goes_on_with_the_same_bits() {
    let body = body(0.3);
    for method in
        [RandomFlow(DormandPrince5).seed(5), RandomFlow(DormandPrince5).seed(5).three_point()]
    {
        let span = Span::steps(0.05, 60);
        let whole = method.run(&body, START, span).unwrap();
        let mut steps = method.steps(&body, START, span).unwrap();
        for _ in 0..23 {
            steps.advance().unwrap();
        }
        let checkpoint = metriplectic_studies::checkpoints::reread(&steps.checkpoint());
        let resumed = method.resume(&body, &checkpoint).unwrap().run().unwrap();
        assert_eq!(resumed.last(), whole.last());
        assert_eq!(resumed.certificate(), whole.certificate());
        tables::are_those_of_the_run(&body, || Ok(method.run(&body, START, span)?));
        // Another path is another method.
        assert!(matches!(
            method.path(1).resume(&body, &checkpoint),
            Err(ResumeError::AnotherMethod { .. })
        ));
    }
}

#[test]
fn the_numbers_go_on_after_a_corner_in_time() {
    let body = body(0.3);
    let method = RandomFlow(DormandPrince5).seed(5);
    let run =
        |schedule: metriplectic::integrators::Schedule| method.run(&body, START, schedule).unwrap();
    let plain = run(Span::steps(0.05, 4).into());
    // The corner ends a step, and the next one draws its own numbers.
    let cut = run(Span::steps(0.05, 4).corners([0.1]));
    let moved = |k: usize, run: &Trajectory<LieDual<3>>| run.states()[k].point;
    assert!((moved(4, &plain) - moved(4, &cut)).norm() < 1e-12);
}

/// A heat exchange in units of `2^a` for energies, `2^b` for times and `2^c` for entropies.
fn exchanged([a, b, c]: [i32; 3]) -> Vec<[f64; 4]> {
    let [e, t, s] = [a, b, c].map(|k| 2.0_f64.powi(k));
    let exchange = move |u: &Vector2<Real>, w: &Vector2<Real>| {
        let rate = u.x * u.y * (u.x / e + 1.0) / (s * t);
        [Contact { rate, along: vector![w.y, -w.x] }]
    };
    let bodies = System::on(Euclidean::<2>)
        .energy(|u: &Vector2<Real>| u.x + u.y)
        .entropy(move |u: &Vector2<Real>| ((u.x / e).ln() * 3.0 + (u.y / e).ln() * 5.0) * s)
        .dissipation(OnsagerDissipation(exchange))
        .noise(Boltzmann(0.1 * s))
        .build()
        .expect("a system");
    let start = vector![0.3, 0.7] * e;
    let run = NinomiyaVictoir(DormandPrince5)
        .seed(2)
        .run(&bodies, start, Span::steps(0.01 * t, 50))
        .expect("a run");
    run.iter()
        .map(|state| [state.point.x / e, state.point.y / e, state.time / t, state.entropy / s])
        .collect()
}

#[test]
fn other_units_have_the_same_bits() {
    let plain = exchanged([0; 3]);
    assert_eq!(exchanged([-67, -31, 12]), plain);
    assert_eq!(exchanged([40, 7, -76]), plain);
    assert!((plain[1][0] - plain[2][0]).abs() > 1e-6);
}

#[test]
fn noise_keeps_the_mean_of_the_shell_in_sight() {
    // A sanity check by one long path: the mean of S is that of exp(S/k_B) on the shell to a few per cent.
    let run = NinomiyaVictoir(DormandPrince5)
        .seed(3)
        .run(&body(0.5), START, Span::steps(0.2, 20_000))
        .unwrap();
    let energy = run.certificate().initial_energy;
    let mean = run.iter().map(|state| state.entropy).sum::<f64>() / run.states().len() as f64;
    let shell = crate::shell::Shell::new(11, (INERTIA * 2.0 * energy).map(f64::sqrt));
    let exact = shell.mean(|p| (p.norm_squared() / (2.0 * 0.5)).exp(), |p| 0.5 * p.norm_squared());
    assert!((mean / exact - 1.0).abs() < 0.02, "{mean} {exact}");
}
