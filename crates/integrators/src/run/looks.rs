//! Where a function is looked at inside a step: as often as it asks for.
//!
//! Five values in a row decide. If the one in the middle is near the cubic through the four others, relative to the range of
//! all values, the function is known between them; if not, the widest gap is parted. So a smooth function takes no further
//! look, and one that oscillates takes some ten in a period, however long the step is. Between values of one sign a parabola
//! may turn near zero: there the function is looked at too, because two changes of sign may hide.

use crate::run::root::Sample;

/// The values that are known of a function in a step.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Looked {
    /// The values, in the order of their places.
    pub(super) samples: Vec<Sample>,
    /// Where the looks first did not agree with each other.
    pub(super) unsure: Option<f64>,
}

/// A function inside a step; `None` where no state is known. It is NaN where it has no value.
pub(super) type OfPlace<'a> = dyn FnMut(f64) -> Option<f64> + 'a;

/// How far a value may be from the cubic through its neighbours, as a fraction of the range of all values.
/// A factor of four fails `run/looks.rs::looks_are_as_many_as_the_function_asks_for`.
const AGREE: f64 = 1.0 / 64.0;

/// The place at which a gap is parted: no simple fraction, so that no period hides.
/// A factor of four fails `run/looks.rs::looks_are_as_many_as_the_function_asks_for`.
const PART: f64 = 0.442_7;

/// How much wider than the narrowest of its neighbours a gap may be. Where the function varies fast, values that are far
/// apart agree by chance.
/// A factor of four fails `run/looks.rs::looks_are_as_many_as_the_function_asks_for`.
const GRADE: f64 = 8.0;

/// The narrowest gap that is parted, as a fraction of the step.
/// A factor of four fails `run/looks.rs::a_jump_is_narrowed_and_noise_is_given_up`.
const NARROW: f64 = 1.0 / 65_536.0;

/// How many windows in a row may not agree in gaps that are not parted. A jump of the function has four.
/// A factor of four fails `run/looks.rs::a_jump_is_narrowed_and_noise_is_given_up`.
const IN_A_ROW: usize = 8;

/// The most looks in a step beyond those that are taken in any case.
/// A factor of four fails `run/looks.rs::many_periods_exhaust_the_looks`.
const MOST: usize = 4096;

/// The most looks for a turn near zero.
/// A factor of four fails `run/looks.rs::a_turn_near_zero_is_looked_at`.
const TURNS: usize = 6;

/// The rounding of values, as a fraction of the largest one.
/// A factor of four fails `run/looks.rs::looks_are_as_many_as_the_function_asks_for`.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Looks at a function where the values so far do not say what lies between them.
pub(super) fn closer(first: Vec<Sample>, value: &mut OfPlace<'_>) -> Option<Looked> {
    let mut range = Range::of(&first);
    if first.windows(WINDOW).all(|window| range.agrees(window)) {
        return Some(Looked { samples: first, unsure: None });
    }
    let mut right: Vec<Sample> = first.iter().rev().copied().collect();
    let mut left: Vec<Sample> = Vec::with_capacity(4 * first.len());
    let (mut looks, mut in_a_row, mut unsure) = (0, 0, None);
    while let Some(sample) = right.pop() {
        left.push(sample);
        let Some(window) = left.last_chunk::<WINDOW>() else { continue };
        let width = |i: usize| window[i + 1].at - window[i].at;
        let gaps = || 0..WINDOW - 1;
        let widest = gaps().fold(0, |most, i| if width(i) > width(most) { i } else { most });
        let narrowest = gaps().map(width).fold(f64::INFINITY, f64::min);
        if range.agrees(window) && width(widest) <= GRADE * narrowest {
            in_a_row = 0;
            continue;
        }
        let place = window[widest].at + PART * width(widest);
        if width(widest) <= NARROW {
            in_a_row += 1;
            if in_a_row > IN_A_ROW {
                // It is noise.
                return Some(Looked { samples: first, unsure: Some(window[0].at) });
            }
            continue;
        }
        if looks == MOST {
            unsure = Some(window[0].at);
            break;
        }
        looks += 1;
        let look = Sample { at: place, value: value(place)? };
        // Where it has no value it stays as it is.
        if !look.value.is_nan() {
            range.enter(look.value);
            right.extend(left.drain(left.len() - WINDOW + 1 + widest..).rev());
            right.push(look);
        }
    }
    left.extend(right.into_iter().rev());
    Some(Looked { samples: left, unsure })
}

/// The values that are compared at once.
const WINDOW: usize = 5;

/// The range of values so far.
struct Range {
    least: f64,
    most: f64,
}

impl Range {
    fn of(samples: &[Sample]) -> Self {
        let mut range = Self { least: f64::INFINITY, most: f64::NEG_INFINITY };
        samples.iter().for_each(|sample| range.enter(sample.value));
        range
    }

    const fn enter(&mut self, value: f64) {
        (self.least, self.most) = (self.least.min(value), self.most.max(value));
    }

    /// The error that a value may have.
    fn allowed(&self) -> f64 {
        let rounding = ROUNDING * self.least.abs().max(self.most.abs());
        (AGREE * (self.most - self.least)).max(rounding)
    }

    /// Whether the value in the middle is near the cubic through the others. A pole is no value to compare with.
    fn agrees(&self, window: &[Sample]) -> bool {
        let middle = WINDOW / 2;
        let mut differences = [0.0; WINDOW];
        for (difference, sample) in differences.iter_mut().zip(window) {
            *difference = sample.value;
        }
        for order in 1..WINDOW {
            for i in 0..WINDOW - order {
                differences[i] =
                    (differences[i + 1] - differences[i]) / (window[i + order].at - window[i].at);
            }
        }
        let others = (0..WINDOW).filter(|i| *i != middle);
        let off = others.fold(differences[0], |off, i| off * (window[middle].at - window[i].at));
        let is_off = off.abs() > self.allowed();
        !is_off
    }
}

/// Looks where the function may turn beyond zero between values of one sign.
pub(super) fn turns(samples: &mut Vec<Sample>, value: &mut OfPlace<'_>) -> Option<()> {
    let allowed = Range::of(samples).allowed();
    let mut next = 0;
    while next + 2 < samples.len() {
        let (mut at, mut slack, after) = (next, allowed, samples[next + 2].at);
        next += 1;
        for _ in 0..TURNS {
            let turn = Turn::of(&samples[at..at + 3]);
            let Some(turn) = turn.filter(|turn| turn.height <= slack) else { break };
            let look = Sample { at: turn.at, value: value(turn.at)? };
            if look.value.is_nan() {
                break;
            }
            let place = samples.partition_point(|sample| sample.at < look.at);
            samples.insert(place, look);
            next = samples.partition_point(|sample| sample.at < after);
            let height = turn.sign * look.value;
            if height <= 0.0 {
                break;
            }
            // The next parabola has the lowest value in its middle.
            slack = BETTER * (height - turn.height).abs();
            let lowest = |j: &usize| turn.sign * samples[*j].value;
            let around = place - 1..=place + 1;
            let middle = around.min_by(|a, b| lowest(a).total_cmp(&lowest(b))).unwrap_or(place);
            at = middle.clamp(1, samples.len() - 2) - 1;
        }
    }
    Some(())
}

/// By how much the next parabola may be off at its turn, in errors of the last one.
/// A factor of four fails `run/looks.rs::a_turn_near_zero_is_looked_at`.
const BETTER: f64 = 2.0;

/// Where the parabola through three values of one sign turns between them.
struct Turn {
    at: f64,
    sign: f64,
    /// Its distance from zero on the side of the values; negative beyond zero.
    height: f64,
}

impl Turn {
    fn of(three: &[Sample]) -> Option<Self> {
        let [a, b, c] = three else { return None };
        let sign = b.value.signum();
        if !(sign * a.value > 0.0 && sign * b.value > 0.0 && sign * c.value > 0.0) {
            return None;
        }
        let [left, right] = [b.at - a.at, c.at - b.at];
        let [before, after] = [(b.value - a.value) / left, (c.value - b.value) / right];
        let curvature = (after - before) / (left + right);
        let slope = (before * right + after * left) / (left + right);
        let at = b.at - 0.5 * slope / curvature;
        // A turn has half of the digits of its place.
        let is_new = (at - b.at).abs() > f64::EPSILON.sqrt() * (left + right);
        let is_between = at > a.at && at < c.at && is_new;
        let height = sign * (b.value - 0.25 * slope * slope / curvature);
        (sign * curvature > 0.0 && is_between && height.is_finite()).then_some(Self {
            at,
            sign,
            height,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn first(f: &dyn Fn(f64) -> f64) -> Vec<Sample> {
        [0.0, 0.188_8, 0.412_1, 0.595_3, 0.814_7, 1.0]
            .map(|at| Sample { at, value: f(at) })
            .to_vec()
    }

    /// The looks that a function asks for, the changes of its sign that they show, and where they did not agree.
    fn looks(f: impl Fn(f64) -> f64) -> (usize, usize, Option<f64>) {
        let mut count = 0;
        let mut value = |at: f64| {
            count += 1;
            Some(f(at))
        };
        let Looked { mut samples, unsure } = closer(first(&f), &mut value).expect("values");
        turns(&mut samples, &mut value).expect("values");
        assert!(samples.is_sorted_by(|a, b| a.at < b.at));
        let changes = samples.windows(2).filter(|pair| pair[0].value * pair[1].value < 0.0);
        (count, changes.count(), unsure)
    }

    #[test]
    fn looks_are_as_many_as_the_function_asks_for() {
        // A function that is smooth, in any unit, asks for none; one with the period of the looks is not constant.
        for unit in [1e-300, 1.0, 1e300] {
            assert_eq!(looks(|x| unit * (2.2 * x + 0.4).sin()), (0, 0, None));
        }
        assert_eq!(looks(|x| (3.0 * x + 0.4).sin()).0, 1);
        assert_eq!(looks(|_| 0.3), (0, 0, None));
        // Nor does one that is constant but for its rounding.
        assert_eq!(looks(|x| 1.0 + f64::EPSILON * (2.0 * (1e9 * x).sin()).round()).0, 0);
        assert_eq!(looks(|x| (5.0 * TAU * x).cos() + 0.5).1, 10);
        for periods in [3.0, 10.0, 100.0, 137.3] {
            let (count, changes, unsure) = looks(|x| (TAU * periods * x + 1.0).sin());
            println!("{periods} periods: {count} looks, {changes} changes");
            assert!((changes as f64 - 2.0 * periods).abs() < 1.0 && unsure.is_none());
            assert!((7.0..11.0).contains(&(count as f64 / periods)), "{count}");
        }
        // Values that are far apart agree by chance where others do not.
        let known = |k: i32| {
            let (periods, phase) = (5.0 + 0.731 * f64::from(k), 0.37 * f64::from(k));
            let (_, changes, _) = looks(|x| (TAU * periods * x + phase).sin());
            (changes as f64 - 2.0 * periods).abs() < 1.01
        };
        let lost = (0..200).filter(|k| !known(*k)).count();
        assert_eq!(lost, 0);
    }

    #[test]
    fn many_periods_exhaust_the_looks() {
        let (_, changes, unsure) = looks(|x| (TAU * 350.0 * x + 1.0).sin());
        assert!(changes == 700 && unsure.is_none());
        let (count, changes, unsure) = looks(|x| (TAU * 1500.0 * x + 1.0).sin());
        // What lies before that place is known.
        let known = unsure.expect("too many periods");
        println!("{count} looks, {changes} changes, unsure from {known}");
        assert!(count == MOST && changes as f64 >= 2.0 * 1500.0 * known - 1.0);
    }

    #[test]
    fn a_jump_is_narrowed_and_noise_is_given_up() {
        let (count, changes, unsure) = looks(|x| if x < 0.37 { 1.0 } else { 2.0 });
        println!("a jump: {count} looks");
        assert!(changes == 0 && unsure.is_none() && (52..58).contains(&count), "{count}");
        let (count, changes, unsure) =
            looks(|x| if (8.0 * x).rem_euclid(2.0) < 0.7 { 1.0 } else { -1.0 });
        println!("a square wave: {count} looks");
        assert!(changes == 8 && unsure.is_none());
        let noise = |x: f64| (1e9 * x).sin() * 1e-16;
        let (count, changes, unsure) = looks(noise);
        println!("noise: {count} looks");
        // The looks that are taken in any case decide.
        let few = first(&noise);
        let few = few.windows(2).filter(|pair| pair[0].value * pair[1].value < 0.0).count();
        assert!(unsure.is_some() && changes == few && (48..54).contains(&count), "{count}");
    }

    #[test]
    fn a_turn_near_zero_is_looked_at() {
        // A parabola takes one look, and a function that is none takes more.
        assert_eq!(looks(|x| (x - 0.3) * (x - 0.3) - 1e-12), (1, 2, None));
        let (count, changes, _) = looks(|x| (2.0 * x - 0.7).cosh() - 1.000_001);
        println!("cosh: {count} looks");
        assert!(changes == 2 && (2..5).contains(&count), "{count}");
        // One that stays positive takes few, and one that touches zero no more than are allowed.
        let (count, changes, _) = looks(|x| 1.001 - (2.0 * x - 0.7).cos());
        println!("near: {count} looks");
        assert!(changes == 0 && count == 2, "{count}");
        let (count, changes, _) = looks(|x| (x - 0.3).powi(4) + 1e-30);
        println!("touching: {count} looks");
        assert!(changes == 0 && (8..16).contains(&count), "{count}");
        // Far from zero there is nothing to look for.
        assert_eq!(looks(|x| (x - 0.3) * (x - 0.3) + 0.1).0, 0);
        // Without a value there is nothing to compare.
        assert_eq!(looks(|x| 1.0 / (x - 0.412_1)).2, None);
    }
}
