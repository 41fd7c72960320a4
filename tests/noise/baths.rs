//! Baths: exact heat and work on each path, and Jarzynski's equality.

use metriplectic::integrators::{Flow as _, StepStart, Stepper as _};
use metriplectic::prelude::*;
use metriplectic_studies::{Claim, Guarantee, scientific};
use nalgebra::{DMatrix, vector};
use rayon::prelude::*;

use crate::operator::{Basis as _, assert_orders, coefficients, order, outcomes};
use crate::refusals::fault;
use crate::shell::Shell;
use crate::tables;

const TEMPERATURE: f64 = 0.8;

/// A particle in an anharmonic trap that is pulled along, in a bath.
macro_rules! particle {
    () => {
        System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy_in_time(|t: Real, x: &Vector2<Real>| {
                let q = x.x - t;
                x.y * x.y * 0.5 + q * q * 0.5 + q.powi(4) * 0.1
            })
            .bath(
                "water",
                Bath::at(TEMPERATURE).friction(|_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                    [Contact { rate: 0.7.into(), along: vector![0.0.into(), 1.0.into()] }]
                }),
            )
            .noise(Boltzmann(1.0))
            .build()
            .unwrap()
    };
}

#[test]
fn heat_and_work_of_each_path_balance() {
    let particle = particle!();
    let start = particle.flow().start(vector![0.3, -0.2]);
    let mut worst = 0.0_f64;
    for path in 0..20 {
        let span = Span::steps(0.05, 400);
        let method = NinomiyaVictoir(DormandPrince5).seed(4).path(path);
        let run = method.run(&particle, start.clone(), span).unwrap();
        let certificate = run.certificate();
        assert!(
            certificate.keeps_energy() && certificate.max_energy_error < 1e-14,
            "{certificate}"
        );
        assert!((certificate.friction - 0.7 * 0.05).abs() < 1e-9, "{certificate}");
        worst = worst.max(certificate.max_energy_error);
        let state = &run.last().point;
        let change = particle.flow().energy_at(state) - certificate.initial_energy;
        let ledger = &state.ledger;
        let (work, heat) = (ledger.parameter_work(), ledger.heat("water").unwrap());
        assert!((change - work - heat).abs() < 1e-13 && heat.abs() > 0.1);
        let entropy = ledger.bath_entropy("water").unwrap();
        assert!((entropy + heat / TEMPERATURE).abs() < 1e-12);
    }
    // A path that is put down goes on with the same bits, and has its tables.
    let (method, span) = (NinomiyaVictoir(DormandPrince5).seed(4), Span::steps(0.05, 40));
    let run = || Ok(method.run(&particle, start.clone(), span)?);
    let whole: Result<_, Error> = run();
    let whole = whole.unwrap();
    let mut steps = method.steps(&particle, start.clone(), span).unwrap();
    for _ in 0..17 {
        steps.advance().unwrap();
    }
    let resumed = method.resume(&particle, &steps.checkpoint()).unwrap().run().unwrap();
    assert_eq!(resumed.last(), whole.last());
    assert_eq!(resumed.certificate(), whole.certificate());
    tables::are_those_of_the_run(&particle, run);
    // Its friction is −0.7 p.
    let fast = NinomiyaVictoir(DormandPrince5).seed(4).run(&particle, start, Span::steps(2.0, 10));
    let error = fault(fast);
    assert!(
        matches!(error, NoiseError::FrictionUnresolved { rate, .. } if (rate - 1.4).abs() < 1e-9),
        "{error}"
    );
    Claim::new(
        Guarantee::Noise,
        "particle that is pulled, 20 paths: |ΔH − W − Q|",
        "NinomiyaVictoir(DormandPrince5)",
    )
    .against("the balance of each path")
    .record(scientific(worst), "1e-14");
}

/// Numbers of the canonical law of the trap at rest, by rejection.
fn canonical(path: u64) -> Vector2<f64> {
    use metriplectic::integrators::noise::{Counter, Numbers as _};
    let counter = Counter::new(99).path(path);
    let deviation = TEMPERATURE.sqrt();
    let momentum = deviation * counter.number(0, 0);
    for trial in 1.. {
        let q = deviation * counter.number(trial, 0);
        // A number that is uniform: the Gaussian one through its own distribution would need erf, so two angles.
        let [a, b] = [1, 2].map(|k| counter.number(trial, k));
        let uniform = (-0.5 * (a * a + b * b)).exp();
        if uniform < (-0.1 * q.powi(4) / TEMPERATURE).exp() {
            return vector![q, momentum];
        }
    }
    unreachable!()
}

#[test]
fn the_equality_of_jarzynski_holds_on_paths() {
    // The trap is moved and not changed, so ΔF = 0.
    let particle = particle!();
    let paths = 4000;
    let works: Vec<f64> = (0..paths)
        .into_par_iter()
        .map(|path| {
            let start = particle.flow().start(canonical(path));
            let method = NinomiyaVictoir(DormandPrince5).seed(6).path(path);
            let run = method.run(&particle, start, Span::steps(0.1, 10)).unwrap();
            run.last().point.ledger.parameter_work()
        })
        .collect();
    let check = FluctuationTheorem::jarzynski(works.iter().copied(), TEMPERATURE, 0.0);
    assert!(check.holds_within(4.0) && check.estimate.standard_error < 0.06, "{check}");
    // The second law of the mean: some of the work is lost.
    assert!(Estimate::of(works).mean > 0.1);
    // Rare paths count most.
    assert!((100.0..1000.0).contains(&check.effective), "{check}");
}

/// A spin with `H = −b(t)·n` in a bath at the temperature 1.
macro_rules! spin {
    () => {
        System::on(Sphere::<2>::round())
            .bracket(AreaForm)
            .energy_in_time(|t: Real, n: &Vector3<Real>| {
                let (angle, size) = (t * 0.9, t * 0.7 + 0.6);
                -(n.x * angle.sin() + n.z * angle.cos()) * size
            })
            .bath("crystal", Bath::at(1.0).isotropic(0.6))
            .noise(Boltzmann(1.0))
            .build()
            .unwrap()
    };
}

#[test]
fn the_equality_of_jarzynski_has_the_order_of_the_method() {
    let spin = spin!();
    let shell = Shell::new(6, Vector3::from_element(1.0));
    let outcomes = outcomes(3);
    let time = 0.5;
    let off = [4, 8, 16].map(|count| {
        let h = time / f64::from(count);
        // The mean of exp(−W) over the steps that are left, backwards.
        let mut left = coefficients(&shell, |_| 1.0);
        for k in (0..count).rev() {
            let mut values = DMatrix::<f64>::zeros(shell.nodes().len(), 1);
            for (i, n) in shell.nodes().iter().enumerate() {
                let from = spin.begin(spin.flow().start(*n), f64::from(k) * h).unwrap();
                let start = StepStart { time: f64::from(k) * h, ..StepStart::first(&spin, &from) };
                for (q, outcome) in &outcomes {
                    let method = NinomiyaVictoir(DormandPrince5).numbers(outcome.clone());
                    let end = method.step(&start, h, &mut Default::default()).unwrap().x;
                    let work = end.ledger.parameter_work();
                    values[i] += q * (-work).exp() * shell.at(&end.x).dot(&left);
                }
            }
            left = shell.projection() * values.column(0);
        }
        let weight = |n: &Vector3<f64>| (0.6 * n.z).exp();
        let mean = shell.mean(weight, |n| shell.at(n).dot(&left));
        // exp(−ΔF) is the ratio of sinh b/b at both ends.
        let sum = |b: f64| b.sinh() / b;
        (h, mean * sum(0.6) / sum(0.6 + 0.7 * time) - 1.0)
    });
    assert!(off[2].1.abs() < 1e-4, "{off:?}");
    let problem = "spin in a turning field: Jarzynski's equality";
    assert_orders(problem, "NinomiyaVictoir(DormandPrince5)", &[order(&off)], 2);
}
