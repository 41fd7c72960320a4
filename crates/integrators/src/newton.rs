//! Newton's method with a residual floor that follows the scale of the state.

use metriplectic_fields::{Column, Factors, Space, Square, Vector};

use crate::root_finder::{Equation, Linearised, NoRoot, Root, RootFinder};

/// Newton's method, damped, down to round-off.
///
/// The Jacobian is kept as long as it serves: with a good guess one of them is enough for a step,
/// and each further correction costs only a residual.
///
/// The last correction is not followed by another residual if the contraction so far says that it
/// would be a hundredth of the floor: in other directions the next contraction may be slower.
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
        let mut best = NoRoot { best: *guess, residual: f64::INFINITY, sweeps: 0 };
        while let Some(here) = equation.linearise(&best.best) {
            best.residual = here.residual.magnitude();
            match self.correct(equation, &here, &mut best) {
                Progress::Solved => {
                    let NoRoot { best: u, residual, sweeps } = best;
                    return Ok(Root { u, residual, floor: here.floor, sweeps });
                }
                Progress::Slow if best.sweeps < self.sweeps => {}
                Progress::Slow | Progress::Stuck => break,
            }
        }
        Err(best)
    }
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
    /// Corrects the best point with one Jacobian as long as the residual falls fast.
    fn correct<M: Space>(
        &self,
        equation: &impl Equation<M>,
        here: &Linearised<M>,
        best: &mut NoRoot<M>,
    ) -> Progress {
        let mut residual = here.residual;
        let (mut factors, mut contraction) = (None, f64::INFINITY);
        loop {
            let solved = best.residual <= self.tolerance * here.floor;
            // A displacement within the floor is that of a state at rest.
            let rests = best.best.magnitude() <= here.floor;
            if solved && (rests || best.residual <= 0.1 * self.tolerance * here.floor) {
                return Progress::Solved;
            }
            factors = factors.or_else(|| here.jacobian.factor());
            let correction = factors.as_ref().and_then(|factors| factors.solve(&residual));
            best.sweeps += 1;
            if solved {
                // What a slow contraction leaves below the floor has the same sign in each step; it
                // costs one more solution to take it out.
                if let Some(last) = correction {
                    best.best -= last;
                }
                return Progress::Solved;
            }
            if let Some(last) = &correction
                && contraction * best.residual <= 0.01 * self.tolerance * here.floor
            {
                best.best -= *last;
                best.residual *= contraction;
                return Progress::Solved;
            }
            let next = correction.and_then(|c| self.descend(equation, best, &c));
            let Some((u, value)) = next else {
                let at_floor = best.residual <= self.stall * here.floor;
                return if at_floor { Progress::Solved } else { Progress::Stuck };
            };
            let before = best.residual;
            residual = value;
            (best.best, best.residual) = (u, value.magnitude());
            contraction = best.residual / before;
            if best.residual > self.reuse * before && best.residual > self.tolerance * here.floor {
                let at_floor = best.residual <= self.stall * here.floor;
                return if at_floor && best.residual > 0.5 * before {
                    Progress::Solved
                } else {
                    Progress::Slow
                };
            }
        }
    }

    /// The longest of the corrections `δ, δ/2, δ/4, …` that reduces the residual.
    #[inline]
    fn descend<M: Space>(
        &self,
        equation: &impl Equation<M>,
        best: &NoRoot<M>,
        correction: &Vector<M>,
    ) -> Option<(Vector<M>, Vector<M>)> {
        let mut length = 1.0;
        for _ in 0..=self.halvings {
            let next = best.best - *correction * length;
            if let Some(value) = equation.value(&next)
                && value.magnitude() < best.residual * (1.0 - 1e-4 * length)
            {
                return Some((next, value));
            }
            length *= 0.5;
        }
        None
    }
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
