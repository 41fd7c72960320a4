//! The numbers that somebody has chosen: each names a test that fails when it is moved by a factor of four, or is listed here.
//!
//! A number whose factor of four no test notices is either without effect on what is promised, as a number that saves work,
//! or not tested enough. The list may become shorter.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Lengths of arrays, layouts and formats, where there is nothing to choose: file and name.
const LAYOUT: &[(&str, &str)] = &[
    ("collocation.rs", "SPLITS"),
    ("collocation/tableau.rs", "POINTS"),
    ("collocation/tableau.rs", "STAGES"),
    ("collocation/timed.rs", "MOST"),
    ("explicit/step.rs", "COUNT"),
    ("explicit/tableau.rs", "STAGES"),
    ("midpoint/predictor.rs", "DIFFERENCES"),
    ("noise/equations.rs", "NO_CLOCK"),
    ("noise/levy.rs", "DEPTH"),
    ("noise/numbers.rs", "UNIT"),
    ("noise/sampler.rs", "MOST"),
    ("numbers/referred_rise.rs", "VECTORS"),
    ("open/vector.rs", "ALL"),
    ("open/vector.rs", "BESIDE"),
    ("round_off/bound.rs", "NO_DIGITS"),
    ("run/checkpoint.rs", "VERSION"),
    ("run/event.rs", "PIECE"),
    ("run/looks.rs", "WINDOW"),
    ("run/observables.rs", "BUFFER"),
    ("run/record.rs", "ROOM"),
    ("step/memory.rs", "LISTS"),
    ("step/memory.rs", "NUMBERS"),
    ("system/recheck.rs", "NO_CLOCK"),
    ("tangent/duals.rs", "ENERGY"),
    ("tangent/duals.rs", "ENTROPY"),
    ("tangent/pieces.rs", "DIGITS"),
];

/// The numbers that can be moved by a factor of four with no failing test: file and name.
const UNNOTICED: &[(&str, &str)] = &[
    ("collocation/full.rs", "DIFFERENCE"),
    ("collocation/heat.rs", "HALVINGS"),
    ("collocation/heat.rs", "JUMP"),
    ("collocation/linear.rs", "HALF_OF_THE_DIGITS"),
    ("collocation/linear.rs", "PASSES"),
    ("collocation/parts.rs", "TRIALS"),
    ("collocation/solve.rs", "HALF"),
    ("collocation/solve.rs", "KNOWN"),
    ("collocation/solve.rs", "STALL"),
    ("collocation/solve.rs", "STALLED_LAW"),
    ("collocation/solve.rs", "SURE"),
    ("collocation/solve.rs", "UNKNOWN"),
    ("explicit/creep.rs", "PATIENCE"),
    ("explicit/step.rs", "MANY_FALLS"),
    ("implicit/collocation/linear.rs", "STEPS"),
    ("newton.rs", "NEAR"),
    ("noise/moves.rs", "LEAST"),
    ("noise/sampler.rs", "WAY"),
    ("open/balance.rs", "LAST_DIGITS"),
    ("open/flow.rs", "AHEAD"),
    ("open/flow.rs", "LITTLE"),
    ("open/surrounded.rs", "LITTLE"),
    ("open/verify.rs", "AGREEING"),
    ("open/verify.rs", "CLEAR"),
    ("run/advance.rs", "TRIES"),
    ("run/controller.rs", "APART"),
    ("run/controller.rs", "FROM_REST"),
    ("run/controller.rs", "INSTANT"),
    ("run/course.rs", "NOT_CONSERVED"),
    ("run/event.rs", "SAME_TIME"),
    ("run/event.rs", "UNEVEN"),
    ("run/event.rs", "WIDTH"),
    ("run/least_sizes.rs", "AHEAD"),
    ("run/least_sizes.rs", "LOOKS"),
    ("run/least_sizes.rs", "ROWS"),
    ("run/recheck.rs", "CREEPS"),
    ("step/initial_scales.rs", "AHEAD"),
    ("system/reach.rs", "LATE"),
    ("system/reach.rs", "NOISE"),
    ("system/reach.rs", "STEEPEST"),
    ("tangent.rs", "CORRECTIONS"),
    ("tangent/adjoint.rs", "WITHIN"),
    ("tangent/beside.rs", "BENT"),
    ("tangent/beside.rs", "INSTANT"),
    ("tangent/beside.rs", "RATIO"),
    ("tangent/beside.rs", "TRIES"),
    ("tangent/beside.rs", "WEAK"),
    ("tangent/beside.rs", "WIDE"),
    ("tangent/landing.rs", "SMALL"),
];

/// The words before the name of a test.
const NOTICED: &str = "A factor of four fails `";

/// A constant of the crate.
struct Constant {
    file: String,
    name: String,
    /// Its docstring.
    text: String,
}

#[test]
fn each_number_names_the_test_that_holds_it() {
    let place = Path::new(env!("CARGO_MANIFEST_DIR"));
    let constants = constants(&place.join("src"));
    assert!(constants.len() > 100, "{} constants", constants.len());
    let listed = |list: &[(&str, &str)], constant: &Constant| {
        list.contains(&(constant.file.as_str(), constant.name.as_str()))
    };
    for constant in &constants {
        let Constant { file, name, text } = constant;
        let lists = [listed(LAYOUT, constant), listed(UNNOTICED, constant)];
        let Some((_, rest)) = text.split_once(NOTICED) else {
            assert!(lists[0] || lists[1], "{file}: {name} names no test ({NOTICED}tests/..`)");
            continue;
        };
        assert!(!lists[0] && !lists[1], "{file}: {name} names a test, and is listed");
        let (path, test) = rest.split('`').next().and_then(|path| path.rsplit_once("::")).unwrap();
        let place =
            if path.starts_with("tests/") { place.join("../..") } else { place.join("src") };
        let text = fs::read_to_string(place.join(path)).unwrap_or_default();
        assert!(text.contains(&format!("fn {test}(")), "{file}: {name}: no test {test} in {path}");
    }
    for (file, name) in LAYOUT.iter().chain(UNNOTICED) {
        let exists = constants.iter().any(|c| c.file == *file && c.name == *name);
        assert!(exists, "{file}: there is no constant {name}");
    }
    let noticed = constants.len() - LAYOUT.len() - UNNOTICED.len();
    println!("{} numbers: {noticed} with a test, {} without", constants.len(), UNNOTICED.len());
}

/// The constants of the source files, without their tests.
fn constants(source: &Path) -> Vec<Constant> {
    let kinds = ["f64", "usize", "u32", "u64", "[f64;"];
    let mut found = Vec::new();
    for path in files(source) {
        let file =
            path.strip_prefix(source).expect("below it").to_string_lossy().replace('\\', "/");
        let text = fs::read_to_string(&path).expect("a source file");
        let text = text.split("#[cfg(test)]\nmod tests {").next().expect("its first part");
        let mut docs = String::new();
        for line in text.lines().map(str::trim_start) {
            let line_of_docs = line.strip_prefix("///");
            let words = line.split("const ").nth(1).and_then(|rest| rest.split_once(": "));
            if let Some(words) = line_of_docs {
                docs.push_str(words);
                docs.push('\n');
                continue;
            }
            let is_constant = ["const ", "pub const ", "pub(crate) const ", "pub(super) const "]
                .iter()
                .any(|start| line.starts_with(start));
            if let (true, Some((name, rest))) = (is_constant, words)
                && name.chars().all(|c| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_')
                && kinds.iter().any(|kind| rest.starts_with(kind))
                && rest.contains('=')
            {
                let (name, text) = (name.to_owned(), std::mem::take(&mut docs));
                found.push(Constant { file: file.clone(), name, text });
            }
            docs.clear();
        }
    }
    let places: BTreeSet<_> = found.iter().map(|c| (&c.file, &c.name)).collect();
    assert_eq!(places.len(), found.len(), "two constants of one name in a file");
    found
}

/// The source files below a folder, without files of tests.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            found.extend(files(&path));
        } else if path.extension().is_some_and(|end| end == "rs") && !path.ends_with("tests.rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}
