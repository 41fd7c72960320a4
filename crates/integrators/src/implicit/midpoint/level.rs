//! The last digits of the laws at the end of a step, as in [`crate::midpoint`], whose file of this name has the formulas.

use metriplectic_equations::{ENERGY, ENTROPY};

use super::equation::{Equation, Linearised};
use super::newton::Root;
use crate::implicit::algebra::{add, dot, magnitude};
use crate::implicit::metric::Units;
use crate::implicit::orthogonal::Orthogonal;
use crate::numbers::Lengths;
use crate::round_off::bound::ROUNDED;
use crate::step::Effort;

/// A root and its end, with the last digits of the laws.
pub(super) struct Polished<L: Lengths> {
    pub(super) u: L::Vector,
    pub(super) end: L::State,
    /// Whether the end is no longer that of `u`.
    pub(super) moved: bool,
    /// Energy and entropy at the end, where they are known.
    pub(super) evaluated: Option<[f64; 2]>,
}

/// Errors of the laws at the end of a step.
struct Defects {
    /// The error `e` of the energy.
    e: f64,
    /// Whether it is round-off.
    balanced: bool,
    /// Whether the entropy falls by more than its round-off.
    falls: bool,
}

impl<L: Lengths> Equation<'_, L> {
    fn energy_and_entropy(&self, x: &L::State) -> [f64; 2] {
        [ENERGY, ENTROPY].map(|law| self.parts.value(law, x))
    }

    fn defects(&self, [energy, entropy]: [f64; 2]) -> Defects {
        let Self { values, drift, .. } = self;
        let e = energy - values.energy + drift.energy;
        Defects {
            e,
            balanced: e.abs() <= ROUNDED * values.energy.abs(),
            falls: entropy - values.entropy < -ROUNDED * values.entropy.abs(),
        }
    }

    /// Energy and entropy at a point where the laws hold to round-off, so that nothing is to be corrected.
    pub(super) fn held(&self, x: &L::State) -> Option<[f64; 2]> {
        let laws = self.energy_and_entropy(x);
        let Defects { balanced, falls, .. } = self.defects(laws);
        (balanced && !(falls && self.is_exact())).then_some(laws)
    }

    /// Corrects a root with the end `x'` at which the energy is not conserved to round-off, or the entropy falls.
    pub(super) fn polish(&self, root: &Root<L>, end: L::State, effort: &mut Effort) -> Polished<L> {
        let laws = self.energy_and_entropy(&end);
        let Defects { e, balanced, falls } = self.defects(laws);
        let mut corrected = if balanced { None } else { self.onto_energy(root, &end, e) };
        if corrected.is_none() && falls && self.is_exact() {
            corrected = self.onto_entropy(root, &end, e);
        }
        match corrected {
            Some(corrected) => {
                effort.iterations += 1;
                corrected
            }
            None => Polished { u: root.u.clone(), end, moved: false, evaluated: Some(laws) },
        }
    }

    /// The error `e = H(x') − H(x) + φe₀` of the energy at a point.
    fn imbalance(&self, end: &L::State) -> f64 {
        self.parts.value(ENERGY, end) - self.values.energy + self.drift.energy
    }

    /// The correction for an error `e` of the energy.
    #[cold]
    fn onto_energy(
        &self,
        Root { u, residual_bound, .. }: &Root<L>,
        end: &L::State,
        e: f64,
    ) -> Option<Polished<L>> {
        // Where the round-off of the equation is near that of the entries of x', an error within the roundings of the energy's terms
        // needs no correction.
        let is_coarse = *residual_bound > 2.0 * ROUNDED * magnitude(self.x);
        let is_closed = self.has_closed_geodesics();
        if is_closed && !is_coarse && e.abs() <= ROUNDED * self.parts.size_of_terms(ENERGY, end) {
            return None;
        }
        if !is_closed && let Some(end) = self.moved_onto_level(u, end) {
            return Some(Polished { u: u.clone(), end, moved: true, evaluated: None });
        }
        let balanced = self.corrected(u, e, None);
        let balanced = balanced.filter(|(_, end)| self.imbalance(end).abs() < e.abs());
        let (u, at) = balanced.as_ref().map_or((u, end), |(u, end)| (u, end));
        if (is_closed || balanced.is_some())
            && let Some(end) = self.moved_onto_level(u, at)
        {
            return Some(Polished { u: u.clone(), end, moved: true, evaluated: None });
        }
        balanced.map(|(u, end)| Polished { u, end, moved: false, evaluated: None })
    }

    /// The correction for an entropy that has fallen by nearly its round-off, if it then falls by less.
    #[cold]
    fn onto_entropy(
        &self,
        Root { u, .. }: &Root<L>,
        end: &L::State,
        e: f64,
    ) -> Option<Polished<L>> {
        let Self { parts, x, values, drift, .. } = self;
        let entropy = parts.value(ENTROPY, end);
        if values.entropy - entropy <= 0.5 * parts.of_an_increment([x, end]) {
            return None;
        }
        let (u, end) = self.corrected(u, e, Some(entropy - values.entropy + drift.entropy))?;
        let is_better = parts.value(ENTROPY, &end) > entropy;
        let allowed = e.abs().max(ROUNDED * values.energy.abs());
        let is_balanced = self.imbalance(&end).abs() <= allowed;
        let polished = Polished { u, end, moved: false, evaluated: None };
        (is_better && is_balanced).then_some(polished)
    }

    /// A root after one more correction, in whose residual the part along `w_H` is the error `e` of the energy, and the one along
    /// `w_S` belongs to the `change` of the entropy, if this is given.
    fn corrected(
        &self,
        u: &L::Vector,
        e: f64,
        change: Option<f64>,
    ) -> Option<(L::Vector, L::State)> {
        let parts = self.parts;
        let at = self.linearise(u)?;
        let rounding = at.rounding.bounds(parts, &at.jacobian);
        let Linearised { residual, jacobian, energy, entropy, growth, d, .. } = at;
        // Each component takes its part in units of its own round-off, and of what is left of it.
        let bounds =
            parts.vector(|i| (rounding[i] + d[i].abs() * f64::EPSILON) + residual[i].abs());
        let g: Units<'_, L> = Units::Sizes(&bounds);
        let mut exact = residual.clone();
        let mut across = Orthogonal::none();
        let of_entropy = change.map(|change| (entropy, change - growth));
        for (w, part) in [Some((energy, e)), of_entropy].into_iter().flatten() {
            let sharp = g.sharp(&across.project_covector(0, &w));
            across.push(g, &w);
            let c = (part - dot(&w, &exact)) / dot(&sharp, &w);
            add(&mut exact, c, &sharp);
        }
        let step = jacobian.solve(&exact)?;
        let u = parts.vector(|i| u[i] - step[i]);
        let end = parts.end(self.line.path, self.x, &u)?;
        let is_within = |i: usize| (exact[i] - residual[i]).abs() <= bounds[i];
        (0..parts.n()).all(is_within).then_some((u, end))
    }

    /// Returns whether the ends of paths are good to a few roundings.
    fn has_closed_geodesics(&self) -> bool {
        self.parts.accuracy(self.line.path) <= ROUNDED
    }

    /// The end `x'` moved onto the level of the energy, within the accuracy of paths: by the shortest way within a rounding; beyond it
    /// along the levels of the entropy and the further invariants, or of the entropy alone.
    fn moved_onto_level(&self, u: &L::Vector, end: &L::State) -> Option<L::State> {
        let Self { parts, x, values, .. } = self;
        let e = self.imbalance(end);
        if e.abs() <= ROUNDED * values.energy.abs() {
            return None;
        }
        // The entries of x' = x + u are rounded in units of x and of u, however small they are.
        let of_x = parts.scales(x);
        let sizes = parts.vector(|i| of_x[i] + u[i].abs());
        let g: Units<'_, L> = Units::Sizes(&sizes);
        let accuracy = parts.accuracy(self.line.path).max(ROUNDED);
        let limit = accuracy * (parts.n() as f64).sqrt();
        let moved = |kept: &Orthogonal<L>, w: &L::Vector| {
            let across = g.sharp(&kept.project_covector(0, w));
            let c = -e / dot(&across, w);
            let step = parts.vector(|i| across[i] * c);
            let is_within = (0..parts.n()).all(|i| step[i].abs() <= limit * sizes[i]);
            let moved = parts.moved(end, &step);
            let is_better = self.imbalance(&moved).abs() < e.abs();
            (is_within && is_better).then_some(moved)
        };
        if self.has_closed_geodesics() {
            return moved(&Orthogonal::none(), &parts.jet(ENERGY, end).1);
        }
        let w = parts.differentials(end);
        let along_entropy = || {
            let mut kept = Orthogonal::none();
            if self.is_exact() {
                kept.push(g, &w.entropy);
            }
            kept
        };
        let mut kept = along_entropy();
        w.invariants.iter().for_each(|l| kept.push(g, l));
        moved(&kept, &w.energy).or_else(|| moved(&along_entropy(), &w.energy))
    }
}
