//! Relaxation on S²: without a bracket, entropy climbs along a level curve of the energy.
//!
//! `x' = K dS`, where `K = |dH|² G* − dH ⊗ dH` of the round metric annihilates `dH`, with
//! `H = ½ Σ D_i (x_i² + ⅔ x_i³)`, `D = (1, ½, ¼)`, and `S = x₃ + 0.3 x₁x₂`. The state starts
//! near the least entropy on the level curve `H = H₀` and comes to rest at the greatest, where `dS ∥ dH`.
//! The curve itself is the orbit of the same energy under the bracket of the area form,
//! `x' = x × dH`.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Gallery, Globe, Options, Panel, Panels, Report, print, write_csv};

fn energy(x: &Vector3<Real>) -> Real {
    let d = [1.0, 0.5, 0.25];
    (0..3).map(|i| (x[i].powi(2) + x[i].powi(3) * (2.0 / 3.0)) * (0.5 * d[i])).sum()
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::read();
    let (count, h) = (options.steps_or(200), options.step_size_or(0.1));

    let relaxing = System::on(Sphere::<2>::round())
        .energy(energy)
        .entropy(|x: &Vector3<Real>| x.z + x.x * x.y * 0.3)
        .build()?;
    let start = Vector3::new(0.69, -0.4, -0.6).normalize();
    let span = Span::steps(h, count).every(count.div_ceil(2000));
    let run = WeylMidpoint.run(&relaxing, start, span)?;
    let (certificate, end) = (run.certificate(), run.last());

    let spinning = System::on(Sphere::<2>::round()).bracket(AreaForm).energy(energy).build()?;
    let level = WeylMidpoint.run(&spinning, start, Span::steps(0.01, 2200))?;
    let highest = level.iter().map(|s| relaxing.entropy_at(&s.point)).fold(f64::MIN, f64::max);

    let gallery = Gallery::open()?;
    let panel = |title: &str, value: &dyn Fn(&State<Sphere<2>>) -> f64| {
        let points: Vec<_> = run.iter().map(|state| (state.time, value(state))).collect();
        Panel::new(title, "t").line(title, points)
    };
    let globe = Globe::new("the state x(t), from ○ to ●")
        .seen_from([0.85, -0.5, 0.25])
        .level("H = H₀", level.iter().map(|s| s.point))
        .curve("x(t)", run.iter().map(|s| s.point));
    Panels::new(format!("Relaxation on S², S = x₃ + 0.3 x₁x₂, h = {h}"))
        .globe(globe)
        .panel(panel("entropy S, its maximum on H = H₀", &|s| s.entropy).level(highest))
        .panel(panel("energy H − H₀", &|s| s.energy - certificate.initial_energy).level(0.0))
        .save(gallery.path("sphere_relaxation.svg"))?;
    write_csv(
        gallery.path("sphere_relaxation.csv"),
        ["t", "x1", "x2", "x3", "energy", "entropy"],
        run.iter().map(|s| [s.time, s.point.x, s.point.y, s.point.z, s.energy, s.entropy]),
    )?;

    if options.json {
        Report::new(certificate, end)?.print()?;
    } else {
        let (t, [x, y, z]): (f64, [f64; 3]) = (end.time, end.point.into());
        print(format_args!("{certificate}\nat t = {t:.1}:  x = ({x:.6}, {y:.6}, {z:.6})"))?;
        print(format_args!("figure:      {}", gallery.path("sphere_relaxation.svg").display()))?;
    }
    Ok(())
}
