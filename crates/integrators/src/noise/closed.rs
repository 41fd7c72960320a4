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
/// A factor of four fails `noise/closed.rs::a_bracket_that_changes_the_volume_by_a_billionth_is_not_unimodular`.
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

#[cfg(test)]
mod tests {
    use super::*;
    use metriplectic_dynamics::noise::Boltzmann;
    use metriplectic_dynamics::{Poisson, System};
    use metriplectic_fields::Real;
    use metriplectic_manifolds::Euclidean;
    use nalgebra::{Matrix3, Vector3, vector};

    #[test]
    fn a_bracket_that_changes_the_volume_by_a_billionth_is_not_unimodular() {
        let changes = |part: f64| {
            let system = System::on(Euclidean::<3>)
                .bracket(Poisson::field(move |x: &Vector3<Real>| {
                    let (mut pi, b) = (Matrix3::<Real>::zeros(), x.y * part + 1.0);
                    (pi[(0, 1)], pi[(1, 0)]) = (b, -b);
                    pi
                }))
                .energy(|x: &Vector3<Real>| x.x + x.y + x.z + x.x * x.y)
                .entropy(|x: &Vector3<Real>| x.z)
                .build()
                .unwrap();
            let noise = Noise::of(Boltzmann(0.1));
            let verdict = examine_model(&system, &vector![0.7, 1.2, 0.3], &noise);
            matches!(verdict, Err(NoiseError::NotUnimodular { .. }))
        };
        // The divergence is 2.2 times this part of terms of the size 2.
        assert!(changes(2e-9) && !changes(5e-10));
    }
}
