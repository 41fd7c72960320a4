//! The relaxing rigid body: three closures, both laws of thermodynamics.
//!
//! A body with moments of inertia `I = (10, 5, 1)` turns about its middle axis, which is unstable.
//! Its angular momentum `p` lives on so(3)*, with `H = ½Σp_i²/I_i`, `S = |p|²/2`, and
//! `p' = p × dH + |dH|² dS − (dH·dS) dH`, the example of Bloch, Farré Puiggalí and Martín de Diego
//! (2024), §4.3. The energy is kept, the entropy climbs to its maximum `H I₁`, and the body ends up
//! turning about its axis of largest inertia. The figure is the paper's, with the energy's error.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Gallery, Options, Panel, Panels, Progress, Report, print, write_csv};

const INERTIA: Vector3<f64> = Vector3::new(10.0, 5.0, 1.0);
const START: Vector3<f64> = Vector3::new(0.001, -1.0, 0.001);
/// States that the figure and the data file hold, at most.
const RECORDED: usize = 2000;

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::read();
    let (count, h) = (options.steps_or(1000), options.step_size_or(0.1));

    let body = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.component_mul(p).component_div(&INERTIA.cast()).sum() * 0.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .build()?;
    let mut steps = WeylMidpoint.steps(&body, START, h)?;
    let mut states = vec![steps.state().clone()];
    let mut progress = Progress::over(count);
    let span = Span::steps(h, count).at_most(RECORDED);
    for step in 1..=count {
        let state = steps.advance()?;
        if span.records(step) {
            states.push(state.clone());
        }
        progress.step();
    }
    let (certificate, end) = (steps.certificate(), steps.state());

    let (gallery, energy) = (Gallery::open()?, certificate.initial_energy);
    let panel = |title: &str, value: &dyn Fn(&State<LieDual<3>>) -> f64| {
        let points: Vec<_> = states.iter().map(|state| (state.time, value(state))).collect();
        Panel::new(title, "t").line(title, points)
    };
    Panels::new(format!("The relaxing rigid body, I = (10, 5, 1), h = {h}"))
        .columns(3)
        .panel(panel("p₁", &|state| state.point.x))
        .panel(panel("p₂", &|state| state.point.y))
        .panel(panel("p₃", &|state| state.point.z))
        .panel(panel("energy H − H₀", &|state| state.energy - energy).level(0.0))
        .panel(panel("entropy S, maximum H I₁", &|s| s.entropy).level(energy * INERTIA.x))
        .save(gallery.path("relaxing_rigid_body.svg"))?;
    write_csv(
        gallery.path("relaxing_rigid_body.csv"),
        ["t", "p1", "p2", "p3", "energy", "entropy"],
        states.iter().map(|s| [s.time, s.point.x, s.point.y, s.point.z, s.energy, s.entropy]),
    )?;

    if options.json {
        Report::new(certificate, end)?.print()?;
    } else {
        let [x, y, z]: [f64; 3] = end.point.into();
        print(certificate)?;
        print(format_args!("at t = {:.1}:  p = ({x:.6}, {y:.6}, {z:.6})", end.time))?;
        print(format_args!(
            "at rest:      |p₁| = √(2HI₁) = {:.6}",
            (2.0 * energy * INERTIA.x).sqrt()
        ))?;
        print(format_args!("figure:       {}", gallery.path("relaxing_rigid_body.svg").display()))?;
    }
    Ok(())
}
