//! A metric of your own, on a chart, a sphere, SO(3) and a product.
//!
//! A metric is a closure from a point over [`Real`](crate::fields::Real) to a symmetric matrix
//! `A(x)`, which measures *velocities*:
//!
//! ```math
//! G_x(u, v) = \theta(u)^T A(x)\, \theta(v) , \qquad
//! \theta = \text{the velocity of a tangent vector, as it is written by hand} .
//! ```
//!
//! [`Metric::field`](crate::manifolds::Metric::field) has the table of what a velocity is on each space:
//! `x'` on Rⁿ and on spheres, the body angular velocity on SO(3), both in one column on a product. You need
//! no chart, except for your own coordinates. A metric without a closure is
//! [`Canonical`](crate::manifolds::Canonical) or
//! [`Metric::constant`](crate::manifolds::Metric::constant), with geodesics in closed form.
//!
//! ```
//! use metriplectic::manifolds::{MetricError, Riemannian, laws, rotations};
//! use metriplectic::prelude::*;
//! use std::f64::consts::FRAC_PI_2;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // 1. A chart: the half plane, (dx² + dy²)/y². Vertical geodesics are y eᵗ.
//! let plane = Metric::field(|q: &Vector2<Real>| Matrix2::from_diagonal_element(q.y.powi(-2)));
//! let (x, v) = (Vector2::new(0.3, 1.5), Vector2::new(0.0, 1.5));
//! laws::metric::<Chart<2>, _>(&plane, &x, &v)?;
//! let end = Riemannian::<Chart<2>>::end(&plane, &x, &v)?;
//! assert!((end - Vector2::new(0.3, 1.5 * 1_f64.exp())).norm() < 1e-12);
//!
//! // 2. A sphere, by a form on the space around: the spheroid x ↦ (x₁, x₂, 2x₃) has A = DᵀD.
//! let d = Vector3::new(1.0, 1.0, 2.0);
//! let spheroid =
//!     Metric::field(move |_: &Vector3<Real>| Matrix3::from_diagonal(&d.component_mul(&d)).cast());
//! let (x, y) = (Vector3::x(), Vector3::y());
//! let v: Vector2<f64> = Riemannian::<Sphere<2>>::log(&spheroid, &x, &y)?;
//! laws::metric::<Sphere<2>, _>(&spheroid, &x, &v)?;
//! assert!((v.norm() - FRAC_PI_2).abs() < 1e-12); // a quarter of the equator
//!
//! // 3. SO(3), left-invariant: A is the inertia, geodesics are the motions of a free rigid body.
//! let inertia = Vector3::new(1.0, 2.0, 4.0);
//! let body = Metric::field(move |_: &Matrix3<Real>| Matrix3::from_diagonal(&inertia).cast());
//! let (r, omega) = (rotations::exp(&Vector3::new(0.3, -0.2, 0.5)), Vector3::z() * 0.8);
//! laws::metric::<Rotations, _>(&body, &r, &omega)?;
//! let end = Riemannian::<Rotations>::end(&body, &r, &omega)?;
//! assert!((end - r * rotations::exp(&omega)).norm() < 1e-12); // about a principal axis, steadily
//!
//! // 4. A product: a pair, factor by factor, or one matrix that couples them.
//! let bath = Metric::field(|s: &Vector1<Real>| Matrix1::new(s.x.exp()));
//! let pair = (Canonical, bath);
//! let coupled = Metric::field(|(n, s): &(Vector3<Real>, Vector1<Real>)| {
//!     let mut a = Matrix4::<Real>::identity();
//!     a[(3, 3)] = s.x.exp();
//!     a[(0, 3)] = n.y * 0.2;
//!     a[(3, 0)] = n.y * 0.2;
//!     a
//! });
//! let (point, v) = ((Vector3::y(), Vector1::new(0.1)), Vector3::new(0.4, 0.1, -0.2));
//! laws::metric::<Product<Sphere<2>, Euclidean<1>>, _>(&pair, &point, &v)?;
//! laws::metric::<Product<Sphere<2>, Euclidean<1>>, _>(&coupled, &point, &v)?;
//!
//! // In a system the metric defines the friction, and so the second law.
//! let system = System::on(Rotations::bi_invariant())
//!     .metric(body)
//!     .bracket(Nambu::default())
//!     .energy(|r: &Matrix3<Real>| r.m11 + r.m22 * 2.0 + r.m33 * 3.0)
//!     .entropy(|r: &Matrix3<Real>| r.m13 - r.m21 * 0.5)
//!     .build()?;
//! let run = WeylMidpoint.run(&system, r, Span::steps(0.02, 50))?;
//! assert!(run.certificate().keeps_energy());
//! # assert!(run.certificate().min_entropy_increment > 0.0);
//!
//! // Every failure has a name. √(1 − x) ends at x = 1, at a finite distance from here.
//! let slit = Metric::field(|q: &Vector2<Real>| Matrix2::from_diagonal_element((-q.x + 1.0).sqrt()));
//! let beyond_edge = Riemannian::<Chart<2>>::end(&slit, &Vector2::zeros(), &Vector2::new(3.0, 0.0));
//! assert!(matches!(beyond_edge, Err(MetricError::Edge { time }) if time < 1.0));
//! let beyond = Riemannian::<Sphere<2>>::end(&Canonical, &x, &Vector2::new(3.5, 0.0));
//! assert!(matches!(beyond, Err(MetricError::CutLocus { .. })));
//! let indefinite = Metric::constant(Matrix2::new(1.0, 2.0, 2.0, 1.0));
//! assert!(matches!(indefinite, Err(MetricError::NotPositive(_))));
//! # Ok(())
//! # }
//! ```
//!
//! # What is checked
//!
//! - Every point where the metric is used: the entries are finite, the matrix is symmetric up to the rounding of its
//!   entries, and positive in the frame of the chart. So a form on R³ may be indefinite off the tangent plane.
//! - Sampled points around the start, before every run.
//! - [`laws::metric`](crate::manifolds::laws::metric), when you call it, also checks that geodesics have constant speed. A
//!   wrong derivative breaks this.
//!
//! No check can know whether it is the metric you meant: a tensor in the wrong coordinates is a metric too. Compare a
//! length with a closed form, or one step with the same step in another chart.
//!
//! # What it costs
//!
//! Geodesics are integrated by extrapolation to 10⁻¹³, and with their derivatives by hyper-dual numbers,
//! in each evaluation of the equation of a step. A step of `h = 0.1` then takes, on average
//! (`benches/step/snapshot.txt`),
//!
//! | problem | evaluations of the closure |
//! |---|---|
//! | S², the spinning top | 173 |
//! | SO(3), Nambu's bracket | 325 |
//!
//! which takes about 50 times the time of the canonical metric on S², and 70 times on SO(3)
//! (`benches/README.md`).
//!
//! So write a constant matrix as [`Metric::constant`](crate::manifolds::Metric::constant), and a
//! product as a pair.
//!
//! # What can go wrong
//!
//! | cause | effect | remedy |
//! |---|---|---|
//! | the edge of a chart is at a finite distance | [`MetricError::Edge`](crate::manifolds::MetricError::Edge), with the fraction of the way; a run halves the step, and otherwise ends in an error with the trajectory so far | a smaller step; coordinates or a metric in which the edge is far, as `ds²/s²` on R₊ |
//! | `A` is not positive somewhere | [`NotPositive`](crate::manifolds::MetricError::NotPositive) with the pivot, along a geodesic [`Degenerate`](crate::manifolds::MetricError::Degenerate) | the domain of the [`Chart`](crate::manifolds::Chart) |
//! | a step beyond the cut locus, where geodesics stop being shortest | [`CutLocus`](crate::manifolds::MetricError::CutLocus) for canonical metrics; with a closure the cut locus is not known, and the logarithm is *a* geodesic, up to where the chart ends: antipodes and half turns are [`OutOfChart`](crate::manifolds::MetricError::OutOfChart) | a smaller step |
//! | two points far apart | [`NoLogarithm`](crate::manifolds::MetricError::NoLogarithm), with the remaining distance; steps need no logarithm | points closer together |
//! | a metric with waves shorter than a thousandth of a step | [`Uneven`](crate::manifolds::MetricError::Uneven), with the pieces | a smaller step |
//! | `sqrt`, `norm` at zero | derivatives that are not numbers: the run refuses to start | `norm_squared`, even powers |
//! | friction too strong or weak | `K` is of second order in `A⁻¹`, and [`Nambu`](crate::dynamics::Nambu) and [`AreaForm`](type@crate::dynamics::AreaForm) have `1/√det g` | scale `A`, or the factor of the bracket |
