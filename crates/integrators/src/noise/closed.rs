//! The noise of a metriplectic system.

use std::ops::Range;

use metriplectic_dynamics::noise::{
    NoiseTerms, divergence, friction_vector, mismatch, noise_drift, noise_vector,
};
use metriplectic_dynamics::{Invariants, Metriplectic, SecondLaw, system::Point};
use metriplectic_fields::{Column as _, ScalarField};
use metriplectic_manifolds::{Canonical, Riemannian};

use super::error::NoiseError;
use super::fluctuating::{Drawn, Fluctuating, Landing, Noise};
use crate::step::{Components, Flow};

/// The round-off of a sum, relative to the sizes of its terms.
const ROUND_OFF: f64 = 1e-9;

impl<Y, U> Fluctuating<U> for Y
where
    Y: Metriplectic<Dissipation: NoiseTerms<Y::Manifold, Y::Metric>>,
    U: ScalarField<Y::Manifold>,
    Canonical: Riemannian<Y::Manifold>,
{
    fn groups(&self) -> Vec<Range<usize>> {
        let all = 0..self.dissipation().count();
        vec![all]
    }

    fn noise(
        &self,
        x: &Point<Y>,
        terms: Range<usize>,
        (strength, numbers): Drawn<'_>,
    ) -> Option<Self::Vector> {
        let v = noise_vector(self, x, terms, (strength, numbers));
        v.ok().filter(|v| v.is_finite()).map(Components)
    }

    fn drift(&self, x: &Point<Y>, _: usize, noise: &Noise<U>) -> Option<Self::Vector> {
        noise_drift(self, x, &noise.measure).ok().filter(|v| v.is_finite()).map(Components)
    }

    fn friction(&self, x: &Point<Y>) -> Option<Self::Vector> {
        friction_vector(self, x).ok().filter(|v| v.is_finite()).map(Components)
    }

    fn has_drift(&self, _: usize, noise: &Noise<U>) -> bool {
        !(self.dissipation().is_closed() && noise.is_uniform && Y::Invariants::COUNT == 0)
    }

    fn landed(&self, Landing { to, laws, .. }: Landing<'_, Self>) -> Option<Point<Y>> {
        self.onto(&to, laws, None)
    }

    fn examine_noise(&self, x: &Point<Y>, noise: &Noise<U>) -> Result<(), NoiseError> {
        if self.second_law() != SecondLaw::Exact {
            return Err(NoiseError::NoiseAndPublished);
        }
        examine_model(self, x, noise)
    }
}

/// Verifies that the terms are those of the dissipation, and that the reversible motion keeps the measure.
///
/// # Errors
///
/// [`NoiseError::TermsDiffer`], [`NoiseError::NotUnimodular`].
pub(crate) fn examine_model<Y, U>(
    system: &Y,
    x: &Point<Y>,
    noise: &Noise<U>,
) -> Result<(), NoiseError>
where
    Y: Metriplectic<Dissipation: NoiseTerms<Y::Manifold, Y::Metric>>,
    U: ScalarField<Y::Manifold>,
    Canonical: Riemannian<Y::Manifold>,
{
    // Where they have no value, the verification of the model says why.
    if let Ok([off, size]) = mismatch(system, x)
        && off > ROUND_OFF * size
    {
        return Err(NoiseError::TermsDiffer { off, size });
    }
    if let Ok([divergence, size]) = divergence(system, x, &noise.measure)
        && divergence.abs() > ROUND_OFF * size
    {
        return Err(NoiseError::NotUnimodular { divergence, size });
    }
    Ok(())
}
