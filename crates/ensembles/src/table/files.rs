//! Files of tables: text, and arrays of `numpy`.

use std::io::{self, Write};
use std::path::Path;

use metriplectic_integrators::run::observables::{npy_header, quoted};

use super::Table;
use super::time::Series;
use crate::replaced::replaced;

impl Table {
    /// Writes comma-separated values (RFC 4180). A number read back is the number written, to the last bit; a cell
    /// that a row does not have is empty. `pandas.read_csv` and `polars.read_csv` read the file.
    ///
    /// The file is replaced as a whole, so one that exists is not lost where writing fails.
    ///
    /// # Errors
    ///
    /// The errors of writing.
    pub fn csv(&self, path: impl AsRef<Path>) -> io::Result<()> {
        replaced(path.as_ref(), |file| self.write_csv(file))
    }

    /// Writes the same text to anything that takes it.
    ///
    /// # Errors
    ///
    /// The errors of writing.
    pub fn write_csv(&self, mut to: impl Write) -> io::Result<()> {
        let names = self.names();
        let heads = names.iter().map(|name| if name == "failed" { "outcome" } else { name });
        let heads: Vec<String> = heads.map(quoted).collect();
        writeln!(to, "{},error", heads.join(","))?;
        for row in self.rows() {
            for name in &names {
                match (name.as_str(), row.get(name)) {
                    ("row", _) => write!(to, "{}", row.number())?,
                    ("failed", _) => write!(to, ",{}", row.outcome())?,
                    (_, Some(x)) => write!(to, ",{x:?}")?,
                    (_, None) => write!(to, ",")?,
                }
            }
            let message = row.error().map_or_else(String::new, |(_, message)| quoted(message));
            writeln!(to, ",{message}")?;
        }
        to.flush()
    }

    /// Writes an array of `numpy` with one named column for each number; NaN where a row does not have it.
    /// `numpy.load(path)["friction"]` is a column.
    ///
    /// # Errors
    ///
    /// The errors of writing.
    pub fn npy(&self, path: impl AsRef<Path>) -> io::Result<()> {
        let names = self.names();
        let rows = self.rows().map(|row| {
            let number = |name: &String| row.get(name).unwrap_or(f64::NAN);
            names.iter().map(number).collect::<Vec<_>>()
        });
        write_npy(path.as_ref(), &names, rows)
    }
}

impl Series {
    /// Writes comma-separated values, one time a line.
    ///
    /// # Errors
    ///
    /// The errors of writing.
    pub fn csv(&self, path: impl AsRef<Path>) -> io::Result<()> {
        replaced(path.as_ref(), |file| {
            let names: Vec<String> = self.names().iter().map(|name| quoted(name)).collect();
            writeln!(file, "{}", names.join(","))?;
            for row in self.rows() {
                let numbers: Vec<String> = row.iter().map(|x| format!("{x:?}")).collect();
                writeln!(file, "{}", numbers.join(","))?;
            }
            Ok(())
        })
    }

    /// Writes an array of `numpy` with the named columns.
    ///
    /// # Errors
    ///
    /// The errors of writing.
    pub fn npy(&self, path: impl AsRef<Path>) -> io::Result<()> {
        write_npy(path.as_ref(), self.names(), self.rows().iter().cloned())
    }
}

fn write_npy(
    path: &Path,
    names: &[String],
    rows: impl ExactSizeIterator<Item = Vec<f64>>,
) -> io::Result<()> {
    replaced(path, |file| {
        file.write_all(&npy_header(names.iter().map(String::as_str), rows.len()))?;
        rows.flatten().try_for_each(|x| file.write_all(&x.to_le_bytes()))
    })
}
