//! Thermal noise, which is fixed by the friction.
//!
//! ```math
//! dx = \Bigl[ \Pi\, dH + K\, dS + k_B \sum_r c_r b_r \Bigr] dt + \sqrt{2 k_B} \sum_r \sqrt{\rho_r}\, b_r \circ dW_r,
//! \qquad K = \sum_r \rho_r\, b_r b_r^{\mathsf T}
//! ```
//!
//! in the form of Stratonovich, with
//!
//! ```math
//! c_r = \rho_r \operatorname{div}_\mu b_r + \tfrac12 \langle d\rho_r, b_r \rangle .
//! ```
//!
//! Each `b_r` is annihilated by `dH`, so the noise and the *kinetic drift* `k_B Σ c_r b_r` keep the energy on every path. The law
//! that does not change is `exp(S/k_B) f(H) μ`, if `div_μ(Π dH) = 0` and `Π dS = 0` (Öttinger 2005, §1.2.5; Hütter and
//! Öttinger 1998 for the drift).
//!
//! The measure `μ` is the volume of the canonical metric of the manifold: that of Lebesgue on a vector space, the area on a
//! sphere, that of Haar on a group, `dx/x` on a half-line. [`Boltzmann::measure`] gives another one, by `ln μ` relative to it.
//!
//! A dissipation whose terms are known implements [`NoiseTerms`].

mod boltzmann;
mod drift;
mod examination;
mod frame;
mod onsager;
mod system;
mod terms;

pub use boltzmann::{Boltzmann, Fluctuation, Measured, Uniform};
pub use drift::{Place, TermVisitor, kinetic_drift};
pub use examination::Around;
pub use frame::NoiseFrame;
pub use system::{
    divergence, friction_vector, lost_in_dissipation, mismatch, noise_drift, noise_vector, place,
    seeded_place,
};
pub use terms::{NoiseTerm, NoiseTerms};
