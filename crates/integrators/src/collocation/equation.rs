//! The equation of a step with stages.
//!
//! The unknowns are the velocities `k̃_i` of the stages at `x`. With `u = h Σ b_j k̃_j` the [chart](super::chart) of the
//! step has its middle at `z`, and the stages are
//!
//! ```math
//! k_i = T \tilde k_i, \qquad X_i = \varphi_z\Bigl(-\tfrac12 d + h \sum_j a_{ij} k_j\Bigr), \qquad
//! v_i = T\varphi_z\, k_i = \tilde\Pi_i\, w_{H,i} + \tilde K_i\, w_{S,i} ,
//! ```
//!
//! with the [covectors](super::covectors) that account for the change of each law.

use metriplectic_dynamics::velocity::{Covectors, differentials, irreversible, reversible};
use metriplectic_dynamics::{Metriplectic, SecondLaw, system::Point};
use metriplectic_fields::{ChartPoint, Column, Dimension, Vector};
use metriplectic_manifolds::Manifold;

use super::chart::{StepChart, in_chart_at};
use super::covectors::{
    AlongStages, Correction, LawStart, OfInvariants, StageCovectors, StageCovectorsOf, StagePoints,
    Stages, StepPolynomial, all_finite, at_stage, combined, unit_of_rates,
};
use super::heat::{self, HeatStart};
use super::in_time::{InTime, Timed, frozen_share};
use super::tableau::{STAGES, Tableau};
use crate::round_off::bound::{NO_DIGITS, ROUNDED};
use crate::round_off::drift;
use crate::step::{CountOf, Dim, DriftCorrection, Laws, Numbers};

/// The velocities of the stages, in the frame at the start of the step.
pub(super) type Unknowns<Y> = Stages<Vector<<Y as Metriplectic>::Manifold>>;

/// The stages of a step, their covectors, and the middle of its chart.
pub(super) type StagesOf<Y> =
    (StagePoints<<Y as Metriplectic>::Manifold>, StageCovectorsOf<Y>, Point<Y>);

/// Units of round-off up to which a velocity that changes the energy is one that has lost digits.
/// A factor of four fails `tests/stiff_friction.rs::gas_containers_with_a_wall_that_leaks_fast`.
pub(crate) const ROUNDINGS: f64 = 16.0;

/// The equation of a step.
#[derive(Debug)]
pub(super) struct StageEquation<'a, Y: Metriplectic> {
    pub(super) tableau: &'static Tableau,
    pub(super) system: &'a Y,
    pub(super) x: &'a Point<Y>,
    pub(super) h: f64,
    /// The laws at `x`.
    pub(super) values: Laws<Numbers<Y>>,
    /// Corrections of the errors of earlier steps.
    pub(super) drift: DriftCorrection<Y>,
    /// The start, if what is lost of the energy becomes heat.
    pub(super) heats: Option<HeatStart<Dim<Y>>>,
    /// The round-off of the terms of a velocity; zero where it is not known.
    pub(super) rounding: Vector<Y::Manifold>,
    /// The system at the times of the stages, if it depends on time. Then `system` is that in the middle of the step.
    pub(super) in_time: Option<InTime<'a, Y>>,
}

impl<Y: Metriplectic> Clone for StageEquation<'_, Y> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<Y: Metriplectic> Copy for StageEquation<'_, Y> {}

/// The equation at given velocities.
pub(super) struct Evaluated<Y: Metriplectic> {
    /// The deficits of the velocities of the stages, at `x`.
    pub(super) residual: Unknowns<Y>,
    /// The end of the step.
    pub(super) end: Point<Y>,
    /// The displacement in the chart of the step.
    pub(super) d: Vector<Y::Manifold>,
    /// The laws at the end.
    pub(super) values: Laws<Numbers<Y>>,
    /// The defects of the energy and the further invariants in the residual, in units of their round-off.
    pub(super) excess: f64,
    /// Its defect of the entropy, and the size of the terms.
    pub(super) entropy: Left,
    /// The largest `|w_S|` of a stage, entry by entry.
    pub(super) entropy_covector: Vector<Y::Manifold>,
    /// The errors of the energy and the further invariants at the end, in units of their round-off.
    pub(super) error: f64,
    /// The sizes of the terms of the laws.
    pub(super) sizes: Laws<Numbers<Y>>,
    /// The round-off of the covectors of the energy.
    pub(super) noise: Vector<Y::Manifold>,
    /// The round-off of the displacement by heat; an entry that heat alone moves has no other.
    pub(super) heat_rounding: Vector<Y::Manifold>,
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

/// The defect of a law in a residual.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Left {
    /// The change of the law, less what it is to be.
    pub(crate) work: f64,
    /// The size of the terms of the law.
    pub(crate) size: f64,
}

impl<'a, Y: Metriplectic> StageEquation<'a, Y> {
    /// The equation of a step of a fraction of the size, which takes nothing back.
    pub(super) fn of_fraction(&self, fraction: f64) -> Self {
        Self { h: self.h * fraction, drift: drift::nothing::<Y>(), ..*self }
    }

    /// The equation of a step from `x` with these laws, which takes nothing back.
    pub(super) fn new(
        tableau: &'static Tableau,
        system: &'a Y,
        x: &'a Point<Y>,
        values: Laws<Numbers<Y>>,
        h: f64,
    ) -> Self {
        let (drift, rounding) = (drift::nothing::<Y>(), Vector::<Y::Manifold>::zero());
        let mut heats = None;
        if tableau.one_sided && system.second_law() == SecondLaw::Exact {
            let w = differentials(system, &ChartPoint::<Y::Manifold>::centre(x));
            heats = heat::start(system, x, &w);
        }
        Self { tableau, system, x, h, values, drift, heats, rounding, in_time: None }
    }

    /// The displacement `u = h Σ b_j k̃_j`.
    #[inline]
    pub(super) fn displacement(&self, k: &Unknowns<Y>) -> Vector<Y::Manifold> {
        combined(self.tableau.stages, &self.tableau.weights, k) * self.h
    }

    /// The chart of the step.
    #[inline]
    pub(super) fn chart(&self, k: &Unknowns<Y>) -> Option<StepChart<Y::Manifold>> {
        StepChart::of(self.x, &self.displacement(k))
    }

    /// The polynomial of the step.
    #[inline]
    pub(super) fn polynomial<'b>(
        &self,
        chart: &'b StepChart<Y::Manifold>,
        k: &Unknowns<Y>,
    ) -> StepPolynomial<'b, Y::Manifold> {
        let &Self { tableau, x, h, .. } = self;
        let mut displacements = [chart.shift; STAGES];
        for i in 0..tableau.stages {
            displacements[i] += chart.to_middle(x, &k[i]) * h;
        }
        StepPolynomial { tableau, chart, k: displacements, h, unit: unit_of_rates(h) }
    }

    /// The equation at these velocities; `None` where it is not defined.
    pub(super) fn evaluate(&self, k: &Unknowns<Y>) -> Option<Evaluated<Y>> {
        let &Self { tableau, system, x, h, .. } = self;
        let chart = self.chart(k)?;
        let polynomial = self.polynomial(&chart, k);
        let inside = |x: &Point<Y>| system.manifold().is_inside(x);
        let stages = StagePoints::of(system.metric(), &polynomial, inside)?;
        let mut w = self.covectors(&stages, &polynomial);
        let (unit, in_unit) = (polynomial.unit, polynomial.unit.recip());
        let scaled = |v: &Vector<Y::Manifold>| *v * in_unit;
        // The work and the heat of an open system.
        let mut exchanged = 0.0;
        let (mut heat, mut surplus, mut left) = (None, 0.0, f64::INFINITY);
        let mut heat_rounding = Vector::<Y::Manifold>::zero();
        if let Some(start) = &self.heats {
            let friction = |i: usize| {
                let at = ChartPoint::<Y::Manifold>::centre(&stages.x[i]);
                irreversible(system, &system.metric_at(&at), &at_stage::<Y>(&w, i)).ok()
            };
            let last = tableau.stages - 1;
            let at_last = friction(last)?;
            left = h.abs() * unit * w.entropy.w[last].dot(&scaled(&at_last));
            let vanishes = |v: Vector<Y::Manifold>| v.magnitude() == 0.0;
            let is_reversible =
                vanishes(at_last) && (0..last).all(|i| friction(i).is_some_and(vanishes));
            let step = heat::Step { system, tableau, chart: &chart, h, x, start, is_reversible };
            let added = heat::add(&step, &stages, &mut w)?;
            (heat, surplus) = (Some(added.velocity), added.gain.max(0.0));
            heat_rounding = added.rounding;
        }
        let mut residual = [Vector::<Y::Manifold>::zero(); STAGES];
        let mut work = Work::<CountOf<Y>>::default();
        let (mut entropy_slope, mut production) = (f64::INFINITY, 0.0);
        let mut entropy_covector = Vector::<Y::Manifold>::zero();
        for i in 0..tableau.stages {
            let at = ChartPoint::<Y::Manifold>::centre(&stages.x[i]);
            let here = at_stage::<Y>(&w, i);
            let weight = h * tableau.weights[i] * unit;
            let system = self.in_time.map_or(system, |in_time| &in_time.systems[i]);
            let g = system.metric_at(&at);
            let friction = irreversible(system, &g, &here).ok()?;
            let velocity = reversible(system, &g, &here).ok()? + friction;
            let mut off = if self.in_time.is_some() {
                exchanged += weight * here.energy.dot(&scaled(&velocity));
                velocity
            } else {
                self.conserving(velocity, &here.energy, in_unit)
            } - stages.v[i];
            if let Some(heat) = &heat {
                off += heat[i];
            }
            work.add(weight, &here, &scaled(&off));
            let sizes = here.entropy.abs();
            entropy_covector =
                Vector::<Y::Manifold>::from_index(|c| entropy_covector[c].max(sizes[c]));
            production += weight * here.entropy.dot(&scaled(&friction));
            entropy_slope = entropy_slope.min(here.entropy.magnitude());
            let zero = Vector::<Y::Manifold>::zero();
            let in_middle = in_chart_at::<Y::Manifold>(&chart.z, &stages.x[i], &zero, &off);
            residual[i] = chart.to_start(x, &in_middle);
        }
        let sizes = Laws {
            energy: w.energy.size,
            entropy: w.entropy.size,
            invariants: CountOf::<Y>::array(|a| w.invariants[a].map_or(0.0, |(_, l)| l.size)),
        };
        let excess = relative::<CountOf<Y>>(&work.laws, &sizes) / ROUNDED;
        let entropy = Left {
            work: if self.is_exact() { work.laws.entropy } else { 0.0 },
            size: w.entropy.size,
        };
        let values = Laws {
            energy: if self.in_time.is_some() {
                w.energy.end - exchanged - w.energy.left.min(0.0)
            } else {
                w.energy.end
            },
            entropy: w.entropy.end,
            invariants: CountOf::<Y>::array(|a| w.invariants[a].map_or(0.0, |(_, l)| l.end)),
        };
        let error = self.error(&values, &sizes);
        let usable = all_finite::<Dim<Y>>(&residual) && !excess.is_nan();
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
            noise: w.energy.noise,
            heat_rounding,
            entropy_slope: if self.is_exact() { entropy_slope } else { f64::INFINITY },
            growth: production,
            surplus,
            left,
            excursion: w.energy.excursion,
        })
    }

    /// The stages at these velocities with their covectors, and the middle of the chart.
    pub(super) fn stages(&self, k: &Unknowns<Y>) -> Option<StagesOf<Y>> {
        let chart = self.chart(k)?;
        let polynomial = self.polynomial(&chart, k);
        let inside = |x: &Point<Y>| self.system.manifold().is_inside(x);
        let stages = StagePoints::of(self.system.metric(), &polynomial, inside)?;
        let w = self.covectors(&stages, &polynomial);
        Some((stages, w, chart.z))
    }

    /// The errors of the energy and the further invariants at the end, in units of round-off.
    pub(super) fn error(&self, after: &Laws<Numbers<Y>>, sizes: &Laws<Numbers<Y>>) -> f64 {
        let Self { values: before, drift, .. } = self;
        let off = Laws {
            energy: after.energy - before.energy + drift.energy,
            entropy: 0.0,
            invariants: CountOf::<Y>::array(|a| {
                after.invariants[a] - before.invariants[a] + drift.invariants[a]
            }),
        };
        relative::<CountOf<Y>>(&off, sizes) / ROUNDED
    }

    /// A velocity that the covector of the energy annihilates. Where friction is stiff the sum of its terms has lost
    /// digits of this number: they are made good within the round-off of each term.
    fn conserving(
        &self,
        velocity: Vector<Y::Manifold>,
        w: &Vector<Y::Manifold>,
        in_unit: f64,
    ) -> Vector<Y::Manifold> {
        let parts = Vector::<Y::Manifold>::from_index(|c| (self.rounding[c] * in_unit) * w[c]);
        let (work, size) = (w.dot(&(velocity * in_unit)), parts.magnitude());
        if !(work.abs() <= ROUNDINGS * size && size > 0.0) {
            return velocity;
        }
        let fraction = work / size;
        velocity
            - Vector::<Y::Manifold>::from_index(|c| self.rounding[c] * (parts[c] / size) * fraction)
    }

    /// Whether the entropy is corrected.
    pub(super) fn is_exact(&self) -> bool {
        self.system.second_law() == SecondLaw::Exact
    }

    /// The covectors of all laws at the stages.
    #[inline]
    fn covectors(
        &self,
        stages: &StagePoints<Y::Manifold>,
        polynomial: &StepPolynomial<'_, Y::Manifold>,
    ) -> Covectors<CountOf<Y>, StageCovectors<Vector<Y::Manifold>>> {
        let &Self { system, values, drift, .. } = self;
        let scales = Y::Manifold::scales(&polynomial.chart.end);
        let along = AlongStages { stages, polynomial, scales };
        let [of_energy, of_entropy] = match (self.is_exact(), self.heats.is_some()) {
            (false, _) => [Correction::Here, Correction::None],
            (true, false) => [Correction::Here; 2],
            (true, true) => [Correction::Later; 2],
        };
        let energy = LawStart { value: values.energy, drift: drift.energy };
        let entropy = LawStart { value: values.entropy, drift: drift.entropy };
        let of_energy = match self.in_time {
            Some(in_time) => {
                let (tableau, x, z) = (self.tableau, self.x, &polynomial.chart.z);
                let share = frozen_share((tableau, in_time), &stages.x, z);
                // What a method that damps loses of the energy is heat of the bath.
                let correction = if tableau.one_sided { Correction::Raised } else { of_energy };
                along.of_law(&Timed { in_time, tableau, x, z, share }, energy, correction)
            }
            None => along.of(system.energy(), energy, of_energy),
        };
        let laws = [of_energy, along.of(system.entropy(), entropy, of_entropy)];
        let start = |a: usize| LawStart { value: values.invariants[a], drift: drift.invariants[a] };
        let mut invariants = OfInvariants { along: &along, start, seen: 0 };
        Covectors::new(laws, system.invariants(), &mut invariants)
    }
}

/// The change of each law by a residual.
struct Work<C: Dimension> {
    laws: Laws<C::Array<f64>>,
}

impl<C: Dimension> Default for Work<C> {
    fn default() -> Self {
        Self { laws: Laws { energy: 0.0, entropy: 0.0, invariants: C::array(|_| 0.0) } }
    }
}

impl<C: Dimension> Work<C> {
    #[inline]
    fn add<V: Column<f64>>(&mut self, weight: f64, w: &Covectors<C, V>, off: &V) {
        self.laws.energy += weight * w.energy.dot(off);
        self.laws.entropy += weight * w.entropy.dot(off);
        for (a, listed) in w.invariants.as_ref().iter().enumerate() {
            let Some((_, l)) = listed else { break };
            self.laws.invariants[a] += weight * l.dot(off);
        }
    }
}

/// The largest change of the energy and the further invariants, relative to the size of the terms of the law.
#[inline]
fn relative<C: Dimension>(off: &Laws<C::Array<f64>>, sizes: &Laws<C::Array<f64>>) -> f64 {
    // 0/0 = 0: a law without terms has no round-off, and nothing changes it.
    let ratio = |off: f64, size: f64| if off.abs() <= NO_DIGITS { 0.0 } else { off.abs() / size };
    let listed = off.invariants.as_ref().iter().zip(sizes.invariants.as_ref());
    listed.fold(ratio(off.energy, sizes.energy), |largest, (&off, &size)| {
        larger(largest, ratio(off, size))
    })
}

/// The larger one of two numbers; NaN if one is.
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if b.is_nan() || b > a { b } else { a }
}
