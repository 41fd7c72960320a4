//! Your own metric: geodesics, and a metriplectic run, from the closure of a matrix.
//!
//! On the upper half plane with `g = 1/y²` the geodesics from `(0, 1)` at the angle `θ` are
//! `γ(t) = (cos θ sinh t, 1)/(cosh t − sin θ sinh t)`, semicircles about the edge `y = 0`.
//!
//! The unit tangent vectors of the plane, at `(x, y)` with the angle `φ`, have the orthonormal coframe
//! `dx/y`, `dy/y`, `dφ + dx/y`, one of Thurston's geometries (Scott 1983): a matrix that is not
//! diagonal. On it `S = −(x² + y² + 1)/2y − ½φ²` is the Casimir of the Nambu bracket with `λ = 4`, and
//! with `H = ¼(φ + ½x)` the state circles about the greatest entropy of its energy, and sinks in.

use std::error::Error;
use std::f64::consts::TAU;

use metriplectic::manifolds::{MetricError, Riemannian};
use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels};

fn main() -> Result<(), Box<dyn Error>> {
    let plane = Metric::field(|q: &Vector2<Real>| Matrix2::from_diagonal_element(q.y.powi(-2)));
    let tangent_vectors = Metric::field(|q: &Vector3<Real>| {
        let [zero, one, curve] = [0.0.into(), 1.0.into(), q.y.recip()];
        let coframe = Matrix3::new(curve, zero, zero, zero, curve, zero, curve, zero, one);
        coframe.tr_mul(&coframe)
    });
    let system = System::on(Chart::<3>::new(|q| q.y > 0.0))
        .metric(tangent_vectors)
        .bracket(Nambu::default().times(4.0))
        .energy(|q: &Vector3<Real>| (q.z + q.x * 0.5) * 0.25)
        .entropy(|q: &Vector3<Real>| (q.xy().norm_squared() + 1.0) / q.y * -0.5 - q.z * q.z * 0.5)
        .build()?;
    let start = Vector3::new(1.0, 2.0, 0.5);

    let about = "Geodesics, and a metriplectic run, from the closure of a metric.";
    let example = Example::new(about, 1200, 0.05);
    let span = Span::steps(example.step_size, example.steps);
    let run = example.run_with(Scheme::new(ChartMidpoint), &system, start, span)?;

    let (origin, mut deviation) = (Vector2::new(0.0, 1.0), 0.0_f64);
    let mut at = |angle: f64, t: f64| -> Result<(f64, f64), MetricError> {
        let (sine, cosine) = angle.sin_cos();
        let end = Riemannian::<Chart<2>>::end(&plane, &origin, &(Vector2::new(cosine, sine) * t))?;
        let exact = Vector2::new(cosine * t.sinh(), 1.0) / (t.cosh() - sine * t.sinh());
        deviation = deviation.max((end - exact).norm() / exact.norm());
        Ok((end.x, end.y))
    };
    let mut fan = Panel::new("y", "x").equal().level(0.0);
    for angle in (0..24).map(|k| TAU * f64::from(k) / 24.0) {
        let line: Result<Vec<_>, _> = (0..=30).map(|n| at(angle, 0.05 * f64::from(n))).collect();
        fan = fan.line("exp(tv), |v| = 1, t ≤ 3/2", line?);
    }
    for t in [0.5, 1.0, 1.5] {
        let circle = (0..=180).map(|k| at(TAU * f64::from(k) / 180.0, t));
        fan = fan.line("t = 1/2, 1, 3/2", circle.collect::<Result<Vec<_>, _>>()?);
    }
    let path: Vec<_> = run.states.iter().map(|s| (s.point.x, s.point.y)).collect();
    let figure = Panels::new(format!("Metrics from closures, h = {}", example.step_size))
        .panel(fan)
        .panel(Panel::new("y", "x").equal().line("(x, y)", &path).line("start", &path[..1]))
        .panel(run.panel("entropy S", |s| s.entropy))
        .panel(run.energy_error());
    let rows = run.states.iter().map(|s| [s.time, s.point.x, s.point.y, s.point.z, s.entropy]);
    example
        .report(&run)
        .with("geodesic_deviation", deviation)
        .table(["t", "x", "y", "phi", "S"], rows)
        .figure(figure)
        .print()
}
