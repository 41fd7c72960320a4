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
use metriplectic_studies::{Gallery, Options, Panel, Panels, Report, print, write_csv};

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::read();
    let (count, h) = (options.steps_or(1200), options.step_size_or(0.05));

    let plane = Metric::field(|q: &Vector2<Real>| Matrix2::from_diagonal_element(q.y.powi(-2)));
    let (origin, mut deviation) = (Vector2::new(0.0, 1.0), 0.0_f64);
    let mut at = |angle: f64, t: f64| -> Result<(f64, f64), MetricError> {
        let (sine, cosine) = angle.sin_cos();
        let end = Riemannian::<Chart<2>>::end(&plane, &origin, &(Vector2::new(cosine, sine) * t))?;
        let exact = Vector2::new(cosine * t.sinh(), 1.0) / (t.cosh() - sine * t.sinh());
        deviation = deviation.max((end - exact).norm() / exact.norm());
        Ok((end.x, end.y))
    };
    let mut fan = Panel::new("g = 1/y²", "x").vertical("y").equal().level(0.0);
    for angle in (0..24).map(|k| TAU * f64::from(k) / 24.0) {
        let line: Result<Vec<_>, _> = (0..=30).map(|n| at(angle, 0.05 * f64::from(n))).collect();
        fan = fan.line("exp(tv), |v| = 1, t ≤ 3/2", line?);
    }
    for t in [0.5, 1.0, 1.5] {
        let circle = (0..=180).map(|k| at(TAU * f64::from(k) / 180.0, t));
        fan = fan.line("t = 1/2, 1, 3/2", circle.collect::<Result<Vec<_>, _>>()?);
    }

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
    let run = WeylMidpoint.run(&system, Vector3::new(1.0, 2.0, 0.5), Span::steps(h, count))?;
    let (certificate, [x, y, phi]) = (run.certificate(), run.last().point.into());

    let (gallery, energy) = (Gallery::open()?, certificate.initial_energy);
    let path: Vec<_> = run.iter().map(|s| (s.point.x, s.point.y)).collect();
    let entropy: Vec<_> = run.iter().map(|s| (s.time, s.entropy)).collect();
    let error: Vec<_> = run.iter().map(|s| (s.time, s.energy - energy)).collect();
    let spiral = Panel::new("the point of the tangent vector", "x").vertical("y").equal();
    Panels::new(format!("Metrics from closures, h = {h}"))
        .panel(fan)
        .panel(spiral.line("(x, y)", &path).line("start", &path[..1]))
        .panel(Panel::new("entropy S", "t").line("S", entropy))
        .panel(Panel::new("energy H − H₀", "t").line("H", error).level(0.0))
        .save(gallery.path("your_own_metric.svg"))?;
    let rows = run.iter().map(|s| [s.time, s.point.x, s.point.y, s.point.z, s.entropy]);
    write_csv(gallery.path("your_own_metric.csv"), ["t", "x", "y", "phi", "S"], rows)?;

    if options.json {
        let report = Report::new(certificate, run.last())?;
        return Ok(report.with("geodesic_deviation", deviation).print()?);
    }
    print(format_args!("{certificate}\nat the end:  (x, y, φ) = ({x:.6}, {y:.6}, {phi:.6})"))?;
    print(format_args!("half plane:  {deviation:.1e} off the closed form"))?;
    Ok(print(format_args!("figure:      {}", gallery.path("your_own_metric.svg").display()))?)
}
