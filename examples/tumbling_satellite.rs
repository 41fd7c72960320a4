//! A satellite that goes into a flat spin, as Explorer 1 did, on SO(3) × R³ × R.
//!
//! A long body, `I = (3, 2.5, 1)`, spins about its axis of smallest inertia. Its parts rub against each
//! other, which turns kinetic energy into heat and leaves the momentum `Rp` in space alone. The state is the
//! attitude `R`, the momentum `p` in the body and the entropy `s`; `H = ½p·I⁻¹p + e(s)`, with the heat
//! `e = ce^{s/c}`, the temperature `T = e'(s)` and `S = s`. The bracket is that of `T*SO(3)`. The vector
//! `N α = p × α_p − α_R` is the torque of a differential `α`. It is `p × Ω` for `dH`, with `Ω = I⁻¹p`, and 0
//! for `J = a·Rp`, whose differential is `(p × b, b, 0)` with `b = Rᵀa`. So
//!
//! ```text
//! K(α, β) = γ B α · B β,   B α = w_s N α − α_s N w,   w = dH,
//! ```
//!
//! is positive, kills `w` and every `J`, and with `B dS = −N w` the equations `Π dH + K dS` are
//!
//! ```text
//! R' = R Ω̃^,   p' = p × Ω̃,   s' = γ |p × Ω|²,   Ω̃ = Ω + γ T p × Ω .
//! ```
//!
//! `|p|` is kept, so the least kinetic energy is `½|p|²/I₁`: the end is a spin about the axis `e₁`.

use std::error::Error;

use metriplectic::manifolds::rotations::hat;
use metriplectic::prelude::*;
use metriplectic_studies::{Gallery, Globe, Options, Panel, Panels, print, write_csv};

const INERTIA: Vector3<f64> = Vector3::new(3.0, 2.5, 1.0);
const FRICTION: f64 = 0.05;
const CAPACITY: f64 = 4.0;
type Space = Product<Product<Rotations, Euclidean<3>>, Euclidean<1>>;
type Real7 = SVector<Real, 7>;
type Point = ((Matrix3<Real>, Vector3<Real>), Vector1<Real>);

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::read();
    let (count, h) = (options.steps_or(2000), options.step_size_or(0.05));

    let spin = |p: &Vector3<Real>| p.component_mul(p).component_div(&INERTIA.cast()).sum() * 0.5;
    let heat = |s: Real| (s / CAPACITY).exp() * CAPACITY;
    // The 3 × 7 matrix of B, by columns: those of α_R, of α_p and of α_s.
    let rubbing = |((_, p), _): &Point, w: &Real7| {
        let (turn, torque) =
            (hat(p), p.cross(&vector![w[3], w[4], w[5]]) - vector![w[0], w[1], w[2]]);
        let b = SMatrix::<Real, 3, 7>::from_fn(|i, j| match j {
            0..3 => -w[6] * if i == j { 1.0 } else { 0.0 },
            3..6 => w[6] * turn[(i, j - 3)],
            _ => -torque[i],
        });
        b.transpose() * b * Real::from(FRICTION)
    };
    let satellite = System::on(Product(Product(Rotations, Euclidean::<3>), Euclidean::<1>))
        .bracket((Symplectic, Zero))
        .energy(|((_, p), s): &Point| spin(p) + heat(s.x))
        .entropy(|(_, s): &Point| s.x)
        .dissipation(FieldDissipation(rubbing))
        .build()?;
    let p = vector![0.15, 0.1, 2.0];
    let start = ((Matrix3::identity(), p), Vector1::new(0.0));
    let run = WeylMidpoint.run(&satellite, start, Span::steps(h, count))?;
    let (certificate, end) = (run.certificate(), run.last());
    let energy = certificate.initial_energy;
    let kinetic = |state: &State<Space>| spin(&state.point.0.1.cast()).re;
    let temperature = |state: &State<Space>| (state.point.1.x / CAPACITY).exp();
    let momentum = |state: &State<Space>| (state.point.0.0 * state.point.0.1 - p).norm();
    let drift = run.iter().map(momentum).fold(0.0, f64::max);
    let flat = 0.5 * p.norm_squared() / INERTIA.x;

    let gallery = Gallery::open()?;
    let panel = |title: &str, value: &dyn Fn(&State<Space>) -> f64| {
        let points: Vec<_> = run.iter().map(|state| (state.time, value(state))).collect();
        Panel::new(title, "t").line(title, points)
    };
    let axis = run.iter().map(|s| s.point.0.0.column(2).into_owned());
    Panels::new(format!("A satellite goes into a flat spin, h = {h}"))
        .columns(2)
        .globe(Globe::new("its long axis in space, from ○ to ●").curve("R e₃", axis))
        .panel(panel("kinetic energy, dashed ½|p|²/I₁", &kinetic).level(flat))
        .panel(panel("temperature T", &temperature))
        .panel(panel("energy H − H₀", &|s| s.energy - energy).level(0.0))
        .panel(panel("momentum in space |Rp − p₀|", &momentum))
        .save(gallery.path("tumbling_satellite.svg"))?;
    let rows = run.iter().map(|s| {
        let ((_, p), s0) = &s.point;
        [s.time, p.x, p.y, p.z, s0.x, momentum(s)]
    });
    write_csv(gallery.path("tumbling_satellite.csv"), ["t", "p1", "p2", "p3", "s", "drift"], rows)?;

    if options.json {
        let mut report = serde_json::to_value(certificate)?;
        report["max_relative_energy_error"] = certificate.max_relative_energy_error().into();
        report["final_state"] = Space::entries(&end.point).into();
        report["kinetic_energy"] = kinetic(end).into();
        report["kinetic_energy_flat"] = flat.into();
        report["momentum_error"] = drift.into();
        print(report)?;
    } else {
        print(format_args!("{certificate}\nmomentum:    |Rp − p₀| ≤ {drift:.1e}"))?;
        print(format_args!(
            "kinetic:     {:.6} at t = {:.1}, in a flat spin {flat:.6}",
            kinetic(end),
            end.time
        ))?;
        print(format_args!("figure:      {}", gallery.path("tumbling_satellite.svg").display()))?;
    }
    Ok(())
}
