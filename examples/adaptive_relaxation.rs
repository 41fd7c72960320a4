//! Steps that follow the motion: a rigid body that waits, tumbles and comes to rest.
//!
//! The body of `relaxing_rigid_body` starts 10⁻⁶ from its unstable axis: it hangs on for a long time,
//! turns over quickly, and creeps to its axis of largest inertia,
//!
//! ```text
//! p' = p × dH + |dH|² dS − (dH·dS) dH,   H = ½Σp_i²/I_i,   S = |p|²/2 .
//! ```
//!
//! Both laws hold in steps of any size, so the size may follow the error; the run ends at rest. What is
//! watched is streamed to a file, which Ctrl-C leaves whole. `--step-size` is the largest step.

use std::{error::Error, fs::File};

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Gallery, Panel, Panels, Progress, Record, interrupted};

const INERTIA: Vector3<f64> = Vector3::new(10.0, 5.0, 1.0);

fn main() -> Result<(), Box<dyn Error>> {
    let body = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.component_mul(p).component_div(&INERTIA.cast()).sum() * 0.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .build()?;
    let start = Vector3::new(1e-6, -1.0, 1e-6);

    let about = "A body waits, tumbles and comes to rest, in steps that follow the motion.";
    let example = Example::adaptive(about, 1e3);
    let span = Span::until(1e4).tolerance(1e-5).largest_step(example.step_size).until_rest(1e-9);
    let mut steps = WeylMidpoint.steps(&body, start, span)?;
    let watch = Observables::on(&body)
        .of("p1", |p| p.x)
        .of("p2", |p| p.y)
        .of("p3", |p| p.z)
        .of_state("entropy", |state| state.entropy);
    let mut table = watch.csv(File::create(Gallery::open()?.path("adaptive_relaxation.csv"))?)?;
    table.write(steps.state())?;
    let mut states = vec![steps.state().clone()];
    let mut progress = Progress::over(example.steps);
    for state in steps.by_ref().take(example.steps) {
        states.push(state?);
        table.write(&states[states.len() - 1])?;
        progress.step();
        if interrupted() {
            break;
        }
    }
    drop(progress);
    table.finish()?;
    let run = Record { states, certificate: steps.certificate().clone() };

    let momenta = Panel::new("angular momentum", "t")
        .line("p₁", run.series(|s| s.point.x))
        .line("p₂", run.series(|s| s.point.y))
        .line("p₃", run.series(|s| s.point.z));
    let sizes = run.changes(|before, after| after.time - before.time);
    let maximum = run.certificate.initial_energy * INERTIA.x;
    let figure =
        Panels::new("A body that waits, tumbles and rests, in steps that follow the motion")
            .columns(2)
            .panel(Panel::new("step size h", "t").line("h", sizes).logarithmic(1e-9))
            .panel(momenta)
            .panel(run.panel("entropy S", |s| s.entropy).named_level("maximum H I₁", maximum))
            .panel(run.energy_error());
    let rested = steps.ending().is_some_and(|ending| ending.is_rest());
    let report = example.report(&run).with("time", run.last().time);
    report.with("rested", rested).figure(figure).print()
}
