//! Steps of a size that follows the motion.
//!
//! Both laws hold in each step, whatever its size, so that a sequence of steps of different sizes
//! keeps them too: adaptivity costs no structure. What it needs is an estimate of the error of a
//! step, and a rule for the next size.
//!
//! # The estimate
//!
//! With `f = Π dH + K dS` in the chart at `x`, a step `x → x'` of size `h` with coordinates `q` of
//! its end is compared with the formula of Lobatto of order 4 (Simpson's rule), whose middle point
//! is that of the cubic of Hermite through both ends,
//!
//! ```math
//! e = q - \tfrac h6 \bigl( f(0) + 4 f(q_m) + f(q) \bigr), \qquad
//! q_m = \tfrac12 q - \tfrac h8 \bigl( f(q) - f(0) \bigr) .
//! ```
//!
//! It is an asymptotic estimate: the formula holds up to `O(h⁵)` for the exact flow, and replacing
//! its end by `q`, which is off by the local error `ℓ = O(h³)`, changes the right side by
//! `(h/6)(f'(q) + 4f'(q_m)/2 + …)ℓ = O(h⁴)`; so `e = ℓ + O(h⁴)`, for every scheme, discrete gradient and
//! dissipation of this crate, whatever its order. It costs three evaluations of the equation of motion and
//! no equation to solve. Two other estimates were considered: a step of twice the size beside two steps
//! (Richardson) costs half of a solve more in each step; the difference to the extrapolated
//! displacements costs nothing, but tends to `h³x'''/12`, and the local error of the midpoint rule,
//! `h³(f''(f, f)/24 − f'f'f/12)`, is no multiple of that.
//!
//! Where a motion is stiff, `|h f'| ≫ 1`, the estimate is too large by a factor of the size
//! `|h f'|/6`: steps are then smaller than the tolerance asks for, never larger.
//!
//! # The tolerance
//!
//! A step is accepted if the error of each entry is small against the size of this entry:
//!
//! ```math
//! r = \Bigl( \sum_i \bigl(e_i/(\tau^{3/2} s_i + a_i)\bigr)^2 \Bigr)^{1/2} \le 1 .
//! ```
//!
//! `τ` is the tolerance, and `s_i` the largest `|x_i|` of the run so far, or what an entry reaches soon that
//! starts at zero ([`Manifold::scales`](metriplectic_manifolds::Manifold::scales), [`Until::scale`]); `a_i` is zero unless you say otherwise
//! ([`Until::absolute`]). The round-off of the estimate is allowed too. No unit enters: entries of 10⁻⁹ and of 300 are followed equally well, and the same
//! problem in other units takes the same steps. On a curved factor, whose frame is arbitrary, all directions
//! have one size, and the Euclidean norm is the same in each frame.
//!
//! A local error of `τ^{3/2}` belongs to steps `h ∝ τ^{1/2}`, and these to an error `∝ h² ∝ τ` at
//! the end of a run: with this exponent a tenth of the tolerance is a tenth of the error, and `τ` is
//! about the error that a run collects while the state moves by its own size (Söderlind, Wang 2006, on the
//! calibration of tolerances).
//!
//! # The controller
//!
//! With `r` in this step and `r₋` in the one before, the next step is
//!
//! ```math
//! h_+ = h \, \min\bigl(5, \max(\tfrac15, \; 0.9\, r^{-0.7/3}\, r_-^{0.4/3}) \bigr) ,
//! ```
//!
//! the PI controller of Gustafsson (1991) with the constants of Hairer, Wanner (Solving ODEs II,
//! §IV.2). A step with `r > 1` is rejected and tried again with `0.9 r^{−1/3}` of its size, a
//! step that Newton's method does not solve, or that leaves the domain, with a quarter; after a
//! rejection the step does not grow. The last step is shortened so that the run ends at the time that was
//! asked for, to the last bit. The first step is that of Hairer, Nørsett, Wanner (Solving ODEs I, §II.4),
//! with the sizes of the entries in place of their absolute numbers.

use crate::method::{Control, Element, Flow, Vector};
use crate::run::scales::{Scales, relative};
use crate::run::span::{Schedule, Size, Span, SpanError, check_end, check_step_size};
use crate::run::watch::Requests;

/// A run to a time, in steps that follow a tolerance; made by [`Span::until`].
///
/// ```
/// use metriplectic_integrators::Span;
/// // To t = 50, with an error of about 10⁻⁶ in each turn of the motion; every tenth state is recorded.
/// let span = Span::until(50.0).tolerance(1e-6).every(10);
/// // From t = 20; or less, if the motion comes to rest.
/// let span = span.starting_at(20.0).until_rest(1e-9);
/// // A displacement that starts at zero, and whose usual size is 10⁻⁹, beside two other entries.
/// let span = span.scale([1e-9, 0.0, 0.0]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Until<const N: usize = 0> {
    pub(crate) start: f64,
    end: f64,
    tolerance: f64,
    first: Option<f64>,
    least: Option<f64>,
    largest: Option<f64>,
    pub(crate) every: usize,
    pub(crate) most: Option<usize>,
    pub(crate) rest: Option<f64>,
    entries: Entries<[f64; N]>,
}

/// What is known of the errors of the entries, one number for each direction of the chart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Entries<V> {
    /// Nothing: errors are relative to the sizes that the entries have.
    Automatic,
    /// The sizes of some entries; zero for an automatic one.
    Scale(V),
    /// Errors that are allowed in addition.
    Absolute(V),
}

/// The tolerance without another one.
const TOLERANCE: f64 = 1e-6;
/// The least error `τ^p` of a step, with the power of its [`Control`]: some units of round-off. So the least
/// tolerance is 10⁻¹⁰ for order 2, and this for a method that holds errors to the tolerance itself.
const LEAST_LOCAL: f64 = 1e-15;

impl Span {
    /// From `t = 0` to `t = end`, in steps that follow a [tolerance](Until::tolerance) of 10⁻⁶ or
    /// another one. Both laws hold in each of them, as in steps of one size. The last one ends at
    /// `end`, to the last bit.
    ///
    /// ```
    /// use metriplectic_dynamics::{AreaForm, System};
    /// use metriplectic_fields::Real;
    /// use metriplectic_integrators::{Run, Span};
    /// use metriplectic_manifolds::{Sphere, WeylMidpoint};
    /// use nalgebra::Vector3;
    ///
    /// # fn main() -> Result<(), metriplectic_integrators::Error> {
    /// let top = System::on(Sphere::<2>::round())
    ///     .bracket(AreaForm)
    ///     .energy(|x: &Vector3<Real>| x.component_mul(x).dot(&Vector3::new(1.0, 2.0, 3.0).cast()))
    ///     .build()?;
    /// let span = Span::until(10.0).tolerance(1e-5);
    /// let run = WeylMidpoint.run(&top, Vector3::new(0.6, 0.0, 0.8), span)?;
    /// assert!(run.last().time == 10.0 && run.certificate().keeps_energy());
    /// # Ok(())
    /// # }
    /// ```
    pub const fn until(end: f64) -> Until {
        let (first, least, largest, most, rest) = (None, None, None, None, None);
        let (start, every, entries) = (0.0, 1, Entries::Automatic);
        let tolerance = TOLERANCE;
        Until { start, end, tolerance, first, least, largest, every, most, rest, entries }
    }
}

impl Until {
    /// The sizes of the entries that their errors are relative to, one for each direction of the chart, in
    /// the units of the entries. Zero stands for the automatic size: the largest one of the run so far.
    ///
    /// Say the size of an entry that starts at zero and moves late, or of one whose changes matter and are
    /// far smaller than the entry: heights of metres beside an earth's radius.
    #[must_use]
    pub const fn scale<const N: usize>(self, sizes: [f64; N]) -> Until<N> {
        self.with(Entries::Scale(sizes))
    }

    /// The error of each entry that is allowed in a step, in addition to `τ^{3/2}` of its size: one for
    /// each direction of the chart, in the units of the entries.
    #[must_use]
    pub const fn absolute<const N: usize>(self, errors: [f64; N]) -> Until<N> {
        self.with(Entries::Absolute(errors))
    }

    const fn with<const N: usize>(self, entries: Entries<[f64; N]>) -> Until<N> {
        let Self { start, end, tolerance, first, least, largest, every, most, rest, .. } = self;
        Until { start, end, tolerance, first, least, largest, every, most, rest, entries }
    }
}

impl<const N: usize> Until<N> {
    /// About the error, relative to the sizes of the entries, that the run collects while its state
    /// moves by its own size; the error at the end is proportional to it. At least 10⁻¹⁰ for
    /// methods of order 2, and 10⁻¹⁵ for the explicit methods.
    #[must_use]
    pub const fn tolerance(self, tolerance: f64) -> Self {
        Self { tolerance, ..self }
    }

    /// The time at which the run starts, 0 without another one.
    #[must_use]
    pub const fn starting_at(self, start: f64) -> Self {
        Self { start, ..self }
    }

    /// The first step to try, instead of the automatic one.
    #[must_use]
    pub const fn first_step(self, h: f64) -> Self {
        Self { first: Some(h), ..self }
    }

    /// The step size below which the run ends in an error; `16 ε max(|start|, |end|)` without another one.
    #[must_use]
    pub const fn least_step(self, h: f64) -> Self {
        Self { least: Some(h), ..self }
    }

    /// The largest step to take.
    #[must_use]
    pub const fn largest_step(self, h: f64) -> Self {
        Self { largest: Some(h), ..self }
    }

    /// Records the start and every `every`-th state after it, and always the last.
    #[must_use]
    pub const fn every(self, every: usize) -> Self {
        Self { every, ..self }
    }

    /// Records at most `states` states: whenever there are more, every second one is given up, and from
    /// then on half as many are recorded. The start and the last state are always recorded, so two are the
    /// fewest.
    ///
    /// ```
    /// # use metriplectic_dynamics::System;
    /// # use metriplectic_fields::Real;
    /// # use metriplectic_integrators::{Run, Span};
    /// # use metriplectic_manifolds::{LieDual, WeylMidpoint};
    /// # use nalgebra::Vector3;
    /// # fn main() -> Result<(), metriplectic_integrators::Error> {
    /// # let body = System::on(LieDual::so3())
    /// #     .energy(|p: &Vector3<Real>| p.x * p.x * 0.5 + p.y * p.y + p.z * p.z * 1.5)
    /// #     .build()?;
    /// let span = Span::until(50.0).tolerance(1e-5).at_most(100);
    /// let run = WeylMidpoint.run(&body, Vector3::new(0.4, 0.5, 0.3), span)?;
    /// assert!(run.certificate().steps > 1000);
    /// assert!((50..=100).contains(&run.states().len()) && run.last().time == 50.0);
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub const fn at_most(self, states: usize) -> Self {
        Self { most: Some(if states > 2 { states } else { 2 }), ..self }
    }

    /// Ends the run as soon as the state is at rest, see [`Ending::Rest`](crate::Ending::Rest).
    #[must_use]
    pub const fn until_rest(self, tolerance: f64) -> Self {
        Self { rest: Some(tolerance), ..self }
    }
}

impl<const N: usize> From<Until<N>> for Schedule {
    fn from(until: Until<N>) -> Self {
        let Until { start, end, tolerance, first, least, largest, every, most, rest, entries } =
            until;
        let entries = match entries {
            Entries::Automatic => Entries::Automatic,
            Entries::Scale(sizes) => Entries::Scale(sizes.into()),
            Entries::Absolute(errors) => Entries::Absolute(errors.into()),
        };
        let size = Size::Tolerance(Adaptive { end, tolerance, first, least, largest, entries });
        Self { size, start, count: None, every, most, rest, watch: Requests::default() }
    }
}

/// What a course says of steps that follow a tolerance.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Adaptive {
    end: f64,
    tolerance: f64,
    first: Option<f64>,
    least: Option<f64>,
    largest: Option<f64>,
    entries: Entries<Box<[f64]>>,
}

impl Adaptive {
    pub(crate) const fn end(&self) -> f64 {
        self.end
    }

    pub(crate) fn check(&self, start: f64) -> Result<(), SpanError> {
        let Self { end, tolerance, .. } = *self;
        check_end(start, end)?;
        if !(tolerance > 0.0 && tolerance.is_finite()) {
            return Err(SpanError::Tolerance { tolerance, least: LEAST_LOCAL });
        }
        for h in [self.first, self.least, self.largest].into_iter().flatten() {
            check_step_size(h)?;
        }
        if let (Some(least), Some(largest)) = (self.least, self.largest)
            && least > largest
        {
            return Err(SpanError::StepSizes { least, largest });
        }
        Ok(())
    }

    /// The numbers for the entries of a point with `expected` directions.
    fn entries<V: Vector>(&self, like: &V) -> Result<Entries<V>, SpanError> {
        let vector = |list: &[f64]| {
            if list.len() != like.len() {
                return Err(SpanError::Entries { found: list.len(), expected: like.len() });
            }
            let bad = list.iter().position(|x| !(*x >= 0.0 && x.is_finite()));
            match bad {
                Some(index) => Err(SpanError::Entry { index, value: list[index] }),
                None => Ok(like.with(|i| list[i])),
            }
        };
        Ok(match &self.entries {
            Entries::Automatic => Entries::Automatic,
            Entries::Scale(list) => Entries::Scale(vector(list)?),
            Entries::Absolute(list) => Entries::Absolute(vector(list)?),
        })
    }

    /// The controller of a run from `x` by a method of this order, with entries of these sizes.
    pub(crate) fn controller<F: Flow>(
        &self,
        flow: &F,
        (x, start): (&Element<F>, f64),
        scales: &Scales<F::Vector>,
        (order, control): (u32, Control),
    ) -> Result<Controller<F::Vector>, SpanError> {
        let least = 10_f64.powf(LEAST_LOCAL.log10() / control.power);
        if self.tolerance < least {
            return Err(SpanError::Tolerance { tolerance: self.tolerance, least });
        }
        let mut controller = Controller {
            order,
            control,
            start,
            end: self.end,
            tolerance: self.tolerance,
            entries: self.entries(&scales.sizes)?,
            least: self.least,
            largest: self.largest,
            next: 0.0,
            taken: None,
            error: None,
            rejected: false,
            cap: None,
        };
        let first = self.first.unwrap_or_else(|| controller.first_step(flow, x, scales));
        controller.next = controller.within(first);
        Ok(controller)
    }
}

/// How large the steps of a run are.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum StepSize<V> {
    /// All of one size.
    Fixed(f64),
    /// As the tolerance says.
    Adaptive(Controller<V>),
}

/// Says how large the next step is, from the errors of those before it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Controller<V> {
    /// The order of the method.
    pub(crate) order: u32,
    /// Its rule.
    pub(crate) control: Control,
    /// When the run starts.
    pub(crate) start: f64,
    pub(crate) end: f64,
    pub(crate) tolerance: f64,
    pub(crate) entries: Entries<V>,
    pub(crate) least: Option<f64>,
    pub(crate) largest: Option<f64>,
    /// The size to try next.
    pub(crate) next: f64,
    /// The size of the step taken last.
    pub(crate) taken: Option<f64>,
    /// Its error in units of the one allowed.
    pub(crate) error: Option<f64>,
    /// Whether the last try was rejected.
    pub(crate) rejected: bool,
    /// What the second law says of the size.
    pub(crate) cap: Option<Cap>,
}

/// A bound of the step size after a step on which the entropy would have fallen.
///
/// Near an equilibrium a step of an explicit method lets the entropy fall exactly where it is larger than the
/// method's region of stability. The error says nothing of that, and would let the steps grow again at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cap {
    /// The largest size.
    pub(crate) size: f64,
    /// The size at which the tries in a row began.
    pub(crate) before: f64,
    /// Steps taken since.
    pub(crate) steps: u32,
}

impl Cap {
    /// Steps after which the bound is raised.
    const PATIENCE: u32 = 20;
    /// The ratio by which it is raised in each step after those.
    const RAISED: f64 = 1.3;
    /// The ratio of a step on which the entropy would have fallen.
    const REDUCED: f64 = 0.7;
    /// The ratio to the size before the tries after a step that was held.
    const HELD: f64 = 1.5;
}

/// Of the size at which the error would be the one allowed.
const SAFETY: f64 = 0.9;
/// The ratio after a step that was not solved.
const UNSOLVED: f64 = 0.25;
/// The least error that the controller remembers: a step without any is no reason to be bold later.
const LEAST_ERROR: f64 = 1e-4;

/// Whether an exponent is this one.
const fn is(exponent: f64, this: f64) -> bool {
    (exponent - this).abs() < f64::EPSILON
}

/// `x^{-α}`, for order 8 by three square roots.
fn inverse_root(x: f64, alpha: f64) -> f64 {
    if is(alpha, 0.125) { x.sqrt().sqrt().sqrt().recip() } else { x.powf(-alpha) }
}

impl<V: Vector> Controller<V> {
    /// The order of the local error.
    fn local_order(&self) -> f64 {
        f64::from(self.order + 1)
    }

    /// The step size below which the run ends in an error.
    pub(crate) fn least(&self) -> f64 {
        self.least.unwrap_or(16.0 * f64::EPSILON * self.start.abs().max(self.end.abs()))
    }

    /// A step size within the bounds.
    fn within(&self, h: f64) -> f64 {
        let least = self.least();
        h.clamp(least, self.largest.unwrap_or(self.end - self.start).max(least))
    }

    /// The size of the step to try from time `t`, so that `t + h` has no round-off, and whether it
    /// is the last one.
    pub(crate) fn attempt(&self, t: f64) -> (f64, bool) {
        let (h, left) = (self.next, self.end - t);
        if left <= 1.01 * h {
            (left, true)
        } else if left < 2.0 * h {
            // Rather two steps of one size than one that is cut to a sliver.
            ((t + 0.5 * left) - t, false)
        } else {
            let end = t + h;
            // A step that was rejected must be tried with a smaller size, not with one rounded up to it.
            let end = if self.rejected && end - t > h { end.next_down() } else { end };
            (end - t, false)
        }
    }

    /// A step of size `h` was taken.
    pub(crate) fn accept(&mut self, h: f64, error: f64) {
        let Control { alpha, beta, ratios: [least, largest], .. } = self.control;
        let proportional = match self.error {
            Some(before) if beta != 0.0 => before.powf(beta),
            _ => 1.0,
        };
        let ratio = SAFETY * inverse_root(error, alpha) * proportional;
        let most = if self.rejected { 1.0 } else { largest };
        let mut next = h * ratio.clamp(least, most);
        self.cap = self.cap.filter(|_| ratio >= 1.0).map(|cap| {
            let raised = if cap.steps >= Cap::PATIENCE { Cap::RAISED } else { 1.0 };
            Cap { size: cap.size * raised, before: 0.0, steps: cap.steps.saturating_add(1) }
        });
        if let Some(cap) = self.cap {
            next = next.min(cap.size);
        }
        self.next = self.within(next);
        self.taken = Some(h);
        self.error = Some(error.max(LEAST_ERROR));
        self.rejected = false;
    }

    /// A step of size `h` was taken that leaves the state where it is, because no smaller one moves it.
    pub(crate) fn accept_held(&mut self, h: f64) {
        let before = self.cap.map_or(h, |cap| cap.before.max(h));
        self.next = self.within(Cap::HELD * before);
        self.taken = Some(h);
        self.rejected = false;
        self.cap = None;
    }

    /// The entropy would have fallen on a step of size `h`.
    pub(crate) fn reject_fall(&mut self, h: f64) {
        let before = self.cap.map_or(h, |cap| cap.before.max(h));
        self.next = Cap::REDUCED * h;
        self.cap = Some(Cap { size: self.next, before, steps: 0 });
        self.rejected = true;
    }

    /// A step of size `h` was not taken, with this error or because it was not solved.
    pub(crate) fn reject(&mut self, h: f64, error: Option<f64>) {
        let Control { rejected, ratios: [least, _], .. } = self.control;
        let ratio =
            error.map_or(UNSOLVED, |error| (SAFETY * error.powf(-rejected)).clamp(least, SAFETY));
        self.next = h * ratio;
        self.rejected = true;
    }

    /// The error `τ^{(p+1)/p} s_i + a_i` that is allowed in a step of size `h`, entry by entry, and what
    /// rounding may make of the estimate.
    pub(crate) fn allowed(&self, scales: &Scales<V>, h: f64) -> V {
        let power = self.control.power;
        let tolerance = if is(power, 1.0) { self.tolerance } else { self.tolerance.powf(power) };
        let tolerance = tolerance.max(8.0 * f64::EPSILON);
        let noise = scales.rounding(h);
        let sizes = &scales.sizes;
        match &self.entries {
            Entries::Automatic => V::zip([sizes, &noise], |[size, noise]| tolerance * size + noise),
            Entries::Scale(known) => V::zip([sizes, &noise, known], |[size, noise, known]| {
                tolerance * if known > 0.0 { known } else { size } + noise
            }),
            Entries::Absolute(errors) => V::zip([sizes, &noise, errors], |[size, noise, error]| {
                tolerance * size + error + noise
            }),
        }
    }

    /// The first step, after Hairer, Nørsett, Wanner (Solving ODEs I, §II.4): a short step of Euler's
    /// method gives the rate `ω = |f'f|/|f|` of the motion, and `h^{p+1}ω^p|f|` is to be a hundredth of the
    /// error allowed, all in units of it.
    fn first_step<F: Flow<Vector = V>>(&self, flow: &F, x: &Element<F>, scales: &Scales<V>) -> f64 {
        let (span, allowed) = (self.end - self.start, self.allowed(scales, 0.0));
        let h = flow.rates(x, &scales.sizes.zero()).and_then(|v| {
            let own_time = scales.speed(&v).recip().min(span);
            let euler = 0.01 * own_time;
            let there = flow.rates(x, &v.map(|v| v * euler))?;
            let change = V::zip([&there, &v], |[there, v]| there - v);
            // h = T (0.01 / (|Tf| (ωT)^p))^{1/(p+1)}, with |f| (ωT)² = |100² Δf|²/|f| for Δf over T/100.
            let (speed, bend) = (relative(&v, &allowed), 100.0 * relative(&change, &allowed));
            let error = own_time * speed * (bend / speed).powi(self.order.cast_signed());
            Some(own_time * self.local_root(0.01 / error).min(1.0))
        });
        h.filter(|h| *h > 0.0).unwrap_or(1e-3 * span)
    }

    /// The root of the order of the local error.
    fn local_root(&self, x: f64) -> f64 {
        if self.order == 2 { x.cbrt() } else { x.powf(self.local_order().recip()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;
    use metriplectic_dynamics::{AreaForm, Metriplectic, Nambu, System, system::Point};
    use metriplectic_fields::{Column as _, Real, Space as _};
    use metriplectic_manifolds::{Exponential, Retraction, Rotations, Sphere, WeylMidpoint};
    use nalgebra::{Matrix3, Vector3};
    use num_dual::DualNum;

    /// How far the estimate is off the local error, relative to it; that is found by 200 steps.
    fn off<Y, R>(retraction: R, system: &Y, x: &Point<Y>, h: f64) -> f64
    where
        Y: Metriplectic,
        R: Run + Retraction<Y::Manifold, Y::Metric>,
        WeylMidpoint: Retraction<Y::Manifold, Y::Metric>,
    {
        let end =
            retraction.run(system, x.clone(), Span::steps(h, 1)).unwrap().last().point.clone();
        let fine = WeylMidpoint.run(system, x.clone(), Span::steps(h / 200.0, 200)).unwrap();
        let at = |y| Y::Manifold::coordinates(x, y);
        let exact = at(&end) - at(&fine.last().point);
        let estimate = system.local_error(x, &end, h).unwrap().0;
        (estimate - exact).magnitude() / exact.magnitude()
    }

    #[test]
    fn the_estimate_tends_to_the_local_error() {
        let top = System::on(Sphere::<2>::round())
            .bracket(AreaForm)
            .energy(|x: &Vector3<Real>| x.x.powi(2) * 0.5 + x.y.powi(3) * 0.4 + x.z * x.x)
            .build()
            .unwrap();
        let start = Vector3::new(0.48, 0.6, 0.64);
        let group = System::on(Rotations::bi_invariant())
            .bracket(Nambu::default())
            .energy(|r: &Matrix3<Real>| r.m11 + r.m22 * 2.0 + r.m33 * 3.0 + r.m12 * r.m23 * 0.5)
            .entropy(|r: &Matrix3<Real>| r.m13 - r.m21 * 0.5 + (r.m31 + r.m32).powi(2) * 0.25)
            .build()
            .unwrap();
        let turned = Rotations::bi_invariant().from_quaternion([0.8, 0.3, -0.4, 0.33]).unwrap();
        let steps = [0.1, 0.05, 0.025];
        for (name, off) in [
            ("S²", steps.map(|h| off(WeylMidpoint, &top, &start, h))),
            ("S², based at the start", steps.map(|h| off(Exponential, &top, &start, h))),
            ("SO(3)", steps.map(|h| off(WeylMidpoint, &group, &turned, 0.03 * h))),
        ] {
            println!("{name}: {off:.4?}");
            // Of order one: the estimate is the local error, and no multiple of it.
            assert!(off[2] < 0.05, "{name}: {off:?}");
            assert!(off[2] < 0.6 * off[1] && off[1] < 0.6 * off[0], "{name}: {off:?}");
        }
    }

    #[test]
    fn the_controller_stays_within_its_bounds() {
        let mut controller = Controller::<Vec<f64>> {
            order: 2,
            control: Control::of_order(2),
            start: 0.0,
            end: 10.0,
            tolerance: 1e-4,
            entries: Entries::Automatic,
            least: Some(1e-6),
            largest: Some(2.0),
            next: 1.0,
            taken: None,
            error: None,
            rejected: false,
            cap: None,
        };
        controller.accept(1.0, 0.0);
        assert!((controller.next - 2.0).abs() < 1e-15);
        controller.reject(1.0, Some(1e9));
        assert!((controller.next - 0.2).abs() < 1e-15);
        controller.accept(0.2, 0.0);
        // Not larger right after a rejection.
        assert!((controller.next - 0.2).abs() < 1e-15);
        controller.reject(0.2, None);
        assert!((controller.next - 0.05).abs() < 1e-15);
        // The last steps: one, if it is nearly as long; two of one size, if it would be cut.
        controller.next = 1.0;
        assert_eq!(controller.attempt(9.0), (1.0, true));
        assert_eq!(controller.attempt(8.5), (0.75, false));
        assert_eq!(controller.attempt(2.0), (1.0, false));
    }
}
