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
use metriplectic_studies::{Gallery, Globe, Options, Panel, Panels, Report, print, write_csv};

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::read();
    let (count, h) = (options.steps_or(200), options.step_size_or(0.005));

    let frame = System::on(Rotations::bi_invariant())
        .bracket(Nambu::default())
        .energy(|r: &Matrix3<Real>| r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5)
        .entropy(|r: &Matrix3<Real>| r.m13 - r.m21 * 0.5 + (r.m31 + r.m32).powi(2) * 0.25)
        .build()?;
    let start = rotations::exp(&Vector3::new(0.3, -0.2, 0.5));
    let run = WeylMidpoint.run(&frame, start, Span::steps(h, count).every(count.div_ceil(2000)))?;
    let (certificate, end) = (run.certificate(), run.last());

    let gallery = Gallery::open()?;
    let axis = |k: usize| run.iter().map(move |s| s.point.column(k).into_owned());
    let panel = |title: &str, value: &dyn Fn(&State<Rotations>) -> f64| {
        let points: Vec<_> = run.iter().map(|state| (state.time, value(state))).collect();
        Panel::new(title, "t").line(title, points)
    };
    let globe = Globe::new("the axes of the body, from ○ to ●");
    Panels::new(format!("Relaxation on SO(3) with the Nambu bracket, h = {h}"))
        .globe(globe.curve("Re₁", axis(0)).curve("Re₂", axis(1)).curve("Re₃", axis(2)))
        .panel(panel("entropy S", &|s| s.entropy))
        .panel(panel("energy H − H₀", &|s| s.energy - certificate.initial_energy).level(0.0))
        .save(gallery.path("rotations.svg"))?;
    write_csv(
        gallery.path("rotations.csv"),
        ["t", "q0", "q1", "q2", "q3", "energy", "entropy"],
        run.iter().map(|s| {
            let [w, x, y, z] = Rotations.to_quaternion(&s.point);
            [s.time, w, x, y, z, s.energy, s.entropy]
        }),
    )?;

    if options.json {
        Report::new(certificate, end)?.print()?;
    } else {
        let [w, x, y, z] = Rotations.to_quaternion(&end.point);
        print(certificate)?;
        print(format_args!("at t = {:.1}:  q = ({w:.6}, {x:.6}, {y:.6}, {z:.6})", end.time))?;
        print(format_args!("figure:      {}", gallery.path("rotations.svg").display()))?;
    }
    Ok(())
}
