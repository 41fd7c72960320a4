//! The velocity by its definition, at every scalar.

use metriplectic_fields::{ChartPoint, Column, Scalar, ScalarField, Vector};
use metriplectic_manifolds::{InnerProduct, MetricAt, MetricError, Riemannian};

use super::covectors::{Components, Covectors, differentials};
use super::plan::{CASIMIR, MOMENTUM, ProjectionPlan};
use crate::bracket::Bracket;
use crate::dissipation::Dissipation;
use crate::invariants::{Invariants, Kind};
use crate::metriplectic::{CountOf, Dim, Metriplectic, SecondLaw};
use crate::orthogonal::Orthogonal;
use crate::vector_field::VectorField;

/// The metric of a system at a point, at a scalar.
type At<'a, Y, D> = MetricAt<'a, <Y as Metriplectic>::Manifold, <Y as Metriplectic>::Metric, D>;

impl<Y: Metriplectic + ?Sized> VectorField<Y::Manifold> for Y {
    fn velocity<D: Scalar>(
        &self,
        x: &ChartPoint<Y::Manifold, D>,
    ) -> Result<Vector<Y::Manifold, D>, MetricError> {
        let (g, w) = (self.metric_at(x), differentials(self, x));
        let reversible = self.bracket().apply(&self.bracket_args(&g, &w.entropy), &w.energy)?;
        Ok(reversible + irreversible(self, &g, &w)?)
    }
}

/// Computes the vector `Π̃ w_H`.
///
/// # Errors
///
/// [`MetricError`] if the metric cannot be used at the point.
#[inline]
pub fn reversible<Y: Metriplectic + ?Sized, D: Scalar>(
    system: &Y,
    g: &At<'_, Y, D>,
    w: &Covectors<CountOf<Y>, Components<Y, D>>,
) -> Result<Components<Y, D>, MetricError> {
    let annihilated = ProjectionPlan::of(system, w);
    let bracket = |alpha: &_| system.bracket().apply(&system.bracket_args(g, &w.entropy), alpha);
    if !annihilated.projected && !annihilated.momenta {
        return bracket(&w.energy);
    }
    let g = g.inner()?;
    if const { Y::Invariants::COUNT == 0 } {
        // With the entropy alone, the same projections need no list.
        let w_hat = g.orthonormal(&w.entropy);
        let square = w_hat.dot(&w_hat);
        if square.re() > 0.0 {
            let (sharp, fraction) = (g.from_orthonormal(&w_hat), square.recip());
            let alpha = w.energy - w.entropy * (sharp.dot(&w.energy) * fraction);
            let v = bracket(&alpha)?;
            return Ok(v - sharp * (w.entropy.dot(&v) * fraction));
        }
        return bracket(&w.energy);
    }
    let mut normals = Orthogonal::<Dim<Y>, D>::default();
    if annihilated.entropy {
        normals.push(g, &w.entropy);
    }
    for c in w.of_kind(Kind::Casimir) {
        normals.push(g, c);
    }
    let mut a = if annihilated.projected {
        let alpha = normals.faded_covector(0, &w.energy, CASIMIR);
        normals.faded_vector(0, &bracket(&alpha)?, CASIMIR)
    } else {
        bracket(&w.energy)?
    };
    if annihilated.momenta {
        normals.push(g, &w.energy);
        let first = normals.len();
        for j in w.of_kind(Kind::Momentum) {
            normals.push(g, j);
        }
        a = normals.faded_vector(first, &a, MOMENTUM);
    }
    Ok(a)
}

/// Computes the vector `K̃ w_S`, and adds the vector of a force.
///
/// # Errors
///
/// [`MetricError`] if the metric cannot be used at the point.
#[inline]
pub fn irreversible<Y: Metriplectic + ?Sized, D: Scalar>(
    system: &Y,
    g: &At<'_, Y, D>,
    w: &Covectors<CountOf<Y>, Components<Y, D>>,
) -> Result<Components<Y, D>, MetricError> {
    let friction = friction(system, g, w)?;
    if system.bracket().is_forced() { Ok(friction + force(system, g, w)?) } else { Ok(friction) }
}

/// The vector of the force, which conserves the further invariants.
fn force<Y: Metriplectic + ?Sized, D: Scalar>(
    system: &Y,
    g: &At<'_, Y, D>,
    w: &Covectors<CountOf<Y>, Components<Y, D>>,
) -> Result<Components<Y, D>, MetricError> {
    let force = system.bracket().force(&system.bracket_args(g, &w.entropy), &w.energy)?;
    if const { Y::Invariants::COUNT == 0 } {
        return Ok(force);
    }
    let (g, mut normals) = (g.inner()?, Orthogonal::<Dim<Y>, D>::default());
    normals.push(g, &w.energy);
    if system.second_law() == SecondLaw::Exact {
        normals.push(g, &w.entropy);
    }
    let listed = w.invariants.as_ref().iter().flatten();
    Ok(listed.fold(force, |force, (_, l)| normals.without(g, l, &force, MOMENTUM)))
}

/// The vector `K̃ w_S`.
#[inline]
fn friction<Y: Metriplectic + ?Sized, D: Scalar>(
    system: &Y,
    g: &At<'_, Y, D>,
    w: &Covectors<CountOf<Y>, Components<Y, D>>,
) -> Result<Components<Y, D>, MetricError> {
    if const { Y::Entropy::IS_CONSTANT } {
        return Ok(Components::<Y, D>::zero());
    }
    let k = |alpha: &_| system.dissipation().apply(g, &w.energy, alpha);
    if const { Y::Invariants::COUNT == 0 } {
        return k(&w.entropy);
    }
    let (normals, first) = orthogonal_to_energy::<Y, D>(g.inner()?, w);
    Ok(normals.project_vector(first, &k(&normals.project_covector(first, &w.entropy))?))
}

/// The covector of the energy and the parts of the further invariants orthogonal to it, which start
/// at the index.
fn orthogonal_to_energy<Y: Metriplectic + ?Sized, D: Scalar>(
    g: &<Y::Metric as Riemannian<Y::Manifold>>::At<D>,
    w: &Covectors<CountOf<Y>, Components<Y, D>>,
) -> (Orthogonal<Dim<Y>, D>, usize) {
    let mut normals = Orthogonal::default();
    normals.push(g, &w.energy);
    let first = normals.len();
    for (_, l) in w.invariants.as_ref().iter().flatten() {
        normals.push(g, l);
    }
    (normals, first)
}
