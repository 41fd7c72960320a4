//! A spin in a field that turns: the hysteresis of a nanomagnet, and the heat of each loop.
//!
//! A unit spin `n` has the energy `H(t, n) = −½ n₃² − b(t)·n` with an easy axis `e₃` and a field that turns in a plane with
//! it. It precesses by the area form and is damped by a bath with the friction `R = α g⁻¹`, the equation of
//! Landau, Lifshitz and Gilbert. The work of the field over a loop is the area of the loop and the heat of the bath.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Globe, Panel, Panels};

const DAMPING: f64 = 0.2;
const FIELD: f64 = 0.9;
const PERIOD: f64 = 400.0;

fn field(t: Real) -> Vector3<Real> {
    let angle = t * (std::f64::consts::TAU / PERIOD);
    Vector3::new(angle.sin() * FIELD, 0.0.into(), angle.cos() * FIELD)
}

fn main() -> Result<(), Box<dyn Error>> {
    let spin = System::on(Sphere::<2>::round())
        .bracket(AreaForm)
        .energy_in_time(|t: Real, n: &Vector3<Real>| n.z * n.z * -0.5 - field(t).dot(n))
        .bath("lattice", Bath::at(1.0).isotropic(DAMPING))
        .build()?;

    let about =
        "A spin in a field that turns: the hysteresis of a nanomagnet, and the heat of each loop.";
    let example = Example::new(about, 4000, 0.2);
    let span = Span::steps(example.step_size, example.steps);
    let start = Vector3::new(0.0, 0.0, 1.0);
    let run = DormandPrince8.run(&spin, spin.start(start), span)?;

    let along = |t: f64| field(t.into()).z.re;
    let magnet: Vec<(f64, f64)> = run.iter().map(|s| (along(s.time), s.point.x.z)).collect();
    let series = |value: &dyn Fn(&OpenState<Vector3<f64>>) -> f64| -> Vec<(f64, f64)> {
        run.iter().map(|s| (s.time, value(&s.point))).collect()
    };
    let energies = Panel::new("energy", "t")
        .line("work of the field", series(&|s| s.ledger.parameter_work()))
        .line("heat into the lattice", series(&|s| -s.ledger.heat("lattice").unwrap_or(0.0)));
    let globe = Globe::new("the spin n(t), from ○ to ●").seen_from([0.4, 0.9, 0.3]);
    let balance: Vec<(f64, f64)> =
        run.iter().map(|s| (s.time, s.energy - run.certificate().initial_energy)).collect();
    let figure = Panels::new(format!("A spin in a field that turns, h = {}", example.step_size))
        .columns(2)
        .globe(globe.curve("n(t)", run.iter().map(|s| s.point.x)))
        .panel(Panel::new("n₃", "b₃").title("hysteresis").line("n₃", magnet))
        .panel(energies)
        .panel(Panel::new("ΔH − W − Q", "t").line("balance", balance).level(0.0));
    let last = run.last();
    let n = last.point.x;
    example
        .report_of(run.certificate(), last.time, vec![n.x, n.y, n.z])
        .with("work", last.point.ledger.parameter_work())
        .with("heat", last.point.ledger.heat("lattice").unwrap_or(0.0))
        .figure(figure)
        .print()
}
