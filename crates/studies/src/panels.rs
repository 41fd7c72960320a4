//! A grid of panels with lines, and globes beside it.

use std::path::PathBuf;

use kuva::plot::annotations::ReferenceLine;
use kuva::prelude::{LinePlot, Plot, ScatterPlot};
use kuva::render::{
    layout::{ComputedLayout, Layout},
    render::{Primitive, render_multiple},
};

use crate::{
    axis::{Axis, Range, layout},
    globe::Globe,
    header::Header,
    plot::{self, At, INK, NAME, PlotError, color, fitting},
};

/// Stretches of a line of which the lowest and the highest point are drawn, at most.
const STRETCHES: usize = 700;
/// Stretches of all lines of a figure: what keeps its file below some 300 kB.
const ALL_STRETCHES: usize = 12_000;

/// Room around the sheet, for the title, to the right of a panel, and for the numbers and the name below it.
const EDGE: f64 = 8.0;
const HEAD: f64 = 36.0;
const RIGHT: f64 = 16.0;
const BELOW: f64 = 42.0;

/// A figure of panels in a grid, with globes to the left of it. Each has a letter.
///
/// # Examples
///
/// ```
/// use metriplectic_studies::{Panel, Panels};
///
/// let energy: Vec<(f64, f64)> =
///     (0..100).map(f64::from).map(|t| (t, 2.2e-16 * t.sin())).collect();
/// let svg = Panels::new("A free rigid body")
///     .panel(Panel::new("energy H − H₀", "t").line("Weyl midpoint", &energy).level(0.0))
///     .svg()?;
/// assert!(svg.contains("energy H − H₀ (10⁻¹⁶)"));
/// # Ok::<(), metriplectic_studies::PlotError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Panels {
    title: String,
    columns: Option<usize>,
    globes: Vec<Globe>,
    panels: Vec<Panel>,
}

/// A pair of axes with lines on it.
#[derive(Clone, Debug)]
pub struct Panel {
    title: String,
    horizontal: String,
    vertical: String,
    unit: String,
    lines: Vec<(String, Vec<(f64, f64)>)>,
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
    fn check(&self) -> Result<(), PlotError> {
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
        let x: Range = points().map(|(x, _)| *x).collect();
        let heights = points().map(|(_, y)| *y).chain(levels);
        let y: Range = heights.map(|y| self.shown(y)).collect();
        let vertical = match self.floor {
            Some(_) => Axis::logarithmic(y),
            None => Axis::linear(y, 0.06, 5),
        };
        (Axis::linear(x, if self.equal { 0.03 } else { 0.0 }, 5), vertical)
    }

    fn header(&self, width: f64) -> Header<'_> {
        let labels = self.labels();
        let several = labels.len() > 1;
        let lines = labels.into_iter().enumerate().filter(|_| several);
        let lines = lines.map(|(k, label)| (label, color(k), false));
        let levels = self.levels.iter().filter(|(label, _)| !label.is_empty());
        let levels = levels.map(|(label, _)| (label.as_str(), INK, true));
        Header::of(&self.title, lines.chain(levels).collect(), width)
    }

    /// The labels of the lines, each once.
    fn labels(&self) -> Vec<&str> {
        let mut labels: Vec<&str> = Vec::new();
        for (label, _) in &self.lines {
            if !labels.contains(&label.as_str()) {
                labels.push(label);
            }
        }
        labels
    }

    /// The axes, their names and the levels, for `kuva`.
    fn layout(&self, frame: At) -> Layout {
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
    fn parts(&self, letter: char, room: &Room, stretches: usize) -> Vec<Primitive> {
        let &Room { frame, left, top } = room;
        let mut layout =
            self.layout(frame).with_force_margins(left, RIGHT).with_force_margins_y(top, BELOW);
        (layout.width, layout.height) = (Some(left + frame.0 + RIGHT), Some(top + frame.1 + BELOW));
        let header = self.header(left + frame.0);
        let mut parts = render_multiple(self.plots(stretches), layout).elements;
        parts.extend(header.parts(letter, (4.0, top - header.height)));
        parts
    }
}

/// The size of a frame, with the room to the left of it and above it.
struct Room {
    frame: At,
    left: f64,
    top: f64,
}

impl Panels {
    /// A figure with a title and no panels yet.
    #[must_use]
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), columns: None, globes: Vec::new(), panels: Vec::new() }
    }

    /// Adds a globe, to the left of all panels and as high as they are together.
    #[must_use]
    pub fn globe(mut self, globe: Globe) -> Self {
        self.globes.push(globe);
        self
    }

    /// Adds a panel, to the right of the last or under it.
    #[must_use]
    pub fn panel(mut self, panel: Panel) -> Self {
        self.panels.push(panel);
        self
    }

    /// Puts so many panels side by side, rather than one, two or three as their number suggests.
    #[must_use]
    pub fn columns(mut self, columns: usize) -> Self {
        self.columns = Some(columns.max(1));
        self
    }

    /// The figure.
    ///
    /// # Errors
    ///
    /// [`PlotError::Empty`] without panels, lines or points, [`PlotError::Point`] for a point that has no
    /// place on its axes or its globe.
    pub fn svg(&self) -> Result<String, PlotError> {
        if self.panels.is_empty() && self.globes.is_empty() {
            return Err(PlotError::Empty { name: self.title.clone() });
        }
        self.globes.iter().try_for_each(Globe::check)?;
        self.panels.iter().try_for_each(Panel::check)?;
        let columns = self.columns_or_usual();
        let frame = match columns + self.globes.len() {
            0 | 1 => (560.0, 280.0),
            2 => (340.0, 210.0),
            _ => (260.0, 180.0),
        };
        let room = self.room(frame);
        let cell = (room.left + frame.0 + RIGHT, room.top + frame.1 + BELOW);
        let rows = self.panels.len().div_ceil(columns.max(1));
        let grid = (cell.0 * columns as f64, cell.1 * rows as f64);

        let globes: Vec<At> = self.globes.iter().map(|globe| globe.size(grid.1)).collect();
        let height = globes.iter().map(|size| size.1).fold(grid.1, f64::max);
        let start = EDGE + globes.iter().map(|size| size.0).sum::<f64>();
        let size = (start + grid.0, HEAD + height + EDGE);
        let mut sheet = plot::sheet(size, &self.title, 0.5 * size.0);
        let (mut letters, mut x) = ('a'..='z', EDGE);
        for (globe, size) in self.globes.iter().zip(&globes) {
            let letter = letters.next().unwrap_or(' ');
            plot::place(
                &mut sheet,
                (x, HEAD + 0.5 * (height - size.1)),
                globe.parts(letter, *size),
            );
            x += size.0;
        }
        let lines: usize = self.panels.iter().map(|panel| panel.lines.len()).sum();
        let stretches = STRETCHES.min(ALL_STRETCHES / lines.max(1)).max(1);
        for (index, panel) in self.panels.iter().enumerate() {
            let parts = panel.parts(letters.next().unwrap_or(' '), &room, stretches);
            let (column, row) = ((index % columns) as f64, (index / columns) as f64);
            let y = HEAD + 0.5 * (height - grid.1) + row * cell.1;
            plot::place(&mut sheet, (start + column * cell.0, y), parts);
        }
        Ok(plot::svg(&sheet))
    }

    /// Writes the figure to a file.
    ///
    /// # Errors
    ///
    /// Those of [`Panels::svg`], and [`PlotError::Io`] if the file cannot be written.
    pub fn save(&self, path: impl Into<PathBuf>) -> Result<(), PlotError> {
        plot::save(path.into(), &self.svg()?)
    }

    /// The room of each panel: the same for all, so that their frames line up.
    fn room(&self, frame: At) -> Room {
        let layouts = self.panels.iter().map(|panel| panel.layout(frame));
        let margins = layouts.map(|layout| ComputedLayout::from_layout(&layout).margin_left);
        let left = margins.fold(0.0, f64::max).ceil();
        let headers = self.panels.iter().map(|panel| panel.header(left + frame.0).height);
        Room { frame, left, top: headers.fold(0.0, f64::max) }
    }

    fn columns_or_usual(&self) -> usize {
        let usual = match (self.panels.len(), self.globes.len()) {
            (0 | 1, _) | (_, 1..) => 1,
            (2 | 4, _) => 2,
            _ => 3,
        };
        self.columns.unwrap_or(usual).min(self.panels.len())
    }
}

/// The lowest and the highest point of each of so many stretches, in their order, and the two ends: a
/// spike stays, whatever is left out around it.
fn thinned(points: &[At], stretches: usize) -> impl Iterator<Item = At> {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(count: u32) -> Vec<(f64, f64)> {
        (0..count).map(|n| f64::from(n) * 1e-3).map(|t| (t, t.sin())).collect()
    }

    fn figure() -> Panels {
        let panel = |title| Panel::new(title, "t").line("a", wave(50_000)).line("b", wave(100));
        Panels::new("title").panel(panel("one")).panel(panel("two").level(0.5))
    }

    #[test]
    fn a_figure_is_the_same_bytes_every_time_and_small() {
        let svg = figure().svg().unwrap();
        assert_eq!(svg, figure().svg().unwrap());
        assert!(svg.len() < 100_000, "{} bytes", svg.len());
        assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"));
    }

    #[test]
    fn a_circle_is_round_where_the_axes_are_equal() {
        let circle: Vec<_> = (0..=360)
            .map(|k| f64::from(k).to_radians())
            .map(|t| (3.0 + t.cos(), 5.0 + t.sin()))
            .collect();
        let mut layout = Panel::new("y", "x").line("", circle).equal().layout((340.0, 210.0));
        (layout.width, layout.height) = (Some(340.0), Some(210.0));
        let layout = layout.with_force_margins(0.0, 0.0).with_force_margins_y(0.0, 0.0);
        let axes = ComputedLayout::from_layout(&layout);
        let (width, height) =
            (axes.map_x(4.0) - axes.map_x(2.0), axes.map_y(4.0) - axes.map_y(6.0));
        assert!((width - height).abs() < 1e-9 && (150.0..210.0).contains(&height));
    }

    #[test]
    fn lines_with_the_same_label_share_their_colour() {
        let panel = Panel::new("p", "t").line("a", wave(9)).line("b", wave(9)).line("a", wave(9));
        assert_eq!(panel.labels(), ["a", "b"]);
    }

    #[test]
    fn many_long_lines_are_still_a_small_file() {
        let panel = || (0..6).fold(Panel::new("p", "t"), |p, _| p.line("l", wave(20_000)));
        let figure = (0..9).fold(Panels::new("nine"), |figure, _| figure.panel(panel()));
        let size = figure.svg().unwrap().len();
        assert!(size < 350_000, "{size} bytes");
    }

    #[test]
    fn panels_and_globes_have_letters_from_the_left() {
        let globe = Globe::new("globe").curve("c", [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let svg = figure().columns(1).globe(globe).svg().unwrap();
        let x = |letter: char| -> f64 {
            let end = svg.find(&format!(">{letter}</text>")).unwrap();
            let group = &svg[svg[..end].rfind("translate(").unwrap() + 10..];
            group[..group.find(',').unwrap()].parse().unwrap()
        };
        assert!(x('a') < x('b') && x('b') <= x('c'), "{svg}");
    }

    #[test]
    fn a_point_alone_is_a_disc() {
        let svg = Panels::new("").panel(Panel::new("", "").line("", [(0.0, 0.0)])).svg().unwrap();
        assert!(svg.contains("<circle"));
    }

    #[test]
    fn a_logarithmic_panel_has_decades_and_a_floor() {
        let panel = |y| Panel::new("p", "t").logarithmic(1e-16).line("l", [(0.0, 1e-3), (1.0, y)]);
        let svg = |y| Panels::new("f").panel(panel(y)).svg().unwrap();
        assert!(svg(1e-15).contains(">10⁻¹²<"));
        assert_eq!(svg(0.0), svg(1e-16));
        let error = |panel| Panels::new("f").panel(panel).svg().unwrap_err();
        assert!(matches!(error(panel(-1e-3)), PlotError::Point { index: 1, .. }));
        assert!(matches!(error(panel(1.0).level(-1.0)), PlotError::Point { .. }));
    }

    #[test]
    fn a_legend_needs_two_lines() {
        let labelled = |panel: Panel| Panels::new("title").panel(panel).svg().unwrap();
        let one = Panel::new("one", "t").line("alone", wave(10));
        assert!(!labelled(one.clone()).contains("alone"));
        let limited = labelled(one.named_level("limit", 0.5));
        assert!(!limited.contains(">alone<") && limited.contains(">limit<"));
    }

    #[test]
    fn a_long_line_keeps_its_spikes_and_its_ends() {
        let mut points = wave(1_000_000);
        points[345_678].1 = 40.0;
        points[345_679].1 = -40.0;
        let shown: Vec<_> = thinned(&points, STRETCHES).collect();
        assert!(shown.len() <= 1500, "{} points", shown.len());
        let order = [0, 345_678, 345_679, 999_999].map(|i| points[i]);
        let places = order.map(|point| shown.iter().position(|p| *p == point));
        assert!(places.iter().all(Option::is_some) && places.is_sorted(), "{places:?}");
        assert!(shown.is_sorted_by(|a, b| a.0 <= b.0));
    }

    #[test]
    fn a_short_line_is_drawn_whole() {
        let points = wave(1000);
        let mut shown: Vec<_> = thinned(&points, STRETCHES).collect();
        shown.dedup();
        assert_eq!(shown, points);
    }

    #[test]
    fn what_cannot_be_drawn_is_named() {
        let error = |panel| Panels::new("title").panel(panel).svg().unwrap_err();
        let panel = || Panel::new("panel", "t");
        assert!(matches!(Panels::new("f").svg(), Err(PlotError::Empty { name }) if name == "f"));
        assert!(matches!(error(panel()), PlotError::Empty { name } if name == "panel"));
        assert!(matches!(error(panel().line("l", [])), PlotError::Empty { name } if name == "l"));
        let nan = error(panel().line("l", [(0.0, 0.0), (1.0, f64::NAN)]));
        assert!(matches!(nan, PlotError::Point { index: 1, .. }), "{nan}");
        let level = error(panel().line("l", [(0.0, 0.0)]).level(f64::INFINITY));
        assert!(matches!(level, PlotError::Point { .. }), "{level}");
        let far = error(panel().line("l", [(0.0, -f64::MAX), (1.0, f64::MAX)]));
        assert!(matches!(far, PlotError::Point { .. }), "{far}");
        let path = std::env::temp_dir().join("metriplectic-no-such-folder/a.svg");
        assert!(matches!(figure().save(&path), Err(PlotError::Io { path: p, .. }) if p == path));
    }
}
