//! Newton's method for the equation of a step, down to the round-off of each component, as in [`Newton`], whose rules and formulas
//! it follows.

use super::equation::{Dissipated, Equation, Evaluated, Linearised, Rounding};
use crate::implicit::algebra::{FEW, Matrix, add, dot, magnitude};
use crate::implicit::parts::Parts;
use crate::newton::{
    INVERTED, MARGIN, NEAR, NOISE, NORM, Newton, SURE, Stiffness, UNCHECKED, corrections, reaches,
};
use crate::numbers::{Lengths, List};

/// A solved equation.
pub(super) struct Root<L: Lengths> {
    /// The solution.
    pub(super) u: L::Vector,
    /// The norm of the residual that is left.
    pub(super) residual: f64,
    /// The round-off of each component of the solution.
    pub(super) round_off: L::Vector,
    /// The norm of the round-off of the residual.
    pub(super) residual_bound: f64,
    /// Linear systems solved.
    pub(super) iterations: usize,
    /// The entropy in the last evaluation.
    pub(super) evidence: Dissipated,
}

/// The best point of an equation that was not solved.
pub(super) struct Iterate<L: Lengths> {
    /// The best point found.
    pub(super) best: L::Vector,
    /// The norm of the residual there; infinite if it was defined nowhere.
    pub(super) residual: f64,
    /// Linear systems solved.
    pub(super) iterations: usize,
}

impl<L: Lengths> Iterate<L> {
    fn solved(self, round_off: L::Vector, evidence: Dissipated, residual_bound: f64) -> Root<L> {
        let Self { best: u, residual, iterations } = self;
        Root { u, residual, round_off, residual_bound, iterations, evidence }
    }
}

/// The inverse of a Jacobian, kept up to date by Broyden's rank-one corrections, and what it makes of the round-off of the equation.
#[derive(Debug)]
pub(super) struct Inverse<L: Lengths> {
    pub(super) matrix: Matrix<L>,
    /// The round-off `|J⁻¹| r + |J⁻¹G| η + |1 − J⁻¹| ξ` of the solution, where the Jacobian was formed.
    pub(super) round_off: L::Vector,
    /// The norm of the round-off of the residual, where the Jacobian was formed.
    pub(super) residual_bound: f64,
    /// The fraction of a residual that the first correction by a kept inverse has left of late.
    pub(super) contraction: f64,
    /// The residual of the guess in the last step, in units of its round-off.
    pub(super) first: f64,
    /// The rate of the friction where the Jacobian was formed.
    pub(super) friction: f64,
    /// Equations that it has solved since the one whose Jacobian it is.
    pub(super) age: u32,
}

// By hand, because lengths have none.
impl<L: Lengths> Clone for Inverse<L> {
    fn clone(&self) -> Self {
        Self { matrix: self.matrix.clone(), round_off: self.round_off.clone(), ..*self }
    }
}

impl<L: Lengths> Inverse<L> {
    fn of(parts: &Parts<'_, L>, at: &Linearised<L>, residual_bound: f64) -> Option<Self> {
        let Linearised { jacobian, rounding, stiffness, .. } = at;
        let Rounding { terms, sensitivity, covector, argument } = rounding;
        let (n, matrix) = (parts.n(), jacobian.inverse()?);
        // In mixed units only the diagonal of J⁻¹J has none, and tells whether the inverse has digits.
        let has_digits = |i: usize| {
            let product: f64 = (0..n).map(|j| matrix[(i, j)] * jacobian[(j, i)]).sum();
            (product - 1.0).abs() < INVERTED
        };
        if !(0..n).all(has_digits) {
            return None;
        }
        // J⁻¹(J − 1) = 1 − J⁻¹.
        let one = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
        let of_terms = matrix.abs_times(terms);
        let moved = parts.matrix(|i, j| (one(i, j) - matrix[(i, j)]).abs());
        // |J⁻¹G|η is between |G|η − |1 − J⁻¹||G|η and their sum, and needs no product of matrices where these are close.
        let shared = sensitivity.abs_times(covector);
        let is_close = || {
            let changed = moved.times(&shared);
            (0..n).all(|i| changed[i] <= 0.25 * shared[i])
        };
        let of_covectors = if n > FEW && is_close() {
            shared
        } else {
            matrix.product(sensitivity).abs_times(covector)
        };
        let of_points = moved.times(argument);
        // A point and its compensation have twice the digits: smaller displacements move nothing.
        let round_off = parts
            .vector(|i| of_terms[i] + of_covectors[i] + of_points[i] + argument[i] * f64::EPSILON);
        let Stiffness { friction, .. } = *stiffness;
        let (contraction, first, age) = (0.0, 0.0, 0);
        Some(Self { matrix, round_off, residual_bound, contraction, first, friction, age })
    }

    /// Whether as many corrections of the next guess as a Jacobian is worth are expected to be enough, the last one unchecked.
    fn serves(&self) -> bool {
        reaches(self.first, self.contraction, corrections(self.matrix.n()), SURE)
    }

    /// The round-off of each component of a solution near `u`.
    fn round_off(&self, parts: &Parts<'_, L>, u: &L::Vector) -> L::Vector {
        parts.vector(|i| (self.round_off[i] + u[i].abs() * f64::EPSILON) * MARGIN)
    }

    /// Broyden's update: the least change of the inverse after which the step `s` has the change `y` of the residual, `s = J⁻¹y`, with
    /// `predicted = J⁻¹y` before it. The `correction` of a residual becomes that of the new inverse.
    fn learn(&mut self, s: &L::Vector, predicted: &L::Vector, correction: &mut L::Vector) {
        let along = dot(s, predicted);
        // Beyond a factor of four the step says little about the slope, and nothing where its square underflows.
        if along > 0.25 * dot(s, s) && along > 1e-280 {
            let row = self.matrix.transpose_times(s);
            let (mut turned, reciprocal) = (s.clone(), along.recip());
            add(&mut turned, -1.0, predicted);
            turned.numbers_mut().iter_mut().for_each(|turned| *turned *= reciprocal);
            self.matrix.add_outer(1.0, &turned, &row);
            let c = dot(s, correction);
            add(correction, c, &turned);
        }
    }
}

/// A measure of corrections: the root mean square of their components in units of round-off.
struct Measure<V> {
    /// The reciprocals of the round-off of each component.
    reciprocals: V,
}

impl<V: List> Measure<V> {
    fn new(round_off: &V) -> Self {
        let mut reciprocals = round_off.clone();
        // A component without round-off is exact, and so is its correction.
        let all = reciprocals.numbers_mut().iter_mut();
        all.for_each(|unit| *unit = unit.max(f64::MIN_POSITIVE).recip());
        Self { reciprocals }
    }

    /// The size of a correction; infinite if it is not finite.
    fn of(&self, correction: &V) -> f64 {
        let pairs = correction.numbers().iter().zip(self.reciprocals.numbers());
        let sum = pairs.fold(0.0, |sum, (c, unit)| sum + (c * unit) * (c * unit));
        let n = correction.numbers().len() as f64;
        if sum.is_finite() { (sum / n).sqrt() } else { f64::INFINITY }
    }
}

/// Returns whether a correction changes each component of a solution by a small fraction of it, or by its round-off.
fn is_small<V: List>(correction: &V, u: &V, round_off: &V) -> bool {
    let (correction, u, round_off) = (correction.numbers(), u.numbers(), round_off.numbers());
    (0..u.len()).all(|i| correction[i].abs() <= UNCHECKED * u[i].abs() + round_off[i])
}

/// Where a Jacobian is first used.
struct Start<L: Lengths> {
    residual: L::Vector,
    evidence: Dissipated,
    /// The norm at which a stagnating residual counts as solved: zero where the Jacobian is not that of the equation itself.
    stalled: f64,
}

/// How far one Jacobian has brought the iteration.
enum Progress<L: Lengths> {
    /// The correction is round-off, of this size in each component of the solution.
    Solved(L::Vector, Dissipated),
    /// It falls too slowly for this Jacobian.
    Slow,
    /// It does not fall.
    Stuck,
}

/// A point with a smaller residual, and the fraction of the correction that led to it.
struct Descent<L: Lengths> {
    u: L::Vector,
    at: Evaluated<L>,
    /// The norm of the residual.
    size: f64,
    length: f64,
}

impl<L: Lengths> Equation<'_, L> {
    /// A root near the guess, first with the inverse of the Jacobian of an equation near by; the inverse that solved the equation is
    /// left in its place.
    pub(super) fn solve_near(
        &self,
        newton: &Newton,
        guess: &L::Vector,
        known: &mut Option<Inverse<L>>,
    ) -> Result<Root<L>, Iterate<L>> {
        let mut best = Iterate { best: guess.clone(), residual: f64::INFINITY, iterations: 0 };
        let mut history = None;
        if let Some(inverse) = known {
            if inverse.serves()
                && let Some(Evaluated { residual, evidence }) = self.evaluate(guess)
            {
                best.residual = magnitude(&residual);
                let here = Start { residual, evidence, stalled: 0.0 };
                if let Progress::Solved(round_off, evidence) =
                    self.correct(newton, here, inverse, &mut best)
                {
                    inverse.age += 1;
                    return Ok(best.solved(round_off, evidence, inverse.residual_bound / NORM));
                }
                history = Some((inverse.contraction, Some(inverse.first)));
            } else {
                // What has not served is forgotten, and tried again some steps later.
                history = Some((0.8 * inverse.contraction, None));
            }
        }
        *known = None;
        let solved = self.solve_afresh(newton, best, known);
        if let (Some(inverse), Some((contraction, first))) = (known, history) {
            inverse.contraction = contraction;
            inverse.first = first.unwrap_or(inverse.first);
        }
        solved
    }

    /// A root near the best point so far, with Jacobians of the equation itself.
    fn solve_afresh(
        &self,
        newton: &Newton,
        mut best: Iterate<L>,
        known: &mut Option<Inverse<L>>,
    ) -> Result<Root<L>, Iterate<L>> {
        let mut first = None;
        while let Some(at) = self.linearise(&best.best) {
            best.residual = magnitude(&at.residual);
            let mut bounds = at.rounding.bounds(self.parts, &at.jacobian);
            let all = bounds.numbers_mut().iter_mut().zip(best.best.numbers());
            all.for_each(|(bound, u)| *bound += u.abs() * f64::EPSILON);
            let residual_bound = magnitude(&bounds);
            let stalled = newton.stall * residual_bound;
            let Some(mut inverse) = Inverse::of(self.parts, &at, NORM * residual_bound) else {
                // The equation does not determine a solution here, however small the residual is.
                break;
            };
            let here = Start { residual: at.residual, evidence: at.evidence, stalled };
            let progress = self.correct(newton, here, &mut inverse, &mut best);
            inverse.first = *first.get_or_insert(inverse.first);
            match progress {
                Progress::Solved(round_off, evidence) => {
                    inverse.contraction = 0.0;
                    *known = Some(inverse);
                    return Ok(best.solved(round_off, evidence, residual_bound));
                }
                Progress::Slow if best.iterations < newton.iterations => {}
                Progress::Slow | Progress::Stuck => break,
            }
        }
        Err(best)
    }

    /// Corrects the best point with one Jacobian as long as the residual falls fast.
    fn correct(
        &self,
        newton: &Newton,
        here: Start<L>,
        inverse: &mut Inverse<L>,
        best: &mut Iterate<L>,
    ) -> Progress<L> {
        let round_off = inverse.round_off(self.parts, &best.best);
        let measure = Measure::new(&round_off);
        let (residual_bound, most) = (newton.tolerance * inverse.residual_bound, newton.tolerance);
        let own = here.stalled > 0.0;
        let Start { residual, mut evidence, stalled } = here;
        let mut correction = inverse.matrix.times(&residual);
        let mut size = measure.of(&correction);
        inverse.first = best.residual / inverse.residual_bound;
        // Before a Jacobian has been seen to contract here, nothing is left to it.
        let (mut contraction, mut expected) = (f64::INFINITY, 1.0);
        // Whether the equation's own Jacobian has had so little left to do that what remains is noise.
        let mut is_noise = false;
        for taken in 0_usize.. {
            if best.residual <= residual_bound && size <= most {
                // A displacement within its round-off is that of a state at rest.
                let enough = if measure.of(&best.best) <= 1.0 {
                    1.0
                } else if is_noise {
                    0.3
                } else {
                    0.1
                };
                if best.residual <= enough * residual_bound && size <= enough * most {
                    return Progress::Solved(round_off, evidence);
                }
            }
            best.iterations += 1;
            let round = best.residual <= residual_bound
                || contraction * best.residual <= SURE * residual_bound;
            if round && expected * size <= most && is_small(&correction, &best.best, &round_off) {
                // What a slow contraction leaves below round-off has the same sign in each step; it costs one more solution to take
                // it out.
                add(&mut best.best, -1.0, &correction);
                best.residual *= contraction.min(1.0);
                return Progress::Solved(round_off, evidence);
            }
            let contracts =
                |value: &L::Vector| measure.of(&inverse.matrix.times(value)) < 0.5 * size;
            let Some(next) = self.descend(newton, best, &correction, contracts) else {
                return if own && taken > 0 && size > newton.stall {
                    // The Jacobian is no longer that of this point.
                    Progress::Slow
                } else if best.residual <= if own { stalled } else { residual_bound }
                    && (own || size <= NEAR * most)
                {
                    Progress::Solved(round_off, evidence)
                } else {
                    Progress::Stuck
                };
            };
            let (before, size_before, step) = (best.residual, size, correction);
            evidence = next.at.evidence;
            (best.best, best.residual) = (next.u, next.size);
            correction = inverse.matrix.times(&next.at.residual);
            size = measure.of(&correction);
            (contraction, expected) = (best.residual / before, size / size_before);
            is_noise = own && before <= NOISE * residual_bound;
            if !own && taken == 0 {
                inverse.contraction = contraction;
            }
            // The norm of the residual falls too slowly, or that of a component which the norm hides.
            let slow = best.residual > f64::max(newton.reuse * before, residual_bound);
            let hidden = best.residual <= residual_bound
                && size > f64::max(newton.reuse * size_before, most);
            if slow || hidden {
                let stagnates = best.residual > 0.5 * before && size > 0.5 * size_before;
                if stagnates && best.residual <= stalled {
                    return Progress::Solved(round_off, evidence);
                }
                // Close to round-off it is the noise that is slow, not the Jacobian.
                if best.residual > NEAR * residual_bound || hidden && size > NEAR * most {
                    return Progress::Slow;
                }
            }
            // The change of a residual near its round-off is noise.
            if before > NOISE * residual_bound {
                let taken = self.parts.vector(|i| step[i] * -next.length);
                let predicted = self.parts.vector(|i| correction[i] - step[i]);
                inverse.learn(&taken, &predicted, &mut correction);
            }
            // Another equation's Jacobian gets its corrections, the last one unchecked.
            let remaining = corrections(self.parts.n()).saturating_sub(taken + 1).max(1);
            let limit = SURE * residual_bound;
            if !own
                && best.residual > residual_bound
                && !reaches(best.residual, contraction, remaining, limit)
            {
                return Progress::Slow;
            }
        }
        Progress::Slow
    }

    /// The longest of the corrections `δ, δ/2, δ/4, …` that reduces the residual, or the whole one if it `contracts` all the same.
    fn descend(
        &self,
        newton: &Newton,
        best: &Iterate<L>,
        correction: &L::Vector,
        contracts: impl Fn(&L::Vector) -> bool,
    ) -> Option<Descent<L>> {
        let mut length = 1.0;
        for halving in 0..=newton.halvings {
            let u = self.parts.vector(|i| best.best[i] - correction[i] * length);
            if let Some(at) = self.evaluate(&u) {
                let size = magnitude(&at.residual);
                let falls = size < best.residual * (1.0 - 1e-4 * length);
                if falls || halving == 0 && contracts(&at.residual) {
                    return Some(Descent { u, at, size, length });
                }
            }
            length *= 0.5;
        }
        None
    }
}
