//! Convergence on doubly logarithmic axes.

use std::path::PathBuf;

use crate::{
    axis::Axis,
    canvas::{self, At, Canvas, GREY, INK, Marker, Type, color, length},
    frame::{self, Frame},
    order::Order,
    plot::{self, PlotError},
};

/// Height of an entry of the legend, of one below it for the same problem, and between two problems.
const ROW: f64 = 36.0;
const RIVAL: f64 = 20.0;
const GAP: f64 = 6.0;
/// Length of the line that stands in it.
const SAMPLE: f64 = 30.0;

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

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Look {
    /// The number of its colour and marker.
    line: usize,
    /// Its place among the series of this number: solid, dashed, and dotted from the third on.
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
    /// [`PlotError::Empty`] without series or points, [`PlotError::NonPositive`] and
    /// [`PlotError::NonFinite`] for a point without logarithms.
    pub fn svg(&self) -> Result<String, PlotError> {
        let frame = self.frame()?;
        let column = frame.lower_right.0 + 20.0;
        let legend = self.series.iter().map(Series::legend_width).fold(0.0, f64::max);
        let title = length(&self.title, frame::TITLE) + 20.0;
        let width = (column + legend + 8.0).max(title);
        let rows = frame.upper_left.1 + self.series.iter().map(Series::height).sum::<f64>();
        let height = rows.max(frame.lower_right.1 + frame::BELOW) + 6.0;
        canvas::sheet((width, height), |canvas| {
            let middle = 0.5 * (frame.upper_left.0 + frame.lower_right.0);
            let centre = middle.max(0.5 * title);
            canvas.text(&self.title, (centre, 22.0), Type::centred(frame::TITLE))?;
            frame.draw(canvas, (&self.horizontal, &self.vertical))?;
            self.guides.iter().try_for_each(|&p| self.draw_guide(canvas, &frame, p))?;
            self.draw_series(canvas, &frame)?;
            self.draw_legend(canvas, (column, frame.upper_left.1 + 10.0))
        })
    }

    /// Writes the figure to a file.
    ///
    /// # Errors
    ///
    /// Those of [`LogLog::svg`], and [`PlotError::Io`] if the file cannot be written.
    pub fn save(&self, path: impl Into<PathBuf>) -> Result<(), PlotError> {
        plot::save(path.into(), &self.svg()?)
    }

    fn frame(&self) -> Result<Frame, PlotError> {
        if self.series.is_empty() {
            return Err(PlotError::Empty { name: self.title.clone() });
        }
        self.series.iter().try_for_each(Series::check)?;
        let points = || self.series.iter().flat_map(|series| &series.points);
        let (x, y) = (ends(points().map(|p| p.0)), ends(points().map(|p| p.1)));
        let (x, y) = (Axis::logarithmic(x), Axis::logarithmic(y));
        let left = 8.0 + frame::margin(&y, &self.vertical);
        Ok(Frame { x, y, upper_left: (left, 46.0), lower_right: (left + 440.0, 406.0) })
    }

    fn draw_series(&self, canvas: &Canvas<'_>, frame: &Frame) -> Result<(), PlotError> {
        for series in &self.series {
            let path: Vec<At> = series.points.iter().map(|&point| frame.at(point)).collect();
            let line = series.look.line;
            series.look.draw(canvas, &path)?;
            for (index, &point) in series.given.iter().enumerate() {
                let filled = !series.is_round_off(index);
                canvas.marker(frame.at(point), Marker { line, filled })?;
            }
        }
        Ok(())
    }

    fn draw_legend(&self, canvas: &Canvas<'_>, (left, top): At) -> Result<(), PlotError> {
        let mut bottom = top - GAP;
        for series in &self.series {
            let y = bottom + if series.look.rank == 0 { GAP } else { 0.0 };
            bottom += series.height();
            series.look.draw(canvas, &[(left, y), (left + SAMPLE, y)])?;
            let marker = Marker { line: series.look.line, filled: true };
            canvas.marker((left + 0.5 * SAMPLE, y), marker)?;
            let beside = left + SAMPLE + 8.0;
            let small = Type::left(frame::NUMBER).grey();
            if series.look.rank == 0 {
                canvas.text(&series.label, (beside, y), Type::left(frame::NAME))?;
                canvas.text(&series.slope_label(), (beside, y + 16.0), small)?;
            } else {
                canvas.text(&series.rival_label(), (beside, y), small)?;
            }
        }
        Ok(())
    }

    /// A triangle to the lower right of the middle of the series.
    fn draw_guide(&self, canvas: &Canvas<'_>, frame: &Frame, p: f64) -> Result<(), PlotError> {
        let misfit = |series: &&Series| (series.slope() - p).abs();
        let nearest = self.series.iter().min_by(|a, b| misfit(a).total_cmp(&misfit(b)));
        let Some((low, high)) = nearest.map(Series::middle) else { return Ok(()) };
        let rise = |x: f64| high.1 * (x / high.0).powf(p);
        let shift = |(x, y): At| (x + 12.0, y + 8.0);
        let (start, end) = (shift(frame.at((low.0, rise(low.0)))), shift(frame.at(high)));
        let corner = (end.0, start.1);
        canvas.line([start, corner, end, start], GREY, 1.0)?;
        let beside = (end.0 + 6.0, 0.5 * (corner.1 + end.1));
        let label = Type { color: INK, ..Type::left(frame::NUMBER) };
        canvas.text(&format!("{p}"), beside, label)
    }
}

impl Look {
    fn draw(self, canvas: &Canvas<'_>, path: &[At]) -> Result<(), PlotError> {
        match self.rank {
            0 => canvas.line(path.iter().copied(), color(self.line), 1.2),
            1 => canvas.dashed(path, color(self.line)),
            _ => canvas.dotted(path, color(self.line)),
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

    fn check(&self) -> Result<(), PlotError> {
        if self.given.is_empty() {
            return Err(PlotError::Empty { name: self.label.clone() });
        }
        let name = || self.label.clone();
        for (index, &(x, y)) in self.given.iter().enumerate() {
            if !(x.is_finite() && y.is_finite()) {
                return Err(PlotError::NonFinite { name: name(), index, x, y });
            }
            if x.min(y) <= 0.0 {
                return Err(PlotError::NonPositive { name: name(), index, x, y });
            }
        }
        Ok(())
    }

    fn slope(&self) -> f64 {
        self.order.as_ref().map_or(0.0, |order| order.slope)
    }

    fn slope_label(&self) -> String {
        self.order
            .as_ref()
            .map_or_else(|| "no slope fitted".into(), |order| format!("slope {order}"))
    }

    /// The slope with the name of a rival, on one line.
    fn rival_label(&self) -> String {
        format!("{}, {}", self.label, self.slope_label())
    }

    /// The height of its entry in the legend, with the gap above it.
    const fn height(&self) -> f64 {
        if self.look.rank == 0 { GAP + ROW } else { RIVAL }
    }

    fn legend_width(&self) -> f64 {
        let number = |text: String| length(&text, frame::NUMBER);
        let text = if self.look.rank == 0 {
            length(&self.label, frame::NAME).max(number(self.slope_label()))
        } else {
            number(self.rival_label())
        };
        SAMPLE + 8.0 + text
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

fn ends(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    (values.clone().fold(f64::INFINITY, f64::min), values.fold(0.0, f64::max))
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
        let polygons =
            |fill: &str| svg.matches(&format!("<polygon opacity=\"1\" fill=\"{fill}\"")).count();
        assert_eq!(polygons("#FFFFFF"), order.plateau.len());
        // One of the filled ones is in the legend.
        assert_eq!(polygons("#0072B2"), order.used.len() + 1);
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
    fn rivals_are_dashed_and_dotted_in_the_colour_of_what_they_rival() {
        let figure = || LogLog::new("t", "h", "error").series("a", with_plateau());
        let rival = || figure().rival("b", with_plateau());
        let all = rival().rival("c", with_plateau()).series("d", with_plateau());
        let looks: Vec<_> = all.series.iter().map(|series| series.look).collect();
        let look = |line, rank| Look { line, rank };
        assert_eq!(looks, [look(0, 0), look(0, 1), look(0, 2), look(1, 0)]);
        let lines = |figure: LogLog| figure.svg().unwrap().matches("<polyline").count();
        let [solid, dashed, dotted] =
            [figure().series("b", with_plateau()), rival(), rival().rival("c", with_plateau())]
                .map(lines);
        assert!(solid < dashed && dashed - solid < dotted - dashed);
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
        assert!(matches!(zero, PlotError::NonPositive { index: 1, .. }), "{zero}");
        let nan = error(&[(f64::NAN, 1.0)]);
        assert!(matches!(nan, PlotError::NonFinite { index: 0, .. }), "{nan}");
    }
}
