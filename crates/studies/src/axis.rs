//! The power of ten in which the numbers of an axis are drawn, and what is written along it.

use std::sync::Arc;

use kuva::render::layout::{ComputedLayout, Layout, TickFormat};
use kuva::render::render_utils::{compute_tick_step, generate_ticks_log};
use kuva::render::theme::Theme;

use crate::plot::{At, GREY, INK, NAME, NUMBER};

/// An axis over `[low, high]` of a number in units of `10^exponent`.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    low: f64,
    high: f64,
    exponent: i32,
    /// The distance between two ticks; `None` on a logarithmic axis.
    step: Option<f64>,
}

impl Axis {
    /// A linear axis over these numbers and a fraction of `padding` on either side, with about so many
    /// ticks. It begins at 0 where that is near.
    pub(crate) fn linear(
        numbers: impl IntoIterator<Item = f64>,
        padding: f64,
        ticks: usize,
    ) -> Self {
        let [low, high] = ends(numbers);
        let low = if low > 0.0 && low < 0.1 * high { 0.0 } else { low };
        let size = low.abs().max(high.abs());
        // A single value gets a tenth of itself on either side.
        let alone = if size > 0.0 { 0.1 * size } else { 1.0 };
        let margin = if high > low { padding * (high - low) } else { alone };
        let exponent = Some(decade(size)).filter(|d| !(-2..5).contains(d)).unwrap_or(0);
        let [low, high] = [low - margin, high + margin].map(|x| x / 10_f64.powi(exponent));
        let step = compute_tick_step(low, high, ticks);
        // A last tick that is nearly reached belongs to the axis.
        let last = (high / step).ceil() * step;
        let high = if last - high < 0.01 * (high - low) { last } else { high };
        Self { low, high, exponent, step: Some(step) }
    }

    /// A logarithmic axis over these positive numbers, and a little more on either side.
    ///
    /// The least number is about 1 on it: `kuva` draws nothing below 1e-10 on logarithmic axes.
    pub(crate) fn logarithmic(numbers: impl IntoIterator<Item = f64>) -> Self {
        let [low, high] = ends(numbers);
        let (exponent, margin) = (decade(low), 1.12 * (high / low).powf(0.03));
        let unit = 10_f64.powi(exponent);
        Self { low: low / margin / unit, high: high * margin / unit, exponent, step: None }
    }

    /// The number that is drawn for a value.
    pub(crate) fn reading(&self, value: f64) -> f64 {
        value / 10_f64.powi(self.exponent)
    }

    /// The factor between two numbers that are so far from each other on a logarithmic axis.
    pub(crate) fn fraction(&self, part: f64) -> f64 {
        (self.high / self.low).powf(part)
    }

    /// The quantity with its power of ten and its unit: `H − H₀ (10⁻¹⁶ J)`.
    pub(crate) fn label(&self, quantity: &str, unit: &str) -> String {
        let scaled = self.exponent != 0 && self.step.is_some();
        let factor = if scaled { power(self.exponent) } else { String::new() };
        let unit = format!("{factor} {unit}");
        match unit.trim() {
            "" => quantity.into(),
            unit => format!("{quantity} ({unit})"),
        }
    }

    /// The numbers along a logarithmic axis as they are written.
    fn written(&self) -> Vec<String> {
        let format = self.format();
        generate_ticks_log(self.low, self.high)
            .into_iter()
            .map(|tick| format.format(tick))
            .collect()
    }

    /// How the numbers along the axis are written.
    fn format(&self) -> TickFormat {
        let (decades, shift) = (decade(self.high) - decade(self.low), self.exponent);
        let Some(step) = self.step else {
            return TickFormat::Custom(Arc::new(move |tick| {
                let exponent = decade(tick * (1.0 + 1e-9));
                let (digit, total) = ((tick / 10_f64.powi(exponent)).round(), exponent + shift);
                match (digit > 1.5, decades < 3) {
                    (_, true) if (0..4).contains(&total) => {
                        (digit * 10_f64.powi(total)).to_string()
                    }
                    (true, true) => format!("{digit}×{}", power(total)),
                    (false, _) if total % (1 + (decades - 1) / 7) == 0 => power(total),
                    _ => String::new(),
                }
            }));
        };
        // A step is 1, 2, 2.5 or 5 times a power of ten.
        let digits = (0..9).find(|&n| (step * 10_f64.powi(n)).fract() < 1e-6).unwrap_or(9);
        let digits = usize::try_from(digits).unwrap_or(0);
        TickFormat::Custom(Arc::new(move |tick| match tick.abs() < 1e-9 * step {
            true => "0".into(),
            false => format!("{tick:.digits$}").replace('-', "−"),
        }))
    }
}

/// A pair of axes in the style of all figures.
pub(crate) fn layout(x: &Axis, y: &Axis) -> Layout {
    let theme = Theme {
        axis_color: GREY.into(),
        grid_color: "#E5E5E5".into(),
        tick_color: GREY.into(),
        text_color: INK.into(),
        ..Theme::light()
    };
    let mut layout = Layout::new((x.low, x.high), (y.low, y.high))
        .with_theme(theme)
        .with_box_axes()
        .with_label_size(NAME)
        .with_tick_size(NUMBER)
        .with_body_size(NUMBER)
        .with_axis_line_width(0.8)
        .with_grid_line_width(0.8)
        .with_tick_width(0.8)
        .with_tick_length(4.0)
        .with_x_axis_min(x.low)
        .with_x_axis_max(x.high)
        .with_y_axis_min(y.low)
        .with_y_axis_max(y.high)
        .with_x_tick_format(x.format())
        .with_y_tick_format(y.format());
    (layout.log_x, layout.log_y) = (x.step.is_none(), y.step.is_none());
    (layout.x_tick_step, layout.y_tick_step) = (x.step, y.step);
    // `kuva` leaves room for numbers as it writes them on a logarithmic axis, and these may be wider.
    if layout.log_y {
        let room = |layout: &Layout| ComputedLayout::from_layout(layout).y_tick_label_px;
        let left = room(&layout);
        layout.y_categories = Some(y.written());
        layout.y_label_offset.0 = (left - room(&layout)).min(0.0);
        layout.y_categories = None;
    }
    layout
}

/// The size of a frame, and the room around it.
pub(crate) struct Room {
    pub(crate) frame: At,
    pub(crate) left: f64,
    pub(crate) right: f64,
    pub(crate) top: f64,
    pub(crate) below: f64,
}

impl Room {
    /// Width and height of all.
    pub(crate) fn size(&self) -> At {
        (self.left + self.frame.0 + self.right, self.top + self.frame.1 + self.below)
    }

    /// Axes with this frame.
    pub(crate) fn around(&self, layout: Layout) -> Layout {
        let (width, height) = self.size();
        let layout = layout.with_force_margins(self.left, self.right);
        layout.with_force_margins_y(self.top, self.below).with_width(width).with_height(height)
    }
}

/// The room to the left of a frame: for the numbers along its axis, and their name.
pub(crate) fn room_left(layout: &Layout) -> f64 {
    ComputedLayout::from_layout(layout).margin_left - layout.y_label_offset.0
}

/// The least and the greatest of some numbers.
fn ends(numbers: impl IntoIterator<Item = f64>) -> [f64; 2] {
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    numbers.into_iter().fold(none, |[low, high], x| [low.min(x), high.max(x)])
}

/// The exponent of the largest power of ten that is not above a number.
fn decade(x: f64) -> i32 {
    format!("{x:e}").rsplit('e').next().and_then(|exponent| exponent.parse().ok()).unwrap_or(0)
}

/// `10⁻³`
fn power(exponent: i32) -> String {
    let digits = "⁰¹²³⁴⁵⁶⁷⁸⁹";
    let raised = |c: char| c.to_digit(10).and_then(|n| digits.chars().nth(n as usize));
    let exponent = exponent.to_string();
    format!("10{}", exponent.chars().map(|c| raised(c).unwrap_or('⁻')).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(axis: &Axis, tick: f64) -> String {
        axis.format().format(tick)
    }

    #[test]
    fn round_off_is_written_in_its_own_units() {
        let axis = Axis::linear([-2.2e-16, 4.4e-16], 0.05, 5);
        assert_eq!(axis.label("|ΔH|", ""), "|ΔH| (10⁻¹⁶)");
        assert_eq!(axis.label("|ΔH|", "J"), "|ΔH| (10⁻¹⁶ J)");
        assert!((axis.reading(2.2e-16) - 2.2).abs() < 1e-12);
    }

    #[test]
    fn ordinary_numbers_are_written_as_they_are() {
        let axis = Axis::linear([0.0, 1.0], 0.0, 5);
        assert_eq!([0.0, 0.2, -0.4].map(|x| written(&axis, x)), ["0", "0.2", "−0.4"]);
        assert_eq!((axis.label("t", ""), axis.label("t", "s")), ("t".into(), "t (s)".into()));
        assert_eq!(written(&Axis::linear([0.0, 2e4], 0.0, 4), 5e3), "5000");
        assert_eq!(written(&Axis::linear([0.0, 1.0], 0.0, 4), 0.5), "0.50");
    }

    #[test]
    fn an_axis_begins_at_zero_where_that_is_near() {
        let low = |low| Axis::linear([low, 30.0], 0.0, 4).low;
        assert_eq!((low(0.1), low(10.0)), (0.0, 10.0));
        for value in [0.0, 3.0, -1e-300] {
            let axis = Axis::linear([value, value], 0.05, 5);
            assert!(axis.low < axis.reading(value) && axis.reading(value) < axis.high);
        }
    }

    #[test]
    fn decades_are_powers_of_ten() {
        let axis = Axis::logarithmic([1e-15, 0.5]);
        let labels = (0..=15).map(|n| written(&axis, 10_f64.powi(n)));
        let labels: Vec<String> = labels.filter(|label| !label.is_empty()).collect();
        assert_eq!(labels, ["10⁻¹⁵", "10⁻¹²", "10⁻⁹", "10⁻⁶", "10⁻³", "10⁰"]);
        let narrow = Axis::logarithmic([0.03, 0.04]);
        assert_eq!([2.0, 5.0].map(|x| written(&narrow, x)), ["2×10⁻²", "5×10⁻²"]);
        let counts = Axis::logarithmic([2.0, 12.0]);
        assert_eq!([2.0, 10.0].map(|x| written(&counts, x)), ["2", "10"]);
    }
}
