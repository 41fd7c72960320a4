//! Newton's method with a residual floor that follows the scale of the state.

use metriplectic_fields::{Column, Dimension, Space, Square, Vector};

use crate::root_finder::{Equation, Linearised, NoRoot, Root, RootFinder};

/// Newton's method, damped, down to round-off.
///
/// The inverse of a Jacobian is kept as long as it serves, from one step to the next: each correction
/// then costs only a residual, from which the inverse learns (Broyden 1965). That of an earlier step is
/// used where three corrections are expected to be enough, by the contraction that it has shown of late;
/// otherwise a new one is formed, at the guess or where the first correction has led.
///
/// The last correction is not followed by another residual if the contraction so far says that it would
/// be a hundredth of the floor: in other directions the next contraction may be slower.
///
/// It stops where the residual is at the floor that the equation states, or where it no longer
/// falls within a small multiple of it: a stall *at* the floor is convergence, a stall above it is
/// not.
///
/// ```
/// use metriplectic_integrators::Newton;
/// let patient = Newton { sweeps: 50, ..Newton::default() };
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Newton {
    /// The residual that counts as solved, in units of the round-off floor.
    pub tolerance: f64,
    /// The multiple of the floor at which a residual that no longer falls counts as solved.
    pub stall: f64,
    /// A correction that leaves more than this share of the residual asks for a new Jacobian.
    pub reuse: f64,
    /// Linear systems that may be solved.
    pub sweeps: usize,
    /// Halvings of one correction that does not reduce the residual.
    pub halvings: usize,
}

impl Default for Newton {
    fn default() -> Self {
        Self { tolerance: 1.0, stall: 100.0, reuse: 0.05, sweeps: 30, halvings: 8 }
    }
}

impl<M: Space> RootFinder<M> for Newton {
    fn solve(&self, equation: &impl Equation<M>, guess: &Vector<M>) -> Result<Root<M>, NoRoot<M>> {
        self.solve_near(equation, guess, &mut None)
    }
}

/// The inverse of a Jacobian, kept up to date by Broyden's rank-one corrections.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Inverse<N: Dimension> {
    pub(crate) matrix: N::Matrix<f64>,
    /// The share of a residual that the first correction by a kept inverse has left of late.
    pub(crate) contraction: f64,
    /// The residual of the guess in the last step, in units of its floor.
    pub(crate) first: f64,
}

impl<N: Dimension> Inverse<N> {
    fn of(jacobian: &N::Matrix<f64>) -> Option<Self> {
        Some(Self { matrix: jacobian.inverse()?, contraction: 0.0, first: 0.0 })
    }

    /// Whether three corrections of the next guess are expected to be enough, the last one unchecked.
    fn serves(&self) -> bool {
        self.contraction.powi(3) * self.first <= SURE
    }

    /// The correction of a residual.
    #[inline]
    fn times(&self, residual: &N::Vector<f64>) -> N::Vector<f64> {
        self.matrix * *residual
    }

    /// Broyden's update: the least change of the inverse after which the step `s` has the change `y`
    /// of the residual, `s = J⁻¹y`, with `predicted = J⁻¹y` before it (Broyden 1965, in the form of
    /// Sherman and Morrison).
    #[inline]
    fn learn(&mut self, s: &N::Vector<f64>, predicted: &N::Vector<f64>) {
        let along = s.dot(predicted);
        // Beyond a factor of four the step says little about the slope.
        if along > 0.25 * s.dot(s) {
            let row = self.matrix.transpose_times(s);
            self.matrix += N::Matrix::<f64>::outer(&((*s - *predicted) * along.recip()), &row);
        }
    }
}

/// The multiple of the floor below which the change of a residual says nothing of the Jacobian.
const NOISE: f64 = 1e3;
/// The share of the floor that the last correction has to promise.
const SURE: f64 = 0.01;
/// The multiple of the floor below which a residual says little about its Jacobian.
const NEAR: f64 = 10.0;

/// Where a Jacobian is first used.
struct Start<M: Space> {
    residual: Vector<M>,
    floor: f64,
    /// Whether the Jacobian is that of the equation itself, and not of one near by.
    own: bool,
}

/// How far one Jacobian has brought the iteration.
enum Progress {
    /// The residual is round-off.
    Solved,
    /// It falls too slowly for this Jacobian.
    Slow,
    /// It does not fall.
    Stuck,
}

impl Newton {
    /// A root near the guess, first with the inverse of the Jacobian of an equation near by; the
    /// inverse that solved the equation is left in its place.
    #[inline]
    pub(crate) fn solve_near<M: Space>(
        &self,
        equation: &impl Equation<M>,
        guess: &Vector<M>,
        known: &mut Option<Inverse<M::Dim>>,
    ) -> Result<Root<M>, NoRoot<M>> {
        let mut best = NoRoot { best: *guess, residual: f64::INFINITY, sweeps: 0 };
        let (mut contraction, mut first) = (0.0, None);
        if let Some(inverse) = known {
            if inverse.serves()
                && let Some((residual, floor)) = equation.value_and_floor(guess)
            {
                best.residual = residual.magnitude();
                inverse.first = best.residual / floor;
                first = Some(inverse.first);
                let here = Start { residual, floor, own: false };
                if let Progress::Solved = self.correct(equation, here, Some(inverse), &mut best) {
                    return Ok(best.solved(floor));
                }
            } else {
                // What has not served is forgotten, and tried again some steps later.
                inverse.contraction *= 0.8;
            }
            contraction = inverse.contraction;
        }
        *known = None;
        let solved = self.solve_afresh(equation, best, known);
        if let Some(inverse) = known {
            inverse.contraction = contraction;
            inverse.first = first.unwrap_or(inverse.first);
        }
        solved
    }

    /// A root near the best point so far, with Jacobians of the equation itself.
    #[cold]
    fn solve_afresh<M: Space>(
        &self,
        equation: &impl Equation<M>,
        mut best: NoRoot<M>,
        known: &mut Option<Inverse<M::Dim>>,
    ) -> Result<Root<M>, NoRoot<M>> {
        let mut first = None;
        while let Some(Linearised { residual, jacobian, floor }) = equation.linearise(&best.best) {
            best.residual = residual.magnitude();
            let first = *first.get_or_insert(best.residual / floor);
            let mut inverse = Inverse::of(&jacobian).map(|inverse| Inverse { first, ..inverse });
            let here = Start { residual, floor, own: true };
            match self.correct(equation, here, inverse.as_mut(), &mut best) {
                Progress::Solved => {
                    *known = inverse;
                    return Ok(best.solved(floor));
                }
                Progress::Slow if best.sweeps < self.sweeps => {}
                Progress::Slow | Progress::Stuck => break,
            }
        }
        Err(best)
    }

    /// Corrects the best point with one Jacobian as long as the residual falls fast.
    #[inline]
    fn correct<M: Space>(
        &self,
        equation: &impl Equation<M>,
        here: Start<M>,
        mut inverse: Option<&mut Inverse<M::Dim>>,
        best: &mut NoRoot<M>,
    ) -> Progress {
        let floor = self.tolerance * here.floor;
        // A stall of another equation's Jacobian is no round-off: the equation's own is to say so.
        let stalled = if here.own { self.stall * here.floor } else { floor };
        let correct = |inverse: &Inverse<M::Dim>, residual: &Vector<M>| {
            Some(inverse.times(residual)).filter(|correction| correction.is_finite())
        };
        let mut residual = here.residual;
        let mut correction = inverse.as_deref().and_then(|inverse| correct(inverse, &residual));
        // Before a Jacobian has been seen to contract here, nothing is left to it: the frame may have
        // turned since the last step, as that of a sphere does across its equator.
        let mut contraction = f64::INFINITY;
        // Whether the equation's own Jacobian has had so little left to do that what remains is noise.
        let mut settled = false;
        loop {
            // A displacement within the floor is that of a state at rest.
            let rests = best.best.magnitude() <= here.floor;
            let enough = if rests {
                1.0
            } else if settled {
                0.3
            } else {
                0.1
            };
            if best.residual <= enough * floor {
                return Progress::Solved;
            }
            best.sweeps += 1;
            let last =
                best.residual <= floor || contraction * best.residual <= self.sure(here.floor);
            if last {
                // What a slow contraction leaves below the floor has the same sign in each step; it
                // costs one more solution to take it out.
                if let Some(last) = correction {
                    best.best -= last;
                    best.residual *= contraction.min(1.0);
                }
                return Progress::Solved;
            }
            let next = correction.and_then(|c| self.descend(equation, best, &c));
            let (Some(next), Some(inverse), Some(step)) = (next, inverse.as_mut(), correction)
            else {
                return if best.residual <= stalled { Progress::Solved } else { Progress::Stuck };
            };
            let before = best.residual;
            residual = next.value;
            (best.best, best.residual) = (next.u, residual.magnitude());
            contraction = best.residual / before;
            settled = here.own && before <= NOISE * floor;
            if !here.own && best.sweeps == 1 {
                inverse.contraction = contraction;
            }
            if best.residual > self.reuse * before && best.residual > floor {
                if best.residual <= stalled && best.residual > 0.5 * before {
                    return Progress::Solved;
                }
                // Close to the floor it is the round-off that is slow, not the Jacobian.
                if best.residual > NEAR * floor {
                    return Progress::Slow;
                }
            }
            correction = correct(inverse, &residual);
            // The change of a residual near its floor is noise.
            if let Some(ahead) = &mut correction
                && before > NOISE * floor
            {
                let taken = step * -next.length;
                let predicted = *ahead - step;
                inverse.learn(&taken, &predicted);
                *ahead = inverse.times(&residual);
            }
            // Another equation's Jacobian gets two corrections, and the last one.
            let left = contraction.powi(if best.sweeps == 1 { 2 } else { 1 }) * best.residual;
            if !here.own && best.residual > floor && left > self.sure(here.floor) {
                return Progress::Slow;
            }
        }
    }

    /// The residual that needs no evaluation to be believed.
    const fn sure(&self, floor: f64) -> f64 {
        SURE * self.tolerance * floor
    }

    /// The longest of the corrections `δ, δ/2, δ/4, …` that reduces the residual.
    #[inline]
    fn descend<M: Space>(
        &self,
        equation: &impl Equation<M>,
        best: &NoRoot<M>,
        correction: &Vector<M>,
    ) -> Option<Descent<M>> {
        let mut length = 1.0;
        for _ in 0..=self.halvings {
            let u = best.best - *correction * length;
            if let Some(value) = equation.value(&u)
                && value.magnitude() < best.residual * (1.0 - 1e-4 * length)
            {
                return Some(Descent { u, value, length });
            }
            length *= 0.5;
        }
        None
    }
}

/// A point with a smaller residual, and the share of the correction that led to it.
struct Descent<M: Space> {
    u: Vector<M>,
    value: Vector<M>,
    length: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use metriplectic_manifolds::Euclidean;
    use nalgebra::{Matrix1, Matrix2, Vector1, Vector2, vector};

    /// `x² + y² = 4`, `xy = 1`.
    struct CircleAndHyperbola;

    impl Equation<Euclidean<2>> for CircleAndHyperbola {
        fn value(&self, u: &Vector2<f64>) -> Option<Vector2<f64>> {
            self.linearise(u).map(|at| at.residual)
        }

        fn linearise(&self, u: &Vector2<f64>) -> Option<Linearised<Euclidean<2>>> {
            Some(Linearised {
                residual: vector![u.norm_squared() - 4.0, u.x * u.y - 1.0],
                jacobian: Matrix2::new(2.0 * u.x, 2.0 * u.y, u.y, u.x),
                floor: 8.0 * f64::EPSILON,
            })
        }
    }

    #[test]
    fn convergence_is_quadratic_with_a_jacobian_for_each_correction() {
        let fresh = Newton { reuse: 0.0, ..Newton::default() };
        let root = fresh.solve(&CircleAndHyperbola, &vector![2.0, 0.4]).unwrap();
        // x² = 2 + √3 in closed form.
        assert!((root.u.x - (2.0 + 3.0_f64.sqrt()).sqrt()).abs() < 1e-15);
        assert!(root.sweeps <= 5, "{} sweeps", root.sweeps);
    }

    /// `ln u = 1`, defined for `u > 0` only.
    struct Logarithm;

    impl Equation<Euclidean<1>> for Logarithm {
        fn value(&self, u: &Vector1<f64>) -> Option<Vector1<f64>> {
            self.linearise(u).map(|at| at.residual)
        }

        fn linearise(&self, u: &Vector1<f64>) -> Option<Linearised<Euclidean<1>>> {
            let residual = vector![u.x.ln() - 1.0];
            let jacobian = Matrix1::new(u.x.recip());
            (u.x > 0.0).then_some(Linearised { residual, jacobian, floor: 4.0 * f64::EPSILON })
        }
    }

    #[test]
    fn damping_backs_off_from_the_edge_of_the_domain() {
        // The undamped correction from u = 20 lands at 20 − 20 (ln 20 − 1) = −19.9.
        let root = Newton::default().solve(&Logarithm, &vector![20.0]).unwrap();
        assert!((root.u.x - 1.0_f64.exp()).abs() < 1e-14);
    }

    /// `u² + 1 = 0` has no real root.
    struct NoRealRoot;

    impl Equation<Euclidean<1>> for NoRealRoot {
        fn value(&self, u: &Vector1<f64>) -> Option<Vector1<f64>> {
            self.linearise(u).map(|at| at.residual)
        }

        fn linearise(&self, u: &Vector1<f64>) -> Option<Linearised<Euclidean<1>>> {
            Some(Linearised {
                residual: vector![u.x * u.x + 1.0],
                jacobian: Matrix1::new(2.0 * u.x),
                floor: f64::EPSILON,
            })
        }
    }

    #[test]
    fn a_missing_root_is_an_error_with_the_best_point() {
        let failure = Newton::default().solve(&NoRealRoot, &vector![3.0]).unwrap_err();
        assert!(failure.residual >= 1.0 && failure.residual < 10.0);
        let undefined = Newton::default().solve(&Logarithm, &vector![-1.0]).unwrap_err();
        assert!(undefined.residual.is_infinite());
    }
}
