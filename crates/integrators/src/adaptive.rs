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
//! A step is accepted if `|e| ≤ τ^{3/2} max(|x|, 1)`, where `τ` is the tolerance, `|x|` the size of the
//! entries of the point ([`Manifold::magnitude`]) and `|e|` that of the velocity with the components
//! `e`. A local error of `τ^{3/2}` belongs to steps `h ∝ τ^{1/2}`, and these to an error `∝ h² ∝ τ` at
//! the end of a run: with this exponent a tenth of the tolerance is a tenth of the error, and `τ` is
//! about the error that a run collects while the state moves by its own size (Söderlind, Wang 2006, on the
//! calibration of tolerances).
//!
//! # The controller
//!
//! With `r = |e|/(τ^{3/2} max(|x|, 1))` in this step and `r₋` in the one before, the next step is
//!
//! ```math
//! h_+ = h \, \min\bigl(5, \max(\tfrac15, \; 0.9\, r^{-0.7/3}\, r_-^{0.4/3}) \bigr) ,
//! ```
//!
//! the PI controller of Gustafsson (1991) with the constants of Hairer, Wanner (Solving ODEs II,
//! §IV.2). A step with `r > 1` is rejected and tried again with `0.9 r^{−1/3}` of its size, a
//! step that Newton's method does not solve, or that leaves the domain, with a quarter; after a
//! rejection the step does not grow. The last step is shortened so that the run ends at the time that was
//! asked for, to the last bit. The first step is that of Hairer, Nørsett, Wanner (Solving ODEs I, §II.4).

use metriplectic_dynamics::{Metriplectic, system::Point};
use metriplectic_fields::{ChartPoint, Column, Dimension, Space, Vector};
use metriplectic_manifolds::Manifold;

use crate::span::{Course, Size, Span, SpanError, check_step_size};
use crate::step::Memory;

/// A run to a time, in steps that follow a tolerance; made by [`Span::until`].
///
/// ```
/// use metriplectic_integrators::Span;
/// // To t = 50, with an error of about 10⁻⁶ in each turn of the motion; every tenth state is recorded.
/// let span = Span::until(50.0).tolerance(1e-6).every(10);
/// // The same, or less if the motion comes to rest.
/// let span = span.until_rest(1e-9);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Until {
    end: f64,
    tolerance: f64,
    first: Option<f64>,
    least: Option<f64>,
    largest: Option<f64>,
    pub(crate) every: usize,
    pub(crate) rest: Option<f64>,
}

/// The tolerance without another one.
const TOLERANCE: f64 = 1e-6;
/// The least tolerance: `τ^{3/2}` is some units of round-off.
const LEAST_TOLERANCE: f64 = 1e-10;

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
        let (first, least, largest, rest) = (None, None, None, None);
        Until { end, tolerance: TOLERANCE, first, least, largest, every: 1, rest }
    }
}

impl Until {
    /// About the error, relative to `max(|x|, 1)`, that the run collects while its state moves by
    /// its own size; the error at the end is proportional to it. At least 10⁻¹⁰.
    #[must_use]
    pub const fn tolerance(self, tolerance: f64) -> Self {
        Self { tolerance, ..self }
    }

    /// The first step to try, instead of the automatic one.
    #[must_use]
    pub const fn first_step(self, h: f64) -> Self {
        Self { first: Some(h), ..self }
    }

    /// The step size below which the run ends in an error; `16 ε · end` without another one.
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

    /// Ends the run as soon as the state is at rest, see [`Ending::Rest`](crate::Ending::Rest).
    #[must_use]
    pub const fn until_rest(self, tolerance: f64) -> Self {
        Self { rest: Some(tolerance), ..self }
    }

    pub(crate) fn check(&self) -> Result<(), SpanError> {
        let Self { end, tolerance, .. } = *self;
        if !(end > 0.0 && end.is_finite()) {
            return Err(SpanError::End { end });
        }
        if !(tolerance >= LEAST_TOLERANCE && tolerance.is_finite()) {
            return Err(SpanError::Tolerance { tolerance, least: LEAST_TOLERANCE });
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

    /// The controller of a run from `x`.
    pub(crate) fn controller<Y: Metriplectic>(&self, system: &Y, x: &Point<Y>) -> Controller {
        let least = self.least.unwrap_or(16.0 * f64::EPSILON * self.end);
        let mut controller = Controller {
            end: self.end,
            tolerance: self.tolerance,
            least,
            largest: self.largest.unwrap_or(self.end).max(least),
            next: 0.0,
            taken: None,
            error: None,
            rejected: false,
        };
        let first = self.first.unwrap_or_else(|| controller.first_step(system, x));
        controller.next = first.clamp(least, controller.largest);
        controller
    }
}

impl From<Until> for Course {
    fn from(until: Until) -> Self {
        Self { size: Size::Tolerance(until), count: None, every: until.every, rest: until.rest }
    }
}

/// How large the steps of a run are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Pace {
    /// All of one size.
    Fixed(f64),
    /// As the tolerance says.
    Adaptive(Controller),
}

/// Says how large the next step is, from the errors of those before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Controller {
    pub(crate) end: f64,
    pub(crate) tolerance: f64,
    pub(crate) least: f64,
    pub(crate) largest: f64,
    /// The size to try next.
    pub(crate) next: f64,
    /// The size of the step taken last.
    pub(crate) taken: Option<f64>,
    /// Its error in units of the one allowed.
    pub(crate) error: Option<f64>,
    /// Whether the last try was rejected.
    pub(crate) rejected: bool,
}

/// Of the size at which the error would be the one allowed.
const SAFETY: f64 = 0.9;
/// The least ratio of two steps.
const LEAST_RATIO: f64 = 0.2;
/// The largest ratio of two steps.
const LARGEST_RATIO: f64 = 5.0;
/// The ratio after a step that was not solved.
const UNSOLVED: f64 = 0.25;
/// The least error that the controller remembers: a step without any is no reason to be bold later.
const LEAST_ERROR: f64 = 1e-4;

impl Controller {
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
            ((t + h) - t, false)
        }
    }

    /// A step of size `h` was taken.
    pub(crate) fn accept(&mut self, h: f64, error: f64) {
        let proportional = self.error.map_or(1.0, |before| before.powf(0.4 / 3.0));
        let ratio = SAFETY * error.powf(-0.7 / 3.0) * proportional;
        let most = if self.rejected { 1.0 } else { LARGEST_RATIO };
        let next = h * ratio.clamp(LEAST_RATIO, most);
        self.next = next.clamp(self.least, self.largest);
        self.taken = Some(h);
        self.error = Some(error.max(LEAST_ERROR));
        self.rejected = false;
    }

    /// A step of size `h` was not taken, with this error or because it was not solved.
    pub(crate) fn reject(&mut self, h: f64, error: Option<f64>) {
        let ratio = error
            .map_or(UNSOLVED, |error| (SAFETY * error.powf(-1.0 / 3.0)).clamp(LEAST_RATIO, SAFETY));
        self.next = h * ratio;
        self.rejected = true;
    }

    /// The error allowed in a step from `x`.
    fn allowed<M: Manifold>(&self, x: &M::Point<f64>) -> f64 {
        self.tolerance.powf(1.5).max(8.0 * f64::EPSILON) * M::magnitude(x).max(1.0)
    }

    /// The error of the step from `x` to `end` in units of the one allowed; `None` if the equation
    /// of motion cannot be evaluated on the way, or in another chart only.
    pub(crate) fn error_of<Y: Metriplectic>(
        &self,
        system: &Y,
        x: &Point<Y>,
        end: &Point<Y>,
        h: f64,
    ) -> Option<f64> {
        let e = local_error(system, x, end, h)?;
        let error = speed::<Y>(x, &e) / self.allowed::<Y::Manifold>(x);
        error.is_finite().then_some(error)
    }

    /// The first step, after Hairer, Nørsett, Wanner (Solving ODEs I, §II.4): a short step of Euler's
    /// method gives the rate `ω = |f'f|/|f|` of the motion, and `h³ω²|f|` is to be a hundredth of the
    /// error allowed.
    fn first_step<Y: Metriplectic>(&self, system: &Y, x: &Point<Y>) -> f64 {
        let speed = |v: &Vector<Y::Manifold>| speed::<Y>(x, v);
        let h = system.velocity(&ChartPoint::centre(x)).ok().and_then(|v| {
            let own_time = Y::Manifold::magnitude(x).max(1.0) / speed(&v);
            let euler = 0.01 * own_time.min(self.end);
            let there = ChartPoint { base: x.clone(), q: v * euler };
            let rate = speed(&(system.velocity(&there).ok()? - v)) / (euler * speed(&v));
            let error = 0.01 * self.allowed::<Y::Manifold>(x);
            Some((error / (rate.powi(2) * speed(&v))).cbrt().min(own_time))
        });
        h.filter(|h| h.is_finite()).unwrap_or(1e-3 * self.end)
    }
}

/// The estimate `e` of the local error, in the chart at `x`.
#[inline(never)]
fn local_error<Y: Metriplectic>(
    system: &Y,
    x: &Point<Y>,
    end: &Point<Y>,
    h: f64,
) -> Option<Vector<Y::Manifold>> {
    let q = Y::Manifold::coordinates(x, end);
    if !Y::Manifold::is_near(&q) {
        return None;
    }
    let f = |q| system.velocity(&ChartPoint { base: x.clone(), q }).ok();
    let (start, there) = (f(Vector::<Y::Manifold>::zero())?, f(q)?);
    let middle = f(q * 0.5 - (there - start) * (h / 8.0))?;
    Some(q - (start + middle * 4.0 + there) * (h / 6.0))
}

/// The size of the velocity at `x` with the components `v`, in the units of the entries.
pub(crate) fn speed<Y: Metriplectic>(x: &Point<Y>, v: &Vector<Y::Manifold>) -> f64 {
    Y::Manifold::velocity(&ChartPoint::centre(x), v).magnitude()
}

impl<N: Dimension> Memory<N> {
    /// The same displacements for steps of another size: with the parabola `D(s)` through the last
    /// three, where `s` counts the steps from the middle of the last one, those of a step `ρ` times
    /// as long are `ρ D(½ − ρ/2)`, `ρ D(½ − 3ρ/2)` and `ρ D(½ − 5ρ/2)`, each with `ρ(ρ² − 1)D''/24`
    /// for the shorter mean: exact where the state is a cubic of the time.
    pub(crate) fn rescaled(&self, ratio: f64) -> Self {
        if ratio.to_bits() == 1.0_f64.to_bits() {
            return *self;
        }
        // Far from the three points their parabola says nothing.
        let known = if ratio > 2.0 { self.known.min(1) } else { self.known.min(3) };
        let difference = |j| if j < known { self.differences[j] } else { N::Vector::<f64>::zero() };
        let [d, slope, bend] = [0, 1, 2].map(difference);
        let mean = d + bend * ((ratio * ratio - 1.0) / 24.0);
        let at = |k: f64| {
            let s = 0.5 - (k + 0.5) * ratio;
            (mean + slope * s + bend * (0.5 * s * (s + 1.0))) * ratio
        };
        let [a, b, c] = [0.0, 1.0, 2.0].map(at);
        let mut rescaled = Self { known: if ratio > 2.0 { 2 * known } else { known }, ..*self };
        rescaled.differences[..3].copy_from_slice(&[a, a - b, a - b * 2.0 + c]);
        rescaled
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;
    use metriplectic_dynamics::{AreaForm, Nambu, System};
    use metriplectic_fields::Real;
    use metriplectic_manifolds::{Exponential, Retraction, Rotations, Sphere, WeylMidpoint};
    use nalgebra::{Const, Matrix3, Vector1, Vector3};
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
        let estimate = local_error(system, x, &end, h).unwrap();
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
    fn displacements_of_a_cubic_are_those_of_every_step_size() {
        type Line = Memory<Const<1>>;
        // The last `n` steps of size `h` along x(t), up to t = 0.
        let memory = |x: &dyn Fn(f64) -> f64, h: f64, n: usize| {
            let step = |k: f64| x(-k * h) - x(-(k + 1.0) * h);
            let [a, b, c] = [0.0, 1.0, 2.0].map(step);
            let mut memory = Line { known: n, ..Line::new() };
            for (slot, d) in memory.differences.iter_mut().zip([a, a - b, a - b * 2.0 + c]).take(n)
            {
                *slot = Vector1::new(d);
            }
            memory
        };
        let close = |a: &Line, b: &Line| {
            assert_eq!(a.known, b.known);
            for (a, b) in a.differences.iter().zip(&b.differences).take(a.known) {
                assert!((a - b).norm() < 1e-15, "{a} for {b}");
            }
        };
        let cubic = |t: f64| 0.3 * t - 0.7 * t * t + 0.2 * t * t * t;
        for ratio in [0.2, 0.7, 1.0, 1.3, 2.0] {
            close(&memory(&cubic, 0.1, 3).rescaled(ratio), &memory(&cubic, 0.1 * ratio, 3));
        }
        // Two displacements make a line, one a constant.
        let parabola = |t: f64| 0.3 * t - 0.7 * t * t;
        close(&memory(&parabola, 0.1, 2).rescaled(0.5), &memory(&parabola, 0.05, 2));
        let line = |t: f64| 0.3 * t;
        close(&memory(&line, 0.1, 1).rescaled(0.5), &memory(&line, 0.05, 1));
        close(&memory(&line, 0.1, 3).rescaled(3.0), &memory(&line, 0.3, 2));
    }

    #[test]
    fn the_controller_stays_within_its_bounds() {
        let mut controller = Controller {
            end: 10.0,
            tolerance: 1e-4,
            least: 1e-6,
            largest: 2.0,
            next: 1.0,
            taken: None,
            error: None,
            rejected: false,
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
