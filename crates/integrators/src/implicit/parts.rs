//! A model in plain numbers, as implicit methods ask it.
//!
//! On a vector space with the canonical metric nothing of the space is asked for: charts are translations, and paths straight lines.

use std::ops::Range;

use metriplectic_dynamics::SecondLaw;
use metriplectic_dynamics::invariants::Kind;
use metriplectic_equations::room::with_numbers;
use metriplectic_equations::{
    self as equations, ByCharts, ENERGY, ENTROPY, Jet, Model, Part, Path, PathAt, PathSlopes,
    Paths, Sizes,
};

use smallvec::{SmallVec, smallvec};

use super::algebra::{Matrix, dot, sum_of_terms, vector};
use super::metric::Metric;
use crate::numbers::{Lengths, List};
use crate::step::Laws;
use crate::system::NO_CLOCK;

/// Returns whether the charts of a model are translations, and its paths straight lines.
pub(crate) fn is_flat(model: &dyn Model) -> bool {
    let Sizes { entries, directions, .. } = model.sizes();
    model.is_vector_space() && entries == directions && model.has_canonical_metric()
}

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

impl<V> OfLaws<Option<V>> {
    /// Each of them, if there are all.
    #[inline]
    pub(crate) fn all(self) -> Option<OfLaws<V>> {
        let Self { energy, entropy, invariants } = self;
        let invariants = invariants.into_iter().collect::<Option<_>>()?;
        Some(OfLaws { energy: energy?, entropy: entropy?, invariants })
    }
}

/// A vector, and its derivatives along the unknown of a step: a column for each direction.
#[derive(Debug)]
pub(crate) struct WithJacobian<L: Lengths> {
    pub(crate) value: L::Vector,
    pub(crate) slope: Matrix<L>,
    /// The summands of the derivatives, if they are known apart.
    pub(super) apart: Option<Box<Apart<L>>>,
}

/// A matrix `B + a bᵀ` by its summands, of which `B` may have few entries.
#[derive(Debug)]
pub(super) struct Apart<L: Lengths> {
    pub(super) base: Matrix<L>,
    pub(super) column: L::Vector,
    pub(super) row: L::Vector,
}

impl<L: Lengths> WithJacobian<L> {
    #[inline]
    pub(crate) const fn new(value: L::Vector, slope: Matrix<L>) -> Self {
        Self { value, slope, apart: None }
    }

    /// The derivatives `A ∂w` of a function with the derivatives `A`.
    #[inline]
    pub(super) fn before(&self, a: &Matrix<L>) -> Matrix<L> {
        let Some(apart) = &self.apart else { return a.product(&self.slope) };
        let Apart { base, column, row } = &**apart;
        let mut product = a.product(base);
        product.add_outer(1.0, &a.times(column), row);
        product
    }
}

impl<L: Lengths> Clone for WithJacobian<L> {
    #[inline]
    fn clone(&self) -> Self {
        Self::new(self.value.clone(), self.slope.clone())
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

/// The paths of steps on a space that is not flat.
#[derive(Clone, Copy)]
enum Curved<'a> {
    /// The paths of the model.
    Known(&'a dyn Paths),
    /// The lines of its charts.
    ByCharts(ByCharts<'a>),
}

/// The path of a step on a space that is not flat.
pub(super) struct CurvedPath<L: Lengths> {
    pub(super) z: L::State,
    pub(super) d: L::Vector,
    pub(super) end: L::State,
    /// The derivatives `∂z`, `∂d` and `∂x'` along the unknown, if they were asked for.
    pub(super) slopes: Option<[Matrix<L>; 3]>,
}

/// A model, with the answers that do not change.
pub(crate) struct Parts<'a, L: Lengths> {
    model: &'a dyn Model,
    /// The paths of its space, if that is not flat.
    curved: Option<Curved<'a>>,
    has_metric: bool,
    entries: usize,
    /// The time of its force and of its energy.
    time: f64,
    /// The parameter whose derivatives `∂F/∂θ_k` are taken in the place of the laws `F`.
    parameter: Option<usize>,
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
        let Sizes { entries, directions, laws } = model.sizes();
        let has_metric = !model.has_canonical_metric();
        let is_flat = is_flat(model);
        let by_charts = || Curved::ByCharts(ByCharts(model));
        let curved = (!is_flat).then(|| model.paths().map_or_else(by_charts, Curved::Known));
        let further = if L::HAS_INVARIANTS { laws.saturating_sub(ENTROPY + 1) } else { 0 };
        Self {
            model,
            curved,
            has_metric,
            entries,
            time: NO_CLOCK,
            parameter: None,
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

    /// The model at a time.
    pub(super) fn at(&self, time: f64) -> Self {
        Self { time, kinds: self.kinds.clone(), ..*self }
    }

    /// The model whose laws are the derivatives of the laws along a parameter. It knows their values and differentials alone.
    pub(crate) fn along_parameter(&self, parameter: usize) -> Self {
        Self { parameter: Some(parameter), kinds: self.kinds.clone(), ..*self }
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

    /// Returns the paths of a space that is not flat.
    #[inline]
    fn paths(&self) -> Option<&dyn Paths> {
        if const { L::IS_FLAT } {
            return None;
        }
        self.curved.as_ref().map(|curved| match curved {
            Curved::Known(paths) => *paths,
            Curved::ByCharts(paths) => paths,
        })
    }

    /// Returns whether charts are translations, and paths straight lines.
    #[inline]
    pub(super) const fn is_flat(&self) -> bool {
        if const { L::IS_FLAT } { true } else { self.curved.is_none() }
    }

    fn state(&self) -> L::State {
        L::State::room(|| self.entries)
    }

    /// The state `φ_x(q)`.
    #[inline]
    pub(super) fn moved(&self, x: &L::State, q: &L::Vector) -> L::State {
        if self.is_flat() {
            return vector(self.n(), |i| x.numbers()[i] + q[i]);
        }
        let mut y = self.state();
        self.model.chart(x.numbers(), q.numbers(), y.numbers_mut());
        y
    }

    /// The displacement `φ_x⁻¹(y)`.
    #[inline]
    pub(super) fn between(&self, x: &L::State, y: &L::State) -> L::Vector {
        if self.is_flat() {
            return self.vector(|i| y.numbers()[i] - x.numbers()[i]);
        }
        let mut q = self.zero();
        let _ = self.model.coordinates(x.numbers(), y.numbers(), q.numbers_mut());
        q
    }

    /// Returns whether a state is well inside of the chart at another one.
    pub(super) fn is_near(&self, x: &L::State, y: &L::State) -> bool {
        let mut q = self.zero();
        self.model.coordinates(x.numbers(), y.numbers(), q.numbers_mut())
    }

    /// Returns whether a state is outside of the space.
    pub(super) fn is_outside(&self, x: &L::State) -> bool {
        self.model.defect(x.numbers()).is_infinite()
    }

    /// The sizes of the entries, one for each direction.
    #[inline]
    pub(super) fn scales(&self, x: &L::State) -> L::Vector {
        if self.is_flat() {
            return self.vector(|i| x.numbers()[i].abs());
        }
        let mut sizes = self.zero();
        self.model.scales(x.numbers(), sizes.numbers_mut());
        sizes
    }

    /// Computes the rounding error of the displacement `d` on the way from `x` to the `end` of its path.
    #[inline]
    pub(super) fn lost_digits(
        &self,
        path: Path,
        [x, end]: [&L::State; 2],
        d: &L::Vector,
    ) -> L::Vector {
        let Some(paths) = self.paths() else {
            return self.vector(|i| d[i] - (end.numbers()[i] - x.numbers()[i]));
        };
        let mut lost = self.zero();
        paths.lost_digits(path, x.numbers(), d.numbers(), end.numbers(), lost.numbers_mut());
        lost
    }

    /// The relative accuracy of the ends of paths.
    pub(super) fn accuracy(&self, path: Path) -> f64 {
        self.paths().map_or(0.0, |paths| paths.accuracy(path))
    }

    /// The end of the path of a displacement; `None` where it cannot be followed.
    #[inline]
    pub(super) fn end(&self, path: Path, x: &L::State, u: &L::Vector) -> Option<L::State> {
        if self.is_flat() {
            return Some(self.moved(x, u));
        }
        let (paths, mut end) = (self.paths()?, self.state());
        paths.end(path, x.numbers(), u.numbers(), end.numbers_mut()).ok()?;
        Some(end)
    }

    /// The path of a displacement on a space that is not flat, with its derivatives if they are asked for.
    pub(super) fn curved_path(
        &self,
        path: Path,
        x: &L::State,
        u: &L::Vector,
        with_slopes: bool,
    ) -> Option<CurvedPath<L>> {
        let paths = self.paths()?;
        let (mut z, mut d, mut end) = (self.state(), self.zero(), self.state());
        let mut to = PathAt { z: z.numbers_mut(), d: d.numbers_mut(), end: end.numbers_mut() };
        let (x, u) = (x.numbers(), u.numbers());
        let mut slopes = None;
        if with_slopes {
            let [mut dz, mut dd, mut dend] = [self.zeros(), self.zeros(), self.zeros()];
            let all = [&mut dz, &mut dd, &mut dend].map(Matrix::numbers_mut);
            let [dz_to, dd_to, dend_to] = all;
            let of_path = &mut PathSlopes { dz: dz_to, dd: dd_to, dend: dend_to };
            paths.path_jet(path, x, u, (&mut to, of_path)).ok()?;
            slopes = Some([dz, dd, dend]);
        } else {
            paths.path(path, x, u, &mut to).ok()?;
        }
        Some(CurvedPath { z, d, end, slopes })
    }

    /// The first and the second derivative of all laws along the curve of a path, at a fraction of its way.
    pub(super) fn along_curve(
        &self,
        (path, x, u): (Path, &L::State, &L::Vector),
        t: f64,
    ) -> Option<SmallVec<[[f64; 2]; 2]>> {
        let mut of_laws = smallvec![[0.0; 2]; self.kinds.len() + ENTROPY + 1];
        let start = (x.numbers(), u.numbers(), t);
        let paths = (self.paths()?, path);
        self.model.along_curve(self.time, paths, start, &mut of_laws).ok()?;
        Some(of_laws)
    }

    /// The velocity at `φ_x(q)` with the components `v` in the chart at `x`, in the chart at `y`.
    #[inline]
    pub(super) fn velocity_at(
        &self,
        y: &L::State,
        (x, q): (&L::State, &L::Vector),
        v: &L::Vector,
    ) -> L::Vector {
        let Some(paths) = self.paths() else { return v.clone() };
        let mut to = self.zero();
        let (at, from) = (y.numbers(), (x.numbers(), q.numbers()));
        paths.velocity_at(at, from.0, from.1, v.numbers(), to.numbers_mut());
        to
    }

    /// Carries vectors from a state to another one near by.
    #[inline]
    pub(super) fn transport(&self, x: &L::State, y: &L::State, vectors: &mut [L::Vector]) {
        if let Some(paths) = self.paths() {
            let n = self.n();
            with_numbers(n * vectors.len(), |all| {
                let pairs = all.chunks_exact_mut(n.max(1)).zip(&*vectors);
                pairs.for_each(|(to, v)| to.copy_from_slice(v.numbers()));
                paths.transport(x.numbers(), y.numbers(), all);
                let pairs = all.chunks_exact(n.max(1)).zip(vectors);
                pairs.for_each(|(v, to)| to.numbers_mut().copy_from_slice(v));
            });
        }
    }

    /// The size of the terms of the slope `⟨w, v⟩`.
    #[inline]
    pub(super) fn pairing_size(&self, w: &L::Vector, v: &L::Vector) -> f64 {
        let of_terms = || sum_of_terms(w, v);
        self.paths().map_or_else(of_terms, |paths| paths.pairing_size(w.numbers(), v.numbers()))
    }

    /// The metric at a state; `None` where it cannot be used.
    #[inline]
    pub(super) fn metric(&self, x: &L::State) -> Option<Metric<L>> {
        if const { L::IS_FLAT } || !self.has_metric {
            return Some(Metric::CANONICAL);
        }
        Metric::at(self.model, x, self.n())
    }

    /// The model itself.
    pub(super) const fn model(&self) -> &'a dyn Model {
        self.model
    }

    /// The differential of a law at `φ_x(q)`, in the chart at `x`.
    pub(super) fn differential_at(&self, law: usize, x: &L::State, q: &L::Vector) -> L::Vector {
        let mut df = self.zero();
        let (x, q) = (x.numbers(), q.numbers());
        self.model.differential_at(law, self.time, x, q, df.numbers_mut());
        df
    }

    /// The Hessian of a law at `φ_x(q)`, in the chart at `x`.
    pub(super) fn hessian_at(&self, law: usize, x: &L::State, q: &L::Vector) -> Matrix<L> {
        let mut hf = self.zeros();
        let (x, q) = (x.numbers(), q.numbers());
        self.model.hessian_at(law, self.time, x, q, hf.numbers_mut());
        hf
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
        if self.parameter.is_some() {
            return self.jet(law, x).0;
        }
        self.model.value(law, self.time, x.numbers())
    }

    /// A law with its differential.
    #[inline]
    pub(crate) fn jet(&self, law: usize, x: &L::State) -> (f64, L::Vector) {
        let (mut df, x) = (self.zero(), x.numbers());
        let value = match self.parameter {
            None => self.model.jet(law, self.time, x, df.numbers_mut()),
            Some(k) => self.model.law_along_parameter(law, k, self.time, x, df.numbers_mut()),
        };
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
        if self.parameter.is_some() {
            return [dot(&self.jet(law, x).1, v), f64::NAN];
        }
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

    /// The derivatives of the vector of a part along parameters, a column for each; `None` where it has no value.
    pub(super) fn along_parameters(
        &self,
        part: Part,
        z: &L::State,
        [energy, entropy, alpha]: [&L::Vector; 3],
        parameters: &Range<usize>,
    ) -> Option<Matrix<L>> {
        let (w, mut column, mut slope) =
            (covectors::<L>(energy, entropy), self.zero(), self.zeros());
        for (c, k) in parameters.clone().enumerate() {
            let (z, alpha, to) = (z.numbers(), alpha.numbers(), column.numbers_mut());
            self.model.part_along_parameter((part, k), self.time, z, w, alpha, to).ok()?;
            (0..self.n()).for_each(|i| slope[(i, c)] = column[i]);
        }
        Some(slope)
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
