//! Metriplectic systems of many sites, from closures of a site and of a bond.
//!
//! Chains with heat, spin lattices, networks and discretised fluids are sums of local terms,
//!
//! ```math
//! H = \sum_i h(x_i) + \sum_{ij} h_2(x_i, x_j), \qquad S = \sum_i s(x_i),
//! ```
//!
//! over the sites and bonds of a [`Graph`]. Their equation of motion is local too: with the differentials
//! `w_i = dh(x_i) + Σ_j ∂h₂` of the total energy and `s_i = ds(x_i)`,
//!
//! ```math
//! x_i' = \Pi(x_i)\, w_i + \sum_j K_{ij} (s_i, s_j) + K_i s_i .
//! ```
//!
//! A [`Lattice`] is a [`Flow`](metriplectic_integrators::Flow) that evaluates it in `O(N)`. The explicit methods
//! ([`DormandPrince5`](metriplectic_integrators::DormandPrince5),
//! [`DormandPrince8`](metriplectic_integrators::DormandPrince8)) run it, with both laws and the conserved sums.
//!
//! | module | what it holds |
//! |---|---|
//! | [`graph`] | [`Graph`]: which sites are bonded |
//! | [`builder`] | [`LatticeBuilder`]: the parts of a lattice, one by one |
//! | [`fields`] | functions of a site and of a bond, with their data |
//! | `gather` | energies that depend on a sum over the neighbours of a site |
//! | [`onsager`] | friction at sites and in bonds: [`Onsager`], [`SiteState`], [`BondState`] |
//! | [`open`] | [`OpenLattice`]: ports and baths at sites |
//! | [`lattice`] | [`Lattice`], and its loops |
//! | [`points`] | [`Points`]: the states of a lattice |
//! | [`profiles`] | [`Profiles`]: rows of numbers along the lattice, in a file |
//! | [`flow`] | a lattice as a flow for the explicit methods |
//! | [`report`] | [`LatticeReport`]: every law, with the place where it is worst |
//! | [`error`](mod@error) | [`LatticeError`]: what can be wrong, with the site or bond |

mod blocks;
pub mod builder;
mod dense;
mod double;
pub mod error;
pub mod fields;
pub mod flow;
pub mod friction;
mod gather;
mod gram;
pub mod graph;
pub mod lattice;
mod layout;
pub mod model;
mod neighbours;
mod noise;
pub mod onsager;
pub mod open;
mod parallel;
#[cfg(test)]
mod parts;
mod paths;
pub mod points;
mod pool;
pub mod profiles;
mod projection;
mod random;
mod recheck;
pub mod report;
mod tangent;
mod terms;
pub mod vector;
mod verify;

pub use builder::LatticeBuilder;
pub use error::{LatticeError, Place, Tried};
pub use graph::{Boundary, Graph};
pub use lattice::Lattice;
pub use model::Model;
pub use onsager::{BondState, Onsager, SiteState};
pub use open::{NoisySurroundings, OpenLattice, OpenSites};
pub use points::{Points, Sites};
pub use profiles::Profiles;
pub use report::{LatticeLaw, LatticeReport};
pub use vector::SiteVector;
