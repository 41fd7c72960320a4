//! The flow of a typed system in plain numbers, in lists of lengths that are known when this library is compiled.
//!
//! Explicit methods of it are compiled with this library, one instance for each pair of lengths, in place of one for each system.
//! Their stages ask the system one question each. A step has the bits of the types of a system.

use metriplectic_dynamics::SecondLaw;
use metriplectic_equations::{ENTROPY, Equations, Evaluated};
use metriplectic_manifolds::PointError;

use super::answered::Answered;
use super::kept::Kept;
use super::lengths::{Array, Arrays, Known, List};
use super::projection::{Aim, Projection};
use super::rows::Rows;
use super::stages::{self, stage_flow};
use super::{StageFlow, referred_rise};
use crate::explicit::{Projected, ProjectionError, Target};
use crate::step::{Directions, Element, Entries, Flow, Laws, Listed, Values, Vector as _, Written};
use crate::system::NO_CLOCK;

/// A typed system of `N` directions and `E` entries without further invariants, in plain numbers.
pub(crate) struct OfLength<'a, const N: usize, const E: usize> {
    system: Kept<'a>,
    answered: &'a Answered<'a>,
}

impl<'a, const N: usize, const E: usize> OfLength<'a, N, E> {
    pub(crate) fn new(answered: &'a Answered<'a>) -> Self {
        Self { system: Kept::new(answered.numbers.0), answered }
    }

    /// Returns the system that it asks.
    pub(crate) const fn equations(&self) -> &Kept<'a> {
        &self.system
    }
}

/// Writes a list.
fn entries(x: &impl List) -> Entries {
    x.numbers().into()
}

/// Reads laws.
fn read(Laws { energy, entropy, .. }: Laws<Values>) -> Laws<[f64; 0]> {
    Laws { energy, entropy, invariants: [] }
}

impl<const N: usize, const E: usize> Flow for OfLength<'_, N, E> {
    type Space = Arrays<E>;
    type Numbers = [f64; 0];
    type Vector = Array<N>;

    fn room(&self, work: &mut dyn FnMut()) {
        self.answered.room(work);
    }

    fn laws(&self, x: &[f64; E]) -> Laws<[f64; 0]> {
        read(self.answered.laws(&entries(x)))
    }

    fn term_sizes(&self, x: &[f64; E]) -> Laws<[f64; 0]> {
        read(self.answered.term_sizes(&entries(x)))
    }

    fn rates(&self, x: &[f64; E], d: &Array<N>) -> Option<Array<N>> {
        let rates = self.answered.rates(&entries(x), &Self::directions(d))?;
        Some(Self::vector(&rates))
    }

    #[inline]
    fn sizes(&self, x: &[f64; E]) -> Array<N> {
        stages::scales(&self.system, x.numbers())
    }

    fn moved(&self, x: &[f64; E], d: &Array<N>) -> [f64; E] {
        List::of(&self.answered.moved(&entries(x), &Self::directions(d)))
    }

    fn displacement(&self, x: &[f64; E], y: &[f64; E]) -> Option<Array<N>> {
        stages::displacement(&self.system, x.numbers(), y.numbers())
    }

    fn production(&self, x: &[f64; E]) -> Option<f64> {
        self.answered.production(&entries(x))
    }

    fn onto(
        &self,
        y: &[f64; E],
        Laws { energy, entropy, .. }: &Laws<[f64; 0]>,
        onto_entropy: Option<f64>,
    ) -> Option<[f64; E]> {
        let (energy, entropy, invariants) = (*energy, *entropy, Values::of(&[]));
        let laws = Laws { energy, entropy, invariants };
        self.answered.onto(&entries(y), &laws, onto_entropy).map(|x| List::of(&x))
    }

    fn element(&self, entries: &[f64]) -> Result<[f64; E], PointError> {
        self.answered.element(entries).map(|x| List::of(&x))
    }

    fn evaluated(&self, x: &[f64; E]) -> Vec<Evaluated> {
        self.system.evaluated(x)
    }

    #[inline]
    fn entropy_law(&self) -> SecondLaw {
        self.system.second_law()
    }

    fn entropy_round_off(&self, [x, y]: [&[f64; E]; 2]) -> f64 {
        self.answered.entropy_round_off([&entries(x), &entries(y)])
    }

    fn local_error(&self, x: &[f64; E], end: &[f64; E], h: f64) -> Option<Array<N>> {
        let error = self.answered.local_error(&entries(x), &entries(end), h)?;
        Some(Self::vector(&error))
    }
}

impl<const N: usize, const E: usize> Listed for OfLength<'_, N, E> {
    type Layout = ();

    fn layout(&self) -> &() {
        &()
    }

    #[inline]
    fn read((): &(), entries: &[f64]) -> [f64; E] {
        List::of(entries)
    }

    #[inline]
    fn write(x: &[f64; E]) -> Entries {
        entries(x)
    }
}

impl<const N: usize, const E: usize> Written for OfLength<'_, N, E> {
    #[inline]
    fn vector(directions: &Directions) -> Array<N> {
        List::of(directions.numbers())
    }

    #[inline]
    fn directions(v: &Array<N>) -> Directions {
        Directions::of(v.numbers())
    }

    #[inline]
    fn numbers(_: &Values) -> [f64; 0] {
        []
    }
}

stage_flow!([const N: usize, const E: usize] OfLength<'_, N, E>, Known<N, E>);
