//! Schemes for typed systems.

use metriplectic_dynamics::{Metriplectic, SecondLaw};
use metriplectic_manifolds::Retraction;

use super::{MidpointMemory, many};
use crate::discrete_gradient::DiscreteGradient;
use crate::implicit::Midpoint;
use crate::midpoint::Scheme;
use crate::midpoint::step::scheme_name;
use crate::step::failure::Fallbacks;
use crate::step::{
    Compiled, Dim, GradientKind, PathOfStep, Promises, Refusal, Start, StepError, StepStart,
    Stepper, Taken,
};

/// Returns whether steps in plain numbers have the bits of those in types, as the runs of tangents do. Newton's method for increments has
/// derivatives by dual numbers there, and in closed form here.
const fn has_bits_of_types(gradient: Option<GradientKind>) -> bool {
    matches!(gradient, Some(GradientKind::Gonzalez | GradientKind::MeanValue))
}

/// The number of variables up to which the matrices of a step in the types of a system cost less than lists of any length.
/// A factor of four fails `typed/schemes.rs::schemes_of_many_variables_take_their_steps_in_plain_numbers`.
const FEW: usize = 32;

/// Returns whether a scheme of a system takes its steps in plain numbers.
const fn is_of_many<Y, R, W>() -> bool
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    many::has_more::<Y>(FEW) && R::PATH.is_some() && has_bits_of_types(W::KIND)
}

/// The scheme in plain numbers.
fn in_numbers<Y, R, W>(&Scheme { newton, splits, .. }: &Scheme<R, W>) -> Midpoint
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    let line = R::PATH.zip(W::KIND).map(|(path, gradient)| PathOfStep { path, gradient });
    Midpoint { name: scheme_name::<R, W>, line, newton, splits }
}

impl<Y, R, W> Stepper<Y> for Scheme<R, W>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    type Memory = MidpointMemory<Dim<Y>>;

    const HAS_DEFAULT_BETWEEN: bool = true;

    const IS_IMPLICIT: bool = R::PATH.is_some() && has_bits_of_types(W::KIND);

    fn compiled(&self) -> Option<Compiled> {
        let &Self { newton, splits, .. } = self;
        let gradient = W::KIND.filter(|_| has_bits_of_types(W::KIND))?;
        let line = PathOfStep { path: R::PATH?, gradient };
        Some(Compiled::Midpoint { name: scheme_name::<R, W>, line, newton, splits })
    }

    fn name(&self) -> String {
        scheme_name::<R, W>()
    }

    fn order(&self) -> u32 {
        2
    }

    fn promises(&self, system: &Y) -> Promises {
        Promises::all_laws(system.second_law() == SecondLaw::Exact)
    }

    fn step(
        &self,
        start: &StepStart<'_, Y>,
        h: f64,
        memory: &mut Self::Memory,
    ) -> Result<Taken<Y>, StepError> {
        // A constant, so that only one of the two is compiled.
        if const { is_of_many::<Y, R, W>() } {
            return many::step(&in_numbers::<Y, R, W>(self), start, h, memory.many());
        }
        self.with_halves(&Start::of(start, h), memory.few())
    }

    fn attempt(
        &self,
        start: &StepStart<'_, Y>,
        h: f64,
        memory: &mut Self::Memory,
    ) -> Result<Taken<Y>, Refusal> {
        if const { is_of_many::<Y, R, W>() } {
            return many::attempt(&in_numbers::<Y, R, W>(self), start, h, memory.many());
        }
        let start = Start::of(start, h);
        self.try_step(&start, memory.few(), Fallbacks::FirstTries).map_err(|failure| Refusal {
            effort: failure.effort,
            error: failure.cause.first_law(start.time, h),
            second_law: false,
        })
    }
}

#[cfg(test)]
mod tests {
    use metriplectic_dynamics::{Poisson, System};
    use metriplectic_fields::{Real, stack::with_room};
    use metriplectic_manifolds::{Euclidean, WeylMidpoint};
    use nalgebra::{Const, SMatrix, SVector};

    use super::*;
    use crate::typed::many::OfFewOrMany;
    use crate::{Method, Span};

    fn start<const N: usize>() -> SVector<f64, N> {
        SVector::from_fn(|i, _| (0.3 + 1.3 * i as f64).sin() * 0.2)
    }

    #[test]
    fn schemes_of_many_variables_take_their_steps_in_plain_numbers() {
        let scheme = Scheme::new(WeylMidpoint);
        macro_rules! is_of_many {
            ($sites:literal, $n:literal) => {{
                let (ring, x) = (ring!($sites, $n), start::<$n>());
                let mut memory = Default::default();
                scheme.step(&StepStart::first(&ring, &x), 0.01, &mut memory).expect("a step");
                matches!(memory, OfFewOrMany::Many(_))
            }};
        }
        assert!(!is_of_many!(8, 24) && is_of_many!(12, 36));
    }

    #[test]
    fn schemes_of_many_variables_take_the_steps_of_their_types() {
        let (ring, scheme, h) = (ring!(12, 36), Scheme::new(WeylMidpoint), 0.02);
        let (mut x, mut y) = (start::<36>(), start::<36>());
        let (mut typed, mut memory) = (Default::default(), Default::default());
        let mut both = || {
            let at = StepStart::first(&ring, &x);
            x = scheme.with_halves(&Start::of(&at, h), &mut typed).expect("a step").x;
            y = scheme.step(&StepStart::first(&ring, &y), h, &mut memory).expect("a step").x;
            (x - y).amax()
        };
        for step in 0..60 {
            let off = with_room::<Const<36>, f64>(&mut both);
            // States are of order 1, and each step is solved to a few roundings of them.
            assert!(off < 1e-13, "{off:e} after {step} steps");
        }
    }

    #[test]
    fn a_run_of_many_variables_goes_on_from_its_checkpoint_with_the_same_bits() {
        let (ring, span) = (ring!(12, 36), Span::steps(0.02, 40));
        let mut whole = WeylMidpoint.steps(&ring, start(), span).expect("a run");
        for _ in 0..20 {
            whole.advance().expect("a step");
        }
        let mut resumed = WeylMidpoint.resume(&ring, &whole.checkpoint()).expect("the same system");
        for _ in 0..20 {
            for steps in [&mut whole, &mut resumed] {
                steps.advance().expect("a step");
            }
        }
        assert_eq!(resumed.checkpoint(), whole.checkpoint());
        let run = WeylMidpoint.run(&ring, start(), span).expect("a run");
        assert_eq!(run.last().point, whole.state().point);
        assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
    }
}
