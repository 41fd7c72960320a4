//! Rotations: energy, entropy and a metric on SO(3) are a whole system.
//!
//! The Nambu bracket is built from the entropy, which is its Casimir, and the dissipation from the
//! bi-invariant metric. In the body frame, `R' = R Ω̂` with
//! `Ω = dS × dH + |dH|² dS − (dH·dS) dH`, for `H = R₁₁ + 2R₂₂ + 3R₃₃ + ½R₁₂R₂₃` and
//! `S = R₁₃ − ½R₂₁ + ¼(R₃₁ + R₃₂)²`. The columns of `R` are the axes of the body, three curves on a
//! sphere; they come to rest where `S` is largest among the rotations of energy `H₀`.

use std::error::Error;

use metriplectic::manifolds::rotations;
use metriplectic::prelude::*;
use metriplectic_studies::{Example, Globe, Panels};

fn main() -> Result<(), Box<dyn Error>> {
    let frame = System::on(Rotations::bi_invariant())
        .bracket(Nambu::default())
        .energy(|r: &Matrix3<Real>| r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5)
        .entropy(|r: &Matrix3<Real>| r.m13 - r.m21 * 0.5 + (r.m31 + r.m32).powi(2) * 0.25)
        .build()?;
    let start = rotations::exp(&Vector3::new(0.3, -0.2, 0.5));

    let about = "A rotation relaxes on SO(3), with the Nambu bracket and the bi-invariant metric.";
    let example = Example::new(about, 200, 0.005);
    let run = example.run(&frame, start, example.span())?;

    let axis = |k: usize| run.states.iter().map(move |s| s.point.column(k).into_owned());
    let globe = Globe::new("the axes of the body, from ○ to ●");
    let globe = globe.curve("Re₁", axis(0)).curve("Re₂", axis(1)).curve("Re₃", axis(2));
    let title = format!("Relaxation on SO(3) with the Nambu bracket, h = {}", example.step_size);
    let figure = Panels::new(title)
        .globe(globe)
        .panel(run.panel("entropy S", |s| s.entropy))
        .panel(run.energy_error());
    let rows = run.states.iter().map(|s| {
        let [w, x, y, z] = Rotations.to_quaternion(&s.point);
        [s.time, w, x, y, z, s.energy, s.entropy]
    });
    example
        .report(&run)
        .table(["t", "q0", "q1", "q2", "q3", "energy", "entropy"], rows)
        .figure(figure)
        .print()
}
