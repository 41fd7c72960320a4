//! A capacitor is charged through a resistor and discharged again, in SI units.
//!
//! The charge `q` has the energy `H(t, q) = q²/2C − V(t) q` with the battery at the voltage `V`, and the resistor is a bath
//! at 300 K whose friction is the conductance, `R = 1/R_Ω`: the equation is `R_Ω q' = V − q/C`. The battery is switched off
//! at a corner. Each time half of `CV²` becomes heat, whatever the resistance is. The energy that the capacitor holds is
//! less by `Vq` than what the battery has supplied, so `H` is the enthalpy, and the work of the switch is `qV`.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels};

const RESISTANCE: f64 = 1e6;
const CAPACITANCE: f64 = 1e-9;
const VOLTAGE: f64 = 5.0;
const SWITCHED: f64 = 0.02;

fn main() -> Result<(), Box<dyn Error>> {
    let voltage = |t: f64| if t < SWITCHED { VOLTAGE } else { 0.0 };
    let circuit = System::on(Euclidean::<1>)
        .bracket(Zero)
        .energy_in_time(|t: Real, q: &Vector1<Real>| {
            q.x * q.x * (0.5 / CAPACITANCE) - q.x * voltage(t.re)
        })
        .bath(
            "resistor",
            Bath::at(300.0).friction(|_: Real, _: &Vector1<Real>, _: &Vector1<Real>| {
                [Contact { rate: RESISTANCE.recip().into(), along: vector![1.0.into()] }]
            }),
        )
        .build()?;

    let about = "A capacitor is charged and discharged through a resistor, in SI units.";
    let example = Example::new(about, 400, 1e-4);
    let span = Span::steps(example.step_size, example.steps).corners([SWITCHED]);
    let run = WeylMidpoint.run(&circuit, circuit.start(vector![0.0]), span)?;

    let nano = 1e9;
    let series = |value: &dyn Fn(f64, f64, f64) -> f64| -> Vec<(f64, f64)> {
        let heat = |s: &OpenState<Vector1<f64>>| s.ledger.heat("resistor").unwrap_or(0.0);
        run.iter().map(|s| (1e3 * s.time, value(s.time, s.point.x.x, heat(&s.point)))).collect()
    };
    let half = 0.5 * CAPACITANCE * VOLTAGE * VOLTAGE;
    let stored = |q: f64| 0.5 * q * q / CAPACITANCE;
    let energies = Panel::new("energy / nJ", "t / ms")
        .line("stored", series(&|_, q, _| nano * stored(q)))
        .line("heat", series(&|_, _, heat| -nano * heat))
        .named_level("½CV²", nano * half);
    let balance: Vec<(f64, f64)> = run
        .iter()
        .map(|s| (1e3 * s.time, (s.energy - run.certificate().initial_energy) / half))
        .collect();
    let entropy: Vec<(f64, f64)> = run.iter().map(|s| (1e3 * s.time, 1e12 * s.entropy)).collect();
    let figure = Panels::new(format!("A capacitor and its resistor, h = {} s", example.step_size))
        .panel(energies)
        .panel(Panel::new("voltage / V", "t / ms").line("q/C", series(&|_, q, _| q / CAPACITANCE)))
        .panel(Panel::new("entropy of the resistor / (pJ/K)", "t / ms").line("S", entropy))
        .panel(Panel::new("(ΔH − W − Q) / ½CV²", "t / ms").line("balance", balance).level(0.0));
    let last = run.last();
    let heat = last.point.ledger.heat("resistor").unwrap_or(0.0);
    example
        .report_of(run.certificate(), last.time, vec![last.point.x.x])
        .with("heat_of_both", -heat)
        .with("c_v_squared", 2.0 * half)
        .figure(figure)
        .print()
}
