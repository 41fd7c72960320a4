//! Relaxation on S²: without a bracket, entropy climbs along a level curve of the energy.
//!
//! `x' = K dS`, where `K = |dH|² G* − dH ⊗ dH` of the round metric annihilates `dH`, with
//! `H = ½ Σ D_i (x_i² + ⅔ x_i³)`, `D = (1, ½, ¼)`, and `S = x₃ + 0.3 x₁x₂`. The state starts
//! near the least entropy on the level curve `H = H₀` and comes to rest at the greatest, where `dS ∥ dH`.
//! The curve itself is the orbit of the same energy under the bracket of the area form,
//! `x' = x × dH`.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Globe, Panels};

fn energy(x: &Vector3<Real>) -> Real {
    let d = [1.0, 0.5, 0.25];
    (0..3).map(|i| (x[i].powi(2) + x[i].powi(3) * (2.0 / 3.0)) * (0.5 * d[i])).sum()
}

fn main() -> Result<(), Box<dyn Error>> {
    let relaxing = System::on(Sphere::<2>::round())
        .energy(energy)
        .entropy(|x: &Vector3<Real>| x.z + x.x * x.y * 0.3)
        .build()?;
    let start = Vector3::new(0.69, -0.4, -0.6).normalize();

    let about = "Relaxation on S²: the entropy climbs along a level curve of the energy.";
    let example = Example::new(about, 200, 0.1);
    let run = example.run(&relaxing, start, example.span())?;

    let spinning = System::on(Sphere::<2>::round()).bracket(AreaForm).energy(energy).build()?;
    let level = WeylMidpoint.run(&spinning, start, Span::steps(0.01, 2200))?;
    let highest = level.iter().map(|s| relaxing.entropy_at(&s.point)).fold(f64::MIN, f64::max);

    let globe = Globe::new("the state x(t), from ○ to ●")
        .seen_from([0.85, -0.5, 0.25])
        .level("H = H₀", level.iter().map(|s| s.point))
        .curve("x(t)", run.states.iter().map(|s| s.point));
    let title = format!("Relaxation on S², S = x₃ + 0.3 x₁x₂, h = {}", example.step_size);
    let figure = Panels::new(title)
        .globe(globe)
        .panel(run.panel("entropy S", |s| s.entropy).named_level("maximum on H = H₀", highest))
        .panel(run.energy_error());
    let rows = run.states.iter();
    let rows = rows.map(|s| [s.time, s.point.x, s.point.y, s.point.z, s.energy, s.entropy]);
    example
        .report(&run)
        .table(["t", "x1", "x2", "x3", "energy", "entropy"], rows)
        .figure(figure)
        .print()
}
