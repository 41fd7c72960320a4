//! Ten questions that lead to a space, a bracket, a dissipation and a scheme, each with a short table.
//!
//! The defaults are in **bold**. The [last section](#three-programs) has a program for each of the three most common
//! kinds of model. It states only what differs from the defaults.
//!
//! # 1. Where does the state live?
//!
//! | the state is | space | because |
//! |---|---|---|
//! | the momentum of a body or fluid in the body frame | [`LieDual`](crate::manifolds::LieDual) | it includes its bracket, and its Casimirs are entropies |
//! | positions, momenta, entropies, without constraints | [`Euclidean`](crate::manifolds::Euclidean) | geodesics are straight lines, steps are cheapest |
//! | a direction, a spin, a unit quaternion | [`Sphere`](crate::manifolds::Sphere) | no chart has a pole, and the norm cannot drift |
//! | an attitude | [`Rotations`](crate::manifolds::Rotations) | no gimbal lock |
//! | a temperature, a volume, an internal energy | [`HalfLine`](crate::manifolds::HalfLine) | zero is infinitely far |
//! | coordinates with an edge | [`Chart`](crate::manifolds::Chart) | a step that leaves the domain is split in halves, or is an error |
//! | several of these | [`Product`](crate::manifolds::Product) | pairs nest |
//! | another space | [your own](super::your_own_manifold) | it takes two traits |
//!
//! # 2. What moves it reversibly?
//!
//! | the bracket | use it | its Casimirs |
//! |---|---|---|
//! | [`LiePoisson`](crate::dynamics::LiePoisson), **of every `LieDual`** | for momenta in the body frame, heavy tops, fluids truncated to a Lie algebra | functions that the coadjoint action leaves alone: `½\|p\|²` on so(3)*, `\|Γ\|²` and `M·Γ` on se(3)* |
//! | [`Symplectic`](crate::dynamics::Symplectic) | for positions and momenta, R²ⁿ or `T*SO(3)` | constants only |
//! | [`Poisson::constant`](crate::dynamics::Poisson::constant) | the same with further variables, such as `s` in `(q, p, s)` | functions of the variables with zero rows |
//! | [`Poisson::field`](crate::dynamics::Poisson::field) | for a matrix that varies; Jacobi's identity is checked | those of your matrix |
//! | [`AlmostPoisson::field`](crate::dynamics::AlmostPoisson::field) | for a nonholonomic system, whose bracket is skew and breaks Jacobi's identity | those of your matrix |
//! | [`.force(f)`](crate::dynamics::SystemBuilder::force) on a `LieDual` | for a force without work, `μ' = ad*_ξ(μ + 𝓕(ξ))`, such as a feedback torque | conserved only where `⟨𝓕, [ξ, dC]⟩ = 0` |
//! | [`AreaForm`](type@crate::dynamics::AreaForm) | on a surface: spins, point vortices | constants only |
//! | [`Nambu`](crate::dynamics::Nambu) | on a 3-manifold, if only `H`, `S` and a metric are known | `S`, by construction |
//! | `Nambu::default().and(c)`, once for each further Casimir | the same on an `n`-manifold, `n ≤ 8`, with `n − 3` functions more | `S`, and each `c` |
//! | `Scaled(c, B)`, of a bracket `B` | for an energy in other units | those of `B` |
//! | a pair, `(AreaForm, Zero)` | on a product | those of both factors; every function of a factor with `Zero` |
//! | [`Zero`](crate::dynamics::Zero), **elsewhere** | without reversible motion: `S` rises along a level set of `H` | all functions |
//!
//! # 3. Is the entropy a Casimir of the bracket?
//!
//! | `Π dS` | then | because |
//! |---|---|---|
//! | `= 0` | nothing; [`SecondLaw::Exact`](crate::dynamics::SecondLaw::Exact) is the **default** | both laws hold in each step |
//! | `≠ 0`, but a bath would make sense | `S = s` on a `Product` with a factor for `s` | a bath takes the energy of friction: `H = h + e(s)`, temperature `e'(s)` |
//! | `≠ 0`, on a 3-manifold | `Nambu` | every `S` is a Casimir; in `n` dimensions too, with `n − 3` further ones |
//! | `≠ 0`, on purpose | [`SecondLaw::Published`](crate::dynamics::SecondLaw::Published) | `H` is conserved; the entropy also changes reversibly, so no second law is promised |
//! | there is no `S` | leave it out | `H` is conserved, without a projection |
//!
//! On a surface a bracket other than `Zero` has only constant Casimirs, and so has `T*SO(3)`. So the second line is for
//! spins and for attitudes ([`errata`](super::errata#24-symmetry-preservation) has the reason for attitudes).
//!
//! # 4. What produces entropy?
//!
//! | you know | dissipation | because |
//! |---|---|---|
//! | only a metric | **[`MetricDissipation`](crate::dynamics::MetricDissipation)** | steepest ascent of `S` orthogonal to `dH`, times `\|dH\|²` |
//! | the same, and a rate | [`MetricDissipation::scaled`](crate::dynamics::MetricDissipation::scaled), or [`Scaled`](crate::dynamics::Scaled) around any other | `κ(x) ≥ 0`; a constant is a time scale |
//! | which variables have friction | [`CometricDissipation`](crate::dynamics::CometricDissipation) | a semidefinite cometric; variables with rows of zeros have no friction |
//! | two such forms | [`KulkarniNomizu`](crate::dynamics::KulkarniNomizu) | metriplectic 4-brackets (Morrison and Updike 2024) |
//! | a form on the Lie algebra | [`CasimirDissipation`](crate::dynamics::CasimirDissipation) | a Casimir grows by forced Euler-Poincaré equations, eq. (ops1) |
//! | any other force `𝓕(ξ)` on it | [`.force(f)`](crate::dynamics::SystemBuilder::force) | `C' = ⟨𝓕(ξ), [ξ, dC]⟩`, whose sign is verified |
//! | heat conduction, Stokes friction, reactions | [`.onsager(f)`](crate::dynamics::SystemBuilder::onsager), [`.field_dissipation(f)`](crate::dynamics::SystemBuilder::field_dissipation) | `K(x, w)` with `w` for `dH`: temperatures are components of `w`, and the law is exact; the book's recipes have programs |
//! | a matrix `K(x)` that you do not want to rewrite | [`ProjectedDissipation`](crate::dynamics::ProjectedDissipation) | it is projected orthogonally to `w`, which may spread friction to other variables; the certificate says so |
//!
//! # 5. Which retraction?
//!
//! | retraction | order | use it |
//! |---|---|---|
//! | **[`WeylMidpoint`](crate::manifolds::WeylMidpoint)** | 2 | unless a row below applies |
//! | **[`ChartMidpoint`](crate::manifolds::ChartMidpoint)** | 2 | with a metric from a closure, on every space: it follows the straight lines of the chart, and integrates no geodesic |
//! | [`Projection`](crate::manifolds::Projection) on spheres, [`Cayley`](crate::manifolds::Cayley) on SO(3) | 2 | rational paths; with a metric from a closure they cost what `ChartMidpoint` does |
//! | [`Exponential`](crate::manifolds::Exponential) | 1 | for comparison with schemes based at `x`; it costs as much |
//!
//! On flat spaces with a constant metric all paths are straight lines, and `WeylMidpoint` is the midpoint rule. With
//! canonical metrics `ChartMidpoint` takes the same steps.
//!
//! With a metric from a closure `WeylMidpoint` integrates true geodesics, 100 to 200 evaluations of the closure in a
//! step, and `ChartMidpoint` takes 2.2 to 3.4 (`cargo test -p metriplectic-quick-tests --test chart_midpoint -- --nocapture`). Both laws are exact
//! with both, and the errors are of one size. Take `WeylMidpoint` for the scheme of the paper, if a step must not
//! depend on the coordinates (with `ChartMidpoint` it does, by `O(h³)`), or if an edge of the domain is infinitely
//! far in the metric.
//!
//! # 6. Which discrete gradient?
//!
//! Write `Scheme::new(WeylMidpoint).gradient(MeanValue)` in place of `WeylMidpoint`. All gradients conserve `H` to
//! round-off. The scheme uses the same gradient for `S`.
//!
//! | gradient | order | use it |
//! |---|---|---|
//! | **[`Gonzalez`](crate::integrators::Gonzalez)** | 2 | by default: one differential and a correction along the path; on flat spaces it is `dH(z)` if `H` is quadratic |
//! | [`MeanValue`](crate::integrators::MeanValue) | 2 | if the metric is arbitrary: on flat spaces it does not depend on it, nor on affine coordinates; four differentials |
//! | [`SymmetricItohAbe`](crate::integrators::SymmetricItohAbe) | 2 | to compare: differences of values, coordinate by coordinate, and slopes only where those are small |
//! | [`ItohAbe`](crate::integrators::ItohAbe) | 1 | to compare; it depends on the order of the coordinates |
//!
//! Accuracy does not decide between them. On the spinning top of Celledoni, Eidnes, Owren and Ringholm (2020) the
//! errors at `t = 5`, with 25 steps, are 3.57e-4, 3.16e-4 and 5.42e-5 for the three of order 2
//! (`tests/equations.rs::the_discrete_gradients_have_small_errors_on_the_spinning_top`). With another energy the
//! order of these errors differs.
//!
//! # 7. Which second law?
//!
//! | `.second_law(..)` | `ΔS` in a step | use it |
//! |---|---|---|
//! | **[`Exact`](crate::dynamics::SecondLaw::Exact)** | `h K(w_S, w_S) ≥ 0` to round-off | if `S` is a Casimir. Its order is 2 as long as `\|w_S\|` is large against `h²`; [`Certificate::min_entropy_slope`](crate::integrators::Certificate) has the least one |
//! | [`Published`](crate::dynamics::SecondLaw::Published) | `≥ −C h³` | to reproduce the paper, and if `S` is not a Casimir |
//!
//! If `S` is quadratic, the space flat and `Π` linear, as in the paper's example, the two are the same map.
//!
//! # 8. Is anything else conserved?
//!
//! | the function | call | because |
//! |---|---|---|
//! | a Casimir beside `S` (`\|Γ\|²` of a heavy top) | `.casimir(f)` | the bracket is projected until it annihilates a discrete gradient of `f` |
//! | a momentum (an angular momentum) | `.momentum(f)` | `Π df ≠ 0`, so a projection of the bracket would change the flow; only the drift of `f` is corrected |
//! | a momentum whose symmetry is to be checked | `.symmetry(action, f)` | verification also tries the action: Poisson, `H∘Φ = H`, and `X_J` its generator |
//!
//! They are methods of the [`SystemBuilder`](crate::dynamics::SystemBuilder). The dissipation of the metric annihilates
//! the differentials of these functions. Any other dissipation must do so too, otherwise the model is refused. Do
//! not list a function that depends on the other fields, such as a function of `H` and `S`: it is refused with its
//! numbers.
//!
//! # 9. Which step?
//!
//! Both laws hold for every step that is solved, so choose `h` by accuracy.
//!
//! | you see | do |
//! |---|---|
//! | runs with `h` and `h/2` differ by more than three times the error you want | halve `h`: the error of order 2 is a third of the difference |
//! | [`retries`](crate::integrators::Certificate) in the certificate | steps were split in halves; a smaller `h` is cheaper |
//! | six iterations or more in the worst step | the step is long for Newton's method; the same |
//! | a path near the cut locus, half a turn of a body in one step | ten steps a turn |
//! | `friction not damped: h\|K'\| = …` in the certificate | friction is faster than a step, which does not damp it: large steps exchange hot and cold and do not find the rest point. Take [`Radau`](crate::integrators::Radau), which damps it, or steps with `h\|K'\|` below 10, or [`Span::until`](crate::integrators::Span::until) |
//! | [`StiffFriction`](crate::integrators::StepError::StiffFriction) | the step is not solved, because friction is stiff: take [`Radau`](crate::integrators::Radau), and smaller steps while a fast transient lasts; the error has the step size |
//!
//! # 10. Which metric?
//!
//! The metric defines the friction (question 4), the volume in `Nambu` and `AreaForm`, and the paths of the steps. If
//! it only defines the paths, take the **canonical** one.
//!
//! | metric | cost | use it |
//! |---|---|---|
//! | **[`Canonical`](crate::manifolds::Canonical)** | closed forms | unless friction says otherwise |
//! | [`Metric::constant`](crate::manifolds::Metric::constant) | closed forms | on flat spaces, for units and weights: a variable in other units needs another weight |
//! | a pair | the sum of its parts | on products, `(Canonical, bath)` |
//! | [`Metric::field`](crate::manifolds::Metric::field) | geodesics are integrated, 50 to 70 times the time | if friction varies with the state; `Canonical` with `CometricDissipation` has the same friction without this cost |
//!
//! More on the last line is in [`your_own_metric`](super::your_own_metric).
//!
//! # Three programs
//!
//! ```
//! use metriplectic::prelude::*;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // Momenta of a body, with internal friction: all defaults. S = ½|p|² is a Casimir of so(3)*.
//! let body = System::on(LieDual::so3())
//!     .energy(|p: &Vector3<Real>| p.x.powi(2) * 0.5 + p.y.powi(2) * 0.25 + p.z.powi(2) * 0.125)
//!     .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
//!     .build()?;
//! let run = WeylMidpoint.run(&body, Vector3::new(0.9, 0.3, 0.2), Span::steps(0.1, 100))?;
//! assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
//!
//! // Mechanics and heat, x = (q, p, s): canonical on (q, p), and S = s is a Casimir because its row is
//! // zero. Friction is a closure of w = (−force, velocity, temperature), so it is exact in each step.
//! let rows = Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
//! let damped = System::on(Euclidean::<3>)
//!     .bracket(Poisson::constant(rows)?)
//!     .energy(|x: &Vector3<Real>| x.y.powi(2) * 0.5 - x.x.cos() + x.z.exp())
//!     .entropy(|x: &Vector3<Real>| x.z)
//!     .field_dissipation(|_: &Vector3<Real>, w: &Vector3<Real>| {
//!         let b = Vector3::new(Real::from(0.0), w.z, -w.y);
//!         b * b.transpose() * (w.z.recip() * 0.2)
//!     })
//!     .build()?;
//! let scheme = Scheme::new(WeylMidpoint).gradient(MeanValue);
//! let run = scheme.run(&damped, Vector3::new(1.5, 0.0, 0.0), Span::steps(0.1, 200))?;
//! assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
//! assert!(run.last().point.x.abs() < 0.3); // the pendulum hangs almost still, and is warmer
//!
//! // A symmetric Hamiltonian system: no entropy, and a momentum that no scheme keeps unasked.
//! let orbit = System::on(Euclidean::<4>)
//!     .bracket(Symplectic)
//!     .energy(|x: &Vector4<Real>| {
//!         let (q, p) = (x.x.powi(2) + x.y.powi(2), x.z.powi(2) + x.w.powi(2));
//!         p * 0.5 + q.powi(2) * 0.25
//!     })
//!     .momentum(|x: &Vector4<Real>| x.x * x.w - x.y * x.z)
//!     .build()?;
//! let run = WeylMidpoint.run(&orbit, Vector4::new(1.0, 0.0, 0.2, 0.6), Span::steps(0.1, 100))?;
//! assert!(run.certificate().keeps_energy() && run.certificate().keeps_invariants());
//! # Ok(())
//! # }
//! ```
//!
//! Two examples show more: `spin_helix` has spins with a bath on `S² × R`, with the brackets `(AreaForm, Zero)`;
//! `rotations` has only an energy and an entropy on SO(3).
