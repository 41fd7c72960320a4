//! The kinetic drift of a list of terms, by dual numbers.

use metriplectic_fields::{ChartPoint, Column, Dimension, Jet2, Real, ScalarField, Vector};
use metriplectic_manifolds::{Canonical, Manifold, MetricAt, MetricError, Riemannian};
use num_dual::DualNum as _;

use super::terms::NoiseTerm;

/// A point with the covectors of energy and further invariants, whose derivatives along two directions of the chart are in
/// `ε₁` and `ε₂`.
#[derive(Clone, Debug)]
pub struct Place<M: Manifold> {
    /// The point.
    pub x: ChartPoint<M, Real>,
    /// The differential of the energy.
    pub w: Vector<M, Real>,
    /// The differential of the entropy.
    pub s: Vector<M, Real>,
    /// The differentials of the further invariants.
    pub invariants: Vec<Vector<M, Real>>,
}

/// A visitor of terms.
pub type TermVisitor<'a, M> = dyn FnMut(usize, NoiseTerm<Vector<M, Real>>) + 'a;

/// The differential of a field, with its derivatives along two directions.
pub(super) fn seeded<M: Manifold>(jet: &Jet2<M>, [i, j]: [usize; 2]) -> Vector<M, Real> {
    let slope = |k: usize, i: usize| if i < M::Dim::LEN { jet.hf[(k, i)] } else { 0.0 };
    Vector::<M, Real>::from_index(|k| Real::new(jet.df[k], slope(k, i), slope(k, j), 0.0))
}

/// The centre of a chart, seeded along two directions.
pub(super) fn centre<M: Manifold>(x: &M::Point<f64>, [i, j]: [usize; 2]) -> ChartPoint<M, Real> {
    let one = |k: usize, direction: usize| if k == direction { 1.0 } else { 0.0 };
    let q = Vector::<M, Real>::from_index(|k| Real::new(0.0, one(k, i), one(k, j), 0.0));
    ChartPoint { base: x.clone(), q }
}

/// The differential of `ln μ` at the centre of a chart, with that of the canonical volume in its coordinates.
pub(super) fn ln_density<M: Manifold>(
    x: &M::Point<f64>,
    measure: &impl ScalarField<M>,
) -> Result<Vector<M>, MetricError>
where
    Canonical: Riemannian<M>,
{
    let n = M::Dim::LEN;
    let mut slopes = measure.jet1(x).df;
    for i in (0..n).step_by(2) {
        let at = centre::<M>(x, [i, i + 1]);
        let density = MetricAt::<M, _, Real>::new(&Canonical, &at).volume_density()?.ln();
        slopes[i] += density.eps1;
        if i + 1 < n {
            slopes[i + 1] += density.eps2;
        }
    }
    Ok(slopes)
}

/// A term and its divergence so far.
#[derive(Clone, Copy)]
struct Sum<V> {
    rate: f64,
    b: V,
    /// `∂_i bⁱ`.
    divergence: f64,
    /// `⟨dρ, b⟩`.
    slope: f64,
}

/// Computes `Σ_r c_r b_r` with `c_r = ρ_r div_μ b_r + ½ ⟨dρ_r, b_r⟩` at a point, from terms at places around it.
///
/// `place` seeds two directions, and `each` passes the terms there to a visitor, always in the same order.
///
/// # Errors
///
/// [`MetricError`] if the metric or the chart cannot be used there.
pub fn kinetic_drift<M: Manifold>(
    x: &M::Point<f64>,
    measure: &impl ScalarField<M>,
    place: impl Fn([usize; 2]) -> Place<M>,
    each: impl Fn(&Place<M>, &mut TermVisitor<'_, M>) -> Result<(), MetricError>,
) -> Result<Vector<M>, MetricError>
where
    Canonical: Riemannian<M>,
{
    let n = M::Dim::LEN;
    let density = ln_density(x, measure)?;
    let mut sums: Vec<Sum<Vector<M>>> = Vec::new();
    for i in (0..n).step_by(2) {
        let mut index = 0;
        each(&place([i, i + 1]), &mut |_, NoiseTerm { rate, b }| {
            if i == 0 {
                let b: Vector<M> = b.real();
                sums.push(Sum { rate: rate.re, b, divergence: density.dot(&b), slope: 0.0 });
            }
            let sum = &mut sums[index];
            sum.divergence += b[i].eps1;
            sum.slope += rate.eps1 * sum.b[i];
            if i + 1 < n {
                sum.divergence += b[i + 1].eps2;
                sum.slope += rate.eps2 * sum.b[i + 1];
            }
            index += 1;
        })?;
    }
    let drift = |sum: &Sum<Vector<M>>| sum.b * (sum.rate * sum.divergence + 0.5 * sum.slope);
    Ok(sums.iter().fold(Vector::<M>::zero(), |total, sum| total + drift(sum)))
}
