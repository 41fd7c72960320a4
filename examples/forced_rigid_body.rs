//! The rigid body from its Lagrangian and a force: the Euler-Poincaré route to both laws.
//!
//! With the Lagrangian `l(Ω) = ½Σ I_iΩ_i²`, `I = (10, 5, 1)`, and a force `𝓕(Ω)`, the equations of Bloch, Farré Puiggalí
//! and Martín de Diego (2024), §3, are
//!
//! ```text
//! p' = (p + 𝓕) × Ω,   p = ∂l/∂Ω,   H = Ω·p − l,   S = ½|p|²,   S' = 𝓕·(Ω × p) .
//! ```
//!
//! They keep the energy whatever `𝓕` is. Three forces make entropy out of `k = Ω × p`, and bring the body to the spin about
//! the axis of largest inertia:
//!
//! * `𝓕 = k`, the force of a form `κ = 1`, has the equations of the flat metric;
//! * `𝓕 = e₁e₁ᵀk` is of a form too, but of no metric: `S' = k₁²` is of fourth order near the end, which it reaches like `1/t`;
//! * `𝓕 = k/√(1 + |k|²/m²)` is a closure of your own, an actuator that gives at most `m = 0.1`.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels};

const INERTIA: Vector3<f64> = Vector3::new(10.0, 5.0, 1.0);
const MOST: f64 = 0.1;
type Body = LieDual<3>;

fn main() -> Result<(), Box<dyn Error>> {
    let body = System::on(LieDual::so3())
        .lagrangian(|w: &Vector3<Real>| w.component_mul(w).dot(&INERTIA.cast()) * 0.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5);
    let friction = |kappa: Vector3<f64>| {
        CasimirDissipation::new(LieDual::so3().algebra(), Matrix3::from_diagonal(&kappa))
    };
    let actuator = |w: &Vector3<Real>| {
        let k = w.cross(&w.component_mul(&INERTIA.cast()));
        k * (k.norm_squared() * MOST.powi(-2) + 1.0).sqrt().recip()
    };
    let all = body.clone().dissipation(friction(vector![1.0, 1.0, 1.0])?).build()?;
    let one = body.clone().dissipation(friction(vector![1.0, 0.0, 0.0])?).build()?;
    let own = body.force(actuator).build()?;
    let start = Vector3::new(0.2, 0.1, 1.0);

    let about = "A rigid body from its Lagrangian and three forces, of which one is a closure.";
    let example = Example::new(about, 1000, 0.1);
    let all = example.run(&all, start, example.span())?;
    let one = example.run(&one, start, example.span())?;
    let own = example.run(&own, start, example.span())?;

    let three = |quantity: &str, value: &dyn Fn(&State<Body>) -> f64| {
        let panel = Panel::new(quantity, "t").line("κ = 1", all.series(value));
        panel.line("κ = e₁e₁ᵀ", one.series(value)).line("actuator", own.series(value))
    };
    let energy = all.certificate.initial_energy;
    let most = energy * INERTIA.x;
    let left = three("H I₁ − S, what is left", &|s| (most - s.entropy).abs()).logarithmic(1e-12);
    let title = format!("A rigid body from its Lagrangian and a force, h = {}", example.step_size);
    let figure = Panels::new(title)
        .columns(3)
        .panel(three("angular momentum p₁", &|s| s.point.x))
        .panel(three("angular momentum p₂", &|s| s.point.y))
        .panel(three("angular momentum p₃", &|s| s.point.z))
        .panel(three("energy H − H₀", &|s| s.energy - energy).level(0.0))
        .panel(three("entropy S", &|s| s.entropy).named_level("H I₁", most))
        .panel(left);
    example
        .report(&all)
        .certificate("about_one_axis", &one.certificate)
        .certificate("actuator", &own.certificate)
        .figure(figure)
        .print()
}
