//! Stiff friction that is damped: what a Radau method loses of the energy becomes heat.
//!
//! Radau's weights are algebraically stable. On a step that is long for friction the method loses energy where the
//! energy is convex, and gains entropy where the entropy is concave. To correct the covectors for both would undo the
//! damping. So the fraction `τ` of the energy that *friction* has lost is returned by a velocity along the entropy,
//!
//! ```math
//! v_i = \tilde\Pi_i\, w_{H,i} + \tilde K_i\, w_{S,i} + \rho\, u_i, \qquad
//! u_i = \frac{♯n_i}{\langle w_{H,i}, ♯n_i\rangle}, \qquad h\rho = -\tau\,\delta_H ,
//! ```
//!
//! with `n_i` the part of `dS` that is orthogonal to the covectors of the further invariants and to the entries that
//! friction does not move, and `w_H = dH + (1 − τ) δ_H ♭v/D`. Then `ΔH = 0` and
//!
//! ```math
//! \Delta S = h \sum_i b_i \tilde K_i(w_{S,i}, w_{S,i}) + \max(N, 0), \qquad
//! N = \delta_S + h\rho \sum_i b_i \langle dS, u_i\rangle ,
//! ```
//!
//! if the covector of the entropy is corrected where `N < 0`, by `a_S = N/(D - h\rho \sum_i b_i \langle ♭v_i, u_i\rangle)`.
//! Near an equilibrium `dS = β dH`, and with `τ = 1` the number `N = δ_S − β δ_H` is the gain of `S − βH`, which has a
//! maximum there: it is not negative, and nothing is corrected.
//!
//! At an infinite temperature `⟨dH, ♯n⟩` changes its sign and `u` has no direction: near it `τ` is reduced to zero. How
//! near is measured with the largest entries of `dH` at the stages, since a single term is never small beside itself.
//! It damps nothing where friction vanishes at every stage, and the entropy is corrected in both directions.
//!
//! `u` is a choice: where an unresolved transient loses energy, the laws do not say which variable warms. Heat moves no
//! entry whose row of `K` is zero at the start, such as a length on which the entropy depends. Where several entries may
//! take it, the metric shares it.

use metriplectic_dynamics::orthogonal::Orthogonal;
use metriplectic_dynamics::velocity::{self, Covectors, differentials};
use metriplectic_dynamics::{Dissipation as _, Metriplectic, system::Point};
use metriplectic_fields::{ChartPoint, Column, Dimension, Space as _, Vector};
use metriplectic_manifolds::{InnerProduct, Manifold, Riemannian};

use super::chart::{StepChart, in_chart_at};
use super::covectors::{StageCovectorsOf, StagePoints, Stages, at_stage};
use super::tableau::{STAGES, Tableau};
use crate::step::{CountOf, Dim};

/// The heat that is added to the stages.
#[derive(Clone, Copy, Debug)]
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

impl<V: Column<f64>> Direction<V> {
    /// The change of the energy in units of its terms with these entries of `dH`; zero without terms.
    fn alignment<M: Manifold<Dim: Dimension<Vector<f64> = V>>>(&self, energy: &V) -> f64 {
        let terms = M::pairing_size(energy, &self.sharp);
        if terms > 0.0 { self.warmed / terms } else { 0.0 }
    }
}

/// The alignment up to which there is no heat: at an infinite temperature the entropy does not change the energy.
/// A factor of four fails `tests/collocation.rs::orders_through_infinite_temperatures`.
pub(crate) const FAINT: f64 = 0.01;
/// The alignment from which on all that friction has lost becomes heat.
/// A factor of four fails `tests/tangent/collocated.rs::parameters_of_a_metric_are_columns_of_stages`.
const CLEAR: f64 = 0.1;

/// The entries that are not warmed.
type Still<Y> = <Dim<Y> as Dimension>::Array<bool>;

/// The entries that friction does not move at a point; none where nothing would be left that the entropy depends on.
fn still<Y: Metriplectic>(
    system: &Y,
    x: &Point<Y>,
    w: &Covectors<CountOf<Y>, Vector<Y::Manifold>>,
) -> Option<Still<Y>> {
    let centre = ChartPoint::<Y::Manifold>::centre(x);
    let g = system.metric_at(&centre);
    let k = system.dissipation().tensor(&g, &w.energy).ok()?;
    let still = Dim::<Y>::array(|i| (0..Dim::<Y>::LEN).all(|j| k[(i, j)] == 0.0));
    let is_warmed = is_clear::<Y>(&direction(system, x, w, &still)?, &w.energy);
    Some(if is_warmed { still } else { Dim::<Y>::array(|_| false) })
}

/// The direction of heat at a point; `None` where there is no metric.
fn direction<Y: Metriplectic>(
    system: &Y,
    x: &Point<Y>,
    w: &Covectors<CountOf<Y>, Vector<Y::Manifold>>,
    still: &Still<Y>,
) -> Option<Direction<Vector<Y::Manifold>>> {
    let g = system.metric().at(&ChartPoint::<Y::Manifold>::centre(x)).ok()?;
    let mut normals = Orthogonal::<Dim<Y>>::default();
    for (i, _) in still.as_ref().iter().enumerate().filter(|(_, still)| **still) {
        normals.push(&g, &Column::from_index(|j| if j == i { 1.0 } else { 0.0 }));
    }
    for (_, l) in w.invariants.as_ref().iter().flatten() {
        normals.push(&g, l);
    }
    let sharp = g.sharp(&normals.project_covector(0, &w.entropy));
    let warmed = w.energy.dot(&sharp);
    warmed.is_finite().then_some(Direction { sharp, warmed })
}

/// Returns whether a direction of heat changes the energy by more than its terms leave.
fn is_clear<Y: Metriplectic>(
    at: &Direction<Vector<Y::Manifold>>,
    energy: &Vector<Y::Manifold>,
) -> bool {
    at.alignment::<Y::Manifold>(energy).abs() > FAINT
}

/// The fraction of the heat that goes in the directions of the stages, which change the energy by these numbers; the units
/// are sums of terms with the largest entries of `dH` at the stages. At an infinite temperature the direction turns: near
/// one there is no heat, and on its other side neither.
pub(crate) fn fraction(warmed: &[f64], units: &[f64]) -> f64 {
    let sign = warmed.last().map_or(0.0, |last| last.signum());
    warmed.iter().zip(units).fold(1.0, |least, (warmed, unit)| {
        let along = if *unit > 0.0 { sign * warmed / unit } else { 0.0 };
        least.min(((along - FAINT) / (CLEAR - FAINT)).clamp(0.0, 1.0))
    })
}

/// Where a step that heats starts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HeatStart<N: Dimension> {
    /// The differential of the energy.
    energy: N::Vector<f64>,
    /// The change of the energy along the direction of heat.
    warmed: f64,
    /// The entries that are not warmed.
    still: N::Array<bool>,
}

impl<N: Dimension> HeatStart<N> {
    /// Returns whether an entry is not warmed.
    pub(crate) fn is_still(&self, entry: usize) -> bool {
        self.still.as_ref()[entry]
    }
}

/// The start of a step at a point; `None` where heat has no direction there.
pub(super) fn start<Y: Metriplectic>(
    system: &Y,
    x: &Point<Y>,
    w: &Covectors<CountOf<Y>, Vector<Y::Manifold>>,
) -> Option<HeatStart<Dim<Y>>> {
    let still = still(system, x, w)?;
    let at = direction(system, x, w, &still)?;
    let start = HeatStart { energy: w.energy, warmed: at.warmed, still };
    is_clear::<Y>(&at, &w.energy).then_some(start)
}

/// A step that heats.
#[derive(Debug)]
pub(super) struct Step<'a, Y: Metriplectic> {
    pub(super) system: &'a Y,
    pub(super) tableau: &'static Tableau,
    pub(super) chart: &'a StepChart<Y::Manifold>,
    pub(super) h: f64,
    pub(super) x: &'a Point<Y>,
    pub(super) start: &'a HeatStart<Dim<Y>>,
    /// Whether friction vanishes at every stage: then nothing is damped, and both laws are corrected.
    pub(super) is_reversible: bool,
}

/// Corrects the covectors of energy and entropy with heat; `None` where a stage is beyond a temperature of zero.
pub(super) fn add<Y: Metriplectic>(
    step: &Step<'_, Y>,
    stages: &StagePoints<Y::Manifold>,
    w: &mut StageCovectorsOf<Y>,
) -> Option<Heat<Vector<Y::Manifold>>> {
    let &Step { system, tableau, h, .. } = step;
    let zero = Vector::<Y::Manifold>::zero();
    let (mut sharp, mut warmed, mut units) = ([zero; STAGES], [0.0; STAGES], [0.0; STAGES]);
    for i in 0..tableau.stages {
        let at = direction(system, &stages.x[i], &at_stage::<Y>(w, i), &step.start.still)?;
        (sharp[i], warmed[i]) = (at.sharp, at.warmed);
    }
    if !stays_above_zero(step, stages, &warmed) {
        return None;
    }
    let largest = largest_entries(&w.energy.w[..tableau.stages]);
    for i in 0..tableau.stages {
        units[i] = Y::Manifold::pairing_size(&largest, &sharp[i]);
    }
    let directed = fraction(&warmed[..tableau.stages], &units[..tableau.stages]);
    let lost = if step.is_reversible { 0.0 } else { directed * transient(step, stages, w)? };
    let (delta, square) = (w.energy.left, stages.square());
    if square != 0.0 {
        for i in 0..tableau.stages {
            w.energy.w[i] += stages.flat(i) * ((1.0 - lost) * delta / square);
        }
    }
    let rho = -lost * delta / h;
    let [mut velocity, mut rounding] = [[zero; STAGES], [zero; STAGES]];
    let (mut gain, mut along) = (w.entropy.left, 0.0);
    if directed > 0.0 {
        for i in 0..tableau.stages {
            let u = sharp[i] * w.energy.w[i].dot(&sharp[i]).recip();
            velocity[i] = u * rho;
            rounding[i] = u.abs() * (lost * w.energy.left_round_off);
            let weight = h * tableau.weights[i];
            gain += weight * w.entropy.w[i].dot(&velocity[i]);
            along += weight * stages.flat(i).dot(&velocity[i]);
        }
    }
    let square = square - along;
    if (gain < 0.0 || step.is_reversible) && square != 0.0 {
        for i in 0..tableau.stages {
            w.entropy.w[i] += stages.flat(i) * (gain / square);
        }
    }
    let gain = if step.is_reversible { 0.0 } else { gain };
    let rounding = Vector::<Y::Manifold>::from_index(|c| {
        rounding.iter().fold(0.0, |largest, rounding| f64::max(largest, rounding[c]))
    });
    Some(Heat { velocity, gain, rounding })
}

/// The largest size of each entry.
pub(crate) fn largest_entries<V: Column<f64>>(vectors: &[V]) -> V {
    V::from_index(|c| vectors.iter().fold(0.0, |largest, v| f64::max(largest, v[c].abs())))
}

/// The factor by which the jump of `⟨dH, ♯n⟩` across a change of its sign shrinks, or grows, until it is known which one it
/// does.
pub(crate) const JUMP: f64 = 16.0;
/// Halvings of the way across a change of the sign.
pub(crate) const HALVINGS: usize = 64;

/// Returns whether no stage is beyond a temperature of zero, where no motion leads: such a root belongs to another branch of the
/// entropy. There `⟨dH, ♯n⟩` has a pole, and changes its sign as it does at an infinite temperature, where it vanishes.
fn stays_above_zero<Y: Metriplectic>(
    step: &Step<'_, Y>,
    stages: &StagePoints<Y::Manifold>,
    warmed: &[f64; STAGES],
) -> bool {
    let mut before = (step.chart.d * -0.5, step.start.warmed);
    (0..step.tableau.stages).all(|i| {
        let here = (stages.q[i], warmed[i]);
        let is_same = here.1 == 0.0 || before.1 == 0.0 || here.1.signum() == before.1.signum();
        let is_above = is_same || vanishes_between(step, before, here) == Some(true);
        before = here;
        is_above
    })
}

/// Returns whether `⟨dH, ♯n⟩` vanishes where it changes its sign between two points in the chart of the step, which stand with
/// its values; `None` where it is not defined.
fn vanishes_between<Y: Metriplectic>(
    step: &Step<'_, Y>,
    mut a: (Vector<Y::Manifold>, f64),
    mut b: (Vector<Y::Manifold>, f64),
) -> Option<bool> {
    let jump = (b.1 - a.1).abs();
    for _ in 0..HALVINGS {
        let q = (a.0 + b.0) * 0.5;
        let y = Y::Manifold::chart(&step.chart.z, &q);
        if !step.system.manifold().is_inside(&y) {
            return None;
        }
        let w = differentials(step.system, &ChartPoint::<Y::Manifold>::centre(&y));
        let middle = (q, direction(step.system, &y, &w, &step.start.still)?.warmed);
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

/// The fraction `τ` of what is lost that becomes heat: what the energy loses is a quadratic form of the variations of
/// the velocity and of `dH` in a step, and this is the part of friction in their pairings.
fn transient<Y: Metriplectic>(
    step: &Step<'_, Y>,
    stages: &StagePoints<Y::Manifold>,
    w: &StageCovectorsOf<Y>,
) -> Option<f64> {
    let &Step { system, tableau, chart, x, start, .. } = step;
    let (s, zero) = (tableau.stages, Vector::<Y::Manifold>::zero());
    let [mut reversible, mut friction] = [[zero; STAGES]; 2];
    let [mut mean_reversible, mut mean_friction] = [zero; 2];
    for i in 0..s {
        let at = ChartPoint::<Y::Manifold>::centre(&stages.x[i]);
        let g = system.metric_at(&at);
        let moved = velocity::reversible(system, &g, &at_stage::<Y>(w, i)).ok()?;
        let to_middle = |v| in_chart_at::<Y::Manifold>(&chart.z, &stages.x[i], &zero, &v);
        reversible[i] = to_middle(moved);
        friction[i] = to_middle(stages.v[i] - moved);
        mean_reversible += reversible[i] * tableau.weights[i];
        mean_friction += friction[i] * tableau.weights[i];
    }
    let back = chart.d * -0.5;
    let mut parts = [0.0; 2];
    for i in 0..s {
        let varied = [reversible[i] - mean_reversible, friction[i] - mean_friction];
        for (part, v) in parts.iter_mut().zip(varied) {
            let here = in_chart_at::<Y::Manifold>(&stages.x[i], &chart.z, &stages.q[i], &v);
            let before = in_chart_at::<Y::Manifold>(x, &chart.z, &back, &v);
            let paired = w.energy.w[i].dot(&here) - start.energy.dot(&before);
            *part += tableau.weights[i] * paired.abs();
        }
    }
    let sum = parts[0] + parts[1];
    Some(if sum > 0.0 { parts[1] / sum } else { 0.0 })
}
