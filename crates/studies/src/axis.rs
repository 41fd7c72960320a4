//! The range of an axis, the power of ten in which its numbers are drawn, and what is written along it.

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
    pub(crate) fn linear(numbers: impl IntoIterator<Item = f64>, padding: f64, ticks: u8) -> Self {
        let [low, high] = ends(numbers);
        let low = if low > 0.0 && low < 0.1 * high { 0.0 } else { low };
        let size = low.abs().max(high.abs());
        // A single value gets a tenth of itself on either side.
        let alone = if size > 0.0 { 0.1 * size } else { 1.0 };
        let margin = if high > low { padding * (high - low) } else { alone };
        let exponent = Some(decade(size)).filter(|d| !(-2..5).contains(d)).unwrap_or(0);
        let [low, high] = [low - margin, high + margin].map(|x| x / 10_f64.powi(exponent));
        let step = round_step((high - low) / f64::from(ticks));
        // A last tick that is nearly reached belongs to the axis.
        let last = (high / step).ceil() * step;
        let high = if last - high < 0.01 * (high - low) { last } else { high };
        Self { low, high, exponent, step: Some(step) }
    }

    /// A logarithmic axis over these positive numbers, and a little more on either side.
    pub(crate) fn logarithmic(numbers: impl IntoIterator<Item = f64>) -> Self {
        let [low, high] = ends(numbers);
        let margin = 1.12 * (high / low).powf(0.03);
        Self { low: low / margin, high: high * margin, exponent: 0, step: None }
    }

    /// Two linear axes in one unit, of which the shorter one is extended until a number has the same length on both
    /// sides of a frame.
    pub(crate) fn equal(axes: [Self; 2], frame: (f64, f64)) -> [Self; 2] {
        let exponent = axes[0].exponent.max(axes[1].exponent);
        let unit = |axis: &Self| 10_f64.powi(axis.exponent - exponent);
        let length = |axis: &Self| (axis.high - axis.low) * unit(axis);
        let sides = [frame.0, frame.1];
        let scale = (length(&axes[0]) / sides[0]).max(length(&axes[1]) / sides[1]);
        let step = round_step(scale * sides[0].min(sides[1]) / 4.0);
        std::array::from_fn(|k| {
            let (axis, unit) = (&axes[k], unit(&axes[k]));
            let (middle, half) = (0.5 * unit * (axis.low + axis.high), 0.5 * scale * sides[k]);
            Self { low: middle - half, high: middle + half, exponent, step: Some(step) }
        })
    }

    /// The place of a value: 0 at the lower end, 1 at the upper one.
    pub(crate) fn place(&self, value: f64) -> f64 {
        let x = self.reading(value);
        match self.step {
            Some(_) => (x - self.low) / (self.high - self.low),
            None => (x / self.low).ln() / (self.high / self.low).ln(),
        }
    }

    /// The number that is drawn for a value.
    fn reading(&self, value: f64) -> f64 {
        value / 10_f64.powi(self.exponent)
    }

    /// The ticks: the values, and the numbers that are written beside them.
    pub(crate) fn ticks(&self) -> Vec<(f64, String)> {
        let unit = 10_f64.powi(self.exponent);
        let written = |tick: f64| (tick * unit, self.written(tick));
        let Some(step) = self.step else {
            return self
                .decades()
                .filter(|x| (self.low..=self.high).contains(x))
                .map(written)
                .collect();
        };
        let first = (self.low / step - 1e-9).ceil();
        let ticks = (0_u8..64).map(|k| (first + f64::from(k)) * step);
        ticks.take_while(|tick| *tick <= self.high + 1e-9 * step).map(written).collect()
    }

    /// The powers of ten from below to above a logarithmic axis, and, if these are few, twice and five times them.
    fn decades(&self) -> impl Iterator<Item = f64> {
        let (first, last) = (decade(self.low), decade(self.high));
        let digits: &[f64] = if last - first < 3 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        (first..=last).flat_map(move |n| digits.iter().map(move |digit| digit * 10_f64.powi(n)))
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

    /// The number beside a tick.
    fn written(&self, tick: f64) -> String {
        let Some(step) = self.step else {
            let decades = decade(self.high) - decade(self.low);
            let exponent = decade(tick * (1.0 + 1e-9));
            let digit = (tick / 10_f64.powi(exponent)).round();
            return match (digit > 1.5, decades < 3) {
                (_, true) if (0..4).contains(&exponent) => {
                    (digit * 10_f64.powi(exponent)).to_string()
                }
                (true, true) => format!("{digit}×{}", power(exponent)),
                (false, _) if exponent % (1 + (decades - 1) / 7) == 0 => power(exponent),
                _ => String::new(),
            };
        };
        if tick.abs() < 1e-9 * step {
            return "0".into();
        }
        // A step is 1, 2, 2.5 or 5 times a power of ten.
        let digits = (0..9).find(|&n| (step * 10_f64.powi(n)).fract() < 1e-6).unwrap_or(9);
        let digits = usize::try_from(digits).unwrap_or(0);
        format!("{tick:.digits$}").replace('-', "−")
    }
}

/// The distance between ticks, 1, 2, 2.5 or 5 times a power of ten, that is nearest to this one.
fn round_step(wanted: f64) -> f64 {
    let unit = 10_f64.powf(wanted.log10().floor());
    let digit = match wanted / unit {
        x if x < 1.5 => 1.0,
        x if x < 2.25 => 2.0,
        x if x < 3.5 => 2.5,
        x if x < 7.5 => 5.0,
        _ => 10.0,
    };
    digit * unit
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
        axis.written(tick)
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
        let written = |numbers: [f64; 2]| {
            let ticks = Axis::logarithmic(numbers).ticks().into_iter();
            ticks.map(|(_, number)| number).filter(|number| !number.is_empty()).collect::<Vec<_>>()
        };
        assert_eq!(written([1e-15, 0.5]), ["10⁻¹⁵", "10⁻¹²", "10⁻⁹", "10⁻⁶", "10⁻³", "10⁰"]);
        assert_eq!(written([0.01, 0.06]), ["10⁻²", "2×10⁻²", "5×10⁻²"]);
        assert_eq!(written([2.0, 12.0]), ["2", "5", "10"]);
    }

    #[test]
    fn ticks_are_round_numbers_within_the_axis() {
        let axis = Axis::linear([-0.3, 1.0], 0.0, 5);
        let ticks = axis.ticks();
        let numbers: Vec<&str> = ticks.iter().map(|(_, number)| number.as_str()).collect();
        assert_eq!(numbers, ["−0.25", "0", "0.25", "0.50", "0.75", "1.00"]);
        assert!(ticks.iter().all(|(value, _)| (0.0..=1.0 + 1e-9).contains(&axis.place(*value))));
        assert!((axis.place(-0.3)).abs() < 1e-12 && (axis.place(1.0) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_unit_has_the_same_length_on_equal_axes() {
        for factor in [1.0, 1e-9, 1e12] {
            let axes =
                [[0.0, 2.0], [5e-3, 6e-3]].map(|x| Axis::linear(x.map(|x| factor * x), 0.0, 5));
            let [x, y] = Axis::equal(axes, (300.0, 200.0));
            let length = |axis: &Axis, side: f64| side * (axis.place(factor) - axis.place(0.0));
            assert!((length(&x, 300.0) - 150.0).abs() < 1e-9, "{factor}");
            assert!((length(&y, 200.0) - 150.0).abs() < 1e-9, "{factor}");
        }
    }
}
