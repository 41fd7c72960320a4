//! A model in plain numbers, as implicit methods ask it: on a vector space, in the canonical inner product of its coordinates.

use metriplectic_dynamics::SecondLaw;
use metriplectic_dynamics::invariants::Kind;
use metriplectic_equations::{self as equations, ENERGY, ENTROPY, Jet, Model, Part, Sizes};

use super::algebra::{Matrix, vector};
use crate::numbers::{Lengths, List};
use crate::step::Laws;
use crate::system::NO_CLOCK;

/// One number, vector or law for each field.
#[derive(Clone, Debug)]
pub(crate) struct OfLaws<V> {
    /// Of the energy.
    pub(crate) energy: V,
    /// Of the entropy.
    pub(crate) entropy: V,
    /// Of each further invariant, in their order.
    pub(crate) invariants: Vec<V>,
}

impl<V> OfLaws<V> {
    /// A function of each.
    #[inline]
    pub(crate) fn map<T>(&self, mut f: impl FnMut(&V) -> T) -> OfLaws<T> {
        OfLaws {
            energy: f(&self.energy),
            entropy: f(&self.entropy),
            invariants: self.invariants.iter().map(f).collect(),
        }
    }
}

/// A vector, and its derivatives along the unknown of a step: a column for each direction.
#[derive(Debug)]
pub(crate) struct WithJacobian<L: Lengths> {
    pub(crate) value: L::Vector,
    pub(crate) slope: Matrix<L>,
}

impl<L: Lengths> Clone for WithJacobian<L> {
    #[inline]
    fn clone(&self) -> Self {
        Self { value: self.value.clone(), slope: self.slope.clone() }
    }
}

/// The differential of a law at a point, and its Hessian.
pub(crate) struct Second<L: Lengths> {
    pub(crate) df: L::Vector,
    pub(crate) hf: Matrix<L>,
}

/// The vector of a part of the motion with its derivatives.
pub(super) struct PartJet<L: Lengths> {
    pub(super) value: L::Vector,
    pub(super) along_x: Matrix<L>,
    pub(super) along_w: Matrix<L>,
    pub(super) tensor: Matrix<L>,
}

/// A model, with the answers that do not change.
pub(crate) struct Parts<'a, L: Lengths> {
    model: &'a dyn Model,
    /// The time of its force, which nothing else depends on.
    time: f64,
    count: usize,
    /// Why each further invariant is conserved.
    pub(crate) kinds: Vec<Kind>,
    /// Whether the entropy has a discrete gradient.
    pub(crate) is_exact: bool,
    /// Whether there is a bracket.
    pub(super) moves: bool,
    /// Whether there is a force.
    pub(super) is_forced: bool,
    /// Whether there is friction.
    pub(crate) rubs: bool,
    /// Whether the bracket annihilates every covector of the entropy.
    pub(super) annihilates_entropy: bool,
    lengths: std::marker::PhantomData<L>,
}

impl<'a, L: Lengths> Parts<'a, L> {
    pub(crate) fn of(model: &'a dyn Model) -> Self {
        let Sizes { directions, laws, .. } = model.sizes();
        let further = if L::HAS_INVARIANTS { laws.saturating_sub(ENTROPY + 1) } else { 0 };
        Self {
            model,
            time: NO_CLOCK,
            count: directions,
            kinds: (0..further).map(|k| model.kind(k)).collect(),
            is_exact: model.second_law() == SecondLaw::Exact,
            moves: !model.is_zero(Part::Reversible),
            is_forced: !model.is_zero(Part::Gyroscopic),
            rubs: !(model.is_zero(Part::Irreversible) || model.has_constant_entropy()),
            annihilates_entropy: model.annihilates_entropy(),
            lengths: std::marker::PhantomData,
        }
    }

    /// The model with its force at a time.
    pub(super) fn at(&self, time: f64) -> Self {
        Self { time, kinds: self.kinds.clone(), ..*self }
    }

    /// The number of directions.
    #[inline]
    pub(crate) fn n(&self) -> usize {
        L::directions(self.count)
    }

    /// The vector with these numbers.
    #[inline]
    pub(super) fn vector(&self, number: impl FnMut(usize) -> f64) -> L::Vector {
        vector(self.n(), number)
    }

    #[inline]
    pub(super) fn zero(&self) -> L::Vector {
        L::Vector::room(|| self.count)
    }

    /// The matrix with these entries.
    #[inline]
    pub(super) fn matrix(&self, entry: impl Fn(usize, usize) -> f64) -> Matrix<L> {
        Matrix::of(self.count, entry)
    }

    #[inline]
    pub(super) fn zeros(&self) -> Matrix<L> {
        Matrix::zeros(self.count)
    }

    /// The number of the law of a further invariant.
    #[inline]
    pub(crate) const fn invariant(k: usize) -> usize {
        ENTROPY + 1 + k
    }

    /// A number for each law, from its number.
    #[inline]
    pub(crate) fn each_law<V>(&self, mut f: impl FnMut(usize) -> V) -> OfLaws<V> {
        OfLaws {
            energy: f(ENERGY),
            entropy: f(ENTROPY),
            invariants: (0..self.kinds.len()).map(|k| f(Self::invariant(k))).collect(),
        }
    }

    /// The state `x + q`.
    #[inline]
    pub(super) fn moved(&self, x: &L::State, q: &L::Vector) -> L::State {
        vector(self.n(), |i| x.numbers()[i] + q[i])
    }

    /// The displacement `y − x`.
    #[inline]
    pub(super) fn between(&self, x: &L::State, y: &L::State) -> L::Vector {
        self.vector(|i| y.numbers()[i] - x.numbers()[i])
    }

    /// The sizes `|x_i|` of the entries.
    #[inline]
    pub(super) fn scales(&self, x: &L::State) -> L::Vector {
        self.vector(|i| x.numbers()[i].abs())
    }

    /// Computes the rounding error of the displacement `d` on the way from `x` to `end`.
    #[inline]
    pub(super) fn lost_digits(&self, x: &L::State, d: &L::Vector, end: &L::State) -> L::Vector {
        self.vector(|i| d[i] - (end.numbers()[i] - x.numbers()[i]))
    }

    /// The laws at a state.
    pub(super) fn laws(&self, x: &L::State) -> Laws<L::Invariants> {
        let mut values = L::Values::room(|| self.kinds.len() + ENTROPY + 1);
        self.model.values(self.time, x.numbers(), values.numbers_mut());
        let values = values.numbers();
        let invariants = L::invariants(&values[ENTROPY + 1..]);
        Laws { energy: values[ENERGY], entropy: values[ENTROPY], invariants }
    }

    /// A law at a state.
    #[inline]
    pub(super) fn value(&self, law: usize, x: &L::State) -> f64 {
        self.model.value(law, self.time, x.numbers())
    }

    /// A law with its differential.
    #[inline]
    pub(crate) fn jet(&self, law: usize, x: &L::State) -> (f64, L::Vector) {
        let mut df = self.zero();
        let value = self.model.jet(law, self.time, x.numbers(), df.numbers_mut());
        (value, df)
    }

    /// The differential of a law and its Hessian.
    #[inline]
    pub(crate) fn second(&self, law: usize, x: &L::State) -> Second<L> {
        let (mut df, mut hf) = (self.zero(), self.zeros());
        self.model.hessian(law, self.time, x.numbers(), df.numbers_mut(), hf.numbers_mut());
        Second { df, hf }
    }

    /// The first and the second derivative of a law along a vector.
    #[inline]
    pub(super) fn along(&self, law: usize, x: &L::State, v: &L::Vector) -> [f64; 2] {
        let [_, first, _, second] = self.model.along(law, self.time, x.numbers(), [v.numbers(); 2]);
        [first, second]
    }

    /// The second derivative of a law along two vectors.
    #[inline]
    pub(super) fn mixed(&self, law: usize, x: &L::State, along: [&L::Vector; 2]) -> f64 {
        self.model.along(law, self.time, x.numbers(), along.map(List::numbers))[3]
    }

    /// The differentials of all laws at a state.
    pub(super) fn differentials(&self, x: &L::State) -> OfLaws<L::Vector> {
        self.each_law(|law| self.jet(law, x).1)
    }

    /// The vector of a part; `None` where it has no value.
    #[inline]
    pub(super) fn apply(
        &self,
        part: Part,
        z: &L::State,
        [energy, entropy, alpha]: [&L::Vector; 3],
    ) -> Option<L::Vector> {
        let (w, mut v) = (covectors::<L>(energy, entropy), self.zero());
        let place = (z.numbers(), self.zero());
        let place = (place.0, place.1.numbers());
        let (alpha, to) = (alpha.numbers(), v.numbers_mut());
        self.model.apply(part, self.time, place, w, alpha, to).ok()?;
        Some(v)
    }

    /// The matrix of the friction; `None` where it has no value.
    pub(super) fn tensor(&self, x: &L::State, w: &OfLaws<L::Vector>) -> Option<Matrix<L>> {
        let (w, mut k) = (covectors::<L>(&w.energy, &w.entropy), self.zeros());
        let (part, x) = (Part::Irreversible, x.numbers());
        self.model.tensor(part, self.time, x, w, k.numbers_mut()).ok()?;
        Some(k)
    }

    /// The derivatives of the friction along the covector of the entropy, or none if it does not depend on it; `None` where it has no
    /// value.
    pub(super) fn friction_along_entropy(
        &self,
        z: &L::State,
        [energy, entropy, alpha]: [&L::Vector; 3],
    ) -> Option<Option<Matrix<L>>> {
        let (w, mut slope) = (covectors::<L>(energy, entropy), self.zeros());
        let (z, to) = (z.numbers(), slope.numbers_mut());
        let depends =
            self.model.friction_along_entropy(NO_CLOCK, z, w, alpha.numbers(), to).ok()?;
        Some(depends.then_some(slope))
    }

    /// The vector of a part with its derivatives; `None` where it has no value.
    #[inline]
    pub(super) fn linearise(
        &self,
        part: Part,
        z: &L::State,
        [energy, entropy, alpha]: [&L::Vector; 3],
    ) -> Option<PartJet<L>> {
        let (mut value, [mut along_x, mut along_w, mut tensor]) =
            (self.zero(), [self.zeros(), self.zeros(), self.zeros()]);
        let mut jet = Jet {
            value: value.numbers_mut(),
            along_x: along_x.numbers_mut(),
            along_w: along_w.numbers_mut(),
            tensor: tensor.numbers_mut(),
        };
        let w = covectors::<L>(energy, entropy);
        self.model.linearise(part, self.time, z.numbers(), w, alpha.numbers(), &mut jet).ok()?;
        Some(PartJet { value, along_x, along_w, tensor })
    }
}

fn covectors<'a, L: Lengths>(
    energy: &'a L::Vector,
    entropy: &'a L::Vector,
) -> equations::Covectors<'a> {
    equations::Covectors { energy: energy.numbers(), entropy: entropy.numbers() }
}
