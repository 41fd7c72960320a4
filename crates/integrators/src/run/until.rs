//! Runs in steps that follow a tolerance.

use std::convert::Infallible;

use crate::run::adaptive::Adaptive;
use crate::run::controller::Entries;
use crate::run::corners::Corners;
use crate::run::requests::Requests;
use crate::run::schedule::{Schedule, Size};
use crate::run::sequence::Frozen;
use crate::run::span::Span;

/// A run to a time, in steps that follow a tolerance; made by [`Span::until`].
///
/// ```
/// use metriplectic_integrators::Span;
/// // To t = 50, with an error of about 10⁻⁶ in each turn of the motion; every tenth state is recorded.
/// let span = Span::until(50.0).tolerance(1e-6).every(10);
/// // From t = 20; or less, if the motion comes to rest.
/// let span = span.starting_at(20.0).until_rest(1e-9);
/// // A displacement that starts at zero, and whose usual size is 10⁻⁹, beside two other entries.
/// let span = span.scale([1e-9, 0.0, 0.0]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Until<const N: usize = 0> {
    pub(crate) start: f64,
    end: f64,
    tolerance: f64,
    first: Option<f64>,
    least: Option<f64>,
    largest: Option<f64>,
    pub(crate) every: usize,
    pub(crate) most: Option<usize>,
    pub(crate) rest: Option<f64>,
    backward: bool,
    entries: Entries<[f64; N]>,
}

/// The tolerance without another one.
/// A factor of four fails `run/until.rs::the_tolerance_is_that_of_the_documentation`.
const TOLERANCE: f64 = 1e-6;

impl Span {
    /// From `t = 0` to `t = end`, in steps that follow a [tolerance](Until::tolerance) of 10⁻⁶ or
    /// another one. Both laws hold in each of them, as in steps of one size. The last one ends at
    /// `end`, to the last bit.
    ///
    /// ```
    /// use metriplectic_dynamics::{AreaForm, System};
    /// use metriplectic_fields::Real;
    /// use metriplectic_integrators::{Run, Span};
    /// use metriplectic_manifolds::{Sphere, WeylMidpoint};
    /// use nalgebra::Vector3;
    ///
    /// # fn main() -> Result<(), metriplectic_integrators::Error> {
    /// let top = System::on(Sphere::<2>::round())
    ///     .bracket(AreaForm)
    ///     .energy(|x: &Vector3<Real>| x.component_mul(x).dot(&Vector3::new(1.0, 2.0, 3.0).cast()))
    ///     .build()?;
    /// let span = Span::until(10.0).tolerance(1e-5);
    /// let run = WeylMidpoint.run(&top, Vector3::new(0.6, 0.0, 0.8), span)?;
    /// assert!(run.last().time == 10.0 && run.certificate().keeps_energy());
    /// # Ok(())
    /// # }
    /// ```
    pub const fn until(end: f64) -> Until {
        let (first, least, largest, most, rest) = (None, None, None, None, None);
        let (start, every, entries, backward) = (0.0, 1, Entries::Automatic, false);
        let tolerance = TOLERANCE;
        Until { start, end, tolerance, first, least, largest, every, most, rest, backward, entries }
    }
}

impl Until {
    /// The sizes of the entries that their errors are relative to, one for each direction of the chart, in
    /// the units of the entries. Zero stands for the automatic size: the largest one of the run so far.
    ///
    /// Say the size of an entry that starts at zero and moves late, or of one whose changes matter and are
    /// far smaller than the entry: heights of metres beside an earth's radius.
    ///
    /// The sites of a lattice are alike: one number for each direction of one site is enough.
    #[must_use]
    pub const fn scale<const N: usize>(self, sizes: [f64; N]) -> Until<N> {
        self.with(Entries::Scale(sizes))
    }

    /// The error of each entry that is allowed in a step, in addition to `τ^{3/2}` of its size: one for
    /// each direction of the chart, or of one site of a lattice, in the units of the entries.
    #[must_use]
    pub const fn absolute<const N: usize>(self, errors: [f64; N]) -> Until<N> {
        self.with(Entries::Absolute(errors))
    }

    /// The run with these [sizes](Self::scale), whose number is known when the program runs.
    #[must_use]
    pub fn scale_listed(self, sizes: &[f64]) -> Schedule {
        Schedule::of(self, Entries::Scale(sizes.into()))
    }

    /// The run with these [errors](Self::absolute), whose number is known when the program runs.
    #[must_use]
    pub fn absolute_listed(self, errors: &[f64]) -> Schedule {
        Schedule::of(self, Entries::Absolute(errors.into()))
    }

    const fn with<const N: usize>(self, entries: Entries<[f64; N]>) -> Until<N> {
        let Self {
            start, end, tolerance, first, least, largest, every, most, rest, backward, ..
        } = self;
        Until { start, end, tolerance, first, least, largest, every, most, rest, backward, entries }
    }
}

impl<const N: usize> Until<N> {
    /// About the error, relative to the sizes of the entries, that the run collects while its state
    /// moves by its own size; the error at the end is proportional to it.
    ///
    /// | method | least | largest |
    /// |---|---|---|
    /// | [`Scheme`](crate::Scheme), such as `WeylMidpoint`, and [`RungeKuttaChebyshev`](crate::RungeKuttaChebyshev) | 10⁻¹⁰ | 1 |
    /// | [`DormandPrince5`](crate::DormandPrince5), [`DormandPrince8`](crate::DormandPrince8), [`ExplicitRungeKutta`](crate::ExplicitRungeKutta) with an error of its own, [`Gauss`](crate::Gauss), [`Radau`](crate::Radau) | 10⁻¹⁵ | 1 |
    ///
    /// One below `8ε = 1.8·10⁻¹⁵` is taken for `8ε`: a step has round-off of this size.
    #[must_use]
    pub const fn tolerance(self, tolerance: f64) -> Self {
        Self { tolerance, ..self }
    }

    /// The time at which the run starts, 0 without another one.
    #[must_use]
    pub const fn starting_at(self, start: f64) -> Self {
        Self { start, ..self }
    }

    /// Goes back in time, to an end before the start, see [`Watch::backward`](crate::Watch::backward).
    #[must_use]
    pub const fn backward(self) -> Self {
        Self { backward: true, ..self }
    }

    /// The first step to try, instead of the automatic one.
    #[must_use]
    pub const fn first_step(self, h: f64) -> Self {
        Self { first: Some(h), ..self }
    }

    /// The step size below which the run ends in an error; `16 ε max(|start|, |end|)` without another one.
    #[must_use]
    pub const fn least_step(self, h: f64) -> Self {
        Self { least: Some(h), ..self }
    }

    /// The largest step to take. The last one may be a hundredth longer, instead of a sliver after it.
    #[must_use]
    pub const fn largest_step(self, h: f64) -> Self {
        Self { largest: Some(h), ..self }
    }

    /// Records the start and every `every`-th state after it, and always the last.
    #[must_use]
    pub const fn every(self, every: usize) -> Self {
        Self { every, ..self }
    }

    /// Records at most `states` states: whenever there are more, every second one is given up, and from
    /// then on half as many are recorded. The start and the last state are always recorded, so two are the
    /// fewest.
    ///
    /// ```
    /// # use metriplectic_dynamics::System;
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_integrators::{Run, Span};
    /// # use metriplectic_manifolds::{LieDual, WeylMidpoint};
    /// # use nalgebra::Vector3;
    /// # fn main() -> Result<(), metriplectic_integrators::Error> {
    /// # let body = System::on(LieDual::so3())
    /// #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
    /// #     .build()?;
    /// let span = Span::until(50.0).tolerance(1e-5).at_most(100);
    /// let run = WeylMidpoint.run(&body, Vector3::new(0.4, 0.5, 0.3), span)?;
    /// assert!(run.certificate().steps > 1000);
    /// assert!((50..=100).contains(&run.states().len()) && run.last().time == 50.0);
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub const fn at_most(self, states: usize) -> Self {
        Self { most: Some(if states > 2 { states } else { 2 }), ..self }
    }

    /// Ends the run as soon as the state is at rest, see [`Ending::Rest`](crate::Ending::Rest).
    #[must_use]
    pub const fn until_rest(self, tolerance: f64) -> Self {
        Self { rest: Some(tolerance), ..self }
    }
}

impl<const N: usize> From<Until<N>> for Schedule {
    fn from(until: Until<N>) -> Self {
        let listed = |_, numbers: &[f64; N]| Ok::<_, Infallible>((*numbers).into());
        let Ok(entries) = until.entries.convert(listed);
        Self::of(until, entries)
    }
}

impl Schedule {
    /// The run to a time with what its errors are relative to.
    fn of<const N: usize>(until: Until<N>, entries: Entries<Box<[f64]>>) -> Self {
        let Until {
            start, end, tolerance, first, least, largest, every, most, rest, backward, ..
        } = until;
        let size = Size::Tolerance(Adaptive { end, tolerance, first, least, largest, entries });
        let (watch, corners, frozen) = (Requests::default(), Corners::default(), Frozen::No);
        Self { size, start, backward, count: None, every, most, rest, watch, corners, frozen }
    }
}

#[cfg(test)]
mod tests {
    use crate::run::span::Span;

    #[test]
    fn the_tolerance_is_that_of_the_documentation() {
        assert_eq!(Span::until(2.0), Span::until(2.0).tolerance(1e-6));
    }
}
