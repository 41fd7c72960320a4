//! What stands above a picture: its title, and a legend as soon as there is something to tell apart.

use plotters::style::RGBColor;

use crate::{
    canvas::{At, Canvas, Type, length},
    frame,
    plot::PlotError,
};

/// Height of a row of the legend.
const ROW: f64 = 18.0;
/// Room for the title.
const TITLE: f64 = 26.0;
/// Room for the line that stands before a label.
const SAMPLE: f64 = 24.0;
/// Room between two entries.
const GAP: f64 = 16.0;

/// A title with the labels and colours of what is drawn under it.
pub(crate) struct Header<'a> {
    pub(crate) title: &'a str,
    pub(crate) entries: Vec<(&'a str, RGBColor)>,
}

impl Header<'_> {
    /// Its height above a picture of this width.
    pub(crate) fn height(&self, width: f64) -> f64 {
        TITLE + ROW * self.rows(width).len() as f64
    }

    /// Draws it over the edge of a picture, from its upper left corner to the right.
    pub(crate) fn draw(
        &self,
        canvas: &Canvas<'_>,
        (left, top): At,
        width: f64,
    ) -> Result<(), PlotError> {
        let rows = self.rows(width);
        let first = top - ROW * rows.len() as f64;
        let set = Type::centred(frame::SUBTITLE).fitting(self.title, width);
        canvas.text(self.title, (left + 0.5 * width, first - 12.0), set)?;
        for (row, entries) in rows.iter().enumerate() {
            let y = first + ROW * (row as f64 + 0.4);
            for &(entry, place) in entries {
                let (x, (label, color)) = (left + place, self.entries[entry]);
                let set = Type::left(frame::NUMBER).fitting(label, width - place - SAMPLE);
                canvas.line([(x, y), (x + 18.0, y)], color, 2.0)?;
                canvas.text(label, (x + SAMPLE, y), set)?;
            }
        }
        Ok(())
    }

    /// The rows of the legend, in the middle, each of entries `(number, place)`.
    fn rows(&self, width: f64) -> Vec<Vec<(usize, f64)>> {
        if self.entries.len() < 2 {
            return Vec::new();
        }
        let mut rows = vec![(Vec::new(), -GAP)];
        for (number, (label, _)) in self.entries.iter().enumerate() {
            let entry = SAMPLE + length(label, frame::NUMBER) + GAP;
            if let Some((row, used)) = rows.last_mut().filter(|(_, used)| used + entry <= width) {
                row.push((number, *used + GAP));
                *used += entry;
            } else {
                rows.push((vec![(number, 0.0)], entry - GAP));
            }
        }
        let centred = |(row, used): (Vec<(usize, f64)>, f64)| {
            let margin = (0.5 * (width - used)).max(0.0);
            row.into_iter().map(|(number, place)| (number, margin + place)).collect::<Vec<_>>()
        };
        rows.into_iter().map(centred).filter(|row| !row.is_empty()).collect()
    }
}
