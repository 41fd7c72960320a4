//! Whether the numbers of a checkpoint agree: with the system at its point, and with each other.

use super::{Exact, ResumeError, SavedRun};
use crate::method::{Element, Flow, LimitingSites, Memory, Promises, Vector};
use crate::run::certificate::StageBalance;
use crate::run::controller::{Controller, Pace, StepSize};
use crate::run::progress::Progress;
use crate::run::scales::Judged;
use crate::run::span::{check_end, check_step_size, check_steps};
use crate::run::trajectory::Ending;

/// Units of round-off by which the values of one field differ between two mathematical libraries: some
/// units for each function in it, and far less than any change of a model.
const LIBRARIES: f64 = 1024.0 * f64::EPSILON;

const fn damaged(what: &'static str, value: f64) -> Result<(), ResumeError> {
    Err(ResumeError::Damaged { what, value })
}

const fn finite(what: &'static str, number: f64) -> Result<(), ResumeError> {
    if number.is_finite() { Ok(()) } else { damaged(what, number) }
}

/// A finite number above zero.
fn positive(what: &'static str, number: f64) -> Result<(), ResumeError> {
    check_step_size(number).map_err(|_| ResumeError::Damaged { what, value: number })
}

/// A finite number that is not negative.
const fn size(what: &'static str, number: f64) -> Result<(), ResumeError> {
    if number >= 0.0 && number.is_finite() { Ok(()) } else { damaged(what, number) }
}

/// Accepts a stored value that is the one of the system, but for round-off of its terms.
fn same(field: &'static str, stored: Exact, found: f64, terms: f64) -> Result<(), ResumeError> {
    let stored = stored.0;
    finite(field, stored)?;
    if (stored - found).abs() <= LIBRARIES * terms {
        Ok(())
    } else {
        Err(ResumeError::AnotherSystem { field, stored, found })
    }
}

/// The laws of the system and its velocity, at the stored point.
pub(super) fn of_the_system<F: Flow>(
    flow: &F,
    x: &Element<F>,
    c: &SavedRun,
) -> Result<(), ResumeError> {
    let (laws, sizes) = (flow.laws(x), flow.term_sizes(x));
    same("energy", c.energy, laws.energy, sizes.energy)?;
    same("entropy", c.entropy, laws.entropy, sizes.entropy)?;
    for (k, stored) in c.invariants.iter().enumerate() {
        let (found, terms) = (laws.invariants.as_ref()[k], sizes.invariants.as_ref()[k]);
        same("further invariant", *stored, found, terms)?;
    }
    if let Some([velocity, terms]) = flow.rates_and_terms(x)
        && !c.velocity.is_empty()
    {
        super::expect_length("entries of the velocity", c.velocity.len(), velocity.len())?;
        for (i, stored) in c.velocity.iter().enumerate() {
            same("velocity", *stored, velocity.get(i), terms.get(i))?;
        }
    }
    Ok(())
}

/// The balance beside the state that it is the balance of.
pub(super) fn of_the_balance<F: Flow>(
    flow: &F,
    x: &Element<F>,
    c: &SavedRun,
    promises: Promises,
) -> Result<(), ResumeError> {
    let b = &c.balance;
    finite("initial energy", b.initial_energy)?;
    finite("initial entropy", b.initial_entropy)?;
    finite("smallest growth of the entropy", b.min_entropy_increment)?;
    finite("kept entropy", c.kept_entropy.0)?;
    size("largest error of the energy", b.max_energy_error)?;
    size("largest defect", b.max_manifold_defect)?;
    if b.min_entropy_slope.is_nan() {
        return damaged("least slope of the entropy", b.min_entropy_slope);
    }
    if b.steps != c.step {
        return damaged("number of steps in the balance", b.steps as f64);
    }
    // A balance holds the errors of the very numbers that are stored beside it.
    if (c.energy.0 - b.initial_energy).abs() > b.max_energy_error {
        return damaged("initial energy", b.initial_energy);
    }
    if c.step > 0 && Exact(c.entropy.0 - b.initial_entropy) != Exact(b.entropy_gained) {
        return damaged("growth of the entropy", b.entropy_gained);
    }
    size("size of the terms of the energy", b.energy_scale)?;
    size("rate of the friction", b.friction)?;
    if let Some(StageBalance { defect, surplus }) = b.stages {
        size("defect of the stages", defect)?;
        size("surplus of the entropy", surplus)?;
    }
    for (here, balance) in c.invariants.iter().zip(&b.invariants) {
        finite("initial value of a further invariant", balance.initial)?;
        size("size of the terms of a further invariant", balance.scale)?;
        size("largest error of a further invariant", balance.max_error)?;
        if (here.0 - balance.initial).abs() > balance.max_error {
            return damaged("initial value of a further invariant", balance.initial);
        }
    }
    let sites = flow.sizes(x).sites().unwrap_or(0);
    let LimitingSites { error, stiffness } = b.limiting_sites;
    if let Some(site) = [error, stiffness].into_iter().flatten().find(|&site| site >= sites) {
        return damaged("site that sets the steps", site as f64);
    }
    size("smallest step", b.smallest_step)?;
    size("largest step", b.largest_step)?;
    if b.smallest_step > b.largest_step {
        return damaged("smallest step", b.smallest_step);
    }
    // What the steps without friction have changed of the entropy is round-off, at worst a sum of it.
    let terms = flow.term_sizes(x).entropy;
    let allowed = (64.0 + c.step as f64) * f64::EPSILON * (terms + c.entropy.0.abs());
    if promises.entropy && (c.kept_entropy.0 - c.entropy.0).abs() > allowed {
        return damaged("kept entropy", c.kept_entropy.0);
    }
    Ok(())
}

/// The numbers of the step size, each by itself.
pub(super) fn of_the_step_size<V>(progress: &Progress<V>) -> Result<(), ResumeError> {
    if progress.every == 0 {
        return damaged("interval of its records", 0.0);
    }
    match &progress.step_size {
        StepSize::Fixed(h) => positive("step size", *h)?,
        StepSize::Adaptive(Controller { pace, .. }) => {
            let &Pace { tolerance, least, largest, next, taken, error, cap, .. } = pace;
            positive("tolerance", tolerance)?;
            positive("next step", next)?;
            for (what, number) in [
                ("least step", least),
                ("largest step", largest),
                ("last step", taken),
                ("last error", error),
                ("bound of the step size", cap.map(|cap| cap.size)),
            ] {
                number.map_or(Ok(()), |number| positive(what, number))?;
            }
        }
    }
    progress.rest.map_or(Ok(()), |tolerance| positive("tolerance of rest", tolerance))
}

/// The time beside the steps, and the end that has been reached or not.
pub(super) fn of_the_schedule(c: &SavedRun) -> Result<(), ResumeError> {
    let progress = &c.progress;
    let (start, time, ended) = (progress.start, c.time.0, progress.ending == Some(Ending::Span));
    // An event that stops a run may lie in its last step.
    let stopped = matches!(progress.ending, Some(Ending::Event { .. }));
    finite("start", start)?;
    if progress.most.is_some_and(|most| most < 2) {
        return damaged("number of states to record", 0.0);
    }
    if progress.rest.is_some_and(|tolerance| tolerance >= 1.0) {
        return damaged("tolerance of rest", progress.rest.unwrap_or(f64::NAN));
    }
    match &progress.step_size {
        &StepSize::Fixed(h) => {
            if Exact(start + c.step as f64 * h) != c.time {
                return damaged("time", time);
            }
            if let Some(count) = progress.count {
                if check_steps(start, h, count).is_err() || c.step > count {
                    return damaged("number of steps to take", count as f64);
                }
                if !stopped && ended != (c.step == count) {
                    return damaged("number of steps", c.step as f64);
                }
            }
        }
        StepSize::Adaptive(Controller { pace, .. }) => {
            let end = pace.end;
            if check_end(start, end).is_err() {
                return damaged("end", end);
            }
            let taken = pace.taken.unwrap_or(0.0);
            // The first steps end after the start, and no step ends after the end.
            let begun =
                if c.step == 0 { c.time == Exact(start) } else { time > start && taken > 0.0 };
            if !(begun && time <= end) || !stopped && ended != (time >= end) {
                return damaged("time", time);
            }
        }
    }
    Ok(())
}

/// The sizes of the entries, and the digits that rounding has lost of them.
pub(super) fn of_the_entries<F: Flow>(
    flow: &F,
    x: &Element<F>,
    progress: &Progress<F::Vector>,
    memory: &impl Memory,
) -> Result<(), ResumeError> {
    let here = flow.sizes(x);
    let [moved, lost] = memory.moved_and_lost();
    for list in [&moved, &lost].into_iter().filter(|list| !list.is_empty()) {
        super::expect_length("numbers of a displacement", list.len(), here.len())?;
    }
    let of = |list: &[f64], i: usize| list.get(i).copied().unwrap_or(0.0);
    for i in 0..here.len() {
        let (here, known) = (here.get(i), progress.scales.sizes.get(i));
        size("size of an entry", known)?;
        if progress.judges_sizes() && known < here {
            return damaged("size of an entry", known);
        }
        if let Some(Judged { first, reached }) = &progress.judged {
            size("size of an entry at the start", first.get(i))?;
            let reached = reached.get(i);
            if !(here..=known).contains(&reached) {
                return damaged("largest size of an entry", reached);
            }
        }
        size("size of the terms of an entry", progress.scales.terms.get(i))?;
        size("largest velocity of an entry", progress.largest_velocity.get(i))?;
        // Both ends of the last step were rounded.
        let (moved, lost) = (of(&moved, i).abs(), of(&lost, i));
        if lost.abs() > LIBRARIES * (here + moved) {
            return damaged("lost digits of an entry", lost);
        }
    }
    Ok(())
}
