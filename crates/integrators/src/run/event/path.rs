//! Events on a path with noise.
//!
//! The path has no cubic between the ends of a step, and changes its sign infinitely often where it does so once. So functions are looked at
//! where a step ends, and as often inside it as their [resolution](crate::Watched::resolution) says. An event is at the first look with the
//! later sign. A time at which a function of the time alone changes its sign is found as in any run, to the last digits.

use crate::run::event::{Change, Changes, Events, Found, InStep, Output, Watched};
use crate::run::state::State;
use crate::step::{Excursion, StateSpace};

/// A step on a path with noise.
pub(crate) trait Path<M: StateSpace> {
    /// The state at a fraction of the step; `None` if it is not known.
    fn state(&mut self, theta: f64) -> Option<State<M>>;

    /// Whether a function has left its sign between two looks and come back; `None` if it is not known.
    fn has_excursion(&mut self, excursion: &Excursion<'_, M::Element>) -> Option<bool>;
}

/// A look at a function.
struct Glance<M: StateSpace> {
    theta: f64,
    value: f64,
    state: State<M>,
}

impl<M: StateSpace> Events<M> {
    /// The events of a step on a path, as those [of a step](Self::of_step).
    pub(crate) fn of_path(
        &mut self,
        ends: [&State<M>; 2],
        path: &mut dyn Path<M>,
    ) -> Option<Found<M>> {
        let times = ends.map(|state| state.time);
        self.in_step(times, &mut |watched, limit| {
            let end = &ends[1].point;
            let mut point = |_: f64, _: &mut Output<'_, M>| None;
            let mut ahead = |_: f64| end.clone();
            let mut step = InStep {
                ends,
                h: times[1] - times[0],
                moves: false,
                inside: &[],
                point: &mut point,
                ahead: &mut ahead,
            };
            if watched.is_of_time(&step) {
                watched.look(&mut step, limit, &mut |theta| path.state(theta))
            } else {
                watched.look_at_path(ends, limit, path)
            }
        })
    }
}

impl<M: StateSpace> Watched<M> {
    /// The changes of sign in a step on a path, in the order of their times, up to a limit; up to the first one if it ends the step.
    fn look_at_path(
        &mut self,
        ends: [&State<M>; 2],
        limit: f64,
        path: &mut dyn Path<M>,
    ) -> Option<Changes<M>> {
        self.before = (self.value, self.departure, self.count);
        // A path has no direction in which it leaves an event.
        self.departure = None;
        let mut changes = Vec::new();
        let last = ends[1].clone();
        let start = Glance { theta: 0.0, value: self.at(ends[0]), state: ends[0].clone() };
        // Another event at the time of a jump is found again where the step starts.
        let mut before = Glance { value: self.value, ..self.glance(ends[0], 0.0) };
        self.enter(&mut changes, [&before, &start], path)?;
        if !start.value.is_nan() {
            before = start;
        }
        let gaps = self.gaps(ends[1].time - ends[0].time);
        for k in 1..=gaps {
            if before.theta > limit || self.is_over_after(changes.len()) {
                break;
            }
            let theta = k as f64 / gaps as f64;
            let state = if k == gaps { last.clone() } else { path.state(theta)? };
            let next = self.glance(&state, theta);
            if !next.value.is_nan() {
                self.enter(&mut changes, [&before, &next], path)?;
                before = next;
            }
        }
        let at_end = self.at(ends[1]);
        self.value = if at_end.is_nan() { before.value } else { at_end };
        Some(Changes { changes, unsure: None })
    }

    fn glance(&self, state: &State<M>, theta: f64) -> Glance<M> {
        Glance { theta, value: self.at(state), state: state.clone() }
    }

    /// The parts of a step of this length at whose ends the function is looked at.
    fn gaps(&self, length: f64) -> usize {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "it is a whole number that is positive, and saturates"
        )]
        let gaps = self.request.resolution.map_or(1, |asked| (length / asked).ceil() as usize);
        gaps.max(1)
    }

    /// Enters the changes of sign between two looks: one if the signs differ, and both that were asked for if the function was beyond zero
    /// in between.
    fn enter(
        &self,
        changes: &mut Vec<Change<M>>,
        [before, next]: [&Glance<M>; 2],
        path: &mut dyn Path<M>,
    ) -> Option<()> {
        let [a, b] = [before.value, next.value];
        let change = |rises: bool| Change { theta: next.theta, rises, state: next.state.clone() };
        if self.changes(a, b) {
            changes.push(change(a < 0.0));
        } else if self.request.bridged && a * b > 0.0 && before.theta < next.theta {
            let time = before.state.time;
            let function = |x: &M::Element| (self.function.0)(time, x);
            let (from, fractions) = (&before.state.point, [before.theta, next.theta]);
            let excursion = Excursion { from, fractions, values: [a, b], function: &function };
            if path.has_excursion(&excursion)? {
                let asked = |rises: &bool| {
                    if *rises { self.request.rising } else { self.request.falling }
                };
                changes.extend([a < 0.0, a > 0.0].into_iter().filter(asked).map(change));
            }
        }
        Some(())
    }
}
