//! The equation of a step with stages, of the velocities of its stages. As in [`crate::collocation`], whose formulas it has.

use metriplectic_equations::{ENERGY, ENTROPY};

use super::chart::StepChart;
use super::clock::{Clock, Timed};
use super::covectors::{
    LawOfStages, StageCovectors, StagePoints, StepPolynomial, all_finite, combined, displacements,
    of_law, zeros,
};
use super::heat::{self, HeatStart};
use crate::collocation::Stages;
use crate::collocation::covectors::{Correction, LawStart, unit_of_rates};
use crate::collocation::equation::{Left, ROUNDINGS, larger};
use crate::collocation::tableau::Tableau;
use crate::implicit::algebra::{add, dot, magnitude};
use crate::implicit::drift;
use crate::implicit::parts::{OfLaws, Parts};
use crate::implicit::start::Start;
use crate::numbers::Lengths;
use crate::round_off::bound::{NO_DIGITS, ROUNDED};
use crate::step::{Laws, Vector as _};

/// The velocities of the stages.
pub(super) type Unknowns<L> = Stages<<L as Lengths>::Vector>;

/// The equation of a step.
pub(super) struct StageEquation<'a, L: Lengths> {
    pub(super) tableau: &'static Tableau,
    pub(super) parts: &'a Parts<'a, L>,
    pub(super) x: &'a L::State,
    pub(super) h: f64,
    /// The laws at `x`.
    pub(super) values: Laws<L::Invariants>,
    /// Corrections of the errors of earlier steps.
    pub(super) drift: Laws<L::Invariants>,
    /// The start, if what is lost of the energy becomes heat.
    pub(super) heats: Option<HeatStart<L>>,
    /// The round-off of the terms of a velocity; zero where it is not known.
    pub(super) rounding: L::Vector,
    /// The model at the times of the stages, if its force depends on time and does work. Then `parts` is that in the middle of the
    /// step.
    pub(super) in_time: Option<&'a [Parts<'a, L>]>,
    /// The energy in time, if it depends on it.
    pub(super) clock: Option<&'a Clock<'a, L>>,
}

// By hand, because lengths have none.
impl<L: Lengths> Clone for StageEquation<'_, L> {
    fn clone(&self) -> Self {
        Self {
            values: self.values.clone(),
            drift: self.drift.clone(),
            heats: self.heats.clone(),
            rounding: self.rounding.clone(),
            ..*self
        }
    }
}

/// The equation at given velocities.
pub(super) struct Evaluated<L: Lengths> {
    /// The deficits of the velocities of the stages, at `x`.
    pub(super) residual: Unknowns<L>,
    /// The end of the step.
    pub(super) end: L::State,
    /// The displacement.
    pub(super) d: L::Vector,
    /// The laws at the end.
    pub(super) values: Laws<L::Invariants>,
    /// The defects of the energy and the further invariants in the residual, in units of their round-off.
    pub(super) excess: f64,
    /// Its defect of the entropy, and the size of the terms.
    pub(super) entropy: Left,
    /// The largest `|w_S|` of a stage, entry by entry.
    pub(super) entropy_covector: L::Vector,
    /// The errors of the energy and the further invariants at the end, in units of their round-off.
    pub(super) error: f64,
    /// The sizes of the terms of the laws.
    pub(super) sizes: Laws<L::Invariants>,
    /// The round-off of the covectors of the energy.
    pub(super) noise: L::Vector,
    /// The round-off of the displacement by heat; an entry that heat alone moves has no other.
    pub(super) heat_rounding: L::Vector,
    /// The least `|w_S|` of a stage; infinite if the entropy is not corrected.
    pub(super) entropy_slope: f64,
    /// The entropy that friction adds.
    pub(super) growth: f64,
    /// The entropy that is gained beside it.
    pub(super) surplus: f64,
    /// The entropy that friction at the end would produce in a step of this size; infinite where nothing is damped.
    pub(super) left: f64,
    /// The largest change of the energy at a stage.
    pub(super) excursion: f64,
}

impl<'a, L: Lengths> StageEquation<'a, L> {
    /// The equation of a step, which takes nothing back.
    pub(super) fn new(
        tableau: &'static Tableau,
        &Start { parts, x, h, ref values, .. }: &Start<'a, L>,
    ) -> Self {
        let (values, drift) = (values.clone(), drift::nothing::<L>(values));
        let heats = if tableau.one_sided && parts.is_exact {
            heat::start(parts, x, &parts.differentials(x))
        } else {
            None
        };
        let rounding = parts.zero();
        Self { tableau, parts, x, h, values, drift, heats, rounding, in_time: None, clock: None }
    }

    /// The equation of a step of a fraction of the size, which takes nothing back.
    pub(super) fn of_fraction(&self, fraction: f64) -> Self {
        let drift = drift::nothing::<L>(&self.values);
        Self { h: self.h * fraction, drift, ..self.clone() }
    }

    /// The displacement `u = h Σ b_j k_j`.
    #[inline]
    pub(super) fn displacement(&self, k: &Unknowns<L>) -> L::Vector {
        combined(self.h, self.tableau.stages, &self.tableau.weights, k)
    }

    /// The chart of the step.
    #[inline]
    pub(super) fn chart(&self, k: &Unknowns<L>) -> Option<StepChart<L>> {
        StepChart::of(self.parts, self.x, self.displacement(k))
    }

    /// Returns whether the chart of the step reaches its end. A root beyond belongs to another way between the ends.
    pub(super) fn is_on_its_way(&self, k: &Unknowns<L>, end: &L::State) -> bool {
        let reaches = |chart: StepChart<L>| self.parts.is_near(&chart.z, end);
        self.parts.is_flat() || self.chart(k).is_some_and(reaches)
    }

    /// The polynomial of the step.
    #[inline]
    fn polynomial<'b>(&self, chart: &'b StepChart<L>, k: &Unknowns<L>) -> StepPolynomial<'b, L>
    where
        'a: 'b,
    {
        let &Self { tableau, parts, x, h, .. } = self;
        let k = displacements(tableau, (parts, x, h), chart, k);
        StepPolynomial { parts, tableau, chart, k, h, unit: unit_of_rates(h) }
    }

    /// The equation at these velocities; `None` where it is not defined.
    pub(super) fn evaluate(&self, k: &Unknowns<L>) -> Option<Evaluated<L>> {
        let &Self { tableau, parts, h, .. } = self;
        let chart = self.chart(k)?;
        let polynomial = self.polynomial(&chart, k);
        let stages = StagePoints::of(&polynomial)?;
        let mut covectors = self.covectors(&stages, &polynomial);
        let (unit, in_unit) = (polynomial.unit, polynomial.unit.recip());
        let scaled = |v: &L::Vector| v.map(|v| v * in_unit);
        let (mut heat, mut surplus, mut left) = (None, 0.0, f64::INFINITY);
        let mut heat_rounding = parts.zero();
        if let Some(start) = &self.heats {
            let w = &covectors.w;
            let friction = |i: usize| parts.irreversible(stages.at(i), &w[i]);
            let last = tableau.stages - 1;
            let at_last = friction(last)?;
            left = h.abs() * unit * dot(&w[last].entropy, &scaled(&at_last));
            let vanishes = |v: &L::Vector| magnitude(v) == 0.0;
            let is_reversible =
                vanishes(&at_last) && (0..last).all(|i| friction(i).is_some_and(|v| vanishes(&v)));
            let x = self.x;
            let step = heat::Step { parts, tableau, chart: &chart, h, x, start, is_reversible };
            let added = heat::add(&step, &stages, &mut covectors)?;
            (heat, surplus) = (Some(added.velocity), added.gain.max(0.0));
            heat_rounding = added.rounding;
        }
        // The work and the heat of surroundings.
        let mut exchanged = 0.0;
        let mut residual = zeros(parts);
        let mut work = drift::nothing::<L>(&self.values);
        let (mut entropy_slope, mut production) = (f64::INFINITY, 0.0);
        let mut entropy_covector = parts.zero();
        for i in 0..tableau.stages {
            let (at, here) = (stages.at(i), &covectors.w[i]);
            let weight = h * tableau.weights[i] * unit;
            let at_stage = self.at_stage(i);
            let friction = at_stage.irreversible(at, here)?;
            let mut velocity = at_stage.reversible(at, here)?;
            add(&mut velocity, 1.0, &friction);
            let mut off = if self.in_time.is_some() {
                exchanged += weight * dot(&here.energy, &scaled(&velocity));
                velocity
            } else {
                self.conserving(velocity, &here.energy, in_unit)
            };
            add(&mut off, -1.0, &stages.v[i]);
            if let Some(heat) = &heat {
                add(&mut off, 1.0, &heat[i]);
            }
            add_work::<L>(&mut work, weight, here, &scaled(&off));
            for c in 0..parts.n() {
                entropy_covector[c] = entropy_covector[c].max(here.entropy[c].abs());
            }
            production += weight * dot(&here.entropy, &scaled(&friction));
            entropy_slope = entropy_slope.min(magnitude(&here.entropy));
            residual[i] = if parts.is_flat() {
                off
            } else {
                let middle = parts.velocity_at(&chart.z, (at.0, &parts.zero()), &off);
                chart.to_start(parts, self.x, middle)
            };
        }
        let StageCovectors { laws, excursion, .. } = covectors;
        let sizes = numbers::<L>(&laws, |law| law.size);
        let excess = relative(&work, &sizes) / ROUNDED;
        let entropy =
            Left { work: if parts.is_exact { work.entropy } else { 0.0 }, size: laws.entropy.size };
        let mut values = numbers::<L>(&laws, |law| law.end);
        if self.in_time.is_some() {
            values.energy -= exchanged + laws.energy.left.min(0.0);
        }
        let error = self.error(&values, &sizes);
        let usable = all_finite::<L>(&residual) && !excess.is_nan();
        usable.then_some(Evaluated {
            residual,
            d: chart.d,
            end: chart.end,
            values,
            excess,
            entropy,
            entropy_covector,
            error,
            sizes,
            noise: laws.energy.noise,
            heat_rounding,
            entropy_slope: if parts.is_exact { entropy_slope } else { f64::INFINITY },
            growth: production,
            surplus,
            left,
            excursion,
        })
    }

    /// The model at the time of a stage.
    pub(super) fn at_stage(&self, i: usize) -> &'a Parts<'a, L> {
        self.in_time.map_or(self.parts, |stages| &stages[i])
    }

    /// The stages at these velocities with their covectors, and the middle of the chart.
    pub(super) fn stages(
        &self,
        k: &Unknowns<L>,
    ) -> Option<(StagePoints<L>, StageCovectors<L>, L::State)> {
        let chart = self.chart(k)?;
        let polynomial = self.polynomial(&chart, k);
        let stages = StagePoints::of(&polynomial)?;
        let covectors = self.covectors(&stages, &polynomial);
        Some((stages, covectors, chart.z))
    }

    /// The errors of the energy and the further invariants at the end, in units of round-off.
    pub(super) fn error(&self, after: &Laws<L::Invariants>, sizes: &Laws<L::Invariants>) -> f64 {
        let Self { values: before, drift, .. } = self;
        let mut off = after.clone();
        off.energy = after.energy - before.energy + drift.energy;
        for a in 0..self.parts.kinds.len() {
            let [after, before, drift] = [after, before, drift].map(|laws| laws.invariants[a]);
            off.invariants[a] = after - before + drift;
        }
        relative(&off, sizes) / ROUNDED
    }

    /// A velocity that the covector of the energy annihilates: the digits of this number that the sum of its terms has lost are
    /// made good within the round-off of each term.
    fn conserving(&self, mut velocity: L::Vector, w: &L::Vector, in_unit: f64) -> L::Vector {
        let terms = self.parts.vector(|c| (self.rounding[c] * in_unit) * w[c]);
        let (work, size) = (dot(w, &velocity.map(|v| v * in_unit)), magnitude(&terms));
        if !(work.abs() <= ROUNDINGS * size && size > 0.0) {
            return velocity;
        }
        let fraction = work / size;
        for c in 0..self.parts.n() {
            velocity[c] -= self.rounding[c] * (terms[c] / size) * fraction;
        }
        velocity
    }

    /// The covectors of all laws at the stages.
    #[inline]
    fn covectors(
        &self,
        stages: &StagePoints<L>,
        polynomial: &StepPolynomial<'_, L>,
    ) -> StageCovectors<L> {
        let Self { parts, values, drift, heats, tableau, in_time, .. } = self;
        let start = |law: usize| {
            let [value, drift] = [values, drift].map(|laws| of_law::<L>(laws, law));
            LawStart { value, drift }
        };
        let correction = |law: usize| match law {
            ENTROPY if !parts.is_exact => Correction::None,
            ENERGY | ENTROPY if heats.is_some() => Correction::Later,
            // What a method that damps loses of the energy is heat of the bath.
            ENERGY if tableau.one_sided && in_time.is_some() => Correction::Raised,
            _ => Correction::Here,
        };
        let z = &polynomial.chart.z;
        let timed = self.clock.zip(*in_time).map(|(clock, in_time)| {
            let share = clock.share(tableau, &stages.x, z);
            Timed { clock, in_time, x: self.x, z, share }
        });
        StageCovectors::of(stages, polynomial, timed, start, correction)
    }
}

/// A number for each law.
fn numbers<L: Lengths>(
    laws: &OfLaws<LawOfStages<L::Vector>>,
    number: impl Fn(&LawOfStages<L::Vector>) -> f64,
) -> Laws<L::Invariants> {
    let OfLaws { energy, entropy, invariants } = laws.map(number);
    Laws { energy, entropy, invariants: L::invariants(&invariants) }
}

/// Adds the changes of the laws by a part of a residual.
#[inline]
fn add_work<L: Lengths>(
    work: &mut Laws<L::Invariants>,
    weight: f64,
    w: &OfLaws<L::Vector>,
    off: &L::Vector,
) {
    work.energy += weight * dot(&w.energy, off);
    work.entropy += weight * dot(&w.entropy, off);
    for (a, l) in w.invariants.iter().enumerate() {
        work.invariants[a] += weight * dot(l, off);
    }
}

/// The largest change of the energy and the further invariants, relative to the size of the terms of the law.
#[inline]
fn relative<I: AsRef<[f64]>>(off: &Laws<I>, sizes: &Laws<I>) -> f64 {
    // 0/0 = 0: a law without terms has no round-off, and nothing changes it.
    let ratio = |off: f64, size: f64| if off.abs() <= NO_DIGITS { 0.0 } else { off.abs() / size };
    let listed = off.invariants.as_ref().iter().zip(sizes.invariants.as_ref());
    listed.fold(ratio(off.energy, sizes.energy), |largest, (&off, &size)| {
        larger(largest, ratio(off, size))
    })
}
