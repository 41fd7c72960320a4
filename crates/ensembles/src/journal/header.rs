//! The first line of a journal.

use std::fmt::Write as _;
use std::path::Path;

use super::line::{escaped, unescaped};
use crate::error::JournalError;
use crate::fingerprint::of_line;

/// The beginning of a journal; the number is that of the format.
const FORMAT: &str = "metriplectic-journal 2";

/// The plan of a journal, and the names of its columns.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Header {
    pub(crate) version: String,
    /// The hash of the plan.
    pub(crate) plan: u64,
    pub(crate) rows: usize,
    pub(crate) name: String,
    /// The plan in a line for people.
    pub(crate) about: String,
    pub(crate) parameters: Vec<String>,
    pub(crate) measures: Vec<String>,
    pub(crate) observables: Vec<String>,
}

impl Header {
    /// The line, with its end.
    pub(crate) fn line(&self) -> String {
        let names = |list: &[String]| list.iter().map(|n| escaped(n)).collect::<Vec<_>>().join(",");
        let mut line = format!(
            "{FORMAT} version={} plan={:016x} rows={} name={} about={} parameters={} measures={} observables={}",
            escaped(&self.version),
            self.plan,
            self.rows,
            escaped(&self.name),
            escaped(&self.about),
            names(&self.parameters),
            names(&self.measures),
            names(&self.observables),
        );
        let sum = of_line(line.as_bytes());
        // Writing to a string does not fail.
        let _ = writeln!(line, " #{sum:016x}");
        line
    }

    pub(crate) fn parse(line: &[u8], path: &Path) -> Result<Self, JournalError> {
        let none = || JournalError::NotAJournal { path: path.to_owned() };
        let text = std::str::from_utf8(line).map_err(|_| none())?;
        let text = text.strip_suffix('\n').ok_or_else(none)?;
        let format = text.split(' ').take(2).collect::<Vec<_>>().join(" ");
        if format.starts_with("metriplectic-journal ") && format != FORMAT {
            let (found, expected) = (format, FORMAT.to_owned());
            return Err(JournalError::AnotherVersion { path: path.to_owned(), found, expected });
        }
        let (body, sum) = text.rsplit_once(" #").ok_or_else(none)?;
        if u64::from_str_radix(sum, 16) != Ok(of_line(body.as_bytes())) || format != FORMAT {
            return Err(none());
        }
        let field = |name: &str| {
            let word = body.split(' ').find_map(|word| word.strip_prefix(name)?.strip_prefix('='));
            word.ok_or_else(none)
        };
        let names = |name: &str| {
            let list = field(name)?;
            Ok(list.split(',').filter(|n| !n.is_empty()).map(unescaped).collect())
        };
        Ok(Self {
            version: unescaped(field("version")?),
            plan: u64::from_str_radix(field("plan")?, 16).map_err(|_| none())?,
            rows: field("rows")?.parse().map_err(|_| none())?,
            name: unescaped(field("name")?),
            about: unescaped(field("about")?),
            parameters: names("parameters")?,
            measures: names("measures")?,
            observables: names("observables")?,
        })
    }

    /// Accepts a journal of the same plan.
    pub(crate) fn check(&self, expected: &Self, path: &Path) -> Result<(), JournalError> {
        let shown = |header: &Self| {
            let columns = [&header.measures, &header.observables].map(|names| names.join(", "));
            format!("{} [{}; {}] (plan {:016x})", header.about, columns[0], columns[1], header.plan)
        };
        if self.plan != expected.plan || self.name != expected.name {
            let (found, expected) = (shown(self), shown(expected));
            return Err(JournalError::AnotherSweep { path: path.to_owned(), found, expected });
        }
        if self.version != expected.version {
            let (found, expected) = (self.version.clone(), expected.version.clone());
            return Err(JournalError::AnotherVersion { path: path.to_owned(), found, expected });
        }
        // Samples may have been added to a plan since.
        let (rows, about) = (expected.rows, expected.about.clone());
        if (Self { rows, about, ..self.clone() }) != *expected {
            return Err(JournalError::NotAJournal { path: path.to_owned() });
        }
        Ok(())
    }
}
