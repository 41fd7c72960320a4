//! A package with a program for each cell, and what the compiler says of it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

use serde_json::Value;

/// The folder of the library.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// The answer of the compiler to a program.
#[derive(Clone, Debug, Default)]
pub(crate) struct Said {
    /// Whether it has checked the program and found nothing.
    pub(crate) compiles: bool,
    /// The codes of the errors.
    pub(crate) codes: BTreeSet<String>,
    /// The errors as a user sees them.
    pub(crate) text: String,
}

/// A folder of its own in the target directory: another process may hold the lock of that one.
const FOLDER: &str = concat!(env!("CARGO_TARGET_TMPDIR"), "/matrix");

/// Writes a file where its text is another one, so that what is compiled already stays.
fn write(path: &Path, text: &str) {
    if fs::read_to_string(path).ok().as_deref() != Some(text) {
        fs::write(path, text).expect("the file is written");
    }
}

/// Writes the package: each program is a binary of its name.
fn package(programs: &BTreeMap<String, String>) -> PathBuf {
    let package = Path::new(FOLDER).join("package");
    let bins = package.join("src").join("bin");
    fs::create_dir_all(&bins).expect("the folder is made");
    for entry in fs::read_dir(&bins).expect("the folder is read") {
        let path = entry.expect("a file").path();
        let is_kept = |name: &std::ffi::OsStr| programs.contains_key(&*name.to_string_lossy());
        if !path.file_stem().is_some_and(is_kept) {
            fs::remove_file(path).expect("the file of another version is removed");
        }
    }
    for (name, program) in programs {
        write(&bins.join(format!("{name}.rs")), program);
    }
    let root = fs::canonicalize(ROOT).expect("the library is there");
    // `{:?}` is a string of TOML as well.
    let manifest = format!(
        "[package]
name = \"matrix\"
version = \"0.0.0\"
edition = \"2024\"
publish = false

[dependencies.metriplectic]
path = {root:?}
default-features = false
features = [\"ensembles\", \"fitting\"]

[profile.dev]
debug = false
incremental = false

[workspace]
"
    );
    write(&package.join("Cargo.toml"), &manifest);
    // The versions are those of the library, so that nothing is fetched. Cargo leaves out what this package does not need.
    let versions = fs::read_to_string(root.join("Cargo.lock")).expect("the versions are read");
    fs::write(package.join("Cargo.lock"), versions).expect("the versions are written");
    package
}

/// Asks the compiler about each program, by its name.
///
/// # Panics
///
/// If Cargo ends before it has come to the programs.
pub(crate) fn said(programs: &BTreeMap<String, String>) -> BTreeMap<String, Said> {
    let package = package(programs);
    let run = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .args(["check", "--bins", "--keep-going", "--offline", "--message-format=json"])
        .current_dir(package)
        .env("CARGO_TARGET_DIR", Path::new(FOLDER).join("target"))
        .env("CARGO_TERM_COLOR", "never")
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .env_remove("CARGO_BUILD_RUSTFLAGS")
        .output()
        .expect("cargo starts");
    let mut said: BTreeMap<String, Said> = BTreeMap::new();
    for line in String::from_utf8_lossy(&run.stdout).lines() {
        let Ok(message) = serde_json::from_str::<Value>(line) else { continue };
        let is_program = message["target"]["kind"].as_array().is_some_and(|k| k[0] == "bin");
        let Some(name) = message["target"]["name"].as_str().filter(|_| is_program) else {
            continue;
        };
        if message["reason"] == "compiler-artifact" {
            said.entry(name.to_owned()).or_default().compiles = true;
        } else if message["message"]["level"] == "error" {
            let entry = said.entry(name.to_owned()).or_default();
            let text = message["message"]["rendered"].as_str();
            entry.text.push_str(text.unwrap_or_default());
            let code = message["message"]["code"]["code"].as_str();
            entry.codes.extend(code.map(str::to_owned));
        }
    }
    let missing = programs.keys().filter(|name| !said.contains_key(*name)).count();
    assert_eq!(
        missing,
        0,
        "cargo has not come to {missing} programs:\n{}",
        String::from_utf8_lossy(&run.stderr)
    );
    said
}
