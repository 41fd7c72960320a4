//! What is taken off the numbers of an axis before they are drawn, and what is written along it.

use std::sync::Arc;

use kuva::render::layout::{Layout, TickFormat};
use kuva::render::render_utils::compute_tick_step;

use crate::plot::{NAME, NUMBER, PlotError, theme};

/// An axis over `[low, high]` of `(number − offset)/10^exponent`, its numbers written in a common power
/// of ten and without the digits they share.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    low: f64,
    high: f64,
    offset: f64,
    /// Digits of the offset after the point.
    digits: usize,
    exponent: i32,
    /// About how many ticks there are.
    ticks: usize,
    logarithmic: bool,
}

impl Axis {
    /// A linear axis over `[low, high]` and a fraction of `padding` on either side, with about so many
    /// ticks. It begins at 0 where that is near.
    pub(crate) fn linear(
        (low, high): (f64, f64),
        padding: f64,
        ticks: f64,
    ) -> Result<Self, PlotError> {
        let low = if low > 0.0 && low < 0.1 * high { 0.0 } else { low };
        let margin = match (high > low, low.abs() > 0.0) {
            (true, _) => padding * (high - low),
            // A single value gets a tenth of itself on either side.
            (false, true) => 0.1 * low.abs(),
            (false, false) => 1.0,
        };
        let (low, high) = (low - margin, high + margin);
        let range = high - low;
        if !range.is_finite() {
            return Err(PlotError::Range { low, high });
        }
        let grain = range.log10().ceil();
        let unit = 10_f64.powf(grain);
        let shared = low.abs().max(high.abs()) > 1e3 * range;
        let offset = if shared { ((0.5 * low + 0.5 * high) / unit).round() * unit } else { 0.0 };
        let decade = (low - offset).abs().max((high - offset).abs()).log10().floor();
        let exponent =
            if (-2.0..5.0).contains(&decade) { 0 } else { integer(decade.clamp(-300.0, 300.0)) };
        let (digits, ticks) = (count(-grain), count(ticks).max(2));
        let axis = Self { low, high, offset, digits, exponent, ticks, logarithmic: false };
        Ok(Self { low: axis.reading(low), high: axis.reading(high), ..axis })
    }

    /// A logarithmic axis over `[low, high]`, both positive, and a little more on either side.
    ///
    /// The numbers are divided by a power of ten, so that the least is about 1: `kuva` draws nothing below
    /// 1e-10 on logarithmic axes.
    pub(crate) fn logarithmic((low, high): (f64, f64)) -> Self {
        let (low, high) = (low.log10(), high.log10());
        let (exponent, margin) = (integer(low.floor()), 0.05 + 0.03 * (high - low));
        let [low, high] =
            [low - margin, high + margin].map(|x| 10_f64.powf(x - f64::from(exponent)));
        Self { low, high, offset: 0.0, digits: 0, exponent, ticks: 8, logarithmic: true }
    }

    /// The number that is drawn for a value.
    pub(crate) fn reading(&self, value: f64) -> f64 {
        (value - self.offset) / 10_f64.powi(self.exponent)
    }

    /// The factor between two numbers that are so far from each other on a logarithmic axis.
    pub(crate) fn fraction(&self, part: f64) -> f64 {
        (self.high / self.low).powf(part)
    }

    /// The quantity, with what is taken off it, and the unit: `H − 0.5 (10⁻¹⁶ J)`.
    pub(crate) fn label(&self, quantity: &str, unit: &str) -> String {
        let mut label = quantity.to_owned();
        if self.offset.abs() > 0.0 {
            let sign = if self.offset > 0.0 { '−' } else { '+' };
            let named = if label.is_empty() { "value" } else { &label };
            let shown = format!("{:.*}", self.digits, self.offset.abs());
            let shown = shown.split_once('.').map_or(shown.clone(), |(whole, fraction)| {
                format!("{whole}.{}", fraction.trim_end_matches('0'))
            });
            label = format!("{named} {sign} {}", shown.trim_end_matches('.'));
        }
        let scaled = self.exponent != 0 && !self.logarithmic;
        let factor = if scaled { power(self.exponent) } else { String::new() };
        match [factor.as_str(), unit].map(str::is_empty) {
            [true, true] => label,
            [false, false] => format!("{label} ({factor} {unit})"),
            _ => format!("{label} ({factor}{unit})"),
        }
    }

    /// How the numbers along the axis are written.
    fn format(&self) -> TickFormat {
        if self.logarithmic {
            let decades = (self.high / self.low).log10();
            let (shift, every) = (self.exponent, integer((decades / 7.0).ceil()).max(1));
            return TickFormat::Custom(Arc::new(move |tick| {
                let exponent = integer((tick.log10() + 1e-9).floor());
                let (digit, total) = ((tick / 10_f64.powi(exponent)).round(), exponent + shift);
                match (digit > 1.5, decades < 2.0) {
                    (_, true) if (0..4).contains(&total) => {
                        format!("{}", digit * 10_f64.powi(total))
                    }
                    (true, true) => format!("{digit}×{}", power(total)),
                    (false, _) if total.rem_euclid(every) == 0 => power(total),
                    _ => String::new(),
                }
            }));
        }
        let step = compute_tick_step(self.low, self.high, self.ticks);
        let digits = (0..9).find(|&n| {
            let scaled = step * 10_f64.powi(n);
            (scaled - scaled.round()).abs() < 1e-6 * scaled
        });
        let digits = usize::try_from(digits.unwrap_or(9)).unwrap_or(9);
        TickFormat::Custom(Arc::new(move |tick| {
            let zero = tick.abs() < 1e-9 * step;
            if zero { "0".into() } else { format!("{tick:.digits$}").replace('-', "−") }
        }))
    }
}

/// A pair of axes in the style of all figures.
pub(crate) fn layout(x: &Axis, y: &Axis) -> Layout {
    let mut layout = Layout::new((x.low, x.high), (y.low, y.high))
        .with_theme(theme())
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
    (layout.log_x, layout.log_y) = (x.logarithmic, y.logarithmic);
    for (axis, step) in [(x, &mut layout.x_tick_step), (y, &mut layout.y_tick_step)] {
        *step = (!axis.logarithmic).then(|| compute_tick_step(axis.low, axis.high, axis.ticks));
    }
    layout
}

/// `10⁻³`
fn power(exponent: i32) -> String {
    let raised = |c: char| {
        c.to_digit(10).map_or('⁻', |n| "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(n as usize).unwrap_or(c))
    };
    format!("10{}", exponent.to_string().chars().map(raised).collect::<String>())
}

#[expect(clippy::cast_possible_truncation, reason = "saturates; decimal exponents are small")]
fn integer(x: f64) -> i32 {
    x.round() as i32
}

fn count(x: f64) -> usize {
    usize::try_from(integer(x)).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(axis: &Axis, tick: f64) -> String {
        axis.format().format(tick)
    }

    #[test]
    fn round_off_is_written_in_its_own_units() {
        let axis = Axis::linear((-2.2e-16, 4.4e-16), 0.05, 5.0).unwrap();
        assert_eq!(axis.label("|ΔH|", ""), "|ΔH| (10⁻¹⁶)");
        assert_eq!(axis.label("|ΔH|", "J"), "|ΔH| (10⁻¹⁶ J)");
        assert!((axis.reading(2.2e-16) - 2.2).abs() < 1e-12);
    }

    #[test]
    fn ordinary_numbers_are_written_as_they_are() {
        let axis = Axis::linear((0.0, 1.0), 0.0, 5.0).unwrap();
        assert_eq!([0.0, 0.2, -0.4].map(|x| written(&axis, x)), ["0", "0.2", "−0.4"]);
        assert_eq!((axis.label("t", ""), axis.label("t", "s")), ("t".into(), "t (s)".into()));
        let long = Axis::linear((0.0, 2e4), 0.0, 4.0).unwrap();
        assert_eq!(written(&long, 5e3), "5000");
    }

    #[test]
    fn common_digits_are_taken_off() {
        let axis = Axis::linear((0.5 - 2e-13, 0.5 + 3.1e-13), 0.0, 5.0).unwrap();
        assert_eq!(axis.label("H", ""), "H − 0.5 (10⁻¹³)");
        let negative = Axis::linear((-12.3456789, -12.3456786), 0.0, 5.0).unwrap();
        assert_eq!(negative.label("", ""), "value + 12.345679 (10⁻⁷)");
    }

    #[test]
    fn an_axis_begins_at_zero_where_that_is_near() {
        let axis = |low| Axis::linear((low, 30.0), 0.0, 4.0).unwrap();
        assert_eq!((axis(0.1).low, axis(10.0).low), (0.0, 10.0));
        let single = Axis::linear((3.0, 3.0), 0.05, 4.0).unwrap();
        assert!(single.low < 3.0 && single.high > 3.0);
    }

    #[test]
    fn decades_are_powers_of_ten() {
        let axis = Axis::logarithmic((1e-15, 0.5));
        let labels: Vec<String> =
            (0..=15).map(|n| written(&axis, 10_f64.powi(n))).filter(|l| !l.is_empty()).collect();
        assert_eq!(labels, ["10⁻¹⁵", "10⁻¹²", "10⁻⁹", "10⁻⁶", "10⁻³", "10⁰"]);
        let narrow = Axis::logarithmic((0.03, 0.04));
        assert_eq!([2.0, 5.0].map(|x| written(&narrow, x)), ["2×10⁻²", "5×10⁻²"]);
        let counts = Axis::logarithmic((2.0, 12.0));
        assert_eq!([2.0, 10.0].map(|x| written(&counts, x)), ["2", "10"]);
    }

    #[test]
    fn an_endless_axis_is_refused() {
        let result = Axis::linear((-f64::MAX, f64::MAX), 0.0, 5.0);
        assert!(matches!(result, Err(PlotError::Range { .. })));
    }
}
