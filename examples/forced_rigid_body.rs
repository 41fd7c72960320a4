//! The rigid body from its Lagrangian and a force: the Euler-Poincaré route to both laws.
//!
//! With the Lagrangian `l(Ω) = ½Σ I_iΩ_i²`, `I = (10, 5, 1)`, and the force `F = κ(Ω × p)` of a positive
//! semidefinite form `κ`, the equations of Bloch, Farré Puiggalí and Martín de Diego (2024), §3, are
//!
//! ```text
//! p' = (p + F) × Ω,   p = ∂l/∂Ω,   H = Ω·p − l,   S = ½|p|²,   S' = κ(Ω × p, Ω × p) ≥ 0 .
//! ```
//!
//! They keep the energy whatever `κ` is. With `κ = 1` they are those of the flat metric, and a step is the
//! same to round-off. A force about one axis, `κ = e₁e₁ᵀ`, is not that of a metric: `S' = (p₂p₃)²(1/I₂ − 1/I₃)²`
//! is of fourth order near the last spin, about the axis of largest inertia, which it reaches like `1/t`.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Gallery, Options, Panel, Panels, Report, print};

const INERTIA: Vector3<f64> = Vector3::new(10.0, 5.0, 1.0);
const START: Vector3<f64> = Vector3::new(0.2, 0.1, 1.0);
type Body = LieDual<3>;

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::read();
    let (count, h) = (options.steps_or(1000), options.step_size_or(0.1));

    let entropy = |p: &Vector3<Real>| p.norm_squared() * 0.5;
    let span = Span::steps(h, count).at_most(2001);
    let forced = |kappa: Vector3<f64>| -> Result<Trajectory<Body>, Box<dyn Error>> {
        let form = Matrix3::from_diagonal(&kappa);
        let body = System::on(LieDual::so3())
            .lagrangian(|w: &Vector3<Real>| w.component_mul(w).dot(&INERTIA.cast()) * 0.5)
            .dissipation(CasimirDissipation::new(LieDual::so3().algebra(), form)?)
            .entropy(entropy)
            .build()?;
        Ok(WeylMidpoint.run(&body, START, span)?)
    };
    let (all, one) = (forced(vector![1.0, 1.0, 1.0])?, forced(vector![1.0, 0.0, 0.0])?);
    let flat = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.component_mul(p).component_div(&INERTIA.cast()).sum() * 0.5)
        .entropy(entropy)
        .build()?;
    let metric = WeylMidpoint.run(&flat, START, span)?;
    let distance = |(a, b): (&State<Body>, &State<Body>)| (a.time, (a.point - b.point).norm());
    let apart: Vec<_> = all.iter().zip(&metric).map(distance).collect();
    let worst = apart.iter().fold(0.0, |worst: f64, (_, off)| worst.max(*off));

    let (gallery, certificate) = (Gallery::open()?, all.certificate());
    let energy = certificate.initial_energy;
    let line = |run: &Trajectory<Body>, value: &dyn Fn(&State<Body>) -> f64| -> Vec<_> {
        run.iter().map(|state| (state.time, value(state))).collect()
    };
    let both = |title: &str, value: &dyn Fn(&State<Body>) -> f64| {
        let panel = Panel::new(title, "t").line("κ = 1", line(&all, value));
        panel.line("κ = e₁e₁ᵀ", line(&one, value))
    };
    Panels::new(format!("The rigid body from its Lagrangian and a force, I = (10, 5, 1), h = {h}"))
        .columns(3)
        .panel(both("p₁", &|s| s.point.x))
        .panel(both("p₂", &|s| s.point.y))
        .panel(both("p₃", &|s| s.point.z))
        .panel(both("energy H − H₀", &|s| s.energy - energy).level(0.0))
        .panel(both("entropy S, maximum H I₁", &|s| s.entropy).level(energy * INERTIA.x))
        .panel(Panel::new("κ = 1: |p − p of the metric|", "t").logarithmic(1e-17).line("", apart))
        .save(gallery.path("forced_rigid_body.svg"))?;

    if options.json {
        let report = Report::new(certificate, all.last())?.with("apart", worst);
        report.with("about_one_axis", serde_json::to_value(one.certificate())?).print()?;
    } else {
        print(format_args!("κ = 1\n{certificate}\nκ = e₁e₁ᵀ\n{}", one.certificate()))?;
        print(format_args!("routes:      |p − p of the metric| ≤ {worst:.1e}"))?;
        print(format_args!("figure:      {}", gallery.path("forced_rigid_body.svg").display()))?;
    }
    Ok(())
}
