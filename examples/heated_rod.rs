//! A rod whose first site touches an oven: a lattice with a bath at one end.
//!
//! Each of 400 sites has the energy `u`, its temperature, and the entropy `ln u`. Heat flows in a bond as `v − u`, and from
//! an oven at `T = 2` into the first site as `2 (T − u)`, through half a site. So `u` obeys the equation of heat, and until
//! the far end is warm
//!
//! ```text
//! u = 1 + erfc(x/√(4t)),   Q = 2 √(t/π),   oven: S_b = −Q/T .
//! ```
//!
//! The heat in the ledger is the energy that the rod has gained, to round-off, and the entropy of rod and oven rises in
//! each step.

use std::error::Error;
use std::f64::consts::PI;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels};

const SITES: usize = 400;
const OVEN: f64 = 2.0;

fn main() -> Result<(), Box<dyn Error>> {
    let rod = Lattice::on(Graph::chain(SITES), Euclidean::<1>)
        .energy(|u: &Vector1<Real>| u.x)
        .entropy(|u: &Vector1<Real>| u.x.ln())
        .bond_onsager(|bond| {
            let [u, v] = bond.x;
            [Onsager { rate: u.x * v.x, b: [vector![1.0], vector![-1.0]] }]
        })
        .build()?
        .opened()
        .bath("oven", OVEN, [0], |_, at: &SiteState<'_, Euclidean<1>>| {
            [Onsager { rate: 2.0 * at.x.x, b: vector![1.0] }]
        });

    let about = "A rod that is heated at one end, with the heat and the entropy of the oven.";
    let example = Example::new(about, 1000, 1.0);
    let start = rod.start(rod.lattice().points(|_| vector![1.0]));
    let end = example.steps as f64 * example.step_size;
    let span = Span::until(end).tolerance(1e-5).output_every(example.step_size);
    let run = RungeKuttaChebyshev.run(&rod, start, span)?;

    let last = run.last();
    let (t, ledger) = (last.time, &last.point.ledger);
    let mut profiles = Panel::new("temperature u", "site");
    for part in [100, 10, 1] {
        let state = &run.states()[example.steps / part];
        let shown = 0..SITES / 2;
        let curve: Vec<_> = shown.clone().map(|i| (i as f64, state.point.x[i].x)).collect();
        profiles = profiles.line(format!("t = {:.0}", state.time), curve);
        let exact = |i: usize| 1.0 + erfc((i as f64 + 0.5) / (4.0 * state.time).sqrt());
        if part == 1 {
            profiles =
                profiles.line("erfc", shown.map(|i| (i as f64, exact(i))).collect::<Vec<_>>());
        }
    }
    let series = |value: &dyn Fn(&State<_>) -> f64| -> Vec<(f64, f64)> {
        run.iter().map(|state| (state.time, value(state))).collect()
    };
    let heat = |s: &State<OpenSites<Euclidean<1>>>| s.point.ledger.heat("oven").unwrap_or(0.0);
    let of_oven =
        |s: &State<OpenSites<Euclidean<1>>>| s.point.ledger.bath_entropy("oven").unwrap_or(0.0);
    let figure = Panels::new(format!("A rod of {SITES} sites with an oven at one end"))
        .panel(profiles)
        .panel(
            Panel::new("heat of the oven", "t")
                .line("Q", series(&heat))
                .line("2√(t/π)", series(&|s| 2.0 * (s.time / PI).sqrt())),
        )
        .panel(
            Panel::new("entropy", "t")
                .line("rod", series(&|s| s.entropy - of_oven(s)))
                .line("oven", series(&of_oven))
                .line("both", series(&|s| s.entropy)),
        );
    let gained: f64 = last.point.x.iter().map(|u| u.x - 1.0).sum();
    let heat = ledger.heat("oven").unwrap_or(0.0);
    example
        .report_of(run.certificate(), t, vec![last.point.x[0].x])
        .with("heat", heat)
        .with("heat_by_the_closed_form", 2.0 * (t / PI).sqrt())
        .with("heat_less_gain", heat - gained)
        .figure(figure)
        .print()
}

/// The complementary error function of a positive number, by its series and its continued fraction.
fn erfc(x: f64) -> f64 {
    let scale = (-x * x).exp() / PI.sqrt();
    if x > 2.5 {
        return scale / (1..60).rev().fold(x, |tail, k| x + 0.5 * f64::from(k) / tail);
    }
    let mut term = 2.0 * x * scale;
    1.0 - (1..80).fold(term, |sum, k| {
        term *= 2.0 * x * x / f64::from(2 * k + 1);
        sum + term
    })
}
