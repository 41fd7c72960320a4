//! Which states of a run are recorded: one rule for runs, their tangents and their adjoints.

/// A state of a record.
pub(crate) trait Numbered {
    /// The steps before it.
    fn step(&self) -> usize;
}

/// The states of a run so far, the start first, thinned out.
///
/// They are those that were asked for and the last one, or those after each step, of which every `every`-th one is due.
#[derive(Debug)]
pub(crate) struct Recording<S> {
    pub(crate) states: Vec<S>,
    pub(crate) every: usize,
    /// The most states to record.
    pub(crate) most: Option<usize>,
}

impl<S: Numbered> Recording<S> {
    /// Records the state at the end of a step if it is due. The last one is: if the run is over, or has failed.
    #[inline]
    pub(crate) fn end_of_step(
        &mut self,
        step: usize,
        [over, failed]: [bool; 2],
        state: impl FnOnce() -> S,
    ) {
        let Self { states, every, most } = self;
        let due = step.is_multiple_of(*every) && !failed;
        let over = over || failed;
        if (due || over) && states.last().is_none_or(|last| last.step() != step) {
            states.push(state());
        }
        while most.is_some_and(|most| states.len() > most) {
            *every = every.saturating_mul(2);
            thin_out(states, *every, over);
        }
    }
}

/// Gives up the states between the first and the last that no multiple of `every` steps leads to, and
/// the last one too unless it is to be kept.
fn thin_out<S: Numbered>(states: &mut Vec<S>, every: usize, keeps_last: bool) {
    let last = states.len() - 1;
    let mut index = 0..;
    states.retain(|state| {
        let index = index.next().unwrap_or(last);
        index == 0 || index == last && keeps_last || state.step().is_multiple_of(every)
    });
}
