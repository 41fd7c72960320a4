//! Stiff friction that is damped: what a Radau method loses of the energy becomes heat. As in [`crate::collocation`], whose
//! file of this name has the formulas.

use super::chart::StepChart;
use super::covectors::{StageCovectors, StagePoints, each_stage, zeros};
use crate::collocation::heat::{FAINT, HALVINGS, JUMP};
use crate::collocation::tableau::{STAGES, Tableau};
use crate::collocation::{Stages, fraction};
use crate::implicit::algebra::{add as plus, dot};
use crate::implicit::orthogonal::Orthogonal;
use crate::implicit::parts::{OfLaws, Parts};
use crate::numbers::{Lengths, List};
use crate::step::Vector as _;

/// The heat that is added to the stages.
pub(super) struct Heat<V> {
    /// The velocities `ρ u_i`.
    pub(super) velocity: Stages<V>,
    /// The number `N`, the gain of the entropy beside the production of friction.
    pub(super) gain: f64,
    /// The round-off of the displacement by heat, the largest over the stages.
    pub(super) rounding: V,
}

/// Where heat is to go at a point: along the part of `dS` that is orthogonal to the invariants.
struct Direction<V> {
    /// The vector `♯n`.
    sharp: V,
    /// The change `⟨dH, ♯n⟩` of the energy along it; its sign is that of the temperature.
    warmed: f64,
}

impl<V: List> Direction<V> {
    /// Returns whether it changes the energy by more than its terms leave with these entries of `dH`.
    fn is_clear<L: Lengths<Vector = V>>(&self, parts: &Parts<'_, L>, energy: &V) -> bool {
        let terms = parts.pairing_size(energy, &self.sharp);
        let alignment = if terms > 0.0 { self.warmed / terms } else { 0.0 };
        alignment.abs() > FAINT
    }
}

/// The entries that friction does not move at a point; none where nothing would be left that the entropy depends on.
fn still<L: Lengths>(
    parts: &Parts<'_, L>,
    x: &L::State,
    w: &OfLaws<L::Vector>,
) -> Option<Vec<bool>> {
    let (n, k) = (parts.n(), parts.tensor(x, w)?);
    let still: Vec<bool> = (0..n).map(|i| (0..n).all(|j| k[(i, j)] == 0.0)).collect();
    let is_warmed = direction(parts, x, w, &still)?.is_clear(parts, &w.energy);
    Some(if is_warmed { still } else { vec![false; n] })
}

/// The direction of heat at a point; `None` where it is not finite, or there is no metric.
fn direction<L: Lengths>(
    parts: &Parts<'_, L>,
    x: &L::State,
    w: &OfLaws<L::Vector>,
    still: &[bool],
) -> Option<Direction<L::Vector>> {
    let (metric, mut normals) = (parts.metric(x)?, Orthogonal::none());
    let g = metric.units();
    for (i, _) in still.iter().enumerate().filter(|(_, still)| **still) {
        normals.push(g, &parts.vector(|j| if j == i { 1.0 } else { 0.0 }));
    }
    w.invariants.iter().for_each(|l| normals.push(g, l));
    let sharp = g.sharp(&normals.project_covector(0, &w.entropy));
    let warmed = dot(&w.energy, &sharp);
    warmed.is_finite().then_some(Direction { sharp, warmed })
}

/// Where a step that heats starts.
pub(super) struct HeatStart<L: Lengths> {
    /// The differential of the energy.
    energy: L::Vector,
    /// The change of the energy along the direction of heat.
    warmed: f64,
    /// The entries that are not warmed.
    pub(super) still: Vec<bool>,
}

// By hand, because lengths have none.
impl<L: Lengths> Clone for HeatStart<L> {
    fn clone(&self) -> Self {
        Self { energy: self.energy.clone(), warmed: self.warmed, still: self.still.clone() }
    }
}

/// The start of a step at a point; `None` where heat has no direction there.
pub(super) fn start<L: Lengths>(
    parts: &Parts<'_, L>,
    x: &L::State,
    w: &OfLaws<L::Vector>,
) -> Option<HeatStart<L>> {
    let still = still(parts, x, w)?;
    let at = direction(parts, x, w, &still)?;
    let start = HeatStart { energy: w.energy.clone(), warmed: at.warmed, still };
    at.is_clear(parts, &w.energy).then_some(start)
}

/// A step that heats.
pub(super) struct Step<'a, L: Lengths> {
    pub(super) parts: &'a Parts<'a, L>,
    pub(super) tableau: &'static Tableau,
    pub(super) chart: &'a StepChart<L>,
    pub(super) h: f64,
    pub(super) x: &'a L::State,
    pub(super) start: &'a HeatStart<L>,
    /// Whether friction vanishes at every stage: then nothing is damped, and both laws are corrected.
    pub(super) is_reversible: bool,
}

/// Corrects the covectors of energy and entropy with heat; `None` where a stage is beyond a temperature of zero.
pub(super) fn add<L: Lengths>(
    step: &Step<'_, L>,
    stages: &StagePoints<L>,
    covectors: &mut StageCovectors<L>,
) -> Option<Heat<L::Vector>> {
    let &Step { parts, tableau, h, start, is_reversible, .. } = step;
    let s = tableau.stages;
    let (mut sharp, mut warmed, mut units) = (zeros(parts), [0.0; STAGES], [0.0; STAGES]);
    for i in 0..s {
        let at = direction(parts, &stages.x[i], &covectors.w[i], &start.still)?;
        (sharp[i], warmed[i]) = (at.sharp, at.warmed);
    }
    if !step.stays_above_zero(stages, &warmed) {
        return None;
    }
    let largest = parts.vector(|c| {
        let entries = covectors.w[..s].iter().map(|w| w.energy[c].abs());
        entries.fold(0.0, f64::max)
    });
    for i in 0..s {
        units[i] = parts.pairing_size(&largest, &sharp[i]);
    }
    let directed = fraction(&warmed[..s], &units[..s]);
    let lost = if is_reversible { 0.0 } else { directed * step.transient(stages, covectors)? };
    let StageCovectors { w, laws, .. } = covectors;
    let (delta, square) = (laws.energy.left, stages.square());
    if square != 0.0 {
        for i in 0..s {
            plus(&mut w[i].energy, (1.0 - lost) * delta / square, &stages.flat(i));
        }
    }
    let rho = -lost * delta / h;
    let (mut velocity, mut rounding) = (zeros(parts), parts.zero());
    let (mut gain, mut along) = (laws.entropy.left, 0.0);
    if directed > 0.0 {
        let round_off = lost * laws.energy.left_round_off;
        for i in 0..s {
            let reciprocal = dot(&w[i].energy, &sharp[i]).recip();
            let u = sharp[i].map(|sharp| sharp * reciprocal);
            velocity[i] = u.map(|u| u * rho);
            for c in 0..parts.n() {
                rounding[c] = f64::max(rounding[c], u[c].abs() * round_off);
            }
            let weight = h * tableau.weights[i];
            gain += weight * dot(&w[i].entropy, &velocity[i]);
            along += weight * dot(&stages.flat(i), &velocity[i]);
        }
    }
    let square = square - along;
    if (gain < 0.0 || is_reversible) && square != 0.0 {
        for i in 0..s {
            plus(&mut w[i].entropy, gain / square, &stages.flat(i));
        }
    }
    let gain = if is_reversible { 0.0 } else { gain };
    Some(Heat { velocity, gain, rounding })
}

impl<L: Lengths> Step<'_, L> {
    /// Returns whether no stage is beyond a temperature of zero, where no motion leads.
    fn stays_above_zero(&self, stages: &StagePoints<L>, warmed: &[f64; STAGES]) -> bool {
        let back = self.chart.d.map(|d| d * -0.5);
        let mut before = (&back, self.start.warmed);
        (0..self.tableau.stages).all(|i| {
            let here = (&stages.q[i], warmed[i]);
            let is_same = here.1 == 0.0 || before.1 == 0.0 || here.1.signum() == before.1.signum();
            let is_above = is_same || self.vanishes_between(before, here) == Some(true);
            before = here;
            is_above
        })
    }

    /// Returns whether `⟨dH, ♯n⟩` vanishes where it changes its sign between two points, whose displacements from the middle of the
    /// step stand with its values; `None` where it is not defined.
    fn vanishes_between(&self, a: (&L::Vector, f64), b: (&L::Vector, f64)) -> Option<bool> {
        let parts = self.parts;
        let (mut a, mut b) = ((a.0.clone(), a.1), (b.0.clone(), b.1));
        let jump = (b.1 - a.1).abs();
        for _ in 0..HALVINGS {
            let q = parts.vector(|c| (a.0[c] + b.0[c]) * 0.5);
            let y = parts.moved(&self.chart.z, &q);
            if !parts.is_flat() && parts.is_outside(&y) {
                return None;
            }
            let w = parts.differentials(&y);
            let middle = (q, direction(parts, &y, &w, &self.start.still)?.warmed);
            if middle.1.signum() == a.1.signum() {
                a = middle;
            } else {
                b = middle;
            }
            let now = (b.1 - a.1).abs();
            if now * JUMP <= jump || now >= JUMP * jump {
                return Some(now < jump);
            }
        }
        Some(false)
    }

    /// The fraction `τ` of what is lost that becomes heat: the part of friction in the pairings of the variations of the velocity and
    /// of `dH` in the step.
    fn transient(&self, stages: &StagePoints<L>, covectors: &StageCovectors<L>) -> Option<f64> {
        let &Self { parts, tableau, chart, start, .. } = self;
        let (s, weights) = (tableau.stages, &tableau.weights);
        let mut reversible = zeros(parts);
        for i in 0..s {
            reversible[i] = parts.reversible(stages.at(i), &covectors.w[i])?;
        }
        let friction =
            each_stage(parts, s, |i| parts.vector(|c| stages.v[i][c] - reversible[i][c]));
        let nothing = parts.zero();
        let to_middle = |all: Stages<L::Vector>| {
            each_stage(parts, s, |i| parts.velocity_at(&chart.z, (&stages.x[i], &nothing), &all[i]))
        };
        let back = chart.d.map(|d| d * -0.5);
        let mut sums = [0.0; 2];
        for (sum, velocity) in sums.iter_mut().zip([reversible, friction].map(to_middle)) {
            let mut mean = parts.zero();
            (0..s).for_each(|i| plus(&mut mean, weights[i], &velocity[i]));
            for i in 0..s {
                let varied = parts.vector(|c| velocity[i][c] - mean[c]);
                let here = parts.velocity_at(&stages.x[i], (&chart.z, &stages.q[i]), &varied);
                let before = parts.velocity_at(self.x, (&chart.z, &back), &varied);
                let paired = dot(&covectors.w[i].energy, &here) - dot(&start.energy, &before);
                *sum += weights[i] * paired.abs();
            }
        }
        let sum = sums[0] + sums[1];
        Some(if sum > 0.0 { sums[1] / sum } else { 0.0 })
    }
}
