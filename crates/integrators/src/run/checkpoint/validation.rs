//! Whether the numbers of a checkpoint agree: with the system at its point, and with each other.

use super::{Checkpoint, Exact, ResumeError, SavedEnding};
use crate::method::{Element, Flow, LimitingSites, Memory, Promises, Vector};
use crate::run::controller::StepSize;
use crate::run::span::{check_end, check_steps};
use crate::run::steps::Progress;

/// Units of round-off by which the values of one field differ between two mathematical libraries: some
/// units for each function in it, and far less than any change of a model.
const LIBRARIES: f64 = 1024.0 * f64::EPSILON;

const fn damaged(what: &'static str, value: f64) -> Result<(), ResumeError> {
    Err(ResumeError::Damaged { what, value })
}

fn finite(what: &'static str, numbers: &[Exact]) -> Result<(), ResumeError> {
    match numbers.iter().find(|number| !number.0.is_finite()) {
        Some(number) => damaged(what, number.0),
        None => Ok(()),
    }
}

/// A finite number that is not negative.
fn size(what: &'static str, number: Exact) -> Result<(), ResumeError> {
    if number.0 >= 0.0 && number.0.is_finite() { Ok(()) } else { damaged(what, number.0) }
}

/// Accepts a stored value that is the one of the system, but for round-off of its terms.
fn same(field: &'static str, stored: Exact, found: f64, terms: f64) -> Result<(), ResumeError> {
    finite(field, &[stored])?;
    let stored = stored.0;
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
    c: &Checkpoint,
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
    c: &Checkpoint,
    promises: Promises,
) -> Result<(), ResumeError> {
    let b = &c.balance;
    finite("initial energy", &[b.initial_energy])?;
    finite("initial entropy", &[b.initial_entropy])?;
    finite("smallest growth of the entropy", &[b.min_entropy_increment])?;
    finite("kept entropy", &[c.kept_entropy])?;
    size("largest error of the energy", b.max_energy_error)?;
    size("largest defect", b.max_manifold_defect)?;
    if b.min_entropy_slope.0.is_nan() {
        return damaged("least slope of the entropy", b.min_entropy_slope.0);
    }
    if b.steps != c.step {
        return damaged("number of steps in the balance", b.steps as f64);
    }
    // A balance holds the errors of the very numbers that are stored beside it.
    if (c.energy.0 - b.initial_energy.0).abs() > b.max_energy_error.0 {
        return damaged("initial energy", b.initial_energy.0);
    }
    if c.step > 0 && Exact(c.entropy.0 - b.initial_entropy.0) != b.entropy_gained {
        return damaged("growth of the entropy", b.entropy_gained.0);
    }
    size("size of the terms of the energy", b.energy_scale)?;
    size("rate of the friction", b.friction)?;
    if let Some((defect, surplus)) = b.stages {
        size("defect of the stages", defect)?;
        size("surplus of the entropy", surplus)?;
    }
    for (here, (initial, error, scale)) in c.invariants.iter().zip(&b.invariants) {
        finite("initial value of a further invariant", &[*initial])?;
        size("size of the terms of a further invariant", *scale)?;
        size("largest error of a further invariant", *error)?;
        if (here.0 - initial.0).abs() > error.0 {
            return damaged("initial value of a further invariant", initial.0);
        }
    }
    let sites = flow.sizes(x).sites().unwrap_or(0);
    let LimitingSites { error, stiffness } = b.limiting_sites;
    if let Some(site) = [error, stiffness].into_iter().flatten().find(|&site| site >= sites) {
        return damaged("site that sets the steps", site as f64);
    }
    size("smallest step", b.smallest_step)?;
    size("largest step", b.largest_step)?;
    if b.smallest_step.0 > b.largest_step.0 {
        return damaged("smallest step", b.smallest_step.0);
    }
    // What the steps without friction have changed of the entropy is round-off, at worst a sum of it.
    let terms = flow.term_sizes(x).entropy;
    let allowed = (64.0 + c.step as f64) * f64::EPSILON * (terms + c.entropy.0.abs());
    if promises.entropy && (c.kept_entropy.0 - c.entropy.0).abs() > allowed {
        return damaged("kept entropy", c.kept_entropy.0);
    }
    Ok(())
}

/// The time beside the steps, and the end that has been reached or not.
pub(super) fn of_the_schedule<V>(
    c: &Checkpoint,
    progress: &Progress<V>,
) -> Result<(), ResumeError> {
    let (start, time, ended) = (c.start.0, c.time.0, c.ending == Some(SavedEnding::Span));
    // An event that stops a run may lie in its last step.
    let stopped = matches!(c.ending, Some(SavedEnding::Event { .. }));
    finite("start", &[c.start])?;
    if c.most.is_some_and(|most| most < 2) {
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
            if let Some(count) = c.count {
                if check_steps(start, h, count).is_err() || c.step > count {
                    return damaged("number of steps to take", count as f64);
                }
                if !stopped && ended != (c.step == count) {
                    return damaged("number of steps", c.step as f64);
                }
            }
        }
        StepSize::Adaptive(controller) => {
            let end = controller.end;
            if check_end(start, end).is_err() {
                return damaged("end", end);
            }
            let taken = controller.taken.unwrap_or(0.0);
            // The first steps end after the start, and no step ends after the end.
            let begun = if c.step == 0 { c.time == c.start } else { time > start && taken > 0.0 };
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
        size("size of an entry", Exact(known))?;
        if progress.judges_sizes() && known < here {
            return damaged("size of an entry", known);
        }
        size("size of the terms of an entry", Exact(progress.scales.terms.get(i)))?;
        size("largest velocity of an entry", Exact(progress.largest_velocity.get(i)))?;
        // Both ends of the last step were rounded.
        let (moved, lost) = (of(&moved, i).abs(), of(&lost, i));
        if lost.abs() > LIBRARIES * (here + moved) {
            return damaged("lost digits of an entry", lost);
        }
    }
    Ok(())
}
