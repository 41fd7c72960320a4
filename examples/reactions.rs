//! Reactions by mass action: a dissipation potential that is not quadratic, as Onsager terms.
//!
//! A reaction with the vectors `λ`, `ϱ` of its left and right sides has the rates `p = k Π (nᵢ/πᵢ)^λᵢ` forth and
//! `q = k Π (nᵢ/πᵢ)^ϱᵢ` back, in amounts `n` over those of an equilibrium, `π`. With `S = Σ nᵢ (1 − ln nᵢ/πᵢ)` its affinity is
//! `A = ν·dS = ln(p/q)`, `ν = ϱ − λ`. So mass action is an Onsager term whose conductance depends on the state (Mielke 2011):
//!
//! ```text
//! n' = ν (p − q) = ν Λ(p, q) A,      Λ(p, q) = (p − q)/(ln p − ln q),      K = Λ ν νᵀ .
//! ```
//!
//! Isomers `A ⇌ B ⇌ C` follow the exponential of a matrix, and a dimer `2A ⇌ B` an equation of Riccati:
//!
//! ```text
//! a' = −2 (a² − b/2),   a + 2b = 1:     (a − a₊)/(a − a₋) = c exp(−2 (a₊ − a₋) t),   a± = −1/8 ± √(1/64 + 1/4) .
//! ```

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Order, Panel, Panels};

/// The amounts at equilibrium, and the rate constants of `A ⇌ B` and `B ⇌ C`.
const EQUILIBRIUM: [f64; 3] = [1.0, 2.0, 0.5];
const RATES: [f64; 2] = [1.0, 0.4];

fn main() -> Result<(), Box<dyn Error>> {
    let isomers = System::on(Euclidean::<3>)
        .energy(|n: &Vector3<Real>| n.sum()) // the same for a mole of each
        .entropy(|n: &Vector3<Real>| -relative_entropy(n.as_slice(), &EQUILIBRIUM))
        .onsager(|n: &Vector3<Real>, _: &Vector3<Real>| {
            let a = Vector3::from_fn(|i, _| n[i] / EQUILIBRIUM[i]);
            let reaction = |r: usize, nu: Vector3<f64>| Contact {
                rate: logarithmic_mean(a[r] * RATES[r], a[r + 1] * RATES[r]),
                along: nu.cast(),
            };
            [reaction(0, vector![-1.0, 1.0, 0.0]), reaction(1, vector![0.0, -1.0, 1.0])]
        })
        .build()?;
    let dimer = System::on(Euclidean::<2>)
        .energy(|n: &Vector2<Real>| n.x + n.y * 2.0)
        .entropy(|n: &Vector2<Real>| -relative_entropy(n.as_slice(), &[1.0, 2.0]))
        .onsager(|n: &Vector2<Real>, _: &Vector2<Real>| {
            let rate = logarithmic_mean(n.x * n.x, n.y * 0.5);
            [Contact { rate, along: vector![-2.0, 1.0].cast() }]
        })
        .build()?;

    let about = "Reactions by mass action: a potential that is not quadratic, as Onsager terms.";
    let example = Example::new(about, 160, 0.05);
    let start = vector![3.8, 0.1, 0.1];
    let sizes = [1.0, 0.5, 0.25, 0.125].map(|part| part * example.step_size);
    let span = |k: usize| Span::steps(sizes[k], example.steps << k).at_most(1000);
    let runs = (0..4).map(|k| example.run(&isomers, start, span(k)));
    let runs = runs.collect::<Result<Vec<_>, _>>()?;
    let pair = example.run(&dimer, vector![0.98, 0.01], span(0))?;

    let exact = |t: f64| (generator() * t).exp() * start;
    let error = |s: &State<Euclidean<3>>| (s.point - exact(s.time)).norm();
    let errors: Vec<f64> = runs.iter().map(|run| error(run.last())).collect();
    let (run, order) = (&runs[0], Order::fit(&sizes, &errors)?);
    let mut amounts = Panel::new("amount", "t").title("A ⇌ B ⇌ C");
    for (i, name) in ["A", "B", "C"].into_iter().enumerate() {
        amounts = amounts.line(name, run.series(|s| s.point[i]));
        amounts = amounts.level(start.sum() * EQUILIBRIUM[i] / EQUILIBRIUM.iter().sum::<f64>());
    }
    let mut distance = Panel::new("distance from the closed form", "t").logarithmic(1e-7);
    for (run, h) in runs.iter().zip(sizes) {
        distance = distance.line(format!("h = {h}"), run.series(error));
    }
    let beside = Panel::new("amount of A", "t").title("2A ⇌ B");
    let figure = Panels::new(format!("Reactions by mass action, h = {}", example.step_size))
        .columns(2)
        .panel(amounts)
        .panel(distance)
        .panel(
            beside
                .line("closed form", pair.series(|s| riccati(s.time)))
                .line("scheme", pair.series(|s| s.point.x)),
        )
        .panel(run.panel("entropy S", |s| s.entropy));
    let off = pair.series(|s| (s.point.x - riccati(s.time)).abs());
    let off = off.into_iter().fold(0.0, |most: f64, (_, off)| most.max(off));
    let report = example.report(run).certificate("dimer", &pair.certificate);
    report.with("order", order.slope).with("dimer_error", off).figure(figure).print()
}

/// `Σ nᵢ (ln nᵢ/πᵢ − 1)`.
fn relative_entropy(n: &[Real], pi: &[f64]) -> Real {
    n.iter().zip(pi).map(|(n, pi)| *n * ((*n / *pi).ln() - 1.0)).sum()
}

/// The matrix of the linear kinetics of the isomers.
fn generator() -> Matrix3<f64> {
    let [a, b, c] = EQUILIBRIUM.map(f64::recip);
    let [k, l] = RATES;
    matrix![-k * a, k * b, 0.0; k * a, -(k + l) * b, l * c; 0.0, l * b, -l * c]
}

/// The amount of A beside its dimer, from 0.98.
fn riccati(t: f64) -> f64 {
    let root = (1.0_f64 / 64.0 + 0.25).sqrt();
    let ends = [root - 0.125, -root - 0.125];
    let ratio = (0.98 - ends[0]) / (0.98 - ends[1]) * (-4.0 * root * t).exp();
    (ends[0] - ratio * ends[1]) / (1.0 - ratio)
}
