//! Two bodies exchange heat with its fluctuations: the law of Beta, which needs the kinetic drift.
//!
//! The energies `(u, v)` have the entropy `S = C₁ ln u + C₂ ln v` and the friction `K = ρ b bᵀ` with `b = (1, −1)` and the
//! conductance `ρ = κ T₁T₂ (1 + a u)`, which depends on the state. Then `exp(S/k_B)` on the line `u + v = 1` is the law
//! `Beta(C₁/k_B + 1, C₂/k_B + 1)`, whatever the conductance is.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels};

const CAPACITIES: [f64; 2] = [3.0, 5.0];
const K_B: f64 = 0.1;
const BINS: usize = 50;

fn main() -> Result<(), Box<dyn Error>> {
    let conduction = |u: &Vector2<Real>, w: &Vector2<Real>| {
        let [t1, t2] = [u.x / CAPACITIES[0], u.y / CAPACITIES[1]];
        [Contact { rate: t1 * t2 * (u.x * 0.8 + 1.0), along: vector![w.y, -w.x] }]
    };
    let bodies = System::on(Euclidean::<2>)
        .energy(|u: &Vector2<Real>| u.x + u.y)
        .entropy(|u: &Vector2<Real>| u.x.ln() * CAPACITIES[0] + u.y.ln() * CAPACITIES[1])
        .dissipation(OnsagerDissipation(conduction))
        .noise(Boltzmann(K_B))
        .build()?;

    let about = "Two bodies exchange heat with its fluctuations, beside the law of Beta.";
    let example = Example::new(about, 40_000, 0.5);
    let span = Span::steps(example.step_size, example.steps);
    let run = NinomiyaVictoir(DormandPrince5).seed(7).run(&bodies, vector![0.2, 0.8], span)?;

    let [a, b] = CAPACITIES.map(|c| c / K_B + 1.0);
    let exact = [a / (a + b), a * b / ((a + b).powi(2) * (a + b + 1.0))];
    let energies: Vec<f64> =
        run.iter().skip(20.min(example.steps / 2)).map(|s| s.point.x).collect();
    let count = energies.len() as f64;
    let mean = energies.iter().sum::<f64>() / count;
    let variance = energies.iter().map(|u| (u - mean).powi(2)).sum::<f64>() / count;

    let width = 0.6 / BINS as f64;
    let density = |k: usize| {
        let bin = k as f64 * width..(k + 1) as f64 * width;
        energies.iter().filter(|u| bin.contains(u)).count() as f64 / (count * width)
    };
    let stairs = |k: usize| [(k as f64 * width, density(k)), ((k + 1) as f64 * width, density(k))];
    let weight = |u: f64| ((a - 1.0) * u.ln() + (b - 1.0) * (1.0 - u).ln()).exp();
    let grid = || (1..1000).map(|k| f64::from(k) / 1000.0);
    let sum = grid().map(weight).sum::<f64>() / 1000.0;
    let law: Vec<(f64, f64)> = grid().filter(|u| *u < 0.6).map(|u| (u, weight(u) / sum)).collect();
    let path: Vec<(f64, f64)> = run.iter().take(400).map(|s| (s.time, s.point.x)).collect();
    let entropy: Vec<(f64, f64)> = run.iter().take(400).map(|s| (s.time, s.entropy)).collect();
    let errors: Vec<(f64, f64)> = run
        .iter()
        .step_by(20)
        .map(|s| (s.time, s.energy - run.certificate().initial_energy))
        .collect();
    let figure = Panels::new(format!("Fluctuating heat, h = {}", example.step_size))
        .columns(2)
        .panel(
            Panel::new("density", "energy u")
                .line("one path", (0..BINS).flat_map(stairs).collect::<Vec<_>>())
                .line("Beta(31, 51)", law),
        )
        .panel(Panel::new("energy u", "t").line("u", path).named_level("mean", exact[0]))
        .panel(Panel::new("entropy S", "t").line("S", entropy))
        .panel(Panel::new("H − H₀", "t").line("H − H₀", errors).level(0.0));
    let last = run.last();
    example
        .report_of(run.certificate(), last.time, last.point.iter().copied().collect())
        .with("mean", mean)
        .with("mean_of_the_law", exact[0])
        .with("variance", variance)
        .with("variance_of_the_law", exact[1])
        .figure(figure)
        .print()
}
