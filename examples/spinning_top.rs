//! The spinning top on S²: a Hamiltonian flow on a space that no single chart covers, and its period.
//!
//! `x' = x × dH`, the bracket of the area form, with `H = ½ Σ D_i (x_i² + ⅔ x_i³)`, `D = (1, ½, ¼)`
//! (Celledoni, Eidnes, Owren, Ringholm 2019, example 1). The classical Runge-Kutta method of order 4
//! is given as many evaluations of `dH`, counted in the closure, where a call has both derivatives on
//! the sphere; those of the verification and of the certificate count too. Its points are nearer to
//! the exact ones here, but its energy drifts.
//!
//! The orbit is a closed level curve of `H`, so the time from one crossing of the plane `x₃ = 0` to the next one in the
//! same direction is the period. A run of order 8 finds it from events. Its steps know nothing of the plane or of the
//! outputs, which lie inside them and have the energy of the run.

use std::{cell::Cell, error::Error};

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Globe, Panel, Panels};

const D: [f64; 3] = [1.0, 0.5, 0.25];

fn main() -> Result<(), Box<dyn Error>> {
    let calls = Cell::new(0_u32);
    let energy = |x: &Vector3<Real>| -> Real {
        calls.set(calls.get() + 1);
        (0..3).map(|i| (x[i].powi(2) + x[i].powi(3) * (2.0 / 3.0)) * (0.5 * D[i])).sum()
    };
    let top = System::on(Sphere::<2>::round()).bracket(AreaForm).energy(energy).build()?;
    let start = Vector3::repeat(3.0_f64.sqrt().recip());

    let about =
        "A spinning top on S²: the midpoint rule conserves its energy, Runge-Kutta does not.";
    let example = Example::new(about, 1000, 0.1);
    let run = example.run(&top, start, example.span())?;

    // Runge-Kutta over the same time, with as many calls.
    let (calls, end) = (calls.get(), run.last().time);
    let error = |energy: f64| (energy - run.certificate.initial_energy).abs();
    let (tau, mut x, mut drift) = (end / f64::from(calls / 4), start, vec![(0.0, 0.0)]);
    for n in 1..=calls / 4 {
        x = runge_kutta(&x, tau);
        drift.push((tau * f64::from(n), error(top.energy_at(&x))));
    }
    let worst = drift.iter().map(|(_, error)| *error).fold(0.0, f64::max);

    // The period: from crossing to crossing, in steps of order 8 that are twice as long.
    let span = Span::steps(2.0 * example.step_size, example.steps)
        .output_every(example.step_size)
        .event("equator", |x: &Vector3<f64>| x.z)
        .rising();
    let orbit = DormandPrince8.run(&top, start, span)?;
    let times: Vec<f64> = orbit.events().iter().map(|event| event.state.time).collect();
    let periods = times.windows(2).map(|pair| (pair[1], pair[1] - pair[0]));
    let count = times.len().saturating_sub(1).max(1) as f64;
    let period = periods.clone().map(|(_, period)| period).sum::<f64>() / count;
    let apart: Vec<_> = periods.map(|(t, each)| (t, each - period)).collect();
    let period_error = apart.iter().map(|(_, error)| error.abs()).fold(0.0, f64::max);

    let mut globe = Globe::new("the axis x(t), from ○ to ●").seen_from([0.85, 0.35, 0.4]);
    for level in [[2.0, 0.0, 1.0], [1.0, 0.0, 1.5], [0.0, 1.0, 1.5]].map(Vector3::from) {
        let orbit = WeylMidpoint.run(&top, level.normalize(), Span::steps(0.1, 400))?;
        globe = globe.level("level curves of H", orbit.iter().map(|s| s.point));
    }
    let entries = Panel::new("entries of the axis x", "t")
        .line("x₁", run.series(|s| s.point.x))
        .line("x₂", run.series(|s| s.point.y))
        .line("x₃", run.series(|s| s.point.z));
    let outputs: Vec<_> = orbit.iter().map(|s| (s.time, error(s.energy))).collect();
    let errors = Panel::new("energy error |H − H₀|", "t")
        .logarithmic(1e-17)
        .line("Weyl midpoint", run.series(|s| error(s.energy)))
        .line("Runge-Kutta 4", drift)
        .line("outputs of order 8", &outputs[..=example.steps]);
    let mut lengths = Panel::new("T_k − T", "t").title("periods, less their mean");
    // A short run has none.
    if !apart.is_empty() {
        lengths = lengths.line("T_k − T", apart);
    }
    let title = format!("The spinning top on S², D = (1, ½, ¼), h = {}", example.step_size);
    let figure = Panels::new(title)
        .globe(globe.curve("x(t)", run.states.iter().map(|s| s.point)))
        .panel(entries)
        .panel(errors)
        .panel(lengths.level(0.0));
    let rows = run.states.iter().map(|s| [s.time, s.point.x, s.point.y, s.point.z, s.energy]);
    example
        .report(&run)
        .with("evaluations", calls)
        .with("runge_kutta_energy_error", worst)
        .certificate("order_8", orbit.certificate())
        .with("outputs", orbit.states().len() - 1)
        .with("crossings", times.len())
        .with("period", period)
        .with("period_error", period_error)
        .table(["t", "x1", "x2", "x3", "energy"], rows)
        .figure(figure)
        .print()
}

/// One step of the classical Runge-Kutta method for `x' = x × ∇H`, the gradient by hand.
fn runge_kutta(x: &Vector3<f64>, h: f64) -> Vector3<f64> {
    let velocity = |x: Vector3<f64>| x.cross(&Vector3::from_fn(|i, _| D[i] * x[i] * (1.0 + x[i])));
    let k1 = velocity(*x);
    let k2 = velocity(x + k1 * (0.5 * h));
    let k3 = velocity(x + k2 * (0.5 * h));
    x + (k1 + (k2 + k3) * 2.0 + velocity(x + k3 * h)) * (h / 6.0)
}
