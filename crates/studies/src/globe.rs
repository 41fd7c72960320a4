//! Curves on the unit sphere.

use std::f64::consts::{FRAC_PI_6, TAU};

use kuva::render::render::{Primitive, TextAnchor};

use crate::{
    header::{Entry, Header},
    plot::{At, GREY, INK, NAME, PlotError, color, line, text},
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

type Vector = [f64; 3];

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
        let viewer = [0.72, 0.52, 0.46];
        Self { title: title.into(), viewer, curves: Vec::new(), levels: Vec::new() }
    }

    /// Puts the viewer in this direction, which need not be a unit vector.
    #[must_use]
    pub fn seen_from(mut self, viewer: impl Into<[f64; 3]>) -> Self {
        self.viewer = viewer.into();
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
        self.curves.push((label.into(), points.into_iter().map(Into::into).collect()));
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
        self.levels.push((label.into(), points.into_iter().map(Into::into).collect()));
        self
    }

    /// Width and height beside a grid of this height.
    pub(crate) fn size(&self, height: f64) -> At {
        let room = height - self.header(height).height - 2.0 * MARGIN;
        let width = room.clamp(DISC.0, DISC.1) + 2.0 * MARGIN;
        (width, width + self.header(width).height)
    }

    pub(crate) fn check(&self) -> Result<(), PlotError> {
        if self.curves.is_empty() && self.levels.is_empty() {
            return Err(PlotError::Empty { name: self.title.clone() });
        }
        let off = |name: &str, index, point: &Vector| {
            let (name, point) = (name.to_owned(), point.to_vec());
            PlotError::Point { name, index, point, place: "the unit sphere" }
        };
        for (label, points) in self.curves.iter().chain(&self.levels) {
            if points.is_empty() {
                return Err(PlotError::Empty { name: label.clone() });
            }
            let on = |x: &Vector| (norm(x) - 1.0).abs() <= SLACK;
            if let Some(index) = points.iter().position(|x| !on(x)) {
                return Err(off(label, index, &points[index]));
            }
        }
        let far = norm(&self.viewer);
        if far.is_normal() { Ok(()) } else { Err(off("the viewer", 0, &self.viewer)) }
    }

    /// The parts of a globe of this size, with its upper left corner at the origin.
    pub(crate) fn parts(&self, letter: char, (width, height): At) -> Vec<Primitive> {
        let centre = (0.5 * width, height - 0.5 * width);
        let radius = 0.5 * width - MARGIN;
        let view = View::from(self.viewer, centre, radius);
        let curves = || self.curves.iter().enumerate().map(|(k, (_, x))| (x, color(k)));
        let mut parts = vec![circle(centre, radius, SURFACE, GREY, 0.9)];
        for (_, x) in &self.levels {
            parts.extend(view.lines(x, Side::Back, &faded(GREY), 0.7));
        }
        for (x, color) in curves() {
            parts.extend(view.lines(x, Side::Back, &faded(color), 0.9));
        }
        for x in &graticule() {
            parts.extend(view.lines(x, Side::Front, GRATICULE, 0.6));
        }
        parts.push(circle(centre, radius, "none", GREY, 0.9));
        parts.extend(view.axes());
        for (_, x) in &self.levels {
            parts.extend(view.lines(x, Side::Front, GREY, 1.0));
        }
        for (x, color) in curves() {
            parts.extend(view.lines(x, Side::Front, color, 1.6));
        }
        parts.extend(curves().flat_map(|(x, color)| view.ends(x, color)));
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

/// A side of the sphere, as the viewer has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Front,
    Back,
}

/// Where the points of the sphere are on the sheet.
struct View {
    right: Vector,
    up: Vector,
    forward: Vector,
    centre: At,
    radius: f64,
}

impl View {
    fn from(viewer: Vector, centre: At, radius: f64) -> Self {
        let forward = unit(viewer);
        // From above a pole the second axis points to the right.
        let level = [-forward[1], forward[0], 0.0];
        let right = if norm(&level) > 1e-6 { unit(level) } else { [0.0, 1.0, 0.0] };
        Self { right, up: cross(&forward, &right), forward, centre, radius }
    }

    fn depth(&self, x: &Vector) -> f64 {
        dot(x, &self.forward)
    }

    fn side(&self, x: &Vector) -> Side {
        if self.depth(x) >= 0.0 { Side::Front } else { Side::Back }
    }

    fn at(&self, x: &Vector) -> At {
        let (x, y) = (dot(x, &self.right), dot(x, &self.up));
        (self.centre.0 + self.radius * x, self.centre.1 - self.radius * y)
    }

    /// The parts of a curve on one side, each up to the limb.
    fn paths(&self, points: &[Vector], side: Side) -> Vec<Vec<Vector>> {
        let (mut paths, mut path): (Vec<_>, Vec<Vector>) = (Vec::new(), Vec::new());
        let mut before: Option<Vector> = None;
        for x in points.iter().copied().map(unit) {
            if let Some(before) = before
                && self.side(&before) != self.side(&x)
            {
                path.push(self.limb(&before, &x));
            }
            if self.side(&x) == side {
                path.push(x);
            } else {
                paths.push(std::mem::take(&mut path));
            }
            before = Some(x);
        }
        paths.push(path);
        paths.retain(|path| path.len() > 1);
        paths
    }

    /// Where the path from `x` to `y` passes from one side to the other.
    fn limb(&self, x: &Vector, y: &Vector) -> Vector {
        let t = self.depth(x) / (self.depth(x) - self.depth(y));
        unit([0, 1, 2].map(|i| x[i] + t * (y[i] - x[i])))
    }

    /// The parts of a curve on one side, as lines.
    fn lines(
        &self,
        points: &[Vector],
        side: Side,
        color: &str,
        width: f64,
    ) -> impl Iterator<Item = Primitive> {
        let paths = self.paths(points, side).into_iter();
        paths.map(move |path| line(path.iter().map(|x| self.at(x)).collect(), color, width, None))
    }

    /// A hollow disc at the start of a curve and a filled one at its end.
    fn ends(&self, points: &[Vector], color: &str) -> Vec<Primitive> {
        let mark = |x: Vector, filled: bool| {
            let front = self.side(&x) == Side::Front;
            let color = if front { color.to_owned() } else { faded(color) };
            circle(self.at(&x), 4.0, if filled { &color } else { SURFACE }, &color, 1.4)
        };
        let start = points.first().map(|x| mark(unit(*x), false));
        start.into_iter().chain(points.last().map(|x| mark(unit(*x), true))).collect()
    }

    /// The ends of the coordinate axes that stick out of the sphere.
    fn axes(&self) -> Vec<Primitive> {
        let mut parts = Vec::new();
        let tip = 1.0 + AXIS[0] / self.radius;
        for (i, name) in ["x₁", "x₂", "x₃"].into_iter().enumerate() {
            let axis = |length: f64| [0, 1, 2].map(|j| if i == j { length } else { 0.0 });
            let across = self.distance(self.at(&axis(1.0)));
            // Behind the sphere an axis begins where the disc does not cover it.
            let start = if self.side(&axis(1.0)) == Side::Front { 1.0 } else { across.recip() };
            if start < tip {
                parts.push(line(vec![self.at(&axis(start)), self.at(&axis(tip))], INK, 1.0, None));
                let name_at = self.at(&axis(tip + AXIS[1] / (self.radius * across.max(1e-3))));
                parts.push(text(name, name_at, NAME, TextAnchor::Middle));
            }
        }
        parts
    }

    /// The distance from the centre of the disc, in radii.
    fn distance(&self, (x, y): At) -> f64 {
        (x - self.centre.0).hypot(y - self.centre.1) / self.radius
    }
}

/// A disc with its outline.
fn circle((cx, cy): At, r: f64, inside: &str, outline: &str, width: f64) -> Primitive {
    let (fill, stroke, stroke_width) = (inside.into(), Some(outline.into()), Some(width));
    Primitive::Circle { cx, cy, r, fill, fill_opacity: None, stroke, stroke_width }
}

/// Meridians and parallels, 30° apart.
fn graticule() -> Vec<Vec<Vector>> {
    let point = |latitude: f64, longitude: f64| {
        let width = latitude.cos();
        [width * longitude.cos(), width * longitude.sin(), latitude.sin()]
    };
    let turn = |k: u8| TAU * f64::from(k) / f64::from(FINE);
    let meridian = |k: u8| {
        let longitude = FRAC_PI_6 * f64::from(k);
        (0..=FINE).map(|n| point(turn(n), longitude)).collect()
    };
    let parallel = |k: i8| {
        let latitude = FRAC_PI_6 * f64::from(k);
        (0..=FINE).map(|n| point(latitude, turn(n))).collect()
    };
    (0..6).map(meridian).chain((-2..=2).map(parallel)).collect()
}

/// Two thirds of the way to the colour of the surface.
fn faded(color: &str) -> String {
    let part = |text: &str, k: usize| {
        let digits = text.get(2 * k + 1..2 * k + 3).unwrap_or("0");
        u32::from_str_radix(digits, 16).unwrap_or(0)
    };
    let mixed = [0, 1, 2].map(|k| (part(color, k) + 2 * part(SURFACE, k)) / 3);
    format!("#{:02X}{:02X}{:02X}", mixed[0], mixed[1], mixed[2])
}

fn dot(a: &Vector, b: &Vector) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn cross(a: &Vector, b: &Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn norm(x: &Vector) -> f64 {
    dot(x, x).sqrt()
}

fn unit(x: Vector) -> Vector {
    x.map(|entry| entry / norm(&x))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Panels;

    fn equator() -> Vec<Vector> {
        (0..=360).map(|k| f64::from(k).to_radians()).map(|t| [t.cos(), t.sin(), 0.0]).collect()
    }

    fn view(viewer: Vector) -> View {
        View::from(viewer, (0.0, 0.0), 1.0)
    }

    #[test]
    fn the_third_axis_points_up_and_the_frame_is_right_handed() {
        let view = view([1.0, 0.0, 0.0]);
        assert_eq!(view.at(&[0.0, 0.0, 1.0]), (0.0, -1.0));
        assert_eq!(view.at(&[0.0, 1.0, 0.0]), (1.0, 0.0));
        assert_eq!(view.side(&[1.0, 0.0, 0.0]), Side::Front);
        assert_eq!(view.side(&[-1.0, 0.0, 0.0]), Side::Back);
        let above = View::from([0.0, 0.0, 2.0], (0.0, 0.0), 1.0);
        assert_eq!(above.at(&[0.0, 1.0, 0.0]), (1.0, 0.0));
    }

    #[test]
    fn a_curve_is_cut_at_the_limb_into_arcs_that_make_it_up() {
        let view = view([1.0, 2.0, 0.5]);
        let (front, back) =
            (view.paths(&equator(), Side::Front), view.paths(&equator(), Side::Back));
        // The curve starts in front: behind it is one path, in front the two ends of it.
        assert_eq!((front.len(), back.len()), (2, 1));
        for path in &back {
            assert!(path.iter().all(|x| view.depth(x) < 1e-12));
            for end in [path[0], path[path.len() - 1]] {
                assert!((view.distance(view.at(&end)) - 1.0).abs() < 1e-12);
            }
        }
        let length = |paths: &[Vec<Vector>]| -> f64 {
            let step = |x: &Vector, y: &Vector| norm(&[0, 1, 2].map(|i| x[i] - y[i]));
            paths.iter().flat_map(|path| path.windows(2)).map(|pair| step(&pair[0], &pair[1])).sum()
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
        let none: [Vector; 0] = [];
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
