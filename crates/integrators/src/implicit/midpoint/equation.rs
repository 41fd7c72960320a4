//! The equation of one step of the midpoint scheme, as in [`Residual`](crate::Residual), whose formula it is.

use std::ops::Range;

use metriplectic_equations::{ENERGY, ENTROPY};

use super::gradient::{LawAlong, Line, MovingLine, Slope, Stable};
use crate::implicit::algebra::{Matrix, add, dot, is_finite};
use crate::implicit::drift;
use crate::implicit::parts::{OfLaws, Parts, WithJacobian};
use crate::implicit::velocity::{Columns, VelocityJet, velocity_jet, whole_velocity_jet};
use crate::newton::Stiffness;
use crate::numbers::Lengths;
use crate::round_off::bound::{ROUNDED, is_dissipated};
use crate::step::{Laws, PathOfStep};

/// The equation `F(u) = d − h (Π̃ w_H + K̃ w_S) = 0` of the initial displacement `u` of the path of a step from `x`. On a vector space
/// the path is a straight line, and `d = u`.
pub(super) struct Equation<'a, L: Lengths> {
    pub(super) parts: &'a Parts<'a, L>,
    pub(super) line: PathOfStep,
    pub(super) x: &'a L::State,
    pub(super) h: f64,
    /// The laws at `x`.
    pub(super) values: Laws<L::Invariants>,
    /// The correction of the errors of earlier steps.
    pub(super) drift: Laws<L::Invariants>,
}

/// The entropy in an evaluation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dissipated {
    /// `|w_S|²`; infinite if the entropy has no discrete gradient.
    pub(super) slope_squared: f64,
    /// Whether anything is dissipated.
    pub(super) dissipates: bool,
}

/// The residual at one displacement.
pub(super) struct Evaluated<L: Lengths> {
    pub(super) residual: L::Vector,
    pub(super) evidence: Dissipated,
}

/// The residual with its Jacobian, and what is in it.
pub(super) struct Linearised<L: Lengths> {
    pub(super) residual: L::Vector,
    pub(super) jacobian: Matrix<L>,
    pub(super) rounding: Rounding<L>,
    pub(super) stiffness: Stiffness,
    pub(super) evidence: Dissipated,
    /// The discrete gradients of energy and entropy.
    pub(super) energy: L::Vector,
    pub(super) entropy: L::Vector,
    /// The growth `h⟨w_S, K̃ w_S⟩` of the entropy by friction.
    pub(super) growth: f64,
    /// The displacement.
    pub(super) d: L::Vector,
}

/// The equation at its root, along the end of its step.
pub(crate) struct FromEnd<L: Lengths> {
    /// The Jacobian `∂F/∂u`.
    pub(crate) jacobian: Matrix<L>,
    /// The differential of the energy at the end.
    pub(crate) energy: L::Vector,
    /// The derivative of the growth `h⟨w_S, K̃ w_S⟩` of the entropy.
    pub(crate) growth: L::Vector,
}

/// The equation at its root, along parameters.
pub(crate) struct AlongParameters<L: Lengths> {
    /// The derivatives `h ∂V` of the motion, a column for each.
    pub(crate) motion: Matrix<L>,
    /// The derivatives of the growth of the entropy.
    pub(crate) growth: L::Vector,
}

/// The derivative of the growth `h⟨w_S, K̃ w_S⟩` of the entropy.
fn growth<L: Lengths>(
    parts: &Parts<'_, L>,
    h: f64,
    jet: &VelocityJet<L>,
    w: &OfLaws<WithJacobian<L>>,
) -> L::Vector {
    let mut growth = parts.zero();
    if let Some(friction) = &jet.irreversible {
        add(&mut growth, h, &w.entropy.slope.transpose_times(&friction.value));
        add(&mut growth, h, &friction.slope.transpose_times(&w.entropy.value));
    }
    growth
}

/// The round-off of a residual, as in [`Rounding`](crate::Rounding).
pub(super) struct Rounding<L: Lengths> {
    /// The round-off of the terms.
    pub(super) terms: L::Vector,
    /// The derivative along the covectors that the components share.
    pub(super) sensitivity: Matrix<L>,
    /// The sizes of the round-off of these.
    pub(super) covector: L::Vector,
    /// The sizes of the round-off of the points.
    pub(super) argument: L::Vector,
}

impl<L: Lengths> Rounding<L> {
    /// The bound of each component, with the Jacobian.
    pub(super) fn bounds(&self, parts: &Parts<'_, L>, jacobian: &Matrix<L>) -> L::Vector {
        let one = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
        let by_covectors = self.sensitivity.abs_times(&self.covector);
        let moved = parts.matrix(|i, j| (jacobian[(i, j)] - one(i, j)).abs());
        let by_points = moved.times(&self.argument);
        parts.vector(|i| self.terms[i] + by_covectors[i] + by_points[i])
    }
}

impl<'a, L: Lengths> Equation<'a, L> {
    /// The equation of a step of a fraction of the size, which takes nothing back.
    pub(super) fn of_fraction(&self, fraction: f64) -> Self {
        let Self { parts, line, x, h, values, .. } = self;
        let (values, drift) = (values.clone(), drift::nothing::<L>(values));
        Self { parts, line: *line, x, h: h * fraction, values, drift }
    }

    /// Whether the entropy has a discrete gradient.
    pub(super) const fn is_exact(&self) -> bool {
        self.parts.is_exact
    }

    /// The value of a law at `x`, and what is taken back of its error.
    #[inline]
    fn start_of(&self, law: usize) -> [f64; 2] {
        let of = |laws: &Laws<L::Invariants>| match law {
            ENERGY => laws.energy,
            ENTROPY => laws.entropy,
            _ => laws.invariants.as_ref()[law - ENTROPY - 1],
        };
        [of(&self.values), of(&self.drift)]
    }

    /// Returns whether a law has a discrete gradient, and no differential in its place.
    #[inline]
    const fn is_discrete(&self, law: usize) -> bool {
        law != ENTROPY || self.is_exact()
    }

    fn dissipated(&self, entropy: &L::Vector, production: f64) -> Dissipated {
        let slope_squared = if self.is_exact() { dot(entropy, entropy) } else { f64::INFINITY };
        let growth = self.h.abs() * production;
        Dissipated { slope_squared, dissipates: is_dissipated(growth, self.values.entropy) }
    }

    /// The residual, safe against round-off; `None` where it is not defined.
    pub(super) fn evaluate(&self, u: &L::Vector) -> Option<Evaluated<L>> {
        let &Self { parts, h, .. } = self;
        let line = &Line::new(parts, self.x, self.line.path, u, false)?;
        let w = parts.each_law(|law| {
            if !self.is_discrete(law) {
                return Some(parts.jet(law, &line.z).1);
            }
            let [start, drift] = self.start_of(law);
            let end = parts.value(law, &line.end);
            let along = LawAlong { parts, law, line };
            let stable = along.stable(self.line.gradient, [start, end], false)?;
            Some(stable.covector(drift, line))
        });
        let w = w.all()?;
        let at = (&line.z, line.units());
        let friction = parts.irreversible(at, &w)?;
        let production = dot(&w.entropy, &friction);
        let reversible = parts.reversible(at, &w)?;
        let d = line.d();
        let residual = parts.vector(|i| d[i] - (reversible[i] + friction[i]) * h);
        let evidence = self.dissipated(&w.entropy, production);
        is_finite(&residual).then_some(Evaluated { residual, evidence })
    }

    /// The covectors of all laws along a line, with derivatives along the displacement: of a discrete gradient by the function `slope`,
    /// from the number of its law, its data, and the differential at the end.
    #[inline]
    fn jets(
        &self,
        line: &Line<'_, L>,
        mut slope: impl FnMut(usize, Stable<L>, &L::Vector) -> Slope<L>,
    ) -> Option<OfLaws<WithJacobian<L>>> {
        let parts = self.parts;
        let w = parts.each_law(|law| {
            if !self.is_discrete(law) {
                let second = parts.second(law, &line.z);
                let slope = line.dz().after(second.hf);
                return Some(WithJacobian::new(second.df, slope));
            }
            let [start, drift] = self.start_of(law);
            let (end, df) = parts.jet(law, &line.end);
            let along = LawAlong { parts, law, line };
            let stable = along.stable(self.line.gradient, [start, end], true)?;
            let value = stable.covector(drift, line);
            let Slope { matrix: slope, apart } = slope(law, stable, &df);
            Some(WithJacobian { value, slope, apart })
        });
        w.all()
    }

    /// The Jacobian `∂d − h ∂V` of the residual, from the derivatives of the velocity.
    #[inline]
    fn jacobian(&self, line: &Line<'_, L>, velocity: Matrix<L>) -> Matrix<L> {
        let mut jacobian = velocity.map(|slope| -(slope * self.h));
        if let Some([_, dd, _]) = line.slopes() {
            jacobian.add(1.0, dd);
            return jacobian;
        }
        for i in 0..self.parts.n() {
            jacobian[(i, i)] += 1.0;
        }
        jacobian
    }

    /// The Jacobian at the root `u`, for the derivative of the step on a vector space: numbers that are divided by its length are zero where
    /// they are round-off. `None` where it is not defined.
    pub(super) fn at_root(&self, u: &L::Vector) -> Option<FromEnd<L>> {
        let &Self { parts, h, .. } = self;
        let line = &Line::new(parts, self.x, self.line.path, u, true)?;
        let along = &MovingLine { line, metric: None };
        let mut energy = parts.zero();
        let w = self.jets(line, |law, stable, df| {
            if law == ENERGY {
                energy = df.clone();
            }
            stable.slope_above_round_off(along, df)
        })?;
        let columns = Columns::Directions(self.line.path.base());
        let jet = whole_velocity_jet(parts, &line.z, columns, &w)?;
        let growth = growth(parts, h, &jet, &w);
        let jacobian = self.jacobian(line, jet.velocity.slope);
        jacobian.magnitude().is_finite().then_some(FromEnd { jacobian, energy, growth })
    }

    /// The derivatives along parameters at the root `u`, with both ends where they are, on a vector space; `None` where it is not defined.
    pub(super) fn along_parameters(
        &self,
        u: &L::Vector,
        parameters: Range<usize>,
    ) -> Option<AlongParameters<L>> {
        let &Self { parts, h, .. } = self;
        let line = &Line::new(parts, self.x, self.line.path, u, false)?;
        let kind = self.line.gradient;
        let along: Vec<_> = parameters.clone().map(|k| parts.along_parameter(k)).collect();
        let w = parts.each_law(|law| {
            let of_law = LawAlong { parts, law, line };
            let value = if self.is_discrete(law) {
                let ends = [self.start_of(law)[0], parts.value(law, &line.end)];
                of_law.stable(kind, ends, false)?.covector(0.0, line)
            } else {
                parts.jet(law, &line.z).1
            };
            let mut slope = parts.zeros();
            for (c, parts) in along.iter().enumerate() {
                let column = if self.is_discrete(law) {
                    LawAlong { parts, law, line }.above_round_off(kind)
                } else {
                    parts.jet(law, &line.z).1
                };
                (0..parts.n()).for_each(|i| slope[(i, c)] = column[i]);
            }
            Some(WithJacobian::new(value, slope))
        });
        let w = w.all()?;
        let columns = Columns::Parameters(parameters);
        let jet = whole_velocity_jet(parts, &line.z, columns, &w)?;
        let growth = growth(parts, h, &jet, &w);
        let motion = jet.velocity.slope.map(|slope| slope * h);
        motion.magnitude().is_finite().then_some(AlongParameters { motion, growth })
    }

    /// The residual with its Jacobian; `None` where it is not defined.
    pub(super) fn linearise(&self, u: &L::Vector) -> Option<Linearised<L>> {
        let &Self { parts, h, .. } = self;
        let line = &Line::new(parts, self.x, self.line.path, u, true)?;
        let metric = line.moving_metric(parts);
        let (metric, d) = (metric.as_ref(), line.d());
        let along = &MovingLine { line, metric };
        let mut noise = None;
        let w = self.jets(line, |law, stable, df| {
            if law == ENERGY {
                // Near the edge of a domain dH is far steeper at x' than at z, and the rounding of d counts there.
                let of_defect = stable.noise(line);
                noise = Some(parts.vector(|i| of_defect[i] + df[i].abs() * f64::EPSILON));
            }
            stable.slope(self.start_of(law)[1], along, df)
        })?;
        let jet = velocity_jet(parts, (&line.z, line.dz(), metric), &w)?;
        let VelocityJet { velocity, terms, sensitivity, production, friction, rotation, .. } = jet;
        let rounding = Rounding {
            // What underflows is no larger than the least normal number.
            terms: parts
                .vector(|i| ROUNDED * h.abs() * terms[i] + f64::MIN_POSITIVE * (1.0 + h.abs())),
            sensitivity: sensitivity.map(|a| a * h),
            covector: noise.unwrap_or_else(|| parts.zero()),
            argument: {
                let sizes = parts.scales(self.x);
                parts.vector(|i| (sizes[i] + d[i].abs()) * f64::EPSILON)
            },
        };
        // Half of a displacement reaches z.
        let stiffness =
            Stiffness { friction: 2.0 * h.abs() * friction, rotation: 2.0 * h.abs() * rotation };
        let evidence = self.dissipated(&w.entropy.value, production);
        let residual = parts.vector(|i| d[i] - velocity.value[i] * h);
        let jacobian = self.jacobian(line, velocity.slope);
        let is_usable = is_finite(&residual) && jacobian.magnitude().is_finite();
        is_usable.then(|| Linearised {
            residual,
            jacobian,
            rounding,
            stiffness,
            evidence,
            energy: w.energy.value,
            entropy: w.entropy.value,
            growth: h * production,
            d: d.clone(),
        })
    }
}
