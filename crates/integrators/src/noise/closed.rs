//! The noise of a metriplectic system.

use std::ops::Range;

use metriplectic_dynamics::noise::{
    Around, NoiseTerms, Uniform, divergence, friction_vector, lost_in_dissipation, mismatch,
    noise_drift, noise_vector,
};
use metriplectic_dynamics::{
    Invariants, Metriplectic, ModelError, Report, SecondLaw, system::Point,
};
use metriplectic_equations::judge::RADIUS;
use metriplectic_fields::{Column, ScalarField, Vector};
use metriplectic_manifolds::{Canonical, Riemannian};

use super::error::NoiseError;
use super::fluctuating::{Drawn, Fluctuating, Landing, Noise};
use super::judged::Judged;
use crate::step::{Components, Flow};

/// The round-off of a sum, relative to the sizes of its terms.
/// A factor of four fails `noise/closed.rs::a_bracket_that_changes_the_volume_by_a_billionth_is_not_unimodular`.
pub(crate) const ROUND_OFF: f64 = 1e-9;

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
        !(is_closed(self) && noise.is_uniform)
    }

    fn landed(&self, Landing { to, laws, .. }: Landing<'_, Self>) -> Option<Point<Y>> {
        self.onto(&to, laws, None)
    }

    fn examine_noise(&self, x: &Point<Y>, noise: &Noise<U>) -> Result<(), NoiseError> {
        if self.second_law() != SecondLaw::Exact {
            return Err(NoiseError::NoiseAndPublished);
        }
        examine_model(self, &Around::of(self, x), noise)
    }

    fn check_start_alone(&self, x0: &Point<Y>) -> Result<(), ModelError> {
        self.verified_as_member(x0).map(drop)
    }
}

impl<Y: Metriplectic> Judged for Y {
    type Broken = ModelError;
    type Report = Report;

    fn radius() -> f64 {
        RADIUS
    }

    fn verify_model(&self, x0: &Point<Y>, radius: f64) -> Result<(), ModelError> {
        self.verify(x0, radius)
    }

    fn report_model(&self, x0: &Point<Y>) -> Report {
        self.report(x0)
    }

    fn is_sound(report: &Report) -> bool {
        report.verdict.is_ok()
    }
}

/// Returns whether the terms are said to have no kinetic drift with the measure 1.
fn is_closed<Y>(system: &Y) -> bool
where
    Y: Metriplectic<Dissipation: NoiseTerms<Y::Manifold, Y::Metric>>,
{
    system.dissipation().is_closed() && Y::Invariants::COUNT == 0
}

/// Verifies at a start and around it that the terms are those of the dissipation, that the kinetic drift is that of their
/// values, and that the reversible motion keeps the measure.
///
/// # Errors
///
/// [`NoiseError::TermsDiffer`], [`NoiseError::DriftNotZero`], [`NoiseError::LostDerivative`], [`NoiseError::NotUnimodular`].
pub(crate) fn examine_model<Y, U>(
    system: &Y,
    around: &Around<Y::Manifold>,
    noise: &Noise<U>,
) -> Result<(), NoiseError>
where
    Y: Metriplectic<Dissipation: NoiseTerms<Y::Manifold, Y::Metric>>,
    U: ScalarField<Y::Manifold>,
    Canonical: Riemannian<Y::Manifold>,
{
    let units = &around.units;
    for x in &around.points {
        // Where they have no value, the verification of the model says why.
        if let Ok([off, size]) = mismatch(system, x, units) {
            if off > ROUND_OFF * size {
                return Err(NoiseError::TermsDiffer { off, size });
            }
            if is_closed(system)
                && let Ok(drift) = noise_drift(system, x, &Uniform)
            {
                vanishes::<Y>(&drift, units, size)?;
            }
        }
        if let Ok([divergence, size]) = divergence(system, x, &noise.measure, units)
            && divergence.abs() > ROUND_OFF * size
        {
            return Err(NoiseError::NotUnimodular { divergence, size });
        }
    }
    let lost = |what, found: Option<[f64; 2]>| match found {
        Some([derivative, quotient]) => {
            Err(NoiseError::LostDerivative { what, derivative, quotient })
        }
        None => Ok(()),
    };
    if !noise.is_uniform {
        lost("ln μ", around.lost_in_measure(&noise.measure))?;
    }
    if is_closed(system) {
        return Ok(());
    }
    lost("the terms of the friction", lost_in_dissipation(system, around))
}

/// Refuses a kinetic drift that does not vanish beside a friction of a size, in units of the coordinates.
///
/// # Errors
///
/// [`NoiseError::DriftNotZero`].
pub(crate) fn vanishes<Y: Metriplectic>(
    drift: &Vector<Y::Manifold>,
    units: &Vector<Y::Manifold>,
    size: f64,
) -> Result<(), NoiseError> {
    let entries = 0..<Vector<Y::Manifold> as Column<f64>>::LEN;
    let off = entries.map(|i| (drift[i] / units[i]).abs()).fold(0.0, f64::max);
    if off > ROUND_OFF * size { Err(NoiseError::DriftNotZero { off, size }) } else { Ok(()) }
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
            let around = Around::of(&system, &vector![0.7, 1.2, 0.3]);
            let verdict = examine_model(&system, &around, &noise);
            matches!(verdict, Err(NoiseError::NotUnimodular { .. }))
        };
        // The divergence is 2.2 times this part of terms of the size 2.
        assert!(changes(2e-9) && !changes(5e-10));
    }
}
