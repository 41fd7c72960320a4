//! Retractions as methods: each stands for its scheme with the default options.

use metriplectic_manifolds::{Cayley, ChartMidpoint, Exponential, Projection, WeylMidpoint};

use crate::midpoint::Scheme;
use crate::step::passed_on::passed_on;
use crate::step::{Compiled, Flow, Stepper};

/// The steps of `Scheme::new(R)`, under its name.
macro_rules! by_default {
    ($($retraction:ty),+) => {$(
        impl<F: Flow> Stepper<F> for $retraction
        where
            Scheme<Self>: Stepper<F>,
        {
            type Memory = <Scheme<Self> as Stepper<F>>::Memory;

            const HAS_DEFAULT_BETWEEN: bool = <Scheme<Self> as Stepper<F>>::HAS_DEFAULT_BETWEEN;

            const IS_IMPLICIT: bool = <Scheme<Self> as Stepper<F>>::IS_IMPLICIT;

            fn compiled(&self) -> Option<Compiled> {
                Scheme::new(*self).compiled()
            }

            passed_on!(F, this => Scheme::new(*this));
        }
    )+};
}
by_default!(WeylMidpoint, ChartMidpoint, Exponential, Projection, Cayley);
