//! Hysteresis of a powder: particles of one spin each, with easy axes in all directions (Stoner, Wohlfarth 1948).
//!
//! The field `η(t) = 1.5 cos ωt` along `e₃` is slow, and an axis `a` is at the angle `θ` from it. A spin precesses by the
//! area form and is damped by a bath, the equation of Landau, Lifshitz and Gilbert:
//!
//! ```text
//! H(t, n) = −½ (n·a)² − η(t) n₃,   n' = n × ∇H − λ (∇H)_tan .
//! ```
//!
//! The spin jumps where its minimum of the energy ends, at `η = −(cos^⅔ θ + sin^⅔ θ)^{−3/2}`; the field is not
//! infinitely slow, so it jumps a little later. The work of the field over a loop is the area of the loop, and the heat of
//! the bath. Without a field a powder keeps half of its magnetisation.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels};

const FIELD: f64 = 1.5;
const PERIOD: f64 = 1000.0;
const FRICTION: f64 = 1.0;
const OUTPUTS: usize = 400;
/// The output at which the whole loop begins, at `η = 0`.
const QUARTER: usize = OUTPUTS / 4;

type Space = OpenSpace<Sphere<2>>;

fn field(time: Real) -> Real {
    (time * (std::f64::consts::TAU / PERIOD)).cos() * FIELD
}

/// The loop of one particle, once and a quarter.
fn particle(row: &Row) -> Result<Trajectory<Space>, metriplectic::integrators::Error> {
    let cos = row["cos"];
    let axis = vector![(1.0 - cos * cos).sqrt(), 0.0, cos];
    let system = System::on(Sphere::<2>::round())
        .bracket(AreaForm)
        .energy_in_time(move |t: Real, n: &Vector3<Real>| {
            n.dot(&axis.cast()).powi(2) * -0.5 - field(t) * n.z
        })
        .bath("crystal", Bath::at(1.0).isotropic(FRICTION))
        .build()?;
    // Near the field and the axis, but in no plane with them.
    let start = system.start(vector![axis.x, 0.01, axis.z + 2.0].normalize());
    let span = Span::until(1.25 * PERIOD).tolerance(1e-6).output_every(PERIOD / OUTPUTS as f64);
    let span = span.event("jump", move |s: &OpenState<Vector3<f64>>| s.x.dot(&axis)).falling();
    Ok(DormandPrince5.run(&system, start, span)?)
}

/// The work of the field up to a state.
fn work(state: &State<Space>) -> f64 {
    state.point.ledger.parameter_work()
}

/// The heat that the bath has taken up to a state.
fn heat(state: &State<Space>) -> f64 {
    -state.point.ledger.heat("crystal").unwrap_or(0.0)
}

/// The field at which a particle jumps, if it is infinitely slow.
fn exact(cos: f64) -> f64 {
    let sin = (1.0 - cos * cos).sqrt();
    (cos.powf(2.0 / 3.0) + sin.powf(2.0 / 3.0)).powf(-1.5)
}

fn main() -> Result<(), Box<dyn Error>> {
    let example =
        Example::study("Hysteresis of a powder of two hundred particles of one spin each.");
    let table = Sweep::new("powder")
        .latin_hypercube(200, [("cos", 0.0..1.0)])
        .run(particle)
        .observe("n₃", |s| s.x.z)
        .measure("jump", |run| -field(run.time_of("jump").into()).re)
        .measure("work", |run| work(run.last()) - work(&run.states()[QUARTER]))
        .measure("heat", |run| heat(run.last()) - heat(&run.states()[QUARTER]))
        .execute()?;
    let cos = table.column("cos")?;
    let degrees = |cos: f64| cos.acos().to_degrees();
    let by_angle = |values: &[f64]| -> Vec<(f64, f64)> {
        let mut line: Vec<_> = cos.iter().zip(values).map(|(c, y)| (degrees(*c), *y)).collect();
        line.retain(|(_, y)| y.is_finite());
        line.sort_by(|a, b| a.0.total_cmp(&b.0));
        line
    };
    let (works, heats) = (table.column("work")?, table.column("heat")?);
    let kept = works.iter().zip(&heats).map(|(w, q)| (w - q).abs()).fold(0.0, f64::max);
    let found = by_angle(&table.column("jump")?);
    let errors = found.iter().map(|(angle, jump)| jump - exact(angle.to_radians().cos()));
    let late = errors.fold(0.0, f64::max);
    let against_field = |line: Vec<(f64, f64)>| -> Vec<(f64, f64)> {
        line.into_iter().map(|(t, m)| (field(t.into()).re, m)).collect()
    };
    let mean = table.mean("n₃")?;
    let powder = against_field(mean.line("mean").unwrap_or_default());
    let quarter = 0.25 * PERIOD;
    let at = |time: f64| mean.rows().iter().find(|row| row[0] >= time).map_or(f64::NAN, |r| r[1]);
    let loop_of = |angle: f64| {
        let off = |c: f64| (degrees(c) - angle).abs();
        let rows = table.rows().zip(&cos).min_by(|a, b| off(*a.1).total_cmp(&off(*b.1)));
        let series = rows.and_then(|(row, _)| Some(row.series("n₃")?.collect::<Vec<_>>()));
        against_field(series.unwrap_or_default())
    };
    let mut loops = Panel::new("n₃", "field η").title("one particle");
    for angle in [5.0, 30.0, 60.0, 85.0] {
        loops = loops.line(format!("θ = {angle}°"), loop_of(angle));
    }
    let curve: Vec<_> = (0..=90).map(f64::from).map(|a| (a, exact(a.to_radians().cos()))).collect();
    let figure = Panels::new("Hysteresis of a powder of two hundred particles")
        .columns(2)
        .panel(Panel::new("mean of n₃", "field η").line("powder", powder).level(0.5).level(-0.5))
        .panel(loops)
        .panel(
            Panel::new("field η of the jump", "angle θ (degrees)")
                .line("infinitely slow", curve)
                .line(format!("once in {PERIOD}"), found),
        )
        .panel(
            Panel::new("energy of a loop", "angle θ (degrees)")
                .line("work of the field", by_angle(&works))
                .line("heat of the bath", by_angle(&heats)),
        );
    let error = table.column("run.energy_error")?.into_iter().fold(0.0, f64::max);
    let report = example.report_of_many().text(&table).with("rows", table.len());
    report
        .with("failed", table.failed())
        .with("remanence", at(quarter))
        .with("latest_jump", late)
        .with("largest_work", works.iter().copied().fold(0.0, f64::max))
        .with("largest_difference_of_work_and_heat", kept)
        .with("worst_energy_error", error)
        .figure(figure)
        .print()
}
