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
use metriplectic_studies::{Gallery, Globe, Options, Panel, Panels, Report, print, write_csv};

const CAPACITY: f64 = 20.0;
type Space = Product<Sphere<2>, Euclidean<1>>;

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::read();
    let (count, h) = (options.steps_or(700), options.step_size_or(0.1));

    let spin = |n: &Vector3<Real>| n.x.powi(2) * 0.25 - n.z;
    let bath = |s: Real| (s / CAPACITY).exp();
    let system = System::on(Product(Sphere::<2>::round(), Euclidean::<1>))
        .bracket((AreaForm, Zero))
        .energy(|(n, s): &(Vector3<Real>, Vector1<Real>)| spin(n) + bath(s.x))
        .entropy(|(_, s): &(Vector3<Real>, Vector1<Real>)| s.x)
        .build()?;
    let start = (Vector3::new(0.48, 0.36, -0.8), Vector1::new(0.0));
    let span = Span::steps(h, count).every(count.div_ceil(2000));
    let run = WeylMidpoint.run(&system, start, span)?;
    let (certificate, end) = (run.certificate(), run.last());
    let stored = |state: &State<Space>| bath(state.point.1.x.into()).re;
    let energy = certificate.initial_energy;
    let (last, rest) = (stored(end) / CAPACITY, (energy + 1.0) / CAPACITY);

    let gallery = Gallery::open()?;
    let line = |value: &dyn Fn(&State<Space>) -> f64| -> Vec<_> {
        run.iter().map(|state| (state.time, value(state))).collect()
    };
    let energies = Panel::new("energies, dashed H = h + e", "t")
        .line("spin h(n)", line(&|s| spin(&s.point.0.cast()).re))
        .line("bath e(s)", line(&stored));
    let temperature = Panel::new("temperature T, at rest (H₀ + 1)/c", "t");
    let error = Panel::new("energy H − H₀", "t").line("H", line(&|s| s.energy - energy));
    let globe = Globe::new("the spin n(t), from ○ to ●").seen_from([0.8, 0.6, 0.4]);
    Panels::new(format!("A spin in a heat bath, on S² × R, h = {h}"))
        .columns(2)
        .globe(globe.curve("n(t)", run.iter().map(|s| s.point.0)))
        .panel(energies.level(energy))
        .panel(temperature.line("T", line(&|s| stored(s) / CAPACITY)).level(rest))
        .panel(Panel::new("entropy S", "t").line("S", line(&|s| s.entropy)))
        .panel(error.level(0.0))
        .save(gallery.path("spin_in_a_bath.svg"))?;
    let rows = run.iter().map(|s| [s.time, s.point.0.x, s.point.0.y, s.point.0.z, s.point.1.x]);
    write_csv(gallery.path("spin_in_a_bath.csv"), ["t", "n1", "n2", "n3", "s"], rows)?;

    if options.json {
        let report = Report::new(certificate, end)?.with("temperature", last);
        report.with("temperature_at_rest", rest).print()?;
    } else {
        let (t, [x, y, z]): (f64, [f64; 3]) = (end.time, end.point.0.into());
        print(format_args!("{certificate}\nat t = {t:.1}:   n = ({x:.6}, {y:.6}, {z:.6})"))?;
        print(format_args!("temperature:  {:.6}, at rest {rest:.6}", last))?;
        print(format_args!("figure:       {}", gallery.path("spin_in_a_bath.svg").display()))?;
    }
    Ok(())
}
