//! What stands above a picture: its letter, its title and its legend.

use kuva::render::render::{Primitive, TextAnchor};

use crate::plot::{At, INK, NAME, NUMBER, fitting, length, line, text};

/// Height of a row.
const ROW: f64 = 18.0;
/// Room for the letter, for the line before a label, and between two entries.
const LETTER: f64 = 22.0;
const SAMPLE: f64 = 24.0;
const GAP: f64 = 14.0;

/// A line of the legend: its label, its colour, and whether it is dashed.
pub(crate) type Entry<'a> = (&'a str, &'static str, bool);

/// A title and a legend, set in rows of a given width.
pub(crate) struct Header<'a> {
    title: &'a str,
    /// The entries with their distances from the left and their rows.
    entries: Vec<(Entry<'a>, f64, f64)>,
    rows: f64,
    width: f64,
}

impl<'a> Header<'a> {
    pub(crate) fn of(title: &'a str, entries: Vec<Entry<'a>>, width: f64) -> Self {
        let start = if title.is_empty() { LETTER } else { LETTER + length(title, NAME) + GAP };
        let (mut x, mut row) = (start, 0.0);
        let set = entries.into_iter().map(|entry| {
            let needed = SAMPLE + length(entry.0, NUMBER);
            if x + needed > width && x > LETTER {
                (x, row) = (LETTER, row + 1.0);
            }
            let placed = (entry, x, row);
            x += needed + GAP;
            placed
        });
        let entries = set.collect();
        Self { title, entries, rows: row + 1.0, width }
    }

    /// Its height above the picture.
    pub(crate) fn height(&self) -> f64 {
        ROW * self.rows + 6.0
    }

    #[cfg(test)]
    pub(crate) fn entries(&self) -> Vec<&str> {
        self.entries.iter().map(|(entry, ..)| entry.0).collect()
    }

    /// The parts, with the upper left corner of the picture at a place.
    pub(crate) fn parts(&self, letter: char, (left, top): At) -> Vec<Primitive> {
        let middle = |row: f64| top - self.height() + ROW * (row + 0.5);
        let mut parts = vec![
            Primitive::Text {
                x: left,
                y: middle(0.0) + 5.0,
                content: letter.into(),
                size: NAME + 2,
                anchor: TextAnchor::Start,
                rotate: None,
                bold: true,
                color: Some(INK.into()),
            },
            text(self.title, (left + LETTER, middle(0.0)), NAME, TextAnchor::Start),
        ];
        for &((label, color, dashed), x, row) in &self.entries {
            let (x, y) = (left + x, middle(row));
            let mut sample = line(vec![(x, y), (x + 18.0, y)], color, 2.0);
            if let Primitive::PolyLine { stroke_dasharray, stroke_width, .. } = &mut sample
                && dashed
            {
                (*stroke_dasharray, *stroke_width) = (Some("5 4".into()), 1.0);
            }
            let size = fitting(label, NUMBER, self.width - (x - left) - SAMPLE);
            parts.extend([sample, text(label, (x + SAMPLE, y), size, TextAnchor::Start)]);
        }
        parts
    }
}
