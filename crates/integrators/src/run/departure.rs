//! How a state leaves the event at which it has jumped.
//!
//! An event is found where its function is zero or has its later sign, by round-off. A ball that bounces goes back to the
//! side from which it came, so there the function has the wrong sign by round-off at the start of the next step. A
//! switch goes on to the other side. The velocity after the jump tells one from the other.

use crate::step::exact::Exact;

/// The state goes back to the side from which it came.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub(super) struct Departure {
    /// The time from which on the function is no round-off.
    time: Exact,
    /// The sign of the function before the event.
    earlier: Exact,
    /// Whether it did not go back.
    pub(super) fails: bool,
}

/// The function of an event before and after a jump.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sides {
    /// The sign before the event.
    pub(super) earlier: f64,
    /// The value at the event, before the jump and after it.
    pub(super) before: f64,
    pub(super) here: f64,
}

/// How much larger than after the jump the function is where it is no round-off.
/// A factor of four fails `run/departure.rs::a_value_of_the_size_of_the_last_one_is_round_off`.
const CLEAR: f64 = 4.0;

/// How many times in a row the function has to be seen on its later side, and farther from zero each time, until it is known
/// not to go back.
/// A factor of four fails `run/departure.rs::a_state_that_goes_on_is_not_awaited`.
const GOES_ON: usize = 3;

/// Looks for the time after a jump at which the function is no round-off, in steps of a factor of 2 up to a step of the run.
/// `None` if the state does not go back, or goes on before it comes back.
pub(super) fn find(
    Sides { earlier, before, here }: Sides,
    time: f64,
    h: f64,
    mut value: impl FnMut(f64) -> f64,
) -> Option<Departure> {
    let is_round_off = earlier * here <= 0.0 && here.abs() <= CLEAR * before.abs();
    let mut later = CLEAR * f64::EPSILON * time.abs().max(h);
    let (mut farthest, mut goes_on) = (CLEAR * here.abs(), 0);
    while is_round_off && later < h {
        let back = earlier * value(later);
        if back > CLEAR * here.abs() {
            return Some(Departure {
                time: Exact(time + later),
                earlier: Exact(earlier),
                fails: false,
            });
        }
        goes_on = if -back > farthest { goes_on + 1 } else { 0 };
        if goes_on == GOES_ON {
            return None;
        }
        farthest = (CLEAR * here.abs()).max(-back);
        later *= 2.0;
    }
    None
}

/// Where in a step the function is first seen on the side to which the state goes back.
pub(super) enum Seen {
    /// The step ends before.
    NotYet,
    At {
        theta: f64,
        value: f64,
    },
    /// Nowhere: the state turns round within round-off.
    Never,
}

/// The fraction of a step up to which the function is looked at.
/// A factor of four fails `run/departure.rs::a_state_that_goes_back_is_seen_in_the_first_fifth_of_a_step`.
const EARLY: f64 = 0.2;

impl Departure {
    /// The state did not go back.
    pub(super) const fn failed(self) -> Self {
        Self { fails: true, ..self }
    }

    /// Looks at the function in a step; `None` if it has no value there.
    pub(super) fn seen(
        self,
        [start, end]: [f64; 2],
        mut value: impl FnMut(f64) -> Option<f64>,
    ) -> Option<Seen> {
        let mut theta = (self.time.0 - start) / (end - start);
        if theta.is_nan() || theta >= 1.0 {
            return Some(Seen::NotYet);
        }
        loop {
            let value = value(theta)?;
            if self.earlier.0 * value > 0.0 {
                return Some(Seen::At { theta, value });
            }
            if theta >= EARLY {
                return Some(Seen::Never);
            }
            theta = (2.0 * theta).min(EARLY);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_of_the_size_of_the_last_one_is_round_off() {
        let goes_back = |here: f64| {
            let sides = Sides { earlier: 1.0, before: 1e-16, here };
            find(sides, 1.0, 0.1, |later| later).is_some()
        };
        assert!(goes_back(-3e-16) && !goes_back(-1e-15));
    }

    #[test]
    fn a_state_that_goes_on_is_not_awaited() {
        // It comes back after half a step, and its first two values are the noise of a bounce.
        let leaves = |value: fn(f64) -> f64| {
            let sides = Sides { earlier: 1.0, before: -1e-17, here: -1e-17 };
            let mut looks = 0;
            let goes_back = find(sides, 1.0, 1.0, |later| {
                looks += 1;
                value(later)
            });
            (goes_back.is_some(), looks)
        };
        assert_eq!(leaves(|later| later * (later - 0.5)), (false, 3));
        assert!(leaves(|later| if later < 3e-15 { -later } else { later }).0);
    }

    #[test]
    fn a_state_that_goes_back_is_seen_in_the_first_fifth_of_a_step() {
        let departure = Departure { time: Exact(0.001), earlier: Exact(1.0), fails: false };
        let seen = |turns: f64| departure.seen([0.0, 1.0], |theta| Some(theta - turns));
        assert!(matches!(seen(0.15), Some(Seen::At { .. })));
        assert!(matches!(seen(0.3), Some(Seen::Never)));
    }
}
