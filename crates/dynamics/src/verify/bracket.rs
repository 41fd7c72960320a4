//! The laws of the bracket.

use metriplectic_fields::{
    ChartPoint, Dimension, Matrix, Scalar, Space, Square, Vector, differential,
};
use metriplectic_manifolds::MetricError;

use super::balance::{self, Balance, ROUNDING, Violation, asymmetry, largest, worse};
use super::findings::Findings;
use super::place::{Place, unusable};
use crate::bracket::{Bracket, epsilon};
use crate::metriplectic::{Metriplectic, Point, SecondLaw};
use crate::model_error::ModelError;

/// A Poisson tensor at one point, and the largest violations of its laws relative to the terms that should
/// cancel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BracketDefects<M: Space> {
    pub(crate) tensor: Matrix<M>,
    pub(crate) skewness: Violation,
    pub(crate) jacobi: Violation,
    /// Whether the derivatives of the tensor are finite.
    pub(crate) is_finite: bool,
}

/// Evaluates skewness and the Jacobi identity `Π^{il}∂_lΠ^{jk} + cyclic` at `x`, in chart coordinates of the
/// sizes `units`. The terms may all be round-off. So their sizes include the `rounding` of the largest terms
/// elsewhere, and of a generic product `Π^{il} Π^{jk} / ℓ_l`.
pub(crate) fn bracket_defects<Y: Metriplectic + ?Sized>(
    system: &Y,
    x: &Point<Y>,
    units: &Vector<Y::Manifold>,
    rounding: f64,
) -> Result<BracketDefects<Y::Manifold>, MetricError> {
    let n = <Y::Manifold as Space>::Dim::LEN;
    let tensor = tensor(system, &ChartPoint::<Y::Manifold>::centre(x))?;
    let mut slopes = Vec::with_capacity(n);
    for l in 0..n {
        let moved = ChartPoint { base: x.clone(), q: epsilon::<Y::Manifold>(l) };
        let dual = self::tensor(system, &moved)?;
        slopes.push(Matrix::<Y::Manifold>::from_entries(|i, j| dual[(i, j)].eps));
    }
    let steepest = (0..n).map(|l| largest::<Y::Manifold>(&slopes[l], units) * units[l]);
    let top = largest::<Y::Manifold>(&tensor, units);
    let top = top * steepest.fold(top, worse);
    let term = |a: usize, b: usize, c: usize| {
        let slopes = &slopes;
        (0..n).map(move |l| tensor[(a, l)] * slopes[l][(b, c)])
    };
    // The cyclic sum of a skew tensor is totally skew, and that of a constant one is zero.
    let mut jacobi = Violation::default();
    let constant = slopes.iter().all(|slope| slope.max_abs() == 0.0);
    for k in 0..if constant { 0 } else { n } {
        for j in 0..k {
            for i in 0..j {
                let terms = term(i, j, k).chain(term(j, k, i)).chain(term(k, i, j));
                let size = rounding * top * units[i] * units[j] * units[k];
                jacobi = jacobi.or_worse(terms.collect::<Balance>().beside(size));
            }
        }
    }
    let skewness = asymmetry::<Y::Manifold>(&tensor, -1.0, units, rounding);
    let is_finite = slopes.iter().all(|slope| slope.max_abs().is_finite());
    Ok(BracketDefects { tensor, skewness, jacobi, is_finite })
}

/// The Poisson tensor of a system at any scalar.
fn tensor<Y: Metriplectic + ?Sized, D: Scalar>(
    system: &Y,
    x: &ChartPoint<Y::Manifold, D>,
) -> Result<Matrix<Y::Manifold, D>, MetricError> {
    let (g, ds) = (system.metric_at(x), differential(system.entropy(), x));
    system.bracket().tensor(&system.bracket_args(&g, &ds))
}

/// Checks that `Π` is skew, satisfies the Jacobi identity, and has `S` as a Casimir.
pub(super) fn examine<Y: Metriplectic + ?Sized>(
    place: &Place<'_, Y>,
    findings: &mut Findings<'_>,
) -> Result<(), ModelError> {
    let &Place { system, x, units, ref entropy, .. } = place;
    let defects = bracket_defects(system, x, units, ROUNDING);
    let defects = defects.map_err(unusable::<Y::Manifold>(x))?;
    if !defects.is_finite {
        let point = findings.point.clone();
        return Err(ModelError::DerivativeNotFinite { field: "bracket", point });
    }
    let size = defects.skewness.relative();
    findings.note("Πᵀ = −Π", size, |point| ModelError::BracketNotSkew { point, size });
    let size = defects.jacobi.relative();
    if system.bracket().is_poisson() {
        findings
            .note("Jacobi identity", size, |point| ModelError::NoJacobiIdentity { point, size });
    } else {
        findings.record("Jacobi identity", size, f64::INFINITY);
    }
    if system.second_law() == SecondLaw::Exact {
        let size = balance::product::<Y::Manifold>(&defects.tensor, &entropy.df, units);
        findings.note("Π dS = 0", size, |point| ModelError::EntropyNotCasimir { point, size });
    }
    Ok(())
}
