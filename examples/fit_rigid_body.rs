//! A fit: the moments of inertia and the friction of a body from noisy data of its angular momentum.
//!
//! The body is `H = ½ Σ p_i²/I_i` on so(3)*, with the entropy `S = γ |p|²/2`, so that friction brings it to its longest axis at a
//! constant energy. Each of 80 rows has a noise of 10⁻³. The derivatives of a run along `I` and `γ` are those of its steps, so
//! Levenberg and Marquardt's method needs one run an iteration, and each run keeps both laws.
//!
//! The ellipse holds the pair `(I₁, I₂)` with a probability of 95 % if the model is right. It is so thin because the data say much
//! about ratios of inertias and less about their size.

use std::error::Error;
use std::f64::consts::TAU;

use metriplectic::manifolds::rand::rngs::ChaCha8Rng;
use metriplectic::manifolds::rand::{RngExt, SeedableRng};
use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels};

/// The noise of each number.
const NOISE: f64 = 1e-3;

/// The quantile of `χ²` with two degrees of freedom at 95 %, `−2 ln 0.05`.
const ELLIPSE: f64 = 5.991;

fn main() -> Result<(), Box<dyn Error>> {
    let family = Family::on(LieDual::so3())
        .parameters(["I1", "I2", "I3", "friction"])
        .energy(|p: &Vector3<Real>, t: &Vector4<Real>| {
            (p.x * p.x / t.x + p.y * p.y / t.y + p.z * p.z / t.z) * 0.5
        })
        .entropy(|p: &Vector3<Real>, t: &Vector4<Real>| p.norm_squared() * t.w * 0.5)
        .build()?;
    let (start, truth) = (vector![0.4, -1.0, 0.3], vector![3.0, 2.0, 1.0, 0.08]);

    let about = "A body's inertias and friction, from noisy data of its angular momentum.";
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

    let guess = vector![2.6, 2.3, 1.2, 0.03];
    let fit = Fit::of(&family)
        .observe(|p: &Vector3<Real>| *p)
        .data(&times, &data)
        .positive_all()
        .start_at(start)
        .run(DormandPrince8, example.span(), guess)?;
    if !example.json {
        println!("{fit}\n");
    }

    let best = family.at(Vector4::from_column_slice(&fit.parameters));
    let tangent = DormandPrince8.tangent(&best, start, example.span())?;
    let measured = |i: usize| -> Vec<(f64, f64)> {
        times.iter().zip(&data).map(|(t, p)| (*t, p[i])).collect()
    };
    let fitted = |i: usize| -> Vec<(f64, f64)> {
        tangent.states().iter().map(|state| (state.time, state.point[i])).collect()
    };
    let momentum = (0..3)
        .fold(Panel::new("momentum", "t"), |panel, i| panel.line(format!("p{}", i + 1), fitted(i)));
    let residuals = (0..3).fold(Panel::new("(data − fit) / 10⁻³", "t"), |panel, i| {
        let off: Vec<(f64, f64)> = (measured(i).iter().zip(&fitted(i)[1..]))
            .map(|((t, data), (_, fit))| (*t, (data - fit) / NOISE))
            .collect();
        panel.line(format!("p{}", i + 1), off)
    });
    let sensitivity = ["I1", "I2", "I3", "friction"].into_iter().zip(0..).fold(
        Panel::new("|θ ∂p/∂θ|", "t").logarithmic(1e-4),
        |panel, (name, k)| {
            let along: Vec<(f64, f64)> = (tangent.states().iter())
                .map(|state| {
                    let column = state.along(name).map_or(0.0, |column| column.norm());
                    (state.time, column * fit.parameters[k])
                })
                .collect();
            panel.line(name, along)
        },
    );
    let estimate =
        |name: &str| fit.estimate(name).map_or([0.0; 2], |e| [e.value, e.standard_error]);
    let ([a, sa], [b, sb]) = (estimate("I1"), estimate("I2"));
    let correlation = fit.correlations()[(0, 1)];
    // The ellipse by the Cholesky factor of the covariance.
    let ellipse: Vec<(f64, f64)> = (0..=200)
        .map(|k| {
            let (sine, cosine) = (TAU * f64::from(k) / 200.0).sin_cos();
            let radius = ELLIPSE.sqrt();
            let across = (1.0 - correlation * correlation).sqrt();
            (a + sa * radius * cosine, b + sb * radius * (correlation * cosine + across * sine))
        })
        .collect();
    let cross = |x: f64, y: f64| vec![(x - 0.2 * sa, y), (x + 0.2 * sa, y)];
    let inertias = Panel::new("I₂", "I₁")
        .line("95 %", ellipse)
        .line("truth", cross(truth.x, truth.y))
        .line("fit", cross(a, b));
    let figure = Panels::new("A rigid body from 240 numbers with a noise of 10⁻³")
        .panel(momentum)
        .panel(residuals)
        .panel(sensitivity)
        .panel(inertias);
    let last = tangent.last();
    example
        .report_of(tangent.certificate(), last.time, last.point.as_slice().to_vec())
        .with("I1", a)
        .with("I1_error", sa)
        .with("friction", estimate("friction")[0])
        .with("friction_error", estimate("friction")[1])
        .with("noise", fit.noise)
        .with("runs", fit.runs)
        .with("tangent_law", tangent.sensitivity().energy)
        .figure(figure)
        .print()
}
