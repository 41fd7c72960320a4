//! Checks that a checkpoint belongs to the method and to the system that are to resume it.

use super::error::{ResumeError, expect_length};
use super::saved::SavedRun;
use crate::step::exact::Exact;
use crate::step::{Element, Flow, Vector as _};

/// Units of round-off by which the values of one field differ between two mathematical libraries: some
/// units for each function in it, and far less than any change of a model.
/// A factor of four fails `run/checkpoint/validation.rs::values_of_another_mathematical_library_are_those_of_the_system`.
const LIBRARIES: f64 = 1024.0 * f64::EPSILON;

/// Accepts the method that took the steps so far, with any options.
pub(super) fn of_the_method(stored: &str, found: String) -> Result<(), ResumeError> {
    if stored == found {
        Ok(())
    } else {
        Err(ResumeError::AnotherMethod { stored: stored.to_owned(), found })
    }
}

/// Accepts a stored value that is the one of the system, but for round-off of its terms.
fn same(field: &'static str, stored: Exact, found: f64, terms: f64) -> Result<(), ResumeError> {
    let stored = stored.0;
    if (stored - found).abs() <= LIBRARIES * terms {
        Ok(())
    } else {
        Err(ResumeError::AnotherSystem { field, stored, found })
    }
}

/// The laws of the system and its velocity, at the stored point.
pub(super) fn of_the_system<F: Flow + ?Sized>(
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
        expect_length("entries of the velocity", c.velocity.len(), velocity.len())?;
        for (i, stored) in c.velocity.iter().enumerate() {
            same("velocity", *stored, velocity.get(i), terms.get(i))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_another_mathematical_library_are_those_of_the_system() {
        let is_same = |off: f64| same("energy", Exact(1.0 + off), 1.0, 1.0).is_ok();
        assert!(is_same(500.0 * f64::EPSILON) && !is_same(2000.0 * f64::EPSILON));
    }
}
