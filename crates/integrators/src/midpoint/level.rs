//! The last digits of the laws at the end of a step.
//!
//! Both brackets annihilate `w_H`, so `⟨w_H, F(u)⟩ = e` for every `u`, with the error `e = H(x') − H(x) + φe₀` of
//! the energy. Once `h|Π|` is large the sum `d − h(Πw + K dS)` has lost digits of this number that the
//! difference `H(x') − H(x)` has. So the last correction is that of the residual whose part along `w_H` is exact,
//!
//! ```math
//! F + (e - \langle w, F\rangle)\, \frac{♯w}{\langle w, ♯w\rangle} ,
//! ```
//!
//! with `♯` in units of the round-off of each component, as long as this changes `F` within its round-off and
//! reduces `e`. Where the entropy falls, its part along `w_S` is made exact too.
//!
//! Where the end is nearer to the edge of a domain than the displacement has digits, no `u` has the
//! right energy, and a numerical geodesic has an error of its own: there the end itself is moved, within
//! the accuracy of geodesics.

use metriplectic_dynamics::orthogonal::{InUnits, Orthogonal};
use metriplectic_dynamics::velocity::differentials;
use metriplectic_dynamics::{Metriplectic, system::Point};
use metriplectic_fields::{ChartPoint, Column, Dimension, Space, Square, Vector};
use metriplectic_manifolds::{InnerProduct, Manifold, Retraction};

use super::equation::{Dissipated, Jet, Residual};
use crate::discrete_gradient::DiscreteGradient;
use crate::newton::Root;
use crate::round_off::bound::{ROUNDED, of_an_increment, size_of_terms};
use crate::step::{Dim, Effort};

/// A root and its end, with the last digits of the laws.
pub(crate) struct Polished<Y: Metriplectic> {
    pub(crate) u: Vector<Y::Manifold>,
    pub(crate) end: Point<Y>,
    /// Whether the end is no longer that of `u`.
    pub(crate) moved: bool,
    /// Energy and entropy at the end, where they are known.
    pub(crate) evaluated: Option<[f64; 2]>,
}

/// Energy and entropy at a point where the laws hold to round-off, so that nothing is to be corrected.
#[inline]
pub(crate) fn held<Y: Metriplectic, R, W>(
    equation: &Residual<'_, Y, R, W>,
    x: &Point<Y>,
) -> Option<[f64; 2]>
where
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    let laws = [equation.system.energy_at(x), equation.system.entropy_at(x)];
    let Defects { balanced, falls, .. } = Defects::of(equation, laws);
    (balanced && !(falls && equation.is_exact())).then_some(laws)
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

impl Defects {
    #[inline]
    fn of<Y: Metriplectic, R, W>(
        Residual { values, drift, .. }: &Residual<'_, Y, R, W>,
        [energy, entropy]: [f64; 2],
    ) -> Self {
        let e = energy - values.energy + drift.energy;
        Self {
            e,
            balanced: e.abs() <= ROUNDED * values.energy.abs(),
            falls: entropy - values.entropy < -ROUNDED * values.entropy.abs(),
        }
    }
}

/// Corrects a root with the end `x'` at which the energy is not conserved to round-off, or the entropy falls.
#[inline]
pub(crate) fn polish<Y, R, W>(
    equation: &Residual<'_, Y, R, W>,
    root: &Root<Y::Manifold, Dissipated>,
    end: Point<Y>,
    effort: &mut Effort,
) -> Polished<Y>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    let laws = [equation.system.energy_at(&end), equation.system.entropy_at(&end)];
    match corrected(equation, root, &end, laws) {
        Some(corrected) => {
            effort.iterations += 1;
            corrected
        }
        None => Polished { u: root.u, end, moved: false, evaluated: Some(laws) },
    }
}

/// The corrected root of an end with this energy and entropy; `None` if there is nothing to correct.
#[inline]
fn corrected<Y, R, W>(
    equation: &Residual<'_, Y, R, W>,
    root: &Root<Y::Manifold, Dissipated>,
    end: &Point<Y>,
    laws: [f64; 2],
) -> Option<Polished<Y>>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    let Defects { e, balanced, falls } = Defects::of(equation, laws);
    let corrected = if balanced { None } else { Level { equation }.energy(root, end, e) };
    if corrected.is_none() && falls && equation.is_exact() {
        return Level { equation }.entropy(root, end, e);
    }
    corrected
}

/// The error `e = H(x') − H(x) + φe₀` of the energy at a point.
#[inline]
fn imbalance<Y: Metriplectic, R, W>(equation: &Residual<'_, Y, R, W>, end: &Point<Y>) -> f64 {
    equation.system.energy_at(end) - equation.values.energy + equation.drift.energy
}

/// The level of the energy that the end of a step belongs to.
struct Level<'a, 'b, Y: Metriplectic, R, W> {
    equation: &'a Residual<'b, Y, R, W>,
}

impl<Y, R, W> Level<'_, '_, Y, R, W>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
    W: DiscreteGradient,
{
    /// The correction for an error `e` of the energy.
    #[cold]
    fn energy(
        &self,
        Root { u, residual_bound, .. }: &Root<Y::Manifold, Dissipated>,
        end: &Point<Y>,
        e: f64,
    ) -> Option<Polished<Y>> {
        let Residual { system, x, .. } = self.equation;
        // Where the round-off of the equation is near that of the entries of x', an error within the
        // roundings of the energy's terms needs no correction.
        let coarse = *residual_bound > 2.0 * ROUNDED * Y::Manifold::magnitude(x);
        let closed = self.has_closed_geodesics();
        if closed
            && !coarse
            && e.abs() <= ROUNDED * size_of_terms::<Y::Manifold>(system.energy(), end)
        {
            return None;
        }
        if !closed && let Some(end) = self.move_onto_level(u, end) {
            return Some(Polished { u: *u, end, moved: true, evaluated: None });
        }
        let balanced = self.corrected(u, e, None);
        let balanced = balanced.filter(|(_, end)| imbalance(self.equation, end).abs() < e.abs());
        let (u, at) = balanced.as_ref().map_or((u, end), |(u, end)| (u, end));
        if (closed || balanced.is_some())
            && let Some(end) = self.move_onto_level(u, at)
        {
            return Some(Polished { u: *u, end, moved: true, evaluated: None });
        }
        balanced.map(|(u, end)| Polished { u, end, moved: false, evaluated: None })
    }

    /// The correction for an entropy that has fallen by nearly its round-off, if it then falls by less.
    #[cold]
    fn entropy(
        &self,
        Root { u, .. }: &Root<Y::Manifold, Dissipated>,
        end: &Point<Y>,
        e: f64,
    ) -> Option<Polished<Y>> {
        let Residual { system, x, values, drift, .. } = self.equation;
        let entropy = system.entropy_at(end);
        if values.entropy - entropy <= 0.5 * of_an_increment(*system, [*x, end]) {
            return None;
        }
        let (u, end) = self.corrected(u, e, Some(entropy - values.entropy + drift.entropy))?;
        let better = system.entropy_at(&end) > entropy;
        let allowed = e.abs().max(ROUNDED * values.energy.abs());
        let balanced = imbalance(self.equation, &end).abs() <= allowed;
        (better && balanced).then_some(Polished { u, end, moved: false, evaluated: None })
    }

    /// A root after one more correction, in whose residual the part along `w_H` is the error `e` of the energy,
    /// and the one along `w_S` belongs to the `change` of the entropy, if this is given.
    fn corrected(
        &self,
        u: &Vector<Y::Manifold>,
        e: f64,
        change: Option<f64>,
    ) -> Option<(Vector<Y::Manifold>, Point<Y>)> {
        let Jet { at, energy, entropy, d, growth } = self.equation.jet(u)?;
        let rounding = at.rounding.bounds(&at.jacobian) + d.abs() * f64::EPSILON;
        // Each component takes its part in units of its own round-off, and of what is left of it.
        let bounds = rounding + at.residual.abs();
        let g = InUnits(bounds);
        let mut exact = at.residual;
        let mut across = Orthogonal::<Dim<Y>>::default();
        let parts = [Some((energy, e)), change.map(|change| (entropy, change - growth))];
        for (w, part) in parts.into_iter().flatten() {
            let sharp = g.sharp(&across.project_covector(0, &w));
            across.push(&g, &w);
            exact += sharp * ((part - w.dot(&exact)) / sharp.dot(&w));
        }
        let u = *u - at.jacobian.solve(&exact)?;
        let Residual { system, retraction, x, .. } = self.equation;
        let end = retraction.end(system.metric(), x, &u).ok()?;
        let added = exact - at.residual;
        let within = (0..Dim::<Y>::LEN).all(|i| added[i].abs() <= bounds[i]);
        within.then_some((u, end))
    }

    /// The relative accuracy of the ends of paths.
    fn accuracy(&self) -> f64 {
        let Residual { system, retraction, .. } = self.equation;
        retraction.accuracy(system.metric())
    }

    /// Whether the ends of geodesics are good to a few roundings.
    fn has_closed_geodesics(&self) -> bool {
        self.accuracy() <= ROUNDED
    }

    /// The end `x'` moved onto the level of the energy, within the accuracy of geodesics: by the shortest
    /// way within a rounding; beyond it along the levels of the entropy and the further invariants, or of the
    /// entropy alone where the differential of the energy hardly differs from theirs.
    fn move_onto_level(&self, u: &Vector<Y::Manifold>, end: &Point<Y>) -> Option<Point<Y>> {
        let Residual { system, x, values, .. } = self.equation;
        let e = imbalance(self.equation, end);
        if e.abs() <= ROUNDED * values.energy.abs() {
            return None;
        }
        // The entries of x' = x + u are rounded in units of x and of u, however small they are.
        let sizes = Y::Manifold::scales(x) + u.abs();
        let g = InUnits(sizes);
        let w = differentials(*system, &ChartPoint::<Y::Manifold>::centre(end));
        let limit = self.accuracy() * (Dim::<Y>::LEN as f64).sqrt();
        let moved = |kept: &Orthogonal<Dim<Y>>| {
            let across = g.sharp(&kept.project_covector(0, &w.energy));
            let step = across * (-e / across.dot(&w.energy));
            let within = (0..Dim::<Y>::LEN).all(|i| step[i].abs() <= limit * sizes[i]);
            let moved = Y::Manifold::chart(end, &step);
            let better = imbalance(self.equation, &moved).abs() < e.abs();
            (within && better).then_some(moved)
        };
        let mut kept = Orthogonal::<Dim<Y>>::default();
        if self.has_closed_geodesics() {
            return moved(&kept);
        }
        if self.equation.is_exact() {
            kept.push(&g, &w.entropy);
        }
        let entropy = kept;
        for (_, l) in w.invariants.as_ref().iter().flatten() {
            kept.push(&g, l);
        }
        moved(&kept).or_else(|| moved(&entropy))
    }
}
