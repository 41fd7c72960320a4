//! The Kovalevskaya top: a heavy top with four invariants, all four conserved, on se(3)*.
//!
//! The top has the moments `I = (1, 1, ½)`, and its centre of mass lies at `R = (1, 0, 0)` in its frame. The state
//! is the angular momentum `l` and the vertical `n`, both in that frame, with `ω = I⁻¹l`:
//!
//! ```text
//! H = ½ l·ω + n·R,   l' = l × ω + n × R,   n' = n × ω,
//! K = (l₁² − l₂² − 2n₁)² + (2 l₁l₂ − 2n₂)² .
//! ```
//!
//! `n·l` and `|n|²` are Casimirs, and Kovalevskaya (1889) found `K`. The start and the step `h = 0.1` are those of
//! Andrews and Farrell (2024), arXiv:2407.11904, who build a scheme of their own to conserve all four. The implicit
//! midpoint rule conserves quadratic invariants alone, and lets `K` go by 0.36. Eight methods of the library keep
//! all four.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels};

fn energy(x: &Vector6<Real>) -> Real {
    (x[0] * x[0] + x[1] * x[1]) * 0.5 + x[2] * x[2] + x[3]
}

fn area(x: &Vector6<Real>) -> Real {
    x[0] * x[3] + x[1] * x[4] + x[2] * x[5]
}

fn square(x: &Vector6<Real>) -> Real {
    x[3] * x[3] + x[4] * x[4] + x[5] * x[5]
}

fn kovalevskaya(x: &Vector6<Real>) -> Real {
    (x[0] * x[0] - x[1] * x[1] - x[3] * 2.0).powi(2) + (x[0] * x[1] - x[4]).powi(2) * 4.0
}

fn main() -> Result<(), Box<dyn Error>> {
    let top = System::on(LieDual::se3())
        .energy(energy)
        .casimir(area)
        .casimir(square)
        .momentum(kovalevskaya)
        .build()?;
    let start = vector![2.0, 0.0, 0.2, 0.8, 0.6, 0.0];

    let about = "The Kovalevskaya top: four invariants, beside a midpoint rule that loses one.";
    let example = Example::new(about, 3000, 0.1);
    let span = example.span();
    let exact = example.run(&top, start, span)?;
    let others = [
        example.run_with(Scheme::new(ChartMidpoint), &top, start, span)?,
        example.run_with(Scheme::new(Exponential), &top, start, span)?,
        example.run_with(Gauss::<3>, &top, start, span)?,
        example.run_with(Radau::<3>, &top, start, span)?,
        example.run_with(DormandPrince5, &top, start, span)?,
        example.run_with(DormandPrince8, &top, start, span)?,
        example.run_with(RungeKuttaChebyshev, &top, start, span)?,
    ];
    let plain = midpoint_rule(start, example.step_size, example.steps);

    type Law = fn(&Vector6<Real>) -> Real;
    let laws: [(&str, Law); 4] =
        [("H", energy), ("n·l", area), ("|n|²", square), ("K", kovalevskaya)];
    let error = |f: Law, x: &Vector6<f64>| (f(&x.cast()) - f(&start.cast())).re.abs();
    let title = format!("The Kovalevskaya top, h = {}", example.step_size);
    let (mut figure, mut text) = (Panels::new(title).columns(2), String::new());
    for (name, law) in laws {
        let plain: Vec<_> = plain.iter().map(|(t, x)| (*t, error(law, x))).collect();
        let ours = exact.series(|s| error(law, &s.point));
        let largest = |k: usize| {
            others.iter().map(|run| error(law, &run.states[k].point)).fold(0.0, f64::max)
        };
        let every: Vec<_> = ours.iter().enumerate().map(|(k, (t, _))| (*t, largest(k))).collect();
        let worst = |e: &[(f64, f64)]| e.iter().fold(0.0_f64, |most, (_, e)| most.max(*e));
        let [us, others, them] = [&ours, &every, &plain].map(|e| worst(e));
        text += &format!(
            "{name:5} off by {:.1e}; by the plain midpoint rule {them:.1e}\n",
            us.max(others)
        );
        let panel = Panel::new(format!("error of {name}"), "t").logarithmic(1e-16);
        let panel = panel.line("plain midpoint rule", plain).line("WeylMidpoint", ours);
        figure = figure.panel(panel.line("largest of 7 other methods", every));
    }
    example.report(&exact).text(text.trim_end()).figure(figure).print()
}

/// The implicit midpoint rule, solved to round-off: `x' = x + h f((x + x')/2)`.
fn midpoint_rule(start: Vector6<f64>, h: f64, steps: usize) -> Vec<(f64, Vector6<f64>)> {
    let velocity = |x: &Vector6<f64>| {
        let (l, n) = (x.xyz(), vector![x[3], x[4], x[5]]);
        let omega = vector![l.x, l.y, 2.0 * l.z];
        let (turn, fall) = (l.cross(&omega) + n.cross(&Vector3::x()), n.cross(&omega));
        vector![turn.x, turn.y, turn.z, fall.x, fall.y, fall.z]
    };
    let step = |x: &Vector6<f64>| (0..60).fold(*x, |end, _| x + velocity(&((x + end) * 0.5)) * h);
    let states = std::iter::successors(Some(start), |x| Some(step(x)));
    states.take(steps + 1).enumerate().map(|(k, x)| (h * k as f64, x)).collect()
}
