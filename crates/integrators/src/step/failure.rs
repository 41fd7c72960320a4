//! How hard an implicit step is tried, and why it was not taken.

use super::StepError;

/// How hard to try.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fallbacks {
    /// Everything, because only halving the step comes after it.
    All,
    /// The first tries alone, because a smaller step is tried next.
    FirstTries,
}

/// Why a step was not taken.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Cause {
    /// The domain of the model is in the way.
    Edge,
    /// The equation is solved, but its end has another energy.
    Energy { change: f64, size: f64 },
    /// The iteration does not converge.
    Unsolved,
}

impl Cause {
    /// The error that names the first law, if the step was refused because its end has another energy.
    pub(crate) const fn first_law(self, time: f64, h: f64) -> Option<StepError> {
        match self {
            Self::Energy { change, size } => {
                Some(StepError::FirstLawBroken { time, h, change, size })
            }
            Self::Edge | Self::Unsolved => None,
        }
    }
}

/// Increments of the step size that may be tried to get to the size that is asked for.
/// A factor of four fails `step/failure.rs::a_branch_is_followed_until_its_increments_are_tiny`.
const INCREMENTS: usize = 200;
/// The fraction of the size reached below which an increment means that the branch of solutions ends there.
/// A factor of four fails `step/failure.rs::a_branch_is_followed_until_its_increments_are_tiny`.
const LEAST: f64 = 1e-4;

/// How often a step of a fixed size, or a flow, is halved that is not iterated.
/// A factor of four fails `tests/explicit.rs::stiff_friction_is_resolved_and_named`.
pub(crate) const HALVES: u32 = 12;

/// Follows the solutions that begin at rest to the whole step, by fractions of its size: an increment doubles after
/// a solution and is quartered after a failure. `solve` is given a solution with its fraction, and the next fraction.
pub(crate) fn continue_in_step_size<T: Clone>(
    rest: T,
    mut solve: impl FnMut((T, f64), f64) -> Option<T>,
) -> Option<T> {
    let (mut reached, mut increment) = ((rest, 0.0), 0.125);
    for _ in 0..INCREMENTS {
        let next = f64::min(reached.1 + increment, 1.0);
        match solve(reached.clone(), next) {
            Some(found) if next >= 1.0 => return Some(found),
            Some(found) => (reached, increment) = ((found, next), 2.0 * increment),
            None => increment *= 0.25,
        }
        if increment <= LEAST * reached.1 {
            return None;
        }
    }
    None
}

/// The size of the smallest part of a step that was split `splits` times.
pub(crate) fn smallest_part(h: f64, splits: usize) -> f64 {
    (0..splits).fold(h, |part, _| 0.5 * part)
}

#[cfg(test)]
mod tests {
    use super::continue_in_step_size;

    #[test]
    fn a_branch_is_followed_until_its_increments_are_tiny() {
        // It ends in the middle of the step.
        let (mut reached, mut tries) = (0.0, 0);
        let end = continue_in_step_size((), |_, next| {
            tries += 1;
            (next < 0.5).then(|| reached = next)
        });
        assert_eq!(end, None);
        assert!((5e-5..3e-4).contains(&(0.5 - reached)), "{reached} after {tries} tries");
        // One that never ends, in ever smaller parts.
        let mut tries = 0;
        let end = continue_in_step_size((), |((), fraction), next| {
            tries += 1;
            (next - fraction < 3e-4).then_some(())
        });
        assert_eq!(end, None);
        assert!((100..400).contains(&tries), "{tries} tries");
    }
}
