//! Where a function changes its sign.

/// A place and the value of the function there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sample {
    pub(crate) at: f64,
    pub(crate) value: f64,
}

/// Evaluations after which a bracket is halved if they have not done so; one less each time that happens, so that in
/// the end it is bisected.
/// A factor of four fails `run/root.rs::smooth_functions_take_few_evaluations`.
const PATIENCE: usize = 4;

/// Narrows a bracket across which a function changes its sign, until it is `width` wide or the function is zero at
/// its end and not before it. The function is positive at the end, or zero, and negative at the start, if it rises; if it falls, the
/// other way round. A place where it is NaN counts as one before the change. The end of the bracket is returned;
/// `None` if the function stops.
///
/// The secant of Anderson and Björck (1973), of order 1.7. A trial keeps a distance from the ends of the bracket
/// that grows as long as it does not find the other sign: so the bracket closes where values are round-off.
pub(crate) fn narrow(
    [mut start, mut end]: [Sample; 2],
    width: f64,
    mut f: impl FnMut(f64) -> Option<f64>,
) -> Option<f64> {
    let sign = if start.value < 0.0 { 1.0 } else { -1.0 };
    let (mut left, mut right) = (sign * start.value, sign * end.value);
    let (mut distance, mut since, mut wide) = (width, 0, end.at - start.at);
    let mut patience = PATIENCE;
    let mut before_last = None;
    // A function that stays zero is bisected for the place where it has come to zero.
    let earlier = end.at - f64::EPSILON.sqrt() * (end.at - start.at);
    let stays = end.value == 0.0 && f(earlier) == Some(0.0);
    while (end.value != 0.0 || stays) && end.at - start.at > width {
        let length = end.at - start.at;
        let secant = end.at - right * length / (right - left);
        let margin = distance.min(0.5 * length);
        let is_close = !(secant >= start.at + margin && secant <= end.at - margin);
        let halves = stays || since >= patience || !secant.is_finite();
        if halves {
            patience = patience.saturating_sub(1);
        }
        let at = if halves {
            start.at + 0.5 * length
        } else {
            secant.max(start.at + margin).min(end.at - margin)
        };
        if is_close {
            distance *= 4.0;
        }
        let value = f(at)?;
        let after = sign * value >= 0.0;
        // The same side twice: the weight of the other one is reduced.
        let reduced = |old: f64| {
            let factor = 1.0 - sign * value / old;
            if factor > 0.0 && factor <= 1.0 { factor } else { 0.5 }
        };
        if after {
            if before_last == Some(after) {
                left *= reduced(right);
            }
            (end, right) = (Sample { at, value }, sign * value);
        } else {
            if before_last == Some(after) {
                right *= reduced(left);
            }
            if value.is_nan() {
                start.at = at;
            } else {
                (start, left) = (Sample { at, value }, sign * value);
            }
        }
        before_last = Some(after);
        since += 1;
        if end.at - start.at <= 0.5 * wide {
            (wide, since) = (end.at - start.at, 0);
        }
    }
    Some(end.at)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The end of the bracket, and the evaluations.
    fn found(f: impl Fn(f64) -> f64, [a, b]: [f64; 2]) -> (f64, usize) {
        let mut count = 0;
        let ends = [a, b].map(|at| Sample { at, value: f(at) });
        let end = narrow(ends, 4.0 * f64::EPSILON, |x| {
            count += 1;
            Some(f(x))
        });
        (end.expect("the function does not stop"), count)
    }

    #[test]
    fn smooth_functions_take_few_evaluations() {
        type Case = (fn(f64) -> f64, f64, usize);
        let functions: [Case; 8] = [
            (|x| x - 0.3, 0.3, 4),
            (|x| 0.7 - x, 0.7, 4),
            (|x| (x - 0.4) * (2.0 + x), 0.4, 8),
            (|x| (x * 1.5).cos() - 0.5, std::f64::consts::PI / 4.5, 9),
            (|x| (x * 3.0).exp() - 2.0, 2.0_f64.ln() / 3.0, 11),
            // Round-off of a large constant, a root of order three, and a jump.
            (|x| (1e3 + 1e-3 * (x - 0.6).sin()) - 1e3, 0.6, 60),
            (|x| (x - 0.6).powi(3), 0.6, 100),
            (|x| if x < 0.37 { -1.0 } else { 1e-3 }, 0.37, 70),
        ];
        for (index, (f, root, most)) in functions.into_iter().enumerate() {
            let (end, count) = found(f, [0.0, 1.0]);
            println!("{index}: {end} after {count} evaluations");
            let allowed = if index == 5 {
                1e-9
            } else if index == 6 {
                1e-5
            } else {
                2e-15
            };
            assert!((end - root).abs() < allowed && count <= most, "{index}: {end}, {count}");
            assert!(f(end) == 0.0 || f(end) * f(1.0) > 0.0, "{index}: the end is after the change");
        }
    }

    #[test]
    fn a_function_that_stays_zero_has_come_there() {
        let (end, count) = found(|x| (0.37 - x).max(0.0), [0.0, 1.0]);
        assert!((end - 0.37).abs() < 2e-15 && count < 60, "{end} after {count} evaluations");
        assert_eq!(found(|x| x - 1.0, [0.0, 1.0]), (1.0, 1));
    }

    #[test]
    fn nan_is_a_place_before_the_change() {
        let (end, _) =
            found(|x| if (0.2..0.5).contains(&x) { f64::NAN } else { x - 0.3 }, [0.0, 1.0]);
        assert!((end - 0.5).abs() < 1e-14);
        let (end, _) = found(|x| if x < 0.5 { -f64::INFINITY } else { f64::INFINITY }, [0.0, 1.0]);
        assert!((end - 0.5).abs() < 1e-14);
    }
}
