//! A rigid body with thermal noise inside: a path on its energy ellipsoid, beside the law `exp(S/k_B)`.
//!
//! `dp = [p × ω + ½ K dS] dt + √k_B Σ_a e_a × ω ∘ dW_a`, with `H = ½ Σ p_i²/I_i`, `ω_i = p_i/I_i` and `S = ½|p|²`. Noise and
//! friction are inside the body, so its energy stays the same to round-off, and the path visits the whole ellipsoid. In
//! directions `n`, with `p_i = √(2EI_i) n_i`, the law is `exp(S/k_B)` on the unit sphere: rotations about the axis of largest
//! inertia are likely, and those about the other axes are not.

use std::error::Error;

use metriplectic::dynamics::noise::Uniform;
use metriplectic::integrators::Noisy;
use metriplectic::prelude::*;
use metriplectic_studies::{Example, Globe, Panel, Panels};

const INERTIA: [f64; 3] = [3.0, 2.0, 1.0];
const K_B: f64 = 0.25;
const BINS: usize = 40;

fn main() -> Result<(), Box<dyn Error>> {
    let so3 = LieDual::so3();
    let friction = CasimirDissipation::new(so3.algebra(), Matrix3::identity() * 0.5)?;
    let body = System::on(so3)
        .energy(|p: &Vector3<Real>| (0..3).map(|i| p[i].powi(2) * (0.5 / INERTIA[i])).sum())
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .dissipation(friction)
        .noise(Boltzmann(K_B))
        .build()?;

    let about = "A rigid body with thermal noise inside, beside the law exp(S/k_B) on its energy ellipsoid.";
    let example = Example::new(about, 40_000, 0.1);
    let span = Span::steps(example.step_size, example.steps);
    let start = vector![0.1, 0.2, 1.0];
    let run = NinomiyaVictoir(DormandPrince5).seed(7).run(&body, start, span)?;

    let energy = run.certificate().initial_energy;
    let axes = Vector3::from(INERTIA).map(|i| (2.0 * energy * i).sqrt());
    let direction = |p: &Vector3<f64>| p.component_div(&axes);
    let (found, exact) = (histogram(run.iter().map(|s| direction(&s.point).x)), law(&axes));
    let off =
        found.iter().zip(&exact).map(|(a, b)| (a.1 - b.1).abs()).sum::<f64>() * 2.0 / BINS as f64;

    let mean = |axes: &Vector3<f64>| mean_entropy(axes);
    let series: Vec<(f64, f64)> = run.iter().take(2000).map(|s| (s.time, s.entropy)).collect();
    let errors: Vec<(f64, f64)> =
        run.iter().step_by(20).map(|s| (s.time, s.energy - energy)).collect();
    let globe = Globe::new("directions n, from ○ to ●").seen_from([0.8, 0.5, 0.4]);
    let figure = Panels::new(format!("A rigid body with thermal noise, h = {}", example.step_size))
        .columns(2)
        .globe(globe.curve("n(t)", run.iter().take(600).map(|s| direction(&s.point))))
        .panel(
            Panel::new("density", "n₁, along the axis of largest inertia")
                .line("one path", stairs(&found))
                .line("exp(S/k_B)", &exact),
        )
        .panel(Panel::new("entropy S", "t").line("S", series).named_level("mean", mean(&axes)))
        .panel(Panel::new("H − H₀", "t").line("H − H₀", errors).level(0.0));
    let theorem = fluctuation_theorem(&body, &axes)?;
    let last = run.last();
    let sampled = run.iter().map(|s| s.entropy).sum::<f64>() / run.states().len() as f64;
    example
        .report_of(run.certificate(), last.time, last.point.iter().copied().collect())
        .text(theorem)
        .with("fluctuation_theorem", theorem.estimate.mean)
        .with("standard_error", theorem.estimate.standard_error)
        .with("mean_entropy", sampled)
        .with("mean_entropy_of_the_law", mean(&axes))
        .with("distance_of_the_histogram", off)
        .figure(figure)
        .print()
}

/// The integral fluctuation theorem `⟨exp(−ΔS/k_B)⟩ = 1` of short paths that begin uniformly on the shell.
fn fluctuation_theorem(
    body: &Noisy<
        impl Metriplectic<
            Manifold = LieDual<3>,
            Metric = Canonical,
            Dissipation = CasimirDissipation<3>,
        > + Sync,
        Uniform,
    >,
    axes: &Vector3<f64>,
) -> Result<FluctuationTheorem, Box<dyn Error>> {
    let table = Sweep::new("uniform starts")
        .samples(400)
        .random("height", |draw| draw.uniform(-1.0..1.0))
        .random("angle", |draw| draw.uniform(0.0..std::f64::consts::TAU))
        .run(|row| {
            let (z, angle) = (row["height"], row["angle"]);
            let r = (1.0 - z * z).sqrt();
            let start = vector![r * angle.cos(), r * angle.sin(), z].component_mul(axes);
            let method = NinomiyaVictoir(DormandPrince5).seed(8).path(row.number() as u64);
            Ok(method.run(body, start, Span::steps(0.1, 10))?)
        })
        .measure("change", |run| run.last().entropy - run.states()[0].entropy)
        .quiet()
        .execute()?
        .complete()?;
    Ok(FluctuationTheorem::integral(table.column("change")?, K_B))
}

/// The middles of the bins of `[−1, 1]`, with the density there.
fn histogram(values: impl Iterator<Item = f64>) -> Vec<(f64, f64)> {
    let (values, half): (Vec<f64>, f64) = (values.collect(), 1.0 / BINS as f64);
    let density = |k: usize| {
        let bin = middle(k) - half..middle(k) + half;
        let count = values.iter().filter(|value| bin.contains(value)).count();
        count as f64 / (2.0 * half * values.len() as f64)
    };
    (0..BINS).map(|k| (middle(k), density(k))).collect()
}

fn middle(bin: usize) -> f64 {
    (bin as f64 + 0.5) * 2.0 / BINS as f64 - 1.0
}

/// The corners of a histogram.
fn stairs(bins: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let half = 1.0 / BINS as f64;
    bins.iter().flat_map(|&(x, y)| [(x - half, y), (x + half, y)]).collect()
}

/// `S` and `exp(S/k_B)` around the circle `n₁ = z`.
fn circle(axes: &Vector3<f64>, z: f64) -> impl Iterator<Item = (f64, f64)> + use<'_> {
    (0..200).map(move |k| {
        let angle = std::f64::consts::TAU * f64::from(k) / 200.0;
        let r = (1.0 - z * z).sqrt();
        let p = vector![z, r * angle.cos(), r * angle.sin()].component_mul(axes);
        let entropy = 0.5 * p.norm_squared();
        (entropy, (entropy / K_B).exp() / 200.0)
    })
}

/// The density of `n₁` in the law.
fn law(axes: &Vector3<f64>) -> Vec<(f64, f64)> {
    let weight = |z: f64| circle(axes, z).map(|(_, weight)| weight).sum::<f64>();
    let weights: Vec<f64> = (0..BINS).map(|k| weight(middle(k))).collect();
    let sum = weights.iter().sum::<f64>() * 2.0 / BINS as f64;
    (0..BINS).map(|k| (middle(k), weights[k] / sum)).collect()
}

/// The mean of `S` in the law.
fn mean_entropy(axes: &Vector3<f64>) -> f64 {
    let all = (0..400).flat_map(|k| circle(axes, (f64::from(k) + 0.5) / 200.0 - 1.0));
    let (above, below) = all.fold((0.0, 0.0), |(a, b), (s, w)| (a + s * w, b + w));
    above / below
}
