//! A satellite is stopped by the motors of its wheels: power, and the momentum that stays.
//!
//! The body has the angular momentum `L` of satellite and wheels in its own frame, and three wheels along its axes have the
//! momenta `h`. With `H = ½ (L − h)·I⁻¹(L − h) + ½ h·J⁻¹h` the body turns at `ω = ∂H/∂L`, `L' = L × ω`, and a wheel has the
//! speed `∂H/∂h` relative to the body. A motor with the torque `u` is a port, `h' = u`: it does the work `u · ∂H/∂h`, and
//! the Casimir `|L|²` does not feel it. The control law `u = k ω`, bounded by what a motor can do, turns with the state: a
//! feedback is a port. It brings the body to rest, and the wheels take up its momentum. Bearings are a bath.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels};

type Point = (Vector3<Real>, Vector3<Real>);
type Momenta = (Vector3<f64>, Vector3<f64>);

const INERTIA: Vector3<f64> = Vector3::new(3.0, 2.0, 1.5);
const WHEEL: f64 = 0.05;
const GAIN: f64 = 0.6;
const MOST: f64 = 0.15;
const BEARING: f64 = 1e-4;

/// The angular velocity of the body.
fn omega(l: &Vector3<Real>, h: &Vector3<Real>) -> Vector3<Real> {
    (l - h).component_div(&INERTIA.cast())
}

fn main() -> Result<(), Box<dyn Error>> {
    let satellite = System::on(Product(LieDual::so3(), Euclidean::<3>))
        .bracket((LiePoisson, Zero))
        .energy(|(l, h): &Point| (l - h).dot(&omega(l, h)) * 0.5 + h.norm_squared() * (0.5 / WHEEL))
        .casimir(|(l, _): &Point| l.norm_squared())
        .work("motors", |_: Real, (l, h): &Point| {
            let torque = omega(l, h).map(|w| (w * (GAIN / MOST)).tanh() * MOST);
            let still = Real::from(0.0);
            vector![still, still, still, torque.x, torque.y, torque.z]
        })
        .bath(
            "bearings",
            Bath::at(290.0).friction(|_: Real, _: &Point, _: &Vector6<Real>| {
                let axis = |k: usize| Contact {
                    rate: Real::from(BEARING),
                    along: Vector6::from_fn(|i, _| Real::from(f64::from(u8::from(i == 3 + k)))),
                };
                [axis(0), axis(1), axis(2)]
            }),
        )
        .build()?;

    let about =
        "A satellite is stopped by the motors of its wheels: power, and the momentum that stays.";
    let example = Example::new(about, 600, 0.05);
    let start = (vector![0.9, -0.6, 0.5], vector![0.0, 0.0, 0.0]);
    let span = Span::steps(example.step_size, example.steps);
    let run = Gauss::<2>.run(&satellite, satellite.start(start), span)?;

    let body = |x: &Momenta| (x.0 - x.1).component_div(&INERTIA);
    let series = |value: &dyn Fn(&Momenta) -> f64| -> Vec<(f64, f64)> {
        run.iter().map(|s| (s.time, value(&s.point.x))).collect()
    };
    let mut rates = Panel::new("ω", "t").title("the body comes to rest");
    let mut wheels = Panel::new("h", "t").title("the wheels take up its momentum");
    for (k, name) in ["1", "2", "3"].into_iter().enumerate() {
        rates = rates.line(format!("ω{name}"), series(&|x| body(x)[k]));
        wheels = wheels.line(format!("h{name}"), series(&|x| x.1[k]));
    }
    let ledger: Vec<(f64, f64)> =
        run.iter().map(|s| (s.time, s.point.ledger.work("motors").unwrap_or(0.0))).collect();
    let heat: Vec<(f64, f64)> =
        run.iter().map(|s| (s.time, -s.point.ledger.heat("bearings").unwrap_or(0.0))).collect();
    let work = Panel::new("energy", "t")
        .line("work of the motors", ledger)
        .line("heat of the bearings", heat);
    let initial = start.0.norm_squared();
    let momentum = series(&|x| x.0.norm_squared() - initial);
    let balance: Vec<(f64, f64)> =
        run.iter().map(|s| (s.time, s.energy - run.certificate().initial_energy)).collect();
    let conserved = Panel::new("error", "t")
        .line("|L|² − |L₀|²", momentum)
        .line("ΔH − W − Q", balance)
        .level(0.0);
    let figure = Panels::new(format!("A satellite and its wheels, h = {}", example.step_size))
        .columns(2)
        .panel(rates)
        .panel(wheels)
        .panel(work)
        .panel(conserved);
    let last = run.last();
    let (l, h) = last.point.x;
    example
        .report_of(run.certificate(), last.time, vec![l.x, l.y, l.z, h.x, h.y, h.z])
        .with("speed", body(&last.point.x).norm())
        .with("work", last.point.ledger.work("motors").unwrap_or(0.0))
        .figure(figure)
        .print()
}
