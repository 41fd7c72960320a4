//! Systems behind pointers, and systems that were verified: another one answers for them.

use std::rc::Rc;
use std::sync::Arc;

use crate::judge::{Judge, RADIUS};
use crate::{Equations, ModelError};

/// A system whose laws were verified once. A run of it checks them at its start alone, without samples around it.
#[derive(Clone, Copy, Debug)]
pub struct VerifiedEquations<S>(S);

impl<S> VerifiedEquations<S> {
    pub(crate) const fn inner(&self) -> &S {
        &self.0
    }
}

impl<S: Equations> VerifiedEquations<S> {
    /// Verifies a system around a state, each coordinate within a tenth of its size.
    ///
    /// # Errors
    ///
    /// [`ModelError`] that names the law, the state and the size of the violation.
    pub fn around(system: S, x0: &[f64]) -> Result<Self, ModelError> {
        Judge::of(&system, 0.0).verify(x0, RADIUS)?;
        Ok(Self(system))
    }
}

/// Answers the questions of [`Equations`] by those of another system.
#[doc(hidden)]
#[macro_export]
macro_rules! answered_by {
    ($([$($generics:tt)*] $type:ty: $this:ident => $other:expr, $verified:expr;)+) => {$(
        impl<$($generics)*> $crate::Equations for $type {
            fn sizes(&self) -> $crate::Sizes {
                let $this = self;
                $other.sizes()
            }

            fn values(&self, t: f64, x: &[f64], values: &mut [f64]) {
                let $this = self;
                $other.values(t, x, values);
            }

            fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
                let $this = self;
                $other.differentials(t, x, values, w);
            }

            fn velocity(&self, t: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
                let $this = self;
                $other.velocity(t, x, v)
            }

            fn second_law(&self) -> $crate::SecondLaw {
                let $this = self;
                $other.second_law()
            }

            fn evaluated(&self, x: &[f64]) -> Vec<$crate::Evaluated> {
                let $this = self;
                $other.evaluated(x)
            }

            fn kind(&self, invariant: usize) -> $crate::Kind {
                let $this = self;
                $other.kind(invariant)
            }

            fn energy_depends_on_time(&self) -> bool {
                let $this = self;
                $other.energy_depends_on_time()
            }

            fn power(&self, t: f64, x: &[f64]) -> f64 {
                let $this = self;
                $other.power(t, x)
            }

            fn check(&self, x: &[f64]) -> Result<(), $crate::PointError> {
                let $this = self;
                $other.check(x)
            }

            fn defect(&self, x: &[f64]) -> f64 {
                let $this = self;
                $other.defect(x)
            }

            fn scales(&self, x: &[f64], sizes: &mut [f64]) {
                let $this = self;
                $other.scales(x, sizes);
            }

            fn is_vector_space(&self) -> bool {
                let $this = self;
                $other.is_vector_space()
            }

            fn chart(&self, x: &[f64], q: &[f64], y: &mut [f64]) {
                let $this = self;
                $other.chart(x, q, y);
            }

            fn coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) -> bool {
                let $this = self;
                $other.coordinates(x, y, q)
            }

            fn stage_state(&self, x: &[f64], q: &[f64], y: &mut [f64]) -> bool {
                let $this = self;
                $other.stage_state(x, q, y)
            }

            fn stage_coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) {
                let $this = self;
                $other.stage_coordinates(x, y, q);
            }

            fn stage_rates(&self, x: &[f64], q: &[f64], y: &[f64], v: &[f64], rates: &mut [f64]) {
                let $this = self;
                $other.stage_rates(x, q, y, v, rates);
            }

            fn velocity_with(&self, t: f64, x: &[f64], w: &[f64], v: &mut [f64]) -> Option<f64> {
                let $this = self;
                $other.velocity_with(t, x, w, v)
            }

            fn stage(&self, t: f64, x: &[f64], q: &[f64], rates: &mut [f64]) -> Option<f64> {
                let $this = self;
                $other.stage(t, x, q, rates)
            }

            fn is_verified(&self) -> bool {
                let $this = self;
                $verified($other)
            }

            fn model(&self) -> Option<&dyn $crate::Model> {
                let $this = self;
                $other.model()
            }
        }
    )+};
}

answered_by! {
    [S: Equations + ?Sized] &S: this => &**this, |of: &S| of.is_verified();
    [S: Equations + ?Sized] Box<S>: this => &**this, |of: &S| of.is_verified();
    [S: Equations + ?Sized] Rc<S>: this => &**this, |of: &S| of.is_verified();
    [S: Equations + ?Sized] Arc<S>: this => &**this, |of: &S| of.is_verified();
    [S: Equations] VerifiedEquations<S>: this => &this.0, |_: &S| true;
}
