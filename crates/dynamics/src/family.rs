//! Systems with parameters: closures of the state and of `θ`.
//!
//! A [`Family`] is a system on `M × Rᴾ` whose second factor carries the parameters with the cometric
//! [`Inert`](metriplectic_manifolds::Inert), so that nothing moves them. It has two faces:
//!
//! - [`Family::at`] freezes `θ`. What it returns is a system on `M` like any other.
//! - [`Differentiable::wide`] is the system on `M × Rᴾ`, whose derivatives along the second factor are those along the
//!   parameters. The tangent of a run is made of it.
//!
//! Parameters that are entries of the state *with the canonical metric* are something else: the dissipation
//! of the metric moves them, and the system is another one.

mod bracket_of;
mod builder;
mod fields;
mod force_of;
mod freeze;
mod frozen;
mod on_first;

pub use bracket_of::{BracketAt, BracketOf};
pub use builder::FamilyBuilder;
pub use fields::{AtParameters, OfPair};
pub use force_of::{ForceAt, ForcedOf};
pub use freeze::Freeze;
pub use frozen::{Differentiable, Frozen, RealPoint};
pub use on_first::{FieldAt, FieldOf, OnFirst};

use std::fmt;
use std::sync::Arc;

use metriplectic_fields::{Real, ScalarField, Space};
use metriplectic_manifolds::{Euclidean, Manifold, Product, Riemannian, Times};
use nalgebra::SVector;

use crate::bracket::Bracket;
use crate::dissipation::Dissipation;
use crate::invariants::Invariants;
use crate::metriplectic::Metriplectic;
use crate::system::System;

/// Systems on `M`, one for each `θ ∈ Rᴾ`; built by [`Family::on`].
///
/// ```
/// use metriplectic_dynamics::{Family, Metriplectic};
/// use metriplectic_fields::Real;
/// use metriplectic_manifolds::LieDual;
/// use nalgebra::{Vector3, Vector4, vector};
///
/// let body = Family::on(LieDual::so3())
///     .parameters(["I1", "I2", "I3", "friction"])
///     .energy(|p: &Vector3<Real>, t: &Vector4<Real>| {
///         (p.x * p.x / t.x + p.y * p.y / t.y + p.z * p.z / t.z) * 0.5
///     })
///     .entropy(|p: &Vector3<Real>, t: &Vector4<Real>| p.norm_squared() * t.w * 0.5)
///     .build()
///     .unwrap();
/// let slow = body.at(vector![3.0, 2.0, 1.0, 0.05]);
/// assert_eq!(slow.energy_at(&vector![0.0, 0.0, 2.0]), 2.0);
/// assert_eq!(body.names()[3], "friction");
/// ```
pub struct Family<Y, const P: usize> {
    wide: Arc<Y>,
    names: [&'static str; P],
}

impl<Y, const P: usize> Clone for Family<Y, P> {
    fn clone(&self) -> Self {
        Self { wide: Arc::clone(&self.wide), names: self.names }
    }
}

impl<Y, const P: usize> fmt::Debug for Family<Y, P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Family").field("names", &self.names).finish_non_exhaustive()
    }
}

impl<Y, const P: usize> Family<Y, P> {
    pub(crate) fn new(wide: Y, names: [&'static str; P]) -> Self {
        Self { wide: Arc::new(wide), names }
    }

    /// The names of the parameters.
    pub const fn names(&self) -> &[&'static str; P] {
        &self.names
    }
}

/// The system on `M` that a family is at one `θ`.
pub type Narrow<M, G, B, K, H, S, L, const P: usize> = System<
    M,
    <G as Freeze<P>>::Narrow,
    <B as Freeze<P>>::Narrow,
    <K as Freeze<P>>::Narrow,
    <H as Freeze<P>>::Narrow,
    <S as Freeze<P>>::Narrow,
    <L as Freeze<P>>::Narrow,
>;

impl<M, G, B, K, H, S, L, const P: usize>
    Family<System<Product<M, Euclidean<P>>, G, B, K, H, S, L>, P>
where
    M: Manifold + Times<Euclidean<P>>,
    System<Product<M, Euclidean<P>>, G, B, K, H, S, L>: Metriplectic<
            Manifold = Product<M, Euclidean<P>>,
            Metric = G,
            Bracket = B,
            Dissipation = K,
            Energy = H,
            Entropy = S,
            Invariants = L,
        >,
    G: Freeze<P, Narrow: Riemannian<M>> + Riemannian<Product<M, Euclidean<P>>>,
    B: Freeze<P, Narrow: Bracket<M, G::Narrow>>,
    K: Freeze<P, Narrow: Dissipation<M, G::Narrow>>,
    H: Freeze<P>,
    S: Freeze<P>,
    L: Freeze<P, Narrow: Invariants<M>>,
{
    /// Freezes the parameters: a system on `M`, for every method and every run. Its energy is `H(·, θ)` evaluated as a
    /// closure that captures `θ` is, with the same bits.
    #[allow(
        clippy::type_complexity,
        reason = "the type lists the parts of the system, and a name for it would hide them"
    )]
    pub fn at(
        &self,
        theta: SVector<f64, P>,
    ) -> Frozen<Narrow<M, G, B, K, H, S, L, P>, System<Product<M, Euclidean<P>>, G, B, K, H, S, L>, P>
    {
        let (y, t) = (&*self.wide, Euclidean::<P>::constant::<Real>(&theta));
        let narrow = System::frozen(
            y.manifold().0.clone(),
            (y.metric().freeze(&t), y.bracket().freeze(&t), y.dissipation().freeze(&t)),
            (y.energy().freeze(&t), y.entropy().freeze(&t), y.invariants().freeze(&t)),
            y.second_law(),
        );
        let tensors_depend = G::DEPENDS || B::DEPENDS || K::DEPENDS;
        Frozen { narrow, wide: Arc::clone(&self.wide), theta, names: self.names, tensors_depend }
    }
}

/// A model with parameters, whose systems have tangents; what a fit asks for.
#[diagnostic::on_unimplemented(
    message = "the members of `{Self}` have no exact derivatives",
    note = "`Fit::of` and `Loss::of` take a family with ports, baths, an energy that depends on time, or noise, too"
)]
pub trait Parametrised<const P: usize> {
    /// The system at one `θ`.
    type System: Differentiable;

    /// Freezes the parameters, as [`Family::at`] does.
    fn at_parameters(&self, theta: SVector<f64, P>) -> Self::System;
}

impl<M, G, B, K, H, S, L, const P: usize> Parametrised<P>
    for Family<System<Product<M, Euclidean<P>>, G, B, K, H, S, L>, P>
where
    M: Manifold + Times<Euclidean<P>>,
    System<Product<M, Euclidean<P>>, G, B, K, H, S, L>: Metriplectic<
            Manifold = Product<M, Euclidean<P>>,
            Metric = G,
            Bracket = B,
            Dissipation = K,
            Energy = H,
            Entropy = S,
            Invariants = L,
        >,
    G: Freeze<P, Narrow: Riemannian<M>> + Riemannian<Product<M, Euclidean<P>>>,
    B: Freeze<P, Narrow: Bracket<M, G::Narrow>>,
    K: Freeze<P, Narrow: Dissipation<M, G::Narrow>>,
    H: Freeze<P, Narrow: ScalarField<M>>,
    S: Freeze<P, Narrow: ScalarField<M>>,
    L: Freeze<P, Narrow: Invariants<M>>,
{
    type System = Frozen<
        Narrow<M, G, B, K, H, S, L, P>,
        System<Product<M, Euclidean<P>>, G, B, K, H, S, L>,
        P,
    >;

    fn at_parameters(&self, theta: SVector<f64, P>) -> Self::System {
        self.at(theta)
    }
}
