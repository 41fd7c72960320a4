//! The interface between explicit methods and systems.

use crate::round_off::bound::SUMMED;
use crate::step::{Element, Flow, Laws, Vector};

/// A flow on which explicit methods run: it says the rates of a stage, and moves a state onto its laws. Every
/// [`Metriplectic`](metriplectic_dynamics::Metriplectic) system is one.
pub trait StageFlow: Flow {
    /// The differentials of the laws at a state, with their values.
    type Gradients: Clone + std::fmt::Debug;

    /// Says whether [`project`](Self::project) uses an estimate of the local error; see [`Target::error`].
    const WEIGHS_ERRORS: bool = false;

    /// Evaluates the laws and their differentials at a state; `None` where one has no value.
    fn gradients(&self, x: &Element<Self>) -> Option<Self::Gradients>;

    /// The values of the laws that go with the differentials.
    fn values(&self, gradients: &Self::Gradients) -> Laws<Self::Numbers>;

    /// The round-off of the entropy at a state, as [`entropy_round_off`](Flow::entropy_round_off) has it for two states, of
    /// which it takes the larger one; `None` if the differentials do not tell.
    #[inline]
    fn entropy_round_off_of(&self, gradients: &Self::Gradients) -> Option<f64> {
        let _ = gradients;
        None
    }

    /// The round-off of the entropy [between](Flow::entropy_round_off) two states, with the differentials at the second one.
    #[inline]
    fn entropy_round_off_to(&self, ends: [&Element<Self>; 2], end: &Self::Gradients) -> f64 {
        let _ = end;
        self.entropy_round_off(ends)
    }

    /// The velocity at a state, in the frame there, and the entropy `⟨dS, K dS⟩` that is produced per unit of
    /// time; `None` where they have no value.
    fn velocity(
        &self,
        x: &Element<Self>,
        gradients: &Self::Gradients,
    ) -> Option<(Self::Vector, f64)>;

    /// The velocity and the production at a state of which nothing else is asked.
    #[inline]
    fn motion(&self, x: &Element<Self>) -> Option<(Self::Vector, f64)> {
        self.velocity(x, &self.gradients(x)?)
    }

    /// The state `ψ_x(q)` at which a stage is taken; `None` beyond the edge of the chart or the domain.
    fn stage(&self, x: &Element<Self>, q: &Self::Vector) -> Option<Element<Self>>;

    /// The rates in the chart of the stages at `x`, of the velocity `v` at `y = ψ_x(q)`.
    fn stage_rates(
        &self,
        x: &Element<Self>,
        at: (&Self::Vector, &Element<Self>),
        v: &Self::Vector,
    ) -> Self::Vector;

    /// The rates and the production of the stage with the coordinates `q = h Σ_j w_j k_j` of so many terms, which go to
    /// `coordinates` if there is such a place; `None` beyond the edge of the chart or the domain.
    ///
    /// A flow of many sites may do all of this in fewer passes over its sites.
    #[inline(always)]
    fn stage_along<'a>(
        &self,
        x: &Element<Self>,
        (h, count): (f64, usize),
        term: impl Fn(usize) -> (f64, &'a Self::Vector),
        coordinates: Option<&mut Self::Vector>,
    ) -> Option<(Self::Vector, f64)>
    where
        Self::Vector: 'a,
    {
        let q = Self::Vector::combination(h, count, term);
        let y = self.stage(x, &q)?;
        let (v, production) = self.motion(&y)?;
        let rates = self.stage_rates(x, (&q, &y), &v);
        if let Some(coordinates) = coordinates {
            *coordinates = q;
        }
        Some((rates, production))
    }

    /// The coordinates `ψ_x⁻¹(y)`.
    fn stage_coordinates(&self, x: &Element<Self>, y: &Element<Self>) -> Self::Vector;

    /// The digits `q − ψ_x⁻¹(y)` that rounding has lost of the coordinates of `y = ψ_x(q)`.
    #[inline]
    fn stage_rounding(
        &self,
        x: &Element<Self>,
        (q, y): (&Self::Vector, &Element<Self>),
    ) -> Self::Vector {
        let reached = self.stage_coordinates(x, y);
        Vector::zip([q, &reached], |[q, reached]| q - reached)
    }

    /// Returns whether the entropy falls from a state to one near it, where the change of its values is round-off. A
    /// flow that cannot say returns `false`.
    fn falls_below_round_off(&self, x: &Element<Self>, y: &Element<Self>) -> bool {
        let _ = (x, y);
        false
    }

    /// Moves a state onto its laws, by Newton's method along their differentials.
    ///
    /// # Errors
    ///
    /// [`ProjectionError`] if no state near `y` has these values.
    fn project(
        &self,
        y: Element<Self>,
        target: &Target<'_, Self>,
    ) -> Result<Projected<Self>, ProjectionError>;
}

/// The values of the laws onto which a state is moved, and how far.
#[derive(Debug)]
pub struct Target<'a, F: Flow + ?Sized> {
    /// The energy and the further invariants; the entropy counts if [`with_entropy`](Self::with_entropy).
    pub laws: &'a Laws<F::Numbers>,
    /// Whether the entropy is one of them. If not, it is only compared with its value.
    pub with_entropy: bool,
    /// A displacement, longer than which none is allowed.
    pub limit: Option<Limit<'a, F::Vector>>,
    /// The unit of each entry, in which displacements and the independence of the laws are measured: the error that is
    /// allowed, or the size in this step. Without it, the size at the state. A flow that
    /// [weighs errors](StageFlow::WEIGHS_ERRORS) may have units of its own.
    pub units: Option<&'a F::Vector>,
    /// An estimate of the local error of the step, if the flow [weighs errors](StageFlow::WEIGHS_ERRORS): a state
    /// may be moved in proportion to it, so that nothing moves which the step has not moved.
    pub error: Option<Combination<'a, F::Vector>>,
}

/// A combination `h Σ_j w_j v_j` of vectors whose numbers are formed where they are needed, so that many sites need no array
/// for them.
#[derive(Debug)]
pub struct Combination<'a, V> {
    /// The factor `h`.
    pub factor: f64,
    /// The terms `(w_j, v_j)`.
    pub terms: &'a [(f64, &'a V)],
}

impl<V> Copy for Combination<'_, V> {}

impl<V> Clone for Combination<'_, V> {
    fn clone(&self) -> Self {
        *self
    }
}

/// The longest displacement by which a state is moved onto its laws.
#[derive(Debug)]
pub enum Limit<'a, V> {
    /// With these entries.
    Entries(&'a V),
    /// Half of the displacement of a step, and no less than the round-off of entries of these sizes.
    HalfOf {
        /// The displacement.
        step: &'a V,
        /// The sizes.
        sizes: &'a V,
    },
}

impl<V> Copy for Limit<'_, V> {}

impl<V> Clone for Limit<'_, V> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<'a, V: Vector> Limit<'a, V> {
    /// Its entries.
    #[must_use]
    pub fn entries(&self) -> V {
        match *self {
            Self::Entries(entries) => entries.clone(),
            Self::HalfOf { step, sizes } => Vector::zip([step, sizes], half_of),
        }
    }

    /// Its length, [relative](Vector::relative_to) to units.
    #[must_use]
    pub fn relative_to(&self, units: &V) -> f64 {
        match *self {
            Self::Entries(entries) => entries.relative_to(units),
            Self::HalfOf { step, sizes } => V::norm_of([step, sizes, units], half_in_units),
        }
    }

    /// Returns whether its length relative to units is below a number. A vector of many sites looks at no more of them than it
    /// needs.
    #[must_use]
    pub fn is_below(&self, length: f64, units: &V) -> bool {
        match *self {
            Self::Entries(_) => self.relative_to(units) < length,
            Self::HalfOf { step, sizes } => {
                V::is_norm_below([step, sizes, units], half_in_units, length)
            }
        }
    }

    /// The limit for a part of each vector.
    #[must_use]
    pub fn map<W>(self, part: impl Fn(&'a V) -> &'a W) -> Limit<'a, W> {
        match self {
            Self::Entries(entries) => Limit::Entries(part(entries)),
            Self::HalfOf { step, sizes } => Limit::HalfOf { step: part(step), sizes: part(sizes) },
        }
    }
}

/// Half of a displacement. Round-off is never too far.
fn half_of([step, size]: [f64; 2]) -> f64 {
    (0.5 * step.abs()).max(SUMMED * size)
}

fn half_in_units([step, size, unit]: [f64; 3]) -> f64 {
    let most = half_of([step, size]);
    if most == 0.0 { 0.0 } else { (most / unit).abs() }
}

/// A state on its laws.
#[derive(Clone, Debug)]
pub struct Projected<F: StageFlow + ?Sized> {
    /// The state.
    pub x: Element<F>,
    /// The differentials of the laws there.
    pub gradients: F::Gradients,
    /// The entropy, less what the errors of the other laws, which are round-off, make of it; and the round-off
    /// of this number.
    pub entropy: f64,
    /// The round-off of `entropy`.
    pub entropy_round_off: f64,
}

/// Why a state could not be moved onto its laws.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProjectionError {
    /// The entropy depends on the other laws, and has another value.
    NoEntropy,
    /// There is no state near by with these values.
    Far,
    /// The way leads out of the domain.
    Outside,
}
