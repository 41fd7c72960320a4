//! Models of the literature, ready made: parameters in physical units in, a [`System`] out.
//!
//! | model | state | with |
//! |---|---|---|
//! | [`TwoGasContainers`] | `(q, p, S₁, S₂)` | a wall between two gases, through which heat leaks |
//! | [`DampedPiston`] | `(q, p, S)` | friction of a piston on an ideal [`Gas`], or on one of van der Waals |
//! | [`ThermoelasticDoublePendulum`] | `(q₁, q₂, p₁, p₂, s₁, s₂)` | heat between two elastic threads, and an angular momentum |
//! | [`HeatRod`] | temperatures of `N` cells | Fourier's law, without a bracket |
//! | [`DampedRigidBody`] | `p` in so(3)* | friction that raises `|p|` at constant energy |
//!
//! Each model is a struct of its parameters, in any consistent units: its metric is made of them, so that other units give the same
//! run. `system()` checks the
//! parameters, and is ten lines of closures that a model of your own may begin with.

#![allow(
    clippy::type_complexity,
    reason = "the type of a system lists its parts, and a name for it would hide them"
)]

mod damped_piston;
mod damped_rigid_body;
mod heat_rod;
mod parameter;
mod thermoelastic_double_pendulum;
mod two_gas_containers;

pub use damped_piston::{DampedPiston, Gas};
pub use damped_rigid_body::DampedRigidBody;
pub use heat_rod::HeatRod;
pub use parameter::ParameterError;
pub use thermoelastic_double_pendulum::ThermoelasticDoublePendulum;
pub use two_gas_containers::TwoGasContainers;

use metriplectic_dynamics::{OnsagerDissipation, System};
use metriplectic_manifolds::{Constant, Euclidean};

/// A system on `Rⁿ` with the bracket `B`, the terms of friction `K`, the energy `H` and the entropy `S`. Its metric measures each entry
/// in a unit of the model, so that no method depends on the units of the parameters.
pub type OnEuclidean<const N: usize, B, K, H, S, L = ()> =
    System<Euclidean<N>, Constant<N>, B, OnsagerDissipation<K>, H, S, L>;
