//! A fit of a metric: how hard a body is to slow down about each axis, as a function of its own angular momentum.
//!
//! The friction of a metriplectic system is that of its metric, `K_w = G*(w, w) G* − ♯w ♯wᵀ`. Here the metric on so(3)* is a closure
//! with coefficients,
//!
//! ```text
//! g(p, θ) = diag(a + d p₁², b, c),
//! ```
//!
//! and a run of 80 rows with a noise of 10⁻³ finds `θ = (a, b, c, d)`. Whatever `θ` is tried, the energy is kept and the entropy
//! `½|p|²` grows, as long as `g` is positive; where it is not, the run is an error and the trial is left.
//!
//! The last panel has the entry `g₁₁` over `p₁` with the band of two standard errors: narrow where the body has been.

use std::error::Error;
use std::f64::consts::TAU;

use metriplectic::manifolds::rand::rngs::ChaCha8Rng;
use metriplectic::manifolds::rand::{RngExt, SeedableRng};
use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels};

/// The noise of each number.
const NOISE: f64 = 1e-3;

fn main() -> Result<(), Box<dyn Error>> {
    let family = Family::on(LieDual::so3())
        .parameters(["a", "b", "c", "d"])
        .field_metric(|p: &Vector3<Real>, t: &Vector4<Real>| {
            Matrix3::from_diagonal(&Vector3::new(t.x + p.x * p.x * t.w, t.y, t.z))
        })
        .energy(|p: &Vector3<Real>, _: &Vector4<Real>| {
            p.x * p.x / 6.0 + p.y * p.y / 4.0 + p.z * p.z * 0.5
        })
        .entropy(|p: &Vector3<Real>, _: &Vector4<Real>| p.norm_squared() * 0.5)
        .build()?;
    let (start, truth) = (vector![0.4, -1.0, 0.3], vector![1.5, 1.0, 2.2, 0.8]);

    let about = "The coefficients of a metric, from noisy data of a body that its friction turns.";
    let example = Example::new(about, 80, 0.25);
    let run = DormandPrince8.run(&family.at(truth), start, example.span())?;
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut normal = || {
        let (a, b): (f64, f64) = (rng.random(), rng.random());
        NOISE * (-2.0 * (1.0 - a).ln()).sqrt() * (TAU * b).cos()
    };
    let times: Vec<f64> = run.states()[1..].iter().map(|state| state.time).collect();
    let data: Vec<Vector3<f64>> = (run.states()[1..].iter())
        .map(|state| state.point + Vector3::from_fn(|_, _| normal()))
        .collect();

    let fit = Fit::of(&family)
        .observe(|p: &Vector3<Real>| *p)
        .data(&times, &data)
        .positive(["a", "b", "c"])
        .start_at(start)
        .run(DormandPrince8, example.span(), vector![1.3, 1.1, 1.9, 0.5])?;
    if !example.json {
        println!("{fit}\n");
    }

    let best = family.at(Vector4::from_column_slice(&fit.parameters));
    let tangent = DormandPrince8.tangent(&best, start, example.span())?;
    let fitted = |i: usize| -> Vec<(f64, f64)> {
        tangent.states().iter().map(|state| (state.time, state.point[i])).collect()
    };
    let momentum = (0..3)
        .fold(Panel::new("momentum", "t"), |panel, i| panel.line(format!("p{}", i + 1), fitted(i)));
    let residuals = (0..3).fold(Panel::new("(data − fit) / 10⁻³", "t"), |panel, i| {
        let off: Vec<(f64, f64)> = (data.iter().zip(&fitted(i)[1..]))
            .map(|(data, (t, fit))| (*t, (data[i] - fit) / NOISE))
            .collect();
        panel.line(format!("p{}", i + 1), off)
    });
    let sensitivity = ["a", "b", "c", "d"].into_iter().fold(
        Panel::new("|∂p/∂θ|", "t").logarithmic(1e-4),
        |panel, name| {
            let along: Vec<(f64, f64)> = (tangent.states().iter())
                .map(|state| (state.time, state.along(name).map_or(0.0, |column| column.norm())))
                .collect();
            panel.line(name, along)
        },
    );
    let estimate =
        |name: &str| fit.estimate(name).map_or([0.0; 2], |e| [e.value, e.standard_error]);
    let ([a, sa], [d, sd]) = (estimate("a"), estimate("d"));
    let entry = |a: f64, d: f64, q: f64| -> Vec<(f64, f64)> {
        let covariance = fit.correlations()[(0, 3)] * sa * sd;
        (0..=60)
            .map(|k| f64::from(k) / 40.0)
            .map(|p| {
                let s = p * p;
                let variance = sa * sa + 2.0 * s * covariance + s * s * sd * sd;
                (p, a + d * s + q * variance.sqrt())
            })
            .collect()
    };
    let metric = Panel::new("g₁₁", "p₁")
        .line("truth", entry(truth.x, truth.w, 0.0))
        .line("fit", entry(a, d, 0.0))
        .line("+ 2 errors", entry(a, d, 2.0))
        .line("− 2 errors", entry(a, d, -2.0));
    let figure = Panels::new("A metric from 240 numbers with a noise of 10⁻³")
        .panel(momentum)
        .panel(residuals)
        .panel(sensitivity)
        .panel(metric);
    let last = tangent.last();
    let report =
        example.report_of(tangent.certificate(), last.time, last.point.as_slice().to_vec());
    (fit.estimates.iter())
        .fold(report, |report, e| {
            report.with(e.name, e.value).with(&format!("{}_error", e.name), e.standard_error)
        })
        .with("noise", fit.noise)
        .with("runs", fit.runs)
        .with("tangent_law", tangent.sensitivity().energy)
        .figure(figure)
        .print()
}
