//! The damped oscillator and its bath: friction of your own, beside a closed form.
//!
//! `x = (q, p, s)` with a bath of temperature 1, `H = ½p² + ½q² + s`, `S = s` and `K = (γ/w_s) b bᵀ`,
//! `b = (0, w_s, −w_p)`. It is made of the covector `w` that it has to annihilate: `dH` in the equations of
//! motion, a discrete gradient of `H` in a step (after Öttinger 2018). From `(2, 0, 0)`
//!
//! ```text
//! q' = p,   p' = −q − γ p,   s' = γ p²   have   s = 2 − ½p² − ½q²,   ω² = 1 − ¼γ²,
//! q = 2e^{−γt/2} (cos ωt + (γ/2ω) sin ωt),      p = −(2/ω) e^{−γt/2} sin ωt .
//! ```

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Order, Panel, Panels};

const GAMMA: f64 = 0.01;

fn main() -> Result<(), Box<dyn Error>> {
    let friction = |_: &Vector3<Real>, w: &Vector3<Real>| {
        let b = Vector3::new(0.0.into(), w.z, -w.y);
        b * b.transpose() * (w.z.recip() * GAMMA)
    };
    let oscillator = System::on(Euclidean::<3>)
        .bracket(Poisson::constant(matrix![0.0, 1.0, 0.0; -1.0, 0.0, 0.0; 0.0, 0.0, 0.0])?)
        .field_dissipation(friction)
        .energy(|x: &Vector3<Real>| (x.x.powi(2) + x.y.powi(2)) * 0.5 + x.z)
        .entropy(|x: &Vector3<Real>| x.z)
        .build()?;
    let start = exact(0.0);

    let about = "The damped oscillator and its bath: friction of your own, beside a closed form.";
    let example = Example::new(about, 1000, 0.1);
    let sizes = [1.0, 0.5, 0.25, 0.125].map(|part| part * example.step_size);
    let span = |k: usize| Span::steps(sizes[k], example.steps << k).at_most(1000);
    let runs = (0..4).map(|k| example.run(&oscillator, start, span(k)));
    let runs = runs.collect::<Result<Vec<_>, _>>()?;

    let error = |s: &State<Euclidean<3>>| (s.point - exact(s.time)).norm();
    let errors: Vec<f64> = runs.iter().map(|run| error(run.last())).collect();
    let (run, order) = (&runs[0], Order::fit(&sizes, &errors)?);
    let beside = |quantity: &str, i: usize, since: f64| {
        let late = |(t, _): &(f64, f64)| *t >= since * run.last().time;
        let closed: Vec<_> = run.series(|s| exact(s.time)[i]).into_iter().filter(late).collect();
        let scheme: Vec<_> = run.series(|s| s.point[i]).into_iter().filter(late).collect();
        Panel::new(quantity, "t").line("closed form", closed).line("scheme", scheme)
    };
    let mut distance = Panel::new("distance from the closed form", "t").logarithmic(1e-5);
    for (run, h) in runs.iter().zip(sizes) {
        distance = distance.line(format!("h = {h}"), run.series(error));
    }
    let title = format!("The damped oscillator, γ = {GAMMA}, h = {}", example.step_size);
    let figure = Panels::new(title)
        .panel(beside("position q", 0, 0.0))
        .panel(beside("momentum p", 1, 0.8).title("end of the run"))
        .panel(beside("entropy s", 2, 0.0).named_level("at rest", 2.0))
        .panel(distance);
    example.report(run).with("errors", errors).with("order", order.slope).figure(figure).print()
}

/// The exact state at time `t`.
fn exact(t: f64) -> Vector3<f64> {
    let omega = (1.0 - 0.25 * GAMMA * GAMMA).sqrt();
    let (amplitude, (sin, cos)) = (2.0 * (-0.5 * GAMMA * t).exp(), (omega * t).sin_cos());
    let (q, p) = (amplitude * (cos + 0.5 * GAMMA * sin / omega), -amplitude * sin / omega);
    Vector3::new(q, p, 2.0 - 0.5 * (p * p + q * q))
}
