//! From numbers to places on an axis, and what is written along it.

use crate::plot::PlotError;

/// An axis from `u = 0` at its lower to `u = 1` at its upper end.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    low: f64,
    high: f64,
    scale: Scale,
    pub(crate) ticks: Vec<Tick>,
}

#[derive(Clone, Debug)]
pub(crate) struct Tick {
    /// Place in `[0, 1]`.
    pub(crate) place: f64,
    /// What is written there; empty for a grid line only.
    pub(crate) label: String,
}

#[derive(Clone, Copy, Debug)]
enum Scale {
    /// `(value − offset) / 10^exponent`, the offset written with so many digits after the point.
    Linear { offset: f64, digits: usize, exponent: i32 },
    /// `log₁₀ value`
    Logarithmic,
}

impl Axis {
    /// A linear axis over `[low, high]` and a fraction of `padding` on either side, with about
    /// `count` ticks. Values that agree in their first three digits are written without them.
    pub(crate) fn linear(
        (low, high): (f64, f64),
        padding: f64,
        count: f64,
    ) -> Result<Self, PlotError> {
        let (low, high) = widened(low, high, padding);
        if !(high - low).is_finite() {
            return Err(PlotError::Range { low, high });
        }
        let scale = Scale::of(low, high);
        let (low, high) = (scale.reading(low), scale.reading(high));
        let axis = Self { low, high, scale, ticks: Vec::new() };
        Ok(Self { ticks: axis.linear_ticks(count), ..axis })
    }

    /// A logarithmic axis over `[low, high]`, both positive, widened to the next 1, 2 or 5.
    pub(crate) fn logarithmic((low, high): (f64, f64)) -> Self {
        let (low, high) = (low.log10(), high.log10());
        let margin = 0.05 + 0.03 * (high - low);
        let (low, high) = (below(low - margin), above(high + margin));
        let axis = Self { low, high, scale: Scale::Logarithmic, ticks: Vec::new() };
        Self { ticks: axis.logarithmic_ticks(), ..axis }
    }

    /// Where a value lies between the ends of the axis.
    pub(crate) fn place(&self, value: f64) -> f64 {
        self.fraction(self.scale.reading(value))
    }

    /// The name of the axis with what is taken off its numbers: `H − 0.5 (units of 10⁻¹⁶)`.
    pub(crate) fn label(&self, name: &str) -> String {
        let Scale::Linear { offset, digits, exponent } = self.scale else { return name.into() };
        let sign = if offset > 0.0 { '−' } else { '+' };
        let taken = match (offset.abs() > 0.0, name.is_empty()) {
            (false, _) => name.into(),
            (true, false) => format!("{name} {sign} {:.digits$}", offset.abs()),
            (true, true) => format!("value {sign} {:.digits$}", offset.abs()),
        };
        match (exponent, taken.is_empty()) {
            (0, _) => taken,
            (_, true) => format!("units of {}", power(exponent)),
            (_, false) => format!("{taken} (units of {})", power(exponent)),
        }
    }

    fn fraction(&self, reading: f64) -> f64 {
        (reading - self.low) / (self.high - self.low)
    }

    fn linear_ticks(&self, count: f64) -> Vec<Tick> {
        let step = round_step((self.high - self.low) / count);
        let digits = digits_of(step);
        let inside = (self.low / step - 1e-6).ceil()..=(self.high / step + 1e-6).floor();
        let label = |value: f64| format!("{value:.digits$}").replace('-', "−");
        multiples(inside)
            // Adding zero turns −0 into 0.
            .map(|n| n * step + 0.0)
            .map(|value| Tick { place: self.fraction(value), label: label(value) })
            .collect()
    }

    /// Powers of ten; 2 and 5 times them on less than two decades; grid lines on less than 2.5.
    fn logarithmic_ticks(&self) -> Vec<Tick> {
        let decades = self.high - self.low;
        let every = (decades / 7.0).ceil().max(1.0);
        let written = |digit: f64, exponent: f64| match digit {
            1.0 => exponent.rem_euclid(every) < 0.5,
            2.0 | 5.0 => decades < 2.0,
            _ => false,
        };
        let drawn = |digit: f64| decades < 2.5 || digit < 2.0;
        let tick = |digit: f64, exponent: f64| Tick {
            place: self.fraction(exponent + digit.log10()),
            label: if written(digit, exponent) { decimal(digit, exponent) } else { String::new() },
        };
        multiples(self.low.floor()..=self.high.ceil())
            .flat_map(|exponent| multiples(1.0..=9.0).map(move |digit| (digit, exponent)))
            .filter(|(digit, exponent)| {
                drawn(*digit) && (*digit > 1.5 || exponent.rem_euclid(every) < 0.5)
            })
            .map(|(digit, exponent)| tick(digit, exponent))
            .filter(|tick| (-1e-9..=1.0 + 1e-9).contains(&tick.place))
            .collect()
    }
}

impl Scale {
    fn of(low: f64, high: f64) -> Self {
        let (range, size) = (high - low, low.abs().max(high.abs()));
        let grain = range.log10().ceil();
        let offset = if size > 1e3 * range {
            let unit = 10_f64.powf(grain);
            ((0.5 * low + 0.5 * high) / unit).round() * unit
        } else {
            0.0
        };
        let left = (low - offset).abs().max((high - offset).abs());
        let decade = left.log10().floor().clamp(-300.0, 300.0);
        let exponent = if (-2.0..5.0).contains(&decade) { 0.0 } else { decade };
        Self::Linear { offset, digits: shortest(offset, -grain), exponent: integer(exponent) }
    }

    fn reading(self, value: f64) -> f64 {
        match self {
            Self::Linear { offset, exponent, .. } => (value - offset) * 10_f64.powi(-exponent),
            Self::Logarithmic => value.log10(),
        }
    }
}

/// The range with its padding; a single value gets a tenth of itself on either side, zero gets 1.
fn widened(low: f64, high: f64, padding: f64) -> (f64, f64) {
    let margin = if high > low {
        padding * (high - low)
    } else if low.abs() > 0.0 {
        0.1 * low.abs()
    } else {
        1.0
    };
    (low - margin, high + margin)
}

/// The 1, 2 or 5 times a power of ten whose ratio to `step` is nearest to one.
fn round_step(step: f64) -> f64 {
    let unit = 10_f64.powf(step.log10().floor());
    let misfit = |digit: &f64| (digit * unit / step).ln().abs();
    let digits = [1.0, 2.0, 5.0, 10.0].into_iter();
    unit * digits.min_by(|a, b| misfit(a).total_cmp(&misfit(b))).unwrap_or(1.0)
}

/// The `log₁₀` of the largest of 1, 2, 5 times a power of ten that is not above `10^x`.
fn below(x: f64) -> f64 {
    let digits = [0.0, 2_f64.log10(), 5_f64.log10()];
    digits.into_iter().rev().map(|d| x.floor() + d).find(|y| *y <= x).unwrap_or(x)
}

/// The `log₁₀` of the smallest of 1, 2, 5 times a power of ten that is not below `10^x`: as 1/2 and
/// 1/5 are 5 and 2 tenths, the mirror image of [`below`].
fn above(x: f64) -> f64 {
    -below(-x)
}

/// Digits after the point that a multiple of `step` needs.
fn digits_of(step: f64) -> usize {
    count((-step.log10() - 1e-9).ceil())
}

/// Digits after the point, up to `most`, that `value` needs.
fn shortest(value: f64, most: f64) -> usize {
    let most = count(most);
    let exact = format!("{value:.most$}");
    exact.split_once('.').map_or(0, |(_, fraction)| fraction.trim_end_matches('0').len())
}

fn multiples(range: std::ops::RangeInclusive<f64>) -> impl Iterator<Item = f64> {
    let (first, last) = range.into_inner();
    (0..).map(move |n: u16| first + f64::from(n)).take_while(move |n| *n <= last + 0.5)
}

/// `2×10⁻³`, `10⁻³`.
fn decimal(digit: f64, exponent: f64) -> String {
    let power = power(integer(exponent));
    if digit > 1.5 { format!("{digit}×{power}") } else { power }
}

/// `10⁻³`
fn power(exponent: i32) -> String {
    let raised = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '4' => '⁴',
        '5' => '⁵',
        '6' => '⁶',
        '7' => '⁷',
        '8' => '⁸',
        '9' => '⁹',
        _ => '⁰',
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
    use proptest::prelude::*;

    use super::*;

    fn labels(axis: &Axis) -> Vec<&str> {
        axis.ticks.iter().map(|t| t.label.as_str()).filter(|label| !label.is_empty()).collect()
    }

    #[test]
    fn round_off_is_written_in_its_own_units() {
        let axis = Axis::linear((-2.2e-16, 4.4e-16), 0.05, 5.0).unwrap();
        assert_eq!(labels(&axis), ["−2", "0", "2", "4"]);
        assert_eq!(axis.label("|ΔH|"), "|ΔH| (units of 10⁻¹⁶)");
        assert_eq!(axis.label(""), "units of 10⁻¹⁶");
    }

    #[test]
    fn ordinary_numbers_are_written_as_they_are() {
        let axis = Axis::linear((0.0, 1.0), 0.0, 5.0).unwrap();
        assert_eq!(labels(&axis), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(axis.label("t"), "t");
        let long = Axis::linear((0.0, 2e4), 0.0, 4.0).unwrap();
        assert_eq!(labels(&long), ["0", "5000", "10000", "15000", "20000"]);
    }

    #[test]
    fn common_digits_are_taken_off() {
        let axis = Axis::linear((0.5 - 2e-13, 0.5 + 3.1e-13), 0.0, 5.0).unwrap();
        assert_eq!(axis.label("H"), "H − 0.5 (units of 10⁻¹³)");
        assert_eq!(labels(&axis), ["−2", "−1", "0", "1", "2", "3"]);
        let negative = Axis::linear((-12.3456789, -12.3456786), 0.0, 5.0).unwrap();
        assert_eq!(negative.label(""), "value + 12.345679 (units of 10⁻⁷)");
    }

    #[test]
    fn a_single_value_has_an_axis() {
        assert_eq!(
            labels(&Axis::linear((0.0, 0.0), 0.05, 4.0).unwrap()),
            ["−1.0", "−0.5", "0.0", "0.5", "1.0"]
        );
        let axis = Axis::linear((3.0, 3.0), 0.05, 4.0).unwrap();
        assert!((axis.place(3.0) - 0.5).abs() < 1e-12);
        assert!(labels(&axis).contains(&"3.0"));
    }

    #[test]
    fn decades_are_powers_of_ten() {
        assert_eq!(labels(&Axis::logarithmic((3e-4, 0.5))), ["10⁻³", "10⁻²", "10⁻¹", "10⁰"]);
        assert_eq!(
            labels(&Axis::logarithmic((1e-15, 0.5))),
            ["10⁻¹⁵", "10⁻¹²", "10⁻⁹", "10⁻⁶", "10⁻³", "10⁰"]
        );
        assert_eq!(labels(&Axis::logarithmic((0.03, 0.04))), ["2×10⁻²", "5×10⁻²"]);
    }

    #[test]
    fn an_endless_axis_is_refused() {
        let result = Axis::linear((-f64::MAX, f64::MAX), 0.0, 5.0);
        assert!(matches!(result, Err(PlotError::Range { .. })));
    }

    proptest! {
        #[test]
        fn every_axis_has_a_few_ticks_that_differ(
            centre in -10.0..10.0_f64, size in -18.0..18.0_f64, at in -18.0..18.0_f64
        ) {
            let (half, centre) = (10_f64.powf(size), centre * 10_f64.powf(at));
            let ends = (centre - half, centre + half);
            let axis = Axis::linear(ends, 0.05, 5.0).unwrap();
            let mut labels = labels(&axis);
            prop_assert!((2..=8).contains(&labels.len()), "{labels:?}");
            labels.dedup();
            prop_assert_eq!(labels.len(), axis.ticks.len());
            prop_assert!(labels.iter().all(|label| label.chars().count() <= 9), "{:?}", labels);
            prop_assert!((0.0..=1.0).contains(&axis.place(ends.0)), "{:?}", axis);
            prop_assert!((0.0..=1.0).contains(&axis.place(ends.1)), "{:?}", axis);
        }

        #[test]
        fn every_logarithmic_axis_has_a_few_labels(low in -18.0..3.0_f64, decades in 0.0..20.0_f64) {
            let ends = (10_f64.powf(low), 10_f64.powf(low + decades));
            let axis = Axis::logarithmic(ends);
            prop_assert!((2..=9).contains(&labels(&axis).len()), "{axis:?}");
            prop_assert!(axis.place(ends.0) > 0.0 && axis.place(ends.1) < 1.0);
        }
    }
}
