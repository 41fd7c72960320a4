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
use metriplectic_studies::{Gallery, Options, Panel, Panels, Report, print};

type Space = Product<Euclidean<8>, Euclidean<2>>;
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
    let options = Options::read();
    let (count, h) = (options.steps_or(800), options.step_size_or(0.05));

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
    let run = WeylMidpoint.run(&pendulum, start, Span::steps(h, count))?;

    let (certificate, end) = (run.certificate(), run.last());
    let path = Gallery::open()?.path("thermoelastic_pendulum.svg");
    let line = |value: &dyn Fn(&State<Space>) -> f64| -> Vec<_> {
        run.iter().map(|state| (state.time, value(state))).collect()
    };
    let orbit = |i: usize| run.iter().map(|s| (s.point.0[i], s.point.0[i + 1])).collect::<Vec<_>>();
    let theta = |i: usize| line(&|s| (s.point.1 - stretch(&s.point))[i].exp());
    let gained = line(&|s| s.energy - certificate.initial_energy);
    let turned = line(&|s| angular_momentum(&s.point) - 2.0);
    let motion = Panel::new("the motion", "x").vertical("y").equal().line("q₁", orbit(0));
    Panels::new(format!("The thermoelastic double pendulum, h = {h}"))
        .panel(motion.line("q₂", orbit(2)).line("threads at t = 0", [(0.0, 0.0), (2.2, 0.0)]))
        .panel(Panel::new("temperatures", "t").line("θ₁", theta(0)).line("θ₂", theta(1)))
        .panel(Panel::new("entropy S", "t").line("S", line(&|s| s.entropy)))
        .panel(Panel::new("errors", "t").line("H − H₀", gained).line("L − L₀", turned).level(0.0))
        .save(&path)?;

    if options.json {
        Report::new(certificate, end)?.with("final_entropy", end.entropy).print()?;
    } else {
        print(format_args!("{certificate}\nat t = {:.1}:  S = {:.6}", end.time, end.entropy))?;
        print(format_args!("figure:      {}", path.display()))?;
    }
    Ok(())
}
