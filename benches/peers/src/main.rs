//! Effort and precision beside the solvers that one would use instead: `just peers`.
//!
//! Prints the tables of `docs/peers.md`; the first argument is where the figure goes. With `--all`
//! every setting has its row.

use std::{env, error::Error, time::Instant};

use metriplectic_peers::{
    Gas, Problem, RelaxingBody, SpinningTop, exact,
    more::{HeavyTop, WarmOscillator},
    norm,
    ours::{How, Ours, Ran},
    rivals::{self, Path, Solver},
};
use metriplectic_studies::{Panel, Panels, Table, scientific};

const TIMES: [u32; 2] = [100, 10_000];
/// Exponents of the tolerances, and those in the tables.
const TOLERANCES: [i32; 10] = [3, 4, 5, 6, 7, 8, 9, 10, 11, 12];
const SHOWN_TOLERANCES: [i32; 3] = [4, 8, 12];
/// Steps in a unit of time, and those in the tables.
const STEPS: [(u32, u32); 6] = [(5, 2), (5, 1), (10, 1), (20, 1), (40, 1), (80, 1)];
const SHOWN_STEPS: [(u32, u32); 3] = [(5, 1), (20, 1), (80, 1)];
const OURS: &str = "metriplectic";
const EIGHT: &str = "DormandPrince8";
const FIVE: &str = "DormandPrince5";
/// The methods with stages, which have a table of their own.
const GAUSS: [&str; 3] = ["Gauss::<2>", "Gauss::<3>", "Gauss::<4>"];
/// Exponents of the tolerances of our adaptive methods.
const OUR_TOLERANCES: [i32; 10] = [3, 4, 5, 6, 7, 8, 9, 10, 11, 12];
/// A run is repeated until it has taken so many seconds, at most five times; the least time counts.
const PATIENCE: f64 = 0.5;

/// A run that came to its end.
struct Outcome {
    steps: usize,
    evaluations: u64,
    seconds: f64,
    /// The distance from the exact solution at the end.
    error: f64,
    /// `max |H − H₀|/|H₀|` over all steps.
    energy_error: f64,
    /// The least `ΔS` of a step and the steps on which `S` fell by more than its round-off.
    entropy: Option<(f64, usize)>,
    /// `max ||x| − 1|`.
    defect: Option<f64>,
}

struct Entry {
    method: &'static str,
    setting: String,
    shown: bool,
    outcome: Result<Outcome, String>,
}

/// All runs of a problem over a time.
struct Comparison {
    problem: String,
    dimension: usize,
    time: u32,
    entries: Vec<Entry>,
}

/// Repeats a run; what it gives, and the least seconds.
fn timed<T>(mut run: impl FnMut() -> T) -> (T, f64) {
    let (mut least, mut all) = (f64::INFINITY, 0.0);
    for _ in 0..4 {
        let clock = Instant::now();
        let result = run();
        let seconds = clock.elapsed().as_secs_f64();
        (least, all) = (least.min(seconds), all + seconds);
        if all > PATIENCE {
            return (result, least);
        }
    }
    let clock = Instant::now();
    let result = run();
    (result, least.min(clock.elapsed().as_secs_f64()))
}

/// Repeats a run of ours, which times itself; what it gives with the least seconds.
fn fastest<const N: usize>(
    mut run: impl FnMut() -> Result<Ran<N>, String>,
) -> Result<Ran<N>, String> {
    let mut best = run()?;
    let mut all = best.seconds;
    for _ in 0..4 {
        if all > PATIENCE {
            break;
        }
        let next = run()?;
        all += next.seconds;
        if next.seconds < best.seconds {
            best = next;
        }
    }
    Ok(best)
}

fn distance<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    norm(&std::array::from_fn::<f64, N, _>(|i| a[i] - b[i]))
}

/// The balance of a rival's path, drawn up after the clock has stopped.
fn audited<P: Problem<N>, const N: usize>(
    problem: &P,
    exact: &[f64; N],
    (path, seconds): (Path<N>, f64),
) -> Result<Outcome, String> {
    let (path, evaluations) = path?;
    let energy = problem.energy(&path[0]);
    let off = |x: &[f64; N]| ((problem.energy(x) - energy) / energy).abs();
    let mut entropy = problem.entropy(&path[0]).map(|_| (f64::INFINITY, 0));
    for pair in path.windows(2) {
        let values = (problem.entropy(&pair[0]), problem.entropy(&pair[1]), &mut entropy);
        let (Some(before), Some(after), Some((least, falls))) = values else { break };
        let round_off =
            4.0 * f64::EPSILON * (before.abs().max(1.0) + problem.entropy_scale(&pair[0]));
        *least = least.min(after - before);
        *falls += usize::from(after - before < -round_off);
    }
    let defect = path.iter().map(|x| (norm(x) - 1.0).abs()).fold(0.0, f64::max);
    Ok(Outcome {
        steps: path.len() - 1,
        evaluations,
        seconds,
        error: distance(&path[path.len() - 1], exact),
        energy_error: path.iter().map(off).fold(0.0, f64::max),
        entropy,
        defect: problem.on_sphere().then_some(defect),
    })
}

fn certified<P: Problem<N>, const N: usize>(
    problem: &P,
    exact: &[f64; N],
    ran: Result<Ran<N>, String>,
) -> Result<Outcome, String> {
    let Ran { end, certificate, calls, seconds } = ran?;
    let entropy = (certificate.min_entropy_increment, certificate.entropy_falls);
    Ok(Outcome {
        steps: certificate.steps,
        evaluations: calls,
        seconds,
        error: distance(&end, exact),
        energy_error: certificate.max_relative_energy_error(),
        entropy: problem.entropy(&end).map(|_| entropy),
        defect: problem.on_sphere().then_some(certificate.max_manifold_defect),
    })
}

fn compare<P: Ours<N>, const N: usize>(problem: &P, time: u32, entries: &mut Vec<Entry>) {
    let end = f64::from(time);
    let exact = exact::flow(problem, end, 16 * time).map(f64::from);
    for (n, d) in STEPS {
        let h = f64::from(d) / f64::from(n);
        let how = How::Midpoint { h, steps: (time * n / d) as usize };
        let outcome = certified(problem, &exact, fastest(|| problem.run(how)));
        let shown = SHOWN_STEPS.contains(&(n, d));
        entries.push(Entry { method: OURS, setting: format!("h = {h}"), shown, outcome });
    }
    let adaptive: [(&'static str, fn(f64, f64) -> How); 5] = [
        (EIGHT, How::Eight),
        (FIVE, How::Five),
        (GAUSS[0], How::Gauss2),
        (GAUSS[1], How::Gauss3),
        (GAUSS[2], How::Gauss4),
    ];
    for (method, how) in adaptive {
        for k in OUR_TOLERANCES {
            let tolerance = 10.0_f64.powi(-k);
            let outcome = certified(problem, &exact, fastest(|| problem.run(how(end, tolerance))));
            let (setting, shown) = (format!("{tolerance:.0e}"), SHOWN_TOLERANCES.contains(&k));
            entries.push(Entry { method, setting, shown, outcome });
        }
    }
    let rivals: [(&str, Solver<P, N>); 4] = [
        ("differential-equations", rivals::differential_equations),
        ("the same, projected", rivals::projected),
        ("diffsol", rivals::diffsol),
        // Last, since it fails on one problem, and lines in a panel take their colours in order.
        ("ode_solvers", rivals::ode_solvers),
    ];
    for (method, solve) in rivals {
        for k in TOLERANCES {
            let tolerance = 10.0_f64.powi(-k);
            let run = timed(|| solve(problem, end, tolerance));
            let outcome = audited(problem, &exact, run);
            let (setting, shown) = (format!("{tolerance:.0e}"), SHOWN_TOLERANCES.contains(&k));
            entries.push(Entry { method, setting, shown, outcome });
        }
    }
}

impl Comparison {
    fn of<P: Ours<N>, const N: usize>(problem: &P, time: u32) -> Self {
        eprintln!("{}, T = {time}", problem.name());
        let mut entries = Vec::new();
        compare(problem, time, &mut entries);
        let dimension = N - usize::from(problem.on_sphere());
        Self { problem: problem.name(), dimension, time, entries }
    }

    fn table(&self, all: bool) -> Table<10> {
        let mut table = Table::new([
            "method",
            "setting",
            "steps",
            "evaluations",
            "ms",
            "error at T",
            "energy error",
            "least ΔS",
            "falls of S",
            "||x| − 1|",
        ]);
        for entry in self.entries.iter().filter(|entry| all || entry.shown) {
            let head = [entry.method.to_owned(), entry.setting.clone()];
            let tail: [String; 8] = match &entry.outcome {
                Ok(o) => {
                    let none = || "–".to_owned();
                    let (least, falls) = o.entropy.map_or((none(), none()), |(least, falls)| {
                        (scientific(least), falls.to_string())
                    });
                    [
                        o.steps.to_string(),
                        o.evaluations.to_string(),
                        format!("{:.3}", 1e3 * o.seconds),
                        scientific(o.error),
                        scientific(o.energy_error),
                        least,
                        falls,
                        o.defect.map_or_else(none, scientific),
                    ]
                }
                Err(error) => {
                    eprintln!("{}: {error}", entry.method);
                    std::array::from_fn(|i| if i == 0 { "failed".into() } else { String::new() })
                }
            };
            let [a, b] = head;
            let [c, d, e, f, g, h, i, j] = tail;
            table.row([a, b, c, d, e, f, g, h, i, j]);
        }
        table
    }

    /// The methods, each once.
    fn every_method(&self) -> Vec<&'static str> {
        let mut methods: Vec<&str> = Vec::new();
        for entry in &self.entries {
            if !methods.contains(&entry.method) {
                methods.push(entry.method);
            }
        }
        methods
    }

    /// The methods but those with stages, each once.
    fn methods(&self) -> Vec<&'static str> {
        let every = self.every_method().into_iter();
        every.filter(|method| !GAUSS.contains(method)).collect()
    }

    /// The evaluations of a run in units of a velocity: our differentials take a call for each pair of entries.
    fn velocities(&self, method: &str, outcome: &Outcome) -> f64 {
        let is_ours = [OURS, EIGHT, FIVE].contains(&method) || GAUSS.contains(&method);
        let calls = if is_ours { self.dimension.div_ceil(2) } else { 1 };
        outcome.evaluations as f64 / calls as f64
    }

    fn outcomes(&self, method: &str) -> impl Iterator<Item = &Outcome> {
        let entries = self.entries.iter().filter(move |entry| entry.method == method);
        entries.filter_map(|entry| entry.outcome.as_ref().ok())
    }

    /// The least time in which a method came as near to the exact solution.
    fn fastest(&self, method: &str, error: f64) -> Option<f64> {
        let near = self.outcomes(method).filter(|o| o.error <= error);
        near.map(|o| o.seconds).reduce(f64::min)
    }

    /// The least evaluations with which a method came as near to the exact solution.
    fn least(&self, method: &str, error: f64) -> Option<u64> {
        let near = self.outcomes(method).filter(|o| o.error <= error);
        near.map(|o| o.evaluations).min()
    }

    fn panel(&self, title: String, value: impl Fn(&Outcome) -> f64) -> Panel {
        let mut panel = Panel::new(title, "log₁₀ of the time in ms").logarithmic(1e-16);
        for method in self.methods() {
            let mut points: Vec<(f64, f64)> = self
                .outcomes(method)
                .map(|o| ((1e3 * o.seconds).log10(), value(o)))
                .filter(|(_, y)| y.is_finite())
                .collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            if !points.is_empty() {
                panel = panel.line(method, points);
            }
        }
        panel
    }
}

/// The least milliseconds of each method to an error at the end.
fn summary(all: &[Comparison]) -> Table<10> {
    let mut header = vec!["problem".to_owned(), "T".into(), "error below".into()];
    header.extend(all[0].methods().into_iter().map(String::from));
    let header: [String; 10] = std::array::from_fn(|i| header[i].clone());
    let mut table = Table::new(header);
    for comparison in all {
        for error in [1e-2, 1e-4, 1e-8] {
            let mut row = vec![comparison.problem.clone(), comparison.time.to_string()];
            row.push(format!("{error:.0e}"));
            for method in comparison.methods() {
                let fastest = comparison.fastest(method, error);
                row.push(fastest.map_or("–".into(), |s| format!("{:.2}", 1e3 * s)));
            }
            let row: [String; 10] = std::array::from_fn(|i| row[i].clone());
            table.row(row);
        }
    }
    table
}

/// The least evaluations and milliseconds of the methods with stages to an error at the end, beside the explicit one.
fn with_stages(all: &[Comparison]) -> Table<7> {
    let [two, three, four] = GAUSS;
    let mut table = Table::new(["problem", "T", "error below", EIGHT, two, three, four]);
    for comparison in all {
        for error in [1e-4, 1e-8, 1e-11] {
            let cell = |method| {
                let least = comparison.least(method, error).zip(comparison.fastest(method, error));
                least.map_or("–".into(), |(evaluations, s)| {
                    format!("{evaluations}, {:.2}", 1e3 * s)
                })
            };
            let head =
                [comparison.problem.clone(), comparison.time.to_string(), format!("{error:.0e}")];
            let [problem, time, error] = head;
            let [a, b, c, d] = [EIGHT, two, three, four].map(cell);
            table.row([problem, time, error, a, b, c, d]);
        }
    }
    table
}

/// The methods in the figure of work against precision, and what they are called there.
const DRAWN: [(&str, &str); 7] = [
    (OURS, "WeylMidpoint"),
    (EIGHT, EIGHT),
    (FIVE, FIVE),
    (GAUSS[0], GAUSS[0]),
    (GAUSS[2], GAUSS[2]),
    ("the same, projected", "DOP853, projected onto H"),
    ("ode_solvers", "DOP853"),
];

/// Draws the error at `T = 100` over the evaluations, of every method on six problems.
fn precision(path: &str) -> Result<(), Box<dyn Error>> {
    let time = TIMES[0];
    let all = [
        Comparison::of(&RelaxingBody, time),
        Comparison::of(&SpinningTop, time),
        Comparison::of(&HeavyTop, time),
        Comparison::of(&Gas { alpha: 1e-3 }, time),
        Comparison::of(&Gas { alpha: 0.5 }, time),
        Comparison::of(&WarmOscillator, time),
    ];
    let mut figure = Panels::new("Work and precision at T = 100").columns(3);
    for comparison in &all {
        let mut panel = Panel::new(comparison.problem.clone(), "log₁₀ of the evaluations");
        panel = panel.logarithmic(1e-16);
        for (method, label) in DRAWN {
            let mut points: Vec<(f64, f64)> = comparison
                .outcomes(method)
                .map(|o| (comparison.velocities(method, o).log10(), o.error))
                .filter(|(_, error)| error.is_finite())
                .collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            panel = panel.line(label, points);
        }
        figure = figure.panel(panel);
    }
    figure.save(path)?;
    eprintln!("figure: {path}");
    let mut header = vec!["problem", "error below"];
    header.extend(all[0].every_method());
    let mut table = Table::<12>::new(std::array::from_fn(|i| header[i].to_owned()));
    for comparison in &all {
        for error in [1e-2, 1e-4, 1e-8] {
            let mut row = vec![comparison.problem.clone(), format!("{error:.0e}")];
            row.extend(comparison.every_method().into_iter().map(|method| {
                let near = comparison.outcomes(method).filter(|o| o.error <= error);
                let least = near.map(|o| comparison.velocities(method, o)).reduce(f64::min);
                least.map_or("–".into(), |least| format!("{least:.0}"))
            }));
            table.row(std::array::from_fn(|i| row[i].clone()));
        }
    }
    println!("Evaluations of the velocity to an error at T = {time}:\n\n{}", table.markdown());
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let every = arguments.iter().any(|argument| argument == "--all");
    let path = arguments.iter().find(|argument| !argument.starts_with("--"));
    if arguments.iter().any(|argument| argument == "--precision") {
        return precision(path.ok_or("where does the figure go?")?);
    }
    let mut all = Vec::new();
    for time in TIMES {
        all.push(Comparison::of(&RelaxingBody, time));
        all.push(Comparison::of(&SpinningTop, time));
        all.push(Comparison::of(&Gas { alpha: 1e-3 }, time));
        all.push(Comparison::of(&Gas { alpha: 0.5 }, time));
    }
    println!("The least milliseconds to an error at T:\n\n{}", summary(&all).markdown());
    println!(
        "\nWith stages: evaluations and milliseconds to an error at T:\n\n{}",
        with_stages(&all).markdown()
    );
    for comparison in &all {
        println!("\n### {}, T = {}\n", comparison.problem, comparison.time);
        println!("{}", comparison.table(every).markdown());
    }
    let mut figure = Panels::new("Effort and precision: the error over the time").columns(4);
    for comparison in &all {
        let title = format!("{}: error at T = {}", comparison.problem, comparison.time);
        figure = figure.panel(comparison.panel(title, |o| o.error));
    }
    for comparison in all.iter().filter(|comparison| comparison.time == TIMES[1]) {
        let title = format!("{}: energy error, T = {}", comparison.problem, comparison.time);
        figure = figure.panel(comparison.panel(title, |o| o.energy_error));
    }
    if let Some(path) = path {
        figure.save(path)?;
        eprintln!("figure: {path}");
    }
    Ok(())
}
