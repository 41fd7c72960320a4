//! A bundle of neighbours on a sphere, beside the tangent of the run in their middle.
//!
//! The direction `n` of a top precesses by `n' = n × ∂H/∂n` with `H = ½ n_x² + n_y² + ⅖ n_z³`. Neighbours on a circle of radius 0.02
//! around its start are carried along. The tangent `T` of the one run in the middle maps the circle to an ellipse, in the frame there;
//! the neighbours lie on it, up to the square of their distance. The flow keeps area (Liouville), the midpoint rule to its order: the
//! ellipse grows as thin as it grows long, because neighbours on other level curves go round in other times.

use std::error::Error;
use std::f64::consts::TAU;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels};

/// The radius of the circle of neighbours.
const RADIUS: f64 = 0.02;

fn main() -> Result<(), Box<dyn Error>> {
    let top = System::on(Sphere::<2>::round())
        .bracket(AreaForm)
        .energy(|n: &Vector3<Real>| n.x * n.x * 0.5 + n.y * n.y + n.z.powi(3) * 0.4)
        .build()?;
    let about = "Neighbours of a top, and the tangent of the run in their middle.";
    let example = Example::new(about, 120, 0.1);
    let start = vector![0.6, 0.0, 0.8];
    let method = Scheme::new(WeylMidpoint);
    let middle = method.tangent(&top, start, example.span())?;

    let circle = |k: i32| {
        let (sine, cosine) = (TAU * f64::from(k) / 48.0).sin_cos();
        vector![RADIUS * cosine, RADIUS * sine]
    };
    let mut neighbours = Vec::new();
    for k in 0..=48 {
        let begin = <Sphere<2> as metriplectic::fields::Space>::chart(&start, &circle(k));
        neighbours.push(method.run(&top, begin, example.span())?);
    }
    // In the frame at the middle of the bundle.
    let at = |step: usize, k: usize| -> Vector2<f64> {
        let (here, there) = (&middle.states()[step].point, &neighbours[k].states()[step].point);
        <Sphere<2> as metriplectic::fields::Space>::coordinates(here, there)
    };
    let mapped = |step: usize, k: i32| -> Vector2<f64> {
        let t = middle.states()[step].along_start();
        let q = circle(k);
        vector![t[(0, 0)] * q.x + t[(0, 1)] * q.y, t[(1, 0)] * q.x + t[(1, 1)] * q.y]
    };
    let last = middle.states().len() - 1;
    let bundle = |step: usize| -> Panel {
        let found: Vec<(f64, f64)> = (0..=48).map(|k| at(step, k)).map(|q| (q.x, q.y)).collect();
        let ellipse: Vec<(f64, f64)> =
            (0..=48).map(|k| mapped(step, k)).map(|q| (q.x, q.y)).collect();
        let time = middle.states()[step].time;
        Panel::new("second direction", "first direction of the frame")
            .title(format!("t = {time:.1}"))
            .line("neighbours", found)
            .line("T times the circle", ellipse)
            .equal()
    };
    let states = middle.states();
    let growth: Vec<(f64, f64)> =
        states.iter().map(|state| (state.time, state.along_start().norm())).collect();
    let area: Vec<(f64, f64)> =
        states.iter().map(|state| (state.time, state.along_start().determinant() - 1.0)).collect();
    let furthest =
        (0..=48).map(|k| (at(last, k as usize) - mapped(last, k)).norm()).fold(0.0, f64::max);
    let figure = Panels::new(format!("Neighbours of a top, h = {}", example.step_size))
        .panel(bundle(last / 3))
        .panel(bundle(last))
        .panel(Panel::new("|T|", "t").line("|T|", growth))
        .panel(Panel::new("det T − 1", "t").line("area", area).level(0.0));
    let end = &states[last];
    example
        .report_of(middle.certificate(), end.time, end.point.as_slice().to_vec())
        .with("growth", end.along_start().norm())
        .with("distance_from_the_ellipse", furthest)
        .with("tangent_law", middle.sensitivity().energy)
        .figure(figure)
        .print()
}
