//! Manifolds, their metrics, and the retractions that map a tangent vector to a pair of points.
//!
//! The page of each space is its chapter: points and velocities, frame and chart, geodesics with their
//! accuracy, and the brackets that live there, with the sources of what is not elementary.
//!
//! | module | what it holds |
//! |---|---|
//! | [`manifold`](mod@manifold) | [`Manifold`]: a space of states |
//! | [`euclidean`](mod@euclidean) | [`Euclidean`]: Rⁿ |
//! | [`lie_algebra`] | [`LieAlgebra`]: structure constants |
//! | [`lie_dual`] | [`LieDual`]: the dual of a Lie algebra, with the ready-made algebras |
//! | [`sphere`](mod@sphere) | [`Sphere`]: Sⁿ, n = 1 … 7 |
//! | [`rotation_vector`] | `exp`, `log` and `dexp` of SO(3) |
//! | [`rotations`](mod@rotations) | [`Rotations`]: SO(3) |
//! | [`half_line`](mod@half_line) | [`HalfLine`]: R₊ |
//! | [`chart`](mod@chart) | [`Chart`]: an open part of Rⁿ, in coordinates of your own |
//! | [`product`](mod@product) | [`Product`]: `A × B` |
//! | [`moving_base`](mod@moving_base) | [`MovingBase`]: stages around a base that moves, for tangents of explicit steps |
//! | [`normal`] | normal coordinates on a space of constant curvature |
//! | [`metric_error`] | [`MetricError`]: errors of metrics and geodesics |
//! | [`inner_product`] | [`InnerProduct`]: flat and sharp at one point; [`Canonical`] |
//! | [`inert`](mod@inert) | [`Inert`]: a cometric that is zero, for parameters |
//! | [`metric`] | [`Riemannian`]: norm, distance, geodesics |
//! | [`metric_at`] | [`MetricAt`]: a metric at one point, evaluated once |
//! | [`flat`] | metrics that are constant in a global chart, with straight geodesics: [`Metric::constant`] |
//! | [`field_metric`] | a metric from a closure, with numerical geodesics: [`Metric::field`] |
//! | [`product_metric`] | metrics on a product, factor by factor |
//! | [`parametric_metric`] | [`ParametricMetric`]: a metric from a closure with parameters |
//! | [`step_path`] | [`StepPath`]: the base point, the displacement and the end of a step |
//! | [`retraction`] | [`Retraction`]: `R_h` and `R_h⁻¹` |
//! | [`weyl_midpoint`] | [`WeylMidpoint`]: the symmetric one, order 2 |
//! | [`chart_midpoint`] | [`ChartMidpoint`]: the symmetric one of the canonical metric, for any metric, order 2 |
//! | [`exponential`] | [`Exponential`]: based at the start, order 1 |
//! | [`projection`] | [`Projection`]: symmetric, rational but for a root, on spheres |
//! | [`cayley`] | [`Cayley`]: symmetric, rational, on SO(3) |
//! | [`laws`] | the laws of each of them, and the functions that check them |

pub mod cayley;
pub mod chart;
mod chart_metric;
pub mod chart_midpoint;
pub mod euclidean;
pub mod exponential;
mod extrapolation;
pub mod field_metric;
pub mod flat;
mod geodesic;
mod geodesic_jet;
pub mod half_line;
#[doc(hidden)]
pub mod in_numbers;
pub mod inert;
pub mod inner_product;
pub mod laws;
pub mod lie_algebra;
pub mod lie_dual;
pub mod manifold;
pub mod metric;
pub mod metric_at;
pub mod metric_error;
pub mod moving_base;
pub mod normal;
pub mod parametric_metric;
#[cfg(all(feature = "argmin", not(all(target_arch = "wasm32", target_os = "unknown"))))]
mod path;
pub mod product;
pub mod product_metric;
pub mod projection;
mod ready_made;
pub mod retraction;
pub mod rotation_vector;
pub mod rotations;
mod shooting;
pub mod sphere;
pub mod step_path;
pub mod weyl_midpoint;

pub use cayley::Cayley;
pub use chart::Chart;
pub use chart_midpoint::ChartMidpoint;
pub use euclidean::Euclidean;
pub use exponential::Exponential;
pub use field_metric::FieldMetric;
pub use flat::{Constant, Flat};
pub use half_line::HalfLine;
pub use inert::Inert;
pub use inner_product::{Canonical, InnerProduct};
pub use lie_algebra::{AlgebraError, LieAlgebra};
pub use lie_dual::LieDual;
pub use manifold::{Manifold, PointError};
pub use metric::{GeodesicEnd, Riemannian};
pub use metric_at::{MetricAt, MetricJet, MetricSlopes, Slopes};
pub use metric_error::{MetricError, out_of_chart};
pub use moving_base::MovingBase;
pub use parametric_metric::ParametricMetric;
pub use product::{Product, Times};
pub use product_metric::Split;
pub use projection::Projection;
pub use ready_made::Metric;
pub use retraction::{Nodes, PointPair, Retraction, Tangent};
pub use rotations::Rotations;
pub use sphere::Sphere;
pub use step_path::{StepPath, StepPathJet};
pub use weyl_midpoint::WeylMidpoint;

/// The random numbers of [`Manifold::random`], for manifolds of your own.
pub use rand;
