//! The columns of a table by their names.

use super::Table;
use crate::error::TableError;
use crate::estimate::Estimate;
use crate::figures::FIGURES;

impl Table {
    /// The names of all columns of numbers, in their order.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        let header = &self.header;
        let longest = self.rows().map(|row| row.end().len()).max().unwrap_or(0);
        let end = (0..longest).map(|k| format!("end.{k}"));
        let mut names = vec!["row".to_owned()];
        names.extend_from_slice(&header.parameters);
        names.push("failed".to_owned());
        names.extend(FIGURES.map(str::to_owned));
        names.extend(end);
        names.extend(header.measures.iter().chain(&header.observables).cloned());
        names
    }

    /// The numbers of a column, in the order of the rows; NaN where a row does not have it.
    ///
    /// # Errors
    ///
    /// [`TableError::NoColumn`].
    pub fn column(&self, name: &str) -> Result<Vec<f64>, TableError> {
        self.known(name)?;
        Ok(self.rows().map(|row| row.get(name).unwrap_or(f64::NAN)).collect())
    }

    /// Estimates the mean of a column over all rows that are done, with its standard error.
    ///
    /// # Errors
    ///
    /// [`TableError::NoColumn`]; [`TableError::NoRows`] if no row is done.
    pub fn estimate(&self, name: &str) -> Result<Estimate, TableError> {
        self.known(name)?;
        let done = self.rows().filter(|row| row.entry.done().is_some());
        let estimate = Estimate::of(done.map(|row| row.get(name).unwrap_or(f64::NAN)));
        if estimate.count == 0 { Err(TableError::NoRows) } else { Ok(estimate) }
    }

    pub(super) fn known(&self, name: &str) -> Result<(), TableError> {
        let known = self.names();
        if known.iter().any(|other| other == name) {
            Ok(())
        } else {
            Err(TableError::NoColumn { name: name.to_owned(), known })
        }
    }
}
