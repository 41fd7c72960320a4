//! Recorded states at given times: data and losses find their states by time, never by place.

use std::sync::Arc;

use crate::run::ending::Ending;
use crate::run::rounding::rounding;
use crate::step::digits::Digits;

/// A time at which a run has no state.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Unpaired {
    /// The run has ended before, and not at rest, where its last state stands for all later times.
    #[error(
        "time {index} of the data is t = {}, and the run has ended at t = {}: {}; leave later data out, or let the run go on",
        Digits(*time), Digits(*reached), how(*ending, event.as_deref())
    )]
    Ended {
        /// Which one of the times, counted from 0.
        index: usize,
        /// The time.
        time: f64,
        /// The time of the last state.
        reached: f64,
        /// How the run has ended.
        ending: Ending,
        /// The name of the event at which it has stopped.
        event: Option<Arc<str>>,
    },
    /// The run has no state there: it was not asked for.
    #[error(
        "time {index} of the data is t = {}, where the run has recorded no state; ask for it by `output_at`",
        Digits(*time)
    )]
    NotRecorded {
        /// Which one of the times, counted from 0.
        index: usize,
        /// The time.
        time: f64,
    },
}

metriplectic_equations::debug_is_the_sentence!(Unpaired);

/// How a run has ended, in words.
fn how(ending: Ending, event: Option<&str>) -> String {
    match (ending, event) {
        (Ending::Event { .. }, Some(name)) => format!("it stopped at the event {name:?}"),
        (Ending::Event { index }, None) => format!("it stopped at event {index}"),
        (Ending::Rest { .. }, _) => "it was at rest".to_owned(),
        (Ending::Span, _) => "its span was over".to_owned(),
        (Ending::Stopped, _) => "it stopped on the way".to_owned(),
    }
}

/// The end of a run: how, and the name of the event at which it has stopped.
pub(crate) type End<'a> = (Ending, Option<&'a Arc<str>>);

/// The numbers of the recorded states at some times, to the rounding of times. The first of two states of one time is meant: the one
/// before a jump. The last state of a run that came to rest stands for all later times.
///
/// # Errors
///
/// [`Unpaired`].
pub(crate) fn paired(
    times: &[f64],
    recorded: &[f64],
    (ending, event): End<'_>,
) -> Result<Vec<usize>, Unpaired> {
    let first = recorded.first().copied().unwrap_or(f64::NAN);
    // The times of a run back in time fall.
    let direction = if recorded.last().is_some_and(|last| *last < first) { -1.0 } else { 1.0 };
    let find = |(index, &time): (usize, &f64)| {
        let next = recorded.partition_point(|t| direction * t < direction * time);
        let off = |k: usize| recorded.get(k).map_or(f64::INFINITY, |t| (t - time).abs());
        let mut nearest = match next.checked_sub(1) {
            Some(before) if off(before) < off(next) => before,
            _ => next,
        };
        while nearest > 0 && recorded[nearest - 1..].first() == recorded.get(nearest) {
            nearest -= 1;
        }
        if off(nearest) <= rounding(first, time) {
            return Ok(nearest);
        }
        let Some(&reached) =
            recorded.last().filter(|reached| direction * time > direction * **reached)
        else {
            return Err(Unpaired::NotRecorded { index, time });
        };
        if ending.is_rest() {
            return Ok(recorded.len() - 1);
        }
        let event = event.cloned();
        Err(Unpaired::Ended { index, time, reached, ending, event })
    };
    times.iter().enumerate().map(find).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const REST: End<'_> = (Ending::Rest { speed: 0.0, largest: 1.0 }, None);
    const SPAN: End<'_> = (Ending::Span, None);

    #[test]
    fn times_find_their_states_to_rounding_in_any_order() {
        let recorded = [-3.0, -1.0, 0.1 + 0.2, 0.7, 0.7, 2.0];
        let times = [2.0_f64.next_down(), 0.3, 0.7, 0.7_f64.next_up(), -3.0, -1.0];
        assert_eq!(paired(&times, &recorded, SPAN), Ok(vec![5, 2, 3, 3, 0, 1]));
        // In any unit of time.
        for unit in [1e-300, 1e-30, 1e30] {
            let [times, recorded] = [&times[..], &recorded]
                .map(|list| list.iter().map(|t| t * unit).collect::<Vec<_>>());
            assert_eq!(paired(&times, &recorded, SPAN), Ok(vec![5, 2, 3, 3, 0, 1]), "{unit}");
        }
        assert_eq!(paired(&[], &[0.0], SPAN), Ok(vec![]));
    }

    #[test]
    fn a_time_without_a_state_is_named_and_rest_lasts() {
        let recorded = [0.0, 1.0, 2.0];
        assert_eq!(paired(&[1.0, 3.0, 1e300], &recorded, REST), Ok(vec![1, 2, 2]));
        let [time, index] = [1.5, 1.0];
        for end in [REST, SPAN] {
            let found = paired(&[index, time], &recorded, end);
            assert_eq!(found, Err(Unpaired::NotRecorded { index: 1, time }));
        }
        let floor: Arc<str> = "floor".into();
        let event = (Ending::Event { index: 0 }, Some(&floor));
        let error = paired(&[2.0, 2.5], &recorded, event).unwrap_err();
        assert!(matches!(error, Unpaired::Ended { index: 1, time: 2.5, reached: 2.0, .. }));
        assert!(error.to_string().contains("it stopped at the event \"floor\""), "{error}");
        assert!(matches!(paired(&[f64::NAN], &recorded, REST), Err(Unpaired::NotRecorded { .. })));
        assert!(matches!(paired(&[-1.0], &recorded, REST), Err(Unpaired::NotRecorded { .. })));
        // A run that is at rest from its start on has one state.
        assert_eq!(paired(&[0.0, 5.0], &[0.0], REST), Ok(vec![0, 0]));
    }
}
