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
use metriplectic_studies::{Example, Panel, Panels};

const INERTIA: Vector3<f64> = Vector3::new(10.0, 5.0, 1.0);
type Body = LieDual<3>;

fn main() -> Result<(), Box<dyn Error>> {
    let entropy = |p: &Vector3<Real>| p.norm_squared() * 0.5;
    let forced = |kappa: Vector3<f64>| -> Result<_, Box<dyn Error>> {
        let form = Matrix3::from_diagonal(&kappa);
        let body = System::on(LieDual::so3())
            .lagrangian(|w: &Vector3<Real>| w.component_mul(w).dot(&INERTIA.cast()) * 0.5)
            .dissipation(CasimirDissipation::new(LieDual::so3().algebra(), form)?)
            .entropy(entropy)
            .build()?;
        Ok(body)
    };
    let flat = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.component_mul(p).component_div(&INERTIA.cast()).sum() * 0.5)
        .entropy(entropy)
        .build()?;
    let start = Vector3::new(0.2, 0.1, 1.0);

    let about = "A rigid body from its Lagrangian and a force, beside one from its metric.";
    let example = Example::new(about, 1000, 0.1);
    let all = example.run(&forced(vector![1.0, 1.0, 1.0])?, start, example.span())?;
    let one = example.run(&forced(vector![1.0, 0.0, 0.0])?, start, example.span())?;
    let metric = example.run(&flat, start, example.span())?;

    let distance = |(a, b): (&State<Body>, &State<Body>)| (a.time, (a.point - b.point).norm());
    let apart: Vec<_> = all.states.iter().zip(&metric.states).map(distance).collect();
    let worst = apart.iter().fold(0.0, |worst: f64, (_, off)| worst.max(*off));
    let both = |quantity: &str, value: &dyn Fn(&State<Body>) -> f64| {
        let panel = Panel::new(quantity, "t").line("κ = 1", all.series(value));
        panel.line("κ = e₁e₁ᵀ", one.series(value))
    };
    let energy = all.certificate.initial_energy;
    let title =
        format!("The rigid body from its Lagrangian and a force, h = {}", example.step_size);
    let figure = Panels::new(title)
        .columns(3)
        .panel(both("angular momentum p₁", &|s| s.point.x))
        .panel(both("angular momentum p₂", &|s| s.point.y))
        .panel(both("angular momentum p₃", &|s| s.point.z))
        .panel(both("energy H − H₀", &|s| s.energy - energy).level(0.0))
        .panel(both("entropy S", &|s| s.entropy).named_level("H I₁", energy * INERTIA.x))
        .panel(Panel::new("|p − p of the metric|", "t").logarithmic(1e-17).line("κ = 1", apart));
    example
        .report(&all)
        .with("apart", worst)
        .certificate("about_one_axis", &one.certificate)
        .figure(figure)
        .print()
}
