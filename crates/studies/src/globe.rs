//! Curves on the unit sphere.

use std::f64::consts::{FRAC_PI_6, TAU};

use nalgebra::Vector3;
use svg::node::element::{Element, Group};

use crate::{
    header::{Entry, Header},
    plot::{self, Anchor, At, GREY, INK, NAME, PlotError, circle, color, line, text},
};

/// How far from 1 the norm of a point may be: what an integrator that leaves the sphere makes of it
/// is still shown, at the place nearest to it.
const SLACK: f64 = 0.05;
/// Room around the disc for the ends of the axes and their names.
const MARGIN: f64 = 40.0;
/// The diameter of the disc, from beside a low grid to beside a high one.
const DISC: At = (300.0, 440.0);
/// How far the axes stick out of the sphere, and their names out of the axes, in pixels.
const AXIS: [f64; 2] = [22.0, 10.0];
/// Points of a circle of the graticule.
const FINE: u8 = 120;

const SURFACE: &str = "#F7F9FB";
const GRATICULE: &str = "#DADEE2";

type Vector = Vector3<f64>;

/// The unit sphere with curves on it, seen from far away: the orthographic projection
///
/// ```text
/// x ↦ (x·r, x·u),   r ∝ e₃ × f,   u = f × r,   f the direction of the viewer,
/// ```
///
/// where `x·f ≥ 0` is the side in front. What lies behind is thin and pale. The axis `e₃` points up,
/// meridians and parallels are 30° apart.
///
/// # Examples
///
/// ```
/// use metriplectic_studies::{Globe, Panels};
///
/// let spiral = (0..=400).map(f64::from).map(|n| {
///     let (height, turn) = (n / 200.0 - 1.0, 0.1 * n);
///     let width = (1.0 - height * height).sqrt();
///     [width * turn.cos(), width * turn.sin(), height]
/// });
/// let globe = Globe::new("from pole to pole").seen_from([1.0, 0.2, 0.4]).curve("spiral", spiral);
/// let svg = Panels::new("A spiral").globe(globe).svg()?;
/// assert!(svg.contains("<circle"));
/// # Ok::<(), metriplectic_studies::PlotError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Globe {
    title: String,
    viewer: Vector,
    curves: Vec<(String, Vec<Vector>)>,
    levels: Vec<(String, Vec<Vector>)>,
}

impl Globe {
    /// A sphere with a title, seen from the octant where all coordinates are positive.
    #[must_use]
    pub fn new(title: impl Into<String>) -> Self {
        let viewer = Vector::new(0.72, 0.52, 0.46);
        Self { title: title.into(), viewer, curves: Vec::new(), levels: Vec::new() }
    }

    /// Puts the viewer in this direction, which need not be a unit vector.
    #[must_use]
    pub fn seen_from(mut self, viewer: impl Into<[f64; 3]>) -> Self {
        self.viewer = viewer.into().into();
        self
    }

    /// Adds a curve through points of the sphere, with a hollow disc at its start and a filled one at
    /// its end. The labels make a legend as soon as there are two.
    #[must_use]
    pub fn curve(
        mut self,
        label: impl Into<String>,
        points: impl IntoIterator<Item = impl Into<[f64; 3]>>,
    ) -> Self {
        self.curves.push((label.into(), entries(points)));
        self
    }

    /// Adds a level set, or any other curve for orientation: grey, under the others. Consecutive ones
    /// with the same label share their entry in the legend.
    #[must_use]
    pub fn level(
        mut self,
        label: impl Into<String>,
        points: impl IntoIterator<Item = impl Into<[f64; 3]>>,
    ) -> Self {
        self.levels.push((label.into(), entries(points)));
        self
    }

    /// Width and height beside a grid of this height.
    pub(crate) fn size(&self, height: f64) -> At {
        let room = height - self.header(height).height - 2.0 * MARGIN;
        let width = room.clamp(DISC.0, DISC.1) + 2.0 * MARGIN;
        (width, width + self.header(width).height)
    }

    pub(crate) fn check(&self) -> Result<(), PlotError> {
        let on = |x: &[f64]| (Vector::from_column_slice(x).norm() - 1.0).abs() <= SLACK;
        for (label, points) in self.curves.iter().chain(&self.levels) {
            plot::check(label, points.iter().map(|x| x.as_slice()), "the unit sphere", on)?;
        }
        let viewers = (!self.curves.is_empty() || !self.levels.is_empty()).then_some(self.viewer);
        let somewhere = |x: &[f64]| Vector::from_column_slice(x).norm().is_normal();
        let viewers = viewers.iter().map(|x| x.as_slice());
        plot::check(&self.title, viewers, "a direction", somewhere)
    }

    /// The parts of a globe of this size, with its upper left corner at the origin.
    pub(crate) fn parts(&self, letter: char, (width, height): At) -> Vec<Element> {
        let centre = (0.5 * width, height - 0.5 * width);
        let radius = 0.5 * width - MARGIN;
        let view = View::from(self.viewer, centre, radius);
        let curves = || self.curves.iter().enumerate().map(|(k, (_, x))| (x, color(k)));
        let levels = || self.levels.iter().map(|(_, x)| (x, GREY));
        let ends = |front| {
            let ends = curves()
                .flat_map(|(x, color)| [(x[0], color, SURFACE), (x[x.len() - 1], color, color)]);
            let there = ends.filter(move |(x, ..)| view.front(x) == front);
            there
                .map(|(x, color, inside)| circle(view.at(&x), 4.0, inside, color, 1.4))
                .collect::<Vec<_>>()
        };
        let mut parts = vec![circle(centre, radius, SURFACE, GREY, 0.9)];
        // What lies behind is pale.
        let behind =
            levels().chain(curves()).flat_map(|(x, color)| view.lines(x, false, color, 0.9));
        let pale = Group::new().set("opacity", 0.35);
        parts.push(behind.chain(ends(false)).fold(pale, Group::add).into());
        for x in &graticule() {
            parts.extend(view.lines(x, true, GRATICULE, 0.6));
        }
        parts.push(circle(centre, radius, "none", GREY, 0.9));
        parts.extend(view.axes());
        for (x, color) in levels() {
            parts.extend(view.lines(x, true, color, 1.0));
        }
        for (x, color) in curves() {
            parts.extend(view.lines(x, true, color, 1.6));
        }
        parts.extend(ends(true));
        parts.extend(self.header(width).parts(letter, (4.0, 0.0)));
        parts
    }

    fn header(&self, width: f64) -> Header<'_> {
        let curves = self.curves.iter().enumerate();
        let mut entries: Vec<Entry<'_>> =
            curves.map(|(k, (label, _))| (label.as_str(), color(k), false)).collect();
        let mut levels: Vec<_> = self.levels.iter().map(|(label, _)| label.as_str()).collect();
        levels.dedup();
        entries.extend(levels.into_iter().map(|label| (label, GREY, false)));
        entries.truncate(if entries.len() > 1 { entries.len() } else { 0 });
        Header::of(&self.title, entries, width)
    }
}

/// Where the points of the sphere are on the sheet.
#[derive(Clone, Copy)]
struct View {
    right: Vector,
    up: Vector,
    forward: Vector,
    centre: At,
    radius: f64,
}

impl View {
    fn from(viewer: Vector, centre: At, radius: f64) -> Self {
        let forward = viewer.normalize();
        // From above a pole the second axis points to the right.
        let level = Vector::z().cross(&forward);
        let right = level.try_normalize(1e-6).unwrap_or_else(Vector::y);
        Self { right, up: forward.cross(&right), forward, centre, radius }
    }

    /// Whether the viewer is on this side of a point.
    fn front(&self, x: &Vector) -> bool {
        x.dot(&self.forward) >= 0.0
    }

    fn at(&self, x: &Vector) -> At {
        let (x, y) = (x.dot(&self.right), x.dot(&self.up));
        (self.centre.0 + self.radius * x, self.centre.1 - self.radius * y)
    }

    /// The parts of a curve on one side, each up to the limb.
    fn paths(&self, points: &[Vector], front: bool) -> Vec<Vec<Vector>> {
        let mut paths = vec![Vec::new()];
        let mut before: Option<Vector> = None;
        for x in points.iter().map(Vector::normalize) {
            if let Some(y) = before.filter(|y| self.front(y) != self.front(&x)) {
                // Where the path passes from one side to the other.
                let [a, b] = [y, x].map(|x| x.dot(&self.forward));
                let limb = (y + (x - y) * (a / (a - b))).normalize();
                if self.front(&x) == front {
                    paths.push(vec![limb]);
                } else if let Some(path) = paths.last_mut() {
                    path.push(limb);
                }
            }
            if let Some(path) = paths.last_mut().filter(|_| self.front(&x) == front) {
                path.push(x);
            }
            before = Some(x);
        }
        paths.retain(|path| path.len() > 1);
        paths
    }

    /// The parts of a curve on one side, as lines.
    fn lines(&self, points: &[Vector], front: bool, color: &str, width: f64) -> Vec<Element> {
        let line = |path: &Vec<Vector>| line(path.iter().map(|x| self.at(x)), color, width, None);
        self.paths(points, front).iter().map(line).collect()
    }

    /// The ends of the coordinate axes that stick out of the sphere.
    fn axes(&self) -> Vec<Element> {
        let mut parts = Vec::new();
        let tip = 1.0 + AXIS[0] / self.radius;
        for (axis, name) in [(Vector::x(), "x₁"), (Vector::y(), "x₂"), (Vector::z(), "x₃")] {
            let across = axis.dot(&self.right).hypot(axis.dot(&self.up));
            // Behind the sphere an axis begins where the disc does not cover it.
            let start = if self.front(&axis) { 1.0 } else { across.recip() };
            if start < tip {
                let ends = [self.at(&(axis * start)), self.at(&(axis * tip))];
                let beside = tip + AXIS[1] / (self.radius * across.max(1e-3));
                parts.push(line(ends, INK, 1.0, None));
                parts.push(text(name, self.at(&(axis * beside)), NAME, Anchor::Middle).into());
            }
        }
        parts
    }
}

/// Meridians and parallels, 30° apart.
fn graticule() -> Vec<Vec<Vector>> {
    let point = |latitude: f64, longitude: f64| {
        let (height, width) = latitude.sin_cos();
        Vector::new(width * longitude.cos(), width * longitude.sin(), height)
    };
    let turn = |n: u8| TAU * f64::from(n) / f64::from(FINE);
    let turns = || (0..=FINE).map(turn);
    let at = |k: i8| FRAC_PI_6 * f64::from(k);
    let meridians = (0..6).map(|k| turns().map(|t| point(t, at(k))).collect());
    let parallels = (-2..=2).map(|k| turns().map(|t| point(at(k), t)).collect());
    meridians.chain(parallels).collect()
}

fn entries(points: impl IntoIterator<Item = impl Into<[f64; 3]>>) -> Vec<Vector> {
    points.into_iter().map(|x| Vector::from(x.into())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Panels;

    fn equator() -> Vec<Vector> {
        (0..=360)
            .map(|k| f64::from(k).to_radians())
            .map(|t| Vector::new(t.cos(), t.sin(), 0.0))
            .collect()
    }

    fn view(viewer: [f64; 3]) -> View {
        View::from(viewer.into(), (0.0, 0.0), 1.0)
    }

    #[test]
    fn the_third_axis_points_up_and_the_frame_is_right_handed() {
        let view = view([1.0, 0.0, 0.0]);
        assert_eq!(view.at(&Vector::z()), (0.0, -1.0));
        assert_eq!(view.at(&Vector::y()), (1.0, 0.0));
        assert!(view.front(&Vector::x()) && !view.front(&-Vector::x()));
        let above = View::from(Vector::z() * 2.0, (0.0, 0.0), 1.0);
        assert_eq!(above.at(&Vector::y()), (1.0, 0.0));
    }

    #[test]
    fn a_curve_is_cut_at_the_limb_into_arcs_that_make_it_up() {
        let view = view([1.0, 2.0, 0.5]);
        let (front, back) = (view.paths(&equator(), true), view.paths(&equator(), false));
        // The curve starts in front: behind it is one path, in front the two ends of it.
        assert_eq!((front.len(), back.len()), (2, 1));
        for path in &back {
            assert!(path.iter().all(|x| x.dot(&view.forward) < 1e-12));
            for end in [path[0], path[path.len() - 1]] {
                let (x, y) = view.at(&end);
                assert!((x.hypot(y) - 1.0).abs() < 1e-12);
            }
        }
        let length = |paths: &[Vec<Vector>]| -> f64 {
            paths
                .iter()
                .flat_map(|path| path.windows(2))
                .map(|pair| (pair[0] - pair[1]).norm())
                .sum()
        };
        assert!((length(&front) + length(&back) - TAU).abs() < 1e-3);
        assert!((length(&back) - 0.5 * TAU).abs() < 1e-3);
    }

    #[test]
    fn the_same_bytes_every_time_and_small() {
        let circle = || (0..6000).map(|n| 1e-3 * f64::from(n)).map(|t| [t.cos(), t.sin(), 0.0]);
        let globe = || Globe::new("globe").curve("a", circle()).level("b", equator());
        let figure = || Panels::new("title").globe(globe()).svg().unwrap();
        assert_eq!(figure(), figure());
        assert!(figure().len() < 60_000, "{} bytes", figure().len());
    }

    #[test]
    fn levels_of_one_name_share_their_entry() {
        let one = Globe::new("globe").level("H", equator()).level("H", equator());
        assert_eq!(one.header(400.0).entries.len(), 0);
        assert_eq!(one.clone().curve("x", equator()).header(400.0).entries.len(), 2);
        let svg = Panels::new("").globe(one.curve("x", equator())).svg().unwrap();
        assert_eq!(svg.matches(">H<").count(), 1);
    }

    #[test]
    fn what_is_not_on_the_sphere_is_named() {
        let error = |globe| Panels::new("title").globe(globe).svg().unwrap_err();
        let globe = || Globe::new("globe");
        assert!(matches!(error(globe()), PlotError::Empty { name } if name == "globe"));
        let none: [[f64; 3]; 0] = [];
        assert!(
            matches!(error(globe().curve("c", none)), PlotError::Empty { name } if name == "c")
        );
        let off = error(globe().curve("c", [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]));
        assert!(matches!(off, PlotError::Point { index: 1, .. }), "{off}");
        let nan = error(globe().level("l", [[f64::NAN, 0.0, 0.0]]));
        assert!(matches!(nan, PlotError::Point { index: 0, .. }), "{nan}");
        let nowhere = error(globe().curve("c", equator()).seen_from([0.0; 3]));
        assert!(matches!(nowhere, PlotError::Point { .. }), "{nowhere}");
    }
}
