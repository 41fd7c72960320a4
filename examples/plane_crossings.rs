//! The spinning top crosses a plane: outputs at equal intervals, and events to the last digits of the time.
//!
//! The top is that of `spinning_top`, `x' = x × dH` on S² with `H = ½ Σ D_i (x_i² + ⅔ x_i³)`, `D = (1, ½, ¼)`.
//! Its orbit is a closed level curve of `H`, so the time from one crossing of the plane `x₃ = 0` to the next one
//! in the same direction is the period. The steps of order 8 know nothing of the plane or of the outputs, which
//! lie inside them, on the dense output of order 7, and keep the energy as the steps do.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Globe, Panel, Panels, Record};

const D: [f64; 3] = [1.0, 0.5, 0.25];

fn main() -> Result<(), Box<dyn Error>> {
    let top = System::on(Sphere::<2>::round())
        .bracket(AreaForm)
        .energy(|x: &Vector3<Real>| -> Real {
            (0..3).map(|i| (x[i].powi(2) + x[i].powi(3) * (2.0 / 3.0)) * (0.5 * D[i])).sum()
        })
        .build()?;
    let start = Vector3::repeat(3.0_f64.sqrt().recip());

    let about = "A spinning top crosses a plane again and again, after one period each.";
    let example = Example::new(about, 800, 0.25);
    let span = Span::steps(example.step_size, example.steps)
        .output_every(example.step_size * example.steps as f64 / 1000.0)
        .event("equator", |x: &Vector3<f64>| x.z);
    let run = DormandPrince8.run(&top, start, span)?;

    // The times from crossing to crossing, and how far each is from their mean.
    let upward: Vec<_> = run.events().iter().filter(|event| event.rises).collect();
    let downward: Vec<_> = run.events().iter().filter(|event| !event.rises).collect();
    let crossings = [("upward", upward), ("downward", downward)];
    let periods = crossings.each_ref().map(|(_, events)| {
        let times = events.windows(2).map(|pair| [pair[0].state.time, pair[1].state.time]);
        times.map(|[before, time]| (time, time - before)).collect::<Vec<_>>()
    });
    let count = periods.iter().map(Vec::len).sum::<usize>();
    let mean =
        periods.iter().flatten().map(|(_, period)| period).sum::<f64>() / count.max(1) as f64;
    let errors = periods.map(|list| list.into_iter().map(|(t, period)| (t, period - mean)));
    let errors = errors.map(Iterator::collect::<Vec<_>>);
    let worst = errors.iter().flatten().map(|(_, error)| error.abs()).fold(0.0, f64::max);

    let circle = (0..=120).map(|k| (f64::from(k) * std::f64::consts::TAU / 120.0).sin_cos());
    let mut globe = Globe::new("the axis x(t) crosses the plane x₃ = 0")
        .seen_from([0.85, 0.4, 0.4])
        .level("x₃ = 0", circle.map(|(sin, cos)| [cos, sin, 0.0]));
    let mut lengths = Panel::new("T_k − T", "t").title("periods, less their mean");
    for ((name, events), errors) in crossings.iter().zip(errors) {
        // A short run has none.
        if !errors.is_empty() {
            lengths = lengths.line(*name, errors);
            globe = globe.curve(*name, events.iter().map(|event| event.state.point));
        }
    }
    let record = Record { states: run.states().to_vec(), certificate: run.certificate().clone() };
    let figure =
        Panels::new(format!("The spinning top crosses a plane, h = {}", example.step_size))
            .globe(globe.curve("x(t)", run.iter().map(|state| state.point)))
            .panel(record.panel("x₃", |state| state.point.z).level(0.0))
            .panel(lengths.level(0.0))
            .panel(record.energy_error());
    let report = example.report(&record).with("outputs", run.states().len() - 1);
    let report = report.with("crossings", run.events().len()).with("period", mean);
    report.with("period_error", worst).figure(figure).print()
}
