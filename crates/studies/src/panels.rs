//! A grid of panels with lines, and globes beside it.

use std::path::PathBuf;

use crate::{
    axis::Axis,
    canvas::{self, At, Canvas, Marker, Type, color},
    frame::{self, Frame},
    globe::Globe,
    header::Header,
    plot::{self, PlotError},
};

/// Stretches of a line of which the lowest and the highest point are drawn, at most.
const STRETCHES: usize = 700;
/// Stretches of all lines of a figure: what keeps its file below some 300 kB.
const ALL_STRETCHES: usize = 12_000;

/// A figure of titled panels in a grid, with globes to the left of it.
///
/// # Examples
///
/// ```
/// use metriplectic_studies::{Panel, Panels};
///
/// let energy: Vec<(f64, f64)> =
///     (0..100).map(f64::from).map(|t| (t, 2.2e-16 * t.sin())).collect();
/// let svg = Panels::new("A free rigid body")
///     .panel(Panel::new("energy", "t").vertical("ΔH").line("Weyl midpoint", &energy).level(0.0))
///     .svg()?;
/// assert!(svg.contains("ΔH (units of 10⁻¹⁶)"));
/// # Ok::<(), metriplectic_studies::PlotError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Panels {
    title: String,
    columns: Option<usize>,
    globes: Vec<Globe>,
    panels: Vec<Panel>,
}

/// A titled pair of axes with lines on it.
#[derive(Clone, Debug)]
pub struct Panel {
    title: String,
    horizontal: String,
    vertical: String,
    lines: Vec<(String, Vec<(f64, f64)>)>,
    levels: Vec<f64>,
    /// The lower end of a logarithmic axis.
    floor: Option<f64>,
    /// Whether a unit has the same length on both axes.
    equal: bool,
}

impl Panel {
    /// A panel with a title and the name of its horizontal axis.
    #[must_use]
    pub fn new(title: impl Into<String>, horizontal: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            horizontal: horizontal.into(),
            vertical: String::new(),
            lines: Vec::new(),
            levels: Vec::new(),
            floor: None,
            equal: false,
        }
    }

    /// Names the vertical axis.
    #[must_use]
    pub fn vertical(mut self, name: impl Into<String>) -> Self {
        self.vertical = name.into();
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
    pub fn level(mut self, y: f64) -> Self {
        self.levels.push(y);
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

    /// The points of the lines and the levels, checked, as `(least, greatest)` of `x` and `y`.
    fn ranges(&self) -> Result<[(f64, f64); 2], PlotError> {
        if self.lines.is_empty() {
            return Err(PlotError::Empty { name: self.title.clone() });
        }
        let mut ranges = [(f64::INFINITY, f64::NEG_INFINITY); 2];
        for (label, points) in &self.lines {
            check(label, points)?;
            self.check_logarithms(label, points)?;
            points.iter().for_each(|(x, y)| ranges = [wider(ranges[0], *x), wider(ranges[1], *y)]);
        }
        for (index, &y) in self.levels.iter().enumerate() {
            if !y.is_finite() {
                return Err(PlotError::NonFinite { name: self.title.clone(), index, x: 0.0, y });
            }
            self.check_logarithms(&self.title, &[(0.0, y)])?;
            ranges[1] = wider(ranges[1], y);
        }
        ranges[1] = (self.shown(ranges[1].0), self.shown(ranges[1].1));
        match self.floor {
            Some(low) if !(low.is_normal() && low > 0.0) => {
                Err(PlotError::Range { low, high: ranges[1].1 })
            }
            _ => Ok(ranges),
        }
    }

    /// Whether all ordinates have a place on the axis, if it is logarithmic.
    fn check_logarithms(&self, label: &str, points: &[(f64, f64)]) -> Result<(), PlotError> {
        let negative = |(_, y): &(f64, f64)| *y < 0.0;
        match points.iter().position(negative).filter(|_| self.floor.is_some()) {
            Some(index) => {
                let (x, y) = points[index];
                Err(PlotError::NonPositive { name: label.to_owned(), index, x, y })
            }
            None => Ok(()),
        }
    }

    fn axes(&self, (width, height): At) -> Result<(Axis, Axis), PlotError> {
        let [x, y] = self.ranges()?;
        if self.equal {
            let unit = (1.06 * (x.1 - x.0) / width).max(1.12 * (y.1 - y.0) / height);
            let (x, y) = (around(x, unit * width), around(y, unit * height));
            return Ok((Axis::linear(x, 0.0, width / 65.0)?, Axis::linear(y, 0.0, height / 42.0)?));
        }
        let vertical = match self.floor {
            Some(_) => Axis::logarithmic(y),
            None => Axis::linear(y, 0.06, height / 42.0)?,
        };
        Ok((Axis::linear(x, 0.0, width / 65.0)?, vertical))
    }

    fn header(&self) -> Header<'_> {
        let labels = self.labels().into_iter().enumerate();
        let entries = labels.map(|(k, label)| (label, color(k))).collect();
        Header { title: &self.title, entries }
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

    fn draw(&self, canvas: &Canvas<'_>, frame: &Frame, stretches: usize) -> Result<(), PlotError> {
        frame.draw(canvas, (&self.horizontal, &self.vertical))?;
        let labels = self.labels();
        for (label, points) in &self.lines {
            let line = labels.iter().position(|other| other == label).unwrap_or(0);
            let shown = thinned(points, stretches).map(|(x, y)| frame.at((x, self.shown(y))));
            canvas.line(shown, color(line), 1.4)?;
            if let &[(x, y)] = points.as_slice() {
                canvas.marker(frame.at((x, self.shown(y))), Marker { line, filled: true })?;
            }
        }
        // Last, since the lines of a long run may cover everything.
        self.levels.iter().try_for_each(|&y| frame.level(canvas, self.shown(y)))?;
        let width = frame.lower_right.0 - frame.upper_left.0;
        self.header().draw(canvas, frame.upper_left, width)
    }
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
    /// [`PlotError::Empty`] without panels, lines or points, [`PlotError::NonFinite`] for a point
    /// that is not finite, [`PlotError::NonPositive`] for one that has no place on a logarithmic axis,
    /// [`PlotError::OffSphere`] for one that has none on a globe, [`PlotError::Range`] for numbers too
    /// far apart.
    pub fn svg(&self) -> Result<String, PlotError> {
        let layout = Layout::of(self)?;
        canvas::sheet(layout.sheet(), |canvas| {
            let middle = 0.5 * layout.sheet().0;
            let set = Type::centred(frame::TITLE).fitting(&self.title, 2.0 * middle - 16.0);
            canvas.text(&self.title, (middle, 22.0), set)?;
            for (globe, (at, diameter)) in self.globes.iter().zip(layout.globes(self)) {
                globe.draw(canvas, at, diameter)?;
            }
            let lines: usize = self.panels.iter().map(|panel| panel.lines.len()).sum();
            let stretches = STRETCHES.min(ALL_STRETCHES / lines.max(1)).max(1);
            let mut pairs = self.panels.iter().zip(layout.frames());
            pairs.try_for_each(|(panel, frame)| panel.draw(canvas, &frame, stretches))
        })
    }

    /// Writes the figure to a file.
    ///
    /// # Errors
    ///
    /// Those of [`Panels::svg`], and [`PlotError::Io`] if the file cannot be written.
    pub fn save(&self, path: impl Into<PathBuf>) -> Result<(), PlotError> {
        plot::save(path.into(), &self.svg()?)
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

/// Where the panels go: the frames are of one size, and line up in columns and rows.
struct Layout {
    axes: Vec<(Axis, Axis)>,
    frame: At,
    /// Diameters of the globes.
    diameters: Vec<f64>,
    /// Upper left corner of the grid.
    grid: At,
    /// Height of the globes, at least.
    body: f64,
    /// Room to the left of the frames of each column.
    lefts: Vec<f64>,
    /// Room above the frames of each row.
    tops: Vec<f64>,
}

impl Layout {
    const EDGE: f64 = 8.0;
    const HEAD: f64 = 40.0;
    const RIGHT: f64 = 22.0;
    /// The diameter of a globe, from beside a low grid to beside a high one.
    const DISC: (f64, f64) = (320.0, 460.0);

    fn of(figure: &Panels) -> Result<Self, PlotError> {
        if figure.panels.is_empty() && figure.globes.is_empty() {
            return Err(PlotError::Empty { name: figure.title.clone() });
        }
        figure.globes.iter().try_for_each(Globe::check)?;
        let columns = figure.columns_or_usual();
        let frame = match columns + figure.globes.len() {
            0 | 1 => (560.0, 280.0),
            2 => (340.0, 210.0),
            _ => (260.0, 180.0),
        };
        let axes = figure.panels.iter().map(|panel| panel.axes(frame));
        let axes = axes.collect::<Result<Vec<_>, PlotError>>()?;
        let mut lefts = vec![0.0_f64; columns];
        let mut tops = vec![0.0_f64; figure.panels.len().div_ceil(columns.max(1))];
        for (index, (panel, (_, y))) in figure.panels.iter().zip(&axes).enumerate() {
            let (column, row) = (index % columns, index / columns);
            lefts[column] = lefts[column].max(frame::margin(y, &panel.vertical));
            tops[row] = tops[row].max(panel.header().height(frame.0));
        }
        let grid = (Self::EDGE, Self::HEAD);
        let alone = Self { axes, frame, diameters: Vec::new(), grid, body: 0.0, lefts, tops };
        Ok(alone.beside(&figure.globes))
    }

    /// The same grid with globes to its left.
    fn beside(mut self, globes: &[Globe]) -> Self {
        let (_, bottom) = self.upper_left(self.lefts.len(), self.tops.len());
        let height = bottom - Self::HEAD;
        for globe in globes {
            let diameter = globe.diameter_within(height).clamp(Self::DISC.0, Self::DISC.1);
            let size = globe.size(diameter);
            self.diameters.push(diameter);
            self.grid.0 += size.0 + Self::EDGE;
            self.body = self.body.max(size.1);
        }
        self.grid.1 += 0.5 * (self.body - height).max(0.0);
        self
    }

    fn sheet(&self) -> At {
        let (right, bottom) = self.upper_left(self.lefts.len(), self.tops.len());
        (right, bottom.max(Self::HEAD + self.body + Self::EDGE))
    }

    /// Upper left corner and diameter of each globe.
    fn globes(&self, figure: &Panels) -> Vec<(At, f64)> {
        let height = self.sheet().1 - Self::HEAD - Self::EDGE;
        let mut left = Self::EDGE;
        let pairs = figure.globes.iter().zip(&self.diameters);
        let place = |(globe, &diameter): (&Globe, &f64)| {
            let size = globe.size(diameter);
            let at = (left, Self::HEAD + 0.5 * (height - size.1));
            left += size.0 + Self::EDGE;
            (at, diameter)
        };
        pairs.map(place).collect()
    }

    fn frames(&self) -> Vec<Frame> {
        self.axes.iter().enumerate().map(|(index, axes)| self.frame_at(index, axes)).collect()
    }

    fn frame_at(&self, index: usize, (x, y): &(Axis, Axis)) -> Frame {
        let (column, row) = (index % self.lefts.len(), index / self.lefts.len());
        let (left, top) = self.upper_left(column, row);
        let upper_left = (left + self.lefts[column], top + self.tops[row]);
        let lower_right = (upper_left.0 + self.frame.0, upper_left.1 + self.frame.1);
        Frame { x: x.clone(), y: y.clone(), upper_left, lower_right }
    }

    /// Where a cell of the grid begins; past the last, where the grid ends.
    fn upper_left(&self, column: usize, row: usize) -> At {
        let width = |left: &f64| left + self.frame.0 + Self::RIGHT;
        let height = |top: &f64| top + self.frame.1 + frame::BELOW + 8.0;
        let left = self.grid.0 + self.lefts[..column].iter().map(width).sum::<f64>();
        (left, self.grid.1 + self.tops[..row].iter().map(height).sum::<f64>())
    }
}

fn check(label: &str, points: &[(f64, f64)]) -> Result<(), PlotError> {
    let name = || label.to_owned();
    if points.is_empty() {
        return Err(PlotError::Empty { name: name() });
    }
    match points.iter().position(|(x, y)| !(x.is_finite() && y.is_finite())) {
        Some(index) => Err(PlotError::NonFinite {
            name: name(),
            index,
            x: points[index].0,
            y: points[index].1,
        }),
        None => Ok(()),
    }
}

fn wider((low, high): (f64, f64), value: f64) -> (f64, f64) {
    (low.min(value), high.max(value))
}

/// A range of this length around the middle of another.
fn around((low, high): (f64, f64), length: f64) -> (f64, f64) {
    let middle = 0.5 * low + 0.5 * high;
    (middle - 0.5 * length, middle + 0.5 * length)
}

/// The lowest and the highest point of each of so many stretches, in their order, and the two ends:
/// a spike stays, whatever is left out around it.
fn thinned(points: &[(f64, f64)], stretches: usize) -> impl Iterator<Item = (f64, f64)> {
    let extremes = |stretch: &[(f64, f64)]| {
        let low = (0..stretch.len()).min_by(|&i, &j| stretch[i].1.total_cmp(&stretch[j].1));
        let high = (0..stretch.len()).max_by(|&i, &j| stretch[i].1.total_cmp(&stretch[j].1));
        let mut kept: Vec<usize> = low.into_iter().chain(high).collect();
        kept.sort_unstable();
        kept.into_iter().map(|i| stretch[i]).collect::<Vec<_>>()
    };
    let short = points.len() <= 2 * stretches;
    let length = if short { 1 } else { points.len().div_ceil(stretches) };
    let ends = (points.first().copied(), points.last().copied());
    let inner = points.chunks(length).flat_map(extremes);
    ends.0.into_iter().chain(inner).chain(ends.1)
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
        assert!(svg.starts_with("<svg width=\"") && svg.trim_end().ends_with("</svg>"));
    }

    #[test]
    fn a_circle_is_round_where_the_axes_are_equal() {
        let circle: Vec<_> = (0..=360)
            .map(|k| f64::from(k).to_radians())
            .map(|t| (3.0 + t.cos(), 5.0 + t.sin()))
            .collect();
        let panel = Panel::new("", "x").line("", circle).equal();
        let (x, y) = panel.axes((340.0, 210.0)).unwrap();
        let width = 340.0 * (x.place(4.0) - x.place(2.0));
        let height = 210.0 * (y.place(6.0) - y.place(4.0));
        assert!((width - height).abs() < 1e-9 && (150.0..210.0).contains(&height));
        assert!((x.place(3.0) - 0.5).abs() < 1e-12 && (y.place(5.0) - 0.5).abs() < 1e-12);
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
    fn the_lines_stay_in_their_frame() {
        let svg = Panels::new("").panel(Panel::new("", "").line("", wave(10_000))).svg().unwrap();
        let places = |line: &str| -> Vec<(i32, i32)> {
            let points = line.split("points=\"").nth(1).unwrap().split('"').next().unwrap();
            let number = |text: &str| text.parse::<i32>().unwrap();
            points
                .split_whitespace()
                .map(|p| p.split_once(',').unwrap())
                .map(|(x, y)| (number(x), number(y)))
                .collect()
        };
        let longest = svg.lines().max_by_key(|line| line.len()).unwrap();
        let line = places(longest);
        let closed = |points: &Vec<(i32, i32)>| points.len() == 5 && points[0] == points[4];
        let frames = svg.lines().filter(|line| line.contains("points=")).map(places);
        let frame = frames.into_iter().find(closed).unwrap();
        let ((left, bottom), (right, top)) = (frame[0], frame[2]);
        assert!(line.iter().all(|(x, y)| (left..=right).contains(x) && (top..=bottom).contains(y)));
        assert_eq!((line[0].0, line[line.len() - 1].0), (left, right));
        let sheet = svg.split("viewBox=\"0 0 ").nth(1).unwrap().split(' ').next().unwrap();
        assert!(left > 0 && right + 200 < sheet.parse().unwrap(), "{left} to {right} of {sheet}");
    }

    #[test]
    fn the_sheet_is_measured_in_pixels() {
        let svg = Panels::new("").panel(Panel::new("", "").line("", [(0.0, 0.0)])).svg().unwrap();
        let header = svg.lines().next().unwrap();
        let number = |after: &str| -> f64 {
            let start = header.split(after).nth(1).unwrap();
            start.split(['"', ' ']).next().unwrap().parse().unwrap()
        };
        assert!(number("width=\"") < 700.0, "{header}");
        assert!((number("viewBox=\"0 0 ") / number("width=\"") - 10.0).abs() < 0.02, "{header}");
    }

    #[test]
    fn a_globe_stands_to_the_left_and_the_panels_keep_their_width() {
        let globe = Globe::new("globe").curve("c", [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let beside = figure().columns(1).globe(globe.clone());
        let layout = Layout::of(&beside).unwrap();
        let (at, diameter) = layout.globes(&beside)[0];
        let frames = layout.frames();
        assert!(at.0 + globe.size(diameter).0 < frames[0].upper_left.0);
        assert!(at.1 >= Layout::HEAD && at.1 + globe.size(diameter).1 <= layout.sheet().1);
        let width = |frame: &Frame| frame.lower_right.0 - frame.upper_left.0;
        assert!((width(&frames[0]) - width(&frames[1])).abs() < 1e-9);
        assert!(frames[1].lower_right.1 <= layout.sheet().1);
        let alone = Panels::new("title").globe(globe).svg().unwrap();
        assert!(alone.len() < beside.svg().unwrap().len());
    }

    #[test]
    fn a_logarithmic_panel_has_decades_and_a_floor() {
        let panel = |y| Panel::new("p", "t").logarithmic(1e-16).line("l", [(0.0, 1e-3), (1.0, y)]);
        let svg = |y| Panels::new("f").panel(panel(y)).svg().unwrap();
        assert!(svg(1e-15).contains("\n10⁻¹²\n"));
        assert_eq!(svg(0.0), svg(1e-16));
        let error = |panel| Panels::new("f").panel(panel).svg().unwrap_err();
        assert!(matches!(error(panel(-1e-3)), PlotError::NonPositive { index: 1, .. }));
        assert!(matches!(error(panel(1.0).level(-1.0)), PlotError::NonPositive { .. }));
        assert!(matches!(error(panel(1.0).logarithmic(0.0)), PlotError::Range { .. }));
    }

    #[test]
    fn a_legend_needs_two_lines() {
        assert!(figure().svg().unwrap().contains("\na\n"));
        let one = Panels::new("title").panel(Panel::new("one", "t").line("alone", wave(10)));
        assert!(!one.svg().unwrap().contains("alone"));
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
        assert!(matches!(nan, PlotError::NonFinite { index: 1, .. }), "{nan}");
        let level = error(panel().line("l", [(0.0, 0.0)]).level(f64::INFINITY));
        assert!(matches!(level, PlotError::NonFinite { .. }), "{level}");
        let far = error(panel().line("l", [(0.0, -f64::MAX), (1.0, f64::MAX)]));
        assert!(matches!(far, PlotError::Range { .. }), "{far}");
        let path = std::env::temp_dir().join("metriplectic-no-such-folder/a.svg");
        assert!(matches!(figure().save(&path), Err(PlotError::Io { path: p, .. }) if p == path));
    }
}
