//! Kepler's problem: the ellipse stays where it is, at a step with which a midpoint rule turns it.
//!
//! The start and the step `h = 0.1` are those of Andrews and Farrell (2024), arXiv:2407.11904, who build a scheme of their
//! own to conserve what Kepler's problem conserves: the energy, the angular momentum and the Runge-Lenz vector,
//!
//! ```text
//! H = ½|v|² − 1/|x|,   L = x₁v₂ − x₂v₁,   A = (v₂L − x₁/|x|, −v₁L − x₂/|x|) .
//! ```
//!
//! `A` points along the axis of the ellipse. Here `L` and `A₂` are listed. `A₁` is a function of the others, since
//! `|A|² = 1 + 2HL²`. The implicit midpoint rule conserves `L` alone.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels};

type Orbit = Vector4<Real>;
type Law = fn(&Orbit) -> Real;
type Line<'a> = &'a dyn Fn(f64, &Vector4<f64>) -> (f64, f64);

fn radius(x: &Orbit) -> Real {
    (x.x * x.x + x.y * x.y).sqrt()
}

fn energy(x: &Orbit) -> Real {
    (x.z * x.z + x.w * x.w) * 0.5 - radius(x).recip()
}

fn momentum(x: &Orbit) -> Real {
    x.x * x.w - x.y * x.z
}

fn axis(x: &Orbit) -> Vector2<Real> {
    let (r, l) = (radius(x), momentum(x));
    vector![x.w * l - x.x / r, -x.z * l - x.y / r]
}

fn main() -> Result<(), Box<dyn Error>> {
    let kepler = System::on(Euclidean::<4>)
        .bracket(Symplectic)
        .energy(energy)
        .momentum(momentum)
        .momentum(|x: &Orbit| axis(x).y)
        .build()?;
    let start = vector![0.4, 0.0, 0.0, 2.0];

    let example = Example::new("Kepler's problem: the ellipse does not turn.", 1000, 0.1);
    let run = example.run(&kepler, start, example.span())?;
    let ours = run.states.iter().map(|state| (state.time, state.point)).collect();
    let runs = [
        ("plain midpoint rule", midpoint_rule(start, example.step_size, example.steps)),
        ("WeylMidpoint", ours),
    ];
    let lines = |panel: Panel, line: Line<'_>| {
        runs.iter().fold(panel, |panel, (name, states)| {
            panel.line(*name, states.iter().map(|(t, x)| line(*t, x)).collect::<Vec<_>>())
        })
    };

    let laws: [(&str, Law); 3] =
        [("H", energy), ("L", momentum), ("the direction of A", |x| axis(x).y.atan2(axis(x).x))];
    let orbit = lines(Panel::new("x₂", "x₁").title("orbit").equal(), &|_, x| (x.x, x.y));
    let title = format!("Kepler's problem, h = {}", example.step_size);
    let (mut figure, mut text) = (Panels::new(title).columns(2).panel(orbit), String::new());
    for (name, law) in laws {
        let error = |x: &Vector4<f64>| (law(&x.cast()) - law(&start.cast())).re.abs();
        let worst = |states: &[(f64, Vector4<f64>)]| {
            states.iter().fold(0.0_f64, |worst, (_, x)| worst.max(error(x)))
        };
        let [plain, ours] = runs.each_ref().map(|(_, states)| worst(states));
        text += &format!("{name:18} off by {ours:.1e}; by the plain midpoint rule {plain:.1e}\n");
        let panel = Panel::new(format!("error of {name}"), "t").logarithmic(1e-16);
        figure = figure.panel(lines(panel, &|t, x| (t, error(x))));
    }
    example.report(&run).text(text.trim_end()).figure(figure).print()
}

/// The implicit midpoint rule, solved to round-off: `x' = x + h f((x + x')/2)`.
fn midpoint_rule(start: Vector4<f64>, h: f64, steps: usize) -> Vec<(f64, Vector4<f64>)> {
    let velocity = |x: &Vector4<f64>| {
        let cube = x.x.hypot(x.y).powi(3);
        vector![x.z, x.w, -x.x / cube, -x.y / cube]
    };
    let step = |x: &Vector4<f64>| (0..60).fold(*x, |end, _| x + velocity(&((x + end) * 0.5)) * h);
    let states = std::iter::successors(Some(start), |x| Some(step(x)));
    states.take(steps + 1).enumerate().map(|(k, x)| (h * k as f64, x)).collect()
}
