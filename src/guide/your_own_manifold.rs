//! A manifold of your own, in sixty lines: the hyperbolic plane.
//!
//! A space of states is a type with two traits. [`Space`](crate::fields::Space) says what a point is,
//! at every scalar, and gives a chart `φ_x` around each real point `x`;
//! [`Manifold`](crate::manifolds::Manifold) says which arrays of numbers are points. Geodesics come from
//! [`Metric::field`](crate::manifolds::Metric::field), so no closed form is needed.
//!
//! The hyperbolic plane is the upper sheet of the hyperboloid in R³ with the form of Minkowski,
//!
//! ```math
//! \mathbb H^2 = \bigl\{ x \in \mathbb R^3 : x_3 = \sqrt{1 + x_1^2 + x_2^2} \bigr\}, \qquad
//! G(v, v) = v_1^2 + v_2^2 - v_3^2 ,
//! ```
//!
//! which is indefinite on R³ and positive on tangent vectors (Cannon, Floyd, Kenyon and Parry 1997).
//! The first two entries are a chart:
//!
//! ```
//! use metriplectic::dynamics::NaturalBracket;
//! use metriplectic::fields::{ChartPoint, Space};
//! use metriplectic::manifolds::rand::{Rng, RngExt};
//! use metriplectic::manifolds::{Riemannian, laws};
//! use metriplectic::nalgebra::Const;
//! use metriplectic::prelude::*;
//!
//! #[derive(Clone, Debug, PartialEq)]
//! struct HyperbolicPlane;
//!
//! /// The point of the sheet above `(x, y)`.
//! fn above<D: Scalar>(x: D, y: D) -> Vector3<D> {
//!     Vector3::new(x, y, (x * x + y * y + 1.0).sqrt())
//! }
//!
//! impl Space for HyperbolicPlane {
//!     type Dim = Const<2>;
//!     type Velocity = Const<3>; // x' is written in R³
//!     type Point<D: Scalar> = Vector3<D>;
//!
//!     fn constant<D: Scalar>(x: &Vector3<f64>) -> Vector3<D> {
//!         x.map(D::from)
//!     }
//!     fn real<D: Scalar>(x: &Vector3<D>) -> Vector3<f64> {
//!         x.map(|entry| entry.re())
//!     }
//!     fn chart<D: Scalar>(x: &Vector3<f64>, q: &Vector2<D>) -> Vector3<D> {
//!         above(q.x + x.x, q.y + x.y)
//!     }
//!     fn coordinates<D: Scalar>(x: &Vector3<f64>, y: &Vector3<D>) -> Vector2<D> {
//!         Vector2::new(y.x - x.x, y.y - x.y)
//!     }
//!     /// The velocity of `φ_x(q)` for `q' = v`; `x₁x₁' + x₂x₂' = x₃x₃'` on the sheet.
//!     fn embed<D: Scalar>(at: &ChartPoint<Self, D>, v: &Vector2<D>) -> Vector3<D> {
//!         let x = at.point();
//!         Vector3::new(v.x, v.y, (x.x * v.x + x.y * v.y) / x.z)
//!     }
//! }
//!
//! impl Manifold for HyperbolicPlane {
//!     fn defect(&self, x: &Vector3<f64>) -> f64 {
//!         (x - self.project(x)).norm()
//!     }
//!     fn entries(x: &Vector3<f64>) -> Vec<f64> {
//!         x.iter().copied().collect()
//!     }
//!     fn assemble(next: &mut impl FnMut() -> f64) -> Vector3<f64> {
//!         Vector3::from_fn(|_, _| next())
//!     }
//!     fn magnitude(x: &Vector3<f64>) -> f64 {
//!         x.norm()
//!     }
//!     fn project(&self, x: &Vector3<f64>) -> Vector3<f64> {
//!         above(x.x, x.y)
//!     }
//!     fn random(&self, rng: &mut impl Rng) -> Vector3<f64> {
//!         above(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0))
//!     }
//! }
//!
//! /// What `System::on` starts from; `Zero` for a manifold without a bracket of its own.
//! impl NaturalBracket for HyperbolicPlane {
//!     type Bracket = AreaForm;
//!     fn natural_bracket(&self) -> AreaForm {
//!         AreaForm
//!     }
//! }
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // A bilinear form on velocities; θᵀAθ is formed in each chart, and must be positive there.
//! let metric = Metric::field(|_: &Vector3<Real>| {
//!     Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0)).cast()
//! });
//!
//! // The same checks that the spaces of this crate pass.
//! let (x, u) = (above(0.3, -0.5), Vector2::new(0.4, 0.7));
//! let y = HyperbolicPlane::chart(&x, &u);
//! laws::manifold(&HyperbolicPlane, &x, &u)?;
//! laws::metric::<HyperbolicPlane, _>(&metric, &x, &u)?;
//! laws::retraction::<HyperbolicPlane, _, _>(&WeylMidpoint, &metric, &x, &u)?;
//! laws::symmetric_retraction::<HyperbolicPlane, _, _>(&WeylMidpoint, &metric, &x, &y)?;
//!
//! // And a closed form: cosh d(x, y) = x₃y₃ − x₁y₁ − x₂y₂.
//! let v: Vector2<f64> = Riemannian::<HyperbolicPlane>::log(&metric, &x, &y)?;
//! let w = HyperbolicPlane::embed(&ChartPoint::centre(&x), &v);
//! let length = (w.x.powi(2) + w.y.powi(2) - w.z.powi(2)).sqrt();
//! let distance = (x.z * y.z - x.x * y.x - x.y * y.y).acosh();
//! assert!((length - distance).abs() < 1e-12);
//!
//! // A metriplectic run: precession about the minimum of h = x₃ − ½x₁, with friction into a bath.
//! let system = System::on(Product(HyperbolicPlane, Euclidean::<1>))
//!     .metric((metric, Canonical))
//!     .bracket((AreaForm, Zero))
//!     .energy(|(x, s): &(Vector3<Real>, Vector1<Real>)| x.z - x.x * 0.5 + s.x.exp() * 0.2)
//!     .entropy(|(_, s): &(Vector3<Real>, Vector1<Real>)| s.x)
//!     .build()?;
//! let start = (above(0.0, 1.0), Vector1::new(0.0));
//! let run = WeylMidpoint.run(&system, start, Span::steps(0.1, 200))?;
//! assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
//!
//! // It sinks to the point where dh = 0 on the plane: x₁/x₃ = ½, x₂ = 0.
//! let (end, _) = &run.last().point;
//! assert!((end.x / end.z - 0.5).abs() < 1e-4 && end.y.abs() < 1e-4);
//! # Ok(())
//! # }
//! ```
//!
//! # What the traits ask for
//!
//! | item | meaning | checked by |
//! |---|---|---|
//! | `Point<D>` | any type that holds numbers of `D`: a column, a matrix, a pair | the compiler |
//! | `chart`, `coordinates` | `φ_x` and `φ_x⁻¹`, with `φ_x(0) = x`, written once for `f64` and all dual numbers | [`laws::manifold`](crate::manifolds::laws::manifold) |
//! | `embed` | `θ(q) v`, the velocity to which tensors refer: the derivative of `φ_x`, or a frame of your choice | geodesics of constant speed, [`laws::metric`](crate::manifolds::laws::metric) |
//! | `defect`, `project`, `entries`, `magnitude`, `scales`, `pairing_size`, `random` | the distance from the manifold, the nearest point, the scale of round-off (of a point, of each direction of its chart, and of a slope), samples for the checks of a model | [`laws::manifold`](crate::manifolds::laws::manifold), in part |
//! | `NaturalBracket` | the bracket that [`System::on`](crate::dynamics::System::on) starts with | [`laws::bracket`](crate::dynamics::laws::bracket) |
//!
//! Write the chart so that it ends *on* the manifold for every `q`. Here the third entry is computed from the others; on
//! a sphere the norm is divided out. The states of a run are chart points, so they then never leave the manifold. If a
//! square root or an angle is not smooth at `q = 0`, its derivatives there are not numbers.
//! [`series`](crate::fields::series) has functions that are smooth there.
//!
//! # What may be left out
//!
//! - [`Space::is_near`](crate::fields::Space::is_near): a chart that does not cover everything says
//!   where its inside ends, and long geodesics change charts there.
//! - [`Space::seeds`](crate::fields::Space::seeds),
//!   [`Space::covariant`](crate::fields::Space::covariant) and
//!   [`Space::contravariant`](crate::fields::Space::contravariant) are derived from `chart` and
//!   `embed`; a closed form is faster.
//! - [`Manifold::transport`](crate::manifolds::Manifold::transport) improves the guess of a step
//!   where frames rotate.
//! - Geodesics in closed form: implement [`Riemannian`](crate::manifolds::Riemannian) for
//!   [`Canonical`](crate::manifolds::Canonical) on your space, as the modules
//!   [`sphere`](crate::manifolds::sphere) and [`rotations`](crate::manifolds::rotations) do. The
//!   same laws check it.
