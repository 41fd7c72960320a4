//! Two gas containers over a long time: what the laws do for the error of the trajectory.
//!
//! The model is that of `gas_containers`, to `t = 10⁴`, by the method of Dormand and Prince of order 8 with
//! both laws, at the tolerance 1e-8. Beside it is the same Runge-Kutta method with the same step control, and no
//! law. It runs on `H = λ·f(x)`, by which any equation `x' = f(x)` is canonical: `H` vanishes with `λ`, and `λ`
//! stays zero. The reference of both is a run at the tolerance 1e-12.

use std::error::Error;

use metriplectic::nalgebra::SVector;
use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels, Record};

const ALPHA: f64 = 1e-3;

fn main() -> Result<(), Box<dyn Error>> {
    let wall = |x: &Vector4<Real>| {
        let [left, right] = [x.z / x.x, x.w / (-x.x + 2.0)].map(|density| density * (2.0 / 3.0));
        let push = Vector4::new(1.0.into(), 0.0.into(), -left, right);
        push * Vector4::y().transpose() - Vector4::y() * push.transpose()
    };
    let leak = |_: &Vector4<Real>, w: &Vector4<Real>| {
        let b = Vector4::new(0.0.into(), 0.0.into(), w.w, -w.z);
        b * b.transpose() * Real::from(ALPHA)
    };
    let containers = System::on(Euclidean::<4>)
        .bracket(Poisson::field(wall))
        .dissipation(FieldDissipation(leak))
        .energy(|x: &Vector4<Real>| x.y.powi(2) * 0.5 + x.z + x.w)
        .entropy(|x: &Vector4<Real>| (x.x * (-x.x + 2.0)).ln() + (x.z * x.w).ln() * 1.5)
        .build()?;
    // x' = f(x), written by hand and without laws, is x' = ∂H/∂λ.
    let lifted = |y: &SVector<Real, 8>| {
        let [left, right] = [y[2] / y[0], y[3] / (-y[0] + 2.0)].map(|ratio| ratio * (2.0 / 3.0));
        let heat = (y[2].recip() - y[3].recip()) * (1.5 * ALPHA);
        y[1] * (y[4] - left * y[6] + right * y[7]) + y[5] * (left - right) + heat * (y[6] - y[7])
    };
    let lifted = System::on(Euclidean::<8>).bracket(Symplectic).energy(lifted).build()?;

    let about = "Two gases over a long time: with both laws the trajectory is more accurate.";
    let example = Example::adaptive(about, 1.0);
    let largest = example.step_size;
    let until = |t, tau| Span::until(t).tolerance(tau).largest_step(largest).output_every(10.0);
    let start = Vector4::new(1.0, 2.0, 2.0, 2.0);
    let mut steps = DormandPrince8.steps(&containers, start, until(1e4, 1e-8))?;
    let mut states = vec![steps.state().clone()];
    while steps.ending().is_none() && steps.certificate().steps < example.steps {
        steps.advance()?;
        states.extend(steps.outputs().cloned());
    }
    states.extend(steps.ending().is_none().then(|| steps.state().clone()));
    let run = Record { states, certificate: steps.certificate().clone() };
    let end = run.last().time;
    let reference = DormandPrince8.run(&containers, start, until(end, 1e-12))?;
    let start = SVector::from_fn(|i, _| if i < 4 { start[i] } else { 0.0 });
    let plain = DormandPrince8.run(&lifted, start, until(end, 1e-8))?;

    let with: Vec<Vector4<f64>> = run.states.iter().map(|s| s.point).collect();
    let points = [with, plain.iter().map(|s| s.point.fixed_rows::<4>(0).into()).collect()];
    let values = |y: &Vector4<f64>, x: &Vector4<f64>| {
        let change = containers.energy_at(y) - run.certificate.initial_energy;
        let [entropy, exact] = [y, x].map(|point| containers.entropy_at(point));
        [entropy, (entropy - exact).abs(), (y.x - x.x).abs(), change.abs()]
    };
    let mut figure = Panels::new("Two gas containers, order 8 at the tolerance 1e-8").columns(2);
    let mut report = example.report(&run).with("steps_without_laws", plain.certificate().steps);
    let floors = [("entropy error", 1e-13), ("position error", 1e-9), ("energy error", 1e-16)];
    for (k, (name, floor)) in [("entropy", 0.0)].into_iter().chain(floors).enumerate() {
        let mut panel = Panel::new(name, "t");
        for (run, label) in points.iter().zip(["with both laws", "without"]) {
            let states = run.iter().zip(&reference);
            let line: Vec<_> = states.map(|(y, x)| (x.time, values(y, &x.point)[k])).collect();
            let worst = line.iter().map(|(_, value)| *value).fold(0.0, f64::max);
            report = report.with(&format!("{name} {label}").replace(' ', "_"), worst);
            panel = panel.line(label, line);
        }
        figure = figure.panel(if floor > 0.0 { panel.logarithmic(floor) } else { panel });
    }
    report.figure(figure).print()
}
