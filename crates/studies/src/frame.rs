//! A pair of axes with its grid, numbers and names.

use plotters::style::RGBColor;

use crate::{
    axis::Axis,
    canvas::{At, Canvas, GREY, GRID, INK, Type, length},
    plot::PlotError,
};

/// Sizes of text, in pixels.
pub(crate) const TITLE: f64 = 16.0;
pub(crate) const SUBTITLE: f64 = 13.5;
pub(crate) const NAME: f64 = 12.0;
pub(crate) const NUMBER: f64 = 11.0;

/// Room for the numbers and the name under the frame.
pub(crate) const BELOW: f64 = 44.0;

/// Axes `x`, `y` on the rectangle from `upper_left` to `lower_right`.
pub(crate) struct Frame {
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    pub(crate) upper_left: At,
    pub(crate) lower_right: At,
}

/// Room for the numbers and the name to the left of a frame with this axis.
pub(crate) fn margin(y: &Axis, name: &str) -> f64 {
    let numbers = y.ticks.iter().map(|tick| length(&tick.label, NUMBER)).fold(0.0, f64::max);
    numbers + if y.label(name).is_empty() { 16.0 } else { 36.0 }
}

impl Frame {
    /// Where a point lies on the sheet.
    pub(crate) fn at(&self, (x, y): (f64, f64)) -> At {
        self.between(self.x.place(x), self.y.place(y))
    }

    /// Grid, numbers and names.
    pub(crate) fn draw(&self, canvas: &Canvas<'_>, names: (&str, &str)) -> Result<(), PlotError> {
        self.draw_vertical(canvas)?;
        self.draw_horizontal(canvas)?;
        self.border(canvas)?;
        let ((x0, y0), (x1, y1)) = (self.upper_left, self.lower_right);
        let middle = (0.5 * (x0 + x1), 0.5 * (y0 + y1));
        let (x, y) = (self.x.label(names.0), self.y.label(names.1));
        let set = Type::centred(NAME).fitting(&x, x1 - x0);
        canvas.text(&x, (middle.0, y1 + 34.0), set)?;
        let left = x0 - margin(&self.y, names.1) + 12.0;
        canvas.text(&y, (left, middle.1), Type::upwards(NAME).fitting(&y, y1 - y0 + 20.0))
    }

    /// A dashed line at this height.
    pub(crate) fn level(&self, canvas: &Canvas<'_>, y: f64) -> Result<(), PlotError> {
        let place = self.y.place(y);
        canvas.dashed(&[self.between(0.0, place), self.between(1.0, place)], INK)
    }

    fn between(&self, u: f64, v: f64) -> At {
        let ((x0, y0), (x1, y1)) = (self.upper_left, self.lower_right);
        (x0 + u * (x1 - x0), y1 + v * (y0 - y1))
    }

    fn draw_vertical(&self, canvas: &Canvas<'_>) -> Result<(), PlotError> {
        for tick in &self.x.ticks {
            let (x, y) = self.between(tick.place, 0.0);
            self.rule(canvas, [(x, y), self.between(tick.place, 1.0)], GRID)?;
            if !tick.label.is_empty() {
                self.rule(canvas, [(x, y), (x, y + 4.0)], GREY)?;
                canvas.text(&tick.label, (x, y + 14.0), Type::centred(NUMBER))?;
            }
        }
        Ok(())
    }

    fn draw_horizontal(&self, canvas: &Canvas<'_>) -> Result<(), PlotError> {
        for tick in &self.y.ticks {
            let (x, y) = self.between(0.0, tick.place);
            self.rule(canvas, [(x, y), self.between(1.0, tick.place)], GRID)?;
            if !tick.label.is_empty() {
                self.rule(canvas, [(x - 4.0, y), (x, y)], GREY)?;
                canvas.text(&tick.label, (x - 7.0, y), Type::right(NUMBER))?;
            }
        }
        Ok(())
    }

    fn border(&self, canvas: &Canvas<'_>) -> Result<(), PlotError> {
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)];
        self.rule(canvas, corners.map(|(u, v)| self.between(u, v)), GREY)
    }

    fn rule(
        &self,
        canvas: &Canvas<'_>,
        points: impl IntoIterator<Item = At>,
        color: RGBColor,
    ) -> Result<(), PlotError> {
        canvas.line(points, color, 0.8)
    }
}
