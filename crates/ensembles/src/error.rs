//! Errors of a sweep. A row that fails is no error here: it is a row.

use std::io;
use std::path::PathBuf;

use crate::listed::listed;

/// A plan of rows that makes no sense.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// The name is empty.
    #[error("the sweep has no name; its name identifies its journals")]
    NoName,
    /// A factor of the plan has no values.
    #[error("`{column}` has no values, so the sweep has no rows")]
    Empty {
        /// The name of the column.
        column: String,
    },
    /// Two columns have one name.
    #[error(
        "two columns of the table have the name {name:?}; the columns of the library are listed at `Table`"
    )]
    SameName {
        /// The name.
        name: String,
    },
    /// The product of the factors is too large.
    #[error("the sweep has more rows than can be numbered")]
    TooManyRows,
    /// Samples are added to a Latin hypercube.
    #[error(
        "samples of a Latin hypercube cannot be added: its strata depend on their number; begin another sweep, or use `samples`"
    )]
    MoreOfAHypercube,
    /// The bounds of a range are not finite and in order.
    #[error("`{column}` ranges from {start} to {end}; give finite bounds, the lower one first")]
    Range {
        /// The name of the column.
        column: String,
        /// The lower bound.
        start: f64,
        /// The upper bound.
        end: f64,
    },
    /// A row that is not in the plan.
    #[error("row {row} is not in the sweep, whose rows are 0 to {}", rows - 1)]
    NoSuchRow {
        /// The row asked for.
        row: usize,
        /// The number of rows.
        rows: usize,
    },
    /// A file of rows that cannot be read.
    #[error("cannot read the rows of {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// A cell of a file of rows that is not a number, or a line with too few or too many of them.
    #[error("line {line} of {}: {problem}", path.display())]
    Cell {
        /// The file.
        path: PathBuf,
        /// The line, counted from 1.
        line: usize,
        /// The fault.
        problem: String,
    },
}

metriplectic_equations::debug_is_the_sentence!(PlanError);

/// A journal that cannot be read or written.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum JournalError {
    /// The file cannot be opened, read or written.
    #[error("the journal {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// The path is a folder or a device.
    #[error("the journal {} is no regular file", path.display())]
    NotAFile {
        /// The path.
        path: PathBuf,
    },
    /// The file does not begin as a journal does. It is left as it is.
    #[error("{} is no journal of a sweep, or its first line was changed; it is left as it is", path.display())]
    NotAJournal {
        /// The file.
        path: PathBuf,
    },
    /// Another process writes to the journal.
    #[error("another process writes to the journal {}; give each process a shard of its own", path.display())]
    InUse {
        /// The file.
        path: PathBuf,
    },
    /// The journal has the format of another version.
    #[error(
        "the journal {} was written by version {found}, and this is version {expected}: rows of two versions \
         may differ in their last digits, so finish the sweep with the version that began it",
        path.display()
    )]
    AnotherVersion {
        /// The file.
        path: PathBuf,
        /// The version and format that wrote it.
        found: String,
        /// The version and format of this program.
        expected: String,
    },
    /// The journal belongs to another plan. Rows of two plans are never mixed.
    #[error(
        "the journal {} belongs to another sweep:\n  found    {found}\n  expected {expected}\nmove it away, or give \
         the sweep another name and journal",
        path.display()
    )]
    AnotherSweep {
        /// The file.
        path: PathBuf,
        /// The plan that it was written for.
        found: String,
        /// The plan of this sweep.
        expected: String,
    },
    /// Two journals hold different numbers for one row.
    #[error(
        "row {row} has other numbers in {} than in {}: the two machines do not compute the same bits, or the model \
         was changed between them",
        first.display(), second.display()
    )]
    Contradiction {
        /// The row.
        row: usize,
        /// One of the files.
        first: PathBuf,
        /// The other file.
        second: PathBuf,
    },
    /// A checkpoint of a [long row](crate::Row::run_long) beside the journal belongs to another plan, or was changed. No row is
    /// run, and the checkpoint is left as it is.
    #[error(
        "the checkpoint {} of row {row} {}; move it away, and the row begins anew",
        path.display(), if *changed { "was changed" } else { "belongs to another sweep" }
    )]
    Checkpoint {
        /// The file.
        path: PathBuf,
        /// The row.
        row: usize,
        /// True if the file was changed; if not, it belongs to another plan.
        changed: bool,
    },
    /// There is no journal to merge.
    #[error("there are no journals to merge")]
    None,
}

metriplectic_equations::debug_is_the_sentence!(JournalError);

/// A question that a table cannot answer.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TableError {
    /// There is no such column.
    #[error("the table has no column {name:?}; it has {}", known.join(", "))]
    NoColumn {
        /// The name asked for.
        name: String,
        /// The names that there are.
        known: Vec<String>,
    },
    /// A column was not observed in time.
    #[error("{name:?} was not observed in time; `Runs::observe` does that")]
    NotInTime {
        /// The name of the column.
        name: String,
    },
    /// Rows have states at different times.
    #[error(
        "rows {first} and {second} have states at different times; ask the runs for outputs, \
         `Span::until(..).output_every(..)`"
    )]
    Times {
        /// One of the rows.
        first: usize,
        /// The other row.
        second: usize,
    },
    /// A probability is not between 0 and 1.
    #[error("{probability} is no probability; it must be from 0 to 1")]
    Probability {
        /// The number.
        probability: f64,
    },
    /// No row has finished.
    #[error("no row of the table has finished")]
    NoRows,
    /// Rows are missing.
    #[error("{} rows are missing: {}", rows.len(), listed(rows))]
    Missing {
        /// Their numbers.
        rows: Vec<usize>,
    },
}

metriplectic_equations::debug_is_the_sentence!(TableError);

metriplectic_integrators::passed_on_as_error!(JournalError, PlanError, TableError);
