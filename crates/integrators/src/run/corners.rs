//! Times at which the law of motion of a system changes, so that no step may lie across them.
//!
//! A protocol that jumps, or has a kink, breaks the order of a method that steps across. A step ends a few roundings before
//! a corner, on the old law. There the [clock](crate::Flow::clocked) of the state is set to the corner: what the energy
//! changes by is work at a frozen state. The next step begins a few roundings behind the corner, with the new law, and
//! with no memory of the old one.
//!
//! Two expressions of one time, such as `3 · 0.1` and `0.3`, differ by roundings. So a closure may switch a rounding before or
//! after the corner that names its time, and a time of the grid may lie on either side. Times within some roundings are one
//! time.

use crate::run::rounding::rounding;
use crate::run::span_error::SpanError;
use crate::run::stepping::AnyStepper;
use crate::step::{Flow, StepError, StepStart, Taken};

#[cfg(feature = "serde")]
use crate::step::exact;

/// The corners of a run.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub(crate) struct Corners {
    /// Times in their order.
    #[cfg_attr(feature = "serde", serde(with = "exact"))]
    pub(crate) times: Vec<f64>,
    /// The interval of corners from the start of the run on.
    #[cfg_attr(feature = "serde", serde(with = "exact"))]
    pub(crate) interval: Option<f64>,
    /// The start of the run.
    #[cfg_attr(feature = "serde", serde(with = "exact"))]
    pub(crate) start: f64,
}

/// How far before a corner a step ends, and how far behind it the next one begins, in roundings of the time. Times that differ
/// by less are one time.
/// A factor of four fails `run/corners.rs::a_step_ends_some_roundings_before_a_corner`.
const APART: f64 = 4.0;

impl Corners {
    pub(crate) fn is_empty(&self) -> bool {
        self.times.is_empty() && self.interval.is_none()
    }

    /// Accepts finite times, and an interval that the time sees.
    pub(crate) fn check(&self, end: f64) -> Result<(), SpanError> {
        if let Some(&time) = self.times.iter().find(|time| !time.is_finite()) {
            return Err(SpanError::Corner { time });
        }
        let least = 3.0 * self.apart(if end.is_finite() { end } else { self.start });
        match self.interval {
            Some(interval) if !(interval > least && interval.is_finite()) => {
                Err(SpanError::Sampling { interval })
            }
            _ => Ok(()),
        }
    }

    /// By how much two expressions of one time may differ.
    fn apart(&self, time: f64) -> f64 {
        APART * rounding(self.start, time)
    }

    /// The first corner after a time that is not this time.
    pub(crate) fn after(&self, time: f64) -> Option<f64> {
        self.beyond(time + self.apart(time))
    }

    /// The first corner beyond a time.
    fn beyond(&self, done: f64) -> Option<f64> {
        let index = self.times.partition_point(|corner| *corner <= done);
        let listed = self.times.get(index).copied();
        let counted = self.interval.map(|interval| {
            let mut count = ((done - self.start) / interval).floor().max(0.0);
            // The quotient may be off by its rounding.
            while self.start + count * interval <= done {
                count += 1.0;
            }
            self.start + count * interval
        });
        match (listed, counted) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        }
    }

    /// The time at which a step begins whose start is a corner: behind the last corner that is this time.
    #[inline]
    pub(crate) fn behind(&self, time: f64) -> Option<f64> {
        if self.is_empty() {
            return None;
        }
        let apart = self.apart(time);
        let is_here = |corner: &f64| *corner <= time + apart;
        let mut corner = self.beyond(time - apart - f64::EPSILON * apart).filter(is_here)?;
        while let Some(next) = self.beyond(corner).filter(is_here) {
            corner = next;
        }
        Some(corner.max(time) + apart)
    }

    /// Times before and behind the corners that are this time, to the accuracy of the time of an event.
    pub(crate) fn around(&self, time: f64) -> Option<[f64; 2]> {
        let (apart, near) = (self.apart(time), 8.0 * self.apart(time));
        let corner = self.beyond(time - near).filter(|corner| *corner <= time + near)?;
        let mut last = corner;
        while let Some(next) = self.beyond(last).filter(|next| *next <= time + near) {
            last = next;
        }
        Some([corner - apart, last + apart])
    }

    /// The time at which a step ends that goes on to a corner.
    fn before(&self, corner: f64) -> f64 {
        corner - self.apart(corner)
    }

    /// Returns whether a corner lies in a step between two times, or no farther from it than it is long.
    pub(crate) fn is_near(&self, [time, end]: [f64; 2]) -> bool {
        let far = (end - time).abs() + self.apart(time).max(self.apart(end));
        self.beyond(time - far).is_some_and(|corner| corner <= end + far)
    }

    /// The intervals of a step of one size from a time on.
    pub(crate) fn intervals(&self, time: f64, step: Fixed) -> Vec<Interval> {
        let mut intervals = vec![self.interval(time, step, true)];
        while let Some(last) = intervals.last().filter(|last| last.recorded < step.end) {
            intervals.push(self.interval(last.recorded, step, false));
        }
        intervals
    }

    /// The interval of a step of one size that begins at a time.
    fn interval(&self, time: f64, Fixed { h, end }: Fixed, is_first: bool) -> Interval {
        let Stop { stop, recorded, is_corner } = self.stop(time, end);
        let behind = self.behind(time);
        let is_whole = is_first && behind.is_none() && !is_corner;
        let h = if is_whole { h } else { stop - behind.unwrap_or(time) };
        Interval { behind, h, recorded, is_corner }
    }

    /// How far a step may go from a time on the way to an end.
    #[inline]
    pub(crate) fn stop(&self, time: f64, end: f64) -> Stop {
        if self.is_empty() {
            return Stop { stop: end, recorded: end, is_corner: false };
        }
        let apart = self.apart(end);
        match self.after(time).filter(|corner| *corner <= end + apart) {
            None => Stop { stop: end, recorded: end, is_corner: false },
            Some(corner) => {
                // A corner at the end may be another expression of the same time.
                let is_end = corner >= end - apart;
                let (recorded, corner) =
                    if is_end { (end, corner.min(end)) } else { (corner, corner) };
                Stop { stop: self.before(corner), recorded, is_corner: true }
            }
        }
    }
}

/// How far a step may go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stop {
    /// The time at which it ends.
    pub(crate) stop: f64,
    /// The time that is recorded then: the corner, or the end.
    pub(crate) recorded: f64,
    /// Whether it ends before a corner.
    pub(crate) is_corner: bool,
}

/// A step of one size, and the time at which it ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fixed {
    pub(crate) h: f64,
    pub(crate) end: f64,
}

/// A step or a part of one, without a corner inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interval {
    /// The time to which the clock is set before it, if it begins at a corner.
    pub(crate) behind: Option<f64>,
    /// Its size.
    pub(crate) h: f64,
    /// The time that is recorded at its end.
    pub(crate) recorded: f64,
    /// It ends before a corner.
    pub(crate) is_corner: bool,
}

/// A step of one size in a run with these corners.
#[inline]
pub(super) fn step<F: Flow + ?Sized>(
    method: &mut dyn AnyStepper<F>,
    start: StepStart<'_, F>,
    size: Fixed,
    corners: &Corners,
) -> Result<Taken<F>, StepError> {
    if corners.is_empty() { method.step(start, size.h) } else { cut(method, start, size, corners) }
}

/// A step in parts between corners.
#[cold]
fn cut<F: Flow + ?Sized>(
    method: &mut dyn AnyStepper<F>,
    start: StepStart<'_, F>,
    size: Fixed,
    corners: &Corners,
) -> Result<Taken<F>, StepError> {
    let flow = start.flow;
    let (mut time, mut reference) = (start.time, start.reference.clone());
    let (mut x, mut values) = (start.x.clone(), start.values.clone());
    let mut before: Option<Taken<F>> = None;
    loop {
        let Interval { behind, h, recorded, .. } = corners.interval(time, size, before.is_none());
        if let Some(behind) = behind {
            method.restart();
            if let Some(clocked) = flow.clocked(&x, behind) {
                values = flow.laws(&clocked);
                x = clocked;
            }
        }
        let from = StepStart {
            flow,
            x: &x,
            time,
            values: values.clone(),
            reference: reference.clone(),
            allowed: start.allowed.clone(),
        };
        let mut taken = method.step(from, h)?;
        taken.evidence.shortest_part = h;
        flow.inspect([&x, &taken.x], true)?;
        if let Some(clocked) = flow.clocked(&taken.x, recorded) {
            taken.values = flow.laws(&clocked);
            taken.x = clocked;
        }
        if taken.evidence.dissipates {
            reference.entropy = taken.values.entropy;
        }
        if let Some(before) = &before {
            taken.evidence = before.evidence.and(taken.evidence);
            taken.effort += before.effort;
            taken.effort.splits += 1;
        }
        if recorded >= size.end {
            return Ok(taken);
        }
        (x, values, time) = (taken.x.clone(), taken.values.clone(), recorded);
        before = Some(taken);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_corner_comes_once() {
        let corners = Corners { times: vec![0.3, 0.5, 2.0], interval: Some(0.25), start: 0.0 };
        let mut found = Vec::new();
        let mut time = 0.0;
        while let Some(corner) = corners.after(time).filter(|corner| *corner <= 1.0) {
            let behind = corners.behind(corner).expect("it is a corner");
            assert!(behind > corner && corners.behind(corners.before(corner) - 1e-15).is_none());
            assert!(corners.before(corner) > time);
            found.push(corner);
            time = corner;
        }
        assert_eq!(found, [0.25, 0.3, 0.5, 0.75, 1.0]);
        let none = Corners::default();
        assert!(none.behind(0.5).is_none() && none.after(0.0).is_none());
    }

    #[test]
    fn a_step_is_cut_in_intervals() {
        let corners = Corners { times: vec![0.3, 0.35], interval: None, start: 0.0 };
        let intervals = corners.intervals(0.25, Fixed { h: 0.25, end: 0.5 });
        let recorded: Vec<f64> = intervals.iter().map(|interval| interval.recorded).collect();
        assert_eq!(recorded, [0.3, 0.35, 0.5]);
        let ends: Vec<_> = intervals.iter().map(|i| (i.behind.is_some(), i.is_corner)).collect();
        assert_eq!(ends, [(false, true), (true, true), (true, false)]);
        // Two times four roundings are left out at each corner.
        let left = 0.25 - intervals.iter().map(|interval| interval.h).sum::<f64>();
        assert!((0.0..2e-14).contains(&left), "{left:e}");
        let whole = corners.intervals(0.5, Fixed { h: 0.25, end: 0.75 });
        assert!(whole.len() == 1 && whole[0].h.to_bits() == 0.25_f64.to_bits());
        assert!(corners.is_near([0.25, 0.28]) && corners.is_near([0.4, 0.5]));
        assert!(!corners.is_near([0.5, 0.6]) && !corners.is_near([0.1, 0.15]));
        let [before, behind] = corners.around(0.3 + 1e-15).expect("a corner");
        assert!(before < 0.3 && behind > 0.3 && corners.around(0.3 + 1e-13).is_none());
    }

    #[test]
    fn two_expressions_of_a_time_are_one_time() {
        // 3 · 0.1 lies a rounding behind 0.3, and 0.7 a rounding behind 7 · 0.1.
        for (grid, corner) in
            [(3.0 * 0.1, 0.3), (0.3, 3.0 * 0.1), (0.7, 7.0 * 0.1), (7.0 * 0.1, 0.7)]
        {
            let corners = Corners { times: vec![corner], interval: None, start: 0.0 };
            let Stop { stop, recorded, is_corner } = corners.stop(grid - 0.1, grid);
            assert!(is_corner && stop < corner.min(grid) && recorded.to_bits() == grid.to_bits());
            let behind = corners.behind(grid).expect("it is a corner");
            assert!(behind > corner.max(grid) && corners.after(grid).is_none());
            assert!(!corners.stop(grid, grid + 0.1).is_corner);
        }
    }

    #[test]
    fn a_step_ends_some_roundings_before_a_corner() {
        let corners = Corners { times: vec![0.75], interval: None, start: 0.0 };
        let left = (0.75 - corners.before(0.75)) / rounding(0.0, 0.75);
        assert!((2.0..10.0).contains(&left), "{left} roundings");
        let begun = (corners.behind(0.75).expect("a corner") - 0.75) / rounding(0.0, 0.75);
        assert!((2.0..10.0).contains(&begun), "{begun} roundings");
    }
}
