//! Two gas containers that exchange volume and heat, in entropies: a problem of the learning literature.
//!
//! The model, its start and the errors of learned models are those of Gruber, Gunzburger, Ju and Wang (2021),
//! arXiv:2110.03442, who take it from Shang and Öttinger (2020). The state is the place and the momentum of the wall, and
//! the entropies of the gases; `T_i = ∂H/∂S_i`, and heat flows with `g = 8`:
//!
//! ```text
//! H = ½p² + U₁ + U₂,   U₁ = (e^{S₁}/q)^{2/3},   U₂ = (e^{S₂}/(2 − q))^{2/3},
//! S = S₁ + S₂,         S₁' = g/T₁ (1/T₁ − 1/T₂),   S₂' = g/T₂ (1/T₂ − 1/T₁) .
//! ```

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels, Record, Table};

const CONDUCTION: f64 = 8.0;
/// `(q, p, S₁, S₂)` at `t = 8`, by `SciPy`'s DOP853 and Radau, which agree to these digits.
const REFERENCE: [f64; 4] =
    [0.98124602254157, -0.08052345768301, 2.25535400537030, 2.23944457420009];
/// Relative errors of models of two and of three variables that were learned from this flow, by three methods.
const PUBLISHED: [[&str; 3]; 2] = [["0.1584", "0.1600", "0.5896"], ["0.0746", "0.0730", "0.0681"]];

fn energies<D: Scalar>(x: &SVector<D, 4>) -> [D; 2] {
    let gas = |s: D, volume: D| ((s - volume.ln()) * (2.0 / 3.0)).exp();
    [gas(x.z, x.x), gas(x.w, -x.x + 2.0)]
}

fn main() -> Result<(), Box<dyn Error>> {
    let canonical =
        matrix![0.0, 1.0, 0.0, 0.0; -1.0, 0.0, 0.0, 0.0; 0.0, 0.0, 0.0, 0.0; 0.0, 0.0, 0.0, 0.0];
    // K = g b bᵀ/(T₁T₂)² with b = (T₂, −T₁) on the entropies; the temperatures are entries of the covector.
    let conduction = |_: &Vector4<Real>, w: &Vector4<Real>| {
        let b = Vector4::new(0.0.into(), 0.0.into(), w.w, -w.z);
        b * b.transpose() * ((w.z * w.w).powi(-2) * CONDUCTION)
    };
    let gas = System::on(Euclidean::<4>)
        .bracket(Poisson::constant(canonical)?)
        .dissipation(FieldDissipation(conduction))
        .energy(|x: &Vector4<Real>| x.y.powi(2) * 0.5 + energies(x)[0] + energies(x)[1])
        .entropy(|x: &Vector4<Real>| x.z + x.w)
        .build()?;
    let start = vector![0.9, -0.4, 2.4, 2.0];

    let about = "Two gases exchange volume and heat: a problem of the learning literature.";
    let example = Example::new(about, 160, 0.05);
    let span = Span::until(example.step_size * example.steps as f64).tolerance(1e-13);
    let run = DormandPrince8.run(&gas, start, span.output_every(example.step_size))?;
    let run =
        Record { states: run.iter().cloned().collect(), certificate: run.certificate().clone() };
    let coarse = example.run(&gas, start, example.span())?;

    let error = |x: &Vector4<f64>| {
        let reference = Vector4::from(REFERENCE);
        (x - reference).norm() / reference.norm()
    };
    let errors = [&coarse, &run].map(|run| error(&run.last().point));
    let mut table = Table::new(["model", "relative error"]);
    for (name, by_method) in ["of 2 variables", "of 3 variables"].into_iter().zip(PUBLISHED) {
        table.row([format!("learned, {name}: as published"), by_method.join(", ")]);
    }
    for (name, error) in
        ["WeylMidpoint, 160 steps, at t = 8", "DormandPrince8, at t = 8"].into_iter().zip(errors)
    {
        table.row([name.to_owned(), format!("{error:.1e}")]);
    }
    let begin = run.states[0].energy;
    let figure = Panels::new(format!("Two gas containers in entropies, g = {CONDUCTION}"))
        .panel(run.panel("position q of the wall", |s| s.point.x).level(1.0))
        .panel(
            Panel::new("energies of the gases", "t")
                .line("U₁", run.series(|s| energies(&s.point)[0]))
                .line("U₂", run.series(|s| energies(&s.point)[1])),
        )
        .panel(run.panel("entropy S", |s| s.entropy))
        .panel(
            Panel::new("energy H − H₀", "t")
                .line("DormandPrince8", run.series(|s| s.energy - begin))
                .line("WeylMidpoint", coarse.series(|s| s.energy - begin))
                .level(0.0),
        );
    example.report(&run).text(table).with("errors", errors.to_vec()).figure(figure).print()
}
