//! Pictures of runs as SVG: lines over the time.

use std::fmt::{self, Write as _};

/// Lines over the time on one pair of axes, with their names.
pub(crate) type Panel = Vec<(String, Vec<f64>)>;

/// The colours of Okabe and Ito (2008), the dark ones first; lines after these are dashed.
pub(crate) const COLORS: [&str; 7] =
    ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#555555"];

/// The range of the finite ones among some numbers, in units of the largest, and the pixels of its ends.
struct Axis {
    unit: f64,
    range: [f64; 2],
    pixels: [f64; 2],
}

impl Axis {
    fn of<'a>(numbers: impl Iterator<Item = &'a f64> + Clone, pixels: [f64; 2]) -> Self {
        let finite = numbers.filter(|x| x.is_finite());
        let largest = finite.clone().fold(0.0, |largest: f64, x| largest.max(x.abs()));
        let unit = if largest > 0.0 { largest } else { 1.0 };
        let [low, high] = finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
            [low.min(x / unit), high.max(x / unit)]
        });
        // A constant has no range, nor has its round-off, nor have no numbers.
        let range = if high - low > 8.0 * f64::EPSILON {
            let margin = 0.03 * (high - low);
            [low - margin, high + margin]
        } else {
            let middle = if high >= low { 0.5 * (low + high) } else { 0.0 };
            [middle - 0.5, middle + 0.5]
        };
        Self { unit, range, pixels }
    }

    /// The pixel of a number; `None` if it is not finite.
    fn place(&self, x: f64) -> Option<f64> {
        let ([low, high], [first, last]) = (self.range, self.pixels);
        x.is_finite().then(|| first + (x / self.unit - low) / (high - low) * (last - first))
    }

    /// About five multiples of 1, 2 or 5 times a power of ten, and how they are written.
    fn ticks(&self) -> Vec<(f64, String)> {
        let [low, high] = self.range;
        let least = 0.2 * (high - low) * self.unit;
        let decade = least.log10().floor();
        let power = 10_f64.powf(decade);
        let step = [1.0, 2.0, 5.0].into_iter().find(|k| k * power >= least).unwrap_or(10.0) * power;
        if !step.is_normal() {
            return Vec::new();
        }
        let place = |k: f64| k * (step / self.unit);
        let first = (low / (step / self.unit)).ceil();
        let ticks = (0..10).map(|k| first + f64::from(k)).take_while(|&k| place(k) <= high);
        let digits = |decades: f64| (0_u8..20).take_while(|&k| f64::from(k) < decades).count();
        let plain = (1e-3..1e5).contains(&self.unit) && decade > -7.0;
        let written = |tick: f64| match tick {
            0.0 => "0".to_owned(),
            _ if plain => format!("{tick:.*}", digits(-step.log10().floor())),
            _ => format!("{tick:.*e}", digits(tick.abs().log10().floor() - step.log10().floor())),
        };
        ticks.map(|k| (k * step, written(k * step))).collect()
    }
}

/// Draws panels below each other. What is not finite is left out and interrupts its line.
pub(crate) fn draw(times: &[f64], panels: &[Panel]) -> String {
    let [width, height, left, right, gap] = [760.0, 190.0, 100.0, 110.0, 22.0];
    let total = (height + gap) * panels.len() as f64 + gap + 16.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {total}\" \
         font-family=\"sans-serif\" font-size=\"11\" fill=\"#222222\">\n\
         <rect width=\"{width}\" height=\"{total}\" fill=\"white\"/>\n"
    );
    // Writing to a string does not fail.
    let mut put = |text: fmt::Arguments<'_>| {
        let _ = svg.write_fmt(text);
    };
    for (number, panel) in panels.iter().enumerate() {
        let top = gap + (height + gap) * number as f64;
        let (bottom, end) = (top + height, width - right);
        let x = Axis::of(times.iter(), [left, end]);
        let y = Axis::of(panel.iter().flat_map(|(_, values)| values), [bottom, top]);
        for (tick, label) in x.ticks() {
            let at = x.place(tick).unwrap_or(left);
            put(format_args!("<path d=\"M{at:.1} {top}V{bottom}\" stroke=\"#dddddd\"/>\n"));
            if number + 1 == panels.len() {
                let below = bottom + 15.0;
                put(format_args!(
                    "<text x=\"{at:.1}\" y=\"{below}\" text-anchor=\"middle\">{label}</text>\n"
                ));
            }
        }
        for (tick, label) in y.ticks() {
            let (at, before) = (y.place(tick).unwrap_or(bottom), left - 6.0);
            put(format_args!("<path d=\"M{left} {at:.1}H{end}\" stroke=\"#dddddd\"/>\n"));
            put(format_args!(
                "<text x=\"{before}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>\n",
                at + 4.0
            ));
        }
        put(format_args!(
            "<path d=\"M{left} {top}H{end}V{bottom}H{left}Z\" fill=\"none\" stroke=\"#777777\"/>\n"
        ));
        for (k, (name, values)) in panel.iter().enumerate() {
            let dash = if k < COLORS.len() { "none" } else { "5 3" };
            let stroke = format!(
                "fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\" stroke-dasharray=\"{dash}\" \
                 stroke-linecap=\"round\" stroke-linejoin=\"round\"",
                COLORS[k % COLORS.len()]
            );
            let points = times.iter().zip(values).map(|(&t, &v)| x.place(t).zip(y.place(v)));
            put(format_args!("<path d=\"{}\" {stroke}/>\n", path(points)));
            let at = top + 12.0 + 13.0 * k as f64;
            put(format_args!("<path d=\"M{} {at}h18\" {stroke}/>\n", end + 10.0));
            put(format_args!(
                "<text x=\"{}\" y=\"{}\">{}</text>\n",
                end + 34.0,
                at + 4.0,
                name.replace('&', "&amp;").replace('<', "&lt;")
            ));
        }
    }
    put(format_args!(
        "<text x=\"{}\" y=\"{}\">t</text>\n</svg>\n",
        width - right + 10.0,
        total - 24.0
    ));
    svg
}

/// The commands of a path through points, without those that nobody sees: a point alone is a cross, and a gap is a gap.
fn path(points: impl Iterator<Item = Option<(f64, f64)>>) -> String {
    let (mut commands, mut last) = (String::new(), None::<(f64, f64)>);
    let mut points = points.peekable();
    while let Some(point) = points.next() {
        let Some((x, y)) = point else {
            last = None;
            continue;
        };
        let ends = points.peek().is_none_or(Option::is_none);
        let command = match last {
            None if ends => format!("M{:.1} {y:.1}h6m-3-3v6", x - 3.0),
            None => format!("M{x:.1} {y:.1}"),
            Some((a, b)) if ends || f64::max((x - a).abs(), (y - b).abs()) > 0.3 => {
                format!("L{x:.1} {y:.1}")
            }
            Some(_) => continue,
        };
        commands.push_str(&command);
        last = Some((x, y));
    }
    commands
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(numbers: &[f64]) -> Vec<String> {
        let ticks = Axis::of(numbers.iter(), [0.0, 100.0]).ticks();
        ticks.into_iter().map(|(_, label)| label).collect()
    }

    #[test]
    fn ticks_are_round_at_every_scale() {
        assert_eq!(labels(&[0.0, 10.0]), ["0", "5", "10"]);
        assert_eq!(labels(&[-0.31, 0.42]), ["-0.2", "0", "0.2", "0.4"]);
        assert_eq!(labels(&[2e-16, -3e-16]), ["-2e-16", "0", "2e-16"]);
        assert_eq!(labels(&[1e11, 3e11]), ["1.0e11", "1.5e11", "2.0e11", "2.5e11", "3.0e11"]);
        for extreme in [[-f64::MAX, f64::MAX], [5e-324, 1e-323], [7.0, 7.0 + 1e-15]] {
            let axis = Axis::of(extreme.iter(), [0.0, 100.0]);
            assert!(axis.ticks().len() < 10);
            let inside =
                |x: &f64| axis.place(*x).is_some_and(|p| (-1e-9..=100.0 + 1e-9).contains(&p));
            assert!(extreme.iter().all(inside), "{extreme:?}");
        }
    }

    #[test]
    fn numbers_without_a_place_interrupt_a_line() {
        let times: Vec<f64> = (0_u8..5).map(f64::from).collect();
        let values = vec![1.0, 2.0, f64::NAN, 3.0, f64::INFINITY];
        let svg = draw(&times, &[vec![("a < b".to_owned(), values)], vec![]]);
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        assert!(svg.contains("a &lt; b"));
        // A line from the first to the second point, and the fourth one as a cross.
        let line = svg.lines().find(|line| line.contains("1.5\"") && line.contains('L')).unwrap();
        assert_eq!([line.matches('M').count(), line.matches('L').count()], [2, 1], "{line}");
        let of_one = draw(&[0.0], &[vec![("x".to_owned(), vec![4.0])]]);
        assert!(of_one.contains("v6\""), "{of_one}");
        let none = draw(&[f64::NAN], &[vec![("x".to_owned(), vec![f64::NAN])]]);
        assert!(!none.contains("NaN"), "{none}");
    }
}
