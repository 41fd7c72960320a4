//! The table of the page on what works with what, as the matrix has it.

use std::fmt::Write as _;
use std::{env, fs};

use crate::cells::{self, Cell, Limit, TESTS};
use crate::programs::KINDS;

/// The page.
const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../book/src/matrix.md");
/// The lines between which the table stands.
const ENDS: [&str; 2] = ["<!-- kinds and verbs -->", "<!-- end of the kinds and verbs -->"];
/// The variable of the environment that writes it anew.
const BLESS: &str = "METRIPLECTIC_BLESS";

/// The notes, in the order in which they are used.
#[derive(Default)]
struct Notes(Vec<&'static str>);

impl Notes {
    fn letter(&mut self, note: &'static str) -> char {
        let place = self.0.iter().position(|other| *other == note).unwrap_or_else(|| {
            self.0.push(note);
            self.0.len() - 1
        });
        ('a'..='z').nth(place).expect("there are few")
    }

    fn mark(&mut self, cell: &Cell) -> String {
        match cell {
            Cell::Tested(test) => match TESTS[*test].limit {
                Limit::None => "✓".to_owned(),
                Limit::Partly(note) => format!("✓ {}", self.letter(note)),
                Limit::Refused(note) => self.letter(note).to_string(),
            },
            Cell::Errors(_) => "no".to_owned(),
            Cell::NoSense => "–".to_owned(),
        }
    }
}

/// The table in Markdown, with its notes.
fn table() -> String {
    let columns = KINDS.map(crate::programs::Kind::heading).join(" | ");
    let mut text = format!("| | {columns} |\n|---|{}\n", "---|".repeat(KINDS.len()));
    let mut notes = Notes::default();
    for (verb, row) in cells::rows() {
        let marks: Vec<String> = row.iter().map(|cell| notes.mark(cell)).collect();
        writeln!(text, "| {verb} | {} |", marks.join(" | ")).expect("it is a string");
    }
    for (letter, note) in ('a'..).zip(&notes.0) {
        write!(text, "\n{letter}: {note}.\n").expect("it is a string");
    }
    text
}

/// Compares the table with that of the page, or writes it there.
///
/// # Panics
///
/// If they differ.
pub(crate) fn compare() {
    let page = fs::read_to_string(PAGE).expect("the page is there");
    let (before, rest) = page.split_once(ENDS[0]).expect("the table begins");
    let (found, after) = rest.split_once(ENDS[1]).expect("the table ends");
    let text = format!("\n\n{}\n", table());
    if env::var_os(BLESS).is_some() {
        let page = format!("{before}{}{text}{}{after}", ENDS[0], ENDS[1]);
        fs::write(PAGE, page).expect("the page is written");
        return;
    }
    assert!(
        found == text,
        "the table of book/src/matrix.md is not that of the matrix; write it anew by\n\
         {BLESS}=1 cargo test -p metriplectic-compile-tests --test matrix\n{text}"
    );
}
