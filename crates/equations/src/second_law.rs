//! The promise of a system about its entropy.

/// The promise of a system about its entropy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum SecondLaw {
    /// There is no entropy: the system is Hamiltonian.
    #[default]
    NoEntropy,
    /// Each step satisfies both laws exactly: `ΔS = h K(w_S, w_S) ≥ 0`. A discrete gradient `w_S` of the
    /// entropy takes the place of `dS`, and the bracket annihilates it. `S` must be a Casimir, `Π dS = 0`.
    /// There is no such scheme otherwise, and verification refuses the model.
    ///
    /// A force `𝓕` adds `h ⟨𝓕(w_H), [w_H, w_S]⟩` to `ΔS`. Verification refuses a force that makes this
    /// negative, at the sampled points or on a step from them.
    Exact,
    /// The scheme as published (Bloch, Farré Puiggalí, Martín de Diego 2024, §4.4), with `dS(z)` at
    /// the base point and an unprojected `Π(z)`. The first law holds exactly. `ΔS ≥ −O(h³)` may have either
    /// sign: it is not promised, and the certificate says so. `S` need not be a Casimir.
    Published,
}
