//! A spin in a heat bath: precession, friction and both laws, on S² × R.
//!
//! A unit spin `n` with `h(n) = ¼n₁² − n₃`, a field along `e₃` and a hard axis `e₁`, is coupled to a
//! bath of entropy `s`, energy `e(s) = e^{s/c}` and temperature `T = e'(s) = e/c`, whose heat capacity
//! is `c = 20`. With `H = h + e` and `S = s` the bracket of the area form moves `n` alone, so that `S`
//! is its Casimir though the spin precesses. Together with `K` of the product metric,
//!
//! ```text
//! n' = n × ∇h + T n × (n × ∇h),   s' = |n × ∇h|² ,
//! ```
//!
//! the equation of Landau and Lifshitz (1935) with the temperature as its damping. `S` is a coordinate
//! of a flat factor, so `ΔS = h K(dS, dS) ≥ 0` in every step. At rest `n = e₃` and `T = (H₀ + 1)/c`.

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Globe, Panel, Panels};

const CAPACITY: f64 = 20.0;
type Space = Product<Sphere<2>, Euclidean<1>>;

fn main() -> Result<(), Box<dyn Error>> {
    let spin = |n: &Vector3<Real>| n.x.powi(2) * 0.25 - n.z;
    let bath = |s: Real| (s / CAPACITY).exp();
    let system = System::on(Product(Sphere::<2>::round(), Euclidean::<1>))
        .bracket((AreaForm, Zero))
        .energy(|(n, s): &(Vector3<Real>, Vector1<Real>)| spin(n) + bath(s.x))
        .entropy(|(_, s): &(Vector3<Real>, Vector1<Real>)| s.x)
        .build()?;
    let start = (Vector3::new(0.48, 0.36, -0.8), Vector1::new(0.0));

    let about = "A spin in a heat bath: precession, friction and both laws, on S² × R.";
    let example = Example::new(about, 700, 0.1);
    let run = example.run(&system, start, example.span())?;

    let stored = |state: &State<Space>| bath(state.point.1.x.into()).re;
    let energy = run.certificate.initial_energy;
    let (last, rest) = (stored(run.last()) / CAPACITY, (energy + 1.0) / CAPACITY);
    let energies = Panel::new("energies", "t")
        .line("spin h(n)", run.series(|s| spin(&s.point.0.cast()).re))
        .line("bath e(s)", run.series(stored))
        .named_level("H", energy);
    let temperature = run.panel("temperature T", |s| stored(s) / CAPACITY);
    let globe = Globe::new("the spin n(t), from ○ to ●").seen_from([0.8, 0.6, 0.4]);
    let figure =
        Panels::new(format!("A spin in a heat bath, on S² × R, h = {}", example.step_size))
            .columns(2)
            .globe(globe.curve("n(t)", run.states.iter().map(|s| s.point.0)))
            .panel(energies)
            .panel(temperature.named_level("(H₀ + 1)/c, at rest", rest))
            .panel(run.panel("entropy S", |s| s.entropy))
            .panel(run.energy_error());
    let rows = run.states.iter();
    let rows = rows.map(|s| [s.time, s.point.0.x, s.point.0.y, s.point.0.z, s.point.1.x]);
    example
        .report(&run)
        .with("temperature", last)
        .with("temperature_at_rest", rest)
        .table(["t", "n1", "n2", "n3", "s"], rows)
        .figure(figure)
        .print()
}
