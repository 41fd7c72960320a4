//! Markers of points.

use std::f64::consts::{FRAC_PI_2, TAU};

use svg::node::element::Element;

use crate::plot::{At, circle, path};

/// A marker around a place, filled or hollow: shapes that differ, for those who cannot go by colour.
pub(crate) fn marker(line: usize, at: At, size: f64, color: &str, filled: bool) -> Element {
    let inside = if filled { color } else { "none" };
    // The number of corners, the direction of the first one in quarters of a turn, and the radius.
    let (corners, first, radius) = match line % 6 {
        0 => return circle(at, size, inside, color, 1.2),
        1 => (4_u8, 0.5, 1.35),
        2 => (3, -1.0, 1.35),
        3 => (4, 0.0, 1.35),
        4 => (5, -1.0, 1.2),
        _ => (3, 1.0, 1.35),
    };
    let corner = |k| {
        let angle = FRAC_PI_2 * first + TAU * f64::from(k) / f64::from(corners);
        (at.0 + radius * size * angle.cos(), at.1 + radius * size * angle.sin())
    };
    let outline = path(&(0..corners).map(corner).collect::<Vec<_>>(), true);
    outline.set("fill", inside).set("stroke", color).set("stroke-width", 1.0).into()
}
