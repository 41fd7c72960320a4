//! The bits of many runs, compared with a record of them: a change of structure must not change a result.
//!
//! Not part of the gate, because the elementary functions of another machine may round otherwise:
//! `just golden`, and `just golden --bless` writes the record. `cargo bench -p metriplectic-benches --bench golden -- methods`
//! compares one record alone: `problems`, `methods`, `lattices` or `examples`.

#[path = "../../tests/models/chain.rs"]
mod chain;
#[path = "../../tests/models/lattices.rs"]
#[allow(dead_code, reason = "one of the lattices is recorded")]
mod lattices;
#[path = "../../tests/models/methods.rs"]
mod methods;
#[path = "../../tests/models/stages.rs"]
mod stages;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use metriplectic::dynamics::system::Point;
use metriplectic::integrators::{Element, RunError, Schedule, StageFlow, StateSpace};
use metriplectic::prelude::*;
use metriplectic_studies::problems::{self, Problem, Study};

use methods::{Any, Explicit};
use stages::{Gauss2, Gauss3, Radau2, Radau3};

/// The methods whose runs are recorded, beside the scheme with each retraction.
const METHODS: [Any; 7] = [
    Any::Implicit(Gauss2),
    Any::Implicit(Gauss3),
    Any::Implicit(Radau2),
    Any::Implicit(Radau3),
    Any::Explicit(Explicit::Order5),
    Any::Explicit(Explicit::Order8),
    Any::Explicit(Explicit::Chebyshev),
];

/// Writes the bits of numbers, and the number of steps after which a run has them.
fn bits(entries: impl IntoIterator<Item = f64>, steps: usize) -> String {
    let mut bits = String::new();
    for number in entries {
        write!(bits, "{:016x} ", number.to_bits()).expect("a string takes it all");
    }
    write!(bits, "after {steps} steps").expect("a string takes it all");
    bits
}

/// A record of every problem with each of its retractions, in steps of one size and of many.
struct Record(BTreeMap<String, String>);

impl Study for Record {
    fn visit<Y, R>(&mut self, problem: &Problem<Y>, scheme: &'static str, retraction: R, _: f64)
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric> + Copy,
    {
        let fixed = Span::steps(problem.time / 60.0, 60);
        let courses: [(&str, Schedule); 2] = [
            ("fixed", fixed.into()),
            ("adaptive", Span::until(problem.time).tolerance(1e-4).into()),
        ];
        for (kind, course) in courses {
            let run = Scheme::new(retraction).run(&problem.system, problem.start.clone(), course);
            let run = run.unwrap_or_else(|error| panic!("{}: {error}", problem.name));
            let bits = bits(Y::Manifold::entries(&run.last().point), run.certificate().steps);
            self.0.insert(format!("{}, {scheme}, {kind}", problem.name), bits);
        }
    }
}

/// A record of every problem with the methods that need no retraction.
struct Methods(BTreeMap<String, String>);

impl Study for Methods {
    fn visit<Y, R>(&mut self, problem: &Problem<Y>, scheme: &'static str, _: R, _: f64)
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric> + Copy,
    {
        if scheme != "exponential" {
            return;
        }
        let Problem { name, manifold, metric, system, start, time, .. } = problem;
        let run = |method: Any, schedule: Schedule, start: &Point<Y>| {
            let run = method.run(system, start.clone(), schedule);
            let run = run.unwrap_or_else(|error| panic!("{name}, {method:?}: {error}"));
            bits(Y::Manifold::entries(&run.last().point), run.certificate().steps)
        };
        for method in METHODS {
            let label = format!("{name} on {manifold} ({metric}), {method:?}");
            let fixed = Span::steps(time / 60.0, 20);
            let adaptive = Span::until(time / 3.0).tolerance(1e-5);
            self.0.insert(format!("{label}, fixed"), run(method, fixed.into(), start));
            self.0.insert(format!("{label}, adaptive"), run(method, adaptive.into(), start));
        }
    }
}

/// Records runs of a lattice by every explicit method.
fn lattice<F: StageFlow>(
    record: &mut BTreeMap<String, String>,
    name: &str,
    lattice: &F,
    start: &Element<F>,
) {
    let mut note = |method: &str, run: Result<Trajectory<F::Space>, RunError<F::Space>>| {
        let run = run.unwrap_or_else(|error| panic!("{name}, {method}: {error}"));
        let bits = bits(F::Space::numbers(&run.last().point), run.certificate().steps);
        record.insert(format!("{name}, {method}"), bits);
    };
    let adaptive = Span::until(1.0).tolerance(1e-6);
    note("order 5", DormandPrince5.run(lattice, start.clone(), adaptive));
    note("order 8", DormandPrince8.run(lattice, start.clone(), adaptive));
    note("Chebyshev", RungeKuttaChebyshev.run(lattice, start.clone(), Span::steps(0.2, 5)));
}

/// The record of two lattices: oscillators with heat, and spins with heat.
fn of_lattices() -> BTreeMap<String, String> {
    let mut record = BTreeMap::new();
    let ring = chain::chain(Graph::ring(40));
    lattice(&mut record, "chain with heat", &ring, &ring.points(chain::waves));
    let spins = lattices::helix::lattice(12, [1.0, 1.0]);
    let start = spins.points(|i| lattices::helix::at(12, i, 0.0));
    lattice(&mut record, "helix of spins", &spins, &start);
    record
}

/// Compares a record with the one in `benches/golden`, or writes it.
fn compare(name: &str, record: &BTreeMap<String, String>) {
    let text: String = record.iter().map(|(name, bits)| format!("{name}: {bits}\n")).collect();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden").join(name);
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(&path, &text).expect("the record is written");
    }
    let known = std::fs::read_to_string(&path).expect("a record");
    let known: Vec<&str> = known.lines().collect();
    let changed: Vec<&str> = text.lines().filter(|line| !known.contains(line)).collect();
    println!("{name}: {} rows", record.len());
    assert_eq!(record.len(), known.len());
    assert!(changed.is_empty(), "{} rows have changed:\n{}", changed.len(), changed.join("\n"));
}

fn main() {
    let asked: Vec<String> =
        std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let wants = |name: &str| asked.is_empty() || asked.iter().any(|asked| asked == name);
    if wants("problems") {
        let mut record = Record(BTreeMap::new());
        problems::each(&mut record);
        compare("problems.txt", &record.0);
    }
    if wants("methods") {
        let mut record = Methods(BTreeMap::new());
        problems::each(&mut record);
        compare("methods.txt", &record.0);
    }
    if wants("lattices") {
        compare("lattices.txt", &of_lattices());
    }
    if wants("examples") {
        compare("examples.txt", &examples());
    }
}

/// The final state of every example, with all digits.
fn examples() -> BTreeMap<String, String> {
    let mut record = BTreeMap::new();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    for file in std::fs::read_dir(folder).expect("the folder of the examples") {
        let path = file.expect("an example").path();
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        let output = Command::new(env!("CARGO"))
            .args([
                "run",
                "--quiet",
                "--release",
                "--all-features",
                "--package",
                "metriplectic",
                "--example",
                &name,
            ])
            .args(["--", "--json"])
            .output()
            .expect("cargo runs");
        let report: serde_json::Value = serde_json::from_slice(&output.stdout)
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        if !report["final_state"].is_null() {
            record.insert(format!("example {name}"), report["final_state"].to_string());
        }
    }
    record
}
