//! The thermoelastic double pendulum: heat, two laws and a symmetry.
//!
//! Two unit masses hang on two elastic threads, from a pivot to `q₁` and from `q₁` to `q₂`, in a plane
//! without gravity. A thread of length `λ` and entropy `s` has the temperature `θ = e^s/λ` and the
//! energy `e = ½ ln²λ + ln λ + θ − 1`, and heat flows between them (Romero 2009, all constants 1):
//!
//! ```text
//! H = ½|p₁|² + ½|p₂|² + e₁ + e₂,   S = s₁ + s₂,   K = [[θ₂/θ₁, −1], [−1, θ₁/θ₂]] on (s₁, s₂) .
//! ```
//!
//! `K = b bᵀ/θ₁θ₂` with `b = (θ₂, −θ₁)` is written for the covector `w` that it has to kill: in a step
//! `θ_i = ∂H/∂s_i` is `w_{s_i}`. The bracket is canonical, so `s₁` and `s₂` are its Casimirs. Turning
//! everything about the pivot changes nothing: the angular momentum `L = q₁ × p₁ + q₂ × p₂` is kept.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Gallery, Options, Panel, Panels, print};

type Space = Product<Euclidean<8>, Euclidean<2>>;
/// `(q₁, p₁ ∈ R²)`
type Point<D> = (SVector<D, 8>, Vector2<D>);

/// The logarithms of the lengths of the threads.
fn logarithms(q: &SVector<Real, 8>) -> [Real; 2] {
    let length = |x: Real, y: Real| (x.powi(2) + y.powi(2)).ln() * 0.5;
    [length(q[0], q[1]), length(q[2] - q[0], q[3] - q[1])]
}

/// `L = q₁ × p₁ + q₂ × p₂`
fn angular_momentum<D: Scalar>((x, _): &Point<D>) -> D {
    x[0] * x[5] - x[1] * x[4] + x[2] * x[7] - x[3] * x[6]
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::read();
    let (count, h) = (options.steps_or(800), options.step_size_or(0.05));

    let thread = |log: Real, s: Real| log.powi(2) * 0.5 + log + (s - log).exp() - 1.0;
    let conduction = |_: &Point<Real>, w: &SVector<Real, 10>| {
        let mut b = SVector::<Real, 10>::zeros();
        (b[8], b[9]) = (w[9], -w[8]);
        b * b.transpose() * (w[8] * w[9]).recip()
    };
    let pendulum = System::on(Product(Euclidean::<8>, Euclidean::<2>))
        .bracket((Symplectic, Zero))
        .dissipation(FieldDissipation(conduction))
        .energy(|(x, s): &Point<Real>| {
            let [first, second] = logarithms(x);
            x.fixed_rows::<4>(4).norm_squared() * 0.5 + thread(first, s.x) + thread(second, s.y)
        })
        .entropy(|(_, s): &Point<Real>| s.x + s.y)
        .build()?;
    let start = (vector![1.0, 0.0, 2.2, 0.0, 0.0, 2.0, 1.0, 0.0], Vector2::new(1.0, 0.2));
    let run = WeylMidpoint.run(&pendulum, start, Span::steps(h, count).at_most(1000))?;
    let (certificate, end) = (run.certificate(), run.last());
    let energy = certificate.initial_energy;
    let turned = |s: &State<Space>| angular_momentum(&s.point) - 2.0;
    let worst = run.iter().map(|s| turned(s).abs()).fold(0.0, f64::max);

    let gallery = Gallery::open()?;
    let line = |value: &dyn Fn(&State<Space>) -> f64| -> Vec<_> {
        run.iter().map(|state| (state.time, value(state))).collect()
    };
    let path = |i: usize| run.iter().map(|s| (s.point.0[i], s.point.0[i + 1])).collect::<Vec<_>>();
    let temperature =
        |s: &State<Space>, i: usize| (s.point.1[i] - logarithms(&s.point.0.cast())[i].re).exp();
    let motion = Panel::new("the masses, until t = 10", "x").vertical("y").equal();
    let temperatures = Panel::new("temperatures of the threads", "t")
        .line("θ₁", line(&|s| temperature(s, 0)))
        .line("θ₂", line(&|s| temperature(s, 1)));
    Panels::new(format!("The thermoelastic double pendulum, h = {h}"))
        .panel(motion.line("q₁", path(0)).line("q₂", path(2)))
        .panel(temperatures)
        .panel(Panel::new("entropy S", "t").line("S", line(&|s| s.entropy)))
        .panel(Panel::new("energy H − H₀", "t").line("H", line(&|s| s.energy - energy)).level(0.0))
        .panel(Panel::new("angular momentum L − L₀", "t").line("L", line(&turned)).level(0.0))
        .save(gallery.path("thermoelastic_pendulum.svg"))?;

    if options.json {
        let mut report = serde_json::to_value(certificate)?;
        report["max_relative_energy_error"] = certificate.max_relative_energy_error().into();
        report["max_momentum_error"] = worst.into();
        report["final_state"] = Space::entries(&end.point).into();
        print(report)?;
    } else {
        print(format_args!("{certificate}\nangular:      |L − L₀| ≤ {worst:.1e} of L₀ = 2"))?;
        print(format_args!("at t = {:.1}:   S = {:.6}", end.time, end.entropy))?;
        print(format_args!(
            "figure:       {}",
            gallery.path("thermoelastic_pendulum.svg").display()
        ))?;
    }
    Ok(())
}
