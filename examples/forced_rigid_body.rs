//! The relaxing rigid body from its Lagrangian and a force: the Euler-Poincaré route, and what it adds.
//!
//! With the reduced Lagrangian `l(Ω) = ½Σ I_i Ω_i²` of a body with `I = (10, 5, 1)` and the force
//! `F = κ(Ω × p)` of a positive semidefinite form `κ`, the forced Euler-Poincaré equations (Bloch, Farré
//! Puiggalí and Martín de Diego 2024, §3) are
//!
//! ```text
//! p' = (p + F) × Ω,   p = ∂l/∂Ω = IΩ,   H = Ω·p − l,   (½|p|²)' = κ(Ω × p, Ω × p) ≥ 0 .
//! ```
//!
//! They keep the energy whatever `κ` is. With `κ = 1` they are the metriplectic system of the flat
//! metric, and the two routes agree to round-off. A force about the first axis alone, `κ = e₁e₁ᵀ`, is no
//! metric's: the body takes another way to the same end, the axis of largest inertia.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Gallery, Options, Panel, Panels, print, write_csv};

const INERTIA: Vector3<f64> = Vector3::new(10.0, 5.0, 1.0);
const START: Vector3<f64> = Vector3::new(0.2, 0.1, 1.0);

/// The body relaxed by the force of the form `κ`.
fn forced(
    kappa: Matrix3<f64>,
) -> Result<impl Metriplectic<Manifold = LieDual<3>, Metric = Canonical>, Box<dyn Error>> {
    let so3 = LieDual::so3();
    let force = CasimirDissipation::new(so3.algebra(), kappa)?;
    Ok(System::on(so3)
        .lagrangian(|omega: &Vector3<Real>| omega.component_mul(omega).dot(&INERTIA.cast()) * 0.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .dissipation(force)
        .build()?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::read();
    let (count, h) = (options.steps_or(500), options.step_size_or(0.1));

    let metric = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.component_mul(p).component_div(&INERTIA.cast()).sum() * 0.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .build()?;
    let span = Span::steps(h, count).at_most(2000);
    let metric = WeylMidpoint.run(&metric, START, span)?;
    let whole = WeylMidpoint.run(&forced(Matrix3::identity())?, START, span)?;
    let about_e1 = Matrix3::from_diagonal(&vector![1.0, 0.0, 0.0]);
    let single = WeylMidpoint.run(&forced(about_e1)?, START, span)?;
    let (certificate, end) = (whole.certificate(), whole.last());
    let energy = certificate.initial_energy;
    let top = energy * INERTIA.x;
    let apart: Vec<_> =
        metric.iter().zip(&whole).map(|(a, b)| (a.time, (a.point - b.point).norm())).collect();
    let difference = apart.iter().map(|(_, off)| *off).fold(0.0, f64::max);

    let gallery = Gallery::open()?;
    let line = |run: &Trajectory<LieDual<3>>,
                value: &dyn Fn(&State<LieDual<3>>) -> f64|
     -> Vec<_> { run.iter().map(|state| (state.time, value(state))).collect() };
    let momenta = |title: &str, run: &Trajectory<LieDual<3>>| {
        let panel = Panel::new(title, "t").line("p₁", line(run, &|s| s.point.x));
        panel.line("p₂", line(run, &|s| s.point.y)).line("p₃", line(run, &|s| s.point.z))
    };
    let pair = |title: &str, value: &dyn Fn(&State<LieDual<3>>) -> f64| {
        let panel = Panel::new(title, "t").line("κ = 1", line(&whole, value));
        panel.line("κ = e₁e₁ᵀ", line(&single, value))
    };
    Panels::new(format!("The rigid body from its Lagrangian and a force, I = (10, 5, 1), h = {h}"))
        .columns(2)
        .panel(momenta("κ = 1", &whole))
        .panel(momenta("κ = e₁e₁ᵀ", &single))
        .panel(pair("entropy S, maximum H I₁", &|s| s.entropy).level(top))
        .panel(pair("energy H − H₀", &|s| s.energy - energy).level(0.0))
        .panel(Panel::new("|p − p of the metric|, κ = 1", "t").line("", apart))
        .save(gallery.path("forced_rigid_body.svg"))?;
    write_csv(
        gallery.path("forced_rigid_body.csv"),
        ["t", "p1", "p2", "p3", "q1", "q2", "q3"],
        whole.iter().zip(&single).map(|(a, b)| {
            [a.time, a.point.x, a.point.y, a.point.z, b.point.x, b.point.y, b.point.z]
        }),
    )?;

    if options.json {
        let mut report = serde_json::to_value(certificate)?;
        report["max_relative_energy_error"] = certificate.max_relative_energy_error().into();
        report["final_state"] = end.point.as_slice().into();
        report["difference_of_the_routes"] = difference.into();
        report["about_one_axis"] = serde_json::to_value(single.certificate())?;
        report["final_state_about_one_axis"] = single.last().point.as_slice().into();
        print(report)?;
    } else {
        print(format_args!("κ = 1\n{certificate}\nκ = e₁e₁ᵀ\n{}", single.certificate()))?;
        print(format_args!(
            "at t = {:.1}:  S = {:.6} and {:.6}, at rest {top:.6}",
            end.time,
            end.entropy,
            single.last().entropy
        ))?;
        print(format_args!("routes:      |p − p of the metric| ≤ {difference:.1e}"))?;
        print(format_args!("figure:      {}", gallery.path("forced_rigid_body.svg").display()))?;
    }
    Ok(())
}
