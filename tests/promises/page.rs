//! The table of the page of guarantees, as the cells of the test make it.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::{env, fs};

use crate::methods::{Every, Explicit, OneStage};
use crate::stages::{Gauss1, Gauss2, Gauss3, Gauss4, Radau2, Radau3, Radau4};
use crate::{Cell, Kind, Verdict};

/// The page.
const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../book/src/guarantees.md");
/// The lines between which the table stands.
const ENDS: [&str; 2] = ["<!-- kinds of flows -->", "<!-- end of the kinds of flows -->"];
/// The variable of the environment that writes it anew.
const BLESS: &str = "METRIPLECTIC_BLESS";

/// What every cell has shown.
#[derive(Default)]
pub(crate) struct Table(BTreeMap<(usize, &'static str), BTreeSet<Verdict>>);

/// The heading of the column of a kind.
const fn heading(kind: Kind) -> &'static str {
    match kind {
        Kind::Closed => "closed",
        Kind::Family => "family",
        Kind::Clock => "clock",
        Kind::Port => "port",
        Kind::Bath => "bath",
        Kind::PortAndBath => "port and bath",
        Kind::Noise { .. } | Kind::NoisyBath { .. } => "noise",
        Kind::Jump => "jump",
        Kind::Lattice => "lattice",
        Kind::OpenLattice => "open lattice",
    }
}

/// What a method is called in a program.
fn name(method: Every) -> &'static str {
    match method {
        Every::OneStage(OneStage::Weyl) => "`WeylMidpoint`",
        Every::OneStage(OneStage::Chart) => "`ChartMidpoint`",
        Every::OneStage(OneStage::Exponential) => "`Exponential`",
        Every::OneStage(OneStage::MeanValue) => "`MeanValue`",
        Every::OneStage(OneStage::ItohAbe) => "`ItohAbe`",
        Every::Implicit(Gauss1) => "`Gauss::<1>`",
        Every::Implicit(Gauss2) => "`Gauss::<2>`",
        Every::Implicit(Gauss3) => "`Gauss::<3>`",
        Every::Implicit(Gauss4) => "`Gauss::<4>`",
        Every::Implicit(Radau2) => "`Radau::<2>`",
        Every::Implicit(Radau3) => "`Radau::<3>`",
        Every::Implicit(Radau4) => "`Radau::<4>`",
        Every::Explicit(Explicit::Kutta3) => "`ExplicitRungeKutta` (Kutta's of order 3)",
        Every::Explicit(Explicit::Order5) => "`DormandPrince5`",
        Every::Explicit(Explicit::Order8) => "`DormandPrince8`",
        Every::Explicit(Explicit::Chebyshev) => "`RungeKuttaChebyshev`",
    }
}

/// What is not right, in the order of its letters.
const NOTES: [(Verdict, &str); 7] = [
    (
        Verdict::Named,
        "with fast friction and steps of one size the state is off where friction acts, and the certificate says so \
         (`is_resolved`)",
    ),
    (
        Verdict::Refused("StepError::EntropyFalls"),
        "with fast friction and steps of one size: `StepError::EntropyFalls`",
    ),
    (
        Verdict::Refused("NotDamped"),
        "`StepError::Method`: `Radau` takes open systems [without an entropy of their own and with one \
         bath](open_systems.md#what-is-not-promised)",
    ),
    (
        Verdict::Refused("NoiseError::NeedsFixedSteps"),
        "with a tolerance `NoiseError::NeedsFixedSteps`",
    ),
    (
        Verdict::Refused("NoiseError::FrictionUnresolved"),
        "with fast friction `NoiseError::FrictionUnresolved`, or `StabilityUnresolved` by the tableaux",
    ),
    (Verdict::Refused("NoiseError::NoiseWithRadau"), "`NoiseError::NoiseWithRadau`"),
    (
        Verdict::Refused("NoiseError::OrderTooLow"),
        "`NinomiyaVictoir` refuses it: `NoiseError::OrderTooLow`",
    ),
];

/// The letter of a note, of those that are used.
fn letter(note: usize, used: &BTreeSet<usize>) -> char {
    let place = used.iter().position(|other| *other == note).expect("it is used");
    ('a'..).nth(place).expect("there are few")
}

impl Table {
    pub(crate) fn enter(&mut self, cell: &Cell, verdict: Verdict) {
        let method = Every::all().iter().position(|method| *method == cell.method);
        let method = method.expect("it is a method");
        // One note for both.
        let verdict = match verdict {
            Verdict::Refused("NoiseError::StabilityUnresolved") => {
                Verdict::Refused("NoiseError::FrictionUnresolved")
            }
            verdict => verdict,
        };
        self.0.entry((method, heading(cell.kind))).or_default().insert(verdict);
    }

    /// The notes of a verdict, by their numbers.
    fn notes<'a>(shown: &'a BTreeSet<Verdict>) -> impl Iterator<Item = usize> + 'a {
        let is_note = |number: &usize| shown.contains(&NOTES[*number].0);
        (0..NOTES.len()).filter(is_note)
    }

    /// The marks of a method on the flows of a column; a dash if there is no such run.
    fn marks(&self, method: usize, column: &'static str, used: &BTreeSet<usize>) -> String {
        let Some(shown) = self.0.get(&(method, column)) else { return "–".to_owned() };
        let right = shown.contains(&Verdict::Right).then(|| "✓".to_owned());
        let letters = Self::notes(shown).map(|note| letter(note, used).to_string());
        let marks: Vec<String> = right.into_iter().chain(letters).collect();
        assert_eq!(marks.len(), shown.len(), "{shown:?}: a verdict has no note");
        marks.join(" ")
    }

    /// The table in Markdown, with its notes. Methods with the same marks share a row.
    fn text(&self) -> String {
        let mut columns: Vec<&str> = Kind::ALL.map(heading).to_vec();
        columns.dedup();
        let used: BTreeSet<usize> = self.0.values().flat_map(Self::notes).collect();
        let mut rows: Vec<(Vec<&str>, String)> = Vec::new();
        for (method, called) in Every::all().into_iter().map(name).enumerate() {
            let marks = columns.iter().map(|column| self.marks(method, column, &used));
            let marks = marks.collect::<Vec<_>>().join(" | ");
            match rows.iter_mut().find(|(_, others)| *others == marks) {
                Some((names, _)) => names.push(called),
                None => rows.push((vec![called], marks)),
            }
        }
        let rule = "---|".repeat(columns.len());
        let mut text = format!("| | {} |\n|---|{rule}\n", columns.join(" | "));
        for (names, marks) in rows {
            writeln!(text, "| {} | {marks} |", names.join(", ")).expect("it is a string");
        }
        for note in &used {
            write!(text, "\n{}: {}.\n", letter(*note, &used), NOTES[*note].1)
                .expect("it is a string");
        }
        // As the page on stages has it.
        let all = |family: &str, from: u32, to: u32| {
            let names = (from..=to).map(|s| format!("`{family}::<{s}>`"));
            (names.collect::<Vec<_>>().join(", "), format!("`{family}::<{from} … {to}>`"))
        };
        for (names, short) in [all("Gauss", 1, 4), all("Radau", 2, 4)] {
            text = text.replace(&names, &short);
        }
        text
    }
}

/// Compares the table with that of the page, or writes it there.
///
/// # Panics
///
/// If they differ.
pub(crate) fn compare(table: &Table) {
    let page = fs::read_to_string(PAGE).expect("the page is there");
    let [before, found, after] = parts(&page);
    let text = format!("\n\n{}\n", table.text());
    if env::var_os(BLESS).is_some() {
        let page = format!("{before}{}{text}{}{after}", ENDS[0], ENDS[1]);
        fs::write(PAGE, page).expect("the page is written");
        return;
    }
    assert!(
        found == text,
        "the table of book/src/guarantees.md is not that of the runs; write it anew by\n\
         {BLESS}=1 cargo test -p metriplectic-tests --test promises\n{text}"
    );
}

/// What stands before, between and after the ends of the table.
fn parts(page: &str) -> [&str; 3] {
    let (before, rest) = page.split_once(ENDS[0]).expect("the table begins");
    let (found, after) = rest.split_once(ENDS[1]).expect("the table ends");
    [before, found, after]
}
