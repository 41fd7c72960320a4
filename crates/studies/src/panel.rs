//! A pair of axes with lines on it.

use kuva::plot::annotations::ReferenceLine;
use kuva::prelude::{LinePlot, Plot, ScatterPlot};
use kuva::render::{
    layout::Layout,
    render::{Primitive, render_multiple},
};

use crate::{
    axis::{Axis, Room, layout},
    header::Header,
    plot::{self, At, INK, NAME, PlotError, color, fitting},
};

/// A pair of axes with lines on it.
#[derive(Clone, Debug)]
pub struct Panel {
    title: String,
    horizontal: String,
    vertical: String,
    unit: String,
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
        plot::check(&self.vertical, first.chain(levels), place, fits)
    }

    fn axes(&self) -> (Axis, Axis) {
        let points = || self.lines.iter().flat_map(|(_, points)| points);
        let levels = self.levels.iter().map(|(_, y)| *y);
        let x = points().map(|(x, _)| *x);
        let heights = points().map(|(_, y)| *y).chain(levels);
        let y = heights.map(|y| self.shown(y));
        let vertical = match self.floor {
            Some(_) => Axis::logarithmic(y),
            None => Axis::linear(y, 0.06, 5),
        };
        (Axis::linear(x, if self.equal { 0.03 } else { 0.0 }, 5), vertical)
    }

    pub(crate) fn header(&self, width: f64) -> Header<'_> {
        let labels = self.labels();
        let several = labels.len() > 1;
        let lines = labels.into_iter().enumerate().filter(|_| several);
        let lines = lines.map(|(k, label)| (label, color(k), false));
        let levels = self.levels.iter().filter(|(label, _)| !label.is_empty());
        let levels = levels.map(|(label, _)| (label.as_str(), INK, true));
        Header::of(&self.title, lines.chain(levels).collect(), width)
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

    /// The axes, their names and the levels, for `kuva`.
    pub(crate) fn layout(&self, frame: At) -> Layout {
        let (x, y) = self.axes();
        let vertical = y.label(&self.vertical, &self.unit);
        let mut layout = layout(&x, &y)
            .with_x_label(x.label(&self.horizontal, ""))
            .with_label_size(fitting(&vertical, NAME, frame.1 + 24.0))
            .with_y_label(vertical);
        for (_, level) in &self.levels {
            let line = ReferenceLine::horizontal(y.reading(self.shown(*level)));
            layout = layout.with_reference_line(line.with_color(INK).with_dasharray("5 4"));
        }
        layout.equal_aspect = self.equal;
        if self.equal {
            // The axis that `kuva` makes longer has room for the ticks of the other one, and few more.
            let step = layout.x_tick_step.into_iter().chain(layout.y_tick_step).fold(0.0, f64::max);
            (layout.x_tick_step, layout.y_tick_step) = (Some(2.0 * step), Some(2.0 * step));
        }
        layout
    }

    /// The lines, for `kuva`; a single point is a disc.
    fn plots(&self, stretches: usize) -> Vec<Plot> {
        let ((x, y), labels) = (self.axes(), self.labels());
        let plot = |(label, points): &(String, Vec<At>)| {
            let colour = color(labels.iter().position(|other| other == label).unwrap_or(0));
            let shown = thinned(points, stretches);
            let shown = shown.map(|(a, b)| (x.reading(a), y.reading(self.shown(b))));
            if points.len() == 1 {
                Plot::Scatter(ScatterPlot::new().with_data(shown).with_color(colour).with_size(4.0))
            } else {
                let line = LinePlot::new().with_data(shown).with_color(colour);
                Plot::Line(line.with_stroke_width(1.4))
            }
        };
        self.lines.iter().map(plot).collect()
    }

    /// The parts, with the upper left corner at the origin.
    pub(crate) fn parts(&self, letter: char, room: &Room, stretches: usize) -> Vec<Primitive> {
        let layout = room.around(self.layout(room.frame));
        let header = self.header(room.left + room.frame.0);
        let mut parts = render_multiple(self.plots(stretches), layout).elements;
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
