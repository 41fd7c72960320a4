//! The report of verification.

use std::{collections::BTreeMap, fs, io, path::Path};

use super::{Claim, Guarantee, page};

/// Why there is no report.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum VerificationError {
    /// The records or the sources cannot be read.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// A record is none.
    #[error("a record cannot be read: {0}")]
    Record(#[from] serde_json::Error),
    /// A claim names a test that there is not.
    #[error("`{test}` is no test: there is no `fn {name}` in tests/{file}.rs")]
    NoTest {
        /// The name in the claim.
        test: String,
        /// Its file.
        file: String,
        /// Its function.
        name: String,
    },
    /// A guarantee has no claim.
    #[error("nothing is recorded for {0:?}: {heading}", heading = .0.facts().heading)]
    NoClaim(Guarantee),
    /// A guarantee speaks of a sentence that the page of guarantees does not have.
    #[error("the page of guarantees has no sentence with \"{part}\", of {guarantee:?}")]
    NoSentence {
        /// The guarantee.
        guarantee: Guarantee,
        /// The text that it looks for.
        part: &'static str,
    },
    /// A sentence that names a test is held by nothing.
    #[error("no table of the report holds this sentence, which names a test: {0}")]
    Unheld(String),
}

metriplectic_equations::debug_is_the_sentence!(VerificationError);

/// All claims, and the page that they hold.
#[derive(Clone, Debug)]
pub struct Verification {
    claims: Vec<Claim>,
    sentences: Vec<String>,
    /// How many of the sentences promise; the others are limits.
    promises: usize,
}

impl Verification {
    /// The records in a folder, for the page of guarantees of the workspace at `root`.
    ///
    /// # Errors
    ///
    /// [`VerificationError`] if a file cannot be read, and wherever claims, tests and sentences do not match.
    pub fn of(records: &Path, root: &Path) -> Result<Self, VerificationError> {
        let mut claims: Vec<Claim> = Vec::new();
        for entry in fs::read_dir(records)? {
            for line in fs::read_to_string(entry?.path())?.lines() {
                claims.push(serde_json::from_str(line)?);
            }
        }
        claims.sort();
        claims.dedup();
        let page = fs::read_to_string(root.join("book/src/guarantees.md"))?;
        let promises = page.split("## Limits").next().unwrap_or(&page);
        let promises = page::sentences(promises).len();
        let verification = Self { claims, sentences: page::sentences(&page), promises };
        for claim in &verification.claims {
            has_test(&claim.test, root)?;
        }
        verification.matches()?;
        Ok(verification)
    }

    /// Every guarantee has claims and sentences, and every sentence that names a test has claims.
    fn matches(&self) -> Result<(), VerificationError> {
        for guarantee in Guarantee::ALL {
            if !self.claims.iter().any(|claim| claim.guarantee == guarantee) {
                return Err(VerificationError::NoClaim(guarantee));
            }
        }
        holds(&self.sentences)
    }

    /// The report as Markdown: the same text for the same records.
    #[must_use]
    pub fn report(&self) -> String {
        let mut text = format!("{HEAD}\n## Sentences and tables\n\n{}", self.promises());
        for part in self.claims.chunk_by(|a, b| a.guarantee == b.guarantee) {
            text += &table(part);
        }
        text
    }

    /// A table of the sentences of the page of guarantees, with the tables that hold them.
    fn promises(&self) -> String {
        let mut counts: BTreeMap<Guarantee, usize> = BTreeMap::new();
        for claim in &self.claims {
            *counts.entry(claim.guarantee).or_default() += 1;
        }
        let tables = |sentence: &str| {
            let held = page::held(sentence).into_iter();
            let links = held.map(|g| {
                format!(
                    "[{}](#{}): {}",
                    g.facts().heading,
                    g.anchor(),
                    counts.get(&g).unwrap_or(&0)
                )
            });
            links.collect::<Vec<_>>().join("; ")
        };
        let mut text = String::from(PROMISES);
        for (index, sentence) in self.sentences.iter().enumerate() {
            let tables = tables(sentence);
            match tables.as_str() {
                "" if index >= self.promises => {}
                "" => text += &format!("| {} | – |\n", quoted(sentence)),
                tables => text += &format!("| {} | {tables} |\n", quoted(sentence)),
            }
        }
        text
    }
}

/// The table of one guarantee, with its figures.
fn table(claims: &[Claim]) -> String {
    let facts = claims[0].guarantee.facts();
    let mut text = format!("\n## {}\n\n", facts.heading);
    for figure in facts.figures {
        text += &format!("![Figure of the example {figure}](gallery/{figure}.svg)\n\n");
    }
    text += "| problem | method | measured | asserted | compared with | test |\n|---|---|--:|--:|---|---|\n";
    for Claim { problem, method, figure, bound, reference, test, .. } in claims {
        let cells = [problem, method, figure, bound, reference];
        text += &format!("| {} | `{test}` |\n", cells.map(|cell| escaped(cell)).join(" | "));
    }
    text
}

/// A cell of a table.
fn escaped(cell: &str) -> String {
    cell.replace('|', "\\|").replace('*', "\\*")
}

/// A sentence of the book, without its links and formulas' marks, as a cell of a table elsewhere.
fn quoted(sentence: &str) -> String {
    let mut text = String::new();
    let mut rest = sentence.trim_matches(['|', ' ']);
    // `[text](address)` is its text.
    while let Some((before, after)) = rest.split_once("](") {
        text += before;
        rest = after.split_once(')').map_or("", |(_, rest)| rest);
    }
    (text + rest)
        .replace(['[', ']'], "")
        .replace(" | ", ", ")
        .replace("\\\\", "\\")
        .replace('|', "\\|")
}

/// Every guarantee finds its sentences, and every sentence that names a test is held by a guarantee.
fn holds(sentences: &[String]) -> Result<(), VerificationError> {
    for guarantee in Guarantee::ALL {
        for part in guarantee.facts().sentences {
            if !sentences.iter().any(|sentence| page::plain(sentence).contains(&page::plain(part)))
            {
                return Err(VerificationError::NoSentence { guarantee, part });
            }
        }
    }
    let names_a_test = |s: &&String| s.contains("`tests/") && page::held(s).is_empty();
    let unheld = sentences.iter().find(names_a_test);
    unheld.map_or(Ok(()), |sentence| Err(VerificationError::Unheld(sentence.clone())))
}

/// Accepts `file::name` if it is a function of `tests/file.rs`.
fn has_test(test: &str, root: &Path) -> Result<(), VerificationError> {
    let (file, name) = test.split_once("::").unwrap_or((test, ""));
    let source = fs::read_to_string(root.join(format!("tests/{file}.rs"))).unwrap_or_default();
    if source.contains(&format!("fn {name}(")) {
        return Ok(());
    }
    let [test, file, name] = [test, file, name].map(str::to_owned);
    Err(VerificationError::NoTest { test, file, name })
}

const HEAD: &str = "# Verification\n\nEach line is a figure that a test has measured and the bound that it asserts. \
`just report` runs the tests and writes this page. No number in it is typed by hand. The name of a test is that of its file in \
`tests/` and of its function. A figure in brackets is a 95 % interval.\n";

const PROMISES: &str = "Which tables hold which sentence of [the page of guarantees](../book/src/guarantees.md), with the \
number of their lines. A sentence with a dash explains, or speaks of what another sentence promises. The report is not written if \
a sentence that names a test has a dash, if a table has no line, or if a line names a test that does not exist. Of the limits, \
the table has those that a test measures.\n\n\
| sentence | tables: lines |\n|---|---|\n";

#[cfg(test)]
mod tests {
    use super::*;

    fn root() -> &'static Path {
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
    }

    fn claim(guarantee: Guarantee, problem: &str) -> Claim {
        let test = "conservation::steps_far_too_large_keep_the_energy".into();
        let figure = "|x| = 1".into();
        Claim { figure, test, ..Claim::new(guarantee, problem, "so(3)*").against("a closed form") }
    }

    #[test]
    fn a_report_has_a_table_for_each_guarantee_in_their_order() {
        let sentences = vec!["| order | 2 |".into(), "It explains.".into()];
        let claims = vec![claim(Guarantee::Energy, "a"), claim(Guarantee::Order, "b")];
        let text = Verification { claims, sentences, promises: 2 }.report();
        let at = |part: &str| text.find(part).unwrap_or_else(|| panic!("{part} is not in {text}"));
        assert!(at("## Energy") < at("## Orders"));
        at("| order, 2 | [Orders are fitted](#orders-are-fitted): 1 |");
        at("| a | so(3)\\* | \\|x\\| = 1 |  | a closed form | `conservation::steps");
        at("| It explains. | – |");
    }

    #[test]
    fn a_claim_names_a_test_that_exists() {
        assert!(has_test(&claim(Guarantee::Energy, "a").test, root()).is_ok());
        for test in ["conservation::no_such_test", "nowhere::main", "main"] {
            let error = has_test(test, root()).expect_err("there is none");
            assert!(error.to_string().starts_with(&format!("`{test}` is no test")), "{error}");
        }
    }

    #[test]
    fn every_sentence_of_the_page_of_guarantees_that_names_a_test_has_a_table() {
        let page = fs::read_to_string(root().join("book/src/guarantees.md")).expect("the page");
        holds(&page::sentences(&page)).unwrap_or_else(|error| panic!("{error}"));
        let unheld = ["As `tests/nowhere.rs` says.".to_owned()];
        let all = Guarantee::ALL.into_iter().flat_map(|guarantee| guarantee.facts().sentences);
        let all: Vec<String> = all.map(|part| (*part).to_owned()).chain(unheld).collect();
        assert!(matches!(holds(&all), Err(VerificationError::Unheld(_))));
        assert!(matches!(holds(&all[1..3]), Err(VerificationError::NoSentence { .. })));
    }

    /// A file with claims is a target of a package that `just report` tests: it passes each one by its name.
    #[test]
    fn the_recipe_of_the_report_runs_every_file_with_claims() {
        let read = |path: &str| fs::read_to_string(root().join(path)).expect(path);
        let recipes = read("justfile");
        let recipe = recipes.split("\nreport:").nth(1).expect("a recipe `report`");
        let recipe = recipe.split("\n\n").next().expect("its lines");
        assert!(recipe.contains("grep -rl --include='*.rs' 'Claim::new' tests"), "{recipe}");
        let mut targets = String::new();
        for (package, manifest, path) in [
            ("metriplectic-tests", "tests/Cargo.toml", "path = \""),
            ("metriplectic-quick-tests", "tests/quick/Cargo.toml", "path = \"../"),
        ] {
            if recipe.contains(&format!("--package {package} ")) {
                targets += &read(manifest).replace(path, "target ");
            }
        }
        let (mut folders, mut files) = (vec![root().join("tests")], 0);
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).expect("a folder of tests") {
                let path = entry.expect("an entry").path();
                if path.is_dir() {
                    folders.push(path);
                } else if path.extension().is_some_and(|kind| kind == "rs")
                    && fs::read_to_string(&path).expect("a test").contains("Claim::new")
                {
                    let file = path.strip_prefix(root().join("tests")).expect("it is inside");
                    // A folder is one target, with its name.
                    let folder = file.parent().filter(|folder| folder.iter().count() > 0);
                    let file = folder.map_or(file.to_owned(), |folder| folder.join("main.rs"));
                    let target = format!("target {}\"", file.display());
                    assert!(targets.contains(&target), "no package of the recipe has {target}");
                    files += 1;
                }
            }
        }
        assert!(files > 15, "{files} files with claims");
    }

    /// The report of the repository is not older than the names of the tests.
    #[test]
    fn the_report_names_tests_that_exist() {
        let report = fs::read_to_string(root().join("docs/verification.md")).expect("the report");
        let mut lines = 0;
        for line in report.lines().filter(|line| line.starts_with("| ") && line.ends_with("` |")) {
            let test = line.rsplit('`').nth(1).expect("the last cell is a test");
            has_test(test, root()).unwrap_or_else(|error| panic!("{error}"));
            lines += 1;
        }
        assert!(lines > 100, "{lines} lines");
    }
}
