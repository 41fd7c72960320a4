//! Studies in rows.

use std::fmt;

use comfy_table::{CellAlignment, TableStyle, presets};

/// A table with a named column for each of `N` cells; the first column is flush left, the others,
/// usually numbers, flush right.
///
/// The number of cells is part of the type, so a row with a missing cell does not compile:
///
/// ```compile_fail,E0308
/// metriplectic_studies::Table::new(["problem", "order"]).row(["sphere"]);
/// ```
///
/// # Examples
///
/// ```
/// use metriplectic_studies::{Table, scientific};
///
/// let mut table = Table::new(["problem", "ΔH"]);
/// table.row(["sphere".into(), scientific(3.5657e-4)]).row(["top".into(), scientific(0.0)]);
/// assert_eq!(
///     table.markdown(),
///     "| problem |      ΔH |\n\
///      |---------|---------|\n\
///      | sphere  | 3.57e-4 |\n\
///      | top     |       0 |"
/// );
/// ```
#[derive(Clone, Debug)]
pub struct Table<const N: usize> {
    header: [String; N],
    rows: Vec<[String; N]>,
}

impl<const N: usize> Table<N> {
    /// A table with these columns and no rows.
    #[must_use]
    pub fn new(header: [impl ToString; N]) -> Self {
        Self { header: header.map(|name| name.to_string()), rows: Vec::new() }
    }

    /// Adds a row.
    pub fn row(&mut self, cells: [impl ToString; N]) -> &mut Self {
        self.rows.push(cells.map(|cell| cell.to_string()));
        self
    }

    /// The table in Markdown.
    #[must_use]
    pub fn markdown(&self) -> String {
        let escape = |cell: &String| cell.replace('|', "\\|");
        self.drawn(presets::ASCII_MARKDOWN, escape)
    }

    fn drawn(&self, style: TableStyle, cell: impl Fn(&String) -> String) -> String {
        let mut table = comfy_table::Table::new();
        table.load_style(style).set_header(self.header.iter().map(&cell));
        table.add_rows(self.rows.iter().map(|row| row.iter().map(&cell)));
        for column in table.column_iter_mut().skip(1) {
            column.set_cell_alignment(CellAlignment::Right);
        }
        table.trim_fmt()
    }
}

/// The table in plain text, without lines between the columns.
impl<const N: usize> fmt::Display for Table<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.drawn(presets::UTF8_HORIZONTAL_ONLY, String::clone))
    }
}

/// A number as the tables print it, with three digits: `3.57e-4`; zero is `0`.
#[must_use]
pub fn scientific(x: f64) -> String {
    if x.abs() > 0.0 || x.is_nan() { format!("{x:.2e}") } else { "0".into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        let numbers = [3.5657e-4, -1.0, 123_456.0, 0.0, -0.0, f64::NAN, f64::NEG_INFINITY];
        let expected = ["3.57e-4", "-1.00e0", "1.23e5", "0", "0", "NaN", "-inf"];
        assert_eq!(numbers.map(scientific), expected);
    }

    #[test]
    fn plain_text_lines_up() {
        let mut table = Table::new(["problem", "order"]);
        table.row(["sphere", "2.00"]).row(["Lie-Poisson", "12.00"]);
        let text = table.to_string();
        let lines: Vec<&str> = text.lines().map(str::trim_end).collect();
        assert!(lines.contains(&" problem       order"), "{text}");
        assert!(lines.contains(&" sphere         2.00"), "{text}");
        assert!(lines.contains(&" Lie-Poisson   12.00"), "{text}");
    }

    #[test]
    fn markdown_survives_a_norm() {
        let mut table = Table::new(["|ΔH|"]);
        table.row([scientific(1.0)]);
        assert!(table.markdown().starts_with("| \\|ΔH\\| |"), "{}", table.markdown());
    }
}
