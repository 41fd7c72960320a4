//! A grid of panels with lines, and globes beside it.

use std::path::PathBuf;

use crate::{
    frame::Room,
    globe::Globe,
    panel::Panel,
    plot::{self, At, PlotError},
};

/// Stretches of a line of which the lowest and the highest point are drawn, at most.
const STRETCHES: usize = 700;
/// Stretches of all lines of a figure: what keeps its file below some 300 kB.
const ALL_STRETCHES: usize = 12_000;

/// Room to the right of a panel, and for the numbers and the name below it.
const RIGHT: f64 = 16.0;
const BELOW: f64 = 42.0;
/// Room around the sheet, and for the title.
const EDGE: f64 = 8.0;
const HEAD: f64 = 36.0;

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
        let cell = room.size();
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
            let at = (x, HEAD + 0.5 * (height - size.1));
            sheet = sheet.add(plot::placed(at, globe.parts(letter, *size)));
            x += size.0;
        }
        let lines: usize = self.panels.iter().map(|panel| panel.lines.len()).sum();
        let stretches = STRETCHES.min(ALL_STRETCHES / lines.max(1)).max(1);
        for (index, panel) in self.panels.iter().enumerate() {
            let parts = panel.parts(letters.next().unwrap_or(' '), &room, stretches);
            let (column, row) = ((index % columns) as f64, (index / columns) as f64);
            let y = HEAD + 0.5 * (height - grid.1) + row * cell.1;
            sheet = sheet.add(plot::placed((start + column * cell.0, y), parts));
        }
        Ok(sheet.to_string())
    }

    /// Writes the figure to a file.
    ///
    /// # Errors
    ///
    /// The errors of [`Panels::svg`], and [`PlotError::Io`] if the file cannot be written.
    pub fn save(&self, path: impl Into<PathBuf>) -> Result<(), PlotError> {
        plot::save(path.into(), &self.svg()?)
    }

    /// The room of each panel: the same for all, so that their frames line up.
    fn room(&self, frame: At) -> Room {
        let left = self.panels.iter().map(|panel| Room::left_of(&panel.axes(frame)[1]));
        let left = left.fold(0.0, f64::max);
        let headers = self.panels.iter().map(|panel| panel.header(left + frame.0).height);
        let top = headers.fold(0.0, f64::max);
        Room { frame, left, right: RIGHT, top, below: BELOW }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::panel::thinned;

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
        let [x, y] = Panel::new("y", "x").line("", circle).equal().axes((340.0, 210.0));
        let width = 340.0 * (x.place(4.0) - x.place(2.0));
        let height = 210.0 * (y.place(6.0) - y.place(4.0));
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
