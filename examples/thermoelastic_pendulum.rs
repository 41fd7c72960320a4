//! The thermoelastic double pendulum: heat, both laws and a symmetry.
//!
//! A pivot holds a unit mass at `q₁` by an elastic thread, and that mass another one at `q₂`, in a
//! plane without gravity. A thread of length `λ` and entropy `s` has the temperature `θ = e^s/λ` and
//! the energy `e = ½ ln²λ + ln λ + θ − 1`. Heat flows between them (Romero 2009, constants all 1):
//!
//! ```text
//! H = ½|p₁|² + ½|p₂|² + e₁ + e₂,   S = s₁ + s₂,   K = [[θ₂/θ₁, −1], [−1, θ₁/θ₂]] on (s₁, s₂) .
//! ```
//!
//! `K` takes its `θᵢ = w_{sᵢ}` from the covector `w` that it has to annihilate. `L = Σ qᵢ × pᵢ` is kept too.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels};

type Point<D> = (SVector<D, 8>, Vector2<D>); // ((q₁, q₂, p₁, p₂), (s₁, s₂))

/// The logarithms of the lengths of the threads.
fn stretch<D: Scalar>((x, _): &Point<D>) -> Vector2<D> {
    let squares = [x[0].powi(2) + x[1].powi(2), (x[2] - x[0]).powi(2) + (x[3] - x[1]).powi(2)];
    Vector2::from(squares.map(|square| square.ln() * 0.5))
}

fn angular_momentum<D: Scalar>((x, _): &Point<D>) -> D {
    x[0] * x[5] - x[1] * x[4] + x[2] * x[7] - x[3] * x[6]
}

fn main() -> Result<(), Box<dyn Error>> {
    let conduction = |_: &Point<Real>, w: &SVector<Real, 10>| {
        let b = SVector::<Real, 10>::ith(8, w[9]) - SVector::<Real, 10>::ith(9, w[8]);
        b * b.transpose() * (w[8] * w[9]).recip()
    };
    let pendulum = System::on(Product(Euclidean::<8>, Euclidean::<2>))
        .bracket((Symplectic, Zero))
        .dissipation(FieldDissipation(conduction))
        .energy(|x: &Point<Real>| {
            let (log, p) = (stretch(x), x.0.fixed_rows::<4>(4));
            let heat = (x.1 - log).map(|log_theta| log_theta.exp());
            (p.norm_squared() + log.norm_squared()) * 0.5 + (log + heat).sum() - 2.0
        })
        .entropy(|(_, s): &Point<Real>| s.x + s.y)
        .momentum(angular_momentum)
        .build()?;
    let start = (vector![1.0, 0.0, 2.2, 0.0, 0.0, 2.0, 1.0, 0.0], Vector2::new(1.0, 0.2));

    let about = "The thermoelastic double pendulum: heat, both laws and a symmetry.";
    let example = Example::new(about, 800, 0.05);
    let run = example.run(&pendulum, start, Span::steps(example.step_size, example.steps))?;

    let orbit = |i: usize| -> Vec<_> {
        run.states.iter().map(|s| (s.point.0[i], s.point.0[i + 1])).collect()
    };
    let theta = |i: usize| run.series(|s| (s.point.1 - stretch(&s.point))[i].exp());
    let motion = Panel::new("y", "x").equal().line("q₁", orbit(0)).line("q₂", orbit(2));
    let errors = Panel::new("errors", "t")
        .line("H − H₀", run.energy_errors())
        .line("L − L₀", run.series(|s| angular_momentum(&s.point) - 2.0))
        .level(0.0);
    let title = format!("The thermoelastic double pendulum, h = {}", example.step_size);
    let figure = Panels::new(title)
        .panel(motion.line("threads at t = 0", [(0.0, 0.0), (2.2, 0.0)]))
        .panel(Panel::new("temperatures", "t").line("θ₁", theta(0)).line("θ₂", theta(1)))
        .panel(run.panel("entropy S", |s| s.entropy))
        .panel(errors);
    let entropy = run.last().entropy;
    example.report(&run).with("final_entropy", entropy).figure(figure).print()
}
