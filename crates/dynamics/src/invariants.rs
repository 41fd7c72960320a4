//! Further conserved functions `L_a`, beside the energy.
//!
//! There are two kinds, and a scheme conserves them in two ways:
//!
//! - a **Casimir** is conserved because the bracket annihilates it, `Π dC = 0`, whatever the energy is:
//!   `|Γ|²` of a heavy top, which lives on se(3)*;
//! - a **momentum** is conserved because the energy is symmetric, `⟨dJ, Π dH⟩ = 0` while
//!   `Π dJ ≠ 0`: the angular momentum of a pendulum.
//!
//! The dissipation must conserve both, `K dL_a = 0`. The dissipation of the metric is projected so that it
//! does ([`orthogonal`](crate::orthogonal)). Any other dissipation must do so by itself.

use std::fmt;

use metriplectic_fields::{Dimension, Plus, Real, ScalarField, Space};
use nalgebra::Const;

pub use metriplectic_equations::Kind;

/// A list of further invariants: `()`, or a shorter list and an invariant. It is made by
/// [`SystemBuilder::casimir`](crate::SystemBuilder::casimir),
/// [`momentum`](crate::SystemBuilder::momentum) and [`symmetry`](crate::SystemBuilder::symmetry).
pub trait Invariants<M: Space> {
    /// Their number, for lists with one value each.
    type Count: Dimension;

    /// How many there are.
    const COUNT: usize = Self::Count::LEN;

    /// Passes each invariant to the visitor, in the order of the list.
    fn each(&self, visitor: &mut impl Visitor<M>);
}

/// A visitor of the invariants of a list.
pub trait Visitor<M: Space> {
    /// Visits an invariant.
    fn visit(&mut self, kind: Kind, f: &impl ScalarField<M>);

    /// Visits the action to which the momentum visited last belongs.
    fn acts(&mut self, _action: &Action<'_, M>) {}
}

/// A one-parameter group of maps of `M`: `(t, x) ↦ Φ_t(x)`, with `Φ_0(x) = x`.
pub type Action<'a, M> = dyn Fn(Real, &<M as Space>::Point<Real>) -> <M as Space>::Point<Real> + 'a;

impl<M: Space> Invariants<M> for () {
    type Count = Const<0>;

    #[inline]
    fn each(&self, _: &mut impl Visitor<M>) {}
}

/// A further Casimir of the bracket.
#[derive(Clone, Copy)]
pub struct Casimir<F>(pub F);

/// A momentum, conserved because the energy is symmetric.
#[derive(Clone, Copy)]
pub struct Momentum<F>(pub F);

/// A momentum with its one-parameter group of symmetries.
#[derive(Clone, Copy)]
pub struct Symmetry<A, F> {
    /// The action `(t, x) ↦ Φ_t(x)`.
    pub action: A,
    /// Its momentum map.
    pub momentum: F,
}

macro_rules! opaque {
    ($name:ident<$($parameter:ident),*>) => {
        // By hand, because closures have no `Debug`.
        impl<$($parameter),*> fmt::Debug for $name<$($parameter),*> {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.debug_struct(stringify!($name)).finish_non_exhaustive()
            }
        }
    };
}
opaque!(Casimir<F>);
opaque!(Momentum<F>);
opaque!(Symmetry<A, F>);

impl<M, L, F> Invariants<M> for (L, Casimir<F>)
where
    M: Space,
    L: Invariants<M, Count: Plus<Const<1>>>,
    F: ScalarField<M>,
{
    type Count = <L::Count as Plus<Const<1>>>::Sum;

    #[inline]
    fn each(&self, visitor: &mut impl Visitor<M>) {
        self.0.each(visitor);
        visitor.visit(Kind::Casimir, &self.1.0);
    }
}

impl<M, L, F> Invariants<M> for (L, Momentum<F>)
where
    M: Space,
    L: Invariants<M, Count: Plus<Const<1>>>,
    F: ScalarField<M>,
{
    type Count = <L::Count as Plus<Const<1>>>::Sum;

    #[inline]
    fn each(&self, visitor: &mut impl Visitor<M>) {
        self.0.each(visitor);
        visitor.visit(Kind::Momentum, &self.1.0);
    }
}

impl<M, L, A, F> Invariants<M> for (L, Symmetry<A, F>)
where
    M: Space,
    L: Invariants<M, Count: Plus<Const<1>>>,
    A: Fn(Real, &M::Point<Real>) -> M::Point<Real>,
    F: ScalarField<M>,
{
    type Count = <L::Count as Plus<Const<1>>>::Sum;

    #[inline]
    fn each(&self, visitor: &mut impl Visitor<M>) {
        self.0.each(visitor);
        visitor.visit(Kind::Momentum, &self.1.momentum);
        visitor.acts(&self.1.action);
    }
}
