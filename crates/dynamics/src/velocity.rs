//! The velocity of a system for given covectors.
//!
//! ```math
//! v = \tilde\Pi\, w_H + \tilde K_{w_H} w_S
//! ```
//!
//! With the differentials of the fields it is the equation of motion. With their discrete gradients along a
//! step it is the scheme, which conserves what the equation conserves:
//!
//! - `Π̃ = P Π Pᵀ`, where `Pᵀ` projects a covector off the discrete gradients of the entropy and of the further
//!   Casimirs. It is skew and annihilates them, so `⟨w_H, Π̃w_H⟩ = 0` and `⟨w_S, Π̃w_H⟩ = 0` to round-off.
//!   It differs from `Π` by `O(h²)`, *because* `Π` annihilates their differentials. A bracket that is built
//!   from the covector of its Casimir
//!   ([`Bracket::annihilates_entropy`](crate::Bracket::annihilates_entropy)) needs no `P` for it. Where a Casimir's covector depends on those
//!   before it, its projection fades out of `P` and of `Pᵀ` with the same weight. So `Π̃` stays skew and
//!   conserves the energy. The entropy comes first and has full weight.
//! - A momentum `J` must not enter `P`. This would change the flow, because `Π dJ ≠ 0`. With
//!   `a = Π̃w_H`, the number `⟨w_J, a⟩` is `O(h²)`. It is removed from `a` along the vector `♯n`, where
//!   `n` is the part of `w_J` orthogonal to the covectors that annihilate `a` already. Near a relative
//!   equilibrium, where `n` vanishes, the correction fades out ([`Orthogonal::faded_vector`](crate::orthogonal::Orthogonal::faded_vector)).
//! - `K̃_w = Q K_w Qᵀ`, where `Q` projects off the parts of the further invariants orthogonal to `w_H`. It
//!   is symmetric and positive semidefinite, and annihilates `w_H` and all invariants. For the dissipation of
//!   the metric this is `κ G*(Pα, Pβ)` with `κ = G*(w_H, w_H)` and `P = 1 − C^{ab} L_b ⊗ L_a` (Bloch,
//!   Farré Puiggalí, Martín de Diego 2024, remark in §2.2).
//! - A force adds `f = ad*_{w_H} 𝓕(w_H)`, with `⟨w_H, f⟩ = 0` and `⟨w_S, f⟩ = ⟨𝓕(w_H), [w_H, w_S]⟩`. Where it
//!   conserves a further invariant, `⟨w_L, f⟩` is `O(h²)`. It is removed from `f` as from `a` above, and
//!   the two numbers do not change.

mod covectors;
mod definition;
mod fractions;
mod jet;
mod plan;

pub use self::covectors::{Covectors, Differentials, Gradient, differentials};
pub use self::definition::{irreversible, reversible};
pub use self::fractions::{independence, projected_fractions};
pub use self::jet::{VelocityJet, velocity_jet};
pub use self::plan::{CASIMIR, MOMENTUM};
