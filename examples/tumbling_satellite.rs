//! A satellite goes into a flat spin, as Explorer 1 did: attitude, momentum and heat, on SO(3) × R³ × R.
//!
//! A long body, `I = (3, 2.5, 1)`, spins about its axis of smallest inertia. Its parts rub against each
//! other, which turns kinetic energy into heat and leaves the momentum `Rp` in space alone. With the bracket
//! of `T*SO(3)` for attitude `R` and body momentum `p`, `H = ½p·Ω + ce^{s/c}`, `Ω = I⁻¹p`, and `S = s`, let
//! `N α = p × α_p − α_R` be the torque of a differential `α`: it is `p × Ω` for `dH`, and 0 for a component
//! `a·Rp` of the momentum, whose differential is `(p × b, b, 0)` with `b = Rᵀa`. So
//! `K(α, β) = γ B α · B β`, `B α = w_s N α − α_s N w`, is positive and annihilates `w = dH` and `d(Rp)`. As
//! `B dS = −N w`, with the temperature `T = w_s` the equations are
//! `R' = R Ω̃^`, `p' = p × Ω̃`, `s' = γ |p × Ω|²`, with `Ω̃ = Ω + γT p × Ω`. Listed as three momenta `Rp` is kept
//! by the steps too. The least kinetic energy is `½|p|²/I₁`: the end is a spin about the axis `e₁`.
//!
//! Observables of each step are streamed to a file, which Ctrl-C leaves whole: try `--steps 1000000000`.

use std::{error::Error, fs::File};

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Gallery, Globe, Panels, Progress, Record, interrupted};

const INERTIA: Vector3<f64> = Vector3::new(3.0, 2.5, 1.0);
const CAPACITY: f64 = 4.0;
type Space = Product<Product<Rotations, Euclidean<3>>, Euclidean<1>>;
type Point = ((Matrix3<Real>, Vector3<Real>), Vector1<Real>);

fn main() -> Result<(), Box<dyn Error>> {
    let spin = |p: &Vector3<Real>| p.component_mul(p).component_div(&INERTIA.cast()).sum() * 0.5;
    let rubbing = |((_, p), _): &Point, w: &SVector<Real, 7>| {
        let torque = |a: &SVector<Real, 7>| p.cross(&vector![a[3], a[4], a[5]]) - a.xyz();
        let b = SMatrix::<Real, 3, 7>::from_columns(&std::array::from_fn::<_, 7, _>(|j| {
            let alpha = SVector::ith(j, Real::from(1.0));
            torque(&alpha) * w[6] - torque(w) * alpha[6]
        }));
        b.transpose() * b * Real::from(0.05)
    };
    let satellite = System::on(Product(Product(Rotations, Euclidean::<3>), Euclidean::<1>))
        .bracket((Symplectic, Zero))
        .energy(|((_, p), s): &Point| spin(p) + (s.x / CAPACITY).exp() * CAPACITY)
        .entropy(|(_, s): &Point| s.x)
        .momentum(|((r, p), _): &Point| (r * p).x)
        .momentum(|((r, p), _): &Point| (r * p).y)
        .momentum(|((r, p), _): &Point| (r * p).z)
        .field_dissipation(rubbing)
        .build()?;
    let p0 = vector![0.15, 0.1, 2.0];
    let start = ((Matrix3::identity(), p0), Vector1::new(0.0));

    let about = "A satellite goes into a flat spin: attitude, momentum and heat.";
    let example = Example::new(about, 2000, 0.05);
    let kinetic = |state: &State<Space>| spin(&state.point.0.1.cast()).re;
    let momentum = |state: &State<Space>| (state.point.0.0 * state.point.0.1 - p0).norm();
    let span = example.span();
    let mut steps = WeylMidpoint.steps(&satellite, start, span)?;
    let watch = Observables::on(&satellite)
        .of_state("kinetic_energy", kinetic)
        .of_state("momentum_error", momentum)
        .of_state("entropy", |state| state.entropy);
    let mut table = watch.csv(File::create(Gallery::open()?.path("tumbling_satellite.csv"))?)?;
    table.write(steps.state())?;
    let mut states = vec![steps.state().clone()];
    let mut progress = Progress::over(example.steps);
    for step in 1..=example.steps {
        table.write(steps.advance()?)?;
        if span.records(step) {
            states.push(steps.state().clone());
        }
        progress.step();
        if interrupted() {
            break;
        }
    }
    drop(progress);
    table.finish()?;
    let run = Record { states, certificate: steps.certificate().clone() };

    let flat = 0.5 * p0.norm_squared() / INERTIA.x;
    let axis = run.states.iter().map(|s| s.point.0.0.column(2).into_owned());
    let title = format!("A satellite goes into a flat spin, h = {}", example.step_size);
    let figure = Panels::new(title)
        .columns(2)
        .globe(Globe::new("the long axis in space, from ○ to ●").curve("R e₃", axis))
        .panel(run.panel("kinetic energy", kinetic).named_level("½|p|²/I₁, flat spin", flat))
        .panel(run.panel("temperature T", |s| (s.point.1.x / CAPACITY).exp()))
        .panel(run.energy_error())
        .panel(run.panel("momentum |Rp − p₀|", momentum));
    let energies = vec![kinetic(&run.states[0]), kinetic(run.last()), flat];
    let report = example.report(&run).with("time", steps.state().time);
    report.with("kinetic_energies", energies).figure(figure).print()
}
