//! A viscous shock in a gas: the equations of Navier, Stokes and Fourier in one dimension, in mass coordinates.
//!
//! Site `i` is a wall with the position `q`, the velocity `p` and the entropy `s` of the cell behind it, whose volume is
//! `V = 1 + q_{i+1} − q_i` and whose energy is `e = c_v V^{1−γ} exp(s/c_v)`. Friction and conduction are `μ/V`
//! and `κ/V`. Weights press on both ends. For `κ = μ c_p` the shock of Mach number `M` is a tanh of the mass
//! coordinate `ξ` (Becker 1922): with the flux `m = M√γ` and the velocities `u₀`, `u₁` relative to it,
//!
//! ```text
//! m V = u = ½ (u₀ + u₁) + ½ (u₀ − u₁) tanh((γ + 1)(u₀ − u₁)(ξ − mt)/(4γμ)),   c_p T + ½ u² = const .
//! ```

use std::error::Error;

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Panel, Panels};

const SITES: usize = 1000;
const GAMMA: f64 = 1.4;
const MACH: f64 = 1.3;
const VISCOSITY: f64 = 4.0;
const HEAT: f64 = 1.0 / (GAMMA - 1.0);
const START: f64 = 250.0;

fn main() -> Result<(), Box<dyn Error>> {
    let canonical = matrix![0.0, 1.0, 0.0; -1.0, 0.0, 0.0; 0.0, 0.0, 0.0];
    let behind = becker(-1e6);
    let mut weights = vec![0.0; SITES];
    (weights[0], weights[SITES - 1]) = (-behind.temperature / behind.volume, 1.0);
    let gas = Lattice::on(Graph::chain(SITES), Euclidean::<3>)
        .bracket(Poisson::constant(canonical)?)
        .site_data(weights)
        .energy_with(|x, weight| x.y.powi(2) * 0.5 + x.x * *weight)
        .bond_energy(|(x, y): &(Vector3<Real>, Vector3<Real>)| {
            (y.x - x.x + 1.0).powf(1.0 - GAMMA) * (x.z / HEAT).exp() * HEAT
        })
        .entropy(|x: &Vector3<Real>| x.z)
        .bond_onsager(|bond| {
            let ([x, y], [u, v]) = (bond.x, bond.w);
            let volume = 1.0 + y.x - x.x;
            // The heat of friction stays in the cell. The last wall has none behind it.
            let slip = [vector![0.0, -1.0, (u.y - v.y) / u.z], vector![0.0, 1.0, 0.0]];
            let conducts = VISCOSITY * HEAT * GAMMA / (volume * u.z * v.z);
            [
                Onsager { rate: VISCOSITY * u.z / volume, b: slip },
                Onsager {
                    rate: if v.z > 0.0 { conducts } else { 0.0 },
                    b: [vector![0.0, 0.0, v.z], vector![0.0, 0.0, -u.z]],
                },
            ]
        })
        .build()?;
    // Walls stand where the volumes of the cells put them, from the right end on.
    let cell = |i: usize| becker(i as f64 + 0.5 - START);
    let mut q = vec![0.0; SITES];
    for i in (0..SITES - 1).rev() {
        q[i] = q[i + 1] - (cell(i).volume - 1.0);
    }
    let start = gas.points(|i| {
        let Cell { volume, temperature, .. } = cell(i);
        let s = HEAT * temperature.ln() + volume.ln();
        vector![q[i], becker(i as f64 - START).velocity, if i + 1 < SITES { s } else { 0.0 }]
    });

    let about =
        "A viscous shock of Mach number 1.3 in 1000 cells, beside the closed form of Becker.";
    let example = Example::new(about, 3000, 0.08);
    let mut run = DormandPrince5.steps(&gas, start, example.step_size)?;
    for _ in 0..example.steps {
        run.advance()?;
    }
    let (certificate, end) = (run.certificate(), run.state());
    let place = START + MACH * GAMMA.sqrt() * end.time;
    let near = (0..SITES - 1).filter(|&i| (i as f64 + 20.0 - place).abs() < 100.0);
    let computed = |i: usize| {
        let volume = 1.0 + end.point[i + 1].x - end.point[i].x;
        let temperature = (end.point[i].z / HEAT).exp() * volume.powf(1.0 - GAMMA);
        Cell { volume, temperature, velocity: end.point[i].y }
    };
    let exact = |i: usize| becker(i as f64 + 0.5 - place);
    let panel = |name: &str, of: fn(&Cell) -> f64, shift: f64| {
        let line = |f: &dyn Fn(usize) -> Cell, shift: f64| -> Vec<(f64, f64)> {
            near.clone().map(|i| (i as f64 + shift, of(&f(i)))).collect()
        };
        Panel::new(name, "cell")
            .line("Becker", line(&exact, 0.5))
            .line("lattice", line(&computed, shift))
    };
    let figure = Panels::new(format!("A shock of Mach number {MACH} at t = {:.0}", end.time))
        .panel(panel("density 1/V", |cell| 1.0 / cell.volume, 0.5))
        .panel(panel("temperature T", |cell| cell.temperature, 0.5))
        .panel(panel("velocity p", |cell| cell.velocity, 0.0));
    let apart = |i: usize| (computed(i).temperature - exact(i).temperature).abs();
    let error = near.clone().map(apart).fold(0.0, f64::max);
    let errors: Vec<_> = near.clone().map(|i| (i as f64 + 0.5, apart(i))).collect();
    let figure = figure.columns(2).panel(
        Panel::new("error of the temperature", "cell").line("error", errors).logarithmic(1e-9),
    );
    let middle = computed(SITES / 2);
    let entries = vec![middle.volume, middle.temperature, middle.velocity];
    let report = example.report_of(certificate, end.time, entries);
    report.with("temperature_error", error).with("shock_at", place).figure(figure).print()
}

struct Cell {
    volume: f64,
    temperature: f64,
    velocity: f64,
}

/// The shock at the distance `xi` from its middle, in the frame of the gas ahead of it with `V = T = 1`.
fn becker(xi: f64) -> Cell {
    let (flux, square) = (MACH * GAMMA.sqrt(), MACH * MACH);
    let [ahead, behind] = [flux, flux * ((GAMMA - 1.0) * square + 2.0) / ((GAMMA + 1.0) * square)];
    let steep = (GAMMA + 1.0) * (ahead - behind) / (4.0 * GAMMA * VISCOSITY);
    let u = 0.5 * (ahead + behind) + 0.5 * (ahead - behind) * (steep * xi).tanh();
    let temperature = 1.0 + 0.5 * (ahead * ahead - u * u) / (GAMMA * HEAT);
    Cell { volume: u / flux, temperature, velocity: ahead - u }
}
