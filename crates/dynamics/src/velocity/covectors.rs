//! One covector for each field of a system.

use std::fmt::Debug;

use metriplectic_fields::{
    ChartPoint, Column, Dimension, Matrix, Scalar, ScalarField, Space, Square, Vector, differential,
};
use num_dual::Dual64;

use crate::bracket::epsilon;
use crate::invariants::{Invariants, Kind, Visitor};
use crate::metriplectic::{CountOf, Metriplectic};

/// A point of a system in a chart, at a scalar.
pub(super) type Place<Y, D> = ChartPoint<<Y as Metriplectic>::Manifold, D>;

/// Components of a vector or covector of a system, at a scalar.
pub(super) type Components<Y, D> = Vector<<Y as Metriplectic>::Manifold, D>;

/// A map from fields to covectors: the differential at a point, or a discrete gradient.
pub trait Gradient<M: Space> {
    /// Components, with their derivatives or without.
    type Covector: Copy + Debug + Send + Sync;

    /// Computes the covector of a field.
    fn of(&mut self, f: &impl ScalarField<M>) -> Self::Covector;
}

/// The covectors of the fields of a system with `C` further invariants.
#[derive(Clone, Copy, Debug)]
pub struct Covectors<C: Dimension, V: Copy + Debug + Send + Sync> {
    /// The covector of the energy, `w_H`.
    pub energy: V,
    /// The covector of the entropy, `w_S`; zero without an entropy.
    pub entropy: V,
    /// The covectors of the further invariants, in their order.
    pub invariants: C::Array<Option<(Kind, V)>>,
}

impl<C: Dimension, V: Copy + Debug + Send + Sync> Covectors<C, V> {
    /// Collects the covectors of energy and entropy, and those that `gradient` computes for the further
    /// `invariants`.
    #[inline]
    pub fn new<M: Space, W: Gradient<M, Covector = V>>(
        [energy, entropy]: [V; 2],
        invariants: &impl Invariants<M, Count = C>,
        gradient: &mut W,
    ) -> Self {
        let mut collected =
            Collected::<M, C, W> { gradient, covectors: C::array(|_| None), len: 0 };
        invariants.each(&mut collected);
        Self { energy, entropy, invariants: collected.covectors }
    }

    /// Returns the covectors of the further invariants of one kind.
    #[inline]
    pub fn of_kind(&self, kind: Kind) -> impl Iterator<Item = &V> {
        let listed = self.invariants.as_ref().iter().flatten();
        listed.filter_map(move |(k, w)| (*k == kind).then_some(w))
    }

    /// Returns whether there are further invariants of one kind.
    #[inline]
    pub fn has(&self, kind: Kind) -> bool {
        self.of_kind(kind).next().is_some()
    }
}

/// The covectors of the invariants seen so far.
struct Collected<'a, M: Space, C: Dimension, W: Gradient<M>> {
    gradient: &'a mut W,
    covectors: C::Array<Option<(Kind, W::Covector)>>,
    len: usize,
}

impl<M: Space, C: Dimension, W: Gradient<M>> Visitor<M> for Collected<'_, M, C, W> {
    #[inline]
    fn visit(&mut self, kind: Kind, f: &impl ScalarField<M>) {
        self.covectors[self.len] = Some((kind, self.gradient.of(f)));
        self.len += 1;
    }
}

/// The differentials of fields at a point, each the same as [`differential()`] of the field.
///
/// At `f64` the derivatives of the chart are computed once. A field then costs one first derivative, `⌈n/2⌉`
/// evaluations of a closure in place of `n⌈n/2⌉`.
#[derive(Debug)]
pub struct Differentials<'a, M: Space, D: Scalar> {
    x: &'a ChartPoint<M, D>,
    real: Option<RealFrame<M>>,
}

/// A real point with the frame of a chart around it.
#[derive(Debug)]
struct RealFrame<M: Space> {
    point: M::Point<f64>,
    /// The column `k` is the direction `k` of the chart, in the chart at the point itself.
    frame: Matrix<M>,
}

impl<'a, M: Space, D: Scalar> Differentials<'a, M, D> {
    /// Prepares the differentials at `x`.
    pub fn at(x: &'a ChartPoint<M, D>) -> Self {
        // A constant, so that each scalar is compiled with its own way alone.
        if const { D::NDERIV > 0 } {
            return Self { x, real: None };
        }
        let q: Vector<M> = x.q.real();
        let point = M::chart(&x.base, &q);
        let frame = Matrix::<M>::from_columns(|k| {
            let moved = Vector::<M, Dual64>::embed(&q) + epsilon::<M>(k);
            let direction = M::coordinates(&point, &M::chart(&x.base, &moved));
            Vector::<M>::from_index(|i| direction[i].eps)
        });
        Self { x, real: Some(RealFrame { point, frame }) }
    }
}

impl<M: Space, D: Scalar> Gradient<M> for Differentials<'_, M, D> {
    type Covector = Vector<M, D>;

    #[inline]
    fn of(&mut self, f: &impl ScalarField<M>) -> Vector<M, D> {
        if const { D::NDERIV > 0 } {
            return differential(f, self.x);
        }
        let RealFrame { point, frame } = self.real.as_ref().expect("a real point has its frame");
        let df = f.jet1(point).df;
        let term = |i: usize, k: usize| if i < M::Dim::LEN { frame[(i, k)] * df[i] } else { 0.0 };
        Vector::<M, D>::from_index(|k| {
            // In pairs, like the Taylor expansion of a closure: the last digit is the same.
            let pairs = (0..M::Dim::LEN).step_by(2).map(|i| term(i, k) + term(i + 1, k));
            D::from(pairs.fold(0.0, |sum, pair| sum + pair))
        })
    }
}

/// Computes the differentials of all fields of a system at a point.
pub fn differentials<Y: Metriplectic + ?Sized, D: Scalar>(
    system: &Y,
    x: &Place<Y, D>,
) -> Covectors<CountOf<Y>, Components<Y, D>> {
    let mut d = Differentials::at(x);
    let laws = [d.of(system.energy()), d.of(system.entropy())];
    Covectors::new(laws, system.invariants(), &mut d)
}
