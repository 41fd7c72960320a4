//! The exchange of a system with its surroundings: work through ports, and heat with baths.
//!
//! ```math
//! x' = \Pi\, dH + K\, dS + \sum_a F_a(t, x) + \sum_b R_b(t, x) \bigl( T_b\, dS - dH \bigr)
//! ```
//!
//! A [`Port`] has a velocity `F` that does the work `⟨dH, F⟩` on the system and carries no entropy, `⟨dS, F⟩ = 0`. A
//! [`Bath`] has a temperature `T` and a friction `R`, symmetric and positive semidefinite, which need annihilate nothing.
//! With `A = T dS − dH` it gives the heat `⟨dH, R A⟩` to the system and loses that much energy, so its entropy grows at
//! the rate `−⟨dH, R A⟩/T`. The entropy of system and bath together grows at the rate `⟨A, R A⟩/T ≥ 0`.
//!
//! | entry | rate | sign |
//! |---|---|---|
//! | work of a port | `⟨dH, F⟩` | into the system |
//! | heat of a bath | `⟨dH, R A⟩` | into the system |
//! | entropy of a bath | `−⟨dH, R A⟩/T` | of the bath |
//!
//! With `S = 0` and a bath at a constant temperature the system is isothermal, `H` is a free energy, and `R dH` its
//! friction. A bath at the temperature zero takes energy and no entropy.

mod bath;
mod drive;
mod lift;
mod list;
mod port;
mod terms;

pub use bath::{Bath, Contact, Contacts, Friction, Isotropic, Temperature};
pub use drive::{Driven, Rates, rates};
pub use list::{Entries, Exchange, ExchangeArgs, Named, Names, Part, PartKind, Visitor, affinity};
pub use port::Port;
pub use terms::{BathTerm, ExchangeTerms, FrictionTerms};

use metriplectic_fields::{
    ChartPoint, Column, Dimension, Factors, Matrix, Real, Square, Vector, Velocity,
};
use metriplectic_manifolds::Manifold;

/// Returns whether all parts of a number vanish.
pub(crate) fn vanishes(a: &Real) -> bool {
    [a.re, a.eps1, a.eps2, a.eps1eps2].iter().all(|part| *part == 0.0)
}

/// The components, in the frame of the chart, of a velocity that is written by hand: those of its part along the
/// manifold. `None` at the edge of the chart.
pub(crate) fn components<M: Manifold>(
    x: &ChartPoint<M, Real>,
    velocity: &Velocity<M, Real>,
) -> Option<Vector<M, Real>> {
    let n = M::Dim::LEN;
    let theta = M::Dim::array(|k| M::embed(x, &Vector::<M, Real>::basis(k)));
    let one = |i: usize, k: usize| Real::from(if i == k { 1.0 } else { 0.0 });
    let is_identity = Velocity::<M, Real>::LEN == n
        && (0..n).all(|k| (0..n).all(|i| vanishes(&(theta[k][i] - one(i, k)))));
    if is_identity {
        return Some(Vector::<M, Real>::from_index(|i| velocity[i]));
    }
    let gram = Matrix::<M, Real>::from_entries(|i, j| theta[i].dot(&theta[j]));
    gram.factor()?.solve(&Vector::<M, Real>::from_index(|k| theta[k].dot(velocity)))
}
