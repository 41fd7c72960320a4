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
use metriplectic_studies::{Gallery, Options, Panel, Panels, Report, interrupted, print};

const INERTIA: Vector3<f64> = Vector3::new(10.0, 5.0, 1.0);
const START: Vector3<f64> = Vector3::new(1e-6, -1.0, 1e-6);

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::read();
    let (count, largest) = (options.steps_or(usize::MAX), options.step_size_or(1e3));

    let body = System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.component_mul(p).component_div(&INERTIA.cast()).sum() * 0.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
        .build()?;
    let span = Span::until(1e4).tolerance(1e-5).largest_step(largest).until_rest(1e-9);
    let mut steps = WeylMidpoint.steps(&body, START, span)?;

    let (gallery, energy) = (Gallery::open()?, steps.state().energy);
    let watch = Observables::on(&body)
        .of("p1", |p| p.x)
        .of("p2", |p| p.y)
        .of("p3", |p| p.z)
        .of_state("entropy", |state| state.entropy);
    let mut table = watch.csv(File::create(gallery.path("adaptive_relaxation.csv"))?)?;
    table.write(steps.state())?;
    let mut states = vec![steps.state().clone()];
    for state in steps.by_ref().take(count) {
        states.push(state?);
        table.write(&states[states.len() - 1])?;
        if interrupted() {
            break;
        }
    }
    table.finish()?;
    let (certificate, end) = (steps.certificate(), steps.state());
    let line = |value: &dyn Fn(&State<LieDual<3>>) -> f64| -> Vec<_> {
        states.iter().map(|state| (state.time, value(state))).collect()
    };
    let sizes = states.windows(2).map(|pair| (pair[1].time, pair[1].time - pair[0].time));
    let momentum = Panel::new("angular momentum", "t").line("p₁", line(&|s| s.point.x));
    let entropy = Panel::new("entropy S, maximum H I₁", "t").line("S", line(&|s| s.entropy));
    let error = Panel::new("energy H − H₀", "t").line("H", line(&|s| s.energy - energy));
    Panels::new("A body that waits, tumbles and rests, in steps that follow the motion")
        .columns(2)
        .panel(
            Panel::new("step size h", "t").line("h", sizes.collect::<Vec<_>>()).logarithmic(1e-9),
        )
        .panel(momentum.line("p₂", line(&|s| s.point.y)).line("p₃", line(&|s| s.point.z)))
        .panel(entropy.level(energy * INERTIA.x))
        .panel(error.level(0.0))
        .save(gallery.path("adaptive_relaxation.svg"))?;

    if options.json {
        let rested = steps.ending().is_some_and(|ending| ending.is_rest());
        let report = Report::new(certificate, end)?.with("time", end.time);
        report.with("rested", rested).print()?;
    } else {
        print(certificate)?;
        print(format_args!("ended at t = {:.3}: {:?}", end.time, steps.ending()))?;
        print(format_args!("figure:      {}", gallery.path("adaptive_relaxation.svg").display()))?;
    }
    Ok(())
}
