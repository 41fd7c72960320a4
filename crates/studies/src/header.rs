//! The head of a picture: its letter, its title and its legend.

use svg::node::element::Element;

use crate::plot::{Anchor, At, NAME, NUMBER, length, line, text};

/// Height of a row; room for the letter, for the line before a label, and between two entries.
const ROW: f64 = 18.0;
const LETTER: f64 = 22.0;
const SAMPLE: f64 = 24.0;
const GAP: f64 = 14.0;

/// A line of the legend: its label, its colour, and whether it is dashed.
pub(crate) type Entry<'a> = (&'a str, &'static str, bool);

/// A title and a legend, set in rows of a given width.
pub(crate) struct Header<'a> {
    title: &'a str,
    /// The entries with their places in the rows.
    pub(crate) entries: Vec<(Entry<'a>, At)>,
    /// The height of all rows.
    pub(crate) height: f64,
}

impl<'a> Header<'a> {
    pub(crate) fn of(title: &'a str, entries: Vec<Entry<'a>>, width: f64) -> Self {
        let gap = if title.is_empty() { 0.0 } else { GAP };
        let (mut x, mut y) = (LETTER + length(title, NAME) + gap, 0.5 * ROW);
        let set = entries.into_iter().map(|entry| {
            let needed = SAMPLE + length(entry.0, NUMBER);
            if x + needed > width && x > LETTER {
                (x, y) = (LETTER, y + ROW);
            }
            x += needed + GAP;
            (entry, (x - needed - GAP, y))
        });
        let entries = set.collect();
        Self { title, entries, height: y + 0.5 * ROW + 6.0 }
    }

    /// The parts, with the upper left corner at a place.
    pub(crate) fn parts(&self, letter: char, (left, top): At) -> Vec<Element> {
        let first = top + 0.5 * ROW;
        let letter = text(&letter.to_string(), (left, first), NAME + 2, Anchor::Start);
        let mut parts = vec![letter.set("font-weight", "bold").into()];
        if !self.title.is_empty() {
            parts.push(text(self.title, (left + LETTER, first), NAME, Anchor::Start).into());
        }
        for &((label, color, dashed), (x, y)) in &self.entries {
            let (x, y) = (left + x, top + y);
            let (width, dashes) = if dashed { (1.0, Some("5 4")) } else { (2.0, None) };
            parts.push(line([(x, y), (x + 18.0, y)], color, width, dashes));
            parts.push(text(label, (x + SAMPLE, y), NUMBER, Anchor::Start).into());
        }
        parts
    }
}
