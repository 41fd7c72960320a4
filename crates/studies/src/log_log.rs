//! Convergence on doubly logarithmic axes.

use std::path::PathBuf;

use svg::node::element::Element;

use crate::axis::Axis;
use crate::frame::{Frame, Room};
use crate::marker::marker;
use crate::order::Order;
use crate::plot::{self, Anchor, At, GREY, NUMBER, PlotError, color, length, line, text};

/// Width and height of the frame, and the room for the title above it and the name below it.
const FRAME: (f64, f64) = (440.0, 360.0);
const TOP: f64 = 40.0;
const BELOW: f64 = 46.0;
/// Height of a row of the legend, and room around it, before its labels, and between two problems.
const ROW: f64 = 17.0;
const AROUND: f64 = 15.0;
const SAMPLE: f64 = 20.0;
const GAP: f64 = 4.0;
/// The size of a marker, and the width of a line.
const MARKER: f64 = 3.6;
const STROKE: f64 = 1.2;

/// A figure of errors over step sizes, with the fitted [`Order`] of each series in the legend.
///
/// Points left out of a fit as round-off have hollow markers.
///
/// # Examples
///
/// ```
/// use metriplectic_studies::LogLog;
///
/// let points: Vec<(f64, f64)> =
///     (1..8).map(|k| 0.5_f64.powi(k)).map(|h| (h, 0.1 * h * h)).collect();
/// let svg = LogLog::new("Midpoint", "h", "error").series("sphere", &points).guide(2.0).svg()?;
/// assert!(svg.contains("2.00 [2.00, 2.00]"));
/// # Ok::<(), metriplectic_studies::PlotError>(())
/// ```
#[derive(Clone, Debug)]
pub struct LogLog {
    title: String,
    horizontal: String,
    vertical: String,
    series: Vec<Series>,
    guides: Vec<f64>,
}

/// How a series is drawn: the number of its colour and marker, and its place among the series of this
/// number, which are solid, dashed, and dotted from the third on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Look {
    line: usize,
    rank: usize,
}

#[derive(Clone, Debug)]
struct Series {
    label: String,
    look: Look,
    /// From the smallest step up.
    points: Vec<(f64, f64)>,
    /// As given, for errors to name.
    given: Vec<(f64, f64)>,
    order: Option<Order>,
}

impl LogLog {
    /// A figure with a title and the names of its axes.
    #[must_use]
    pub fn new(
        title: impl Into<String>,
        horizontal: impl Into<String>,
        vertical: impl Into<String>,
    ) -> Self {
        Self {
            title: title.into(),
            horizontal: horizontal.into(),
            vertical: vertical.into(),
            series: Vec::new(),
            guides: Vec::new(),
        }
    }

    /// Adds a series of points `(h, error)`, in any order, with a colour and a marker of its own as
    /// long as there are six at most.
    #[must_use]
    pub fn series(self, label: impl Into<String>, points: impl AsRef<[(f64, f64)]>) -> Self {
        let line = self.series.iter().map(|series| series.look.line + 1).max().unwrap_or(0);
        self.add(label.into(), points.as_ref(), Look { line, rank: 0 })
    }

    /// Adds a series with the colour and the marker of the last one, the first dashed and the others
    /// dotted: the same problem, solved in another way. Its label stands below that of the problem.
    #[must_use]
    pub fn rival(self, label: impl Into<String>, points: impl AsRef<[(f64, f64)]>) -> Self {
        let look = self.series.last().map_or(Look { line: 0, rank: 0 }, |series| series.look);
        self.add(label.into(), points.as_ref(), Look { rank: look.rank + 1, ..look })
    }

    fn add(mut self, label: String, points: &[(f64, f64)], look: Look) -> Self {
        self.series.push(Series::of(label, points, look));
        self
    }

    /// Adds a triangle of slope `order` beside the series it fits best.
    #[must_use]
    pub fn guide(mut self, order: f64) -> Self {
        self.guides.push(order);
        self
    }

    /// The figure.
    ///
    /// # Errors
    ///
    /// [`PlotError::Empty`] without series or points, [`PlotError::Point`] for a point without logarithms.
    pub fn svg(&self) -> Result<String, PlotError> {
        if self.series.is_empty() {
            return Err(PlotError::Empty { name: self.title.clone() });
        }
        for series in &self.series {
            let fits = |p: &[f64]| p[0].min(p[1]) > 0.0 && (p[0] * p[1]).is_finite();
            let points = series.given.iter().map(|&(h, error)| [h, error]);
            plot::check(&series.label, points, "logarithmic axes", fits)?;
        }
        let points = || self.series.iter().flat_map(|series| &series.points);
        let x = Axis::logarithmic(points().map(|p| p.0));
        let y = Axis::logarithmic(points().map(|p| p.1));
        let (legend, width, height) = self.legend((AROUND, TOP));
        let left = Room::left_of(&y);
        let below = BELOW.max(TOP + height + 8.0 - FRAME.1 - TOP);
        let right = (width + AROUND).ceil();
        let room = Room { frame: FRAME, left, right, top: TOP, below };
        let frame = Frame { room: &room, x, y };
        let mut parts = frame.parts([&self.horizontal, &self.vertical]);
        for &p in &self.guides {
            let corners = self.guide_points(&frame, p);
            parts.push(line([0, 1, 2, 0].map(|k| corners[k]), GREY, 1.0, None));
            let beside = (corners[2].0 + 0.025 * FRAME.0, 0.5 * (corners[1].1 + corners[2].1));
            parts.push(text(&p.to_string(), beside, NUMBER, Anchor::Middle).into());
        }
        parts.extend(self.series.iter().flat_map(|series| series.parts(&frame)));
        let sheet = plot::sheet(room.size(), &self.title, left + 0.5 * FRAME.0);
        let sheet = sheet.add(plot::placed((0.0, 0.0), parts));
        Ok(sheet.add(plot::placed((left + FRAME.0, 0.0), legend)).to_string())
    }

    /// The legend with its upper left corner at a place, its width and its height.
    fn legend(&self, (left, top): At) -> (Vec<Element>, f64, f64) {
        let (mut parts, mut width, mut y) = (Vec::new(), 0.0_f64, top + 0.5 * ROW);
        for problem in self.series.chunk_by(|_, next| next.look.rank > 0) {
            let name = text(&problem[0].label, (left, y), NUMBER, Anchor::Start);
            parts.push(name.set("font-weight", "bold").into());
            // Bold letters are wider by a tenth.
            width = width.max(1.1 * length(&problem[0].label, NUMBER));
            for series in problem {
                y += ROW;
                let label = series.caption();
                parts.push(series.sample((left + 0.4 * SAMPLE, y)));
                parts.push(text(&label, (left + SAMPLE, y), NUMBER, Anchor::Start).into());
                width = width.max(SAMPLE + length(&label, NUMBER));
            }
            y += ROW + GAP;
        }
        (parts, left + width, y - top - 0.5 * ROW)
    }

    /// Writes the figure to a file.
    ///
    /// # Errors
    ///
    /// The errors of [`LogLog::svg`], and [`PlotError::Io`] if the file cannot be written.
    pub fn save(&self, path: impl Into<PathBuf>) -> Result<(), PlotError> {
        plot::save(path.into(), &self.svg()?)
    }

    /// The corners of a triangle of slope `p`, to the lower right of the middle of the series that it fits best.
    fn guide_points(&self, frame: &Frame<'_>, p: f64) -> [At; 3] {
        let misfit = |series: &&Series| (series.slope() - p).abs();
        let nearest = self.series.iter().min_by(|a, b| misfit(a).total_cmp(&misfit(b)));
        let (low, high) = nearest.map_or_else(Default::default, Series::middle);
        let at = |point| {
            let (x, y) = frame.at(point);
            (x + 0.025 * FRAME.0, y + 0.025 * FRAME.1)
        };
        let (start, end) = (at((low.0, high.1 * (low.0 / high.0).powf(p))), at(high));
        [start, (end.0, start.1), end]
    }
}

impl Look {
    fn dashes(self) -> Option<&'static str> {
        match self.rank {
            0 => None,
            1 => Some("5 4"),
            _ => Some("0.5 4"),
        }
    }
}

impl Series {
    fn of(label: String, given: &[(f64, f64)], look: Look) -> Self {
        let mut points = given.to_vec();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (steps, errors): (Vec<f64>, Vec<f64>) = given.iter().copied().unzip();
        // Four points make an order; a figure of three is still a figure.
        let order = Order::fit(&steps, &errors).ok();
        Self { label, look, points, given: given.to_vec(), order }
    }

    fn slope(&self) -> f64 {
        self.order.as_ref().map_or(0.0, |order| order.slope)
    }

    /// Its line, its markers, and the hollow markers of round-off.
    fn parts(&self, frame: &Frame<'_>) -> Vec<Element> {
        let color = color(self.look.line);
        let path = self.points.iter().map(|point| frame.at(*point));
        let mut parts = vec![line(path, color, STROKE, self.look.dashes())];
        parts.extend(self.given.iter().enumerate().map(|(index, point)| {
            let filled = !self.is_round_off(index);
            marker(self.look.line, frame.at(*point), MARKER, color, filled)
        }));
        parts
    }

    /// The slope; for a rival after its name.
    fn caption(&self) -> String {
        let order = self.order.as_ref();
        let slope =
            order.map_or_else(|| "no slope fitted".into(), |order| format!("slope {order}"));
        if self.look.rank == 0 { slope } else { format!("{}, {slope}", self.label) }
    }

    /// A marker, or for a rival its line, around a place.
    fn sample(&self, (x, y): At) -> Element {
        let color = color(self.look.line);
        match self.look.rank {
            0 => marker(self.look.line, (x, y), MARKER, color, true),
            _ => line([(x - 7.0, y), (x + 7.0, y)], color, STROKE, self.look.dashes()),
        }
    }

    fn is_round_off(&self, index: usize) -> bool {
        self.order.as_ref().is_some_and(|order| order.plateau.contains(&index))
    }

    /// Two points around the middle of the points of the fit.
    fn middle(&self) -> ((f64, f64), (f64, f64)) {
        let kept: Vec<(f64, f64)> = match &self.order {
            Some(order) => order.used.iter().rev().map(|&index| self.given[index]).collect(),
            None => self.points.clone(),
        };
        let at = |fraction: usize| kept[(kept.len() - 1) * fraction / 6];
        (at(2), at(4))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_plateau() -> Vec<(f64, f64)> {
        (1..12).map(|k| 0.5_f64.powi(k)).map(|h| (h, h.powi(4).max(1e-9))).collect()
    }

    #[test]
    fn round_off_is_hollow_and_not_in_the_slope() {
        let svg = LogLog::new("t", "h", "error").series("s", with_plateau()).svg().unwrap();
        assert!(svg.contains("slope 4.00 [4.00, 4.00]"));
        let order =
            Series::of("s".into(), &with_plateau(), Look { line: 0, rank: 0 }).order.unwrap();
        let markers = |fill: &str| {
            let circles = svg.lines().filter(|line| line.contains("<circle"));
            circles.filter(|line| line.contains(&format!("fill=\"{fill}\""))).count()
        };
        // One more stands in the legend.
        assert_eq!(
            (markers("none"), markers(color(0))),
            (order.plateau.len(), order.used.len() + 1)
        );
        assert!(order.plateau.len() >= 4);
    }

    #[test]
    fn the_same_bytes_every_time_and_a_triangle_more() {
        let figure = || LogLog::new("t", "h", "error").series("s", with_plateau()).guide(4.0);
        assert_eq!(figure().svg().unwrap(), figure().svg().unwrap());
        let bare = LogLog::new("t", "h", "error").series("s", with_plateau()).svg().unwrap();
        assert!(figure().svg().unwrap().len() > bare.len());
    }

    #[test]
    fn the_name_of_the_vertical_axis_is_beside_its_numbers() {
        let points = [(2.0, 1530.0), (4.0, 8915.0), (32.0, 394_593.0)];
        let svg = LogLog::new("t", "n", "name").series("s", points).svg().unwrap();
        let x = |text: &str| -> f64 {
            let line = svg.lines().find(|line| line.contains(&format!(">{text}<"))).unwrap();
            let x = &line[line.find(" x=\"").unwrap() + 4..];
            x[..x.find('"').unwrap()].parse().unwrap()
        };
        let left_of_the_number = x("2×10⁴") - length("2×10⁴", NUMBER);
        // The name is written upwards from its base line.
        assert!(0.5 * f64::from(plot::NAME) < x("name") && x("name") < left_of_the_number, "{svg}");
    }

    #[test]
    fn rivals_are_dashed_and_dotted_in_the_colour_of_what_they_rival() {
        let figure = || LogLog::new("t", "h", "error").series("a", with_plateau());
        let rival = || figure().rival("b", with_plateau());
        let all = rival().rival("c", with_plateau()).series("d", with_plateau());
        let looks: Vec<_> = all.series.iter().map(|series| series.look).collect();
        let look = |line, rank| Look { line, rank };
        assert_eq!(looks, [look(0, 0), look(0, 1), look(0, 2), look(1, 0)]);
        let dashed = rival().rival("c", with_plateau()).svg().unwrap();
        // On the line and in the legend.
        let count = |style: &str| dashed.matches(&format!("stroke-dasharray=\"{style}\"")).count();
        assert_eq!((count("5 4"), count("0.5 4")), (2, 2));
    }

    #[test]
    fn three_points_are_a_figure_without_a_slope() {
        let points = [(0.1, 0.01), (0.05, 0.0025), (0.025, 0.0006)];
        let svg = LogLog::new("t", "h", "error").series("s", points).guide(2.0).svg().unwrap();
        assert!(svg.contains("no slope fitted"));
    }

    #[test]
    fn what_has_no_logarithm_is_named() {
        let error = |points: &[(f64, f64)]| {
            LogLog::new("title", "h", "error").series("s", points).svg().unwrap_err()
        };
        let empty = LogLog::new("title", "h", "error").svg().unwrap_err();
        assert!(matches!(empty, PlotError::Empty { name } if name == "title"));
        assert!(matches!(error(&[]), PlotError::Empty { name } if name == "s"));
        let zero = error(&[(0.1, 1.0), (0.2, 0.0)]);
        assert!(matches!(zero, PlotError::Point { index: 1, .. }), "{zero}");
        let nan = error(&[(f64::NAN, 1.0)]);
        assert!(matches!(nan, PlotError::Point { index: 0, .. }), "{nan}");
    }
}
