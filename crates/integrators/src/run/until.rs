//! What a user says of a run in steps that follow a tolerance.

use std::convert::Infallible;

use crate::method::{Element, Flow, Vector};
use crate::run::controller::{Controller, Pace, Rule};
use crate::run::scales::Scales;
use crate::run::span::{Schedule, Size, Span, SpanError, check_end, check_step_size};
use crate::run::watch::Requests;

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
    entries: Entries<[f64; N]>,
}

/// What is known of the errors of the entries, one number for each direction of the chart.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) enum Entries<V> {
    /// Nothing: errors are relative to the sizes that the entries have.
    Automatic,
    /// The sizes of some entries; zero for an automatic one.
    Scale(V),
    /// Errors that are allowed in addition.
    Absolute(V),
}

/// The tolerance without another one.
const TOLERANCE: f64 = 1e-6;
/// The least error `τ^p` of a step, with the power of its [`Control`](crate::method::Control), and the least error `τ`
/// of a run: some units of round-off. So the least tolerance is 10⁻¹⁰ for `p = 3/2`, and this one for `p ≤ 1`.
const LEAST: f64 = 1e-15;
/// The largest tolerance: an error of the size of the entry.
const LARGEST: f64 = 1.0;

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
        let (start, every, entries) = (0.0, 1, Entries::Automatic);
        let tolerance = TOLERANCE;
        Until { start, end, tolerance, first, least, largest, every, most, rest, entries }
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

    const fn with<const N: usize>(self, entries: Entries<[f64; N]>) -> Until<N> {
        let Self { start, end, tolerance, first, least, largest, every, most, rest, .. } = self;
        Until { start, end, tolerance, first, least, largest, every, most, rest, entries }
    }
}

impl<const N: usize> Until<N> {
    /// About the error, relative to the sizes of the entries, that the run collects while its state
    /// moves by its own size; the error at the end is proportional to it.
    ///
    /// | method | least | largest |
    /// |---|---|---|
    /// | [`Scheme`](crate::Scheme), such as `WeylMidpoint`, and [`RungeKuttaChebyshev`](crate::RungeKuttaChebyshev) | 10⁻¹⁰ | 1 |
    /// | [`DormandPrince5`](crate::DormandPrince5), [`DormandPrince8`](crate::DormandPrince8), [`Gauss`](crate::Gauss), [`Radau`](crate::Radau) | 10⁻¹⁵ | 1 |
    #[must_use]
    pub const fn tolerance(self, tolerance: f64) -> Self {
        Self { tolerance, ..self }
    }

    /// The time at which the run starts, 0 without another one.
    #[must_use]
    pub const fn starting_at(self, start: f64) -> Self {
        Self { start, ..self }
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

impl<V> Entries<V> {
    /// The same, with the numbers in another form.
    pub(crate) fn convert<W, E>(
        &self,
        convert: impl FnOnce(&'static str, &V) -> Result<W, E>,
    ) -> Result<Entries<W>, E> {
        Ok(match self {
            Self::Automatic => Entries::Automatic,
            Self::Scale(sizes) => Entries::Scale(convert("sizes of entries", sizes)?),
            Self::Absolute(errors) => Entries::Absolute(convert("errors of entries", errors)?),
        })
    }
}

impl<const N: usize> From<Until<N>> for Schedule {
    fn from(until: Until<N>) -> Self {
        let Until { start, end, tolerance, first, least, largest, every, most, rest, entries } =
            until;
        let Ok(entries) = entries.convert(|_, numbers| Ok::<_, Infallible>((*numbers).into()));
        let size = Size::Tolerance(Adaptive { end, tolerance, first, least, largest, entries });
        Self { size, start, count: None, every, most, rest, watch: Requests::default() }
    }
}

/// What a course says of steps that follow a tolerance.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Adaptive {
    end: f64,
    tolerance: f64,
    first: Option<f64>,
    least: Option<f64>,
    largest: Option<f64>,
    entries: Entries<Box<[f64]>>,
}

impl Adaptive {
    pub(crate) const fn end(&self) -> f64 {
        self.end
    }

    pub(crate) fn check(&self, start: f64) -> Result<(), SpanError> {
        check_end(start, self.end)?;
        for h in [self.first, self.least, self.largest].into_iter().flatten() {
            check_step_size(h)?;
        }
        if let (Some(least), Some(largest)) = (self.least, self.largest)
            && least > largest
        {
            return Err(SpanError::StepSizes { least, largest });
        }
        Ok(())
    }

    /// Accepts a tolerance that a method with this rule can hold.
    pub(crate) fn check_tolerance(&self, rule: &Rule) -> Result<(), SpanError> {
        let (tolerance, least, largest) = (self.tolerance, rule.tolerance_of(LEAST), LARGEST);
        let least = least.max(LEAST);
        if tolerance >= least && tolerance <= largest {
            Ok(())
        } else {
            Err(SpanError::Tolerance { tolerance, least, largest })
        }
    }

    /// The numbers for the entries of a point with `expected` directions.
    fn entries<V: Vector>(&self, like: &V) -> Result<Entries<V>, SpanError> {
        self.entries.convert(|_, list| {
            let bad = list.iter().position(|x| !(*x >= 0.0 && x.is_finite()));
            if let Some(index) = bad {
                return Err(SpanError::Entry { index, value: list[index] });
            }
            let other = SpanError::Entries { found: list.len(), expected: like.kinds() };
            like.with_list(list).ok_or(other)
        })
    }

    /// The controller of a run from `x` under this rule, with entries of these sizes.
    pub(crate) fn controller<F: Flow>(
        &self,
        rule: &Rule,
        flow: &F,
        x: &Element<F>,
        scales: &Scales<F::Vector>,
    ) -> Result<Controller<F::Vector>, SpanError> {
        let Self { end, tolerance, least, largest, .. } = *self;
        let pace = Pace { end, tolerance, least, largest, ..Pace::default() };
        let mut controller = Controller { pace, entries: self.entries(&scales.sizes)? };
        let first = self.first.unwrap_or_else(|| controller.first_step(rule, flow, x, scales));
        controller.pace.next = controller.pace.within(rule, first);
        Ok(controller)
    }
}
