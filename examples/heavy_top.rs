//! The heavy top, which rises and sleeps: gravity, a torque without work, and two Casimirs, on se(3)*.
//!
//! A top, `I = (1, 1.2, 2)`, stands on its tip, inclined by 60°, and spins about its axis `e₃`. In its frame
//! are the angular momentum `M` and the vertical `Γ`. With `H = ½M·I⁻¹M + mgl Γ₃`, `mgl = 1`, `S = M·Γ`, and
//! the form `κ = 0.1` on rotations, the forced Euler-Poincaré equations (Bloch, Farré Puiggalí and Martín
//! de Diego 2024, §3) are, with `Ω = I⁻¹M`,
//!
//! ```text
//! M' = M × Ω + mgl Γ × e₃ + κ Ω × (Γ × Ω),   Γ' = Γ × Ω,   S' = κ |Ω × Γ|² .
//! ```
//!
//! The last torque does no work, and it increases the momentum `S` about the vertical, a Casimir, until the
//! top turns about the vertical: the nutation dies out, the axis rises, and the top sleeps upright with
//! `S = √(2I₃(H − mgl))`. The other Casimir, `|Γ|²`, is kept.

use std::error::Error;

use metriplectic::manifolds::rotations;
use metriplectic::prelude::*;
use metriplectic_studies::{Example, Globe, Panels};

const INERTIA: Vector3<f64> = Vector3::new(1.0, 1.2, 2.0);

fn main() -> Result<(), Box<dyn Error>> {
    let spin = |m: &Vector3<Real>| m.component_mul(m).component_div(&INERTIA.cast()).sum() * 0.5;
    let square = |x: &Vector6<Real>| x[3] * x[3] + x[4] * x[4] + x[5] * x[5];
    let form = Matrix6::from_diagonal(&vector![0.1, 0.1, 0.1, 0.0, 0.0, 0.0]);
    let top = System::on(LieDual::se3())
        .energy(|x: &Vector6<Real>| spin(&x.xyz()) + x[5])
        .entropy(|x: &Vector6<Real>| x[0] * x[3] + x[1] * x[4] + x[2] * x[5])
        .casimir(square)
        .dissipation(CasimirDissipation::new(LieDual::se3().algebra(), form)?)
        .build()?;
    let inclined = rotations::exp(&vector![0.0, 60_f64.to_radians(), 0.0]);
    let start = vector![0.0, 0.0, 4.0, inclined.m31, inclined.m32, inclined.m33];

    let about = "A heavy top rises and sleeps: gravity, a torque without work, two Casimirs.";
    let example = Example::new(about, 1200, 0.05);
    let run = example.run(&top, start, Span::steps(example.step_size, example.steps))?;

    let asleep = (2.0 * INERTIA.z * (run.certificate.initial_energy - 1.0)).sqrt();
    // Where the axis points: R' = R Ω̂, with Ω at the middle of each step.
    let axis = run.states.windows(2).scan(inclined, |r, pair| {
        let momentum = (pair[0].point + pair[1].point).xyz() * 0.5;
        *r *= rotations::exp(&(momentum.component_div(&INERTIA) * example.step_size));
        Some(r.column(2).into_owned())
    });
    let casimir = run.panel("Casimir |Γ|² − 1", |s| square(&s.point.cast()).re - 1.0);
    let title = format!("The heavy top rises and sleeps, on se(3)*, h = {}", example.step_size);
    let figure = Panels::new(title)
        .columns(2)
        .globe(Globe::new("the axis in space, from ○ to ●").curve("R e₃", axis))
        .panel(run.panel("height Γ₃ of the axis", |s| s.point[5]).named_level("upright", 1.0))
        .panel(run.panel("entropy S = M·Γ", |s| s.entropy).named_level("√(2I₃(H − mgl))", asleep))
        .panel(run.energy_error())
        .panel(casimir.level(0.0));
    let entropies = vec![run.last().entropy, asleep];
    example.report(&run).with("entropies", entropies).figure(figure).print()
}
