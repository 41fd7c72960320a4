//! Forced Euler-Poincaré systems, from a reduced Lagrangian on a Lie algebra.
//!
//! ```math
//! \frac{d}{dt} \frac{\partial l}{\partial \xi}
//!     = \mathrm{ad}^*_\xi \Bigl( \frac{\partial l}{\partial \xi} + F(\xi) \Bigr)
//! ```
//!
//! (Bloch, Farré Puiggalí, Martín de Diego 2024, §3). With the Legendre transform
//! `μ = ∂l/∂ξ`, `h(μ) = ⟨μ, ξ⟩ − l(ξ)` they are the forced Lie-Poisson equations (eq. "flp")
//!
//! ```math
//! \mu' = \mathrm{ad}^*_\xi \bigl( \mu + F(\xi) \bigr), \qquad \xi = dh(\mu),
//! ```
//!
//! which conserve `h` for every `F`. With the force of a positive semidefinite form,
//! `⟨F(ξ), η⟩ = κ(η, [ξ, dC])`, a Casimir `C` grows. The equations are then the metriplectic system of
//! [`LiePoisson`], [`CasimirDissipation`](crate::CasimirDissipation), energy
//! `h` and entropy `C`:
//!
//! ```
//! use metriplectic_dynamics::{CasimirDissipation, System};
//! use metriplectic_fields::Real;
//! use metriplectic_manifolds::LieDual;
//! use nalgebra::{Matrix3, Vector3};
//! let so3 = LieDual::so3();
//! let friction = CasimirDissipation::new(so3.algebra(), Matrix3::identity()).unwrap();
//! let relaxed_rigid_body = System::on(so3)
//!     .lagrangian(|xi: &Vector3<Real>| {
//!         (xi.x * xi.x * 10.0 + xi.y * xi.y * 5.0 + xi.z * xi.z) * 0.5
//!     })
//!     .dissipation(friction)
//!     .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
//!     .build();
//! assert!(relaxed_rigid_body.is_ok());
//! ```
//!
//! Any other force is a closure `|ξ| -> F(ξ)`, or a [`Force`] of your own. `C' = ⟨F(ξ), [ξ, dC]⟩` may then
//! have any sign, and an entropy is not needed:
//!
//! ```
//! use metriplectic_dynamics::System;
//! use metriplectic_fields::Real;
//! use metriplectic_manifolds::LieDual;
//! use nalgebra::Vector3;
//! let body_in_a_vortex = System::on(LieDual::so3())
//!     .lagrangian(|xi: &Vector3<Real>| xi.norm_squared() * 0.5)
//!     .force(|xi: &Vector3<Real>| Vector3::new(-xi.y, xi.x, xi.z * 0.0) * xi.norm_squared())
//!     .build();
//! assert!(body_in_a_vortex.is_ok());
//! ```

use metriplectic_fields::ScalarField;
use metriplectic_manifolds::{Euclidean, LieDual};

use crate::bracket::{Force, ForcedLiePoisson, LiePoisson};
use crate::builder::SystemBuilder;
use crate::dissipation::Choice;

pub use crate::legendre::{Legendre, LegendreError};

impl<G, K: Choice, H, S, I, P, const N: usize>
    SystemBuilder<LieDual<N>, G, LiePoisson, K, H, S, I, P>
{
    /// Sets the force `𝓕: g → g*` of the equations `μ' = ad*_ξ(μ + 𝓕(ξ))`, `ξ = dH`: a closure
    /// `|ξ| -> SVector<Real, N>` or any other [`Force`]. Every force conserves `H`.
    ///
    /// With a force an entropy changes by `S' = ⟨𝓕(ξ), [ξ, dS]⟩` alone, unless a
    /// [`dissipation`](Self::dissipation) is given too; the metric adds none. Verification refuses a force under
    /// which an entropy falls, unless the second law is [`Published`](crate::SecondLaw::Published). The force
    /// must conserve the further invariants, `⟨dL, ad*_ξ 𝓕⟩ = 0`.
    #[allow(
        clippy::type_complexity,
        reason = "the type of a builder lists the parts of the system, and a name for it would hide them"
    )]
    pub fn force<F: Force<N>>(
        self,
        force: F,
    ) -> SystemBuilder<LieDual<N>, G, ForcedLiePoisson<F>, K::WithForce, H, S, I, P> {
        self.bracket(ForcedLiePoisson(force)).choose(K::with_force)
    }
}

impl<G, B, K, H, S, I, P, const N: usize> SystemBuilder<LieDual<N>, G, B, K, H, S, I, P> {
    /// Sets the energy `h(μ) = ⟨μ, ξ⟩ − l(ξ)` of a reduced Lagrangian `l` by [`Legendre::of`]. `l` is a closure
    /// `|ξ| -> Real` on the Lie algebra, or any other [`ScalarField`] on it.
    pub fn lagrangian<L: ScalarField<Euclidean<N>>>(
        self,
        l: L,
    ) -> SystemBuilder<LieDual<N>, G, B, K, Legendre<L, N>, S, I, P> {
        self.energy(Legendre::of(l))
    }
}
