//! Heat through a chain of Fermi, Pasta, Ulam and Tsingou, `x = (q, p, s)` at each of 10⁴ sites.
//!
//! Half of the ring is hot. Heat diffuses, and the thermal stress `a (s_i + s_j)` sends sound to both sides. With
//! `e = c exp(s/c)`, `c = 2`, the temperature `T = exp(s/c)` obeys `c T' = κ ΔT` up to the small heat of
//! compression, and the sound behind its fronts has the velocity `v = a s_hot / c₀`, `c₀ = 1`:
//!
//! ```text
//! T = 1 + ½ (T_hot − 1) erfc(x/√(4κt/c)),   v = a s_hot for |x| < t .
//! ```

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels};

const SITES: usize = 10_000;
const STRESS: f64 = 0.01;
const CONDUCTIVITY: f64 = 2.0;
const CAPACITY: f64 = 2.0;
const HOT: f64 = 1.2;

fn main() -> Result<(), Box<dyn Error>> {
    let canonical = matrix![0.0, 1.0, 0.0; -1.0, 0.0, 0.0; 0.0, 0.0, 0.0];
    let chain = Lattice::on(Graph::ring(SITES), Euclidean::<3>)
        .bracket(Poisson::constant(canonical)?)
        .energy(|x: &Vector3<Real>| x.y.powi(2) * 0.5 + (x.z / CAPACITY).exp() * CAPACITY)
        .bond_energy(|(x, y): &(Vector3<Real>, Vector3<Real>)| {
            let r = y.x - x.x;
            r.powi(2) * 0.5 + r.powi(3) / 12.0 + r.powi(4) * 0.25 - r * (x.z + y.z) * STRESS
        })
        .entropy(|x: &Vector3<Real>| x.z)
        .bond_onsager(|bond| {
            // (force, velocity, temperature) at both ends.
            let [u, v] = bond.w;
            let slip = 0.5 * (v.y - u.y);
            let warm = [vector![0.0, -1.0, -slip / u.z], vector![0.0, 1.0, -slip / v.z]];
            let flow = [vector![0.0, 0.0, 1.0 / u.z], vector![0.0, 0.0, -1.0 / v.z]];
            [
                Onsager { rate: 0.1 * u.z * v.z / (u.z + v.z), b: warm },
                Onsager { rate: CONDUCTIVITY * u.z * v.z, b: flow },
            ]
        })
        .conserved(|x: &Vector3<Real>| x.y)
        .build()?;
    let hot = CAPACITY * HOT.ln();
    let start = chain.points(|i| vector![0.0, 0.0, if i < SITES / 2 { hot } else { 0.0 }]);

    let about = "Heat through a chain of 10⁴ sites, beside erfc and the fronts of sound.";
    let example = Example::new(about, 2000, 0.5);
    let mut run = DormandPrince5.steps(&chain, start, example.step_size)?;
    for _ in 0..example.steps {
        run.advance()?;
    }
    let (certificate, end) = (run.certificate(), run.state());
    let (t, middle) = (end.time, SITES / 2);
    let temperature = |i: usize| (end.point[i].z / CAPACITY).exp();
    let profile = |width: usize, f: &dyn Fn(usize) -> f64| -> Vec<(f64, f64)> {
        (middle - width..middle + width).map(|i| (i as f64 - middle as f64, f(i))).collect()
    };
    // Σ_j of the discrete kernel is erfc at half sites.
    let spread = (4.0 * CONDUCTIVITY * t / CAPACITY).sqrt();
    let diffused =
        |i: usize| 1.0 + 0.5 * (HOT - 1.0) * erfc((i as f64 + 0.5 - middle as f64) / spread);
    let width = SITES / 40;
    let apart = |i: usize| (temperature(i) - diffused(i)).abs();
    let error = (middle - width..middle + width).map(apart).fold(0.0, f64::max);
    let wide = SITES / 4;
    let sound = |i: usize| if (i.abs_diff(middle) as f64) < t { STRESS * hot } else { 0.0 };
    let figure = Panels::new(format!("Heat and sound in a chain of {SITES} sites at t = {t:.0}"))
        .panel(
            Panel::new("temperature T", "site")
                .line("erfc", profile(width, &diffused))
                .line("chain", profile(width, &temperature)),
        )
        .panel(
            Panel::new("velocity v", "site")
                .line("closed form", profile(wide, &sound))
                .line("chain", profile(wide, &|i| end.point[i].y)),
        );
    let entries = [0, wide, middle].map(temperature).to_vec();
    let report = example.report_of(certificate, t, entries);
    report
        .with("temperature_error", error)
        .with("velocity", end.point[middle].y)
        .figure(figure)
        .print()
}

/// The complementary error function, by its series and its continued fraction.
fn erfc(x: f64) -> f64 {
    if x < 0.0 {
        return 2.0 - erfc(-x);
    }
    let scale = (-x * x).exp() / std::f64::consts::PI.sqrt();
    if x > 2.5 {
        return scale / (1..60).rev().fold(x, |tail, k| x + 0.5 * f64::from(k) / tail);
    }
    let mut term = 2.0 * x * scale;
    1.0 - (1..80).fold(term, |sum, k| {
        term *= 2.0 * x * x / f64::from(2 * k + 1);
        sum + term
    })
}
