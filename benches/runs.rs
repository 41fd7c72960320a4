//! The cost of a step that is tried, of a short run beside its steps, and of a journal beside its rows, in
//! instructions.
//!
//! `cargo bench -p metriplectic-benches --bench runs` counts with callgrind. A count is a difference of two executions,
//! so that the start of the program drops out. It fails if a step costs more than a twentieth beyond what it did, if a run of
//! a verified model costs more than 20 thousand instructions or a quarter of 20 steps beside them, or if a journal costs more
//! than a twentieth of rows of 10 steps.

use std::hint::black_box;
use std::process::Command;

use metriplectic::dynamics::system::Point;
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

/// The models whose steps are counted, with the times between which they are, and the instructions of a step of orders 8
/// and 5.
const TRIED: [(&str, [f64; 2], [f64; 2]); 4] = [
    ("body", [40.0, 200.0], [5866.0, 4529.0]),
    ("top", [20.0, 200.0], [6988.0, 4998.0]),
    ("inlined top", [20.0, 200.0], [6094.0, 4500.0]),
    ("gas", [4.0, 40.0], [9619.0, 6710.0]),
];

/// The energy of the top.
#[inline(always)]
fn cubic(x: &Vector3<Real>) -> Real {
    let term = |x: Real, weight: f64| x * x * (x * (2.0 / 3.0) + 1.0) * (0.5 * weight);
    term(x.x, 1.0) + term(x.y, 0.5) + term(x.z, 0.25)
}

fn count_top(energy: impl Fn(&Vector3<Real>) -> Real + Sync, order: &str, time: f64) {
    let top = System::on(Sphere::<2>::round()).bracket(AreaForm).energy(energy).build();
    let start = Vector3::from([3.0_f64.sqrt().recip(); 3]);
    count_tried(&top.expect("a system"), start, order, time);
}

/// A run to a time with a tolerance of 1e-8, which prints the steps that it tried.
fn tried(model: &str, order: &str, time: f64) {
    match model {
        "body" => {
            let [a, b, c] = [10.0, 5.0, 1.0].map(|moment: f64| 0.5 / moment);
            let body = System::on(LieDual::so3())
                .energy(move |p: &Vector3<Real>| p.x * p.x * a + p.y * p.y * b + p.z * p.z * c)
                .entropy(|p: &Vector3<Real>| (p.x * p.x + p.y * p.y + p.z * p.z) * 0.5)
                .build();
            count_tried(&body.expect("a system"), vector![0.001, -1.0, 0.001], order, time);
        }
        "top" => count_top(|x: &Vector3<Real>| cubic(x), order, time),
        "inlined top" => count_top(
            #[inline(always)]
            |x: &Vector3<Real>| cubic(x),
            order,
            time,
        ),
        _ => {
            let wall = |x: &Vector4<Real>| {
                let [left, right] = [x.z / x.x, x.w / (-x.x + 2.0)].map(|d| d * (2.0 / 3.0));
                let (o, one) = (Real::from(0.0), Real::from(1.0));
                Matrix4::new(o, one, o, o, -one, o, left, -right, o, -left, o, o, o, right, o, o)
            };
            let leak = |_: &Vector4<Real>, w: &Vector4<Real>| {
                let o = Real::from(0.0);
                let (one, both, two) = (w.w * w.w * 0.5, w.z * w.w * -0.5, w.z * w.z * 0.5);
                Matrix4::new(o, o, o, o, o, o, o, o, o, o, one, both, o, o, both, two)
            };
            let gas = System::on(Euclidean::<4>)
                .bracket(Poisson::field(wall))
                .dissipation(FieldDissipation(leak))
                .energy(|x: &Vector4<Real>| x.y * x.y * 0.5 + x.z + x.w)
                .entropy(|x: &Vector4<Real>| (x.x * (-x.x + 2.0)).ln() + (x.z * x.w).ln() * 1.5)
                .build();
            count_tried(&gas.expect("a system"), vector![1.0, 2.0, 2.0, 2.0], order, time);
        }
    }
}

fn count_tried<Y: Metriplectic>(system: &Y, start: Point<Y>, order: &str, time: f64) {
    let system = &system.verified(&start).expect("a model");
    let span = Span::until(time).tolerance(1e-8).at_most(2);
    let run = match order {
        "5" => DormandPrince5.run(system, start, span),
        _ => DormandPrince8.run(system, start, span),
    };
    let run = run.expect("a run");
    println!("{}", run.certificate().steps + run.certificate().rejected);
}

/// The instructions of a step that is tried.
fn of_a_tried_step(model: &str, order: &str, times: [f64; 2]) -> f64 {
    let [[few, a], [many, b]] = times.map(|time| {
        let task = ["tried", model, order, &time.to_string()].map(str::to_owned);
        let Counted { instructions, printed } = counted(&task);
        [instructions, printed.trim().parse().expect("a number of steps")]
    });
    (many - few) / (b - a)
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

/// Returns the count by callgrind of this program with a task, and the output of the program.
struct Counted {
    instructions: f64,
    printed: String,
}

fn collected(task: &[String]) -> f64 {
    counted(task).instructions
}

fn counted(task: &[String]) -> Counted {
    let program = std::env::current_exe().expect("a bench has a path");
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(program)
        .args(task)
        .output()
        .expect("valgrind starts");
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    let line = text.lines().find(|line| line.contains("Collected")).expect("a count");
    let instructions = line.rsplit(' ').next().and_then(|count| count.parse().ok());
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    Counted { instructions: instructions.expect("a number"), printed }
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
        Some("tried") => {
            return tried(&arguments[1], &arguments[2], arguments[3].parse().expect("a time"));
        }
        Some("sweep") => return sweep(arguments[1] == "true", number(2)),
        _ => {}
    }
    if Command::new("valgrind").arg("--version").output().is_err() {
        println!("valgrind is not installed: the instructions are not counted");
        return;
    }
    for (k, order) in ["8", "5"].into_iter().enumerate() {
        for (model, times, known) in TRIED {
            let each = of_a_tried_step(model, order, times);
            println!(
                "order {order}, {model:11} a step that is tried, at a tolerance of 1e-8: {each:6.0}"
            );
            assert!(each <= 1.05 * known[k], "order {order}, {model}: {} before", known[k]);
        }
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
            let bound = (0.25 * steps).min(20e3);
            assert!(!verified || fixed <= bound, "{method}: a short run costs too much");
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
