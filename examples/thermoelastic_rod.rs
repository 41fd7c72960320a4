//! A thermoelastic rod: 250 masses in a periodic potential, with friction, and one entropy for all of them.
//!
//! The model, its data and the errors of learned reduced models are those of Gruber, Gunzburger, Ju and Wang (2021),
//! arXiv:2110.03442. The bath of all masses has the temperature 1, and its entropy `S` is its energy:
//!
//! ```text
//! H = Σ (½ p_i² + cos q_i) + S,   q_i' = p_i,   p_i' = sin q_i − γ p_i,   S' = γ Σ p_i²,   γ = 0.1 .
//! ```
//!
//! On a lattice each site has a share `s_i` of the entropy, which the friction of its own mass warms. Since `S = Σ s_i`
//! enters `H` by its sum alone, the motion is that of one entropy.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels, Table};

const MASSES: usize = 250;
const FRICTION: f64 = 0.1;
/// `(q₁, q₂₅₀, p₁, p₂₅₀, S)` at `t = 8` and `t = 48`, by `SciPy`'s DOP853 and LSODA, which agree to these digits.
const REFERENCES: [(f64, [f64; 5]); 2] = [
    (8.0, [1.73114905294, 3.10385392, 0.574655423218, 1.07008071085, 221.52983998683]),
    (48.0, [3.09510856972, 3.28859007363, 0.191064493102, 0.00792347682, 421.5128086722]),
];
/// Relative errors of reduced models that three methods have learned from this rod, over its whole course.
const PUBLISHED: [&str; 2] = ["0.0920, 0.182, 0.152", "0.0446, 0.0908, 1.073"];

fn main() -> Result<(), Box<dyn Error>> {
    let canonical = matrix![0.0, 1.0, 0.0; -1.0, 0.0, 0.0; 0.0, 0.0, 0.0];
    let rod = Lattice::on(Graph::from_bonds(MASSES, []), Euclidean::<3>)
        .bracket(Poisson::constant(canonical)?)
        .energy(|x: &Vector3<Real>| x.y.powi(2) * 0.5 + x.x.cos() + x.z)
        .entropy(|x: &Vector3<Real>| x.z)
        // Friction of p; the share of the entropy takes the heat: b·w = 0.
        .site_onsager(|site| [Onsager { rate: FRICTION, b: vector![0.0, -1.0, site.w.y] }])
        .build()?;
    let place = |i: usize| i as f64 / (MASSES - 1) as f64;
    let start = rod.points(|i| {
        let x = place(i);
        vector![(0.65 * x).exp(), (1.0 - 0.1 * x * x).recip(), 1.9 / MASSES as f64]
    });

    let about = "A rod of 250 masses that share one entropy, beside published references.";
    let example = Example::adaptive(about, 1.0);
    let until = Span::until(48.0).tolerance(1e-11).largest_step(example.step_size);
    let mut run = DormandPrince8.steps(&rod, start, until.output_every(0.5))?;
    let mut states = vec![run.state().clone()];
    while run.ending().is_none() && run.certificate().steps < example.steps {
        run.advance()?;
        states.extend(run.outputs().cloned());
    }

    let learned = ["learned, 10 variables", "learned, 20 variables"];
    let mut table = Table::new(["t", "this run", "of S", learned[0], learned[1]]);
    let mut errors = Vec::new();
    for (time, reference) in REFERENCES {
        let Some(state) = states.iter().find(|state| (state.time - time).abs() < 1e-9) else {
            continue;
        };
        let (first, last) = (&state.point[0], &state.point[MASSES - 1]);
        let values = [first.x, last.x, first.y, last.y, state.entropy];
        let error = |k: usize| (values[k] / reference[k] - 1.0).abs();
        errors.push((0..5).map(error).fold(0.0, f64::max));
        let [few, more] = PUBLISHED.map(str::to_owned);
        let [all, entropy] = [errors[errors.len() - 1], error(4)].map(|e| format!("{e:.1e}"));
        table.row([time.to_string(), all, entropy, few, more]);
    }
    let colour = [0.0, 2.0, 8.0, 48.0];
    let shape = colour
        .into_iter()
        .filter_map(|t| states.iter().find(|state| (state.time - t).abs() < 1e-9));
    let shape = shape.fold(Panel::new("position q", "place along the rod"), |panel, state| {
        let line: Vec<_> = state.point.iter().enumerate().map(|(i, x)| (place(i), x.x)).collect();
        panel.line(format!("t = {}", state.time), line)
    });
    let heat = |f: &dyn Fn(&State<_>) -> f64| -> Vec<(f64, f64)> {
        states.iter().map(|state| (state.time, f(state))).collect()
    };
    let initial = states[0].energy;
    let figure = Panels::new(format!("A thermoelastic rod, {MASSES} masses and one entropy"))
        .columns(3)
        .panel(shape)
        .panel(Panel::new("entropy S", "t").line("S", heat(&|s| s.entropy)))
        .panel(
            Panel::new("energy H − H₀", "t").line("H", heat(&|s| s.energy - initial)).level(0.0),
        );
    let end = run.state();
    example
        .report_of(run.certificate(), end.time, vec![end.point[0].x, end.point[0].y, end.entropy])
        .text("Largest relative errors; those of learned models are published, over the whole course:")
        .text(table)
        .with("errors", errors)
        .figure(figure)
        .print()
}
