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
use metriplectic_studies::{Gallery, Options, Panel, Panels, Report, print};

const INERTIA: Vector3<f64> = Vector3::new(3.0, 2.0, 1.0);
const START: Vector3<f64> = Vector3::new(0.3, 0.5, 2.0);
const GAIN: f64 = 0.2;
type Body = LieDual<3>;

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::read();
    let (count, h) = (options.steps_or(1500), options.step_size_or(0.02));

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
    let span = Span::steps(h, count);
    let run = WeylMidpoint.run(&stabilised, START, span)?;
    let other = WeylMidpoint.run(&stirred, START, span)?;

    let (gallery, certificate) = (Gallery::open()?, run.certificate());
    // C' by its formula at the middle of each step, and ΔC/h.
    let formula = |pair: &[State<Body>]| {
        let p = (pair[0].point + pair[1].point) * 0.5;
        let k = (p.component_div(&INERTIA).cross(&p) * GAIN).norm_squared();
        (pair[0].time + 0.5 * h, k / (GAIN * (1.0 + k).sqrt()))
    };
    let rise = |pair: &[State<Body>]| (pair[1].entropy - pair[0].entropy) / h;
    let formulas: Vec<_> = run.states().windows(2).map(formula).collect();
    let rates: Vec<_> = run.states().windows(2).map(|s| (formula(s).0, rise(s))).collect();
    let worst = formulas.iter().zip(&rates).map(|(a, b)| (a.1 - b.1).abs()).fold(0.0, f64::max);

    let both = |title: &str, value: &dyn Fn(&State<Body>) -> f64| {
        let line = |run: &Trajectory<Body>| -> Vec<_> {
            run.iter().map(|state| (state.time, value(state))).collect()
        };
        Panel::new(title, "t").line("feedback", line(&run)).line("vortex", line(&other))
    };
    let energy = certificate.initial_energy;
    let rates = Panel::new("feedback: C'", "t").line("formula", formulas).line("ΔC/h", rates);
    Panels::new(format!("A feedback torque that saturates, and a vortex, h = {h}"))
        .panel(both("momentum p₁", &|s| s.point.x))
        .panel(both("Casimir C, dashed H I₁", &|s| s.entropy).level(energy * INERTIA.x))
        .panel(rates)
        .panel(both("energy H − H₀", &|s| s.energy - energy).level(0.0))
        .save(gallery.path("feedback_torque.svg"))?;

    if options.json {
        let report = Report::new(certificate, run.last())?.with("rate_error", worst);
        report.with("vortex", serde_json::to_value(other.certificate())?).print()?;
    } else {
        print(format_args!("feedback\n{certificate}\nvortex\n{}", other.certificate()))?;
        print(format_args!("|ΔC/h − C'| ≤ {worst:.1e}"))?;
        print(format_args!("figure:      {}", gallery.path("feedback_torque.svg").display()))?;
    }
    Ok(())
}
