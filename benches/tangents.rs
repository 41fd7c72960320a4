//! The cost of derivatives beside that of the run, in instructions of a step.
//!
//! `cargo bench -p metriplectic-benches --bench tangents` counts with callgrind. A count is a difference of a longer and a shorter
//! run, so that the start of the program drops out. Costs are printed in runs: steps of the plain run of the same method.

use std::hint::black_box;
use std::process::Command;

use metriplectic::dynamics::Parametrised;
use metriplectic::integrators::LinearisedAlong;
use metriplectic::prelude::*;

const START: Vector3<f64> = Vector3::new(0.4, -1.0, 0.3);
/// The size of a step.
const H: f64 = 0.02;
/// The steps of the two runs, between two powers of two, on which the second law of a tangent is judged.
const STEPS: [usize; 2] = [64, 127];

/// The work that is counted.
const TASKS: [&str; 3] = ["run", "tangent", "adjoint"];
const METHODS: [&str; 2] = ["midpoint", "order 8"];
const PARAMETERS: [&str; 3] = ["0", "4", "50"];

/// The manifold of a family of bodies.
type Wide<const P: usize> = Product<LieDual<3>, Euclidean<P>>;

fn body() -> impl Differentiable<Manifold = LieDual<3>, Wide: Metriplectic<Manifold = LieDual<3>>> {
    System::on(LieDual::so3())
        .energy(|p: &Vector3<Real>| (p.x * p.x / 3.0 + p.y * p.y / 2.0 + p.z * p.z) * 0.5)
        .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.025)
        .build()
        .expect("a system")
}

fn bodies() -> impl Parametrised<
    4,
    System: Differentiable<Manifold = LieDual<3>, Wide: Metriplectic<Manifold = Wide<4>>>,
> {
    Family::on(LieDual::so3())
        .parameters(["I1", "I2", "I3", "friction"])
        .energy(|p: &Vector3<Real>, t: &Vector4<Real>| {
            (p.x * p.x / t.x + p.y * p.y / t.y + p.z * p.z / t.z) * 0.5
        })
        .entropy(|p: &Vector3<Real>, t: &Vector4<Real>| p.norm_squared() * t.w * 0.5)
        .build()
        .expect("a family")
}

/// An energy with many coefficients, of the price of that of the body.
fn many() -> impl Parametrised<
    50,
    System: Differentiable<Manifold = LieDual<3>, Wide: Metriplectic<Manifold = Wide<50>>>,
> {
    Family::on(LieDual::so3())
        .parameters([""; 50])
        .energy(|p: &Vector3<Real>, t: &SVector<Real, 50>| {
            let pair = |k: usize| p.x * t[k] + p.y * t[k + 1] + p.z * t[k + 2];
            (0..16).fold(p.norm_squared() * 0.5, |sum, k| sum + pair(3 * k).powi(2) * 0.01)
        })
        .entropy(|p: &Vector3<Real>, t: &SVector<Real, 50>| p.norm_squared() * t[49] * 0.5)
        .build()
        .expect("a family")
}

fn done<D>(system: &D, [method, task]: [&str; 2], steps: usize)
where
    D: Differentiable<Manifold = LieDual<3>>,
    Scheme<WeylMidpoint>: Stepper<D> + LinearisedAlong<D>,
    DormandPrince8: Stepper<D> + LinearisedAlong<D>,
{
    if method == "midpoint" {
        by(Scheme::new(WeylMidpoint), system, task, steps);
    } else {
        by(DormandPrince8, system, task, steps);
    }
}

fn by<D, M>(method: M, system: &D, task: &str, steps: usize)
where
    D: Differentiable<Manifold = LieDual<3>>,
    M: Copy + Stepper<D> + LinearisedAlong<D>,
{
    let span = Span::steps(H, steps);
    match task {
        "run" => drop(black_box(method.run(system, START, span).expect("a run"))),
        "tangent" => drop(black_box(method.tangent(system, START, span).expect("a tangent"))),
        _ => {
            let run = method.adjoint(system, START, span).expect("a run");
            drop(black_box(run.gradient(|_, p: &Vector3<Real>| p.norm_squared())));
        }
    }
}

fn task(arguments: &[String]) {
    let [parameters, method, task] = [0, 1, 2].map(|k| arguments[k].as_str());
    let steps = arguments[3].parse().expect("a number");
    match parameters {
        "0" => done(&body(), [method, task], steps),
        "4" => {
            let theta = Vector4::new(3.0, 2.0, 1.0, 0.05);
            done(&bodies().at_parameters(theta), [method, task], steps);
        }
        _ => {
            let theta = SVector::<f64, 50>::from_fn(|k, _| 0.3 + (k as f64 * 1.7).cos());
            done(&many().at_parameters(theta), [method, task], steps);
        }
    }
}

/// The instructions of a step.
fn of_a_step(task: [&str; 3]) -> f64 {
    let program = std::env::current_exe().expect("a bench has a path");
    let [few, many] = STEPS.map(|steps| {
        let output = Command::new("valgrind")
            .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
            .arg(&program)
            .args(task)
            .arg(steps.to_string())
            .output()
            .expect("valgrind starts");
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        let line = text.lines().find(|line| line.contains("Collected")).expect("a count");
        let count = line.rsplit(' ').next().and_then(|count| count.parse::<f64>().ok());
        count.expect("a number")
    });
    (many - few) / (STEPS[1] - STEPS[0]) as f64
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.len() == 4 {
        return task(&arguments);
    }
    if Command::new("valgrind").arg("--version").output().is_err() {
        println!("valgrind is not installed: the instructions are not counted");
        return;
    }
    for method in METHODS {
        for parameters in PARAMETERS {
            let [run, tangent, adjoint] = TASKS.map(|task| of_a_step([parameters, method, task]));
            println!(
                "{method:8} n + P = 3 + {parameters:2}: a step {run:6.0}, tangent {:5.1} runs, adjoint {:5.1} runs",
                tangent / run - 1.0,
                adjoint / run - 1.0
            );
        }
    }
}
