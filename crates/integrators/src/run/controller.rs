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
//! starts at zero ([`Manifold::scales`](metriplectic_manifolds::Manifold::scales), [`Until::scale`](crate::Until::scale)); `a_i` is zero unless you say otherwise
//! ([`Until::absolute`](crate::Until::absolute)). The round-off of the estimate is allowed too. No unit enters: entries of 10⁻⁹ and of 300 are followed equally well, and the same
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

use crate::step::scales::{relative, rounding};
use crate::step::{Control, Element, Flow, Scales, Stepper, Vector};

#[cfg(feature = "serde")]
use crate::step::exact;

/// How large the steps of a run are.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) enum StepSize<V> {
    /// All of one size.
    Fixed(#[cfg_attr(feature = "serde", serde(with = "exact"))] f64),
    /// As the tolerance says.
    Adaptive(Controller<V>),
}

impl<V> StepSize<V> {
    /// Converts the numbers of the entries to another form.
    pub(crate) fn convert<W, E>(
        &self,
        convert: impl FnOnce(&'static str, &V) -> Result<W, E>,
    ) -> Result<StepSize<W>, E> {
        Ok(match self {
            Self::Fixed(h) => StepSize::Fixed(*h),
            Self::Adaptive(Controller { pace, entries }) => {
                let entries = entries.convert(convert)?;
                StepSize::Adaptive(Controller { pace: *pace, entries })
            }
        })
    }
}

/// Says how large the next step is, from the errors of those before it.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Controller<V> {
    pub(crate) pace: Pace,
    pub(crate) entries: Entries<V>,
}

/// Sizes that the errors of the entries are relative to, one number for each direction of the chart.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) enum Entries<V> {
    /// Relative to the sizes that the entries have.
    Automatic,
    /// The sizes of some entries; zero for an automatic one.
    Scale(V),
    /// Errors that are allowed in addition.
    Absolute(V),
}

impl<V> Entries<V> {
    /// Converts the numbers to another form.
    pub(crate) fn convert<W, E>(
        &self,
        convert: impl FnOnce(&'static str, &V) -> Result<W, E>,
    ) -> Result<Entries<W>, E> {
        Ok(match self {
            Self::Automatic => Entries::Automatic,
            Self::Scale(sizes) => Entries::Scale(convert("sizes of entries", sizes)?),
            Self::Absolute(errors) => Entries::Absolute(convert("errors of entries", errors)?),
        })
    }
}

/// Rules of the method and of the start of a run for the size of its steps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rule {
    /// The order of the method.
    order: u32,
    control: Control,
    /// When the run starts.
    start: f64,
}

impl Rule {
    /// The rule of this method, in a run from this time.
    pub(crate) fn of<F: Flow + ?Sized, M: Stepper<F>>(method: &M, start: f64) -> Self {
        Self { order: method.order(), control: method.control(), start }
    }

    /// The tolerance that holds the error of a step to this one.
    pub(crate) fn tolerance_of(&self, error: f64) -> f64 {
        10_f64.powf(error.log10() / self.control.power)
    }

    /// The order of the local error.
    fn local_order(&self) -> f64 {
        f64::from(self.order + 1)
    }

    /// The root of the order of the local error.
    fn local_root(&self, x: f64) -> f64 {
        if self.order == 2 { x.cbrt() } else { x.powf(self.local_order().recip()) }
    }
}

/// The sizes of the steps: between which bounds, and what is known of the next one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub(crate) struct Pace {
    /// When the run ends.
    #[cfg_attr(feature = "serde", serde(with = "exact"))]
    pub(crate) end: f64,
    #[cfg_attr(feature = "serde", serde(with = "exact"))]
    pub(crate) tolerance: f64,
    #[cfg_attr(feature = "serde", serde(with = "exact"))]
    pub(crate) least: Option<f64>,
    #[cfg_attr(feature = "serde", serde(with = "exact"))]
    pub(crate) largest: Option<f64>,
    /// The size to try next.
    #[cfg_attr(feature = "serde", serde(with = "exact"))]
    pub(crate) next: f64,
    /// The size of the step taken last.
    #[cfg_attr(feature = "serde", serde(with = "exact"))]
    pub(crate) taken: Option<f64>,
    /// Its error in units of the one allowed.
    #[cfg_attr(feature = "serde", serde(with = "exact"))]
    pub(crate) error: Option<f64>,
    /// Whether the last try was rejected.
    pub(crate) rejected: bool,
    /// The bound of the size by the second law.
    pub(crate) cap: Option<Cap>,
    /// When the law of motion has jumped last, in a step that has left the state where it was.
    #[cfg_attr(feature = "serde", serde(default, with = "exact"))]
    pub(crate) jumped: Option<f64>,
}

/// A bound of the step size after a step on which the entropy would have fallen.
///
/// Near an equilibrium a step of an explicit method lets the entropy fall exactly where it is larger than the
/// method's region of stability. The error says nothing of that, and would let the steps grow again at once.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Cap {
    /// The largest size.
    #[cfg_attr(feature = "serde", serde(with = "exact"))]
    pub(crate) size: f64,
    /// The size at which the tries in a row began.
    #[cfg_attr(feature = "serde", serde(with = "exact"))]
    pub(crate) before: f64,
    /// Steps taken since.
    pub(crate) steps: u32,
}

impl Cap {
    /// Steps after which the bound is raised.
    /// A factor of four fails `run/controller/tests.rs::the_bound_after_a_fall_of_the_entropy_is_raised_slowly`.
    const PATIENCE: u32 = 20;
    /// The ratio by which it is raised in each step after those.
    /// A factor of four fails `run/controller/tests.rs::the_bound_after_a_fall_of_the_entropy_is_raised_slowly`.
    const RAISED: f64 = 1.3;
    /// The ratio of a step on which the entropy would have fallen.
    /// A factor of four fails `run/controller/tests.rs::the_bound_after_a_fall_of_the_entropy_is_raised_slowly`.
    const REDUCED: f64 = 0.7;
    /// The ratio to the size before the tries after a step that was held.
    /// A factor of four fails `run/controller/tests.rs::the_bound_after_a_fall_of_the_entropy_is_raised_slowly`.
    const HELD: f64 = 1.5;
}

/// Of the size at which the error would be the one allowed.
/// A factor of four fails `run/controller/tests.rs::a_step_with_the_error_that_is_allowed_is_followed_by_a_slightly_smaller_one`.
const SAFETY: f64 = 0.9;
/// The ratio after a step that was not solved.
/// A factor of four fails `run/controller/tests.rs::the_controller_stays_within_its_bounds`.
const UNSOLVED: f64 = 0.25;
/// The least error that the controller remembers: a step without any is no reason to be bold later.
/// A factor of four fails `run/controller/tests.rs::a_step_with_the_error_that_is_allowed_is_followed_by_a_slightly_smaller_one`.
const LEAST_ERROR: f64 = 1e-4;

/// The longest step of a system that takes the time, relative to the run, as long as nothing changes its motion.
/// A factor of four fails `tests/trust/from_rest.rs::a_pulse_is_seen_from_rest`.
const AT_REST: f64 = 0.01;
/// The length of a step in which the law of motion of a system that takes the time may jump, in units of the least step.
const INSTANT: f64 = 64.0;
/// How far two such steps are apart, in units of their length.
const APART: f64 = 1e3;
/// The first step of a system that takes the time, relative to the run, from a state at rest.
const FROM_REST: f64 = 1e-6;

/// Whether an exponent is this one.
const fn is(exponent: f64, this: f64) -> bool {
    (exponent - this).abs() < f64::EPSILON
}

/// `x^{-α}`, for order 8 by three square roots.
fn inverse_root(x: f64, alpha: f64) -> f64 {
    if is(alpha, 0.125) { x.sqrt().sqrt().sqrt().recip() } else { x.powf(-alpha) }
}

impl Pace {
    /// The error of a step relative to the sizes of the entries.
    pub(crate) fn relative_error(&self, rule: &Rule) -> f64 {
        let (power, tolerance) = (rule.control.power, self.tolerance);
        let relative = if is(power, 1.0) { tolerance } else { tolerance.powf(power) };
        relative.max(8.0 * f64::EPSILON)
    }

    /// The step size below which the run ends in an error.
    pub(crate) fn least(&self, rule: &Rule) -> f64 {
        self.least.unwrap_or(self.roundings(rule))
    }

    /// Some roundings of the times of the run.
    fn roundings(&self, rule: &Rule) -> f64 {
        16.0 * f64::EPSILON * rule.start.abs().max(self.end.abs())
    }

    /// Returns whether a step is so short that a time in it has few digits, and no such step was taken shortly before. A jump of
    /// the law of motion is found to within it. A motion that ends shrinks its steps again.
    pub(crate) fn may_jump(&self, rule: &Rule, t: f64, h: f64) -> bool {
        let instant = INSTANT * self.roundings(rule);
        h <= instant && self.jumped.is_none_or(|before| (t - before).abs() > APART * instant)
    }

    /// The law of motion has jumped in a step of size `h` from time `t`.
    pub(crate) fn jumped(&mut self, t: f64, h: f64) {
        self.jumped = Some(t);
        (self.taken, self.rejected, self.error) = (Some(h), false, None);
    }

    /// The longest step of a system that takes the time, as long as nothing changes its motion: a hundredth of the run.
    pub(crate) fn longest_at_rest(&self, rule: &Rule) -> f64 {
        AT_REST * (self.end - rule.start).abs()
    }

    /// A step size within the bounds.
    pub(crate) fn within(&self, rule: &Rule, h: f64) -> f64 {
        let least = self.least(rule);
        h.clamp(least, self.largest.unwrap_or((self.end - rule.start).abs()).max(least))
    }

    /// The size of the step to try from time `t` on the way to a later `end`, so that `t + h` has no round-off, and whether it
    /// is the last one.
    pub(crate) fn attempt(&self, t: f64, end: f64) -> (f64, bool) {
        let (h, left) = (self.next, end - t);
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
    pub(crate) fn accept(&mut self, rule: &Rule, h: f64, error: f64) {
        let Control { alpha, beta, ratios: [least, largest], .. } = rule.control;
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
        self.next = self.within(rule, next);
        self.taken = Some(h);
        self.error = Some(error.max(LEAST_ERROR));
        self.rejected = false;
    }

    /// A step of size `h` was taken that leaves the state where it is, because no smaller one moves it.
    pub(crate) fn accept_held(&mut self, rule: &Rule, h: f64) {
        let before = self.cap.map_or(h, |cap| cap.before.max(h));
        self.next = self.within(rule, Cap::HELD * before);
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
    pub(crate) fn reject(&mut self, rule: &Rule, h: f64, error: Option<f64>) {
        let Control { rejected, ratios: [least, _], .. } = rule.control;
        let ratio =
            error.map_or(UNSOLVED, |error| (SAFETY * error.powf(-rejected)).clamp(least, SAFETY));
        self.next = h * ratio;
        self.rejected = true;
    }
}

impl<V: Vector> Controller<V> {
    /// The error `τ^{(p+1)/p} s_i + a_i` that is allowed in a step of size `h`, entry by entry, and what
    /// rounding may make of the estimate.
    pub(crate) fn allowed(&self, rule: &Rule, scales: &Scales<V>, h: f64) -> V {
        self.allowed_at(self.pace.relative_error(rule), [&scales.sizes, &scales.terms], h)
    }

    /// The error that is allowed beside entries of these sizes, and of these terms, with the relative one.
    pub(crate) fn allowed_at(&self, relative: f64, [sizes, terms]: [&V; 2], h: f64) -> V {
        let noise = |terms: f64| rounding(terms, h);
        match &self.entries {
            Entries::Automatic => {
                V::zip([sizes, terms], |[size, terms]| relative * size + noise(terms))
            }
            Entries::Scale(known) => V::zip([sizes, terms, known], |[size, terms, known]| {
                relative * if known > 0.0 { known } else { size } + noise(terms)
            }),
            Entries::Absolute(errors) => V::zip([sizes, terms, errors], |[size, terms, error]| {
                relative * size + error + noise(terms)
            }),
        }
    }

    /// The sizes that errors are relative to: those of the run, or the ones that are known beforehand.
    pub(crate) fn judged_by(&self, sizes: &V) -> V {
        match &self.entries {
            Entries::Scale(known) => {
                V::zip([sizes, known], |[size, known]| if known > 0.0 { known } else { size })
            }
            Entries::Automatic | Entries::Absolute(_) => sizes.clone(),
        }
    }

    /// The first step, after Hairer, Nørsett, Wanner (Solving ODEs I, §II.4): a short step of Euler's
    /// method gives the rate `ω = |f'f|/|f|` of the motion, and `h^{p+1}ω^p|f|` is to be a hundredth of the
    /// error allowed, all in units of it.
    pub(crate) fn first_step<F: Flow<Vector = V> + ?Sized>(
        &self,
        rule: &Rule,
        flow: &F,
        x: &Element<F>,
        scales: &Scales<V>,
    ) -> f64 {
        let (span, allowed) = ((self.pace.end - rule.start).abs(), self.allowed(rule, scales, 0.0));
        let (in_time, longest) = (flow.depends_on_time(), self.pace.longest_at_rest(rule));
        let h = flow.rates(x, &scales.sizes.zero()).and_then(|v| {
            let own_time = scales.speed(&v).recip().min(span);
            let euler = 0.01 * own_time;
            let there = flow.rates(x, &v.map(|v| v * euler))?;
            let change = V::zip([&there, &v], |[there, v]| there - v);
            // h = T (0.01 / (|Tf| (ωT)^p))^{1/(p+1)}, with |f| (ωT)² = |100² Δf|²/|f| for Δf over T/100.
            let (speed, bend) = (relative(&v, &allowed), 100.0 * relative(&change, &allowed));
            let error = own_time * speed * (bend / speed).powi(rule.order.cast_signed());
            // Nothing bends the motion so far, and what the time will bring is not known.
            let bends = error > 0.0;
            if in_time && !bends {
                return (speed > 0.0).then_some(own_time.min(longest));
            }
            Some(own_time * rule.local_root(0.01 / error).min(1.0))
        });
        let at_rest = if in_time { FROM_REST } else { 1e-3 };
        h.filter(|h| *h > 0.0).unwrap_or(at_rest * span)
    }
}

#[cfg(test)]
mod tests;
