//! Two gas containers with a wall between them that moves: the second law under stress.
//!
//! The wall has mass 1, place `0 < q < 2` and momentum `p`, the gases on its two sides have energies
//! `U₁`, `U₂`, pressures `P₁ = 2U₁/3q`, `P₂ = 2U₂/3(2 − q)` and temperatures `T = 2U/3`, and a little
//! heat leaks through, `α = 10⁻³` (after Shang and Öttinger 2020, where `α = ½`):
//!
//! ```text
//! H = ½p² + U₁ + U₂,   q' = p,         U₁' = −P₁ p + α (1/T₁ − 1/T₂),
//! S = ln q(2 − q) + 3/2 ln U₁U₂,       p' = P₁ − P₂,   U₂' = P₂ p − α (1/T₁ − 1/T₂).
//! ```
//!
//! `S` is far from quadratic, and what the leak produces in a step is less than the error of the
//! step. The published scheme, with `Π dS` and `dS` at the midpoint, lowers `S` on half of the steps;
//! the exact one, with a discrete gradient of `S` in their place, on none. Both keep `H`.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Gallery, Options, Panel, Panels, print, write_csv};

const ALPHA: f64 = 1e-3;
type Space = Euclidean<4>;

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::read();
    let (count, h) = (options.steps_or(300), options.step_size_or(0.1));

    let adiabatic = |x: &Vector4<Real>| {
        let pressures = (x.z / x.x * (2.0 / 3.0), x.w / (-x.x + 2.0) * (2.0 / 3.0));
        let pushed = Vector4::new(1.0.into(), 0.0.into(), -pressures.0, pressures.1);
        pushed * Vector4::y().transpose() - Vector4::y() * pushed.transpose()
    };
    // For w = dH this is α [[1, −1], [−1, 1]] on (U₁, U₂); for any other w, K_w w = 0 too.
    let leak = |_: &Vector4<Real>, w: &Vector4<Real>| {
        let b = Vector4::new(0.0.into(), 0.0.into(), w.w, -w.z);
        b * b.transpose() * Real::from(ALPHA)
    };
    let run = |law| {
        let containers = System::on(Euclidean::<4>)
            .bracket(Poisson::field(adiabatic))
            .dissipation(FieldDissipation(leak))
            .energy(|x: &Vector4<Real>| x.y.powi(2) * 0.5 + x.z + x.w)
            .entropy(|x: &Vector4<Real>| (x.x * (-x.x + 2.0)).ln() + (x.z * x.w).ln() * 1.5)
            .second_law(law);
        let start = Vector4::new(1.0, 2.0, 2.0, 2.0);
        Ok::<_, Box<dyn Error>>(WeylMidpoint.run(&containers.build()?, start, Span::steps(h, count))?)
    };
    let (published, exact) = (run(SecondLaw::Published)?, run(SecondLaw::Casimir)?);

    let gallery = Gallery::open()?;
    let both = |title: &str, value: &dyn Fn(&[State<Space>]) -> Vec<(f64, f64)>| {
        let panel = Panel::new(title, "t").line("published", value(published.states()));
        panel.line("exact", value(exact.states())).level(0.0)
    };
    let line = |run: &[State<Space>], value: &dyn Fn(&State<Space>) -> f64| -> Vec<_> {
        run.iter().map(|state| (state.time, value(state))).collect()
    };
    let rises = |run: &[State<Space>]| -> Vec<_> {
        run.windows(2).map(|pair| (pair[1].time, pair[1].entropy - pair[0].entropy)).collect()
    };
    let gained = |run: &[State<Space>]| line(run, &|s| s.entropy - run[0].entropy);
    let error = |run: &[State<Space>]| line(run, &|s| s.energy - run[0].energy);
    let entry = |i: usize| line(exact.states(), &|s| s.point[i]);
    Panels::new(format!("Two gas containers, α = {ALPHA}, h = {h}"))
        .panel(
            Panel::new("place and momentum of the wall", "t")
                .line("q", entry(0))
                .line("p", entry(1)),
        )
        .panel(Panel::new("energies of the gases", "t").line("U₁", entry(2)).line("U₂", entry(3)))
        .panel(both("energy H − H₀", &error))
        .panel(both("entropy S − S₀", &gained))
        .panel(both("ΔS of each step", &rises))
        .panel(
            Panel::new("ΔS of each exact step", "t").line("ΔS", rises(exact.states())).level(0.0),
        )
        .save(gallery.path("gas_containers.svg"))?;
    let rows =
        exact.iter().map(|s| [s.time, s.point.x, s.point.y, s.point.z, s.point.w, s.entropy]);
    write_csv(gallery.path("gas_containers.csv"), ["t", "q", "p", "U1", "U2", "S"], rows)?;

    let runs = [("published", &published), ("exact", &exact)];
    if options.json {
        let mut report = serde_json::json!({});
        for (scheme, run) in runs {
            report[scheme] = serde_json::to_value(run.certificate())?;
            report[scheme]["max_relative_energy_error"] =
                run.certificate().max_relative_energy_error().into();
            report[scheme]["final_state"] = run.last().point.as_slice().into();
        }
        print(report)?;
    } else {
        for (scheme, run) in runs {
            print(format_args!("{scheme} scheme\n{}\n", run.certificate()))?;
        }
        print(format_args!("figure:       {}", gallery.path("gas_containers.svg").display()))?;
    }
    Ok(())
}
