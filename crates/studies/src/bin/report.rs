//! Writes the report of verification from the records of a folder: `report FOLDER FILE`.

use std::{env, error::Error, fs, path::Path};

use metriplectic_studies::claim::report;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [folder, file] = &arguments[..] else { return Err("usage: report FOLDER FILE".into()) };
    fs::write(file, report(Path::new(folder))?)?;
    Ok(())
}
