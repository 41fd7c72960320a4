//! A pendulum in air is driven by a motor: a strange attractor, and where the energy goes.
//!
//! `H = ½p² − cos q`, a port with the torque `A sin Ωt`, and air at a temperature as the friction `γ` of the momentum. Once
//! a period of the motor the state is a point of Poincaré's section. The motor's work and the air's heat grow without
//! bound, and their difference with the energy stays at round-off.

use std::collections::BTreeMap;
use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Map, Panel, Panels};

const TORQUE: f64 = 1.5;
const FREQUENCY: f64 = 2.0 / 3.0;
const FRICTION: f64 = 0.5;
const PERIOD: f64 = std::f64::consts::TAU / FREQUENCY;
/// The size of a cell in the picture of the section.
const CELL: f64 = 0.06;
/// Steps in a period.
const STEPS: usize = 40;

fn main() -> Result<(), Box<dyn Error>> {
    let pendulum = System::on(Euclidean::<2>)
        .bracket(Symplectic)
        .energy(|x: &Vector2<Real>| x.y * x.y * 0.5 - x.x.cos())
        .work("motor", |t: Real, _: &Vector2<Real>| {
            vector![0.0.into(), (t * FREQUENCY).sin() * TORQUE]
        })
        .bath(
            "air",
            Bath::at(1.0).friction(|_: Real, _: &Vector2<Real>, _: &Vector2<Real>| {
                [Contact { rate: FRICTION.into(), along: Vector2::y() }]
            }),
        )
        .build()?;

    let about =
        "A pendulum in air is driven by a motor: a strange attractor, and where the energy goes.";
    let example = Example::new(about, 3000 * STEPS, PERIOD / STEPS as f64);
    let span = Span::steps(example.step_size, example.steps).every(STEPS);
    let run = DormandPrince8.run(&pendulum, pendulum.start(vector![0.2, 0.0]), span)?;

    // How often the section visits each cell of a grid; the first periods lead to the attractor.
    let turn = std::f64::consts::TAU;
    let cell = |x: f64| (x / CELL).floor().to_bits();
    let mut visits: BTreeMap<[u64; 2], u32> = BTreeMap::new();
    for state in run.iter().skip(20) {
        let [q, p] = state.point.x.into();
        let angle = q - turn * ((q + 0.5 * turn) / turn).floor();
        *visits.entry([cell(angle), cell(p)]).or_default() += 1;
    }
    let centre = |k: u64| (f64::from_bits(k) + 0.5) * CELL;
    let cells = visits.iter().map(|([q, p], n)| [centre(*q), centre(*p), f64::from(*n)]);
    let sections = Panel::new("p", "q")
        .title("once a period of the motor, visits")
        .map(Map::new(cells, [2.0, 4.0]));
    let series = |value: &dyn Fn(&OpenState<Vector2<f64>>) -> f64| -> Vec<(f64, f64)> {
        run.iter().map(|s| (s.time, value(&s.point))).collect()
    };
    let ledger = Panel::new("energy", "t")
        .line("work of the motor", series(&|s| s.ledger.work("motor").unwrap_or(0.0)))
        .line("heat into the air", series(&|s| -s.ledger.heat("air").unwrap_or(0.0)));
    let balance: Vec<(f64, f64)> =
        run.iter().map(|s| (s.time, s.energy - run.certificate().initial_energy)).collect();
    let figure = Panels::new(format!("A driven pendulum in air, {STEPS} steps a period"))
        .columns(2)
        .panel(sections)
        .panel(ledger)
        .panel(Panel::new("ΔH − W − Q", "t").line("balance", balance).level(0.0));
    let last = run.last();
    example
        .report_of(run.certificate(), last.time, vec![last.point.x.x, last.point.x.y])
        .with("work", last.point.ledger.work("motor").unwrap_or(0.0))
        .figure(figure)
        .print()
}
