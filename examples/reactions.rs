//! Reactions by mass action: a dissipation potential that is not quadratic, as Onsager terms.
//!
//! Isomers `A ⇌ B ⇌ C` have amounts `n`, those of an equilibrium are `π`, and `a = n/π` are the activities. A reaction has the rates
//! `p = k aᵢ` forth and `q = k aⱼ` back. With `S = Σ nᵢ (1 − ln aᵢ)` its affinity is `A = ν·dS = ln(p/q)`. So mass action is an
//! Onsager term, whose conductance is the logarithmic mean of its rates (Mielke 2011):
//!
//! ```text
//! n' = ν (p − q) = ν Λ(p, q) A,      Λ(p, q) = (p − q)/(ln p − ln q),      K = Λ ν νᵀ .
//! ```
//!
//! These equations are linear, and their closed form is the exponential of a matrix. At rest each reaction is in balance.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Order, Panel, Panels};

/// The amounts at equilibrium, and the rate constants of `A ⇌ B` and `B ⇌ C`.
const EQUILIBRIUM: [f64; 3] = [1.0, 2.0, 0.5];
const RATES: [f64; 2] = [1.0, 0.4];

fn main() -> Result<(), Box<dyn Error>> {
    let activities = |n: &Vector3<Real>| Vector3::from_fn(|i, _| n[i] / EQUILIBRIUM[i]);
    let isomers = System::on(Euclidean::<3>)
        .energy(|n: &Vector3<Real>| n.sum()) // a mole of each has the same
        .entropy(move |n: &Vector3<Real>| n.dot(&activities(n).map(|a| -a.ln() + 1.0)))
        .onsager(move |n: &Vector3<Real>, _: &Vector3<Real>| {
            let rates = |r: usize| [r, r + 1].map(|i| activities(n)[i] * RATES[r]);
            let reaction = |r: usize, nu: Vector3<f64>| {
                let [p, q] = rates(r);
                Contact { rate: logarithmic_mean(p, q), along: nu.cast() }
            };
            [reaction(0, vector![-1.0, 1.0, 0.0]), reaction(1, vector![0.0, -1.0, 1.0])]
        })
        .build()?;

    let about = "Reactions by mass action: a potential that is not quadratic, as Onsager terms.";
    let example = Example::new(about, 160, 0.05);
    let start = vector![3.8, 0.1, 0.1];
    let sizes = [1.0, 0.5, 0.25, 0.125].map(|part| part * example.step_size);
    let span = |k: usize| Span::steps(sizes[k], example.steps << k).at_most(1000);
    let runs = (0..4).map(|k| example.run(&isomers, start, span(k)));
    let runs = runs.collect::<Result<Vec<_>, _>>()?;

    let [a, b, c] = EQUILIBRIUM.map(f64::recip);
    let [k, l] = RATES;
    let linear = matrix![-k * a, k * b, 0.0; k * a, -(k + l) * b, l * c; 0.0, l * b, -l * c];
    let error = |s: &State<Euclidean<3>>| (s.point - (linear * s.time).exp() * start).norm();
    let errors: Vec<f64> = runs.iter().map(|run| error(run.last())).collect();
    let (run, order) = (&runs[0], Order::fit(&sizes, &errors)?);

    let mut amounts = Panel::new("amount", "t");
    for (i, name) in ["A", "B", "C"].into_iter().enumerate() {
        amounts = amounts.line(name, run.series(|s| s.point[i]));
        amounts = amounts.level(start.sum() * EQUILIBRIUM[i] / EQUILIBRIUM.iter().sum::<f64>());
    }
    let mut distance = Panel::new("distance from the closed form", "t").logarithmic(1e-8);
    for (run, h) in runs.iter().zip(sizes) {
        distance = distance.line(format!("h = {h}"), run.series(error));
    }
    let rate = |i: usize| run.series(|s| k * s.point[i] / EQUILIBRIUM[i]);
    let balance = Panel::new("rates of A ⇌ B", "t").line("forth", rate(0)).line("back", rate(1));
    let figure = Panels::new(format!("Reactions by mass action, h = {}", example.step_size))
        .columns(2)
        .panel(amounts)
        .panel(distance)
        .panel(balance)
        .panel(run.panel("entropy S", |s| s.entropy));
    let last = rate(0).iter().zip(rate(1)).map(|(p, q)| (p.1 - q.1).abs()).next_back();
    let report = example.report(run).with("order", order.slope);
    report.with("difference_of_rates", last.unwrap_or(f64::NAN)).figure(figure).print()
}
