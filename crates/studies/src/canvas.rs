//! Ink on paper: lengths in pixels, `y` downwards, drawn by plotters.

use std::error::Error;

use plotters::{
    coord::Shift,
    prelude::*,
    style::text_anchor::{HPos, Pos, VPos},
};

use crate::plot::PlotError;

/// The backend snaps to whole units, which shows as jagged lines; ten units are a pixel.
const UNITS: f64 = 10.0;
/// The backend divides font sizes by this.
const FONT: f64 = 1.24;

pub(crate) const INK: RGBColor = RGBColor(34, 34, 34);
pub(crate) const GREY: RGBColor = RGBColor(119, 119, 119);
pub(crate) const GRID: RGBColor = RGBColor(229, 229, 229);

/// Okabe & Ito 2008, the dark colours first.
const PALETTE: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];

/// The colour of the line of this number.
pub(crate) fn color(line: usize) -> RGBColor {
    PALETTE[line % PALETTE.len()]
}

/// An estimate, on the wide side, of how long a text is: fonts are known to the viewer only.
pub(crate) fn length(text: &str, size: f64) -> f64 {
    0.6 * size * text.chars().count() as f64
}

pub(crate) type At = (f64, f64);

/// A sheet that is being drawn on.
pub(crate) struct Canvas<'a> {
    area: DrawingArea<SVGBackend<'a>, Shift>,
}

/// How a text is set: its size in pixels, and which of its points is placed.
#[derive(Clone, Copy)]
pub(crate) struct Type {
    pub(crate) size: f64,
    pub(crate) color: RGBColor,
    pub(crate) horizontal: HPos,
    pub(crate) vertical: VPos,
    /// Reads upwards.
    pub(crate) upwards: bool,
}

impl Type {
    pub(crate) const fn centred(size: f64) -> Self {
        let (horizontal, vertical) = (HPos::Center, VPos::Center);
        Self { size, color: INK, horizontal, vertical, upwards: false }
    }

    pub(crate) const fn left(size: f64) -> Self {
        Self { horizontal: HPos::Left, ..Self::centred(size) }
    }

    pub(crate) const fn right(size: f64) -> Self {
        Self { horizontal: HPos::Right, ..Self::centred(size) }
    }

    pub(crate) const fn upwards(size: f64) -> Self {
        Self { upwards: true, ..Self::centred(size) }
    }

    /// Smaller, where the text would be longer than this.
    pub(crate) fn fitting(self, text: &str, most: f64) -> Self {
        Self { size: self.size.min(most / length(text, 1.0)), ..self }
    }

    pub(crate) const fn grey(self) -> Self {
        Self { color: GREY, ..self }
    }
}

/// Markers that differ in shape, for those who cannot go by colour.
#[derive(Clone, Copy)]
pub(crate) struct Marker {
    pub(crate) line: usize,
    pub(crate) filled: bool,
}

/// Draws a sheet of this size, as SVG.
pub(crate) fn sheet(
    (width, height): At,
    draw: impl FnOnce(&Canvas<'_>) -> Result<(), PlotError>,
) -> Result<String, PlotError> {
    let (units, pixels) = (whole((width, height)), (width.round(), height.round()));
    let mut svg = String::new();
    {
        let size = (units.0.unsigned_abs(), units.1.unsigned_abs());
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        area.fill(&WHITE).map_err(failed)?;
        let canvas = Canvas { area };
        draw(&canvas)?;
        canvas.area.present().map_err(failed)?;
    }
    let header = format!("<svg width=\"{}\" height=\"{}\"", units.0, units.1);
    let scaled = format!(
        "<svg width=\"{}\" height=\"{}\" stroke-linejoin=\"round\" stroke-linecap=\"round\"",
        pixels.0, pixels.1
    );
    Ok(svg.replacen(&header, &scaled, 1))
}

impl Canvas<'_> {
    pub(crate) fn text(&self, text: &str, at: At, set: Type) -> Result<(), PlotError> {
        let font = ("sans-serif", set.size * UNITS * FONT).into_font().color(&set.color);
        let style = font.pos(Pos::new(set.horizontal, set.vertical));
        let turn = if set.upwards { FontTransform::Rotate270 } else { FontTransform::None };
        self.area.draw(&Text::new(text, whole(at), style.transform(turn))).map_err(failed)
    }

    /// A line through these points.
    pub(crate) fn line(
        &self,
        points: impl IntoIterator<Item = At>,
        color: RGBColor,
        width: f64,
    ) -> Result<(), PlotError> {
        let mut path: Vec<(i32, i32)> = points.into_iter().map(whole).collect();
        path.dedup();
        self.area.draw(&PathElement::new(path, color.stroke_width(stroke(width)))).map_err(failed)
    }

    /// A line through these points in dashes.
    pub(crate) fn dashed(&self, points: &[At], color: RGBColor) -> Result<(), PlotError> {
        dashes(points, (5.0, 4.0)).into_iter().try_for_each(|dash| self.line(dash, color, 1.0))
    }

    /// A line through these points in dots.
    pub(crate) fn dotted(&self, points: &[At], color: RGBColor) -> Result<(), PlotError> {
        dashes(points, (0.5, 4.0)).into_iter().try_for_each(|dot| self.line(dot, color, 1.8))
    }

    /// A disc without an outline.
    pub(crate) fn disc(&self, at: At, radius: f64, inside: RGBColor) -> Result<(), PlotError> {
        self.area.draw(&Circle::new(whole(at), stroke(radius), inside.filled())).map_err(failed)
    }

    /// The outline of a disc.
    pub(crate) fn circle(
        &self,
        at: At,
        radius: f64,
        color: RGBColor,
        width: f64,
    ) -> Result<(), PlotError> {
        let style = color.stroke_width(stroke(width));
        self.area.draw(&Circle::new(whole(at), stroke(radius), style)).map_err(failed)
    }

    pub(crate) fn marker(&self, at: At, marker: Marker) -> Result<(), PlotError> {
        let color = color(marker.line);
        let inside = if marker.filled { color } else { WHITE };
        let outline = marker_outline(at, marker.line);
        let path: Vec<(i32, i32)> = outline.iter().copied().map(whole).collect();
        self.area.draw(&Polygon::new(path, inside.filled())).map_err(failed)?;
        self.line(outline.iter().copied().chain(outline.first().copied()), color, 1.2)
    }
}

/// The dashes of a line, of this length and at this distance.
fn dashes(points: &[At], (dash, gap): (f64, f64)) -> Vec<Vec<At>> {
    let mut dashes = vec![Vec::new()];
    // Whether a dash is being drawn, and how far it is to its end, or to the next.
    let (mut drawn, mut left) = (true, dash);
    for pair in points.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let length = (to.0 - from.0).hypot(to.1 - from.1);
        let at =
            |s: f64| (from.0 + s / length * (to.0 - from.0), from.1 + s / length * (to.1 - from.1));
        let mut start = 0.0;
        while start < length {
            let end = (start + left).min(length);
            if drawn {
                dashes.last_mut().into_iter().for_each(|dash| dash.extend([at(start), at(end)]));
            }
            left -= end - start;
            if end < length {
                drawn = !drawn;
                left = if drawn { dash } else { gap };
                dashes.push(Vec::new());
            }
            start = end;
        }
    }
    dashes.retain(|dash| !dash.is_empty());
    dashes
}

/// Disc, square, triangle, diamond, pentagon, and the triangle on its tip, as polygons around a
/// point.
fn marker_outline((x, y): At, line: usize) -> Vec<At> {
    let (corners, radius, turn) = [
        (16, 3.6, 0.0),
        (4, 4.6, 0.5),
        (3, 4.8, 0.75),
        (4, 4.8, 0.0),
        (5, 4.2, 0.25),
        (3, 4.8, 0.25),
    ][line % 6];
    let corner = |k: u8| {
        let angle = std::f64::consts::TAU * (f64::from(k) + turn) / f64::from(corners);
        (x + radius * angle.cos(), y - radius * angle.sin())
    };
    (0..corners).map(corner).collect()
}

fn stroke(width: f64) -> u32 {
    whole((width, 0.0)).0.unsigned_abs()
}

#[expect(clippy::cast_possible_truncation, reason = "saturates; a sheet has some thousand pixels")]
fn whole((x, y): At) -> (i32, i32) {
    ((x * UNITS).round() as i32, (y * UNITS).round() as i32)
}

fn failed(source: impl Error + Send + Sync + 'static) -> PlotError {
    PlotError::Backend { source: Box::new(source) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dashes_go_round_corners_and_cover_five_parts_of_nine() {
        let corner: [At; 3] = [(0.0, 0.0), (47.0, 0.0), (47.0, 43.0)];
        let length = |dash: &Vec<At>| -> f64 {
            dash.windows(2).map(|p| (p[1].0 - p[0].0).hypot(p[1].1 - p[0].1)).sum()
        };
        let dashes = dashes(&corner, (5.0, 4.0));
        assert_eq!(dashes.len(), 10);
        assert!(dashes.iter().all(|dash| (length(dash) - 5.0).abs() < 1e-9), "{dashes:?}");
        assert_eq!(dashes[0], [(0.0, 0.0), (5.0, 0.0)]);
        // The sixth begins at 45 and has its end behind the corner.
        assert_eq!((dashes[5][0], dashes[5][dashes[5].len() - 1]), ((45.0, 0.0), (47.0, 3.0)));
    }

    #[test]
    fn six_lines_differ_in_colour_and_in_marker() {
        let outlines: Vec<_> = (0..6).map(|line| marker_outline((0.0, 0.0), line)).collect();
        for i in 0..6 {
            assert!((0..i).all(|j| color(i) != color(j) && outlines[i] != outlines[j]));
        }
    }
}
