//! Typed systems of many variables on a vector space take implicit steps in plain numbers, where no matrix is copied, and a Jacobian of
//! stages serves many steps.

use metriplectic_dynamics::{InNumbers, Metriplectic, system::Point};
use metriplectic_fields::{Dimension as _, Space as _};
use metriplectic_manifolds::Riemannian as _;

use crate::numbers::FromEquations;
use crate::step::in_plain::{typed, written};
use crate::step::{
    Dim, Flow, Listed as _, Memory, Refusal, RestoreError, Saved, StepEnds, StepError, StepStart,
    Stepper, Taken, Written, both,
};

/// The number of variables up to which steps in the types of a system take no more instructions than in lists of any length.
/// A factor of four fails `typed/many.rs::systems_of_many_variables_keep_their_jacobian`.
const FEW: usize = 8;

/// Returns whether a system takes its steps with stages in plain numbers.
pub(super) const fn is_of_many<Y: Metriplectic>() -> bool {
    has_more::<Y>(FEW)
}

/// Returns whether a system on a vector space with the canonical metric has more than `few` variables.
pub(super) const fn has_more<Y: Metriplectic>(few: usize) -> bool {
    Dim::<Y>::LEN > few && Y::Manifold::IS_VECTOR_SPACE && Y::Metric::IS_CANONICAL
}

/// The memory of a method for typed systems, of few variables or of many.
#[doc(hidden)]
#[derive(Clone, Debug)]
pub enum OfFewOrMany<T, N> {
    /// In the types of a system.
    Few(T),
    /// In plain numbers.
    Many(N),
}

impl<T: Default, N> Default for OfFewOrMany<T, N> {
    fn default() -> Self {
        Self::Few(T::default())
    }
}

impl<T: Default, N: Default> OfFewOrMany<T, N> {
    /// The memory of steps in types.
    pub(super) fn few(&mut self) -> &mut T {
        if let Self::Many(_) = self {
            *self = Self::default();
        }
        match self {
            Self::Few(memory) => memory,
            Self::Many(_) => unreachable!("it has just been replaced"),
        }
    }

    /// The memory of steps in plain numbers.
    pub(super) fn many(&mut self) -> &mut N {
        if let Self::Few(_) = self {
            *self = Self::Many(N::default());
        }
        match self {
            Self::Many(memory) => memory,
            Self::Few(_) => unreachable!("it has just been replaced"),
        }
    }
}

/// The mark of numbers of steps in plain numbers in a checkpoint.
const MARK: &str = "steps in plain numbers";

/// Calls the memory that there is.
macro_rules! each {
    ($self:expr, $memory:ident => $of:expr) => {
        match $self {
            Self::Few($memory) => Self::Few($of),
            Self::Many($memory) => Self::Many($of),
        }
    };
}

impl<T: Memory, N: Memory> Memory for OfFewOrMany<T, N> {
    fn rescaled(&self, ratio: f64) -> Self {
        each!(self, memory => memory.rescaled(ratio))
    }

    fn restarted(&self) -> Self {
        each!(self, memory => memory.restarted())
    }

    fn beside(&self) -> Self {
        each!(self, memory => memory.beside())
    }

    fn clocked(&mut self) {
        match self {
            Self::Few(memory) => memory.clocked(),
            Self::Many(memory) => memory.clocked(),
        }
    }

    fn take_room(&mut self, from: &mut Self) {
        match (self, from) {
            (Self::Few(memory), Self::Few(from)) => memory.take_room(from),
            (Self::Many(memory), Self::Many(from)) => memory.take_room(from),
            _ => {}
        }
    }

    fn reuse(&mut self, given_up: Self) {
        match (self, given_up) {
            (Self::Few(memory), Self::Few(given_up)) => memory.reuse(given_up),
            (Self::Many(memory), Self::Many(given_up)) => memory.reuse(given_up),
            _ => {}
        }
    }

    fn refused(&mut self, tried: Self) {
        match (self, tried) {
            (Self::Few(memory), Self::Few(tried)) => memory.refused(tried),
            (Self::Many(memory), Self::Many(tried)) => memory.refused(tried),
            _ => {}
        }
    }

    fn stage_count(&self) -> Option<u32> {
        match self {
            Self::Few(memory) => memory.stage_count(),
            Self::Many(memory) => memory.stage_count(),
        }
    }

    fn stage_velocities(&self) -> Vec<f64> {
        match self {
            Self::Few(memory) => memory.stage_velocities(),
            Self::Many(memory) => memory.stage_velocities(),
        }
    }

    fn save(&self, saved: &mut Saved) {
        match self {
            Self::Few(memory) => memory.save(saved),
            Self::Many(memory) => {
                saved.put(MARK, []);
                memory.save(saved);
            }
        }
    }

    fn restore(saved: &Saved) -> Result<Self, RestoreError> {
        match saved.list(MARK)? {
            None => T::restore(saved).map(Self::Few),
            Some(_) => N::restore(saved).map(Self::Many),
        }
    }
}

/// A typed system in plain numbers.
type InLists<'a, Y> = FromEquations<InNumbers<'a, Y>>;

/// Calls `f` with the start of a step in plain numbers.
fn with_start<Y: Metriplectic, T>(
    StepStart { flow, x, time, values, reference, allowed }: &StepStart<'_, Y>,
    f: impl FnOnce(&StepStart<'_, InLists<'_, Y>>) -> T,
) -> T {
    f(&StepStart {
        flow: &FromEquations(InNumbers(*flow)),
        x: &Y::write(x),
        time: *time,
        values: written(values),
        reference: written(reference),
        allowed: allowed.as_ref().map(Y::directions),
    })
}

/// Calls `f` with the ends of a step in plain numbers.
fn with_ends<Y: Metriplectic, T>(
    &StepEnds { flow, x, end, h, values, reference }: &StepEnds<'_, Y>,
    f: impl FnOnce(&StepEnds<'_, InLists<'_, Y>>) -> T,
) -> T {
    let [x, end] = both([x, end], |x| Y::write(x));
    let [before, after] = both(values, written);
    let flow = &FromEquations(InNumbers(flow));
    let values = [&before, &after];
    f(&StepEnds { flow, x: &x, end: &end, h, values, reference: &written(reference) })
}

fn taken<Y: Metriplectic>(
    Taken { x, values, evidence, effort }: Taken<InLists<'_, Y>>,
) -> Taken<Y> {
    Taken { x: Y::read(&(), &x), values: typed::<Y>(&values), evidence, effort }
}

/// Takes a step, as [`Stepper::step`] does.
pub(super) fn step<Y, M, N>(
    method: &M,
    start: &StepStart<'_, Y>,
    h: f64,
    memory: &mut N,
) -> Result<Taken<Y>, StepError>
where
    Y: Metriplectic,
    M: for<'a> Stepper<InLists<'a, Y>, Memory = N>,
{
    with_start(start, |start| method.step(start, h, memory).map(taken))
}

/// Tries a step, as [`Stepper::attempt`] does.
pub(super) fn attempt<Y, M, N>(
    method: &M,
    start: &StepStart<'_, Y>,
    h: f64,
    memory: &mut N,
) -> Result<Taken<Y>, Refusal>
where
    Y: Metriplectic,
    M: for<'a> Stepper<InLists<'a, Y>, Memory = N>,
{
    with_start(start, |start| method.attempt(start, h, memory).map(taken))
}

/// Estimates the error of a step, as [`Stepper::error`] does.
pub(super) fn error<Y, M, N>(
    method: &M,
    step: &StepEnds<'_, Y>,
    memory: &N,
    norm: impl Fn(&<Y as Flow>::Vector) -> f64,
) -> Option<f64>
where
    Y: Metriplectic,
    M: for<'a> Stepper<InLists<'a, Y>, Memory = N>,
{
    with_ends(step, |step| method.error(step, memory, |error| norm(&Y::vector(error))))
}

/// Computes a state inside a step, as [`Stepper::between`] does.
pub(super) fn between<Y, M, N>(
    method: &M,
    step: &StepEnds<'_, Y>,
    memory: &mut N,
    theta: f64,
) -> Option<Point<Y>>
where
    Y: Metriplectic,
    M: for<'a> Stepper<InLists<'a, Y>, Memory = N>,
{
    with_ends(step, |step| Some(Y::read(&(), &method.between(step, memory, theta)?)))
}

#[cfg(test)]
mod tests {
    use metriplectic_dynamics::{Poisson, System};
    use metriplectic_fields::Real;
    use metriplectic_manifolds::Euclidean;
    use nalgebra::{SMatrix, SVector};

    use super::*;
    use crate::{Gauss, Method, Radau, Span};

    fn start<const N: usize>() -> SVector<f64, N> {
        SVector::from_fn(|i, _| (0.3 + 1.3 * i as f64).sin() * 0.4)
    }

    /// Says whether a step of a system was taken in plain numbers.
    fn is_in_numbers<Y: Metriplectic>(system: &Y, x: &Point<Y>) -> bool {
        let mut memory = Stepper::<Y>::memory(&Gauss::<2>);
        Gauss::<2>.step(&StepStart::first(system, x), 0.05, &mut memory).expect("a step");
        matches!(memory, OfFewOrMany::Many(_))
    }

    #[test]
    fn systems_of_many_variables_keep_their_jacobian() {
        assert!(!is_in_numbers(&ring!(2, 6), &start()) && is_in_numbers(&ring!(3, 9), &start()));
    }

    #[test]
    fn a_run_of_many_variables_goes_on_from_its_checkpoint_with_the_same_bits() {
        let (ring, span) = (ring!(4, 12), Span::steps(0.05, 40));
        macro_rules! resumes {
            ($($method:expr),*) => {$(
                let mut whole = $method.steps(&ring, start(), span).expect("a run");
                for _ in 0..20 {
                    whole.advance().expect("a step");
                }
                let mut resumed = $method.resume(&ring, &whole.checkpoint()).expect("the same system");
                for _ in 0..20 {
                    for steps in [&mut whole, &mut resumed] {
                        steps.advance().expect("a step");
                    }
                }
                assert_eq!(resumed.checkpoint(), whole.checkpoint());
                let run = $method.run(&ring, start(), span).expect("a run");
                assert_eq!(run.last().point, whole.state().point);
                assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
            )*};
        }
        resumes!(Gauss::<3>, Radau::<2>);
    }
}
