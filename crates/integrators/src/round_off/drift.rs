//! Correction of the round-off that earlier steps have accumulated in H, S and the invariants.

use metriplectic_dynamics::velocity::differentials;
use metriplectic_dynamics::{Bracket, Dissipation, Invariants, Metriplectic};
use metriplectic_fields::{ChartPoint, Column, Dimension, Matrix, Square, Vector};
use metriplectic_manifolds::InnerProduct;

use crate::round_off::bound::ROUNDED;
use crate::step::{CountOf, DriftCorrection, Laws, Start};

/// Makes the correction that is zero, as in the definition of the scheme.
pub(crate) fn nothing<Y: Metriplectic>() -> DriftCorrection<Y> {
    Laws { energy: 0.0, entropy: 0.0, invariants: CountOf::<Y>::array(|_| 0.0) }
}

/// The fractions `φe` of the accumulated errors `e` that the step takes back.
///
/// The errors of the solver would make the energy a random walk over millions of steps, so
/// a step aims at `H(x₀)` instead of `H(x)`, once they differ by more than a few units of round-off.
/// Asking for `⟨w, d⟩ = F(x') − F(x) + φe` changes the covector by `φe ♭d/G(d, d)`, and with it the
/// displacement by some `δ`, which must stay small against `d`. Both are compared by the change of `F` that goes
/// with them, which has one unit: `φ = r²/(1 + r²)` with `r = Σ|∂_iF d_i| / (10² Σ|∂_iF δ_i|)` for `φ = 1`. It is
/// all of `e` while the state moves, and nothing of it at rest, where the correction would stop every motion.
///
/// For the energy `δ_i = h Σ_j (|Π| + |K'|)_ij |♭d_j| |e|/G(d, d)`. The covectors of the entropy and of the
/// further invariants enter by the projections, where `Σ|∂_iF δ_i| = |e|`, and that of the entropy by `K` as
/// well.
pub(crate) fn target<Y: Metriplectic>(
    system: &Y,
    start: &Start<'_, Y>,
    d: &Vector<Y::Manifold>,
) -> DriftCorrection<Y> {
    let Laws { energy, entropy, invariants } = start.accumulated_error;
    let values = &start.values;
    let far = |e: f64, size: f64| e.abs() > ROUNDED * size;
    let mut off = far(energy, values.energy.abs()) || far(entropy, values.entropy.abs());
    for k in 0..Y::Invariants::COUNT {
        off |= far(invariants[k], values.invariants[k].abs());
    }
    if !off {
        return nothing::<Y>();
    }
    let x = ChartPoint::<Y::Manifold>::centre(start.x);
    let w = differentials(system, &x);
    let g = system.metric_at(&x);
    let args = system.bracket_args(&g, &w.entropy);
    let pi = system.bracket().linearise(&args, &w.energy);
    let k = system.dissipation().linearise(&g, &w.energy, &w.entropy);
    let (Ok(pi), Ok(k), Ok(g)) = (pi, k, g.inner()) else { return nothing::<Y>() };
    let mut sensitivity = pi.tensor.abs() + k.along_w.abs();
    if system.bracket().is_forced()
        && let Ok(force) = system.bracket().linearise_force(&args, &w.energy)
    {
        sensitivity += force.tensor.abs();
    }
    let (flat, length) = (g.flat(d), d.abs());
    // Σ|∂_iF δ_i|/|e| for a δ by a tensor.
    let moved = |df: &Vector<Y::Manifold>, tensor: Matrix<Y::Manifold>| {
        df.abs().dot(&(tensor * flat.abs())) * start.h.abs() / flat.dot(d)
    };
    let fraction = |e: f64, size: f64, df: &Vector<Y::Manifold>, sensitivity: f64| {
        let r = df.abs().dot(&length) / (1e2 * sensitivity * e.abs());
        if far(e, size) && r.is_finite() { e / (1.0 + r.powi(-2)) } else { 0.0 }
    };
    let of_energy = moved(&w.energy, sensitivity);
    let of_entropy = 1.0 + moved(&w.entropy, k.tensor.abs());
    DriftCorrection::<Y> {
        energy: fraction(energy, values.energy.abs(), &w.energy, of_energy),
        // An entropy that has risen by round-off comes back by less than a fall in each step.
        entropy: fraction(entropy, values.entropy.abs(), &w.entropy, of_entropy)
            .min(2.0 * f64::EPSILON * values.entropy.abs()),
        invariants: CountOf::<Y>::array(|k| {
            let size = values.invariants[k].abs();
            w.invariants[k].map_or(0.0, |(_, dl)| fraction(invariants[k], size, &dl, 1e6))
        }),
    }
}
