//! The linear systems of a step, by one real decomposition of the dimension of the system.
//!
//! The corrections `Δ` solve `(I − hA ⊗ J) Δ = r`, with the Jacobian `J` of the equation of motion in the middle. The
//! blended iteration (Brugnano, Magherini 2002) combines this system and its equivalent
//! `(γA⁻¹ ⊗ I − γh I ⊗ J) Δ = γA⁻¹ r` by the matrix `M = I − γhJ`,
//!
//! ```math
//! \rho = r - (I - hA \otimes J)\,\Delta, \qquad g = \gamma A^{-1}\rho, \qquad
//! \Delta \mathrel{+}= M^{-1}\bigl(g + M^{-1}(\rho - g)\bigr) ,
//! ```
//!
//! with `γ = min |λ(A)|`. It converges for every `hJ` whose eigenvalues have no positive real part, and its cost does
//! not depend on the closures.

use metriplectic_dynamics::orthogonal::WithJacobian;
use metriplectic_dynamics::velocity::{Covectors, Gradient, velocity_jet};
use metriplectic_dynamics::{Metriplectic, system::Point};
use metriplectic_fields::{ChartPoint, Column, Dimension, Matrix, ScalarField, Space, Square};
use metriplectic_manifolds::Manifold;

use super::covectors::{Stages, combined};
use super::equation::{Evaluated, Left, StageEquation, Unknowns};
use super::tableau::{STAGES, Tableau};
use crate::round_off::bound::ROUNDED;
use crate::step::Dim;

/// The linear part of the equation of a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Linear<N: Dimension> {
    tableau: &'static Tableau,
    h: f64,
    /// The matrix `hJ`, at the start of the step.
    slope: N::Matrix<f64>,
    /// The matrix `M⁻¹`.
    inverse: N::Matrix<f64>,
    /// The round-off of the terms of a displacement.
    rounded: N::Vector<f64>,
    /// The solution with the terms as the right side.
    terms: N::Vector<f64>,
    /// The derivative of a displacement along the covector of the energy, and `M⁻¹` times it.
    sensitivity: N::Matrix<f64>,
    /// The round-off by that of the points.
    moved: N::Vector<f64>,
    /// The displacement that it was formed at, without its sign.
    displaced: N::Vector<f64>,
    /// The rate `h|K'|` of the friction.
    pub(super) friction: f64,
    /// The rate `h|Π'|` of the reversible motion.
    pub(super) rotation: f64,
}

/// Iterations of the linear system.
pub(crate) const PASSES: usize = 12;
/// The fraction of a correction that the linear system may leave.
/// A factor of four fails `tests/stiff_friction.rs::units_change_nothing`.
pub(crate) const LEFT: f64 = 1e-3;
/// The factor between the bound of round-off to first order and what is taken for round-off.
/// A factor of four fails `tests/collocation.rs::one_stage_is_the_scheme_of_the_paper`.
pub(crate) const MARGIN: f64 = 3.0;
/// The ratio of the displacement of a guess to the size that an entry has on a step, above which the round-off there is not that of the
/// step: it may be longer than the step itself.
/// A factor of four fails `collocation/linear.rs::a_linear_part_serves_displacements_of_its_own_size`.
pub(crate) const LONGER: f64 = 256.0;

/// The displacement of an entry, relative to its size, from which on a state is not at rest.
pub(crate) const HALF_OF_THE_DIGITS: f64 = 1.5e-8;

/// The differentials of all fields with their derivatives.
struct Hessians<'a, M: Space>(&'a M::Point<f64>);

impl<M: Space> Gradient<M> for Hessians<'_, M> {
    type Covector = WithJacobian<M::Dim>;

    fn of(&mut self, f: &impl ScalarField<M>) -> WithJacobian<M::Dim> {
        let jet = f.jet2(self.0);
        WithJacobian { value: jet.df, slope: jet.hf }
    }
}

/// The derivatives of the velocity at a point, along the chart there.
fn slopes<Y: Metriplectic>(
    system: &Y,
    z: &Point<Y>,
) -> Option<metriplectic_dynamics::velocity::VelocityJet<Dim<Y>>> {
    let mut hessians = Hessians::<Y::Manifold>(z);
    let laws = [hessians.of(system.energy()), hessians.of(system.entropy())];
    let w = Covectors::new(laws, system.invariants(), &mut hessians);
    let at = ChartPoint::centre(z);
    velocity_jet(system, &system.metric_at(&at), &Matrix::<Y::Manifold>::one(), &w).ok()
}

impl<N: Dimension> Linear<N> {
    /// The linear part in the middle of a step with these velocities; `None` where it is not defined, or has no
    /// inverse.
    pub(super) fn of<Y>(equation: &StageEquation<'_, Y>, k: &Unknowns<Y>) -> Option<Self>
    where
        Y: Metriplectic<Manifold: Space<Dim = N>>,
    {
        let &StageEquation { tableau, system, x, h, .. } = equation;
        let chart = equation.chart(k)?;
        let jet = slopes(system, &chart.z)?;
        let slope = chart.map_to_start(x, &(jet.velocity.slope * h));
        let inverse = (N::Matrix::<f64>::one() - slope * tableau.gamma).inverse()?;
        let sizes = Y::Manifold::scales(x) + chart.d.abs();
        let moved = (N::Matrix::<f64>::one() - inverse).abs() * sizes * f64::EPSILON;
        let terms = N::Vector::<f64>::from_index(|i| {
            ROUNDED * h.abs() * jet.terms[i] + f64::MIN_POSITIVE * (1.0 + h.abs())
        });
        let sensitivity = inverse * (jet.sensitivity * h);
        let usable = slope.magnitude().is_finite() && inverse.magnitude().is_finite();
        usable.then_some(Self {
            tableau,
            h,
            slope,
            inverse,
            rounded: terms,
            terms: inverse.abs() * terms,
            sensitivity,
            moved,
            displaced: chart.d.abs(),
            friction: h.abs() * jet.friction,
            rotation: h.abs() * jet.rotation,
        })
    }

    /// The matrix `M⁻¹`.
    pub(super) const fn filter(&self) -> &N::Matrix<f64> {
        &self.inverse
    }

    /// The round-off of the displacement of a stage.
    pub(super) fn round_off<Y>(&self, at: &Evaluated<Y>, k: &Unknowns<Y>) -> N::Vector<f64>
    where
        Y: Metriplectic<Manifold: Space<Dim = N>>,
    {
        let mut largest = N::Vector::<f64>::zero();
        for k in &k[..self.tableau.stages] {
            largest = N::Vector::<f64>::from_index(|c| largest[c].max((self.h * k[c]).abs()));
        }
        let heat = self.inverse.abs() * at.heat_rounding;
        let first = self.terms + self.sensitivity.abs() * at.noise + self.moved + heat;
        (first + largest * f64::EPSILON) * MARGIN
    }

    /// Returns whether it was formed at far longer displacements than `d` from a state whose entries have these sizes.
    pub(super) fn is_of_a_longer_step(&self, sizes: &N::Vector<f64>, d: &N::Vector<f64>) -> bool {
        (0..N::LEN).any(|c| {
            let noise = MARGIN * (self.terms[c] + self.moved[c]);
            self.displaced[c] > LONGER * (sizes[c] + d[c].abs() + noise)
        })
    }

    /// Returns whether a velocity at the start moves entries of these sizes, by more than its round-off. The round-off of a step has
    /// no bound where its velocities vanish or its heat has no direction, so it alone shows no rest.
    pub(super) fn moves(&self, velocity: &N::Vector<f64>, sizes: &N::Vector<f64>) -> bool {
        let asked = self.inverse * *velocity * self.h;
        let rounded = (self.terms + self.moved) * MARGIN;
        (0..N::LEN).any(|c| asked[c].abs() > rounded[c].max(HALF_OF_THE_DIGITS * sizes[c]))
    }

    /// The round-off of the terms of a velocity.
    pub(super) fn rounding(&self) -> N::Vector<f64> {
        self.rounded * self.h.abs().recip()
    }

    /// The errors of the laws that a residual leaves, in units of round-off. The unit for the production of entropy is that of its
    /// terms, which may be large where friction is stiff, of the heat, and of the covectors of the energy: the last two
    /// have the digits of the energy, and an entropy near zero has more.
    pub(super) fn excess<Y>(&self, at: &Evaluated<Y>) -> f64
    where
        Y: Metriplectic<Manifold: Space<Dim = N>>,
    {
        let Left { work, size } = at.entropy;
        if work == 0.0 {
            return at.excess;
        }
        let in_units = |rounded: N::Vector<f64>| {
            work.abs() / (ROUNDED * size + at.entropy_covector.dot(&rounded))
        };
        let of_terms = in_units(self.rounded);
        if of_terms <= 1.0 {
            return at.excess.max(of_terms);
        }
        let by_covectors = self.sensitivity.abs() * at.noise + at.heat_rounding;
        at.excess.max(in_units(self.rounded + by_covectors))
    }

    /// The root mean square of displacements by these velocities, in units of their round-off; infinite if it is not
    /// finite.
    pub(super) fn measure(&self, v: &Stages<N::Vector<f64>>, round_off: &N::Vector<f64>) -> f64 {
        let mut sum = 0.0;
        for v in &v[..self.tableau.stages] {
            for c in 0..N::LEN {
                let units = self.h * v[c] / round_off[c].max(f64::MIN_POSITIVE);
                sum += units * units;
            }
        }
        let count = (self.tableau.stages * N::LEN) as f64;
        if sum.is_finite() { (sum / count).sqrt() } else { f64::INFINITY }
    }

    /// The correction of the velocities by a residual, and its measure.
    pub(super) fn correction(
        &self,
        residual: &Stages<N::Vector<f64>>,
        round_off: &N::Vector<f64>,
    ) -> (Stages<N::Vector<f64>>, f64) {
        let s = self.tableau.stages;
        let mut delta = [N::Vector::<f64>::zero(); STAGES];
        let mut rho = *residual;
        let mut size = 0.0;
        for _ in 0..PASSES {
            let mut change = delta;
            for i in 0..s {
                let g = combined(s, &self.tableau.inverse[i], &rho) * self.tableau.gamma;
                change[i] = self.inverse * (g + self.inverse * (rho[i] - g));
            }
            for i in 0..s {
                delta[i] += change[i];
            }
            size = self.measure(&delta, round_off);
            if self.measure(&change, round_off) <= LEFT * size {
                break;
            }
            for i in 0..s {
                let along = self.slope * combined(s, &self.tableau.matrix[i], &delta);
                rho[i] = residual[i] - (delta[i] - along);
            }
        }
        (delta, size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collocation::tableau::GAUSS;
    use metriplectic_dynamics::{Symplectic, System};
    use metriplectic_fields::Real;
    use metriplectic_manifolds::Euclidean;
    use nalgebra::{Vector2, vector};

    #[test]
    fn a_linear_part_serves_displacements_of_its_own_size() {
        let system = System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5)
            .build()
            .unwrap();
        let x = vector![1.0, 0.25];
        let values = crate::step::Flow::laws(&system, &x);
        let equation = StageEquation::new(&GAUSS[1], &system, &x, values, 0.1);
        // A displacement of the second entry by this multiple of its size.
        let serves = |multiple: f64| {
            let mut k = [Vector2::zeros(); STAGES];
            k[..2].fill(vector![0.0, 2.5 * multiple]);
            let linear = Linear::of(&equation, &k).unwrap();
            !linear.is_of_a_longer_step(&x.abs(), &Vector2::zeros())
        };
        assert!(serves(128.0) && !serves(512.0));
    }
}
