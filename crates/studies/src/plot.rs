//! Figures as SVG: the same bytes for the same numbers.
//!
//! [`Panels`] draws lines over time and, beside them, curves on a sphere ([`Globe`]). [`LogLog`] draws
//! convergence. The colours are those of Okabe and Ito (2008), which the colour-blind tell apart. The crate `svg`
//! writes the elements.

use std::{fs, io, path::PathBuf};

use svg::node::element::{self, Element, Group, Rectangle};

pub use crate::{globe::Globe, log_log::LogLog, panel::Panel, panels::Panels};

/// Why a figure could not be drawn.
#[derive(thiserror::Error)]
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
        /// The error of the system.
        source: io::Error,
    },
}

metriplectic_equations::debug_is_the_sentence!(PlotError);

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

/// The end of a text, or its middle, that stands at its place.
#[derive(Clone, Copy)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

/// A line of text around a place, half of its height above it.
pub(crate) fn text(content: &str, at: At, size: u32, anchor: Anchor) -> element::Text {
    baseline(content, (at.0, at.1 + 0.35 * f64::from(size)), size, anchor)
}

/// A line of text that is written upwards, with its baseline at `x` and its middle at `y`.
pub(crate) fn upwards(content: &str, (x, y): At, size: u32) -> element::Text {
    let turn = format!("rotate(-90,{},{})", pixels(x), pixels(y));
    baseline(content, (x, y), size, Anchor::Middle).set("transform", turn)
}

fn baseline(content: &str, (x, y): At, size: u32, anchor: Anchor) -> element::Text {
    let anchor = match anchor {
        Anchor::Start => "start",
        Anchor::Middle => "middle",
        Anchor::End => "end",
    };
    let text = element::Text::new(content).set("x", pixels(x)).set("y", pixels(y));
    text.set("font-size", size).set("text-anchor", anchor)
}

/// A line through places, perhaps dashed, without the points that cannot be told from their neighbours.
pub(crate) fn line(
    points: impl IntoIterator<Item = At>,
    color: &str,
    width: f64,
    dashes: Option<&str>,
) -> Element {
    let mut points = points.into_iter().peekable();
    let mut kept: Vec<At> = Vec::new();
    while let Some((x, y)) = points.next() {
        let far = |&(a, b): &At| (x - a).hypot(y - b) >= GRAIN;
        if points.peek().is_none() || kept.last().is_none_or(far) {
            kept.push((x, y));
        }
    }
    let line = path(&kept, false).set("stroke", color).set("stroke-width", width);
    let line = line.set("fill", "none");
    if let Some(dashes) = dashes { line.set("stroke-dasharray", dashes) } else { line }.into()
}

/// A path through places, in hundredths of a pixel.
pub(crate) fn path(points: &[At], closed: bool) -> element::Path {
    let path: Vec<String> = points.iter().map(|(x, y)| format!("{x:.2} {y:.2}")).collect();
    element::Path::new().set("d", format!("M{}{}", path.join("L"), if closed { "Z" } else { "" }))
}

/// A disc with its outline.
pub(crate) fn circle((x, y): At, r: f64, inside: &str, outline: &str, width: f64) -> Element {
    let circle = element::Circle::new().set("cx", pixels(x)).set("cy", pixels(y)).set("r", r);
    circle.set("fill", inside).set("stroke", outline).set("stroke-width", width).into()
}

/// A length in hundredths of a pixel.
fn pixels(x: f64) -> String {
    let rounded = format!("{x:.2}");
    rounded.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// An empty sheet of this size with a title over `middle`.
pub(crate) fn sheet((width, height): At, title: &str, middle: f64) -> svg::Document {
    let size = fitting(title, TITLE, 2.0 * middle - 16.0);
    svg::Document::new()
        .set("width", width)
        .set("height", height)
        .set("font-family", "DejaVu Sans, Verdana, Liberation Sans, Arial, sans-serif")
        .set("fill", INK)
        .add(Rectangle::new().set("width", "100%").set("height", "100%").set("fill", "white"))
        .add(text(title, (middle, 20.0), size, Anchor::Middle))
}

/// A picture with its upper left corner at a place.
pub(crate) fn placed((x, y): At, picture: impl IntoIterator<Item = Element>) -> Group {
    let group = Group::new()
        .set("transform", format!("translate({x:.1},{y:.1})"))
        .set("stroke-linejoin", "round")
        .set("stroke-linecap", "round");
    picture.into_iter().fold(group, Group::add)
}

/// The file of a figure.
pub(crate) fn save(path: PathBuf, svg: &str) -> Result<(), PlotError> {
    fs::write(&path, svg).map_err(|source| PlotError::Io { path, source })
}
