//! A molecule in a bath, in SI units: lengths of 10⁻¹⁰ m, momenta of 10⁻²³ kg m/s, entropies of 10⁻²² J/K.
//!
//! Hydrogen chloride vibrates in the potential of Morse (1929), and friction heats a bath of heat capacity
//! `C`. With `x = (r, p, s)`, `S = s`, `T = ∂H/∂s`, `K = (γ/w_s) b bᵀ` and `b = (0, w_s, −w_p)`,
//!
//! ```text
//! H = ½p²/μ + D (1 − e^{−a(r − r₀)})² + C T₀ e^{s/C},   r' = p/μ,   p' = −V'(r) − γ p/μ,   s' = γ (p/μ)²/T .
//! ```
//!
//! Nothing is scaled by hand, and nothing in the library assumes a size: a twin of the run, in units of `1/a`,
//! `D`, `μ` and `T₀`, is the same motion up to `h²`. At rest `r = r₀` and `C T = H₀`. Data: `r₀` and `ω` from
//! Huber and Herzberg (1979), `D = 4.618 eV`, `a = ω √(μ/2D)`.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels, Record};

/// A run in the units of `μ`, `D`, `a`, `r₀`, `γ`, `C` and `T₀`, from a bond that is stretched by `½/a`.
fn run(
    [mu, d, a, r0, gamma, c, t0]: [f64; 7],
    example: &Example,
    span: Span,
) -> Result<Record<Euclidean<3>>, Box<dyn Error>> {
    let friction = move |_: &Vector3<Real>, w: &Vector3<Real>| {
        let b = Vector3::new(0.0.into(), w.z, -w.y);
        b * b.transpose() * (w.z.recip() * gamma)
    };
    let energy = move |x: &Vector3<Real>| {
        let stretch = -((-x.x + r0) * a).exp() + 1.0;
        x.y.powi(2) * (0.5 / mu) + stretch.powi(2) * d + (x.z / c).exp() * (c * t0)
    };
    let system = System::on(Euclidean::<3>)
        .bracket(Poisson::constant(matrix![0.0, 1.0, 0.0; -1.0, 0.0, 0.0; 0.0, 0.0, 0.0])?)
        .energy(energy)
        .entropy(|x: &Vector3<Real>| x.z)
        .dissipation(FieldDissipation(friction))
        .build()?;
    example.run(&system, vector![r0 + 0.5 / a, 0.0, 0.0], span.at_most(2000))
}

fn main() -> Result<(), Box<dyn Error>> {
    // In kg, J, 1/m, m, kg/s, J/K and K; then without units.
    let [mu, d, a, r0, gamma, c, t0] =
        [1.6266e-27, 7.399e-19, 1.868e10, 1.2746e-10, 3e-14, 1.38e-21, 300.0];
    let time = (mu / d).sqrt() / a;
    let reduced = [1.0, 1.0, 1.0, r0 * a, gamma * time / mu, c * t0 / d, 1.0];

    let about = "Hydrogen chloride vibrates and warms a bath, in SI units and without units.";
    let example = Example::new(about, 4000, 1e-16);
    let (count, h) = (example.steps, example.step_size);
    let si = run([mu, d, a, r0, gamma, c, t0], &example, Span::steps(h, count))?;
    let twin = run(reduced, &example, Span::steps(h / time, count))?;

    let apart = si.states.iter().zip(&twin.states);
    let apart = apart.map(|(s, t)| (s.point.x * a - t.point.x).abs()).fold(0.0, f64::max);
    let temperature = |state: &State<Euclidean<3>>| t0 * (state.point.z / c).exp();
    let (energy, last) = (si.certificate.initial_energy, temperature(si.last()));
    let panel = |quantity: &str, unit: &str, value: &dyn Fn(&State<Euclidean<3>>) -> f64| {
        let points: Vec<_> = si.states.iter().map(|s| (s.time * 1e15, value(s))).collect();
        Panel::new(quantity, "t (fs)").unit(unit).line(quantity, points)
    };
    let bond = panel("bond length r", "pm", &|s| s.point.x * 1e12);
    let figure = Panels::new(format!("Hydrogen chloride in a bath, in SI units, h = {h:.0e} s"))
        .panel(bond.named_level("r₀, at rest", r0 * 1e12))
        .panel(panel("temperature T", "K", &temperature).named_level("H₀/C, at rest", energy / c))
        .panel(panel("entropy S", "J/K", &|s| s.entropy))
        .panel(panel("energy H − H₀", "J", &|s| s.energy - energy).level(0.0));
    example
        .report(&si)
        .with("apart", apart)
        .with("temperature", last)
        .with("temperature_at_rest", energy / c)
        .figure(figure)
        .print()
}
