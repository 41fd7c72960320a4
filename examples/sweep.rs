//! A thousand bodies flip: the time until a body that spins about its middle axis turns over, and where it comes to rest.
//!
//! `p' = p × ω + γ K p`, with `H = ½ Σ p_i²/I_i`, `S = ½γ|p|²` and `K` that keeps `H`. The rotation about the middle axis
//! is unstable, so a body turns over after a time that grows with the logarithm of its deviation (Euler 1758; the
//! effect of Dzhanibekov). Friction turns it to the axis of largest inertia at last, forwards or backwards: which of
//! both it is depends on the number of half turns before, and so on friction and on the start in narrow stripes.
//!
//! The rows run on all threads. As shards of several processes they write journals; `--help` says how.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Map, Panel, Panels};
use serde_json::json;

const INERTIA: [f64; 3] = [10.0, 5.0, 1.0];
const END: f64 = 150.0;
const JOURNAL: &str = "sweep.journal";

/// A body from a start beside its middle axis, until `t = 150`.
fn flip(row: &Row) -> Result<Trajectory<LieDual<3>>, metriplectic::integrators::Error> {
    let (friction, deviation) = (row["friction"], row["deviation"]);
    let body = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| (0..3).map(|i| p[i].powi(2) * (0.5 / INERTIA[i])).sum())
        .entropy(move |p: &Vector3<Real>| p.norm_squared() * (0.5 * friction))
        .build()?;
    let span = Span::until(END).tolerance(1e-7).output_every(1.0);
    let span = span.event("flip", |p: &Vector3<f64>| p.y);
    Ok(DormandPrince8.run(&body, vector![deviation, -1.0, deviation], span)?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let example =
        Example::sweep("The times at which a thousand bodies flip, and where they come to rest.");
    let runs = Sweep::new("flips")
        .grid("friction", geomspace(0.02, 0.5, 40))
        .grid("deviation", geomspace(1e-4, 0.3, 25))
        .run(flip)
        .observe("p₂", |p| p.y)
        .measure("flip", |run| run.time_of("flip"))
        .measure("flips", |run| run.events().len() as f64);
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
    let [friction, deviation, flip, flips, end] =
        ["friction", "deviation", "flip", "flips", "end.0"].map(|name| table.column(name));
    let places: Vec<[f64; 2]> =
        friction?.iter().zip(&deviation?).map(|(x, y)| [x.log10(), y.log10()]).collect();
    let map = |values: Vec<f64>, bounds: &[f64]| {
        let points = places.iter().zip(values).map(|([x, y], z)| [*x, *y, z]);
        let panel = Panel::new("log₁₀ deviation", "log₁₀ friction");
        panel.map(Map::new(points, bounds.iter().copied()))
    };
    let (flip, flips, end) = (flip?, flips?, end?);
    let [mean, band] = [table.mean("p₂")?, table.quantiles("p₂", [0.05, 0.5, 0.95])?];
    let line = |name: &str| band.line(name).unwrap_or_default();
    let [first, last] = [f64::min, f64::max].map(|f| flip.iter().copied().fold(f64::NAN, f));
    let error = table.column("run.energy_error")?.into_iter().fold(0.0, f64::max);
    let backwards = end.iter().filter(|p| **p < 0.0).count();
    let time = Panel::new("p₂", "t")
        .title("of all bodies")
        .line("5 %", line("q0.05"))
        .line("median", line("q0.5"))
        .line("95 %", line("q0.95"))
        .line("mean", mean.line("mean").unwrap_or_default());
    let figure = Panels::new("A thousand bodies turn over")
        .columns(2)
        .panel(map(flip, &[10.0, 15.0, 20.0, 25.0, 30.0, 40.0]).title("first flip at t ="))
        .panel(map(flips, &[1.0, 2.0, 3.0, 4.0, 6.0, 8.0]).title("flips"))
        .panel(map(end, &[0.0]).title("p₁ at the end"))
        .panel(time.level(0.0));
    let report = report.with("first_flip", json!([first, last])).with("backwards", backwards);
    Ok(report.with("worst_energy_error", error).figure(figure))
}
