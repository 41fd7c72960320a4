//! Training data with both laws exact: the thermoelastic double pendulum of the learning literature.
//!
//! Networks that keep the laws of thermodynamics are trained on 50 runs of this pendulum, of 200 steps of 0.3
//! (Hernández, Badías, González, Chinesta and Cueto 2021, arXiv:2004.04653). No smooth energy is constant on those
//! data to better than 1.55e-4: they are single midpoint steps. Here is such a set by a method of order 8, with `H`
//! and the angular momentum `L` constant to round-off, and `S` that never falls. With the energies of Romero (2009),
//! `λ_i` the lengths of the threads and `θ_i = ∂e_i/∂s_i`,
//!
//! ```text
//! H = |p₁|²/2m₁ + |p₂|²/2m₂ + e₁ + e₂,   S = s₁ + s₂,   s₁' = κ (θ₂/θ₁ − 1),   s₂' = κ (θ₁/θ₂ − 1),
//! e_i = ½ C_i ln²(λ_i/l_i) + βθ₀ ln(λ_i/l_i) + cθ₀ (exp((s_i − β ln(λ_i/l_i))/c) − 1) .
//! ```

use std::{error::Error, fs::File};

use metriplectic::prelude::*;
use metriplectic_studies::{Example, Gallery, Panel, Panels};

type Point<D> = (SVector<D, 8>, Vector2<D>); // ((q₁, q₂, p₁, p₂), (s₁, s₂))

const MASSES: [f64; 2] = [1.0, 2.0];
const LENGTHS: [f64; 2] = [2.0, 1.0];
const STIFFNESS: [f64; 2] = [0.019, 0.188];
const EXPANSION: f64 = 0.087;
const CAPACITY: f64 = 5.0;
const COLD: f64 = 300.0;
const CONDUCTIVITY: f64 = 300.0;
const RUNS: usize = 50;
const STEPS: usize = 200;

/// `ln(λ_i/l_i)` of both threads.
fn stretch<D: Scalar>((x, _): &Point<D>) -> [D; 2] {
    let squares = [x[0].powi(2) + x[1].powi(2), (x[2] - x[0]).powi(2) + (x[3] - x[1]).powi(2)];
    std::array::from_fn(|i| squares[i].ln() * 0.5 - LENGTHS[i].ln())
}

fn angular_momentum<D: Scalar>((x, _): &Point<D>) -> D {
    x[0] * x[5] - x[1] * x[4] + x[2] * x[7] - x[3] * x[6]
}

fn energy<D: Scalar>(x: &Point<D>) -> D {
    let (log, (y, s)) = (stretch(x), x);
    let thread = |i: usize| {
        let heat = ((s[i] - log[i] * EXPANSION) / CAPACITY).exp_m1() * (CAPACITY * COLD);
        log[i].powi(2) * (0.5 * STIFFNESS[i]) + log[i] * (EXPANSION * COLD) + heat
    };
    let kinetic = |i: usize| (y[4 + 2 * i].powi(2) + y[5 + 2 * i].powi(2)) * (0.5 / MASSES[i]);
    kinetic(0) + kinetic(1) + thread(0) + thread(1)
}

fn main() -> Result<(), Box<dyn Error>> {
    // The temperatures are the entries of the covector that K annihilates.
    let conduction = |_: &Point<Real>, w: &SVector<Real, 10>| {
        let b = SVector::<Real, 10>::ith(8, w[9]) - SVector::<Real, 10>::ith(9, w[8]);
        b * b.transpose() * ((w[8] * w[9]).recip() * CONDUCTIVITY)
    };
    let around = [4.5, 4.5, 2.0, 4.5, -0.5, 1.5, 1.4, -0.2];
    // Ten variables: gradients by a sweep back along the recorded energy.
    let (space, rest) =
        (Product(Euclidean::<8>, Euclidean::<2>), (around.into(), Vector2::zeros()));
    let recorded = field!(|x: &Point<Real>| energy(x)).recorded(&space, &rest)?;
    let pendulum = System::on(space)
        .bracket((Symplectic, Zero))
        .field_dissipation(conduction)
        .energy(recorded)
        .entropy(|(_, s): &Point<Real>| s.x + s.y)
        .momentum(angular_momentum)
        .build()?;

    let about = "A training set of 50 runs of the thermoelastic double pendulum, as one NPY file.";
    let example = Example::new(about, STEPS, 0.3);
    let span = Span::until(example.step_size * example.steps as f64).tolerance(1e-9);
    // The start of a run is drawn from the seed and the number of its row alone.
    let mut runs = Sweep::new("learning_data")
        .seed(2004)
        .samples(RUNS)
        .run(|row| {
            let mut draw = row.draw();
            let start = SVector::from_fn(|i, _| around[i] + draw.uniform(-0.1..0.1));
            let outputs = span.output_every(example.step_size);
            Ok(DormandPrince8.run(&pendulum, (start, Vector2::zeros()), outputs)?)
        })
        .observe("H", energy)
        .observe("L", angular_momentum)
        .observe("S", |(_, s)| s.x + s.y);
    for i in 0..10 {
        let entry = move |(x, s): &Point<f64>| if i < 8 { x[i] } else { s[i - 8] };
        runs = runs.observe(format!("x{i}"), entry);
    }
    let table = runs.execute()?;

    let lines = |name: &str| -> Vec<Vec<(f64, f64)>> {
        table.rows().filter_map(|row| Some(row.series(name)?.collect())).collect()
    };
    let relative = |name: &str| -> Vec<Vec<(f64, f64)>> {
        let error = |line: Vec<(f64, f64)>| {
            let first = line[0].1;
            line.into_iter().map(|(t, value)| (t, value / first - 1.0)).collect()
        };
        lines(name).into_iter().map(error).collect()
    };
    let folder = Gallery::open()?;
    let mut states = Profiles::npy(File::create(folder.path("learning_data.npy"))?, 10)?;
    let entries: Vec<_> = (0..10).map(|i| lines(&format!("x{i}"))).collect();
    for (run, line) in entries[0].iter().enumerate() {
        for step in 0..line.len() {
            states.row(entries.iter().map(|entry| entry[run][step].1))?;
        }
    }

    let worst = |lines: &[Vec<(f64, f64)>]| {
        lines.iter().flatten().fold(0.0_f64, |worst, (_, error)| worst.max(error.abs()))
    };
    let [energies, momenta, entropies] = [relative("H"), relative("L"), lines("S")];
    let rise = |line: &Vec<(f64, f64)>| line.windows(2).all(|pair| pair[1].1 >= pair[0].1);
    let falls = entropies.iter().filter(|line| !rise(line)).count();
    let [energy, momentum] = [worst(&energies), worst(&momenta)];
    let panel = |name: &str, lines: &[Vec<(f64, f64)>]| {
        lines.iter().fold(Panel::new(name, "t"), |panel, line| panel.line("runs", line))
    };
    // The first run: where the masses go, from the pivot at the origin.
    let along = |i: usize| -> Vec<(f64, f64)> {
        entries[i][0].iter().zip(&entries[i + 1][0]).map(|(x, y)| (x.1, y.1)).collect()
    };
    let motion = Panel::new("y", "x").title("one run").equal();
    let figure = Panels::new(format!("A training set of {RUNS} runs with both laws exact"))
        .columns(2)
        .panel(motion.line("q₁", along(0)).line("q₂", along(2)))
        .panel(panel("relative error of H", &energies))
        .panel(panel("relative error of L", &momenta))
        .panel(panel("entropy S", &entropies));
    let last = table.row(RUNS - 1).ok_or("there are no runs")?.end().to_vec();
    example
        .report_of_many()
        .text(&table)
        .text("                  published set     this set")
        .text(format_args!("energy constant to   1.55e-4     {energy:.1e}"))
        .text(format_args!("momentum             5e-14       {momentum:.1e}"))
        .text(format_args!("runs where S falls   0           {falls}"))
        .with("rows", table.len())
        .with("failed", table.failed())
        .with("steps", example.steps)
        .with("final_state", last)
        .with("energy_error", energy)
        .with("momentum_error", momentum)
        .with("entropy_falls", falls)
        .figure(figure)
        .print()
}
