//! The linear systems of a step, by one decomposition of the dimension of the system. As in [`crate::collocation`], whose file of
//! this name has the formulas.

use super::covectors::{combined, each_stage, zeros};
use super::equation::{Evaluated, StageEquation, Unknowns};
use crate::collocation::equation::Left;
use crate::collocation::linear::{HALF_OF_THE_DIGITS, LEFT, LONGER, MARGIN, PASSES};
use crate::collocation::tableau::Tableau;
use crate::implicit::algebra::{Matrix, add, dot, magnitude, vector};
use crate::implicit::metric::MetricAlong;
use crate::implicit::parts::{Parts, Second, WithJacobian};
use crate::implicit::velocity::{Turn, VelocityJet, velocity_jet};
use crate::numbers::{Lengths, List};
use crate::round_off::bound::ROUNDED;
use crate::step::Vector as _;

/// The linear part of the equation of a step.
pub(super) struct Linear<L: Lengths> {
    pub(super) tableau: &'static Tableau,
    /// The size of the step that it was formed for.
    pub(super) h: f64,
    /// The matrix `hJ`.
    pub(super) slope: Matrix<L>,
    /// The matrix `M⁻¹`.
    pub(super) inverse: Matrix<L>,
    /// The round-off of the terms of a displacement.
    pub(super) rounded: L::Vector,
    /// The solution with the terms as the right side.
    pub(super) terms: L::Vector,
    /// The derivative of a displacement along the covector of the energy, and `M⁻¹` times it.
    pub(super) sensitivity: Matrix<L>,
    /// The round-off by that of the points.
    pub(super) moved: L::Vector,
    /// The displacement that it was formed at, without its sign.
    pub(super) displaced: L::Vector,
    /// The rate `h|K'|` of the friction.
    pub(super) friction: f64,
    /// The rate `h|Π'|` of the reversible motion.
    pub(super) rotation: f64,
    /// Steps since the one that it was formed in.
    pub(super) age: u32,
}

// By hand, because lengths have none.
impl<L: Lengths> Clone for Linear<L> {
    fn clone(&self) -> Self {
        let Self { slope, inverse, rounded, terms, sensitivity, moved, displaced, .. } = self;
        Self {
            slope: slope.clone(),
            inverse: inverse.clone(),
            rounded: rounded.clone(),
            terms: terms.clone(),
            sensitivity: sensitivity.clone(),
            moved: moved.clone(),
            displaced: displaced.clone(),
            ..*self
        }
    }
}

/// The number of variables up to which derivatives are formed in each step, because they cost less than the corrections that they save.
/// A factor of four fails `implicit.rs::derivatives_of_many_variables_serve_many_steps`.
const FEW: usize = 6;
/// Steps that derivatives serve, because the sizes of the terms may change.
const STEPS: u32 = 20;
/// Evaluations of a step after which its derivatives serve no other one.
/// A factor of four fails `implicit.rs::derivatives_of_many_variables_serve_many_steps`.
const EVALUATIONS: usize = 6;

/// The velocity at a point with its derivatives along the point.
fn slopes<L: Lengths>(parts: &Parts<'_, L>, z: &L::State) -> Option<VelocityJet<L>> {
    let w = parts.each_law(|law| {
        let Second { df, hf, .. } = parts.second(law, z);
        WithJacobian::new(df, hf)
    });
    let (metric, one) = (parts.metric(z)?, Matrix::scaled_one(parts.n(), 1.0));
    let along = MetricAlong::of(&metric, parts.model(), (z, &one));
    velocity_jet(parts, (z, Turn::Scaled(1.0), along.as_ref()), &w)
}

impl<L: Lengths> Linear<L> {
    /// The linear part in the middle of a step with these velocities; `None` where it is not defined, or has no inverse.
    pub(super) fn of(equation: &StageEquation<'_, L>, k: &Unknowns<L>) -> Option<Self> {
        let &StageEquation { tableau, parts, x, h, .. } = equation;
        let chart = equation.chart(k)?;
        let jet = slopes(parts, &chart.z)?;
        let one = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
        let slope = jet.velocity.slope.map(|slope| slope * h);
        let slope = chart.map_to_start(parts, x, slope);
        let inverse = parts.matrix(|i, j| one(i, j) - slope[(i, j)] * tableau.gamma).inverse()?;
        let displaced = chart.d.map(f64::abs);
        let mut sizes = parts.scales(x);
        add(&mut sizes, 1.0, &displaced);
        let of_points = parts.matrix(|i, j| (one(i, j) - inverse[(i, j)]).abs());
        let moved = of_points.times(&sizes).map(|moved| moved * f64::EPSILON);
        let rounded =
            jet.terms.map(|terms| ROUNDED * h.abs() * terms + f64::MIN_POSITIVE * (1.0 + h.abs()));
        let terms = inverse.abs_times(&rounded);
        let sensitivity = inverse.product(&jet.sensitivity.map(|slope| slope * h));
        let usable = slope.magnitude().is_finite() && inverse.magnitude().is_finite();
        let (friction, rotation) = (h.abs() * jet.friction, h.abs() * jet.rotation);
        usable.then_some(Self {
            tableau,
            h,
            slope,
            inverse,
            rounded,
            terms,
            sensitivity,
            moved,
            displaced,
            friction,
            rotation,
            age: 0,
        })
    }

    /// The number of variables.
    fn n(&self) -> usize {
        self.slope.n()
    }

    /// Returns whether it may serve a step of size `h` with this guess of the displacement: one of the same size, about as long.
    pub(super) fn serves(&self, tableau: &Tableau, h: f64, guess: &L::Vector) -> bool {
        let fraction = magnitude(guess) / magnitude(&self.displaced);
        std::ptr::eq(self.tableau, tableau)
            && self.n() == guess.numbers().len()
            && self.h.to_bits() == h.to_bits()
            && self.age < STEPS
            && (0.7..1.5).contains(&fraction)
    }

    /// Returns whether they serve the next step, after one that has taken so many evaluations with it.
    pub(super) fn is_kept(&self, evaluations: usize) -> bool {
        self.n() > FEW && evaluations <= EVALUATIONS
    }

    /// The round-off of the displacement of a stage.
    pub(super) fn round_off(&self, at: &Evaluated<L>, k: &Unknowns<L>) -> L::Vector {
        let k = &k[..self.tableau.stages];
        let heat = self.inverse.abs_times(&at.heat_rounding);
        let noise = self.sensitivity.abs_times(&at.noise);
        vector(self.n(), |c| {
            let largest = k.iter().map(|k| (self.h * k[c]).abs()).fold(0.0, f64::max);
            let first = self.terms[c] + noise[c] + self.moved[c] + heat[c];
            (first + largest * f64::EPSILON) * MARGIN
        })
    }

    /// Returns whether it was formed at far longer displacements than `d` from a state whose entries have these sizes.
    pub(super) fn is_of_a_longer_step(&self, sizes: &L::Vector, d: &L::Vector) -> bool {
        (0..self.n()).any(|c| {
            let noise = MARGIN * (self.terms[c] + self.moved[c]);
            self.displaced[c] > LONGER * (sizes[c] + d[c].abs() + noise)
        })
    }

    /// Returns whether a velocity at the start moves entries of these sizes, by more than its round-off.
    pub(super) fn moves(&self, velocity: &L::Vector, sizes: &L::Vector) -> bool {
        let asked = self.inverse.times(velocity);
        (0..self.n()).any(|c| {
            let rounded = (self.terms[c] + self.moved[c]) * MARGIN;
            (asked[c] * self.h).abs() > rounded.max(HALF_OF_THE_DIGITS * sizes[c])
        })
    }

    /// The round-off of the terms of a velocity.
    pub(super) fn rounding(&self) -> L::Vector {
        let rate = self.h.abs().recip();
        self.rounded.map(|rounded| rounded * rate)
    }

    /// The errors of the laws that a residual leaves, in units of round-off. The unit for the production of entropy is that of its
    /// terms, of the heat, and of the covectors of the energy.
    pub(super) fn excess(&self, at: &Evaluated<L>) -> f64 {
        let Left { work, size } = at.entropy;
        if work == 0.0 {
            return at.excess;
        }
        let in_units = |rounded: &L::Vector| {
            work.abs() / (ROUNDED * size + dot(&at.entropy_covector, rounded))
        };
        let of_terms = in_units(&self.rounded);
        if of_terms <= 1.0 {
            return at.excess.max(of_terms);
        }
        let mut by_covectors = self.sensitivity.abs_times(&at.noise);
        add(&mut by_covectors, 1.0, &at.heat_rounding);
        add(&mut by_covectors, 1.0, &self.rounded);
        at.excess.max(in_units(&by_covectors))
    }

    /// The root mean square of displacements by these velocities, in units of their round-off; infinite if it is not
    /// finite.
    pub(super) fn measure(&self, v: &Unknowns<L>, round_off: &L::Vector) -> f64 {
        let (stages, n) = (self.tableau.stages, self.n());
        let mut sum = 0.0;
        for v in &v[..stages] {
            for c in 0..n {
                let units = self.h * v[c] / round_off[c].max(f64::MIN_POSITIVE);
                sum += units * units;
            }
        }
        let count = (stages * n) as f64;
        if sum.is_finite() { (sum / count).sqrt() } else { f64::INFINITY }
    }

    /// The [correction](Self::correction) as the sum `Σ_m (A ⊗ hJ)^m ρ`, which needs one product in place of three, where each term is
    /// a tenth of the one before it; `None` elsewhere.
    fn by_powers(
        &self,
        parts: &Parts<'_, L>,
        residual: &Unknowns<L>,
        round_off: &L::Vector,
    ) -> Option<(Unknowns<L>, f64)> {
        let Tableau { stages: s, matrix, .. } = *self.tableau;
        let (mut delta, mut term) = (residual.clone(), residual.clone());
        let mut before = self.measure(&term, round_off);
        for _ in 0..PASSES {
            term = each_stage(parts, s, |i| self.slope.times(&combined(1.0, s, &matrix[i], &term)));
            let of_term = self.measure(&term, round_off);
            // Not so if it is not a number.
            let falls = of_term <= 0.1 * before;
            if !falls {
                return None;
            }
            for i in 0..s {
                add(&mut delta[i], 1.0, &term[i]);
            }
            let size = self.measure(&delta, round_off);
            if of_term <= LEFT * size {
                return Some((delta, size));
            }
            before = of_term;
        }
        None
    }

    /// The correction of the velocities by a residual, and its measure.
    pub(super) fn correction(
        &self,
        parts: &Parts<'_, L>,
        residual: &Unknowns<L>,
        round_off: &L::Vector,
    ) -> (Unknowns<L>, f64) {
        let Self { slope, inverse, .. } = self;
        let Tableau { stages: s, matrix, inverse: coefficients, gamma, .. } = *self.tableau;
        if self.n() > FEW
            && self.friction + self.rotation < 1.0
            && let Some(solved) = self.by_powers(parts, residual, round_off)
        {
            return solved;
        }
        let (mut delta, mut rho, mut size) = (zeros(parts), residual.clone(), 0.0);
        for _ in 0..PASSES {
            let change = each_stage(parts, s, |i| {
                let mut g = combined(gamma, s, &coefficients[i], &rho);
                let rest = inverse.times(&parts.vector(|c| rho[i][c] - g[c]));
                add(&mut g, 1.0, &rest);
                inverse.times(&g)
            });
            for i in 0..s {
                add(&mut delta[i], 1.0, &change[i]);
            }
            size = self.measure(&delta, round_off);
            if self.measure(&change, round_off) <= LEFT * size {
                break;
            }
            for i in 0..s {
                let along = slope.times(&combined(1.0, s, &matrix[i], &delta));
                rho[i] = parts.vector(|c| residual[i][c] - (delta[i][c] - along[c]));
            }
        }
        (delta, size)
    }
}
