//! A pair of axes with lines on it.

use svg::node::element::Element;

use crate::axis::Axis;
use crate::frame::{Frame, Room};
use crate::header::Header;
use crate::map::Map;
use crate::plot::{self, At, INK, PlotError, circle, color, line};

/// A pair of axes with lines on it, or a map.
#[derive(Clone, Debug)]
pub struct Panel {
    title: String,
    horizontal: String,
    vertical: String,
    unit: String,
    map: Option<Map>,
    pub(crate) lines: Vec<(String, Vec<(f64, f64)>)>,
    levels: Vec<(String, f64)>,
    /// The lower end of a logarithmic axis.
    floor: Option<f64>,
    /// Whether a unit has the same length on both axes.
    equal: bool,
}

impl Panel {
    /// A panel with the quantity on its vertical axis and the name of its horizontal axis.
    #[must_use]
    pub fn new(quantity: impl Into<String>, horizontal: impl Into<String>) -> Self {
        Self {
            title: String::new(),
            horizontal: horizontal.into(),
            vertical: quantity.into(),
            unit: String::new(),
            map: None,
            lines: Vec::new(),
            levels: Vec::new(),
            floor: None,
            equal: false,
        }
    }

    /// Puts a title above the panel, where the quantity does not say enough.
    #[must_use]
    pub fn title(mut self, title: impl Into<String>) -> Self {
        self.title = title.into();
        self
    }

    /// Names the unit of the vertical axis.
    #[must_use]
    pub fn unit(mut self, unit: impl Into<String>) -> Self {
        self.unit = unit.into();
        self
    }

    /// Adds a line through points `(x, y)`. The labels make a legend as soon as there are two; lines
    /// with the same label share their colour.
    #[must_use]
    pub fn line(mut self, label: impl Into<String>, points: impl AsRef<[(f64, f64)]>) -> Self {
        self.lines.push((label.into(), points.as_ref().to_vec()));
        self
    }

    /// Puts a map on the axes, under the lines.
    #[must_use]
    pub fn map(self, map: Map) -> Self {
        Self { map: Some(map), ..self }
    }

    /// Adds a dashed line at height `y`.
    #[must_use]
    pub fn level(self, y: f64) -> Self {
        self.named_level("", y)
    }

    /// Adds a dashed line at height `y` with an entry in the legend.
    #[must_use]
    pub fn named_level(mut self, label: impl Into<String>, y: f64) -> Self {
        self.levels.push((label.into(), y));
        self
    }

    /// Makes the vertical axis logarithmic, for numbers `≥ 0`; what is below `floor` is drawn there,
    /// since zero has no logarithm.
    #[must_use]
    pub fn logarithmic(mut self, floor: f64) -> Self {
        self.floor = Some(floor);
        self
    }

    /// Gives a unit the same length on both axes, for curves in a plane.
    #[must_use]
    pub fn equal(mut self) -> Self {
        self.equal = true;
        self
    }

    /// Where a number is drawn.
    fn shown(&self, y: f64) -> f64 {
        self.floor.map_or(y, |floor| y.max(floor))
    }

    /// Whether every point has a place on the axes.
    pub(crate) fn check(&self) -> Result<(), PlotError> {
        let least = if self.floor.is_some() { 0.0 } else { f64::NEG_INFINITY };
        let place = if self.floor.is_some() { "a logarithmic axis" } else { "an axis" };
        let fits = |point: &[f64]| point.iter().all(|x| x.abs() < 1e300) && point[1] >= least;
        for (label, points) in &self.lines {
            plot::check(label, points.iter().map(|&(x, y)| [x, y]), place, fits)?;
        }
        let levels = self.levels.iter().map(|(_, y)| [0.0, *y]);
        let first = self.lines.iter().map(|(_, points)| [0.0, points[0].1]).take(1);
        let map = self.map.iter().flat_map(Map::corners).map(|(x, y)| [x, y]);
        plot::check(&self.vertical, first.chain(levels).chain(map), place, fits)
    }

    /// The axes of a frame of this size.
    pub(crate) fn axes(&self, frame: At) -> [Axis; 2] {
        let lines = || self.lines.iter().flat_map(|(_, points)| points).copied();
        let points = || lines().chain(self.map.iter().flat_map(Map::corners));
        let levels = self.levels.iter().map(|(_, y)| *y);
        let x = points().map(|(x, _)| x);
        let heights = points().map(|(_, y)| y).chain(levels);
        let y = heights.map(|y| self.shown(y));
        let vertical = match self.floor {
            Some(_) => Axis::logarithmic(y),
            None => Axis::linear(y, if self.map.is_some() { 0.0 } else { 0.06 }, 5),
        };
        let axes = [Axis::linear(x, if self.equal { 0.03 } else { 0.0 }, 5), vertical];
        if self.equal { Axis::equal(axes, frame) } else { axes }
    }

    pub(crate) fn header(&self, width: f64) -> Header<'_> {
        let labels = self.labels();
        let several = labels.len() > 1;
        let lines = labels.into_iter().enumerate().filter(|_| several);
        let lines = lines.map(|(k, label)| (label, color(k), false));
        let levels = self.levels.iter().filter(|(label, _)| !label.is_empty());
        let levels = levels.map(|(label, _)| (label.as_str(), INK, true));
        let map = self.map.iter().flat_map(Map::legend).map(|(label, color)| (label, color, false));
        Header::of(&self.title, map.chain(lines).chain(levels).collect(), width)
    }

    /// The labels of the lines, each once.
    pub(crate) fn labels(&self) -> Vec<&str> {
        let mut labels: Vec<&str> = Vec::new();
        for (label, _) in &self.lines {
            if !labels.contains(&label.as_str()) {
                labels.push(label);
            }
        }
        labels
    }

    /// The parts, with the upper left corner at the origin; a line of one point is a disc.
    pub(crate) fn parts(&self, letter: char, room: &Room, stretches: usize) -> Vec<Element> {
        let [x, y] = self.axes(room.frame);
        let names = [x.label(&self.horizontal, ""), y.label(&self.vertical, &self.unit)];
        let frame = Frame { room, x, y };
        let mut parts = frame.parts([&names[0], &names[1]]);
        parts.extend(self.map.iter().flat_map(|map| map.parts(&frame)));
        let labels = self.labels();
        for (label, points) in &self.lines {
            let colour = color(labels.iter().position(|other| other == label).unwrap_or(0));
            let mut places = thinned(points, stretches).map(|(a, b)| frame.at((a, self.shown(b))));
            parts.push(match (places.next(), points.len()) {
                (Some(place), 1) => circle(place, 4.0, colour, colour, 0.0),
                (first, _) => line(first.into_iter().chain(places), colour, 1.4, None),
            });
        }
        parts.extend(self.levels.iter().map(|(_, y)| frame.level(self.shown(*y), INK)));
        let header = self.header(room.left + room.frame.0);
        parts.extend(header.parts(letter, (4.0, room.top - header.height)));
        parts
    }
}

/// The lowest and the highest point of each of so many stretches, in their order, and the two ends: a
/// spike stays, whatever is left out around it.
pub(crate) fn thinned(points: &[At], stretches: usize) -> impl Iterator<Item = At> {
    let short = points.len() <= 2 * stretches;
    let length = if short { 1 } else { points.len().div_ceil(stretches) };
    let extremes = |stretch: &[At]| {
        let by = |&i: &usize, &j: &usize| stretch[i].1.total_cmp(&stretch[j].1);
        let (low, high) = ((0..stretch.len()).min_by(by), (0..stretch.len()).max_by(by));
        [low.min(high), low.max(high)].into_iter().flatten().map(|i| stretch[i]).collect::<Vec<_>>()
    };
    let inner = points.chunks(length).flat_map(extremes);
    points.first().copied().into_iter().chain(inner).chain(points.last().copied())
}
