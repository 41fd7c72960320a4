//! Writes the report of verification from the records of a folder: `report FOLDER ROOT`, `ROOT` the workspace.

use std::{env, error::Error, fs, path::Path};

use metriplectic_studies::claim::Verification;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [folder, root] = &arguments[..] else { return Err("usage: report FOLDER ROOT".into()) };
    let root = Path::new(root);
    let report = Verification::of(Path::new(folder), root)?.report();
    fs::write(root.join("docs/verification.md"), report)?;
    Ok(())
}
