//! Measured figures of guarantees, for the report of verification.
//!
//! A test that measures a figure records it beside its assertion. `just report` runs these tests with the variable
//! `METRIPLECTIC_REPORT`, which names a folder, and writes `docs/verification.md` from what they leave there.

use std::{env, fmt, fs, io::Write, panic::Location, path::Path, thread};

use serde::{Deserialize, Serialize};

mod guarantee;
mod page;
mod verification;

pub use guarantee::Guarantee;
pub use verification::{Verification, VerificationError};

/// The variable of the environment that names the folder of the records.
const FOLDER: &str = "METRIPLECTIC_REPORT";

/// A figure and its bound.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Claim {
    guarantee: Guarantee,
    problem: String,
    method: String,
    figure: String,
    bound: String,
    reference: String,
    test: String,
}

impl Claim {
    /// Begins the claim that a method keeps a guarantee on a problem.
    #[must_use]
    pub fn new(
        guarantee: Guarantee,
        problem: impl Into<String>,
        method: impl Into<String>,
    ) -> Self {
        let [figure, bound, reference, test] = [const { String::new() }; 4];
        Self {
            guarantee,
            problem: problem.into(),
            method: method.into(),
            figure,
            bound,
            reference,
            test,
        }
    }

    /// Names what the figure was compared with, and its source.
    #[must_use]
    pub fn against(mut self, reference: impl Into<String>) -> Self {
        self.reference = reference.into();
        self
    }

    /// Records the figure and the bound that the test asserts, under the name of the test; does nothing unless a report is
    /// being written.
    ///
    /// # Panics
    ///
    /// If the record cannot be written.
    #[track_caller]
    pub fn record(mut self, figure: impl fmt::Display, bound: impl fmt::Display) {
        let Some(folder) = env::var_os(FOLDER) else { return };
        let file = of_tests(Location::caller().file());
        let thread = thread::current();
        // A test in a module has the name of this before its own.
        let name = thread.name().and_then(|name| name.rsplit("::").next()).unwrap_or_default();
        (self.figure, self.bound) = (figure.to_string(), bound.to_string());
        self.test = format!("{file}::{name}");
        let line = serde_json::to_string(&self).expect("strings are JSON");
        let path = Path::new(&folder).join(format!("{}.{name}.jsonl", file.replace('/', ".")));
        let written = fs::create_dir_all(&folder).and_then(|()| {
            let mut file = fs::OpenOptions::new().create(true).append(true).open(&path)?;
            writeln!(file, "{line}")
        });
        written.unwrap_or_else(|error| panic!("cannot write {}: {error}", path.display()));
    }
}

/// The name of a file in the folder of the tests: `noise/body` of `tests/noise/body.rs`.
fn of_tests(file: &str) -> &str {
    let inside = file.rsplit_once("tests/").map_or(file, |(_, inside)| inside);
    // The quick tests are files of the folder above.
    let inside = inside.strip_prefix("quick/../").unwrap_or(inside);
    inside.strip_suffix(".rs").unwrap_or(inside)
}

#[test]
fn a_claim_names_its_file_in_the_folder_of_the_tests() {
    for (file, name) in [
        ("tests/order.rs", "order"),
        ("tests/noise/body.rs", "noise/body"),
        ("tests/quick/../second_law.rs", "second_law"),
        ("order.rs", "order"),
    ] {
        assert_eq!(of_tests(file), name);
    }
}
