//! The relaxing rigid body: three closures, both laws of thermodynamics.
//!
//! A body with moments of inertia `I = (10, 5, 1)` turns about its middle axis, which is unstable.
//! Its angular momentum `p` lives on so(3)*, with `H = ½Σp_i²/I_i`, `S = |p|²/2`, and
//! `p' = p × dH + |dH|² dS − (dH·dS) dH`, the example of Bloch, Farré Puiggalí and Martín de Diego
//! (2024), §4.3. The energy is kept, the entropy climbs to its maximum `H I₁`, and the body ends up
//! turning about its axis of largest inertia. The figure is the paper's, with the energy's error.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panels};

const INERTIA: Vector3<f64> = Vector3::new(10.0, 5.0, 1.0);

fn main() -> Result<(), Box<dyn Error>> {
    let body = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| {
            (p.x * p.x / INERTIA.x + p.y * p.y / INERTIA.y + p.z * p.z / INERTIA.z) * 0.5
        })
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .build()?;
    let start = Vector3::new(0.001, -1.0, 0.001);

    let about = "A rigid body turns over and comes to rest: energy is conserved, entropy grows.";
    let example = Example::new(about, 1000, 0.1);
    let run = example.run(&body, start, example.span())?;

    let maximum = run.certificate.initial_energy * INERTIA.x;
    let title = format!("The relaxing rigid body, I = (10, 5, 1), h = {}", example.step_size);
    let figure = Panels::new(title)
        .columns(3)
        .panel(run.panel("angular momentum p₁", |s| s.point.x))
        .panel(run.panel("angular momentum p₂", |s| s.point.y))
        .panel(run.panel("angular momentum p₃", |s| s.point.z))
        .panel(run.energy_error())
        .panel(run.panel("entropy S", |s| s.entropy).named_level("maximum H I₁", maximum));
    let rows = run.states.iter();
    let rows = rows.map(|s| [s.time, s.point.x, s.point.y, s.point.z, s.energy, s.entropy]);
    example
        .report(&run)
        .text(format_args!("at rest:     |p₁| = √(2HI₁) = {:.6}", (2.0 * maximum).sqrt()))
        .table(["t", "p1", "p2", "p3", "energy", "entropy"], rows)
        .figure(figure)
        .print()
}
