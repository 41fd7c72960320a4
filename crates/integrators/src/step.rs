//! One step: guess, solve, retract.
//!
//! The equation of a step is tried in this order, until it is solved:
//!
//! 1. **Newton's method from the guess**: the displacement extrapolated from the steps before, with the
//!    Jacobian that they have left, else that of explicit Euler. It is damped: a correction that
//!    leaves the domain of a field, or does not reduce the residual, is halved up to
//!    [`Newton::halvings`] times. At most [`Newton::iterations`] corrections.
//! 2. **Newton's method from rest**, `u = 0`, where all is defined that is defined at the start. Its first
//!    correction is the linearly implicit step, which stiff friction does not drive off. At most 8
//!    corrections.
//! 3. **Continuation in the step size**: the solution that begins at rest is followed along its tangent
//!    from a step of size 0 to the one that is asked for, by increments that double where Newton's
//!    method ends near the prediction and are quartered where it does not. At most 200 increments, and
//!    none below 10⁻⁴ of the size reached: there the solution has dg_v back, or has met the edge of the
//!    domain.
//! 4. **The globaliser**, 100 iterations of argmin's L-BFGS on `½|F(u)|²` from the best point of 1 and 2,
//!    then Newton's method from where it ends (with the feature `argmin`). What it finds is a solution,
//!    with both laws, but it may be another one than that of 3.
//! 5. **Halves**: the step is taken as two of half the size, each by 1 and 2 alone, and each that
//!    fails is halved again, [`Scheme::splits`] times at most. Both laws hold for each part.
//! 6. [`StepError`]: `OutOfDomain` if in the smallest part the edge of a domain is in Newton's way,
//!    `DependentInvariants` if it starts where a further invariant depends on the other fields, otherwise
//!    `NotConverged`; the first and the last with all that was tried.
//!
//! Steps of adaptive size are tried by 1 and 2, and then by a smaller step.
//!
//! Of the 242 starts of `tests/hard_corpus.rs` 218 have a solution that continuation in 60 digits finds.
//! All of them end in a certified step.

use metriplectic_dynamics::velocity::{differentials, projected_fractions};
use metriplectic_dynamics::{Bracket, Dissipation, Invariants, Metriplectic, system::Point};
use metriplectic_fields::{
    ChartPoint, Column, Dimension, Matrix, ScalarField, Space, Square, Vector,
};
use metriplectic_manifolds::{InnerProduct, Manifold, Retraction, Riemannian};

use crate::discrete_gradient::{DiscreteGradient, Gonzalez};
use crate::error::{Attempts, StepError};
use crate::newton::{Inverse, Newton};
use crate::residual::{Dim, DriftCorrection, LastCorrection, Numbers, Residual, size_of_terms};
use crate::root_finder::{Equation, Iterate, Root};

/// A scheme: a retraction, and how hard to try to solve its equation.
///
/// ```
/// use metriplectic_integrators::{Newton, Scheme};
/// use metriplectic_manifolds::WeylMidpoint;
/// let scheme = Scheme { splits: 4, ..Scheme::new(WeylMidpoint) };
/// let patient = scheme.newton(Newton { iterations: 60, ..Newton::default() });
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scheme<R, W = Gonzalez> {
    /// Turns a vector into a pair of points.
    pub retraction: R,
    /// Accounts for the change of energy and entropy along a step.
    pub gradient: W,
    /// Solves the equation of a step.
    pub newton: Newton,
    /// How often a step that is not solved is split in halves; both laws hold for each half.
    pub splits: usize,
}

impl<R> Scheme<R> {
    /// The scheme of a retraction, with the discrete gradient of Gonzalez and the default solver.
    pub fn new(retraction: R) -> Self {
        Self { retraction, gradient: Gonzalez, newton: Newton::default(), splits: 10 }
    }
}

impl<R, W> Scheme<R, W> {
    /// Replaces the discrete gradient.
    #[must_use]
    pub fn gradient<V: DiscreteGradient>(self, gradient: V) -> Scheme<R, V> {
        let Self { retraction, newton, splits, .. } = self;
        Scheme { retraction, gradient, newton, splits }
    }

    /// Replaces the options of the solver.
    #[must_use]
    pub fn newton(self, newton: Newton) -> Self {
        Self { newton, ..self }
    }
}

impl<R, W: DiscreteGradient> Scheme<R, W> {
    /// One step from where `start` says. The displacement is guessed from `memory`, and noted there.
    ///
    /// # Errors
    ///
    /// [`StepError`] with `time` and all that was tried.
    pub fn step<Y>(
        &self,
        system: &Y,
        start: &Start<'_, Y>,
        memory: &mut Memory<Dim<Y>>,
    ) -> Result<(Point<Y>, Effort), StepError>
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric>,
    {
        let mut work = Effort::default();
        let whole = self.attempt(system, start, memory, Fallbacks::All, &mut work);
        let end = whole.or_else(|lost| {
            *memory = Memory::new();
            if self.splits == 0 {
                return Err((lost, start.x.clone()));
            }
            self.halves(system, start, 1, &mut work)
        });
        match end {
            Ok(end) => Ok((end, work)),
            Err((smallest, x)) => Err(self.failure(system, start, (smallest, &x), &work)),
        }
    }

    /// What a user is told of a step that was not solved, by what became of its smallest part, which
    /// starts at `x`.
    #[cold]
    fn failure<Y>(
        &self,
        system: &Y,
        start: &Start<'_, Y>,
        (StepFailure { residual, cause }, x): (StepFailure, &Point<Y>),
        work: &Effort,
    ) -> StepError
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric>,
    {
        let Start { time, h, .. } = *start;
        let Effort { iterations, continued, globalised, splits, .. } = *work;
        let tried = Attempts { iterations, continued, globalised, splits };
        if let Some(error) = (StepFailure { residual, cause }).first_law(time, h) {
            return error;
        }
        let suggested = smallest_part(h, self.splits);
        let equation =
            Residual::new(system, (&self.retraction, &self.gradient), start.x, suggested);
        equation.linearise(&Vector::<Y::Manifold>::zero());
        // Where friction is slow against the smallest part, or slower than the reversible motion, something
        // else is in the way.
        let stiffness = equation.friction().unwrap_or(0.0);
        if stiffness > f64::max(1.0, equation.rotation()) {
            let stiffness = stiffness * (h / suggested);
            return StepError::StiffFriction { time, h, stiffness, residual, tried };
        }
        match (cause, dependent_invariant(system, x)) {
            (Cause::Edge, _) => StepError::OutOfDomain { time, h, tried },
            (_, Some((index, fraction))) => {
                let change = start.accumulated_error.invariants[index].abs();
                StepError::DependentInvariants { time, index, change, fraction }
            }
            _ => StepError::NotConverged { time, h, residual, tried, suggested },
        }
    }

    /// The two halves of a step that was not solved whole; if they were not solved either, where the
    /// smallest part of them starts.
    fn halves<Y>(
        &self,
        system: &Y,
        start: &Start<'_, Y>,
        depth: usize,
        work: &mut Effort,
    ) -> Result<Point<Y>, (StepFailure, Point<Y>)>
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric>,
    {
        work.splits += 1;
        let mut memory = Memory::new();
        let mut point = start.x.clone();
        let h = 0.5 * start.h;
        for _ in 0..2 {
            let [energy, entropy] = [system.energy_at(&point), system.entropy_at(&point)];
            let accumulated_error = DriftCorrection {
                energy: start.accumulated_error.energy + (energy - start.energy),
                ..start.accumulated_error
            };
            let part = Start { x: &point, h, energy, entropy, accumulated_error, ..*start };
            let end = match self.attempt(system, &part, &mut memory, Fallbacks::NewtonOnly, work) {
                Ok(end) => end,
                Err(failure) if depth >= self.splits => return Err((failure, point)),
                Err(_) => self.halves(system, &part, depth + 1, work)?,
            };
            point = end;
        }
        Ok(point)
    }

    /// Guess, solve, retract.
    pub(crate) fn attempt<Y>(
        &self,
        system: &Y,
        start: &Start<'_, Y>,
        memory: &mut Memory<Dim<Y>>,
        effort: Fallbacks,
        work: &mut Effort,
    ) -> Result<Point<Y>, StepFailure>
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric>,
    {
        let guess = memory.extrapolate().or_else(|| explicit(system, start));
        let guess = guess.unwrap_or_else(Vector::<Y::Manifold>::zero);
        let parts = (&self.retraction, &self.gradient);
        let drift_correction = drift_correction(system, start, &guess);
        let values = [start.energy, start.entropy];
        let known = memory.linearised.take().filter(|known| known.serves(start.h, &guess));
        let residual = Residual::with_drift_correction(
            system,
            parts,
            (start.x, values),
            start.h,
            drift_correction,
        );
        let mut inverse = known.map(|known| known.inverse);
        let root = self.newton.solve_near(&residual, &guess, &mut inverse);
        work.iterations += iterations(&root);
        let root = match root {
            Ok(root) => root,
            Err(failure) => self.rescue(&residual, failure, effort, &mut inverse, work)?,
        };
        memory.linearised = inverse.map(|inverse| match (residual.friction(), known) {
            // No Jacobian was formed in this step.
            (None, Some(known)) => Linearisation { inverse, steps: known.steps + 1, ..known },
            (friction, _) => {
                let friction = friction.unwrap_or(0.0);
                Linearisation {
                    inverse,
                    friction,
                    h: start.h,
                    length: root.u.magnitude(),
                    steps: 0,
                }
            }
        });
        work.entropy_slope = work.entropy_slope.min(residual.entropy_slope());
        work.dissipates |= residual.dissipates();
        let friction = memory.linearised.map_or(0.0, |known| known.friction);
        work.friction = work.friction.max(friction);
        if friction > VERY_STIFF && !has_digits(system, start, &root) {
            return Err(StepFailure { residual: root.residual, cause: Cause::Unsolved });
        }
        work.rests = (0..Dim::<Y>::LEN).all(|i| root.u[i].abs() <= 2.0 * root.noise[i]);
        if work.rests {
            // The state is at rest: what the solver found is its own round-off, and following it
            // would make a random walk of the energy.
            (work.energy, work.entropy) = (start.energy, start.entropy);
            return Ok(start.x.clone());
        }
        let lost = || StepFailure { residual: root.residual, cause: Cause::Edge };
        let end = self.retraction.end(system.metric(), start.x, &root.u).map_err(|_| lost())?;
        let values = [system.energy_at(&end), system.entropy_at(&end)];
        let last = residual.last_correction(&root, &end, values);
        work.iterations += usize::from(last.is_some());
        let LastCorrection { u, end, moved } =
            last.unwrap_or(LastCorrection { u: root.u, end, moved: false });
        // Outside an open chart the defect is infinite: there is no state to go on from.
        if system.manifold().defect(&end).is_infinite() {
            return Err(lost());
        }
        if moved {
            memory.compensation = None;
        }
        let end = memory.note::<Y::Manifold, _>(system.metric(), start.x, &u, end);
        if moved {
            // What the end has been moved by is not lost.
            memory.compensation = None;
        }
        // The last digits of the end, which no residual has seen, may be beyond the edge.
        (work.energy, work.entropy) = (system.energy_at(&end), system.entropy_at(&end));
        let change = work.energy - start.energy;
        if !work.entropy.is_finite() {
            Err(lost())
        } else if let Some(size) = breaks_first_law(system, change, [start.x, &end], work.energy) {
            Err(StepFailure { residual: root.residual, cause: Cause::Energy { change, size } })
        } else {
            Ok(end)
        }
    }

    /// A root where Newton's method has lost its way from the guess, in the order of the
    /// [module](self).
    #[cold]
    fn rescue<Y>(
        &self,
        residual: &Residual<'_, Y, R, W>,
        failure: Iterate<Y::Manifold>,
        effort: Fallbacks,
        inverse: &mut Option<Inverse<Dim<Y>>>,
        work: &mut Effort,
    ) -> Result<Root<Y::Manifold>, StepFailure>
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric>,
    {
        let mut best = failure;
        let mut newton = |newton: &Newton, guess: &Vector<Y::Manifold>, work: &mut Effort| {
            let solved = newton.solve_near(residual, guess, inverse);
            work.iterations += iterations(&solved);
            solved
                .map_err(|lost| {
                    if lost.residual < best.residual {
                        best = lost;
                    }
                })
                .or(Err(best.best))
        };
        let direct = Newton { iterations: DIRECT.min(self.newton.iterations), ..self.newton };
        let mut solved = newton(&direct, &Vector::<Y::Manifold>::zero(), work);
        let whole = effort == Fallbacks::All;
        if whole
            && solved.is_err()
            && let Some(near) = self.follow(residual, work)
        {
            solved = newton(&self.newton, &near, work);
        }
        #[cfg(feature = "argmin")]
        if whole
            && let Err(best) = &solved
            && let Some(closer) = crate::globaliser::descend(residual, best)
        {
            work.globalised += 1;
            solved = newton(&self.newton, &closer, work);
        }
        solved.map_err(|at| {
            let cause = if at_edge(residual, &at) { Cause::Edge } else { Cause::Unsolved };
            StepFailure { residual: best.residual, cause }
        })
    }

    /// The displacement of the last of a row of steps of growing sizes from the same start, up to
    /// that of `residual`: the branch of solutions that begins at rest is followed along its tangents. A
    /// solution counts as one of this branch if it is near its prediction.
    fn follow<Y>(
        &self,
        residual: &Residual<'_, Y, R, W>,
        work: &mut Effort,
    ) -> Option<Vector<Y::Manifold>>
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric>,
    {
        work.continued += 1;
        // The points on the way need not be solved to round-off.
        let newton = Newton { tolerance: 1e3, iterations: DIRECT, halvings: 2, ..self.newton };
        let (mut u, mut fraction, mut increment) = (Vector::<Y::Manifold>::zero(), 0.0, 0.125);
        for _ in 0..STAGES {
            let next = f64::min(fraction + increment, 1.0);
            let equation = residual.of_fraction(next);
            work.iterations += 1;
            let near = equation.linearise(&u).and_then(|at| {
                let step = at.jacobian.solve(&at.residual)?;
                // The branch begins as a straight line: the implicit displacement is the explicit one.
                let bends = (step - at.residual).magnitude() > NEARBY * step.magnitude();
                if fraction <= 0.0 && bends {
                    return None;
                }
                let predicted = u - step;
                let solved = newton.solve_near(&equation, &predicted, &mut None);
                work.iterations += iterations(&solved);
                let root = solved.ok()?.u;
                let off = (root - predicted).magnitude();
                (off <= NEARBY * (root - u).magnitude()).then_some(root)
            });
            match near {
                Some(root) if next >= 1.0 => return Some(root),
                Some(root) => (u, fraction, increment) = (root, next, 2.0 * increment),
                None => increment *= 0.25,
            }
            if increment <= LEAST * fraction {
                return None;
            }
        }
        None
    }
}

/// The change of the energy, relative to the size of its terms, that is no round-off: no step is taken
/// that changes it by more.
const BROKEN: f64 = 1e-6;

/// The size `|H| + Σ_i |∂_iH| (|x_i| + |d_i|)` of the terms of the energy on the step `d` between two points,
/// if a change of the energy is more than a millionth of it, or no number.
///
/// It is the smaller one of those at the two ends. At the edge of a logarithm `|∂_iH x_i|` is as large as the
/// reciprocal of round-off, and would excuse any error; at a point where all terms vanish `|∂_iH d_i|` does not.
pub(crate) fn breaks_first_law<Y: Metriplectic>(
    system: &Y,
    change: f64,
    [x, end]: [&Point<Y>; 2],
    energy: f64,
) -> Option<f64> {
    // Most often the energy itself is large enough, and needs no differential; an infinite one is not.
    if energy.is_finite() && change.abs() <= BROKEN * energy.abs() {
        return None;
    }
    let d = Y::Manifold::coordinates(x, end).abs();
    let sizes = [x, end].map(|x| {
        let exchanged = system.energy().jet1(x).df.abs().dot(&d);
        size_of_terms::<Y::Manifold>(system.energy(), x) + exchanged
    });
    let holds = sizes.iter().all(|&size| change.abs() <= BROKEN * size && size.is_finite());
    if holds { None } else { Some(sizes[0].min(sizes[1])) }
}

/// The rate `h|K'|` of friction from which on the round-off of a solution may be large.
const VERY_STIFF: f64 = 1e8;

/// Whether the round-off of a solution is small: if friction is so stiff that the slow motion has no digits
/// beside it, the round-off of the displacement is as large as the displacement, and a state would seem to
/// rest. It is measured by the energy that goes with it, which has one unit for all components.
fn has_digits<Y: Metriplectic>(
    system: &Y,
    start: &Start<'_, Y>,
    Root { u, noise, .. }: &Root<Y::Manifold>,
) -> bool {
    let scales = Y::Manifold::scales(start.x);
    if (0..Dim::<Y>::LEN).all(|i| noise[i] <= 1e-2 * BROKEN * (scales[i] + u[i].abs())) {
        return true;
    }
    let dh = system.energy().jet1(start.x).df.abs();
    dh.dot(noise) <= BROKEN * (start.energy.abs() + dh.dot(&scales))
}

/// The rate `h|K'|` of friction from which on a step is stiff: the midpoint rule leaves two thirds of a
/// deviation that decays at this rate, with the opposite sign.
pub(crate) const STIFF: f64 = 10.0;

/// What Newton's method has cost.
fn iterations<M: Manifold>(solved: &Result<Root<M>, Iterate<M>>) -> usize {
    solved.as_ref().map_or_else(|lost| lost.iterations, |root| root.iterations)
}

/// A solution belongs to a branch if it is off its prediction by no more than this fraction of the way.
const NEARBY: f64 = 0.1;
/// Linear systems after which a way from rest is no longer direct, and its end no longer likely to be
/// the solution that belongs to the start.
const DIRECT: usize = 8;
/// Steps of growing sizes that may be tried to get to the size that is asked for.
const STAGES: usize = 200;
/// The fraction of what has been reached below which an increment of the size means that the branch of
/// solutions ends there.
const LEAST: f64 = 1e-4;

/// How hard to try.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fallbacks {
    /// Everything, because only halving the step comes after it.
    All,
    /// Newton's method alone, because a smaller step is tried next.
    NewtonOnly,
}

/// A step that was not solved.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepFailure {
    /// The smallest residual that was found.
    residual: f64,
    /// Why it was not solved.
    cause: Cause,
}

impl StepFailure {
    /// The error that names the first law, if the step was refused because its end has another energy.
    pub(crate) const fn first_law(self, time: f64, h: f64) -> Option<StepError> {
        match self.cause {
            Cause::Energy { change, size } => {
                Some(StepError::FirstLawBroken { time, h, change, size })
            }
            Cause::Edge | Cause::Unsolved => None,
        }
    }
}

/// Why a step was not solved.
#[derive(Clone, Copy, Debug)]
enum Cause {
    /// The domain of the model is in the way.
    Edge,
    /// The equation is solved, but its end has another energy.
    Energy { change: f64, size: f64 },
    /// Newton's method does not converge.
    Unsolved,
}

/// Whether it is the edge of the domain that stops Newton's method at `u`: its correction leads out,
/// cut to the length of the step, because a far longer one, from a Jacobian that is nearly singular,
/// leads out of any domain.
fn at_edge<M: Manifold>(equation: &impl Equation<M>, u: &Vector<M>) -> bool {
    let Some(at) = equation.linearise(u) else { return true };
    let Some(step) = at.jacobian.solve(&at.residual) else { return false };
    let fraction = (u.magnitude() + at.residual.magnitude()) / step.magnitude();
    equation.value(&(*u - step * fraction.min(1.0))).is_none()
}

/// The further invariant that has the least independent fraction at `x`, and this fraction, if it is small
/// enough to be the cause of a failure.
pub(crate) fn dependent_invariant<Y: Metriplectic>(
    system: &Y,
    x: &Point<Y>,
) -> Option<(usize, f64)> {
    let fractions = projected_fractions(system, &ChartPoint::centre(x)).ok()?;
    let least = fractions.into_iter().enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
    least.filter(|(_, fraction)| *fraction < DEPENDENT)
}

/// The independent fraction of a further invariant's differential that explains a failure.
const DEPENDENT: f64 = 1e-3;

/// The size of the smallest part of a step that was split `splits` times.
fn smallest_part(h: f64, splits: usize) -> f64 {
    (0..splits).fold(h, |part, _| 0.5 * part)
}

/// Where a step starts.
#[derive(Debug)]
pub struct Start<'a, Y: Metriplectic> {
    /// The point `x`.
    pub x: &'a Point<Y>,
    /// The time at which the step starts, for its errors; that of the whole step for a part of it.
    pub time: f64,
    /// The step size.
    pub h: f64,
    /// The energy `H(x)`.
    pub energy: f64,
    /// The entropy `S(x)`.
    pub entropy: f64,
    /// The further invariants `L_a(x)`.
    pub invariants: Numbers<Y>,
    /// The round-off `H(x) − H(x₀)` that earlier steps have left, and that of the entropy, since
    /// something was dissipated, and of the further invariants.
    pub accumulated_error: DriftCorrection<Y>,
}

/// What a step cost.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Effort {
    /// Linear systems solved by Newton's method.
    pub iterations: usize,
    /// How often the step, or a part of it, was split in halves.
    pub splits: usize,
    /// How often a step was approached through smaller ones from the same start.
    pub continued: usize,
    /// How often the globaliser was called.
    pub globalised: usize,
    /// The size `|w_S|` of the discrete gradient of the entropy, by which the bracket is projected;
    /// infinite where it has none.
    pub entropy_slope: f64,
    /// Whether anything was dissipated.
    pub dissipates: bool,
    /// The largest rate `h|K'|` of the friction.
    pub friction: f64,
    /// Whether the state is at rest: the displacement is no more than its own round-off.
    pub rests: bool,
    /// The energy at the end.
    pub energy: f64,
    /// The entropy there.
    pub entropy: f64,
}

impl Default for Effort {
    fn default() -> Self {
        Self {
            iterations: 0,
            splits: 0,
            continued: 0,
            globalised: 0,
            entropy_slope: f64::INFINITY,
            dissipates: false,
            friction: 0.0,
            rests: false,
            energy: f64::NAN,
            entropy: f64::NAN,
        }
    }
}

/// The explicit Euler displacement `h (Π dH + K dS)(x)`.
fn explicit<Y: Metriplectic>(system: &Y, start: &Start<'_, Y>) -> Option<Vector<Y::Manifold>> {
    let displacement = system.velocity(&ChartPoint::<Y::Manifold>::centre(start.x)).ok()? * start.h;
    displacement.is_finite().then_some(displacement)
}

/// The fractions `φ e` of the left-over errors `e` that the step takes back.
///
/// What the solver leaves in each step would make the energy a random walk over millions of them, so
/// a step aims at `H(x₀)` instead of `H(x)`, once they differ by more than a few units of round-off.
/// Asking for `⟨w, d⟩ = F(x') − F(x) + φe` changes the covector by `φe ♭d/G(d, d)`, and with it the
/// displacement by some `δ`, which must stay small against `d`. Both are compared by the change of `F` that goes
/// with them, which has one unit: `φ = r²/(1 + r²)` with `r = Σ|∂_iF d_i| / (10² Σ|∂_iF δ_i|)` for `φ = 1`. It is
/// all of `e` while the state moves, and nothing of it at rest, where it would hold the state fast.
///
/// For the energy `δ_i = h Σ_j (|Π| + |K'|)_ij |♭d_j| |e|/G(d, d)`. The covectors of the entropy and of the
/// further invariants enter by the projections, where `Σ|∂_iF δ_i| = |e|`, and that of the entropy by `K` as
/// well.
fn drift_correction<Y: Metriplectic>(
    system: &Y,
    start: &Start<'_, Y>,
    d: &Vector<Y::Manifold>,
) -> DriftCorrection<Y> {
    let DriftCorrection { energy, entropy, invariants } = start.accumulated_error;
    let far = |e: f64, size: f64| e.abs() > 4.0 * f64::EPSILON * size;
    let mut off = far(energy, start.energy.abs()) || far(entropy, start.entropy.abs());
    for k in 0..Y::Invariants::COUNT {
        off |= far(invariants[k], start.invariants[k].abs());
    }
    if !off {
        return DriftCorrection::nothing();
    }
    let x = ChartPoint::<Y::Manifold>::centre(start.x);
    let w = differentials(system, &x);
    let args = system.bracket_args(&x, &w.entropy);
    let pi = system.bracket().linearise(&args, &w.energy);
    let k = system.dissipation().linearise(system.metric(), start.x, &w.energy, &w.entropy);
    let (Ok(pi), Ok(k), Ok(g)) = (pi, k, system.metric().at(&x)) else {
        return DriftCorrection::nothing();
    };
    let mut gain = pi.tensor.abs() + k.along_w.abs();
    if system.bracket().is_forced()
        && let Ok(force) = system.bracket().linearise_force(&args, &w.energy)
    {
        gain += force.tensor.abs();
    }
    let (flat, length) = (g.flat(d), d.abs());
    // Σ|∂_iF δ_i|/|e| for a δ by a tensor.
    let moved = |df: &Vector<Y::Manifold>, tensor: Matrix<Y::Manifold>| {
        df.abs().dot(&(tensor * flat.abs())) * start.h.abs() / flat.dot(d)
    };
    let fraction = |e: f64, size: f64, df: &Vector<Y::Manifold>, sensitivity: f64| {
        let r = df.abs().dot(&length) / (1e2 * sensitivity * e.abs());
        if far(e, size) && r.is_finite() { e / (1.0 + r.powi(-2)) } else { 0.0 }
    };
    let of_energy = moved(&w.energy, gain);
    let of_entropy = 1.0 + moved(&w.entropy, k.tensor.abs());
    DriftCorrection {
        energy: fraction(energy, start.energy.abs(), &w.energy, of_energy),
        // An entropy that has risen by round-off comes back by less than a fall in each step.
        entropy: fraction(entropy, start.entropy.abs(), &w.entropy, of_entropy)
            .min(2.0 * f64::EPSILON * start.entropy.abs()),
        invariants: Dim::<Y>::array(|k| {
            let size = start.invariants[k].abs();
            w.invariants[k].map_or(0.0, |(_, dl)| fraction(invariants[k], size, &dl, 1e6))
        }),
    }
}

/// What a step remembers of the steps before it: the displacements, from which the next one is
/// extrapolated; the inverse of a Jacobian, which serves as long as it contracts; and what rounding has
/// lost of the position.
///
/// The entries of a point are rounded in every step, and steps shorter than their last digit would
/// be lost altogether; what is lost is carried along and added to the next displacement
/// (compensated summation; Kahan 1965, Hairer, Lubich, Wanner 2006, §VIII.5).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Memory<N: Dimension> {
    /// The backward differences `∇ʲd` of the displacements, as far as they are `known`.
    pub(crate) differences: [N::Vector<f64>; DIFFERENCES],
    pub(crate) known: usize,
    pub(crate) linearised: Option<Linearisation<N>>,
    pub(crate) compensation: Option<N::Vector<f64>>,
}

/// Displacements that are remembered.
const DIFFERENCES: usize = 4;

/// The Jacobian of an earlier step, and what it was formed for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Linearisation<N: Dimension> {
    pub(crate) inverse: Inverse<N>,
    /// The rate `h|K'|` of the friction there.
    pub(crate) friction: f64,
    pub(crate) h: f64,
    pub(crate) length: f64,
    pub(crate) steps: u32,
}

/// Steps after which a Jacobian is formed again, because the sizes of the terms may have changed.
const STEPS: u32 = 100;

impl<N: Dimension> Linearisation<N> {
    /// Whether it may be tried for a step of size `h` with this guess of the displacement: the sizes
    /// that the round-off is judged by are those of steps that are about as long.
    #[inline]
    fn serves(&self, h: f64, guess: &N::Vector<f64>) -> bool {
        let fraction = guess.magnitude() / self.length;
        self.h.to_bits() == h.to_bits() && self.steps < STEPS && (0.7..1.5).contains(&fraction)
    }
}

impl<N: Dimension> Default for Memory<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<N: Dimension> Memory<N> {
    /// An empty memory.
    #[must_use]
    pub fn new() -> Self {
        let differences = [N::Vector::<f64>::zero(); DIFFERENCES];
        Self { differences, known: 0, linearised: None, compensation: None }
    }

    /// The next displacement `Σ_{j<k} ∇ʲd`, on the polynomial through the last `k` of them; `k` is the
    /// one that would have been best for the last step, where it was wrong by `∇ᵏd`.
    #[inline]
    fn extrapolate(&self) -> Option<N::Vector<f64>> {
        if self.known < 2 {
            return None;
        }
        let (mut best, mut smallest) = (1, f64::INFINITY);
        for (k, difference) in self.differences[..self.known].iter().enumerate().skip(1) {
            let size = difference.dot(difference);
            if size < smallest {
                (best, smallest) = (k, size);
            }
        }
        // Where the last difference is the smallest, it is the next one that counts.
        if best + 1 == self.known {
            best = self.known;
        }
        let mut sum = self.differences[0];
        for difference in &self.differences[1..best] {
            sum += *difference;
        }
        Some(sum)
    }
}

impl<N: Dimension> Memory<N> {
    /// Notes the step from `x` by the displacement `d`, and gives its end, moved by what earlier
    /// steps have lost.
    #[inline]
    fn note<M: Manifold<Dim = N>, G: Riemannian<M>>(
        &mut self,
        metric: &G,
        x: &M::Point<f64>,
        d: &N::Vector<f64>,
        end: M::Point<f64>,
    ) -> M::Point<f64> {
        let mut difference = *d;
        for last in &mut self.differences {
            let next = difference - *last;
            *last = difference;
            difference = next;
        }
        M::transport_all(x, &end, &mut self.differences);
        self.known = DIFFERENCES.min(self.known + 1);
        let lost = metric.lost(x, d, &end);
        match self.compensation {
            Some(compensation) if compensation.magnitude() > 0.0 => {
                let settled = M::chart(&end, &compensation);
                self.compensation = Some(lost + metric.lost(&end, &compensation, &settled));
                settled
            }
            _ => {
                self.compensation = Some(lost);
                end
            }
        }
    }
}
