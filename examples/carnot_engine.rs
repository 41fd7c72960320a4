//! A gas runs an engine between two baths, at four speeds.
//!
//! An ideal gas with the entropy `s` in the volume `V(t)` has the energy `H(t, s) = 3/2 e^{2s/3} V^{−2/3}`, and its
//! temperature is `T = ∂H/∂s`. The piston follows Carnot's cycle: it expands in touch with the bath at `T_h = 2`, expands
//! alone until the gas has cooled to `T_c = 1`, is pushed back in touch with the bath at `T_c`, and pushed further alone. A
//! contact of the rate `κ/T` lets the heat `κ (T_b − T)` flow.
//!
//! The ledger has the work and the heat of each bath, so the efficiency `η = −W/Q_h` obeys the identity
//! `η = 1 − T_c/T_h − T_c ΔS/Q_h` with the entropy `ΔS` that a cycle produces. Slow engines come near Carnot's ½.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels};

const HOT: f64 = 2.0;
const COLD: f64 = 1.0;
const PERIODS: [f64; 4] = [10.0, 30.0, 100.0, 1000.0];

/// The logarithm of the volume at the four corners of the cycle: `1, 2, 2·2^{3/2}, 2^{3/2}`.
fn corners() -> [f64; 5] {
    let two = 2.0_f64.ln();
    [0.0, two, 2.5 * two, 1.5 * two, 0.0]
}

/// The logarithm of the volume, and which of the four strokes it is.
fn piston(t: Real, period: f64) -> (Real, usize) {
    let cycles = t * period.recip();
    let turn = cycles - cycles.re.floor();
    let stroke = [0, 1, 2, 3].into_iter().rev().find(|k| turn.re >= 0.25 * f64::from(*k));
    let stroke = stroke.map_or(0, |k| [0, 1, 2, 3][usize::try_from(k).unwrap_or(0)]);
    let volumes = corners();
    let along = turn * 4.0 - stroke as f64;
    (along * (volumes[stroke + 1] - volumes[stroke]) + volumes[stroke], stroke)
}

/// What a cycle of the engine comes to.
struct Cycle {
    period: f64,
    /// `(s, T)` and `(V, p)` along the last cycle.
    heat: Vec<(f64, f64)>,
    work: Vec<(f64, f64)>,
    efficiency: f64,
    /// What the identity says of the efficiency.
    identity: f64,
}

fn engine(period: f64, steps: usize) -> Result<(Cycle, Certificate), Box<dyn Error>> {
    let contact = move |stroke: usize| {
        move |t: Real, _: &Vector1<Real>, w: &Vector1<Real>| {
            let (_, now) = piston(t, period);
            let rate = if now == stroke { w.x.recip() } else { Real::from(0.0) };
            [Contact::along(rate, [1.0])]
        }
    };
    let gas = System::on(Euclidean::<1>)
        .bracket(Zero)
        .energy_in_time(move |t: Real, s: &Vector1<Real>| {
            let (volume, _) = piston(t, period);
            ((s.x - volume) * (2.0 / 3.0)).exp() * 1.5
        })
        .entropy(|s: &Vector1<Real>| s.x)
        .dissipation(CometricDissipation(|_: &Vector1<Real>| Matrix1::new(Real::from(0.0))))
        .bath("hot", Bath::at(HOT).friction(contact(0)))
        .bath("cold", Bath::at(COLD).friction(contact(2)))
        .build()?;
    // The first cycles bring the gas into its rhythm.
    let cycles = if period < 50.0 { 8 } else { 4 };
    let strokes = (0..=4 * cycles).map(|k| 0.25 * period * f64::from(k));
    let start = gas.start(vector![1.5 * HOT.ln()]);
    let total = usize::try_from(cycles)? * steps;
    let span = Span::steps(period / steps as f64, total).corners(strokes);
    let run = WeylMidpoint.run(&gas, start, span)?;

    let last = &run.states()[total - steps..];
    let temperature = |s: f64, t: f64| (2.0 / 3.0 * (s - piston(t.into(), period).0.re)).exp();
    let heat = last.iter().map(|x| (x.point.x.x, temperature(x.point.x.x, x.time)));
    let work = last.iter().map(|x| {
        let volume = piston(x.time.into(), period).0.re.exp();
        (volume, temperature(x.point.x.x, x.time) / volume)
    });
    let ends = [&last[0].point, &last[steps].point];
    let gained = |value: &dyn Fn(usize) -> f64| value(1) - value(0);
    let worked = gained(&|k| ends[k].ledger.parameter_work());
    let hot = gained(&|k| ends[k].ledger.heat("hot").unwrap_or(0.0));
    let cold = gained(&|k| ends[k].ledger.heat("cold").unwrap_or(0.0));
    let [first, second] = [0, 1].map(|k: usize| gas.energy_at(ends[k]));
    let of_gas = gained(&|k| ends[k].x.x);
    let produced = of_gas - hot / HOT - cold / COLD;
    // A cycle that is not quite closed keeps energy and entropy in the gas.
    let kept = (second - first) - COLD * of_gas;
    let cycle = Cycle {
        period,
        heat: heat.collect(),
        work: work.collect(),
        efficiency: -worked / hot,
        identity: 1.0 - COLD / HOT - (COLD * produced + kept) / hot,
    };
    Ok((cycle, run.certificate().clone()))
}

fn main() -> Result<(), Box<dyn Error>> {
    let example = Example::study("A gas runs an engine between two baths, at four speeds.");
    let mut cycles = Vec::new();
    let mut certificate = None;
    for period in PERIODS {
        let (cycle, balance) = engine(period, 400)?;
        cycles.push(cycle);
        certificate = Some(balance);
    }
    let mut heat = Panel::new("T", "s").title("temperature and entropy of the gas");
    let mut work = Panel::new("p", "V").title("pressure and volume of the gas");
    for cycle in &cycles {
        let name = format!("period {}", cycle.period);
        heat = heat.line(name.clone(), &cycle.heat);
        work = work.line(name, &cycle.work);
    }
    let efficiencies: Vec<(f64, f64)> =
        cycles.iter().map(|cycle| (cycle.period.log10(), cycle.efficiency)).collect();
    let efficiency = Panel::new("η", "log₁₀ period")
        .title("efficiency")
        .line("−W/Q_h", efficiencies)
        .named_level("Carnot", 1.0 - COLD / HOT);
    let off: Vec<f64> = cycles.iter().map(|cycle| cycle.efficiency - cycle.identity).collect();
    let figure = Panels::new("A gas runs an engine between two baths")
        .columns(2)
        .panel(heat)
        .panel(work)
        .panel(efficiency);
    let certificate = certificate.ok_or("four engines have run")?;
    example
        .report_of(&certificate, PERIODS[3], vec![])
        .with("efficiencies", cycles.iter().map(|cycle| cycle.efficiency).collect::<Vec<_>>())
        .with("errors_of_the_identity", off)
        .figure(figure)
        .print()
}
