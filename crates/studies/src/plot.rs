//! Figures as SVG: the same bytes for the same numbers.
//!
//! [`Panels`] draws lines over time and, beside them, curves on a sphere ([`Globe`]). [`LogLog`] draws
//! convergence. Axes, grids, ticks, lines and markers are those of the crate `kuva`. The colours are those
//! of Okabe and Ito (2008), which the colour-blind tell apart.

use std::{fs, io, path::PathBuf};

use kuva::backend::svg::SvgBackend;
use kuva::render::render::{PathData, Primitive, Scene, TextAnchor};

pub use crate::{globe::Globe, log_log::LogLog, panel::Panel, panels::Panels};

/// Why a figure could not be drawn.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlotError {
    /// The figure, panel or line of this name has nothing in it.
    #[error("there is nothing to draw in `{name}`; give it a line with at least one point")]
    Empty {
        /// Title or label.
        name: String,
    },
    /// A point has no place on the paper: it is not finite, not positive on a logarithmic axis, or not on
    /// the unit sphere.
    #[error("point {index} of `{name}` is {point:?}, which has no place on {place}; leave it out")]
    Point {
        /// Label of the line.
        name: String,
        /// Index of the point.
        index: usize,
        /// Its entries.
        point: Vec<f64>,
        /// Where it was to be drawn.
        place: &'static str,
    },
    /// The file could not be written.
    #[error("cannot write {}: {source}; does its folder exist?", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}

pub(crate) const INK: &str = "#222222";
pub(crate) const GREY: &str = "#777777";

/// Sizes of text, in pixels.
pub(crate) const TITLE: u32 = 16;
pub(crate) const NAME: u32 = 12;
pub(crate) const NUMBER: u32 = 11;

/// Points of a curve nearer than this to the last one drawn are left out, in pixels.
const GRAIN: f64 = 0.2;

/// Whether a line has points and each has a place on the paper.
pub(crate) fn check<P: AsRef<[f64]>>(
    name: &str,
    points: impl IntoIterator<Item = P>,
    place: &'static str,
    fits: impl Fn(&[f64]) -> bool,
) -> Result<(), PlotError> {
    let (name, mut count) = (name.to_owned(), 0);
    for point in points {
        if !fits(point.as_ref()) {
            let point = point.as_ref().to_vec();
            return Err(PlotError::Point { name, index: count, point, place });
        }
        count += 1;
    }
    if count > 0 { Ok(()) } else { Err(PlotError::Empty { name }) }
}

/// A place on the sheet, in pixels, `y` downwards.
pub(crate) type At = (f64, f64);

/// The colour of the line of this number, by Okabe and Ito (2008), the dark ones first.
pub(crate) fn color(line: usize) -> &'static str {
    ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#555555"][line % 7]
}

/// The length of a text, about: only the viewer knows the font.
pub(crate) fn length(text: &str, size: u32) -> f64 {
    0.54 * f64::from(size) * text.chars().count() as f64
}

/// The size of a text that is not longer than this, at most the one asked for.
pub(crate) fn fitting(text: &str, size: u32, most: f64) -> u32 {
    (7..=size).rev().find(|&size| length(text, size) <= most).unwrap_or(7)
}

/// A line of text around a place, half of its height above it.
pub(crate) fn text(content: &str, (x, y): At, size: u32, anchor: TextAnchor) -> Primitive {
    let (content, y) = (content.to_owned(), y + 0.35 * f64::from(size));
    Primitive::Text { x, y, content, size, anchor, rotate: None, bold: false, color: None }
}

/// A line through places, perhaps dashed.
pub(crate) fn line(points: Vec<At>, color: &str, width: f64, dashes: Option<&str>) -> Primitive {
    Primitive::PolyLine {
        points,
        stroke: color.into(),
        stroke_width: width,
        stroke_dasharray: dashes.map(str::to_owned),
    }
}

/// An empty sheet of this size with a title over `middle`.
pub(crate) fn sheet((width, height): At, title: &str, middle: f64) -> Scene {
    let mut sheet = Scene::new(width, height);
    (sheet.background_color, sheet.text_color) = (Some("white".into()), Some(INK.into()));
    sheet.font_family = Some("DejaVu Sans, Verdana, Liberation Sans, Arial, sans-serif".into());
    let size = fitting(title, TITLE, 2.0 * middle - 16.0);
    sheet.add(text(title, (middle, 20.0), size, TextAnchor::Middle));
    sheet
}

/// Puts a picture on the sheet with its upper left corner at a place.
pub(crate) fn place(sheet: &mut Scene, (x, y): At, picture: impl IntoIterator<Item = Primitive>) {
    sheet.add(Primitive::GroupStart {
        transform: Some(format!("translate({x:.1},{y:.1})")),
        title: None,
        extra_attrs: Some(r#"stroke-linejoin="round" stroke-linecap="round""#.into()),
    });
    // Clips have numbers that count all figures of a process, and every line is inside its frame.
    let drawn = |part: &Primitive| match part {
        Primitive::ClipStart { .. } | Primitive::ClipEnd => false,
        Primitive::Text { content, .. } => !content.is_empty(),
        _ => true,
    };
    picture.into_iter().filter(drawn).for_each(|part| sheet.add(compact(part)));
    sheet.add(Primitive::GroupEnd);
}

/// A line without the points that cannot be told from their neighbours, in hundredths of a pixel. The
/// backend writes up to 17 digits.
fn compact(part: Primitive) -> Primitive {
    let Primitive::PolyLine { points, stroke, stroke_width, stroke_dasharray } = part else {
        return part;
    };
    let mut kept: Vec<At> = Vec::new();
    for (k, &(x, y)) in points.iter().enumerate() {
        let far = |&(a, b): &At| (x - a).hypot(y - b) >= GRAIN;
        if k + 1 == points.len() || kept.last().is_none_or(far) {
            kept.push((x, y));
        }
    }
    let path = kept.iter().map(|(x, y)| format!("{x:.2} {y:.2}")).collect::<Vec<_>>().join("L");
    let d = format!("M{path}");
    let (fill, opacity) = (None, None);
    Primitive::Path(Box::new(PathData { d, fill, stroke, stroke_width, opacity, stroke_dasharray }))
}

/// The sheet as SVG, an element in each line.
pub(crate) fn svg(sheet: &Scene) -> String {
    SvgBackend::new().with_pretty(true).render_scene(sheet)
}

/// The file of a figure.
pub(crate) fn save(path: PathBuf, svg: &str) -> Result<(), PlotError> {
    fs::write(&path, svg).map_err(|source| PlotError::Io { path, source })
}
