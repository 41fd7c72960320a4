//! Methods with stages: [`Gauss`] of order `2s`, [`Radau`] of order `2s − 1`, with both laws exact on every space.
//!
//! A step has `s` stages `X_i` in a chart around its middle, with velocities `v_i`. Each function `F` among
//! `H`, `S` and `L_a` gets one number for all stages,
//!
//! ```math
//! a_F = \frac{F(x') - F(x) - h \sum_i b_i \langle dF(X_i), v_i\rangle}{h \sum_i b_i G(v_i, v_i)}, \qquad
//! w_{F,i} = dF(X_i) + a_F\, ♭v_i ,
//! ```
//!
//! and the stages solve `v_i = Π̃_i w_{H,i} + K̃_i w_{S,i}`, the equation of the midpoint scheme. Then
//! `F(x') − F(x) = h Σ b_i ⟨w_{F,i}, v_i⟩` by the definition of `a_F`. So `ΔH = ΔL_a = 0` and
//! `ΔS = h Σ b_i K̃_i(w_{S,i}, w_{S,i}) ≥ 0`, for every step size that is solved. With one stage it is the
//! [midpoint scheme](crate::midpoint).
//!
//! # Order
//!
//! The numerator is the error of an `s`-point rule for the integral of `d/dt F(u(t))` on the collocation polynomial `u`.
//! Its `2s`-th derivative has no term with `F'` or `F''`, because `u` has degree `s`. So the numerator is
//! `O(h^{2s+1}|v|³)`, and `a_F ♭v` is `O(h^{2s}|v|²)`: the step is that of Gauss for a field that is perturbed by
//! `O(h^{2s})`, up to equilibrium.
//!
//! # Reversible
//!
//! The chart depends on both ends alike, and Gauss nodes are symmetric. A step of `h` and one of `−h` lead back.
//!
//! # Stiff friction
//!
//! A method with an exact balance of the entropy cannot damp (the book has the proof). [`Radau`] gives up the
//! balance on one side, `ΔS ≥ h Σ b_i K̃_i(w_S, w_S)`, and returns what it loses of the energy as heat. It damps
//! friction that is much faster than a step.
//!
//! # The solver
//!
//! A step is solved by the following, in this order:
//!
//! 1. The blended iteration from the continued polynomial of the step before, with one Jacobian for all stages.
//! 2. The same from rest.
//! 3. Newton's method with the derivatives of all stages, for friction that is stiff and not linear.
//! 4. Continuation in the step size, by steps that double and are quartered.
//! 5. In parts: halves of a Gauss step, ten times at most; parts of a Radau step that grow from the time in which
//!    friction acts, since the step damps what is faster than itself.
//!
//! It stops where the correction *and* the errors of the laws are round-off. A root whose stages have quite another
//! energy, or which is beyond the chart, is refused. Adaptive steps are tried by 1 to 3, and then by a smaller step.
//!
//! Sources: one number per step for the energy, Brugnano, Iavernaro, Trigiante (2010); the correction along the
//! velocity, Gonzalez (1996); averaged covectors of order `s`, Andrews and Farrell (2025); tableaux, Hairer and Wanner
//! (Solving ODEs II, §IV.5).

#![allow(
    clippy::needless_range_loop,
    reason = "a stage is an index of several lists and of the tableau"
)]

mod chart;
pub(crate) mod covectors;
pub(crate) mod dense;
pub(crate) mod equation;
pub(crate) mod fallbacks;
pub(crate) mod full;
pub(crate) mod heat;
pub(crate) mod in_time;
pub(crate) mod linear;
pub(crate) mod memory;
pub(crate) mod parts;
mod root;
pub(crate) mod solve;
pub(crate) mod step;
pub(crate) mod tableau;
mod timed;

pub(crate) use covectors::{Stages, combined, trust};
pub(crate) use heat::{HeatStart, fraction, largest_entries};
pub(crate) use in_time::{EnergyInTime, InTime};
pub use memory::StageMemory;
pub(crate) use root::StepRoot;
pub(crate) use tableau::{STAGES, Tableau};
pub(crate) use timed::{MOST, Stage, StageSolution, TimedStep};

use crate::step::Control;
use tableau::{GAUSS, RADAU};

/// The Gauss method of `S = 1 … 4` stages and order `2S`: reversible, with both laws exact.
///
/// ```
/// use metriplectic_dynamics::System;
/// use metriplectic_fields::Real;
/// use metriplectic_integrators::{Gauss, Method, Span};
/// use metriplectic_manifolds::LieDual;
/// use nalgebra::Vector3;
/// # fn main() -> Result<(), metriplectic_integrators::Error> {
/// let body = System::on(LieDual::so3())
///     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
///     .entropy(|p: &Vector3<Real>| p.norm_squared() * 0.5)
///     .build()?;
/// let run = Gauss::<3>.run(&body, Vector3::new(0.4, 0.5, 0.3), Span::steps(0.5, 100))?;
/// let certificate = run.certificate();
/// assert!(certificate.keeps_energy() && certificate.keeps_entropy());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Gauss<const S: usize>;

/// The Radau IIA method of `S = 2 … 4` stages and order `2S − 1`, for friction that is much faster than a step: it damps
/// it, conserves the energy, and the entropy never falls.
///
/// The entropy rises by the production of friction, and by what the method adds where it damps
/// ([`StageBalance::surplus`](crate::StageBalance)). There is a surplus without friction too, of the order of the error.
/// So take [`Gauss`] where nothing is stiff.
///
/// ```
/// use metriplectic_dynamics::{FieldDissipation, System};
/// use metriplectic_fields::Real;
/// use metriplectic_integrators::{Method, Radau, Span};
/// use metriplectic_manifolds::Euclidean;
/// use nalgebra::Vector2;
/// # fn main() -> Result<(), metriplectic_integrators::Error> {
/// // Two bodies, the second with twice the heat capacity, exchange heat in nanoseconds.
/// type Temperatures = Vector2<Real>;
/// let bodies = System::on(Euclidean::<2>)
///     .energy(|t: &Temperatures| t.x + t.y * 2.0)
///     .entropy(|t: &Temperatures| t.x.ln() + t.y.ln() * 2.0)
///     .dissipation(FieldDissipation(|t: &Temperatures, w: &Temperatures| {
///         let b = Vector2::new(w.y, -w.x);
///         b * b.transpose() * (t.x * t.y * 1e8)
///     }))
///     .build()?;
/// # use num_dual::DualNum;
/// let run = Radau::<3>.run(&bodies, Vector2::new(300.0, 360.0), Span::steps(1.0, 10))?;
/// assert!((run.last().point.x - 340.0).abs() < 1e-6);
/// assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Radau<const S: usize>;

macro_rules! method {
    ($name:ident, $tableaux:expr, $first:literal, $last:literal, $splits:literal) => {
        impl<const S: usize> $name<S> {
            /// The first part of a step that is not solved is at least `2^{-SPLITS}` of it.
            pub(crate) const SPLITS: usize = $splits;

            pub(crate) const IS_A_METHOD: () = assert!(
                S >= $first && S <= $last,
                concat!(stringify!($name), " has ", $first, " to ", $last, " stages")
            );

            pub(crate) fn tableau() -> &'static Tableau {
                let () = Self::IS_A_METHOD;
                &$tableaux[S - $first]
            }
        }
    };
}

method!(Gauss, GAUSS, 1, 4, 10);
// Down to the inverse of round-off: the time in which the fastest friction acts.
method!(Radau, RADAU, 2, 4, 60);

/// The defect of the polynomial of a step is `O(h^{s+1})`, and its end is of order `p`: held to `τ^{(s+1)/p}`, the
/// error of a run is proportional to the tolerance `τ`.
pub(crate) fn control(tableau: &Tableau) -> Control {
    let local = tableau.stages as f64 + 1.0;
    Control {
        power: local / f64::from(tableau.order),
        alpha: 0.7 / local,
        beta: 0.4 / local,
        rejected: 1.0 / local,
        ratios: [0.2, 3.0],
    }
}
