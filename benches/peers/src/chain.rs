//! A chain of Fermi, Pasta, Ulam and Tsingou with heat, by this library and by DOP853 of `ode_solvers`: `cargo run
//! --release --bin chain`.
//!
//! The ring has 1000 sites `(q, p, s)` with a heat bath each, friction and conduction in each bond. The right-hand side of
//! DOP853 is written by hand; this library takes the closures of `tests/models/chain.rs`. All run on one thread, and the
//! least of seven times counts.

#[path = "../../../tests/models/chain.rs"]
mod model;

use std::cell::RefCell;
use std::error::Error;

use metriplectic::integrators::Flow;
use metriplectic::prelude::*;
use metriplectic_peers::rivals;
use metriplectic_studies::Table;
use ode_solvers_nalgebra::DVector;

use model::{chain, waves};

const SITES: usize = 1000;
const END: f64 = 20.0;
const TOLERANCES: [i32; 10] = [3, 4, 5, 6, 7, 8, 9, 10, 11, 12];
const SHOWN: [i32; 3] = [4, 7, 10];
const LEVELS: [i32; 4] = [4, 6, 8, 10];
const REPEATS: usize = 7;
const METHODS: [&str; 3] = ["DormandPrince5", "DormandPrince8", "ode_solvers"];

/// A run that came to its end.
struct Outcome {
    method: &'static str,
    exponent: i32,
    steps: usize,
    seconds: f64,
    error: f64,
    /// `max |H − H₀|/|H₀|` over the steps.
    energy_error: f64,
    /// The least change of the entropy in a step.
    least: f64,
    falls: usize,
}

/// The laws at a state, and the size of the terms of the entropy.
struct At {
    energy: f64,
    entropy: f64,
    size: f64,
}

/// What the entropy gains in a step, beside the size of its terms.
struct Rise {
    by: f64,
    size: f64,
}

/// The right-hand side by hand, with room for the differentials of the energy.
struct ByHand<'a>(&'a RefCell<Vec<[f64; 3]>>);

impl ode_solvers::System<f64, DVector<f64>> for ByHand<'_> {
    fn system(&self, _: f64, x: &DVector<f64>, v: &mut DVector<f64>) {
        let (x, v, n) = (x.as_slice(), v.as_mut_slice(), x.len() / 3);
        let mut w = self.0.borrow_mut();
        for (w, x) in w.iter_mut().zip(x.chunks_exact(3)) {
            *w = [0.0, x[1], (0.5 * x[2]).exp()];
        }
        for i in 0..n {
            let j = if i + 1 == n { 0 } else { i + 1 };
            let (r, heat) = (x[3 * j] - x[3 * i], x[3 * i + 2] + x[3 * j + 2]);
            let force = r * (1.0 + r * (0.25 + r)) - 0.025 * heat;
            w[i][0] -= force;
            w[j][0] += force;
            w[i][2] -= 0.025 * r;
            w[j][2] -= 0.025 * r;
        }
        for (v, w) in v.chunks_exact_mut(3).zip(w.iter()) {
            (v[0], v[1], v[2]) = (w[1], -w[0], 0.0);
        }
        for i in 0..n {
            let j = if i + 1 == n { 0 } else { i + 1 };
            let [[_, p, t], [_, q, u]] = [w[i], w[j]];
            // The factor 0.2 tu/(t + u) (1/t + 1/u) of the friction is 0.2.
            let (slip, flux) = (0.5 * (q - p), 0.1 * (u - t));
            let (force, heat) = (0.2 * slip, 0.2 * slip * slip);
            v[3 * i + 1] += force;
            v[3 * j + 1] -= force;
            v[3 * i + 2] += (heat + flux) / t;
            v[3 * j + 2] += (heat - flux) / u;
        }
    }
}

fn distance(x: impl Iterator<Item = f64>, y: &[f64]) -> f64 {
    x.zip(y).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}

/// The entries of all sites.
fn flat(x: &[Vector3<f64>]) -> impl Iterator<Item = f64> {
    x.iter().flat_map(|x| [x.x, x.y, x.z])
}

fn tolerance(exponent: i32) -> f64 {
    10.0_f64.powi(-exponent)
}

/// The seconds that this thread has had of a processor, which other programs on it do not stretch (Linux).
fn processor_seconds() -> Result<f64, Box<dyn Error>> {
    let line = std::fs::read_to_string("/proc/thread-self/schedstat")?;
    let nanoseconds: f64 = line.split_whitespace().next().ok_or("an empty line")?.parse()?;
    Ok(nanoseconds * 1e-9)
}

/// A chain, where it starts, and where it ends.
struct Case<'a, L> {
    lattice: &'a L,
    start: &'a Points<Euclidean<3>>,
    exact: &'a [f64],
}

impl<L: Flow<Space = metriplectic::lattices::Sites<Euclidean<3>>>> Case<'_, L> {
    /// A method of this library, at the tolerance `10^{-exponent}`.
    fn ours<M: Method<L> + Copy>(
        &self,
        name: &'static str,
        method: M,
        exponent: i32,
    ) -> Result<Outcome, Box<dyn Error>> {
        let Self { lattice, start, exact } = *self;
        let mut best: Option<Outcome> = None;
        for _ in 0..REPEATS {
            let span = Span::until(END).tolerance(tolerance(exponent));
            let mut steps = method.steps(lattice, start.clone(), span)?;
            // The model is verified before.
            let clock = processor_seconds()?;
            while steps.ending().is_none() {
                steps.advance()?;
            }
            let seconds = processor_seconds()? - clock;
            let certificate = steps.certificate();
            let next = Outcome {
                method: name,
                exponent,
                steps: certificate.steps,
                seconds,
                error: distance(flat(&steps.state().point), exact),
                energy_error: certificate.max_relative_energy_error(),
                least: certificate.min_entropy_increment,
                falls: certificate.entropy_falls,
            };
            best = best.filter(|best| best.seconds <= seconds).or(Some(next));
        }
        best.ok_or_else(|| "no run".into())
    }

    /// DOP853 of `ode_solvers`, whose laws are looked at after the clock has stopped.
    fn dop853(&self, exponent: i32) -> Result<Outcome, Box<dyn Error>> {
        let Self { lattice, start, exact } = *self;
        let scratch = RefCell::new(vec![[0.0; 3]; SITES]);
        let mut best: Option<(f64, Vec<DVector<f64>>)> = None;
        for _ in 0..REPEATS {
            let from = DVector::from_iterator(3 * SITES, flat(start));
            let mut solver = rivals::dop853(ByHand(&scratch), from, END, tolerance(exponent));
            let clock = processor_seconds()?;
            solver.integrate()?;
            let seconds = processor_seconds()? - clock;
            if best.as_ref().is_none_or(|(least, _)| seconds < *least) {
                best = Some((seconds, solver.y_out().clone()));
            }
        }
        let (seconds, path) = best.ok_or("no run")?;
        let laws: Vec<_> = path
            .iter()
            .map(|x| {
                let sites = x.as_slice().chunks_exact(3).map(|x| vector![x[0], x[1], x[2]]);
                let point = Points::from(sites.collect::<Vec<_>>());
                let metriplectic::integrators::Laws { energy, entropy, .. } = lattice.laws(&point);
                At { energy, entropy, size: lattice.term_sizes(&point).entropy }
            })
            .collect();
        let energy = laws[0].energy;
        let off = |at: &At| ((at.energy - energy) / energy).abs();
        let rises = || {
            laws.windows(2)
                .map(|pair| Rise { by: pair[1].entropy - pair[0].entropy, size: pair[1].size })
        };
        Ok(Outcome {
            method: METHODS[2],
            exponent,
            steps: path.len() - 1,
            seconds,
            error: distance(path[path.len() - 1].iter().copied(), exact),
            energy_error: laws.iter().map(off).fold(0.0, f64::max),
            least: rises().map(|rise| rise.by).fold(f64::INFINITY, f64::min),
            falls: rises().filter(|rise| rise.by < -4.0 * f64::EPSILON * rise.size).count(),
        })
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let lattice = chain(Graph::ring(SITES));
    let start = lattice.points(waves);
    let reference = |tolerance: f64| {
        let span = Span::until(END).tolerance(tolerance).at_most(2);
        let run = DormandPrince8.run(&lattice, start.clone(), span);
        run.map(|run| flat(&run.last().point).collect::<Vec<_>>())
    };
    let exact = reference(3e-15)?;
    let off = distance(reference(3e-14)?.into_iter(), &exact);
    println!("the exact solution is known to {off:.0e}, H₀ = {}", lattice.laws(&start).energy);
    let case = Case { lattice: &lattice, start: &start, exact: &exact };
    let mut outcomes = Vec::new();
    for exponent in TOLERANCES {
        let [five, eight, _] = METHODS;
        outcomes.push(case.ours(five, DormandPrince5, exponent)?);
        outcomes.push(case.ours(eight, DormandPrince8, exponent)?);
        outcomes.push(case.dop853(exponent)?);
    }
    let mut table = Table::new([
        "method",
        "setting",
        "steps",
        "ms",
        "error at T",
        "energy error",
        "least ΔS",
        "falls of S",
    ]);
    for method in METHODS {
        let shown = |o: &&Outcome| o.method == method && SHOWN.contains(&o.exponent);
        for o in outcomes.iter().filter(shown) {
            table.row([
                method.into(),
                format!("1e-{}", o.exponent),
                o.steps.to_string(),
                format!("{:.1}", o.seconds * 1e3),
                format!("{:.2e}", o.error),
                format!("{:.2e}", o.energy_error),
                format!("{:.2e}", o.least),
                o.falls.to_string(),
            ]);
        }
    }
    println!("{}", table.markdown());
    let mut table = Table::new(["error below", METHODS[0], METHODS[1], METHODS[2], "ratio"]);
    for level in LEVELS {
        let least = METHODS.map(|method| {
            let enough = |o: &&Outcome| o.method == method && o.error <= tolerance(level);
            let times = outcomes.iter().filter(enough).map(|o| o.seconds * 1e3);
            times.fold(f64::INFINITY, f64::min)
        });
        let [five, eight, dop] = least;
        let [a, b, c] = least.map(|ms| format!("{ms:.1}"));
        table.row([format!("1e-{level}"), a, b, c, format!("{:.2}", five.min(eight) / dop)]);
    }
    println!("{}", table.markdown());
    Ok(())
}
