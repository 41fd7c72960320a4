//! Thermal noise that the friction fixes: energy exact on every path, and the law `exp(S/k_B)`.
//!
//! ```math
//! dx = \Bigl[ \Pi\, dH + K\, dS + k_B \sum_r c_r b_r \Bigr] dt + \sqrt{2 k_B} \sum_r X_r \circ dW_r, \qquad
//! X_r = \sqrt{\rho_r}\, b_r, \quad K = \sum_r X_r X_r^{\mathsf T}, \quad \langle dH, X_r \rangle = 0
//! ```
//!
//! The equation, the measure and the *kinetic drift* `k_B Σ c_r b_r` are those of
//! [`metriplectic_dynamics::noise`]. In an isothermal bath `k_B T` stands for `k_B`, and the terms need not keep the energy:
//! what they change of it is heat.
//!
//! # Steps
//!
//! A step is composed of flows:
//!
//! - `A_h`, a step of the method that is wrapped, on the system without noise, with both laws exact;
//! - `D_h`, the flow of the kinetic drift `k_B Σ c_r b_r`, nothing where this vanishes;
//! - `exp(s X)`, the flow of a noise field for the time `s = √(2 k_B h) ξ`.
//!
//! ```math
//! \text{RandomFlow:} \quad \exp\Bigl( \sqrt{2 k_B h} \sum_r \xi_r X_r \Bigr) \circ D_h \circ A_h
//! ```
//! ```math
//! \text{NinomiyaVictoir:} \quad B \circ \exp(s_m X_m) \circ \dots \circ \exp(s_1 X_1) \circ B, \qquad
//! B = D_{h/4} \circ A_{h/2} \circ D_{h/4},
//! ```
//!
//! the second with the order of its noise fields turned round by a fair coin (Ninomiya and Victoir 2008). The weak orders,
//! and those of the law that is sampled, are 1 and 2. The noise fields and the drift are followed by a method of order 5,
//! because a flow of order 2 leaves an error `s³ = O(h^{3/2})`, whose square makes the law wrong in the order 1. Then the
//! state is moved onto the energy and the further invariants of the run.
//!
//! A flow that leaves its chart is *halved*, `exp(sX) = exp(½sX)²`, and its random number is never drawn again: this
//! would change the law.
//!
//! # Random numbers
//!
//! A number is a function of the seed, the path, the step and the term alone ([`Counter`]), by [`philox`]. So a run that is
//! resumed has the same numbers, and so have runs on other threads.
//!
//! Between the ends of a step the Brownian path of each term is that of [Lévy's construction](levy()). The state at a fraction `θ` of a
//! step is the end of a step of size `θh` with the numbers `W_r(θ)/√θ`: an output there is on the same path, and the steps stay as
//! they are. Such states and those at the ends of steps have one law together, of the weak order of the method.
//!
//! # Limits
//!
//! The error of the law is `O((h|K'|)²)` at best. Each step measures `h|K'|` along the way of its noise fields, by which
//! explicit methods know it too. A run on which it exceeds 1 on more than a few steps ends in
//! [`NoiseError::FrictionUnresolved`]; rare steps are a line of the certificate. Stationary is not ergodic: with few noise
//! fields, or an energy shell in several pieces, one path does not visit the whole shell.

mod builder;
mod closed;
mod equations;
mod error;
mod flow;
mod fluctuating;
mod judged;
mod levy;
mod moves;
mod ninomiya_victoir;
mod numbers;
mod philox;
mod random_flow;
mod sampler;
mod system;
mod verify;

pub use builder::{Fluctuates, NoiseBuilder};
pub(crate) use closed::{ROUND_OFF, examine_model, vanishes};
pub(crate) use equations::{OwnTerms, Term, kinetic_drift, start_and_near, summed};
pub use error::{NoiseError, NoisyError};
pub use fluctuating::{Drawn, Fluctuating, Landing, Noise};
pub use judged::Judged;
pub use levy::levy;
pub use ninomiya_victoir::NinomiyaVictoir;
pub use numbers::{Counter, Numbers, Purpose};
pub use philox::philox;
pub use random_flow::RandomFlow;
pub use sampler::{NoiseMemory, Sampler, Sampling};
pub use system::Noisy;
pub use verify::NoisyReport;
