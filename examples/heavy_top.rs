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
use metriplectic_studies::{Gallery, Globe, Options, Panel, Panels, Report, print};

const INERTIA: Vector3<f64> = Vector3::new(1.0, 1.2, 2.0);
type Top = LieDual<6>;

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::read();
    let (count, h) = (options.steps_or(1200), options.step_size_or(0.05));

    let spin = |m: &Vector3<Real>| m.component_mul(m).component_div(&INERTIA.cast()).sum() * 0.5;
    let form = Matrix6::from_diagonal(&vector![0.1, 0.1, 0.1, 0.0, 0.0, 0.0]);
    let torque = CasimirDissipation::new(LieDual::se3().algebra(), form)?;
    let square = |x: &Vector6<Real>| x[3] * x[3] + x[4] * x[4] + x[5] * x[5];
    let top = System::on(LieDual::se3())
        .energy(|x: &Vector6<Real>| spin(&x.xyz()) + x[5])
        .entropy(|x: &Vector6<Real>| x[0] * x[3] + x[1] * x[4] + x[2] * x[5])
        .casimir(square)
        .dissipation(torque)
        .build()?;
    let inclined = rotations::exp(&vector![0.0, 60_f64.to_radians(), 0.0]);
    let start = vector![0.0, 0.0, 4.0, inclined.m31, inclined.m32, inclined.m33];
    let run = WeylMidpoint.run(&top, start, Span::steps(h, count))?;
    let (certificate, end) = (run.certificate(), run.last());
    let energy = certificate.initial_energy;
    let asleep = (2.0 * INERTIA.z * (energy - 1.0)).sqrt();
    let casimir = |state: &State<Top>| square(&state.point.cast()).re - 1.0;

    // Where the axis points: R' = R Ω̂, with Ω at the middle of each step.
    let axis = run.states().windows(2).scan(inclined, |r, pair| {
        let momentum = (pair[0].point + pair[1].point).xyz() * 0.5;
        *r *= rotations::exp(&(momentum.component_div(&INERTIA) * h));
        Some(r.column(2).into_owned())
    });
    let gallery = Gallery::open()?;
    let panel = |title: &str, value: &dyn Fn(&State<Top>) -> f64| {
        let points: Vec<_> = run.iter().map(|state| (state.time, value(state))).collect();
        Panel::new(title, "t").line(title, points)
    };
    Panels::new(format!("The heavy top rises and sleeps, on se(3)*, h = {h}"))
        .columns(2)
        .globe(Globe::new("the axis in space, from ○ to ●").curve("R e₃", axis))
        .panel(panel("height Γ₃ of the axis", &|s| s.point[5]).level(1.0))
        .panel(panel("entropy S = M·Γ, dashed √(2I₃(H − mgl))", &|s| s.entropy).level(asleep))
        .panel(panel("energy H − H₀", &|s| s.energy - energy).level(0.0))
        .panel(panel("Casimir |Γ|² − 1", &casimir).level(0.0))
        .save(gallery.path("heavy_top.svg"))?;

    if options.json {
        let entropies = vec![end.entropy, asleep];
        Report::new(certificate, end)?.with("entropies", entropies).print()?;
    } else {
        print(certificate)?;
        print(format_args!("entropy:     S = {:.6}, asleep {asleep:.6}", end.entropy))?;
        print(format_args!("figure:      {}", gallery.path("heavy_top.svg").display()))?;
    }
    Ok(())
}
