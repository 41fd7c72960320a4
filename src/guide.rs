//! Guides: how to choose the parts of a model, how to add a manifold or a metric, what is proved of methods with stages, and the paper
//! equation by equation.
//!
//! - [`choosing`]: which space, bracket, dissipation and scheme, in short tables with reasons;
//! - [`your_own_manifold`]: the hyperbolic plane, from nothing to a metriplectic run;
//! - [`your_own_metric`]: closures on a chart, a sphere, SO(3) and a product;
//! - [`recording`]: fields with many variables, recorded for gradients by one sweep back;
//! - [`stages`]: the equations of methods with stages, their laws and orders with proofs;
//! - [`equations`]: what computes each equation of the paper, and which test checks it;
//! - [`errata`]: where the library departs from the paper, with derivations.

pub mod choosing;
pub mod equations;
pub mod errata;
pub mod recording;
pub mod stages;
pub mod your_own_manifold;
pub mod your_own_metric;
