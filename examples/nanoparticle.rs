//! The spin of a nanoparticle in SI units: Langevin's function at six fields, and how it switches.
//!
//! A unit spin `n` with the moment `μ` has `H = −μ n·B − KV n₃²`, and precesses and is damped with `n' = γ n × B + …`, the
//! equation of Landau, Lifshitz and Gilbert at 300 K. Its mean along a field is `coth x − 1/x` with `x = μB/kT`. With an
//! easy axis it stays beside one of its ends, and switches to the other one now and then.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels};
use serde_json::json;

/// Boltzmann's constant in J/K, and the temperature in K.
const K_B: f64 = 1.380649e-23;
const TEMPERATURE: f64 = 300.0;
/// The moment in J/T, the gyromagnetic ratio in 1/(s T), and the damping.
const MOMENT: f64 = 4.8e-19;
const RATIO: f64 = 1.76e11;
const DAMPING: f64 = 0.3;
/// The height of the barrier in units of kT.
const BARRIER: f64 = 5.0;
const PATHS: usize = 6;
const STEPS: usize = 2000;

type Path = Result<Trajectory<OpenSpace<Sphere<2>>>, metriplectic::integrators::Error>;

/// A path in a field along `e₃`, in T, with an anisotropy in J.
fn path(field: f64, anisotropy: f64, number: u64, span: Span) -> Path {
    let spin = System::on(Sphere::<2>::round())
        .bracket(Poisson::field(|n: &Vector3<Real>| n.cross_matrix() * Real::from(RATIO / MOMENT)))
        .energy(move |n: &Vector3<Real>| n.z * (-MOMENT * field) - n.z * n.z * anisotropy)
        .bath("crystal", Bath::at(TEMPERATURE).isotropic(DAMPING * RATIO / MOMENT))
        .noise(Boltzmann(K_B))
        .build()?;
    let start = spin.flow().start(vector![0.0, 0.6, 0.8]);
    Ok(NinomiyaVictoir(DormandPrince5).seed(7).path(number).run(&spin, start, span)?)
}

/// The mean of `n₃` after the start is forgotten.
fn mean(states: &[State<OpenSpace<Sphere<2>>>]) -> f64 {
    let kept = states.iter().skip(200);
    kept.clone().map(|state| state.point.x.z).sum::<f64>() / kept.count() as f64
}

fn main() -> Result<(), Box<dyn Error>> {
    let example = Example::study(
        "The spin of a nanoparticle in SI units: Langevin's function, and switching.",
    );
    let thermal = K_B * TEMPERATURE;
    let langevin = |x: f64| x.tanh().recip() - x.recip();
    let fields = linspace(0.5, 4.0, 6);
    let table = Sweep::new("fields")
        .grid("x", fields.clone())
        .samples(PATHS)
        .run(|row| {
            let field = row["x"] * thermal / MOMENT;
            let h = 0.2 / (RATIO * field).max(3e9);
            path(field, 0.0, row.number() as u64, Span::steps(h, STEPS))
        })
        .measure("mean", |run| mean(run.states()))
        .measure("off", |run| run.certificate().max_energy_error / thermal)
        .quiet()
        .execute()?
        .complete()?;
    let (x, means) = (table.column("x")?, table.column("mean")?);
    let of = |field: f64| {
        let here = x.iter().zip(&means).filter(|(x, _)| (**x - field).abs() < 1e-9);
        Estimate::of(here.map(|(_, mean)| *mean))
    };
    let found: Vec<(f64, Estimate)> = fields.iter().map(|x| (*x, of(*x))).collect();
    let worst =
        found.iter().map(|(x, estimate)| estimate.errors_from(langevin(*x))).fold(0.0, f64::max);
    let balance = table.column("off")?.into_iter().fold(0.0, f64::max);

    let h = 3e-11;
    let switching = path(0.0, BARRIER * thermal, 0, Span::steps(h, 8000))?;
    let trace: Vec<(f64, f64)> =
        switching.iter().step_by(4).map(|s| (1e9 * s.time, s.point.x.z)).collect();
    let heat: Vec<(f64, f64)> = switching
        .iter()
        .step_by(4)
        .map(|s| (1e9 * s.time, s.point.ledger.heat("crystal").unwrap_or(0.0) / thermal))
        .collect();
    let bars = |sign: f64| -> Vec<(f64, f64)> {
        found.iter().map(|(x, of)| (*x, of.mean + sign * of.standard_error)).collect()
    };
    let curve: Vec<(f64, f64)> =
        (1..=90).map(|k| f64::from(k) * 0.05).map(|x| (x, langevin(x))).collect();
    let figure = Panels::new("The spin of a nanoparticle at 300 K")
        .panel(
            Panel::new("mean of n·B/|B|", "μB/kT")
                .line("coth x − 1/x", curve)
                .line("paths + σ", bars(1.0))
                .line("paths − σ", bars(-1.0)),
        )
        .panel(Panel::new("n₃", "t / ns").title("a barrier of 5 kT").line("n₃", trace).level(0.0))
        .panel(Panel::new("heat of the crystal / kT", "t / ns").line("Q", heat));
    example
        .report_of_many()
        .text(&table)
        .with("fields", json!(fields))
        .with("means", json!(found.iter().map(|(_, of)| of.mean).collect::<Vec<_>>()))
        .with(
            "standard_errors",
            json!(found.iter().map(|(_, of)| of.standard_error).collect::<Vec<_>>()),
        )
        .with("worst_in_standard_errors", worst)
        .with("worst_balance_in_thermal_energies", balance)
        .figure(figure)
        .print()
}
