//! A thousand bodies fall over: when a body that spins about its long axis turns over, and to which side.
//!
//! `p' = p × ω + γ (|ω|² p − ⟨ω, p⟩ ω)`, with `H = ½ Σ p_i²/I_i`, `ω_i = p_i/I_i` and `S = ½γ|p|²`. The rotation
//! about the axis of least inertia is stable without friction alone: Explorer 1 did so in 1958, and fell over within
//! a day. The body ends in a rotation about the axis of largest inertia, forwards or backwards. Which of both it is
//! depends on friction and on the start in stripes, because it depends on the phase in which the motion crosses the
//! separatrix.
//!
//! The rows run on all threads. As shards of several processes they write journals; `--help` says how.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Gallery, Map, Panel, Panels};
use serde_json::json;

const INERTIA: [f64; 3] = [10.0, 5.0, 1.0];
const END: f64 = 120.0;
const JOURNAL: &str = "sweep.journal";

/// A body from a start beside its long axis, until `t = 120`.
fn fall(row: &Row) -> Result<Trajectory<LieDual<3>>, metriplectic::integrators::Error> {
    let (friction, deviation) = (row["friction"], row["deviation"]);
    let body = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| (0..3).map(|i| p[i].powi(2) * (0.5 / INERTIA[i])).sum())
        .entropy(move |p: &Vector3<Real>| p.norm_squared() * (0.5 * friction))
        .build()?;
    let span = Span::until(END).tolerance(1e-7).output_every(1.0);
    let span = span.event("fall", |p: &Vector3<f64>| p.z);
    Ok(DormandPrince8.run(&body, vector![deviation, 0.0, 1.0], span)?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let example = Example::sweep("A thousand spinning bodies fall over: when, and to which side.");
    let runs = Sweep::new("falls")
        .grid("friction", geomspace(0.05, 1.0, 40))
        .grid("deviation", linspace(0.02, 0.5, 25))
        .run(fall)
        .observe("p₃", |p| p.z)
        .observe("|p|", |p| p.norm())
        .measure("fall", |run| run.time_of("fall"));
    let shard = Shard::from_environment()?;
    let table = match (example.merge, shard.count) {
        (true, _) => Table::merge(Table::journals(JOURNAL)?)?.complete()?,
        (false, 1) => runs.execute()?,
        _ => runs.shard(shard).journal(JOURNAL).execute()?,
    };
    let report = example.report_of_many().text(&table).with("rows", table.len());
    let report = report.with("failed", table.failed()).with("missing", table.missing().len());
    if table.missing().is_empty() { drawn(report, &table)? } else { report }.print()
}

/// The report with the figure and the numbers of all rows.
fn drawn(
    report: metriplectic_studies::Report,
    table: &Table,
) -> Result<metriplectic_studies::Report, Box<dyn Error>> {
    let column = |name: &str| table.column(name);
    let (friction, deviation) = (column("friction")?, column("deviation")?);
    let (falls, ends) = (column("fall")?, column("end.0")?);
    let map = |values: &[f64], bounds: &[f64]| {
        let places = friction.iter().zip(&deviation).zip(values);
        let points = places.map(|((x, y), z)| [x.log10(), *y, *z]);
        Panel::new("p₁ at the start", "log₁₀ friction")
            .map(Map::new(points, bounds.iter().copied()))
    };
    let band = |name: &str| -> Result<Panel, Box<dyn Error>> {
        let quantiles = table.quantiles(name, [0.05, 0.5, 0.95])?;
        let line = |name: &str| quantiles.line(name).unwrap_or_default();
        let panel = Panel::new(name, "t").line("5 %", line("q0.05")).line("median", line("q0.5"));
        let mean = table.mean(name)?.line("mean").unwrap_or_default();
        Ok(panel.line("95 %", line("q0.95")).line("mean", mean))
    };
    table.csv(Gallery::open()?.path("sweep.csv"))?;
    let figure = Panels::new("A thousand spinning bodies fall over")
        .columns(2)
        .panel(map(&falls, &[5.0, 10.0, 15.0, 20.0, 30.0, 40.0]).title("time of the fall"))
        .panel(map(&ends, &[0.0]).title("p₁ at the end"))
        .panel(band("p₃")?.level(0.0))
        .panel(band("|p|")?);
    let [first, last] = [f64::min, f64::max].map(|f| falls.iter().copied().fold(f64::NAN, f));
    let error = column("run.energy_error")?.into_iter().fold(0.0, f64::max);
    let backwards = ends.iter().filter(|p| **p < 0.0).count();
    let report = report.with("first_and_last_fall", json!([first, last]));
    let report = report.with("backwards", backwards).with("worst_energy_error", error);
    Ok(report.figure(figure))
}
