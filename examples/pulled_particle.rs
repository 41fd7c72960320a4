//! A particle in a trap that becomes stiffer: Jarzynski's equality and Crooks' theorem, from exact work and heat.
//!
//! `H(t, q, p) = ½p² + ½k(t)q²` in a bath at the temperature 1, with `k` from 1 to 4 in a short time, and back. The work of
//! each path is the change of `H` at frozen states, and work and heat add up to the change of `H` to round-off. So
//! `⟨exp(−W/kT)⟩ = exp(−ΔF/kT)` with `ΔF = ½ kT ln 4`, and the distributions of the work forwards and backwards
//! cross at `W = ΔF`.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels};

const FRICTION: f64 = 1.0;
const TIME: f64 = 1.0;
const STIFFNESS: [f64; 2] = [1.0, 4.0];
const PATHS: usize = 3000;
const STEPS: usize = 25;
const BINS: usize = 30;
const WORKS: [f64; 2] = [-1.0, 4.0];

/// The stiffness on the way, forwards or backwards.
fn stiffness(t: Real, backward: bool) -> Real {
    let s = if backward { -t / TIME + 1.0 } else { t / TIME };
    s * (STIFFNESS[1] - STIFFNESS[0]) + STIFFNESS[0]
}

fn pulled(
    row: &Row,
    backward: bool,
) -> Result<Trajectory<OpenSpace<Euclidean<2>>>, metriplectic::integrators::Error> {
    let particle = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy_in_time(move |t: Real, x: &Vector2<Real>| {
            (x.y * x.y + x.x * x.x * stiffness(t, backward)) * 0.5
        })
        .bath(
            "water",
            Bath::at(1.0).friction(|_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                [Contact::along(FRICTION, [0.0, 1.0])]
            }),
        )
        .noise(Boltzmann(1.0))
        .build()?;
    let deviation = STIFFNESS[usize::from(backward)].sqrt().recip();
    let start = particle.flow().start(vector![deviation * row["q"], row["p"]]);
    let span = Span::steps(TIME / STEPS as f64, STEPS);
    let path = 2 * row.number() as u64 + u64::from(backward);
    Ok(NinomiyaVictoir(DormandPrince5).seed(7).path(path).run(&particle, start, span)?)
}

/// The works of all paths, and the worst error of a balance.
fn works(backward: bool) -> Result<(Vec<f64>, f64), Box<dyn Error>> {
    let table = Sweep::new("paths")
        .samples(PATHS)
        .random("q", |draw| draw.normal(0.0, 1.0))
        .random("p", |draw| draw.normal(0.0, 1.0))
        .run(|row| pulled(row, backward))
        .measure("work", |run| run.last().point.ledger.parameter_work())
        .measure("off", |run| run.certificate().max_energy_error)
        .quiet()
        .execute()?
        .complete()?;
    let off = table.column("off")?.into_iter().fold(0.0, f64::max);
    Ok((table.column("work")?, off))
}

/// The middles of bins with the density of works there.
fn histogram(works: &[f64]) -> Vec<(f64, f64)> {
    let width = (WORKS[1] - WORKS[0]) / BINS as f64;
    let density = |k: usize| {
        let first = WORKS[0] + k as f64 * width;
        let count = works.iter().filter(|w| (first..first + width).contains(w)).count();
        (first + 0.5 * width, count as f64 / (works.len() as f64 * width))
    };
    (0..BINS).map(density).collect()
}

fn main() -> Result<(), Box<dyn Error>> {
    let example = Example::study(
        "A particle in a trap that becomes stiffer: Jarzynski and Crooks from exact work.",
    );
    let free_energy = 0.5 * (STIFFNESS[1] / STIFFNESS[0]).ln();
    let ((forward, off), (backward, off_back)) = (works(false)?, works(true)?);
    let weights: Vec<f64> = forward.iter().map(|w| (free_energy - w).exp()).collect();
    let jarzynski = FluctuationTheorem::jarzynski(forward.iter().copied(), 1.0, free_energy);

    let negative: Vec<f64> = backward.iter().map(|w| -w).collect();
    let (there, back) = (histogram(&forward), histogram(&negative));
    // The ratio of both, where each has paths enough.
    let ratio: Vec<(f64, f64)> = there
        .iter()
        .zip(&back)
        .filter(|((_, a), (_, b))| a.min(*b) > 0.05)
        .map(|((w, a), (_, b))| (*w, (a / b).ln()))
        .collect();
    let line: Vec<(f64, f64)> = ratio.iter().map(|(w, _)| (*w, w - free_energy)).collect();
    let convergence: Vec<(f64, f64)> = (1..=60)
        .map(|k| k * PATHS / 60)
        .map(|n| (n as f64, weights[..n].iter().sum::<f64>() / n as f64))
        .collect();
    let figure = Panels::new("A particle in a trap that becomes stiffer")
        .panel(
            Panel::new("density", "work W / kT")
                .line("forwards, W", there)
                .line("backwards, −W", back),
        )
        .panel(
            Panel::new("ln of their ratio", "work W / kT")
                .title("Crooks")
                .line("paths", ratio)
                .line("(W − ΔF)/kT", line),
        )
        .panel(
            Panel::new("⟨exp(−(W − ΔF)/kT)⟩", "paths")
                .title("Jarzynski")
                .line("mean", convergence)
                .level(1.0),
        );
    example
        .report_of_many()
        .text(jarzynski)
        .with("jarzynski", jarzynski.estimate.mean)
        .with("standard_error", jarzynski.estimate.standard_error)
        .with("mean_work", Estimate::of(forward).mean)
        .with("free_energy", free_energy)
        .with("worst_balance", off.max(off_back))
        .figure(figure)
        .print()
}
