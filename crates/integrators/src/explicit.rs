//! Explicit Runge-Kutta methods, and then back onto the laws.
//!
//! The stages of [`DormandPrince8`], [`DormandPrince5`] and of a [`Tableau`] of your own are taken in a cheap chart `ψ_x`
//! of the space ([`Space::stage`](metriplectic_fields::Space::stage)). Any chart keeps the order (Munthe-Kaas 1998;
//! Hairer, Lubich, Wanner 2006, §IV.5).
//!
//! # The entropy
//!
//! `S` is one more component of the equation, `S' = σ = ⟨dS, K dS⟩`, and
//!
//! ```math
//! S^* = \bar S + h \sum_i b_i \sigma_i
//! ```
//!
//! is of the same order as the state. It is *trusted* if it does not fall, and if its embedded error is at most
//! half of its rise. The error of order 5 needs the rates at the end of the step, and is not known yet.
//!
//! # The laws
//!
//! The end of the step is moved onto `{H = H₀, L_a = L_a⁰, S = S*}` by Newton's method along the differentials,
//! made orthogonal in units of the allowed errors, or of the sizes of the entries in steps of one size. So neither units
//! of measurement nor the metric decide which laws are independent. The targets are those of the start of the run, so
//! nothing drifts. A projection keeps the order (Hairer, Lubich, Wanner 2006, §IV.4).
//!
//! Near an equilibrium `dS = β dH + γ_a dL_a`, and a round-off of the energy moves `S` by more than its own. So
//! the entropy is compared as `S − β (H − H₀) − γ_a (L_a − L_a⁰)`.
//!
//! | step | when | entropy |
//! |---|---|---|
//! | targeted | `S*` is trusted and reached | `S*` |
//! | free | else, on `{H₀, L_a⁰}` alone | what it is, if it does not fall |
//! | rejected | it would fall | `h ← 0.7 h`, and no larger steps for a while |
//! | held | it would fall in any step, by round-off, and the state is at rest in its own motion | as before; the state stays |
//!
//! At an equilibrium the entropy falls exactly where the step is beyond the region of stability, so the free
//! steps find its edge. Values of `S` show a deviation `δ` from an equilibrium only if `|δ| > √ε`. Below that, the
//! integral `∫ ⟨dS − β dH − γ_a dL_a, dx⟩` over the step decides whether the entropy falls, so a run reaches the
//! equilibrium to round-off.
//!
//! # What is promised
//!
//! `H` and `L_a` are conserved to round-off at any tolerance. `S` does not fall by more than its round-off.
//! A model with [`SecondLaw::Published`] keeps `H` and `L_a`. The methods are not symmetric in time, and stiff
//! friction bounds their steps; the certificate says when it does.

mod along;
mod chebyshev;
pub(crate) mod conditions;
mod creep;
mod dense;
mod dormand_prince;
mod estimates;
mod flow;
mod landing;
mod memory;
mod refused;
mod rest;
mod spectrum;
mod stage;
mod step;
mod tableau;
mod tableau_error;
mod trial;

use metriplectic_dynamics::SecondLaw;

pub(crate) use along::along;
pub use flow::{Combination, Limit, Projected, ProjectionError, StageFlow, Target};
pub use memory::ExplicitMemory;
use memory::MemoryOf;

use crate::step::{
    Compiled, Control, Element, LimitingSites, MethodError, Promises, Refusal, StepEnds, StepError,
    StepStart, Stepper, Taken,
};

pub(crate) use chebyshev::{CHEBYSHEV, Coefficients, Recursion};
use dormand_prince::{EIGHT, FIVE};
use trial::{Done, Kind, Trial};

use tableau::Stages;
pub use tableau::{Row, Tableau};
pub use tableau_error::TableauError;

/// The method of Dormand and Prince of order 8, with both laws exact: for high accuracy, and for smooth motions at
/// any accuracy.
///
/// ```
/// use metriplectic_dynamics::System;
/// use metriplectic_fields::Real;
/// use metriplectic_integrators::{DormandPrince8, Method, Span};
/// use metriplectic_manifolds::LieDual;
/// use nalgebra::Vector3;
/// # fn main() -> Result<(), metriplectic_integrators::Error> {
/// let body = System::on(LieDual::so3())
///     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
///     .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
///     .build()?;
/// let span = Span::until(50.0).tolerance(1e-8);
/// let run = DormandPrince8.run(&body, Vector3::new(0.4, 0.5, 0.3), span)?;
/// let certificate = run.certificate();
/// assert!(certificate.keeps_energy() && certificate.keeps_entropy());
/// assert!(certificate.steps < 200);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DormandPrince8;

/// The method of Dormand and Prince of order 5, with both laws exact: for errors of 1e-3 to 1e-6, and where
/// steps are short for other reasons.
///
/// ```
/// use metriplectic_dynamics::System;
/// use metriplectic_fields::Real;
/// use metriplectic_integrators::{DormandPrince5, Method, Span};
/// use metriplectic_manifolds::Euclidean;
/// use nalgebra::Vector2;
/// # use metriplectic_dynamics::Symplectic;
/// # use num_dual::DualNum;
/// # fn main() -> Result<(), metriplectic_integrators::Error> {
/// let pendulum = System::on(Euclidean::<2>)
///     .bracket(Symplectic)
///     .energy(|x: &Vector2<Real>| x.y * x.y * 0.5 - x.x.cos())
///     .build()?;
/// let run = DormandPrince5.run(&pendulum, Vector2::new(2.0, 0.0), Span::until(20.0).tolerance(1e-5))?;
/// assert!(run.certificate().keeps_energy());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DormandPrince5;

/// The method of Runge, Kutta and Chebyshev of order 2, with both laws exact: for stiff friction and conduction, where
/// stability bounds the steps of the other explicit methods.
///
/// A step takes as many stages as its size and the spectral radius `ρ` of the equation of motion ask for, about
/// `1.25 √(hρ)`, where an explicit method of another kind takes a number of steps in proportion to `hρ` (Sommeijer,
/// Shampine, Verwer 1997). The eigenvalues of the motion must lie near the negative axis: friction may be stiff, an
/// oscillation may not.
///
/// ```
/// use metriplectic_dynamics::{FieldDissipation, System};
/// use metriplectic_fields::Real;
/// use metriplectic_integrators::{Method, RungeKuttaChebyshev, Span};
/// use metriplectic_manifolds::Euclidean;
/// use nalgebra::{Matrix2, Vector2};
/// # use num_dual::DualNum;
/// # fn main() -> Result<(), metriplectic_integrators::Error> {
/// // Two bodies that exchange heat 10⁴ times faster than they are looked at.
/// let exchange = |_: &Vector2<Real>, w: &Vector2<Real>| {
///     let b = Vector2::new(w.y, -w.x);
///     b * b.transpose() * Real::from(1e4)
/// };
/// let bodies = System::on(Euclidean::<2>)
///     .dissipation(FieldDissipation(exchange))
///     .energy(|e: &Vector2<Real>| e.x + e.y)
///     .entropy(|e: &Vector2<Real>| e.x.ln() + e.y.ln())
///     .build()?;
/// let span = Span::until(1.0).tolerance(1e-3);
/// let run = RungeKuttaChebyshev.run(&bodies, Vector2::new(1.0, 3.0), span)?;
/// assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
/// assert!((run.last().point.x - 2.0).abs() < 1e-3 && run.certificate().steps < 200);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RungeKuttaChebyshev;

/// An explicit Runge-Kutta method with coefficients of your own, with both laws exact.
///
/// ```
/// use metriplectic_dynamics::System;
/// use metriplectic_fields::Real;
/// use metriplectic_integrators::{ExplicitRungeKutta, Method, Span, Tableau};
/// use metriplectic_manifolds::LieDual;
/// use nalgebra::Vector3;
/// # fn main() -> Result<(), metriplectic_integrators::Error> {
/// // Kutta's method of order 3 (1901).
/// const KUTTA: Tableau = Tableau::new(
///     "Kutta3",
///     3,
///     &[&[(0, 0.5)], &[(0, -1.0), (1, 2.0)]],
///     &[(0, 1.0 / 6.0), (1, 2.0 / 3.0), (2, 1.0 / 6.0)],
/// );
/// let body = System::on(LieDual::so3())
///     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
///     .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
///     .build()?;
/// let kutta = ExplicitRungeKutta::new(&KUTTA);
/// let run = kutta.run(&body, Vector3::new(0.4, 0.5, 0.3), Span::until(50.0).tolerance(1e-4))?;
/// assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ExplicitRungeKutta {
    tableau: &'static Tableau,
}

impl ExplicitRungeKutta {
    /// The method of a tableau. A run refuses a tableau whose rows name stages that are not known, whose weights miss
    /// their order, or whose error estimates nothing, with the [`TableauError`] in [`RunError::Method`](crate::RunError::Method).
    pub const fn new(tableau: &'static Tableau) -> Self {
        Self { tableau }
    }

    /// Its coefficients.
    pub const fn tableau(&self) -> &'static Tableau {
        self.tableau
    }
}

impl DormandPrince8 {
    /// The coefficients.
    pub const TABLEAU: &'static Tableau = &EIGHT;

    const fn tableau(self) -> &'static Tableau {
        Self::TABLEAU
    }
}

impl DormandPrince5 {
    /// The coefficients.
    pub const TABLEAU: &'static Tableau = &FIVE;

    const fn tableau(self) -> &'static Tableau {
        Self::TABLEAU
    }
}

impl RungeKuttaChebyshev {
    /// The coefficients, which each step makes for its number of stages.
    pub const TABLEAU: &'static Tableau = &CHEBYSHEV;

    const fn tableau(self) -> &'static Tableau {
        Self::TABLEAU
    }
}

macro_rules! method {
    ($name:ident, $file:expr, $check:expr) => {
        impl<F: StageFlow> Stepper<F> for $name {
            type Memory = MemoryOf<F>;

            const IS_EXPLICIT: bool = true;

            fn compiled(&self) -> Option<Compiled> {
                Some(Compiled::Explicit(self.tableau()))
            }

            fn name(&self) -> String {
                let file: fn(&'static Tableau) -> String = $file;
                file(self.tableau())
            }

            fn order(&self) -> u32 {
                self.tableau().order
            }

            fn control(&self) -> Control {
                self.tableau().control
            }

            fn check(&self, follows_tolerance: bool) -> Result<(), MethodError> {
                let check: fn(&$name, bool) -> Result<(), TableauError> = $check;
                check(self, follows_tolerance).map_err(MethodError::new)
            }

            fn promises(&self, flow: &F) -> Promises {
                Promises::all_laws(flow.entropy_law() == SecondLaw::Exact)
            }

            fn step(
                &self,
                start: &StepStart<'_, F>,
                h: f64,
                memory: &mut MemoryOf<F>,
            ) -> Result<Taken<F>, StepError> {
                step::with_halves::<F, Self>(&Trial { tableau: self.tableau(), start, h }, memory)
            }

            #[inline]
            fn attempt(
                &self,
                start: &StepStart<'_, F>,
                h: f64,
                memory: &mut MemoryOf<F>,
            ) -> Result<Taken<F>, Refusal> {
                step::attempt::<F, Self>(&Trial { tableau: self.tableau(), start, h }, memory)
            }

            fn error(
                &self,
                step: &StepEnds<'_, F>,
                memory: &MemoryOf<F>,
                norm: impl Fn(&F::Vector) -> f64,
            ) -> Option<f64> {
                estimates::error(&Done { tableau: self.tableau(), ends: step }, memory, norm)
            }

            fn limiting_sites(
                &self,
                step: &StepEnds<'_, F>,
                memory: &MemoryOf<F>,
                allowed: &F::Vector,
            ) -> LimitingSites {
                estimates::limiting_sites(
                    &Done { tableau: self.tableau(), ends: step },
                    memory,
                    allowed,
                )
            }

            fn between(
                &self,
                step: &StepEnds<'_, F>,
                memory: &mut MemoryOf<F>,
                theta: f64,
            ) -> Option<Element<F>> {
                let promises = self.promises(step.flow);
                dense::between(
                    &Done { tableau: self.tableau(), ends: step },
                    promises,
                    memory,
                    theta,
                )
            }
        }
    };
}

fn plain(tableau: &'static Tableau) -> String {
    tableau.name.to_owned()
}

/// The name and a digest of the coefficients: two tableaus of one name are two methods. Those of this library have their
/// names alone.
fn with_digest(tableau: &'static Tableau) -> String {
    let digest = tableau.digest();
    let ours = [&EIGHT, &FIVE, &CHEBYSHEV].into_iter().any(|ours| ours.digest() == digest);
    if ours { plain(tableau) } else { format!("{} {digest:016x}", tableau.name) }
}

impl Kind for DormandPrince8 {
    const MAY_BE_EIGHT: bool = true;
}

impl Kind for DormandPrince5 {
    const MAY_BE_FIVE: bool = true;
}

impl Kind for RungeKuttaChebyshev {
    const IS_CHEBYSHEV: bool = true;
}

/// Any of them: with it the methods of this library are compiled, with their own tableaus.
impl Kind for ExplicitRungeKutta {
    const IS_CHEBYSHEV: bool = true;
    const MAY_BE_EIGHT: bool = true;
    const MAY_BE_FIVE: bool = true;
}

method!(DormandPrince8, plain, |_, _| Ok(()));
method!(DormandPrince5, plain, |_, _| Ok(()));
method!(RungeKuttaChebyshev, plain, |_, _| Ok(()));
method!(ExplicitRungeKutta, with_digest, |method, follows_tolerance| {
    // Tests check those of this library, and there is no time for it in a short run.
    let Tableau { stages, compiled, .. } = method.tableau;
    let is_ours = compiled.is_some() || matches!(stages, Stages::Chebyshev);
    if is_ours { Ok(()) } else { method.tableau.check(follows_tolerance) }
});
