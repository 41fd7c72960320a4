//! Beside the methods of the literature that keep laws: `cargo run --release --no-default-features --bin neighbours`.
//!
//! Prints the table of `docs/peers.md`: relaxation Runge-Kutta for one law and for two, and the scheme of Andrews and Farrell.

use metriplectic_peers::{
    Gas, RelaxingBody, averaged,
    averaged::TwoLaws,
    exact,
    more::WarmOscillator,
    norm,
    ours::{How, Ours},
    relaxation::{self, Path, Relaxed},
};
use metriplectic_studies::{Table, scientific};

const TOLERANCES: [f64; 2] = [1e-4, 1e-10];
/// Steps of one size in a unit of time.
const STEPS: [u32; 1] = [40];

/// A row of the table.
struct Row {
    method: &'static str,
    setting: String,
    steps: usize,
    evaluations: u64,
    error: f64,
    energy_error: f64,
    falls: usize,
    plain: Option<usize>,
}

/// What a path has kept.
fn audited<P: TwoLaws<N>, const N: usize>(
    problem: &P,
    exact: &[f64; N],
    (method, setting): (&'static str, String),
    path: &Path<N>,
) -> Row {
    let states = &path.states;
    let energy = problem.energy(&states[0]);
    let off = |x: &[f64; N]| ((problem.energy(x) - energy) / energy).abs();
    let entropy = |x: &[f64; N]| problem.entropy(x).unwrap_or(f64::NAN);
    let fell = |pair: &&[[f64; N]]| {
        let (before, after) = (entropy(&pair[0]), entropy(&pair[1]));
        let size = before.abs().max(1.0) + problem.entropy_scale(&pair[0]);
        after - before < -4.0 * f64::EPSILON * size
    };
    let end = states[states.len() - 1];
    Row {
        method,
        setting,
        steps: states.len() - 1,
        evaluations: path.evaluations,
        error: norm(&std::array::from_fn::<f64, N, _>(|i| end[i] - exact[i])),
        energy_error: states.iter().map(off).fold(0.0, f64::max),
        falls: states.windows(2).filter(fell).count(),
        plain: Some(path.plain),
    }
}

fn rows<P: TwoLaws<N> + Ours<N>, const N: usize>(problem: &P, time: u32, table: &mut Table<9>) {
    eprintln!("{}, T = {time}", problem.name());
    let end = f64::from(time);
    let exact = exact::flow(problem, end, 16 * time).map(f64::from);
    let mut all = Vec::new();
    for tolerance in TOLERANCES {
        let relaxed = [
            ("DP5, no law", Relaxed::Nothing),
            ("DP5, relaxed for H", Relaxed::Energy),
            ("DP5, relaxed for H and S", Relaxed::Both),
        ];
        for (method, relaxed) in relaxed {
            let path = relaxation::run(problem, end, tolerance, relaxed);
            all.push(audited(problem, &exact, (method, format!("{tolerance:.0e}")), &path));
        }
        let ours: [(&str, fn(f64, f64) -> How); 2] =
            [("DormandPrince5", How::Five), ("DormandPrince8", How::Eight)];
        for (method, how) in ours {
            let setting = format!("{tolerance:.0e}");
            all.extend(certified(problem, &exact, (method, setting), how(end, tolerance)));
        }
    }
    for n in STEPS {
        let (h, steps) = (f64::from(n).recip(), (time * n) as usize);
        let setting = format!("h = {h}");
        match averaged::run(problem, h, steps) {
            Some(path) => {
                let names = ("Andrews-Farrell, one stage", setting.clone());
                all.push(audited(problem, &exact, names, &path));
            }
            None => eprintln!("Andrews-Farrell, {setting}: no convergence"),
        }
        let how = How::Midpoint { h, steps };
        all.extend(certified(problem, &exact, ("WeylMidpoint", setting), how));
    }
    all.sort_by_key(|row| row.method);
    for row in all {
        table.row([
            format!("{}, T = {time}", problem.name()),
            row.method.into(),
            row.setting,
            row.steps.to_string(),
            row.evaluations.to_string(),
            scientific(row.error),
            scientific(row.energy_error),
            row.falls.to_string(),
            row.plain.map_or("–".into(), |plain| plain.to_string()),
        ]);
    }
}

/// A run of ours; its evaluations are in units of a velocity, which takes a call for each pair of entries.
fn certified<P: Ours<N>, const N: usize>(
    problem: &P,
    exact: &[f64; N],
    (method, setting): (&'static str, String),
    how: How,
) -> Option<Row> {
    let ran = problem.run(how).map_err(|error| eprintln!("{method}, {setting}: {error}")).ok()?;
    let certificate = &ran.certificate;
    Some(Row {
        method,
        setting,
        steps: certificate.steps,
        evaluations: ran.calls / N.div_ceil(2) as u64,
        error: norm(&std::array::from_fn::<f64, N, _>(|i| ran.end[i] - exact[i])),
        energy_error: certificate.max_relative_energy_error(),
        falls: certificate.entropy_falls,
        plain: None,
    })
}

fn main() {
    let mut table = Table::new([
        "problem",
        "method",
        "setting",
        "steps",
        "evaluations",
        "error at T",
        "energy error",
        "falls of S",
        "steps without factors",
    ]);
    rows(&RelaxingBody, 100, &mut table);
    rows(&WarmOscillator, 100, &mut table);
    rows(&Gas { alpha: 1e-3 }, 100, &mut table);
    rows(&Gas { alpha: 1e-3 }, 10_000, &mut table);
    rows(&Gas { alpha: 0.5 }, 10_000, &mut table);
    println!("{}", table.markdown());
}
