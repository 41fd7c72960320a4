//! The damped oscillator and its bath: friction of your own, against a closed form.
//!
//! `x = (q, p, s)` with `H = ½p² + ½q² + T s`, `T = 1`, `S = s`, and `K = (γ/w_s) b bᵀ`,
//! `b = (0, w_s, −w_p)`, written for the covector `w` that it has to kill: `w = dH` in the equations
//! of motion and a discrete gradient of `H` in a step (Öttinger 2018). For `w = dH`
//!
//! ```text
//! q' = p,   p' = −q − γ p,   s' = γ p²/T :
//! q = 2e^{−γt/2} (cos ωt + (γ/2ω) sin ωt),   p = −2e^{−γt/2} sin ωt / ω,   ω² = 1 − γ²/4 ,
//! ```
//!
//! and `s = (2 − ½p² − ½q²)/T`. The errors at four step sizes fall with the square of the step.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Gallery, Options, Order, Panel, Panels, print, write_csv};

const FRICTION: f64 = 0.01;
const TEMPERATURE: f64 = 1.0;

/// The exact `(q, p, s)` at time `t`, from `(2, 0, 0)`.
fn exact(t: f64) -> Vector3<f64> {
    let omega = (1.0 - 0.25 * FRICTION * FRICTION).sqrt();
    let (amplitude, (sin, cos)) = (2.0 * (-0.5 * FRICTION * t).exp(), (omega * t).sin_cos());
    let q = amplitude * (cos + FRICTION * sin / (2.0 * omega));
    let p = -amplitude * sin / omega;
    Vector3::new(q, p, (2.0 - 0.5 * (p * p + q * q)) / TEMPERATURE)
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::read();
    let (count, h) = (options.steps_or(1000), options.step_size_or(0.1));

    let friction = |_: &Vector3<Real>, w: &Vector3<Real>| {
        let b = Vector3::new(0.0.into(), w.z, -w.y);
        b * b.transpose() * (w.z.recip() * FRICTION)
    };
    let oscillator = System::on(Euclidean::<3>)
        .bracket(Poisson::constant(matrix![0.0, 1.0, 0.0; -1.0, 0.0, 0.0; 0.0, 0.0, 0.0])?)
        .dissipation(FieldDissipation(friction))
        .energy(|x: &Vector3<Real>| (x.x.powi(2) + x.y.powi(2)) * 0.5 + x.z * TEMPERATURE)
        .entropy(|x: &Vector3<Real>| x.z)
        .build()?;
    let start = exact(0.0);
    let (start, sizes) = (exact(0.0), [1, 2, 4, 8].map(|parts| h / f64::from(parts)));
    let span = |h: f64, parts: usize| Span::steps(h, parts * count).at_most(1000);
    let runs = (0..4).map(|k| WeylMidpoint.run(&oscillator, start, span(sizes[k], 1 << k)));
    let runs = runs.collect::<Result<Vec<_>, _>>()?;
    let error = |s: &State<Euclidean<3>>| (s.point - exact(s.time)).norm();
    let errors: Vec<f64> = runs.iter().map(|run| error(run.last())).collect();
    let (run, order) = (&runs[0], Order::fit(&sizes, &errors)?);
    let (certificate, end) = (run.certificate(), run.last());

    let gallery = Gallery::open()?;
    let line = |value: &dyn Fn(&State<Euclidean<3>>) -> f64| -> Vec<_> {
        run.iter().map(|state| (state.time, value(state))).collect()
    };
    let beside = |title: &str, i: usize| {
        let panel = Panel::new(title, "t").line("closed form", line(&|s| exact(s.time)[i]));
        panel.line("scheme", line(&|s| s.point[i]))
    };
    let mut distance = Panel::new("distance from the closed form", "t").logarithmic(1e-6);
    for (run, h) in runs.iter().zip(sizes) {
        let points: Vec<_> = run.iter().map(|state| (state.time, error(state))).collect();
        distance = distance.line(format!("h = {h}"), points);
    }
    Panels::new(format!("The damped oscillator and its bath, γ = {FRICTION}, h = {h}"))
        .columns(2)
        .panel(beside("position q", 0))
        .panel(beside("momentum p", 1))
        .panel(beside("entropy s of the bath, at rest H/T", 2).level(2.0 / TEMPERATURE))
        .panel(distance)
        .save(gallery.path("damped_oscillator.svg"))?;
    let rows = run.iter().map(|s| [s.time, s.point.x, s.point.y, s.point.z, error(s)]);
    write_csv(gallery.path("damped_oscillator.csv"), ["t", "q", "p", "s", "error"], rows)?;

    if options.json {
        let mut report = serde_json::to_value(certificate)?;
        report["max_relative_energy_error"] = certificate.max_relative_energy_error().into();
        report["final_state"] = end.point.as_slice().into();
        report["step_sizes"] = sizes.as_slice().into();
        report["errors"] = errors.into();
        report["order"] = order.slope.into();
        print(report)?;
    } else {
        let [q, p, s]: [f64; 3] = end.point.into();
        print(format_args!(
            "{certificate}\nat t = {:.1}:  (q, p, s) = ({q:.6}, {p:.6}, {s:.6})",
            end.time
        ))?;
        print(format_args!("errors:       {errors:.1?} at h = {sizes:?}, order {order}"))?;
        print(format_args!("figure:       {}", gallery.path("damped_oscillator.svg").display()))?;
    }
    Ok(())
}
