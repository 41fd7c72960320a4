//! The bits of many runs, compared with a record of them: a change of structure must not change a result.
//!
//! Not part of the gate, because the elementary functions of another machine may round otherwise:
//! `just golden`, and `just golden --bless` writes the record.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use metriplectic::integrators::Schedule;
use metriplectic::prelude::*;
use metriplectic_studies::problems::{self, Problem, Study};

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
            let mut bits = String::new();
            for number in Y::Manifold::entries(&run.last().point) {
                write!(bits, "{:016x} ", number.to_bits()).expect("a string takes it all");
            }
            let counts = run.certificate();
            write!(bits, "after {} steps", counts.steps).expect("a string takes it all");
            self.0.insert(format!("{}, {scheme}, {kind}", problem.name), bits);
        }
    }
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
    let mut record = Record(BTreeMap::new());
    problems::each(&mut record);
    compare("problems.txt", &record.0);
    compare("examples.txt", &examples());
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
