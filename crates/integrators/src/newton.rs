//! Newton's method, down to the round-off of each component.

mod equation;
mod inverse;

use metriplectic_fields::{Column, Dimension, Space, Vector};

pub use equation::{Equation, Evaluated, Iterate, Linearised, Root, Rounding, Stiffness};
pub(crate) use inverse::{INVERTED, Inverse, MARGIN, corrections, reaches};

/// Newton's method, damped, down to round-off.
///
/// The inverse of a Jacobian is kept as long as it serves, from one step to the next: each correction
/// then costs only a residual, from which the inverse learns (Broyden 1965). That of an earlier step is
/// used where three corrections, or `n/2` in a dimension above 6, are expected to be enough, by the contraction
/// that it has shown of late;
/// otherwise a new one is formed, at the guess or where the first correction has led.
///
/// Components of a solution may have different units, so **convergence is measured per component**: by
/// the correction `δ = J⁻¹F` in units of the round-off of the solution, `η_i = Σ_j |J⁻¹_ij| r_j +
/// |J⁻¹G|_ij η_j + |1 − J⁻¹|_ij ξ_j + ε|u_i|` with the [round-off of the equation](Rounding). The measure is the root mean
/// square of `δ_i/η_i`; it is the same number in all units (Deuflhard 2004, on affine covariance). The
/// norm of the residual only decides whether a correction is taken, and whether the method has failed.
///
/// The last correction is not followed by another residual if the contraction so far says that the next one
/// would be a hundredth of the round-off: in other directions the next contraction may be slower.
///
/// It stops where the correction is round-off, or where it no longer falls and the residual is within a
/// small multiple of its round-off. Stagnation above that multiple is not convergence.
///
/// ```
/// use metriplectic_integrators::Newton;
/// let patient = Newton { iterations: 50, ..Newton::default() };
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Newton {
    /// The correction that counts as solved, in units of the round-off of the solution.
    pub tolerance: f64,
    /// The multiple of its round-off at which a residual that no longer falls counts as solved.
    pub stall: f64,
    /// If a correction is followed by one of more than this fraction of it, a new Jacobian is formed.
    pub reuse: f64,
    /// Linear systems that may be solved.
    pub iterations: usize,
    /// Halvings of one correction that does not reduce the residual.
    pub halvings: usize,
}

impl Default for Newton {
    fn default() -> Self {
        Self { tolerance: 1.0, stall: 100.0, reuse: 0.05, iterations: 30, halvings: 8 }
    }
}

/// A measure of corrections: the root mean square of their components in units of round-off.
struct Measure<N: Dimension> {
    /// The reciprocals of the round-off of each component.
    reciprocals: N::Vector<f64>,
}

impl<N: Dimension> Measure<N> {
    #[inline]
    fn new(round_off: &N::Vector<f64>) -> Self {
        // A component without round-off is exact, and so is its correction.
        Self {
            reciprocals: N::Vector::<f64>::from_index(|i| {
                round_off[i].max(f64::MIN_POSITIVE).recip()
            }),
        }
    }

    /// The size of a correction; infinite if it is not finite.
    #[inline]
    fn of(&self, correction: &N::Vector<f64>) -> f64 {
        let mut sum = 0.0;
        for i in 0..N::LEN {
            let units = correction[i] * self.reciprocals[i];
            sum += units * units;
        }
        if sum.is_finite() { (sum / N::LEN as f64).sqrt() } else { f64::INFINITY }
    }
}

/// The norm of a residual that is taken for round-off, in units of the norm of its bounds.
/// A factor of four fails `tests/tangent/schemes.rs::tangents_of_schemes_are_those_of_differences`.
pub(crate) const NORM: f64 = 3.0;
/// The multiple of round-off below which the change of a residual says nothing of the Jacobian.
/// A factor of four fails `tests/tangent/schemes.rs::tangents_of_schemes_are_those_of_differences`.
pub(crate) const NOISE: f64 = 1e3;
/// The fraction of the round-off that the last correction has to promise.
/// A factor of four fails `tests/mutations.rs::the_friction_of_a_certificate_is_that_of_the_steps_however_long_a_jacobian_is_kept`.
pub(crate) const SURE: f64 = 0.01;
/// The multiple of round-off below which a residual says little about its Jacobian.
pub(crate) const NEAR: f64 = 10.0;
/// The fraction of each component of a solution that the last correction may change unchecked.
/// A factor of four fails `newton/tests.rs::a_tenth_of_each_component_may_go_unchecked`.
pub(crate) const UNCHECKED: f64 = 0.1;

/// Returns whether a correction changes each component of a solution by a small fraction of it, or by its round-off. The Jacobian is then
/// close to that of the solution, and the contraction so far predicts the next one.
#[inline]
fn is_small<V: Column<f64>>(correction: &V, u: &V, round_off: &V) -> bool {
    (0..V::LEN).all(|i| correction[i].abs() <= UNCHECKED * u[i].abs() + round_off[i])
}

/// Where a Jacobian is first used.
struct Start<M: Space, E> {
    residual: Vector<M>,
    evidence: E,
    /// The norm at which a stagnating residual counts as solved: zero where the Jacobian is not that of
    /// the equation itself, because its stagnation does not prove that round-off was reached.
    stalled: f64,
}

/// How far one Jacobian has brought the iteration.
enum Progress<M: Space, E> {
    /// The correction is round-off, of this size in each component of the solution; with what the last
    /// evaluation told.
    Solved((Vector<M>, E)),
    /// It falls too slowly for this Jacobian.
    Slow,
    /// It does not fall.
    Stuck,
}

impl Newton {
    /// A root near the guess.
    ///
    /// # Errors
    ///
    /// [`Iterate`] with the best point found.
    pub fn solve<M: Space, Q: Equation<M>>(
        &self,
        equation: &Q,
        guess: &Vector<M>,
    ) -> Result<Root<M, Q::Evidence>, Iterate<M>> {
        self.solve_near(equation, guess, &mut None)
    }

    /// A root near the guess, first with the inverse of the Jacobian of an equation near by; the
    /// inverse that solved the equation is left in its place.
    #[inline]
    pub(crate) fn solve_near<M: Space, Q: Equation<M>>(
        &self,
        equation: &Q,
        guess: &Vector<M>,
        known: &mut Option<Inverse<M::Dim>>,
    ) -> Result<Root<M, Q::Evidence>, Iterate<M>> {
        let mut best = Iterate { best: *guess, residual: f64::INFINITY, iterations: 0 };
        let mut history = None;
        if let Some(inverse) = known {
            if inverse.serves()
                && let Some(Evaluated { residual, evidence }) = equation.evaluate(guess)
            {
                best.residual = residual.magnitude();
                let here = Start { residual, evidence, stalled: 0.0 };
                if let Progress::Solved(solution) =
                    self.correct(equation, &here, inverse, &mut best)
                {
                    inverse.age += 1;
                    let (round_off, evidence) = solution;
                    return Ok(best.solved(round_off, evidence, inverse.residual_bound / NORM));
                }
                history = Some((inverse.contraction, Some(inverse.first)));
            } else {
                // What has not served is forgotten, and tried again some steps later.
                history = Some((0.8 * inverse.contraction, None));
            }
        }
        *known = None;
        let solved = self.solve_afresh(equation, best, known);
        if let (Some(inverse), Some((contraction, first))) = (known, history) {
            inverse.contraction = contraction;
            inverse.first = first.unwrap_or(inverse.first);
        }
        solved
    }

    /// A root near the best point so far, with Jacobians of the equation itself.
    #[cold]
    fn solve_afresh<M: Space, Q: Equation<M>>(
        &self,
        equation: &Q,
        mut best: Iterate<M>,
        known: &mut Option<Inverse<M::Dim>>,
    ) -> Result<Root<M, Q::Evidence>, Iterate<M>> {
        let mut first = None;
        while let Some(at) = equation.linearise(&best.best) {
            let Linearised { residual, evidence, .. } = at;
            best.residual = residual.magnitude();
            let bounds = at.rounding.bounds(&at.jacobian) + best.best.abs() * f64::EPSILON;
            let residual_bound = bounds.magnitude();
            let stalled = self.stall * residual_bound;
            let Some(mut inverse) = Inverse::of(&at, NORM * residual_bound) else {
                // The equation does not determine a solution here, however small the residual is.
                break;
            };
            let here = Start { residual, evidence, stalled };
            let progress = self.correct(equation, &here, &mut inverse, &mut best);
            inverse.first = *first.get_or_insert(inverse.first);
            match progress {
                Progress::Solved(solution) => {
                    inverse.contraction = 0.0;
                    *known = Some(inverse);
                    let (round_off, evidence) = solution;
                    return Ok(best.solved(round_off, evidence, residual_bound));
                }
                Progress::Slow if best.iterations < self.iterations => {}
                Progress::Slow | Progress::Stuck => break,
            }
        }
        Err(best)
    }

    /// Corrects the best point with one Jacobian as long as the residual falls fast.
    #[inline]
    fn correct<M: Space, Q: Equation<M>>(
        &self,
        equation: &Q,
        here: &Start<M, Q::Evidence>,
        inverse: &mut Inverse<M::Dim>,
        best: &mut Iterate<M>,
    ) -> Progress<M, Q::Evidence> {
        let round_off = inverse.round_off(&best.best);
        let measure = Measure::<M::Dim>::new(&round_off);
        let solved = |evidence| Progress::Solved((round_off, evidence));
        let (residual_bound, most) = (self.tolerance * inverse.residual_bound, self.tolerance);
        let own = here.stalled > 0.0;
        let Start { mut residual, mut evidence, .. } = *here;
        let mut correction = inverse.times(&residual);
        let mut size = measure.of(&correction);
        inverse.first = best.residual / inverse.residual_bound;
        // Before a Jacobian has been seen to contract here, nothing is left to it: the frame may have
        // turned since the last step, as that of a sphere does across its equator.
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
                    return solved(evidence);
                }
            }
            best.iterations += 1;
            let round = best.residual <= residual_bound
                || contraction * best.residual <= SURE * residual_bound;
            if round && expected * size <= most && is_small(&correction, &best.best, &round_off) {
                // What a slow contraction leaves below round-off has the same sign in each step; it costs
                // one more solution to take it out.
                best.best -= correction;
                best.residual *= contraction.min(1.0);
                return solved(evidence);
            }
            let Some(next) = self.descend(equation, best, &correction, |value| {
                measure.of(&inverse.times(value)) < 0.5 * size
            }) else {
                return if own && taken > 0 && size > self.stall {
                    // The Jacobian is no longer that of this point.
                    Progress::Slow
                } else if best.residual <= if own { here.stalled } else { residual_bound }
                    && (own || size <= NEAR * most)
                {
                    solved(evidence)
                } else {
                    Progress::Stuck
                };
            };
            let (before, size_before, step) = (best.residual, size, correction);
            (residual, evidence) = (next.at.residual, next.at.evidence);
            (best.best, best.residual) = (next.u, next.size);
            correction = inverse.times(&residual);
            size = measure.of(&correction);
            (contraction, expected) = (best.residual / before, size / size_before);
            is_noise = own && before <= NOISE * residual_bound;
            if !own && taken == 0 {
                inverse.contraction = contraction;
            }
            // The norm of the residual falls too slowly, or that of a component which the norm hides.
            let slow = best.residual > f64::max(self.reuse * before, residual_bound);
            let hidden =
                best.residual <= residual_bound && size > f64::max(self.reuse * size_before, most);
            if slow || hidden {
                let stagnates = best.residual > 0.5 * before && size > 0.5 * size_before;
                if stagnates && best.residual <= here.stalled {
                    return solved(evidence);
                }
                // Close to round-off it is the noise that is slow, not the Jacobian.
                if best.residual > NEAR * residual_bound || hidden && size > NEAR * most {
                    return Progress::Slow;
                }
            }
            // The change of a residual near its round-off is noise.
            if before > NOISE * residual_bound {
                let taken = step * -next.length;
                let predicted = correction - step;
                inverse.learn(&taken, &predicted, &mut correction);
            }
            // Another equation's Jacobian gets its corrections, the last one unchecked.
            let remaining =
                corrections(<M::Dim as Dimension>::LEN).saturating_sub(taken + 1).max(1);
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

    /// The longest of the corrections `δ, δ/2, δ/4, …` that reduces the residual, or the whole one if it
    /// `contracts` all the same: in mixed units a component that is solved hides the others in the norm.
    #[inline]
    fn descend<M: Space, Q: Equation<M>>(
        &self,
        equation: &Q,
        best: &Iterate<M>,
        correction: &Vector<M>,
        contracts: impl Fn(&Vector<M>) -> bool,
    ) -> Option<Descent<M, Q::Evidence>> {
        let mut length = 1.0;
        for halving in 0..=self.halvings {
            let u = best.best - *correction * length;
            if let Some(at) = equation.evaluate(&u) {
                let size = at.residual.magnitude();
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

/// A point with a smaller residual, and the fraction of the correction that led to it.
struct Descent<M: Space, E> {
    u: Vector<M>,
    at: Evaluated<M, E>,
    /// The norm of the residual.
    size: f64,
    length: f64,
}

#[cfg(test)]
mod tests;
