//! A colloid in a heat bath, in SI units: friction in nanoseconds, a drift in milliseconds.
//!
//! A bead of polystyrene, 1 µm across, is held by a laser in water. Its momentum decays in `m/γ = 65 ns`; its distance
//! from the focus in `γ/k = 0.8 ms`, ten thousand times slower. The drop of water around it has the heat capacity
//! `C` and the temperature `T = T₀ e^{s/C}`. With `x = (r, p, s)`, `S = s` and `b = (0, w_s, −w_p)`,
//!
//! ```text
//! H = ½p²/m + ½k r² + C T₀ e^{s/C},    r' = p/m,   p' = −k r − γ p/m,   s' = γ (p/m)²/T .
//! ```
//!
//! The bead starts with a kick. `Radau` damps it in its first step, and then follows the drift in steps of 20 µs, three
//! hundred times the fast time: `r = (r₀ + p₀/γ) e^{−kt/γ}`. The midpoint rule multiplies the kick by nearly −1 in each
//! step; its certificate says that friction is not damped. Both keep both laws.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels, Record};

/// In kg, kg/s, N/m, J/K and K.
const MASS: f64 = 5.5e-16;
const FRICTION: f64 = 8.4e-9;
const TRAP: f64 = 1e-5;
const CAPACITY: f64 = 2.2e-12;
const ROOM: f64 = 300.0;
/// The start: 100 nm from the focus, with a kick in kg m/s.
const START: Vector3<f64> = Vector3::new(1e-7, 1.7e-17, 0.0);

type Motion = Record<Euclidean<3>>;

fn main() -> Result<(), Box<dyn Error>> {
    let drag = |_: &Vector3<Real>, w: &Vector3<Real>| {
        let b = Vector3::new(0.0.into(), w.z, -w.y);
        b * b.transpose() * (w.z.recip() * FRICTION)
    };
    let bead = System::on(Euclidean::<3>)
        .bracket(Poisson::constant(matrix![0.0, 1.0, 0.0; -1.0, 0.0, 0.0; 0.0, 0.0, 0.0])?)
        .energy(|x: &Vector3<Real>| {
            let kinetic = x.y * x.y * (0.5 / MASS) + x.x * x.x * (0.5 * TRAP);
            // C T₀ (e^{s/C} − 1): the heat of the bath alone would leave no digits for the bead.
            kinetic + (x.z / CAPACITY).exp_m1() * (CAPACITY * ROOM)
        })
        .entropy(|x: &Vector3<Real>| x.z)
        .field_dissipation(drag)
        .build()?;
    let about = "A colloid in a laser trap: fast friction that is damped, and a slow drift.";
    let example = Example::new(about, 200, 2e-5);
    let span = Span::steps(example.step_size, example.steps);
    let run = |method: Result<Trajectory<_>, RunError<_>>| -> Result<Motion, Box<dyn Error>> {
        let run = method?;
        Ok(Record { states: run.iter().cloned().collect(), certificate: run.certificate().clone() })
    };
    let radau = run(Radau::<3>.run(&bead, START, span))?;
    let midpoint = run(WeylMidpoint.run(&bead, START, span))?;

    let exact = |t: f64| (START.x + START.y / FRICTION) * (-TRAP / FRICTION * t).exp();
    let off = radau.states[1..].iter().map(|s| (s.point.x - exact(s.time)).abs());
    let apart = off.fold(0.0, f64::max);
    type Value<'a> = &'a dyn Fn(&State<Euclidean<3>>) -> f64;
    let both = |title: &str, unit: &str, value: Value<'_>| {
        let line = |motion: &Motion| -> Vec<_> {
            motion.states.iter().map(|s| (s.time * 1e3, value(s))).collect()
        };
        let panel = Panel::new(title, "t (ms)").unit(unit);
        panel.line("Radau", line(&radau)).line("midpoint", line(&midpoint))
    };
    let warmed = |s: &State<Euclidean<3>>| (s.point.z / CAPACITY).exp_m1() * ROOM * 1e9;
    let energy = radau.certificate.initial_energy;
    let figure = Panels::new(format!("A colloid in a heat bath, h = {:.0e} s", example.step_size))
        .panel(both("distance r", "nm", &|s| s.point.x * 1e9).level(0.0))
        .panel(both("momentum p", "kg m/s", &|s| s.point.y).level(0.0))
        .panel(both("warming T − T₀", "nK", &warmed))
        .panel(both("energy H − H₀", "J", &|s| s.energy - energy).level(0.0));
    example
        .report(&radau)
        .with("apart", apart)
        .certificate("midpoint", &midpoint.certificate)
        .figure(figure)
        .print()
}
