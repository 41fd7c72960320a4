//! The attitude of a body along a run of its angular momentum.
//!
//! A run on so(3)* knows the momentum `p` in the frame of the body and not where the body points. Its
//! attitude follows by the equation of reconstruction (Marsden and Ratiu 1999, §13.5),
//!
//! ```math
//! R' = R\, \hat\Omega, \qquad \Omega = dH(p) .
//! ```
//!
//! A step of the run is `p' − p = h(z × w + K_w dS)`, with the midpoint `z` and the discrete gradient
//! `w` of `H`. The cross product alone is a rotation, `p' = cay(hw)ᵀ p`, so the body momentum `cay(hw) p'`
//! is what the dissipation has made of `p`, and `R'p' = R cay(hw) p'` is the balance of the momentum in
//! space. Two rotations compete for the step:
//!
//! - `cay(hw)` keeps this balance to round-off, but it turns by `2 atan(h|w|/2)` instead of `h|w|`: a body
//!   that spins about an axis falls behind by the fraction `h²|w|²/12`;
//! - `exp(hw)` is exact for that body, but it moves the momentum in space by `O(h²)`.
//!
//! So the step is the exponential, and then the smallest rotation `exp(τ)` that restores the balance:
//!
//! ```math
//! R_{k+1} = R_k \exp(\hat\tau) \exp(h \hat w), \qquad
//! \exp(\hat\tau) \exp(h \hat w)\, p_{k+1} = \mathrm{cay}(hw)\, p_{k+1} .
//! ```
//!
//! `|τ| = O(h³)`, so the order is 2. The balance is kept as a sum `ℓ` in space, to which each step adds
//! `R_k (cay(hw) p_{k+1} − p_k)`, what the dissipation has done, and `R_{k+1} p_{k+1}` is turned to `ℓ`: the
//! rounding of the rotations does not add up to a drift.
//!
//! Of a free body `R p` is constant to round-off, and `τ = 0` for one that spins about a principal axis.
//! With the discrete gradient instead of `dH(z)` this holds for every energy, quadratic or not: `w` is that
//! of a run by [`Gonzalez`](crate::Gonzalez), the default, with a metric that does not vary. For other
//! runs the attitude is of order 2, and so is the momentum.

use metriplectic_dynamics::Metriplectic;
use metriplectic_fields::{ChartPoint, ScalarField, Space};
use metriplectic_manifolds::{
    Canonical, LieDual, Manifold, MetricError, PointError, Retraction, Riemannian, Rotations,
    WeylMidpoint, rotations,
};
use nalgebra::{Matrix3, Vector3};

use crate::round_off::stable_gradient::{Segment, StableGradient};
use crate::run::event::Event;
use crate::run::state::State;
use crate::run::trajectory::Trajectory;

/// The attitude `R(t)` of a body, a rotation from its frame to space, along a run on so(3)*; see the
/// [module](mod@crate::attitude).
///
/// Every matrix is orthogonal to round-off, after a million steps as after the first.
///
/// ```
/// use metriplectic_dynamics::System;
/// use metriplectic_fields::Real;
/// use metriplectic_integrators::{Attitude, Run, Span};
/// use metriplectic_manifolds::{LieDual, WeylMidpoint};
/// use nalgebra::{Matrix3, Vector3};
///
/// let body = System::on(LieDual::so3())
///     .energy(|p: &Vector3<Real>| (p.x * p.x + p.y * p.y / 2.0 + p.z * p.z / 3.0) * 0.5)
///     .build()?;
/// let run = WeylMidpoint.run(&body, Vector3::new(1.0, 0.3, 0.8), Span::steps(0.1, 100))?;
/// let attitudes = Attitude::along(&body, &run, Matrix3::identity())?;
/// let in_space = attitudes[100] * run.last().point;
/// assert!((in_space - run.states()[0].point).norm() < 1e-13);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Attitude<'a, Y> {
    system: &'a Y,
    state: State<LieDual<3>>,
    rotation: Matrix3<f64>,
    /// The momentum `ℓ` in space.
    momentum: Vector3<f64>,
}

impl<'a, Y: Metriplectic<Manifold = LieDual<3>>> Attitude<'a, Y> {
    /// The attitude `r0` at a state of a run of `system`, its start for instance.
    ///
    /// # Errors
    ///
    /// [`AttitudeError::NotARotation`] if `r0` is none, [`AttitudeError::NotSo3`] if the state is no
    /// angular momentum.
    pub fn start(
        system: &'a Y,
        state: &State<LieDual<3>>,
        r0: Matrix3<f64>,
    ) -> Result<Self, AttitudeError> {
        Rotations.check(&r0).map_err(AttitudeError::NotARotation)?;
        if !turns_vectors(system.manifold()) {
            return Err(AttitudeError::NotSo3);
        }
        Ok(Self { system, state: state.clone(), rotation: r0, momentum: r0 * state.point })
    }

    /// The rotation from the frame of the body to space.
    pub const fn rotation(&self) -> &Matrix3<f64> {
        &self.rotation
    }

    /// The attitudes at the states of a run that has recorded each of its steps, from `r0` on. A kick at an
    /// [event](crate::Watched::jump) changes the momentum and not the attitude: the step that it cuts is followed in two parts.
    ///
    /// # Errors
    ///
    /// The errors of [`start`](Self::start) and [`advance`](Self::advance).
    pub fn along(
        system: &'a Y,
        run: &Trajectory<LieDual<3>>,
        r0: Matrix3<f64>,
    ) -> Result<Vec<Matrix3<f64>>, AttitudeError> {
        let mut attitude = Self::start(system, &run.states()[0], r0)?;
        let mut rotations = Vec::with_capacity(run.states().len());
        rotations.push(r0);
        let mut events = run.events().iter().peekable();
        for state in &run.states()[1..] {
            // A state at the time of an event may be the one before it.
            let is_over = |event: &Event<LieDual<3>>| {
                let State { time, point, .. } = &event.state;
                *time < state.time
                    || time.to_bits() == state.time.to_bits() && *point != state.point
            };
            while let Some(event) = events.next_if(|event| is_over(event)) {
                attitude.jump(event)?;
            }
            rotations.push(*attitude.advance(state)?);
        }
        Ok(rotations)
    }

    /// Follows the run to an event of its next step, and through the [jump](crate::Watched::jump) there. An event without a jump
    /// changes nothing.
    ///
    /// If you [advance](Self::advance) from step to step, hand over the events of each step before its state: a jump between two
    /// states is not seen from them.
    ///
    /// ```
    /// # use metriplectic_dynamics::System;
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_integrators::{Attitude, Run, Span, Watch};
    /// # use metriplectic_manifolds::{LieDual, WeylMidpoint};
    /// # use nalgebra::{Matrix3, Vector3, vector};
    /// # let body = System::on(LieDual::so3())
    /// #     .energy(|p: &Vector3<Real>| (p.x * p.x + p.y * p.y / 2.0 + p.z * p.z / 3.0) * 0.5)
    /// #     .build()?;
    /// let span = Span::steps(0.1, 30)
    ///     .event_in_time("kick", |t, _: &Vector3<f64>| t - 1.52)
    ///     .jump(|_, p: &Vector3<f64>| vector![p.x, p.y, p.z + 0.5]);
    /// let mut steps = WeylMidpoint.steps(&body, vector![1.0, 0.3, 0.8], span)?;
    /// let mut attitude = Attitude::start(&body, steps.state(), Matrix3::identity())?;
    /// while steps.ending().is_none() {
    ///     let next = steps.advance()?.clone();
    ///     for event in steps.take_events() {
    ///         attitude.jump(&event)?;
    ///     }
    ///     attitude.advance(&next)?;
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    ///
    /// The errors of [`advance`](Self::advance).
    pub fn jump(&mut self, event: &Event<LieDual<3>>) -> Result<(), AttitudeError> {
        let Some(jump) = &event.jump else { return Ok(()) };
        if event.state.time > self.state.time {
            self.follow(&event.state)?;
        }
        let kick: Vector3<f64> = jump.after.point - event.state.point;
        self.momentum += self.rotation * kick;
        self.state = jump.after.clone();
        Ok(())
    }

    /// Follows one step of the run to its next state: the form of [`along`](Self::along) in constant
    /// memory. Where the state may jump, [`jump`](Self::jump) comes before it.
    ///
    /// # Errors
    ///
    /// [`AttitudeError::Skipped`] if the state is not the next one, [`AttitudeError::Metric`] if the
    /// metric of the system cannot be used.
    pub fn advance(&mut self, next: &State<LieDual<3>>) -> Result<&Matrix3<f64>, AttitudeError> {
        let (from, to) = (self.state.step, next.step);
        // A jump may have led to it, and a run may end inside a step.
        if !(to == from || to == from + 1) {
            return Err(AttitudeError::Skipped { from, to });
        }
        // In a run back in time it is the earlier one.
        if (next.time - self.state.time).abs() > 0.0 {
            self.follow(next)?;
        }
        self.state = next.clone();
        Ok(&self.rotation)
    }

    /// Follows the motion to a state at another time.
    fn follow(&mut self, next: &State<LieDual<3>>) -> Result<(), AttitudeError> {
        let turn = self.velocity(next)? * step_size(&self.state, next);
        let (p, half) = (next.point, 0.5 * turn.norm());
        let slower = if half > 0.0 { half.atan() / half } else { 1.0 };
        self.momentum += self.rotation * (rotations::exp(&(turn * slower)) * p - self.state.point);
        let balance = self.rotation.tr_mul(&self.momentum);
        let tilt = smallest_rotation(&(rotations::exp(&turn) * p), &balance);
        self.rotation = Rotations::chart(&Rotations::chart(&self.rotation, &tilt), &turn);
        Ok(())
    }

    /// The discrete gradient `w` of the energy from the last state to the next one.
    fn velocity(&self, next: &State<LieDual<3>>) -> Result<Vector3<f64>, AttitudeError> {
        let (x, energy) = (&self.state.point, self.system.energy());
        let d = next.point - x;
        let z = x + d * 0.5;
        let nodes = WeylMidpoint.along(&Canonical, x, &d)?;
        let df = energy.jet1(&z).df;
        let (segment, values) = (Segment::new(&d, &next.point), [self.state.energy, next.energy]);
        let stable = StableGradient::new(energy, &df, &segment, values, || df.dot(&d), || nodes);
        let g = self.system.metric().at(&ChartPoint::<LieDual<3>>::centre(&z))?;
        Ok(stable.covector(0.0, &g, &d))
    }
}

/// The size of the step between two states. In steps of one size the quotient `t/n` is `h` to an `ε`, and
/// the difference of two late times is not; in others the difference is all there is.
fn step_size(from: &State<LieDual<3>>, to: &State<LieDual<3>>) -> f64 {
    let mean = to.time / to.step as f64;
    let off = (from.time - from.step as f64 * mean).abs();
    if off <= 4.0 * f64::EPSILON * to.time.abs() { mean } else { to.time - from.time }
}

/// Whether the bracket of the algebra is the cross product.
fn turns_vectors(space: &LieDual<3>) -> bool {
    let unit = |i: usize| Vector3::from_fn(|k, _| if k == i { 1.0 } else { 0.0 });
    (0..9).all(|k| {
        let (a, b) = (unit(k / 3), unit(k % 3));
        (space.algebra().bracket(&a, &b) - a.cross(&b)).amax() <= 8.0 * f64::EPSILON
    })
}

/// The vector of the smallest rotation that takes the direction of `a` to that of `b`; zero if it has no
/// axis.
fn smallest_rotation(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector3<f64> {
    let axis = a.cross(b);
    let sine = axis.norm();
    if sine > 0.0 { axis * (sine.atan2(a.dot(b)) / sine) } else { Vector3::zeros() }
}

/// Why there is no attitude.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AttitudeError {
    /// The initial attitude is not a rotation.
    #[error("the initial attitude is not a rotation: {0}")]
    NotARotation(#[source] PointError),
    /// The states are not angular momenta in the basis that rotations about the axes make.
    #[error(
        "the algebra of the run is not so(3) with [e_a, e_b] = ε_abc e_c, so its states do not turn a \
         body; run the system on `LieDual::so3()`"
    )]
    NotSo3,
    /// States between two recorded ones are missing.
    #[error(
        "the state after step {from} is followed by that after step {to}, and an attitude needs every \
         step: record them all, `Span::steps(..)` without `every`, or follow the iterator `.steps(..)`"
    )]
    Skipped {
        /// Steps taken at the last state.
        from: usize,
        /// Steps taken at the next one.
        to: usize,
    },
    /// The metric of the system cannot be used.
    #[error(transparent)]
    Metric(#[from] MetricError),
}

metriplectic_equations::debug_is_the_sentence!(AttitudeError);
