//! Whether the numbers of a checkpoint agree: with the system at its point, and with each other.

use metriplectic_dynamics::invariants::{Invariants as _, Kind, Visitor};
use metriplectic_dynamics::system::Point;
use metriplectic_dynamics::{Metriplectic, SecondLaw};
use metriplectic_fields::{Column, Dimension, ScalarField, Vector};
use metriplectic_manifolds::Manifold;

use super::{Checkpoint, Exact, ResumeError, SavedEnding};
use crate::adaptive::StepSize;
use crate::residual::Dim;
use crate::scales;
use crate::span::{check_end, check_steps};
use crate::step::Memory;
use crate::trajectory::Progress;

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

/// The value of a field, and the size `|F| + Σ_i |∂_iF| |x_i|` of its terms.
fn value<Y: Metriplectic>(f: &impl ScalarField<Y::Manifold>, x: &Point<Y>) -> [f64; 2] {
    let (jet, sizes) = (f.jet1(x), Y::Manifold::scales(x));
    let slopes = (0..Vector::<Y::Manifold>::LEN).map(|i| (jet.df[i] * sizes[i]).abs());
    [f.at(x), jet.value.abs() + slopes.sum::<f64>()]
}

/// The fields of the system and its velocity, at the stored point.
pub(super) fn of_the_system<Y: Metriplectic>(
    system: &Y,
    x: &Point<Y>,
    c: &Checkpoint,
) -> Result<(), ResumeError> {
    struct Values<'a, Y: Metriplectic>(&'a Point<Y>, Vec<[f64; 2]>);
    impl<Y: Metriplectic> Visitor<Y::Manifold> for Values<'_, Y> {
        fn visit(&mut self, _: Kind, f: &impl ScalarField<Y::Manifold>) {
            self.1.push(value::<Y>(f, self.0));
        }
    }
    let [energy, energy_terms] = value::<Y>(system.energy(), x);
    same("energy", c.energy, energy, energy_terms)?;
    let [entropy, entropy_terms] = value::<Y>(system.entropy(), x);
    same("entropy", c.entropy, entropy, entropy_terms)?;
    let mut values = Values::<Y>(x, Vec::new());
    system.invariants().each(&mut values);
    for (stored, [found, terms]) in c.invariants.iter().zip(values.1) {
        same("further invariant", *stored, found, terms)?;
    }
    if let Some([velocity, terms]) = scales::velocity_and_terms(system, x)
        && !c.velocity.is_empty()
    {
        super::expect_length("entries of the velocity", c.velocity.len(), Dim::<Y>::LEN)?;
        for (i, stored) in c.velocity.iter().enumerate() {
            same("velocity", *stored, velocity[i], terms[i])?;
        }
    }
    Ok(())
}

/// The balance beside the state that it is the balance of.
pub(super) fn of_the_balance<Y: Metriplectic>(
    system: &Y,
    x: &Point<Y>,
    c: &Checkpoint,
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
    for (here, (initial, error, scale)) in c.invariants.iter().zip(&b.invariants) {
        finite("initial value of a further invariant", &[*initial])?;
        size("size of the terms of a further invariant", *scale)?;
        size("largest error of a further invariant", *error)?;
        if (here.0 - initial.0).abs() > error.0 {
            return damaged("initial value of a further invariant", initial.0);
        }
    }
    size("smallest step", b.smallest_step)?;
    size("largest step", b.largest_step)?;
    if b.smallest_step.0 > b.largest_step.0 {
        return damaged("smallest step", b.smallest_step.0);
    }
    // What the steps without friction have changed of the entropy is round-off, at worst a sum of it.
    let [_, terms] = value::<Y>(system.entropy(), x);
    let allowed = (64.0 + c.step as f64) * f64::EPSILON * (terms + c.entropy.0.abs());
    let exact = system.second_law() == SecondLaw::Exact;
    if exact && (c.kept_entropy.0 - c.entropy.0).abs() > allowed {
        return damaged("kept entropy", c.kept_entropy.0);
    }
    Ok(())
}

/// The time beside the steps, and the end that has been reached or not.
pub(super) fn of_the_course<N: Dimension>(
    c: &Checkpoint,
    progress: &Progress<N>,
) -> Result<(), ResumeError> {
    let (start, time, ended) = (c.start.0, c.time.0, c.ending == Some(SavedEnding::Span));
    finite("start", &[c.start])?;
    if c.most.is_some_and(|most| most < 2) {
        return damaged("number of states to record", 0.0);
    }
    if progress.rest.is_some_and(|tolerance| tolerance >= 1.0) {
        return damaged("tolerance of rest", progress.rest.unwrap_or(f64::NAN));
    }
    match progress.pace {
        StepSize::Fixed(h) => {
            if Exact(start + c.step as f64 * h) != c.time {
                return damaged("time", time);
            }
            if let Some(count) = c.count {
                if check_steps(start, h, count).is_err() || c.step > count {
                    return damaged("number of steps to take", count as f64);
                }
                if ended != (c.step == count) {
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
            if !(begun && time <= end) || ended != (time >= end) {
                return damaged("time", time);
            }
        }
    }
    Ok(())
}

/// The sizes of the entries, and the digits that rounding has lost of them.
pub(super) fn of_the_entries<Y: Metriplectic>(
    x: &Point<Y>,
    progress: &Progress<Dim<Y>>,
    memory: &Memory<Dim<Y>>,
) -> Result<(), ResumeError> {
    let here = Y::Manifold::scales(x);
    for i in 0..Dim::<Y>::LEN {
        let known = progress.scales.sizes[i];
        size("size of an entry", Exact(known))?;
        if progress.judges_sizes() && known < here[i] {
            return damaged("size of an entry", known);
        }
        size("size of the terms of an entry", Exact(progress.scales.terms[i]))?;
        size("largest velocity of an entry", Exact(progress.largest_velocity[i]))?;
        // Both ends of the last step were rounded.
        let moved = if memory.known > 0 { memory.differences[0][i].abs() } else { 0.0 };
        let lost = memory.compensation.map_or(0.0, |compensation| compensation[i]);
        if lost.abs() > LIBRARIES * (here[i] + moved) {
            return damaged("lost digits of an entry", lost);
        }
    }
    Ok(())
}
