//! Requests for outputs and events, and the outputs that are still to come.

use crate::run::event::Request;
use crate::run::progress::Progress;
use crate::run::rounding::rounding;
use crate::run::span_error::SpanError;

/// Requests of a schedule for outputs and events.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Requests {
    /// Times of outputs, in their order, if a list was given.
    pub(crate) times: Option<Vec<f64>>,
    /// The interval of outputs from the start on.
    pub(crate) interval: Option<f64>,
    pub(crate) events: Vec<Request>,
}

impl Requests {
    pub(crate) const fn has_outputs(&self) -> bool {
        self.times.is_some() || self.interval.is_some()
    }

    /// Accepts outputs of a run from `start` to `end` that have different times up to `seen`.
    pub(crate) fn check(
        &self,
        [start, end]: [f64; 2],
        seen: f64,
        direction: f64,
    ) -> Result<(), SpanError> {
        let [first, last] = [direction * start, direction * end + rounding(start, end)];
        let outside = |time: &&f64| {
            let along = direction * **time;
            !(along >= first && along <= last && time.is_finite())
        };
        if let Some(&time) = self.times.iter().flatten().find(outside) {
            return Err(SpanError::Output { time, start, end });
        }
        let unseen =
            |resolution: f64| !(resolution > rounding(start, seen) && resolution.is_finite());
        for (index, event) in self.events.iter().enumerate() {
            if direction < 0.0 && event.jump.is_some() {
                return Err(SpanError::BackwardJump);
            }
            if event.stops_after == Some(0) {
                return Err(SpanError::StopAfterNone { index });
            }
            if let Some(resolution) = event.resolution.filter(|resolution| unseen(*resolution)) {
                return Err(SpanError::EventResolution { index, resolution });
            }
        }
        match self.interval {
            Some(interval) if !(interval > 0.0 && interval.is_finite()) => {
                Err(SpanError::OutputInterval { interval })
            }
            Some(interval) if interval <= rounding(start, seen) => {
                let time = if seen.abs() > start.abs() { seen } else { start };
                Err(SpanError::OutputStandstill { time, interval })
            }
            _ => Ok(()),
        }
    }
}

/// The outputs of a run that are still to come.
#[derive(Clone, Debug)]
pub(crate) struct Outputs {
    /// The sign of the time of the run. The times below are along the run: they rise.
    direction: f64,
    start: f64,
    times: Option<Vec<f64>>,
    interval: Option<f64>,
    /// When the run ends; infinite if it does not.
    end: f64,
    /// How many of the times are over, and how many intervals.
    index: usize,
    count: usize,
}

impl Outputs {
    /// Keeps the outputs after `time` in a run that began at `start`.
    pub(crate) fn after(
        time: f64,
        start: f64,
        times: Option<Vec<f64>>,
        interval: Option<f64>,
    ) -> Self {
        let end = f64::INFINITY;
        let mut outputs = Self { direction: 1.0, start, times, interval, end, index: 0, count: 0 };
        let done = time + rounding(start, time);
        outputs.index = outputs.listed().partition_point(|t| *t <= done);
        if let Some(interval) = interval {
            // The quotient may be off by its rounding.
            let quotient = ((done - start) / interval).floor().max(1.0) - 1.0;
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "it is a whole number that is not negative, and saturates"
            )]
            let before = quotient as usize;
            outputs.count = before;
            while outputs.in_interval().is_some_and(|t| t <= done) {
                outputs.count += 1;
            }
        }
        outputs
    }

    /// The outputs of a run that ends then: a multiple of the interval that is another expression of this time is the end.
    pub(crate) const fn until(mut self, end: f64) -> Self {
        self.end = end;
        self
    }

    /// The outputs after `time` in a run with this progress.
    pub(crate) fn of<V>(
        progress: &Progress<V>,
        time: f64,
        times: Option<Vec<f64>>,
        interval: Option<f64>,
    ) -> Self {
        let (direction, backward) = (progress.direction(), progress.backward);
        let along = |times: Vec<f64>| {
            if backward { times.iter().rev().map(|t| -t).collect() } else { times }
        };
        let start = direction * progress.start;
        let outputs = Self::after(direction * time, start, times.map(along), interval);
        Self { direction, ..outputs.until(direction * progress.end()) }
    }

    pub(crate) const fn is_empty(&self) -> bool {
        self.times.is_none() && self.interval.is_none()
    }

    /// Returns whether no output is left, however long the run goes on.
    pub(crate) fn are_over(&self) -> bool {
        self.index == self.listed().len() && self.interval.is_none()
    }

    fn listed(&self) -> &[f64] {
        self.times.as_deref().unwrap_or_default()
    }

    /// The next multiple of the interval.
    fn in_interval(&self) -> Option<f64> {
        let time = self.start + (self.count + 1) as f64 * self.interval?;
        let is_end = (time - self.end).abs() <= rounding(self.start, time);
        Some(if is_end { self.end } else { time })
    }

    /// The next output up to `time`, or so near to it that it is the same time.
    pub(crate) fn next(&mut self, time: f64) -> Option<f64> {
        let last = self.direction * time + rounding(self.start, time);
        let listed = self.listed().get(self.index).copied().filter(|t| *t <= last);
        let counted = self.in_interval().filter(|t| *t <= last);
        let next = match (listed, counted) {
            // A multiple may be another expression of a listed time.
            (Some(a), Some(b)) if (a - b).abs() <= rounding(self.start, a) => a.max(b),
            (Some(a), Some(b)) => a.min(b),
            (a, b) => a.or(b)?,
        };
        self.index += usize::from(listed.is_some_and(|t| t <= next));
        self.count += usize::from(counted.is_some_and(|t| t <= next));
        Some(self.direction * next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outputs_are_taken_up_where_they_were_left() {
        for start in [0.0, -3.0, 1e6] {
            let times = vec![start + 0.25, start + 0.3, start + 1.0, start + 2.75];
            let (step, interval) = (0.07, 0.1);
            let time = |n: u32| start + f64::from(n) * step;
            let ahead =
                |n: u32| Outputs::after(time(n), start, Some(times.clone()), Some(interval));
            let mut whole = ahead(0);
            let mut all = Vec::new();
            for n in 1..=50 {
                let mut resumed = ahead(n - 1);
                while let Some(t) = whole.next(time(n)) {
                    assert_eq!(resumed.next(time(n)), Some(t));
                    all.push(t);
                }
                assert_eq!(resumed.next(time(n)), None);
            }
            assert!(all.is_sorted_by(|a, b| a < b), "{all:?}");
            // 35 multiples up to 3.5, and 0.25 and 2.75, which are none of them.
            assert!((37..=39).contains(&all.len()), "{} from {start}", all.len());
        }
    }
    #[test]
    fn a_multiple_of_the_interval_may_be_the_end() {
        // Ends and intervals with two decimals: the multiples are 1 to n, whatever their digits.
        let mut other_digits = 0;
        for interval in [1_u32, 3, 7, 10, 30, 60, 70] {
            for n in 1..=64_u32 {
                let (end, step) = (f64::from(n * interval) / 100.0, f64::from(interval) / 100.0);
                let outputs = Outputs::after(0.0, 0.0, None, Some(step));
                let all = |mut outputs: Outputs| std::iter::from_fn(move || outputs.next(end));
                let times: Vec<f64> = all(outputs.clone().until(end)).collect();
                assert_eq!(times.len(), n as usize);
                assert_eq!(times.last(), Some(&end));
                other_digits += usize::from(all(outputs).last() != Some(end));
                // Beside a list with other expressions of the same times.
                let listed = (1..=n).map(|k| f64::from(k * interval) / 100.0).collect();
                let both = Outputs::after(0.0, 0.0, Some(listed), Some(step)).until(end);
                assert_eq!(all(both).count(), n as usize);
            }
        }
        assert!(other_digits > 40, "{other_digits} ends have two expressions");
    }
}
