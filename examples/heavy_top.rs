//! The heavy top, which rises: gravity, a torque that does no work, and two Casimirs, on se(3)*.
//!
//! A top with moments of inertia `I = (1, 1.2, 2)` stands on its tip with the axis `e₃` inclined by 60°
//! and spins about it. In its frame are the angular momentum `M` and the vertical `Γ`. With
//! `H = ½M·I⁻¹M + mgl Γ₃`, `mgl = 1`, `S = M·Γ`, and the form `κ = 0.1` on rotations, the forced
//! Euler-Poincaré equations on se(3)* (Bloch, Farré Puiggalí and Martín de Diego 2024, §3) are
//!
//! ```text
//! M' = M × Ω + mgl Γ × e₃ + κ Ω × (Γ × Ω),   Γ' = Γ × Ω,   S' = κ |Ω × Γ|² .
//! ```
//!
//! The momentum about the vertical, `S`, is a Casimir that the last torque increases without work. The
//! other Casimir, `|Γ|²`, is kept. The nutation dies out, the axis rises, and the top sleeps: upright,
//! with `S = √(2I₃(H − mgl))`, turning about the vertical.

use std::error::Error;

use metriplectic::manifolds::rotations;
use metriplectic::prelude::*;
use metriplectic_studies::{Gallery, Globe, Options, Panel, Panels, print, write_csv};

const INERTIA: Vector3<f64> = Vector3::new(1.0, 1.2, 2.0);
const WEIGHT: f64 = 1.0;
const FRICTION: f64 = 0.1;

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::read();
    let (count, h) = (options.steps_or(1200), options.step_size_or(0.05));

    let se3 = LieDual::se3();
    let form = Matrix6::from_diagonal(&vector![FRICTION, FRICTION, FRICTION, 0.0, 0.0, 0.0]);
    let torque = CasimirDissipation::new(se3.algebra(), form)?;
    let vertical = |x: &Vector6<Real>| (3..6).map(|i| x[i] * x[i]).sum::<Real>();
    let top = System::on(se3)
        .energy(|x: &Vector6<Real>| {
            (0..3).map(|i| x[i] * x[i] / (2.0 * INERTIA[i])).sum::<Real>() + x[5] * WEIGHT
        })
        .entropy(|x: &Vector6<Real>| x[0] * x[3] + x[1] * x[4] + x[2] * x[5])
        .dissipation(torque)
        .build()?;
    let inclined = rotations::exp(&vector![0.0, 60_f64.to_radians(), 0.0]);
    let gamma = inclined.row(2);
    let start = vector![0.0, 0.0, 4.0, gamma[0], gamma[1], gamma[2]];
    let run = WeylMidpoint.run(&top, start, Span::steps(h, count))?;
    let (certificate, end) = (run.certificate(), run.last());
    let energy = certificate.initial_energy;
    let asleep = (2.0 * INERTIA.z * (energy - WEIGHT)).sqrt();
    let length = |state: &State<LieDual<6>>| vertical(&state.point.cast()).re - 1.0;
    let length_error = run.iter().map(|state| length(state).abs()).fold(0.0, f64::max);

    // Where the axis points: R' = R Ω̂ with the angular velocity at the middle of each step.
    let axis = run.states().windows(2).scan(inclined, |r, pair| {
        let omega = (pair[0].point + pair[1].point).xyz().component_div(&INERTIA) * 0.5;
        *r *= rotations::exp(&(omega * h));
        Some(r.column(2).into_owned())
    });
    let gallery = Gallery::open()?;
    let panel = |title: &str, value: &dyn Fn(&State<LieDual<6>>) -> f64| {
        let points: Vec<_> = run.iter().map(|state| (state.time, value(state))).collect();
        Panel::new(title, "t").line(title, points)
    };
    Panels::new(format!("The heavy top on se(3)* rises and sleeps, h = {h}"))
        .columns(2)
        .globe(Globe::new("the axis in space, from ○ to ●").curve("R e₃", axis))
        .panel(panel("height Γ₃ of the axis", &|s| s.point[5]).level(1.0))
        .panel(panel("entropy S = M·Γ, dashed √(2I₃(H − mgl))", &|s| s.entropy).level(asleep))
        .panel(panel("energy H − H₀", &|s| s.energy - energy).level(0.0))
        .panel(panel("Casimir |Γ|² − 1", &length).level(0.0))
        .save(gallery.path("heavy_top.svg"))?;
    let rows =
        run.iter().map(|s| std::array::from_fn(|i| if i < 1 { s.time } else { s.point[i - 1] }));
    write_csv(gallery.path("heavy_top.csv"), ["t", "M1", "M2", "M3", "G1", "G2", "G3"], rows)?;

    if options.json {
        let mut report = serde_json::to_value(certificate)?;
        report["max_relative_energy_error"] = certificate.max_relative_energy_error().into();
        report["final_state"] = end.point.as_slice().into();
        report["casimir_error"] = length_error.into();
        report["entropy_asleep"] = asleep.into();
        print(report)?;
    } else {
        print(format_args!("{certificate}\nCasimir:     ||Γ|² − 1| ≤ {length_error:.1e}"))?;
        print(format_args!(
            "at t = {:.1}:  Γ₃ = {:.6}, S = {:.6}",
            end.time, end.point[5], end.entropy
        ))?;
        print(format_args!("asleep:      Γ₃ = 1, S = √(2I₃(H − mgl)) = {asleep:.6}"))?;
        print(format_args!("figure:      {}", gallery.path("heavy_top.svg").display()))?;
    }
    Ok(())
}
