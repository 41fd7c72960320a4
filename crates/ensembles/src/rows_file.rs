//! Rows of parameters from a file of comma-separated numbers.

use std::fs;
use std::path::Path;

use crate::error::PlanError;

/// The names and the rows of a file.
pub(crate) fn read(path: &Path) -> Result<(Vec<String>, Vec<Vec<f64>>), PlanError> {
    let text = fs::read_to_string(path)
        .map_err(|source| PlanError::Read { path: path.to_owned(), source })?;
    let cell = |line: usize, problem: String| {
        let path = path.to_owned();
        PlanError::Cell { path, line: line + 1, problem }
    };
    // Spreadsheets begin a file with a mark of the byte order.
    let mut lines = text.trim_start_matches('\u{feff}').lines().enumerate();
    let (_, first) = lines.next().unwrap_or((0, ""));
    let names: Vec<String> =
        split(first).map(|name| unquoted(name).replace("\"\"", "\"")).collect();
    if names.iter().any(String::is_empty) {
        return Err(cell(0, "a column has no name".to_owned()));
    }
    let mut rows = Vec::new();
    for (line, text) in lines.filter(|(_, text)| !text.trim().is_empty()) {
        let number = |entry: &str| {
            let entry = unquoted(entry);
            let problem = || cell(line, format!("{entry:?} is not a number"));
            entry.parse::<f64>().map_err(|_| problem())
        };
        let row = split(text).map(number).collect::<Result<Vec<_>, _>>()?;
        if row.len() != names.len() {
            let problem = format!("{} numbers under {} names", row.len(), names.len());
            return Err(cell(line, problem));
        }
        rows.push(row);
    }
    Ok((names, rows))
}

/// The cells of a line; a comma within quotes does not end one.
fn split(line: &str) -> impl Iterator<Item = &str> {
    let mut quoted = false;
    line.split(move |c| {
        quoted ^= c == '"';
        c == ',' && !quoted
    })
}

fn unquoted(cell: &str) -> &str {
    let cell = cell.trim();
    cell.strip_prefix('"').and_then(|cell| cell.strip_suffix('"')).unwrap_or(cell)
}
