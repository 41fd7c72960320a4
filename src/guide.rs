//! Bring your own: a manifold or a metric that is not in the box.
//!
//! - [`your_own_manifold`]: the hyperbolic plane, from nothing to a metriplectic run;
//! - [`your_own_metric`]: closures on a chart, a sphere, SO(3) and a product.

pub mod your_own_manifold;
pub mod your_own_metric;
