//! The text of a table for a reader.

use std::collections::BTreeMap;
use std::fmt;

use super::{Table, TableRow};
use crate::listed::listed;

/// The summary in a few lines: how many rows are done, what failed, and the worst figures.
impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (rows, planned) = (self.len(), self.planned());
        write!(f, "{}: {rows}", self.name())?;
        if rows < planned {
            write!(f, " of {planned}")?;
        }
        write!(f, " rows, {} failed", self.failed())?;
        let mut kinds: BTreeMap<&str, usize> = BTreeMap::new();
        for (kind, _) in self.rows().filter_map(|row| row.error()) {
            *kinds.entry(kind).or_default() += 1;
        }
        if !kinds.is_empty() {
            let kinds: Vec<_> = kinds.iter().map(|(kind, n)| format!("{kind}: {n}")).collect();
            write!(f, " ({})", kinds.join(", "))?;
        }
        let first = self.rows().find_map(|row| Some((row.number(), row.error()?.1.to_owned())));
        if let Some((row, sentence)) = first {
            write!(f, "\nrow {row}: {sentence}")?;
        }
        let passed = self.passed_over();
        if !passed.is_empty() {
            let (n, rows) = (passed.len(), listed(&passed));
            write!(f, "\npassed over: {n} rows, which ran when a process ended: {rows}")?;
        }
        let worst = |column: &str| {
            let numbers = self.rows().filter_map(|row| Some((row.number(), row.get(column)?)));
            numbers.filter(|(_, x)| !x.is_nan()).max_by(|a, b| a.1.total_cmp(&b.1))
        };
        if let Some((row, error)) = worst("run.energy_error") {
            write!(f, "\nfirst law:   |H − H₀| ≤ {error:.1e} of the terms of H (row {row})")?;
        }
        self.flagged(f, "run.kept", 0.0, "a law is broken in")?;
        self.flagged(f, "run.stiff", 1.0, "friction is not damped in")?;
        self.flagged(f, "run.resolved", 0.0, "the motion is not resolved in")?;
        let missing = self.missing();
        if rows > 1 && !missing.is_empty() {
            write!(f, "\nmissing:     {} rows: {}", missing.len(), listed(&missing))?;
        }
        Ok(())
    }
}

impl Table {
    /// Lists the rows that have this value in a column of flags.
    fn flagged(
        &self,
        f: &mut fmt::Formatter<'_>,
        column: &str,
        value: f64,
        says: &str,
    ) -> fmt::Result {
        let has =
            |row: &TableRow<'_>| row.get(column).is_some_and(|x| x.to_bits() == value.to_bits());
        let rows: Vec<usize> = self.rows().filter(has).map(|row| row.number()).collect();
        if rows.is_empty() {
            return Ok(());
        }
        write!(f, "\n{says} {} rows: {}", rows.len(), listed(&rows))
    }
}

impl<'a> TableRow<'a> {
    /// How the run ended, `span`, `rest`, `event` or `stopped`, or the kind of the error.
    #[must_use]
    pub fn outcome(&self) -> &'a str {
        match (self.entry.done(), self.entry.error()) {
            (Some(done), _) => done.ending,
            (_, Some((kind, _))) => kind,
            _ => "",
        }
    }
}
