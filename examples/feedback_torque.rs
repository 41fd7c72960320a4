//! A feedback torque that saturates: a force of your own in the Euler-Poincaré equations.
//!
//! A body on so(3)* is stabilised about its axis of largest inertia by a torque that does no work,
//!
//! ```text
//! p' = (p + 𝓕(Ω)) × Ω,   p = IΩ,   H = ½Ω·IΩ,   C = ½|p|²,   C' = 𝓕(Ω)·(Ω × p) .
//! ```
//!
//! `H` is conserved whatever `𝓕` is (Bloch, Farré Puiggalí and Martín de Diego 2024, §3). With the command
//! `k = g Ω × IΩ` the actuator gives `𝓕 = k/√(1 + |k|²)`, which is never larger than 1 and not the force of
//! a form: `C' = |k|²/(g√(1 + |k|²)) ≥ 0`, and `C` is the entropy. A second body is stirred by a vortex about
//! `e₁`, `𝓕 = Ω₃ e₁ × Ω`: `C` rises and falls, and the certificate promises nothing of it.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels};

const INERTIA: Vector3<f64> = Vector3::new(3.0, 2.0, 1.0);
const GAIN: f64 = 0.2;
type Body = LieDual<3>;

fn main() -> Result<(), Box<dyn Error>> {
    let saturated = |omega: &Vector3<Real>| {
        let k = omega.cross(&omega.component_mul(&INERTIA.cast())) * Real::from(GAIN);
        k * (k.norm_squared() + 1.0).sqrt().recip()
    };
    let vortex = |omega: &Vector3<Real>| Vector3::x().cross(omega) * omega.z;
    let body = System::on(LieDual::so3())
        .lagrangian(|omega: &Vector3<Real>| omega.component_mul(omega).dot(&INERTIA.cast()) * 0.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5);
    let stabilised = body.clone().force(saturated).build()?;
    let stirred = body.force(vortex).second_law(SecondLaw::Published).build()?;
    let start = Vector3::new(0.3, 0.5, 2.0);

    let about = "A saturated feedback torque stabilises a body, a vortex stirs another one.";
    let example = Example::new(about, 1500, 0.02);
    let h = example.step_size;
    let run = example.run(&stabilised, start, Span::steps(h, example.steps))?;
    let other = example.run(&stirred, start, Span::steps(h, example.steps))?;

    // C' by its formula at the middle of each step, and ΔC/h.
    let formula = |pair: &[State<Body>]| {
        let p = (pair[0].point + pair[1].point) * 0.5;
        let k = (p.component_div(&INERTIA).cross(&p) * GAIN).norm_squared();
        (pair[0].time + 0.5 * h, k / (GAIN * (1.0 + k).sqrt()))
    };
    let rise = |pair: &[State<Body>]| (pair[1].entropy - pair[0].entropy) / h;
    let formulas: Vec<_> = run.states.windows(2).map(formula).collect();
    let rates: Vec<_> = run.states.windows(2).map(|s| (formula(s).0, rise(s))).collect();
    let worst = formulas.iter().zip(&rates).map(|(a, b)| (a.1 - b.1).abs()).fold(0.0, f64::max);

    let both = |quantity: &str, value: &dyn Fn(&State<Body>) -> f64| {
        let panel = Panel::new(quantity, "t").line("feedback", run.series(value));
        panel.line("vortex", other.series(value))
    };
    let energy = run.certificate.initial_energy;
    let rates = Panel::new("rate C' with feedback", "t").line("ΔC/h", rates);
    let figure = Panels::new(format!("A feedback torque that saturates, and a vortex, h = {h}"))
        .panel(both("angular momentum p₁", &|s| s.point.x))
        .panel(both("Casimir C", &|s| s.entropy).named_level("H I₁", energy * INERTIA.x))
        .panel(rates.line("formula", formulas))
        .panel(both("energy H − H₀", &|s| s.energy - energy).level(0.0));
    example
        .report(&run)
        .with("rate_error", worst)
        .certificate("vortex", &other.certificate)
        .figure(figure)
        .print()
}
