//! Observables in time, over all rows.

use super::Table;
use crate::entry::Done;
use crate::error::TableError;
use crate::estimate::Estimate;

/// Numbers in time: named columns, of which the first is the time `t`.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    names: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Series {
    /// The names of the columns.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The numbers at each time, in the order of the names.
    #[must_use]
    pub fn rows(&self) -> &[Vec<f64>] {
        &self.rows
    }

    /// A column over time, for a line of a figure.
    #[must_use]
    pub fn line(&self, name: &str) -> Option<Vec<(f64, f64)>> {
        let column = self.names.iter().position(|other| other == name)?;
        Some(self.rows.iter().map(|row| (row[0], row[column])).collect())
    }
}

impl Table {
    /// The quantiles of what was observed, at each time over all rows that are done: the columns `t`, `q0.05`, ….
    ///
    /// A quantile lies between two of the sorted numbers, linearly in `p (n − 1)` (Hyndman, Fan 1996, type 7, the
    /// default of `numpy`). It is NaN where a number is.
    ///
    /// # Errors
    ///
    /// [`TableError`] if the name was not observed in time, or rows have states at different times.
    pub fn quantiles(
        &self,
        name: &str,
        probabilities: impl IntoIterator<Item = f64>,
    ) -> Result<Series, TableError> {
        let probabilities: Vec<f64> = probabilities.into_iter().collect();
        if let Some(&probability) = probabilities.iter().find(|p| !(0.0..=1.0).contains(*p)) {
            return Err(TableError::Probability { probability });
        }
        let names = probabilities.iter().map(|p| format!("q{p:?}")).collect();
        self.over_rows(name, names, |values| {
            values.sort_by(f64::total_cmp);
            probabilities.iter().map(|&p| quantile(values, p)).collect()
        })
    }

    /// The mean of what was observed, at each time over all rows that are done, with its standard error `s/√n`: the
    /// columns `t`, `mean` and `standard_error`. The error is NaN for a single row.
    ///
    /// # Errors
    ///
    /// The errors of [`quantiles`](Self::quantiles).
    pub fn mean(&self, name: &str) -> Result<Series, TableError> {
        let names = ["mean", "standard_error"].map(str::to_owned).to_vec();
        self.over_rows(name, names, |values| {
            let Estimate { mean, standard_error, .. } = Estimate::of(values.iter().copied());
            vec![mean, standard_error]
        })
    }

    /// Numbers of the values of all rows at each time.
    fn over_rows(
        &self,
        name: &str,
        mut names: Vec<String>,
        numbers: impl Fn(&mut [f64]) -> Vec<f64>,
    ) -> Result<Series, TableError> {
        let column = self.header.observables.iter().position(|other| other == name);
        let Some(column) = column else {
            self.known(name)?;
            return Err(TableError::NotInTime { name: name.to_owned() });
        };
        let mut done = self.entries.iter().filter_map(|e| e.done().map(|done| (e.number, done)));
        let Some((first, like)) = done.next() else { return Err(TableError::NoRows) };
        let same = |other: &Done| {
            other.times.len() == like.times.len()
                && other.times.iter().zip(&like.times).all(|(a, b)| a.to_bits() == b.to_bits())
        };
        if let Some((second, _)) = done.find(|(_, other)| !same(other)) {
            return Err(TableError::Times { first, second });
        }
        let n = like.times.len();
        let mut values = Vec::new();
        let rows = like.times.iter().enumerate().map(|(k, t)| {
            let done = self.entries.iter().filter_map(|entry| entry.done());
            values.clear();
            values.extend(done.map(|done| done.series[column * n + k]));
            std::iter::once(*t).chain(numbers(&mut values)).collect()
        });
        let rows = rows.collect();
        names.insert(0, "t".to_owned());
        Ok(Series { names, rows })
    }
}

/// The quantile of sorted numbers.
fn quantile(sorted: &[f64], p: f64) -> f64 {
    if sorted.iter().any(|x| x.is_nan()) {
        return f64::NAN;
    }
    let place = p * (sorted.len() - 1) as f64;
    let below = place.floor();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 ≤ place < n")]
    let k = below as usize;
    let next = sorted[(k + 1).min(sorted.len() - 1)];
    let rest = place - below;
    if rest == 0.0 { sorted[k] } else { (1.0 - rest) * sorted[k] + rest * next }
}
