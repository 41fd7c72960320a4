//! Hysteresis of a powder: particles of one spin each, with easy axes in all directions (Stoner, Wohlfarth 1948).
//!
//! The field `η(τ) = 1.5 cos ωτ` along `e₃` is slow, and an axis `a` is at the angle `θ` from it. With a heat bath of
//! entropy `s` and a clock `τ` whose momentum `ε` counts the work of the field,
//!
//! ```text
//! H = −½ (n·a)² − η(τ) n₃ + C e^{s/C} + ε,   n' = n × ∇H − λ w_tan,   S = s .
//! ```
//!
//! The spin jumps where its minimum of the energy ends, at `η = −(cos^⅔ θ + sin^⅔ θ)^{−3/2}`; the field is not
//! infinitely slow, so it jumps a little later. Without a field a powder keeps half of its magnetisation.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels};

const FIELD: f64 = 1.5;
const PERIOD: f64 = 1000.0;
const CAPACITY: f64 = 50.0;
const FRICTION: f64 = 1.0;
const OUTPUTS: f64 = 400.0;

/// The spin, and `(s, τ, ε)`.
type Point<D> = (Vector3<D>, Vector3<D>);
type Space = Product<Sphere<2>, Euclidean<3>>;

fn field(time: f64) -> f64 {
    FIELD * (std::f64::consts::TAU * time / PERIOD).cos()
}

/// The loop of one particle, once and a quarter.
fn particle(row: &Row) -> Result<Trajectory<Space>, metriplectic::integrators::Error> {
    let cos = row["cos"];
    let axis = vector![(1.0 - cos * cos).sqrt(), 0.0, cos];
    let clock = Poisson::constant(matrix![0.0, 0.0, 0.0; 0.0, 0.0, 1.0; 0.0, -1.0, 0.0])?;
    let system = System::on(Product(Sphere::<2>::round(), Euclidean::<3>))
        .bracket((AreaForm, clock))
        .energy(move |(n, x): &Point<Real>| {
            let along = n.x * axis.x + n.z * axis.z;
            let field = (x.y * (std::f64::consts::TAU / PERIOD)).cos() * FIELD;
            along * along * -0.5 - field * n.z + (x.x / CAPACITY).exp() * CAPACITY + x.z
        })
        .entropy(|(_, x): &Point<Real>| x.x)
        .dissipation(FieldDissipation(|_: &Point<Real>, w: &Vector6<Real>| {
            let channel = |k: usize| {
                let b = Vector6::<Real>::ith(k, w[3]) - Vector6::<Real>::ith(3, w[k]);
                b * b.transpose() * (w[3].recip() * FRICTION)
            };
            channel(0) + channel(1) + channel(2)
        }))
        .build()?;
    // Near the field and the axis, but in no plane with them.
    let start = (vector![axis.x, 0.01, axis.z + 2.0].normalize(), Vector3::zeros());
    let span = Span::until(1.25 * PERIOD).tolerance(1e-6).output_every(PERIOD / OUTPUTS);
    let span = span.event("jump", move |(n, _): &Point<f64>| n.dot(&axis)).falling();
    Ok(DormandPrince5.run(&system, start, span)?)
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
        .observe("n₃", |(n, _)| n.z)
        .observe("temperature", |(_, x)| (x.x / CAPACITY).exp())
        .measure("jump", |run| -field(run.time_of("jump")))
        .execute()?;
    let (cos, jumps) = (table.column("cos")?, table.column("jump")?);
    let degrees = |cos: f64| cos.acos().to_degrees();
    let mut found: Vec<_> = cos.iter().zip(&jumps).map(|(c, jump)| (degrees(*c), *jump)).collect();
    found.retain(|(_, jump)| jump.is_finite());
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let errors = found.iter().map(|(angle, jump)| jump - exact(angle.to_radians().cos()));
    let late = errors.fold(0.0, f64::max);
    let against_field = |line: Vec<(f64, f64)>| -> Vec<(f64, f64)> {
        line.into_iter().map(|(t, m)| (field(t), m)).collect()
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
            Panel::new("temperature", "t")
                .line("mean", table.mean("temperature")?.line("mean").unwrap_or_default()),
        );
    let error = table.column("run.energy_error")?.into_iter().fold(0.0, f64::max);
    let report = example.report_of_many().text(&table).with("rows", table.len());
    report
        .with("failed", table.failed())
        .with("remanence", at(quarter))
        .with("latest_jump", late)
        .with("worst_energy_error", error)
        .figure(figure)
        .print()
}
