//! What a short run costs beside its steps, and what a journal costs beside its rows, in instructions.
//!
//! `cargo bench -p metriplectic-benches --bench runs` counts with callgrind. A count is a difference of two executions,
//! so that the start of the program drops out. It fails if a run of a verified model costs more than a quarter of 20 steps
//! beside them, or a journal more than a twentieth of rows of 10 steps.

use std::hint::black_box;
use std::process::Command;

use metriplectic::manifolds::metric::Canonical;
use metriplectic::prelude::*;

/// The steps of a short run.
const STEPS: usize = 20;
/// The steps of a row of the sweep.
const ROW: usize = 10;

fn body() -> impl Metriplectic<Manifold = LieDual<3>, Metric = Canonical> {
    System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| p.x.powi(2) * 0.05 + p.y.powi(2) * 0.1 + p.z.powi(2) * 0.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.2)
        .build()
        .expect("a system")
}

/// What is done from each start.
#[derive(Clone, Copy)]
enum Part {
    /// A run of so many steps.
    Run,
    /// The start, and so many steps without an end.
    Steps,
    /// The start alone.
    Start,
}

const PARTS: [(&str, Part); 3] =
    [("run", Part::Run), ("steps", Part::Steps), ("start", Part::Start)];

/// Runs from so many starts of a model that is verified once, or each time.
fn runs(method: &str, part: Part, verified: bool, count: usize) {
    let body = body();
    let once = body.verified(&vector![0.4, -1.0, 0.3]).expect("a model");
    for k in 0..count {
        let start = vector![0.4 + 1e-3 * k as f64, -1.0, 0.3];
        match (method, verified) {
            ("midpoint", true) => done(Scheme::new(WeylMidpoint), part, &once, start),
            ("midpoint", false) => done(Scheme::new(WeylMidpoint), part, &body, start),
            (_, true) => done(DormandPrince8, part, &once, start),
            (_, false) => done(DormandPrince8, part, &body, start),
        }
    }
}

fn done<F>(method: impl Method<F>, part: Part, system: &F, start: Vector3<f64>)
where
    F: Metriplectic<Manifold = LieDual<3>>,
{
    if let Part::Run = part {
        let run = method.run(system, start, Span::steps(0.1, STEPS).at_most(2));
        return drop(black_box(run.expect("a run")));
    }
    let mut steps = method.steps(system, start, 0.1).expect("a start");
    if let Part::Steps = part {
        for _ in 0..STEPS {
            black_box(steps.advance().expect("a step"));
        }
    }
    drop(black_box(steps));
}

/// A sweep of short rows, with a journal or without one.
fn sweep(journal: bool, rows: usize) {
    let body = body();
    let once = body.verified(&vector![0.4, -1.0, 0.3]).expect("a model");
    let path = std::env::temp_dir().join(format!("metriplectic-runs-{}", std::process::id()));
    let runs = Sweep::new("short")
        .samples(rows)
        .random("spin", |draw| draw.uniform(-1.0..1.0))
        .run(|row| {
            let span = Span::steps(0.1, ROW).at_most(2);
            Ok(WeylMidpoint.run(&once, vector![row["spin"], -1.0, 0.3], span)?)
        })
        .observe("p1", |p| p.x)
        .threads(1)
        .quiet();
    let runs = if journal { runs.journal(&path) } else { runs };
    black_box(runs.execute().expect("all rows"));
    let _ = std::fs::remove_file(path);
}

/// The instructions of this program with a task.
fn collected(task: &[String]) -> f64 {
    let program = std::env::current_exe().expect("a bench has a path");
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(program)
        .args(task)
        .output()
        .expect("valgrind starts");
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    let line = text.lines().find(|line| line.contains("Collected")).expect("a count");
    line.rsplit(' ').next().and_then(|count| count.parse().ok()).expect("a number")
}

/// The instructions of one of so many repetitions.
fn each(task: impl Fn(usize) -> Vec<String>) -> f64 {
    let [few, many] = [20, 120].map(|count| collected(&task(count)));
    (many - few) / 100.0
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize| arguments[k].parse::<usize>().expect("a number");
    match arguments.first().map(String::as_str) {
        Some("parts") => {
            let part = PARTS.iter().find(|(name, _)| *name == arguments[2]).expect("a part").1;
            return runs(&arguments[1], part, arguments[3] == "true", number(4));
        }
        Some("sweep") => return sweep(arguments[1] == "true", number(2)),
        _ => {}
    }
    if Command::new("valgrind").arg("--version").output().is_err() {
        println!("valgrind is not installed: the instructions are not counted");
        return;
    }
    for method in ["midpoint", "order 8"] {
        for verified in [true, false] {
            let [run, steps, start] = PARTS.map(|(part, _)| {
                each(|count| {
                    ["parts", method, part, &verified.to_string(), &count.to_string()]
                        .map(str::to_owned)
                        .to_vec()
                })
            });
            let (steps, fixed) = (steps - start, run - (steps - start));
            println!(
                "{method:10} verified once: {verified:5}  {STEPS} steps {steps:7.0}, beside them {fixed:7.0}: {:5.1} %",
                100.0 * fixed / steps
            );
            assert!(!verified || fixed <= 0.25 * steps, "{method}: a short run costs too much");
        }
    }
    let row = |journal: bool| {
        each(|rows| ["sweep", &journal.to_string(), &rows.to_string()].map(str::to_owned).to_vec())
    };
    let (without, with) = (row(false), row(true));
    println!(
        "a row of {ROW} steps {without:.0}, with a journal {with:.0}: {:.1} % more",
        100.0 * (with / without - 1.0)
    );
    assert!(with <= 1.05 * without, "a journal costs too much");
}
