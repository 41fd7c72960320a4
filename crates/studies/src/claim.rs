//! Measured figures of guarantees, for the report of verification.
//!
//! A test that measures a figure records it beside its assertion. `just report` runs these tests with the variable
//! `METRIPLECTIC_REPORT`, which names a folder, and writes `docs/verification.md` from what they leave there.

use std::{env, fmt, fs, io::Write, panic::Location, path::Path, thread};

use serde::{Deserialize, Serialize};

/// The variable of the environment that names the folder of the records.
const FOLDER: &str = "METRIPLECTIC_REPORT";

/// A sentence of the page of guarantees, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Guarantee {
    /// The first law.
    Energy,
    /// The second law.
    Entropy,
    /// Casimirs and momenta.
    Invariants,
    /// The order of convergence.
    Order,
    /// States against independent solutions.
    Accuracy,
    /// Ten million steps.
    LongRuns,
    /// Hard starts.
    HardSteps,
}

impl Guarantee {
    /// The heading of its table, and the place in the book that promises it.
    const fn heading(self) -> (&'static str, &'static str) {
        match self {
            Self::Energy => ("Energy is constant to round-off", "the-first-law"),
            Self::Entropy => ("Entropy decreases on no step", "the-second-law"),
            Self::Invariants => {
                ("Casimirs and momenta are constant to round-off", "further-invariants")
            }
            Self::Order => ("Orders are fitted", "order"),
            Self::Accuracy => ("States agree with independent solutions", "order"),
            Self::LongRuns => ("Errors do not grow over ten million steps", "steps"),
            Self::HardSteps => ("Hard starts end in a certified step or in an error", "steps"),
        }
    }
}

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
        let file = Path::new(Location::caller().file()).file_stem().unwrap_or_default();
        let thread = thread::current();
        let name = thread.name().unwrap_or_default();
        (self.figure, self.bound) = (figure.to_string(), bound.to_string());
        self.test = format!("{}::{name}", file.to_string_lossy());
        let line = serde_json::to_string(&self).expect("strings are JSON");
        let path = Path::new(&folder).join(format!("{}.{name}.jsonl", file.to_string_lossy()));
        let written = fs::create_dir_all(&folder).and_then(|()| {
            let mut file = fs::OpenOptions::new().create(true).append(true).open(&path)?;
            writeln!(file, "{line}")
        });
        written.unwrap_or_else(|error| panic!("cannot write {}: {error}", path.display()));
    }
}

/// The report of all records in a folder, as Markdown: the same text for the same records.
///
/// # Errors
///
/// Those of reading the folder, and a record that is none.
pub fn report(folder: &Path) -> std::io::Result<String> {
    let mut claims: Vec<Claim> = Vec::new();
    for entry in fs::read_dir(folder)? {
        let text = fs::read_to_string(entry?.path())?;
        for line in text.lines() {
            claims.push(serde_json::from_str(line)?);
        }
    }
    claims.sort();
    claims.dedup();
    let mut text = String::from(HEAD);
    for part in claims.chunk_by(|a, b| a.guarantee == b.guarantee) {
        let (heading, anchor) = part[0].guarantee.heading();
        text += &format!(
            "\n## {heading}\n\n[What is promised](../book/src/guarantees.md#{anchor}).\n\n\
             | problem | method | measured | asserted | compared with | test |\n|---|---|--:|--:|---|---|\n"
        );
        for Claim { problem, method, figure, bound, reference, test, .. } in part {
            let cells = [problem, method, figure, bound, reference];
            let cells = cells.map(|cell| cell.replace('|', "\\|").replace('*', "\\*"));
            text += &format!("| {} | `{test}` |\n", cells.join(" | "));
        }
    }
    Ok(text)
}

const HEAD: &str = "# Verification\n\nEach line is a figure that a test has measured and the bound that it asserts. \
`just report` runs the tests and writes this page; nothing in it is typed by hand. The name of a test is that of its file in \
`tests/` and of its function.\n";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_has_a_table_for_each_guarantee_in_their_order() {
        let folder = env::temp_dir().join("metriplectic-claims");
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        let claim = |guarantee, problem: &str| Claim {
            figure: "|x| = 1".into(),
            ..Claim::new(guarantee, problem, "so(3)*").against("a closed form")
        };
        let lines: Vec<String> = [claim(Guarantee::Order, "b"), claim(Guarantee::Energy, "a")]
            .iter()
            .map(|claim| serde_json::to_string(claim).unwrap())
            .collect();
        fs::write(folder.join("one.jsonl"), lines.join("\n")).unwrap();
        let text = report(&folder).unwrap();
        assert_eq!(text, report(&folder).unwrap());
        let at = |part: &str| text.find(part).unwrap_or_else(|| panic!("{part} is not in {text}"));
        assert!(at("## Energy") < at("## Orders"));
        assert!(text.contains("| a | so(3)\\* | \\|x\\| = 1 |  | a closed form | `` |"), "{text}");
    }
}
