//! Relaxation on S²: without a bracket, entropy climbs along a level curve of the energy, in steps that follow the motion.
//!
//! `x' = K dS`, where `K = |dH|² G* − dH ⊗ dH` of the round metric annihilates `dH`, with
//! `H = ½ Σ D_i (x_i² + ⅔ x_i³)`, `D = (1, ½, ¼)`, and `S = x₃ + 0.3 x₁x₂`. The state starts
//! near the least entropy on the level curve `H = H₀` and comes to rest at the greatest, where `dS ∥ dH`. Both laws hold
//! in steps of any size, so the size may follow the error, and the run ends at rest. `--step-size` is the largest step.
//! The curve itself is the orbit of the same energy under the bracket of the area form,
//! `x' = x × dH`.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Globe, Panel, Panels, Record};

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
    let example = Example::adaptive(about, 10.0);
    let span = Span::until(1e3).tolerance(1e-5).largest_step(example.step_size).until_rest(1e-9);
    let mut steps = WeylMidpoint.steps(&relaxing, start, span)?;
    let mut states = vec![steps.state().clone()];
    for state in steps.by_ref().take(example.steps) {
        states.push(state?);
    }
    let rested = steps.ending().is_some_and(|ending| ending.is_rest());
    let run = Record { states, certificate: steps.certificate().clone() };

    let spinning = System::on(Sphere::<2>::round()).bracket(AreaForm).energy(energy).build()?;
    let level = WeylMidpoint.run(&spinning, start, Span::steps(0.01, 2200))?;
    let highest = level.iter().map(|s| relaxing.entropy_at(&s.point)).fold(f64::MIN, f64::max);

    let globe = Globe::new("the state x(t), from ○ to ●")
        .seen_from([0.85, -0.5, 0.25])
        .level("H = H₀", level.iter().map(|s| s.point))
        .curve("x(t)", run.states.iter().map(|s| s.point));
    let sizes = run.changes(|before, after| after.time - before.time);
    let figure =
        Panels::new("Relaxation on S², S = x₃ + 0.3 x₁x₂, in steps that follow the motion")
            .globe(globe)
            .panel(run.panel("entropy S", |s| s.entropy).named_level("maximum on H = H₀", highest))
            .panel(Panel::new("step size h", "t").line("h", sizes).logarithmic(1e-9))
            .panel(run.energy_error());
    let rows = run.states.iter();
    let rows = rows.map(|s| [s.time, s.point.x, s.point.y, s.point.z, s.energy, s.entropy]);
    example
        .report(&run)
        .with("rested", rested)
        .table(["t", "x1", "x2", "x3", "energy", "entropy"], rows)
        .figure(figure)
        .print()
}
