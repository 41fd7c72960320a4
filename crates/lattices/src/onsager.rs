//! Friction at sites and in bonds.
//!
//! The tensor of a bond is a sum of a few terms of rank one (Onsager 1931),
//!
//! ```math
//! K_{ij} = \sum_r \rho_r\, b_r b_r^{\mathsf T}, \qquad \rho_r \ge 0, \qquad b_r \cdot (w_i, w_j) = 0,
//! ```
//!
//! with the differentials `w_i`, `w_j` of the *total* energy at its two sites. So `K dH = 0` holds exactly, also where
//! the energy of a bond depends on the temperatures of its sites.

use std::fmt;

use metriplectic_fields::{Space, Vector};

/// A term `ρ b bᵀ` of the tensor of friction: `b` is a vector of a site, or a pair of them for a bond.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Onsager<B> {
    /// The rate `ρ ≥ 0`.
    pub rate: f64,
    /// The vector `b`, which the differential of the energy annihilates.
    pub b: B,
}

/// State on which friction at a site may depend.
pub struct SiteState<'a, M: Space, D = ()> {
    /// The point.
    pub x: &'a M::Point<f64>,
    /// The differential of the total energy there, in the frame of the chart at `x`.
    pub w: &'a Vector<M>,
    /// The differential of the total entropy there: reciprocal temperatures, if internal energies are variables.
    pub s: &'a Vector<M>,
    /// The data of the site.
    pub data: &'a D,
}

/// State on which friction in a bond may depend.
pub struct BondState<'a, M: Space, E = ()> {
    /// The points of its first and of its second site.
    pub x: [&'a M::Point<f64>; 2],
    /// The differentials of the total energy there, in the frames of the charts at these points.
    pub w: [&'a Vector<M>; 2],
    /// The differentials of the total entropy there.
    pub s: [&'a Vector<M>; 2],
    /// The data of the bond.
    pub data: &'a E,
}

impl<M: Space, D> fmt::Debug for SiteState<'_, M, D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SiteState")
            .field("x", self.x)
            .field("w", self.w)
            .field("s", self.s)
            .finish_non_exhaustive()
    }
}

impl<M: Space, E> fmt::Debug for BondState<'_, M, E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("BondState")
            .field("x", &self.x)
            .field("w", &self.w)
            .field("s", &self.s)
            .finish_non_exhaustive()
    }
}

/// Friction at sites.
pub trait SiteFriction<M: Space, D>: Sync {
    /// True if there is any.
    const PRESENT: bool = true;
    /// How many terms a site has.
    const TERMS: usize;

    /// Passes each term to the visitor.
    fn each(&self, at: &SiteState<'_, M, D>, visit: impl FnMut(Onsager<Vector<M>>));
}

/// Friction in bonds.
pub trait BondFriction<M: Space, E>: Sync {
    /// True if there is any.
    const PRESENT: bool = true;
    /// How many terms a bond has.
    const TERMS: usize;

    /// Passes each term to the visitor.
    fn each(&self, at: &BondState<'_, M, E>, visit: impl FnMut(Onsager<[Vector<M>; 2]>));
}

/// No friction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Frictionless;

impl<M: Space, D> SiteFriction<M, D> for Frictionless {
    const PRESENT: bool = false;
    const TERMS: usize = 0;

    fn each(&self, _: &SiteState<'_, M, D>, _: impl FnMut(Onsager<Vector<M>>)) {}
}

impl<M: Space, E> BondFriction<M, E> for Frictionless {
    const PRESENT: bool = false;
    const TERMS: usize = 0;

    fn each(&self, _: &BondState<'_, M, E>, _: impl FnMut(Onsager<[Vector<M>; 2]>)) {}
}

/// Friction with `R` terms from a closure.
#[derive(Clone, Copy, Debug)]
pub struct Terms<F, const R: usize>(pub(crate) F);

impl<M, D, F, const R: usize> SiteFriction<M, D> for Terms<F, R>
where
    M: Space,
    F: Fn(&SiteState<'_, M, D>) -> [Onsager<Vector<M>>; R] + Sync,
{
    const TERMS: usize = R;

    #[inline]
    fn each(&self, at: &SiteState<'_, M, D>, visit: impl FnMut(Onsager<Vector<M>>)) {
        (self.0)(at).into_iter().for_each(visit);
    }
}

impl<M, E, F, const R: usize> BondFriction<M, E> for Terms<F, R>
where
    M: Space,
    F: Fn(&BondState<'_, M, E>) -> [Onsager<[Vector<M>; 2]>; R] + Sync,
{
    const TERMS: usize = R;

    #[inline]
    fn each(&self, at: &BondState<'_, M, E>, visit: impl FnMut(Onsager<[Vector<M>; 2]>)) {
        (self.0)(at).into_iter().for_each(visit);
    }
}
