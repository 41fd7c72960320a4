//! The spinning top on S²: a Hamiltonian flow on a space that no single chart covers.
//!
//! `x' = x × dH`, the bracket of the area form, with `H = ½ Σ D_i (x_i² + ⅔ x_i³)`, `D = (1, ½, ¼)`
//! (Celledoni, Eidnes, Owren, Ringholm 2019, example 1). The classical Runge-Kutta method of order 4
//! is given as many evaluations of `dH`, counted in the closure, where a call has both derivatives on
//! the sphere; those of the verification and of the certificate count too. Its points are nearer to
//! the exact ones here, but its energy drifts.

use std::{cell::Cell, error::Error};

use metriplectic::prelude::*;
use metriplectic_studies::{Gallery, Globe, Options, Panel, Panels, Report, print, write_csv};

const D: [f64; 3] = [1.0, 0.5, 0.25];

/// One step of the classical Runge-Kutta method for `x' = x × ∇H`, the gradient by hand.
fn runge_kutta(x: &Vector3<f64>, h: f64) -> Vector3<f64> {
    let velocity = |x: Vector3<f64>| x.cross(&Vector3::from_fn(|i, _| D[i] * x[i] * (1.0 + x[i])));
    let k1 = velocity(*x);
    let k2 = velocity(x + k1 * (0.5 * h));
    let k3 = velocity(x + k2 * (0.5 * h));
    x + (k1 + (k2 + k3) * 2.0 + velocity(x + k3 * h)) * (h / 6.0)
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::read();
    let (count, h) = (options.steps_or(1000), options.step_size_or(0.1));
    let calls = Cell::new(0_u32);
    let energy = |x: &Vector3<Real>| -> Real {
        calls.set(calls.get() + 1);
        (0..3).map(|i| (x[i].powi(2) + x[i].powi(3) * (2.0 / 3.0)) * (0.5 * D[i])).sum()
    };
    let top = System::on(Sphere::<2>::round()).bracket(AreaForm).energy(energy).build()?;
    let start = Vector3::repeat(3.0_f64.sqrt().recip());
    let run = WeylMidpoint.run(&top, start, Span::steps(h, count).every(count.div_ceil(2000)))?;
    let (certificate, end) = (run.certificate(), run.last());
    let (calls, error) = (calls.get(), |energy: f64| (energy - certificate.initial_energy).abs());
    let (tau, mut x, mut drift) = (end.time / f64::from(calls / 4), start, vec![(0.0, 0.0)]);
    for n in 1..=calls / 4 {
        x = runge_kutta(&x, tau);
        drift.push((tau * f64::from(n), error(top.energy_at(&x))));
    }
    let worst = drift.iter().map(|(_, error)| *error).fold(0.0, f64::max);

    let gallery = Gallery::open()?;
    let entry = |i: usize| run.iter().map(|s| (s.time, s.point[i])).collect::<Vec<_>>();
    let kept: Vec<_> = run.iter().map(|s| (s.time, error(s.energy))).collect();
    let entries = Panel::new("the axis x", "t").line("x₁", entry(0)).line("x₂", entry(1));
    let errors = Panel::new("energy error |H − H₀|", "t").logarithmic(1e-17);
    let mut globe = Globe::new("the axis x(t), from ○ to ●").seen_from([0.85, 0.35, 0.4]);
    for level in [[2.0, 0.0, 1.0], [1.0, 0.0, 1.5], [0.0, 1.0, 1.5]].map(Vector3::from) {
        let orbit = WeylMidpoint.run(&top, level.normalize(), Span::steps(0.1, 400))?;
        globe = globe.level("level curves of H", orbit.iter().map(|s| s.point));
    }
    Panels::new(format!("The spinning top on S², D = (1, ½, ¼), h = {h}"))
        .globe(globe.curve("x(t)", run.iter().map(|s| s.point)))
        .panel(entries.line("x₃", entry(2)))
        .panel(errors.line("Weyl midpoint", kept).line("Runge-Kutta 4, as many evaluations", drift))
        .save(gallery.path("spinning_top.svg"))?;
    let rows = run.iter().map(|s| [s.time, s.point.x, s.point.y, s.point.z, s.energy]);
    write_csv(gallery.path("spinning_top.csv"), ["t", "x1", "x2", "x3", "energy"], rows)?;

    if options.json {
        let report = Report::new(certificate, end)?.with("evaluations", calls);
        report.with("runge_kutta_energy_error", worst).print()?;
    } else {
        let (t, [x, y, z]): (f64, [f64; 3]) = (end.time, end.point.into());
        print(format_args!("{certificate}\nat t = {t:.1}:  x = ({x:.6}, {y:.6}, {z:.6})"))?;
        print(format_args!("Runge-Kutta:  |H − H₀| ≤ {worst:.1e} after {calls} evaluations"))?;
        print(format_args!("figure:       {}", gallery.path("spinning_top.svg").display()))?;
    }
    Ok(())
}
