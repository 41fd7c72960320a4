//! The matrix of what works with what: each kind of system with each verb is a program, and the matrix in `cells.rs` says whether it compiles.
//!
//! The matrix can only get fuller: a program that compiles where the matrix has an error fails the test, with the sentence that its
//! cell is to be set, and so does one that no longer compiles. A cell with a program that compiles names the test that compares such a
//! run with a reference. The table of `book/src/matrix.md` is written from the cells: `METRIPLECTIC_BLESS=1` writes it anew.
//!
//! All programs are checked by one call of Cargo, without generating code, and errors are compared by their codes. With `trybuild`
//! each program that fails would have a snapshot of its message, more than a hundred of them, which name the types of half of the
//! library: they would change with every one of these types, and no reader would look at them. The messages that a user is likely to
//! meet have their snapshots in `doors`.

mod cells;
mod package;
mod page;
mod programs;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use cells::{Cell, TESTS};
use programs::KINDS;

/// A file name from the words of a cell.
fn file_name(verb: &str, kind: &str) -> String {
    let words = format!("{verb} {kind}").to_lowercase();
    let parts = words.split(|c: char| !c.is_ascii_alphanumeric()).filter(|part| !part.is_empty());
    parts.collect::<Vec<_>>().join("_")
}

#[test]
fn what_works_with_what_is_what_the_matrix_says() {
    assert_eq!(cells::columns(), KINDS.map(programs::Kind::heading));
    let mut cells = BTreeMap::new();
    for (verb, row) in cells::rows() {
        assert_eq!(row.len(), KINDS.len(), "the row of {verb}");
        for (kind, cell) in KINDS.into_iter().zip(row) {
            if cell.has_program() {
                let name = file_name(verb, kind.heading());
                let program = programs::program(kind, verb);
                cells.insert(name, (format!("{verb} × {}", kind.heading()), cell, program));
            }
        }
    }
    let programs = cells.iter().map(|(name, (_, _, program))| (name.clone(), program.clone()));
    let said = package::said(&programs.collect());
    let mut wrong = Vec::new();
    for (name, (called, cell, _)) in &cells {
        let said = &said[name];
        match cell {
            Cell::Errors(_) if said.compiles => wrong.push(format!(
                "{called} compiles now: the cell is yes, so set it in tests/compile/matrix/cells.rs, with the test that \
                 compares it with a reference"
            )),
            Cell::Errors(codes) if said.codes != codes.iter().cloned().collect::<BTreeSet<_>>() => {
                wrong.push(format!("{called} has the errors {:?}, not {codes:?}", said.codes));
            }
            Cell::Tested(_) if !said.compiles => wrong.push(format!(
                "{called} does not compile any more, and the matrix says that it does:\n{}",
                said.text
            )),
            _ => {}
        }
    }
    let compile = cells.values().filter(|(_, cell, _)| cell.compiles()).count();
    println!("{} programs: {compile} compile", cells.len());
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_tests_that_the_matrix_names_are_there() {
    let rows = cells::rows();
    for (number, test) in TESTS.iter().enumerate() {
        let path = format!("{}/../../{}", env!("CARGO_MANIFEST_DIR"), test.file);
        let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
        let function = format!("fn {}()", test.test);
        assert!(text.contains(&function), "{} has no `{function}`", test.file);
        let is_used = rows.iter().any(|(_, row)| row.contains(&Cell::Tested(number)));
        assert!(is_used, "no cell names `{}`: delete it", test.name);
    }
}

#[test]
fn the_book_has_the_matrix() {
    page::compare();
}
