//! The output of an example: its files, and text for a reader or JSON for a program.

use std::{error::Error, path::PathBuf};

use metriplectic_integrators::Certificate;
use metriplectic_manifolds::Manifold;
use serde_json::{Map, Value};

use crate::{Gallery, LogLog, Panels, Record, print, write_csv};

/// The report of an example, written by [`Report::print`]: one JSON object, or text. Its files are those of
/// the [`Gallery`], named after the program. What fails on the way is the error of [`Report::print`].
#[derive(Debug)]
#[must_use = "a report is written by `print`"]
pub struct Report {
    json: bool,
    gallery: Result<Gallery, Box<dyn Error>>,
    fields: Map<String, Value>,
    text: Vec<String>,
}

impl Report {
    pub(crate) fn new(json: bool, folder: Option<PathBuf>) -> Self {
        let gallery = folder.map_or_else(Gallery::open, Gallery::within).map_err(Box::from);
        Self { json, gallery, fields: Map::new(), text: Vec::new() }
    }

    /// The fields of the certificate, `max_relative_energy_error`, and `final_state` with the entries of
    /// the last point.
    pub(crate) fn run<M: Manifold>(self, run: &Record<M>) -> Self {
        let end = run.last();
        self.certified(&run.certificate, end.time, M::entries(&end.point))
    }

    /// A report of a run of any flow, with these entries of its last state.
    pub(crate) fn certified(self, certificate: &Certificate, time: f64, entries: Vec<f64>) -> Self {
        let shown: Vec<String> = entries.iter().map(|x| readable(*x)).collect();
        let mut report = self.text(certificate);
        match serde_json::to_value(certificate) {
            Ok(Value::Object(fields)) => report.fields.extend(fields),
            Ok(_) => {}
            Err(error) => report.gallery = Err(error.into()),
        }
        let error = certificate.max_relative_energy_error();
        report.fields.insert("max_relative_energy_error".into(), error.into());
        report.fields.insert("final_state".into(), entries.into());
        report.line("end", format!("t = {}: ({})", readable(time), shown.join(", ")))
    }

    /// Adds a value to the JSON object, and a line with its name to the text.
    pub fn with(mut self, key: &str, value: impl Into<Value>) -> Self {
        let value = value.into();
        let shown = shown(&value);
        self.fields.insert(key.to_owned(), value);
        self.line(&key.replace('_', " "), shown)
    }

    /// Adds the certificate of another run.
    pub fn certificate(mut self, key: &str, certificate: &Certificate) -> Self {
        match serde_json::to_value(certificate) {
            Ok(value) => _ = self.fields.insert(key.to_owned(), value),
            Err(error) => self.gallery = Err(error.into()),
        }
        self.text(format_args!("\n{}\n{certificate}", key.replace('_', " ")))
    }

    /// Adds lines to the text alone.
    pub fn text(mut self, lines: impl std::fmt::Display) -> Self {
        self.text.push(lines.to_string());
        self
    }

    /// Writes numbers to a CSV file.
    pub fn table<const N: usize>(
        self,
        names: [&str; N],
        rows: impl IntoIterator<Item = [f64; N]>,
    ) -> Self {
        self.file("csv", |path| Ok(write_csv(path, names, rows)?))
    }

    /// Draws the figure.
    pub fn figure(self, figure: Panels) -> Self {
        self.file("svg", |path| Ok(figure.save(path)?))
    }

    /// Draws a figure of errors over step sizes, with this added to its name.
    pub fn log_log(self, suffix: &str, figure: &LogLog) -> Self {
        self.file(&format!("{suffix}.svg"), |path| Ok(figure.save(path)?))
    }

    fn file(
        mut self,
        ending: &str,
        write: impl FnOnce(&PathBuf) -> Result<(), Box<dyn Error>>,
    ) -> Self {
        let Ok(gallery) = &self.gallery else { return self };
        let dot = if ending.contains('.') { "" } else { "." };
        let path = gallery.path(format!("{}{dot}{ending}", crate::example::name()));
        match write(&path) {
            Ok(()) if ending == "csv" => self.line("data", path.display()),
            Ok(()) => self.line("figure", path.display()),
            Err(error) => {
                self.gallery = Err(error);
                self
            }
        }
    }

    fn line(self, name: &str, value: impl std::fmt::Display) -> Self {
        self.text(format_args!("{:<12} {value}", format!("{name}:")))
    }

    /// Prints it to standard output.
    ///
    /// # Errors
    ///
    /// The first failure: a file that cannot be written, a figure that cannot be drawn, or standard output.
    pub fn print(self) -> Result<(), Box<dyn Error>> {
        let fields = Value::Object(self.fields.clone());
        self.print_as(&fields)
    }

    /// Prints another JSON value than an object, or the text.
    ///
    /// # Errors
    ///
    /// The errors of [`Report::print`].
    pub fn print_as(self, json: &Value) -> Result<(), Box<dyn Error>> {
        self.gallery?;
        Ok(if self.json { print(json) } else { print(self.text.join("\n")) }?)
    }
}

/// A value as text: numbers with seven digits.
fn shown(value: &Value) -> String {
    match value {
        Value::Number(number) if number.is_f64() => {
            number.as_f64().map_or_else(String::new, readable)
        }
        Value::Array(values) => values.iter().map(shown).collect::<Vec<_>>().join(", "),
        Value::String(text) => text.clone(),
        _ => value.to_string(),
    }
}

/// A number with some digits: `0.142880`, `1.2e-15`.
fn readable(x: f64) -> String {
    let ordinary = x.abs() < 1e6 && (x.abs() >= 1e-3 || x.abs() < f64::MIN_POSITIVE);
    if ordinary { format!("{x:.6}") } else { format!("{x:.5e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_short() {
        let value = serde_json::json!([0.1, 1e-15, 3, true, -1234.5]);
        assert_eq!(shown(&value), "0.100000, 1.00000e-15, 3, true, -1234.500000");
    }

    #[test]
    fn a_report_that_could_not_write_is_an_error() {
        let folder =
            std::env::temp_dir().join(format!("metriplectic-report-{}", std::process::id()));
        let report = || Report::new(false, Some(folder.clone()));
        assert!(report().with("answer", 42).figure(Panels::new("nothing")).print().is_err());
        assert!(report().table(["t"], [[0.0]]).with("answer", 42).gallery.is_ok());
        let files = std::fs::read_dir(&folder).unwrap();
        assert_eq!(files.count(), 1);
        std::fs::remove_dir_all(folder).unwrap();
    }
}
