//! The examination of a model: every law, at the start and at samples around it.

use metriplectic_fields::{ChartPoint, Column, Dimension, Jet2, Vector, differential_at};
use metriplectic_manifolds::{InnerProduct, Manifold, Riemannian};
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;

use super::balance::Balance;
use super::domain::value_not_finite;
use super::findings::Findings;
use super::place::{Place, jet};
use super::sampling::CoordinateScales;
use super::{bracket, dissipation, fields, force, invariants, metric};
use crate::metriplectic::{Dim, Metriplectic, Point};
use crate::model_error::ModelError;
use crate::report::Report;

/// A seed, so that a model fails in the same way each time.
const SEED: u64 = 0x4745_4e45_5249_4321;

/// An examination of a model around a start.
pub(super) struct Examination<'a, Y: Metriplectic + ?Sized> {
    system: &'a Y,
    /// The sizes of the coordinates at the start.
    sizes: CoordinateScales<Y::Manifold>,
    /// The distance within which points are drawn, relative to these sizes.
    radius: f64,
    rng: ChaCha8Rng,
}

impl<'a, Y: Metriplectic + ?Sized> Examination<'a, Y> {
    pub(super) fn around(system: &'a Y, x0: &Point<Y>, radius: f64) -> Self {
        let rng = ChaCha8Rng::seed_from_u64(SEED);
        Self { system, sizes: CoordinateScales::at(system, x0), radius, rng }
    }

    /// Draws a point around the start at which the model has values.
    pub(super) fn sample(&mut self, x0: &Point<Y>, report: &mut Report) -> Option<Point<Y>> {
        let Self { system, sizes, radius, rng } = self;
        // Outside the domain of an open chart, where the defect is infinite, or of a field, there is no model.
        let inside = |x: &Point<Y>| {
            system.manifold().defect(x).is_finite() && value_not_finite(*system, x).is_none()
        };
        let (x, _) = sizes.draw(x0, *radius, rng, &mut report.passed_over, inside)?;
        Some(x)
    }

    /// Judges the model at a point: its derivatives along the `axes`, and every law.
    pub(super) fn at(
        &mut self,
        x: &Point<Y>,
        axes: &[usize],
        report: &mut Report,
    ) -> Result<(), ModelError> {
        report.judged += 1;
        let system = self.system;
        let energy = jet(system.energy(), "energy", x)?;
        let entropy = jet(system.entropy(), "entropy", x)?;
        metric::examine(system, x)?;
        let w = self.discrete_gradient(x, &energy);
        let place = Place { system, x, units: &self.sizes.units, energy, entropy };
        // A wrong derivative breaks other laws too, and is reported as their cause.
        let compared = fields::TensorSlopes::at(&place).and_then(|slopes| {
            axes.iter().try_for_each(|&axis| fields::compare(&place, &slopes, axis))
        });
        let mut findings =
            Findings { point: Y::Manifold::entries(x), laws: &mut report.laws, first: None };
        bracket::examine(&place, &mut findings)?;
        force::examine(&place, w.as_ref(), &mut findings)?;
        dissipation::examine(&place, w.as_ref(), &mut findings)?;
        invariants::examine(&place, &mut findings)?;
        compared?;
        findings.first.map_or(Ok(()), Err)?;
        fields::compare_dissipation(&place, axes)
    }

    /// Computes a discrete gradient of the energy between `x` and a point near it, in the chart at `x`: the
    /// mean of the two differentials with Gonzalez' correction,
    ///
    /// ```math
    /// w = \bar w + \frac{H(y) - H(x) - \langle \bar w, d \rangle}{G(d, d)}\, ♭d, \qquad
    /// \bar w = \tfrac12 (dH(x) + dH(y)), \qquad y = \varphi_x(d) .
    /// ```
    ///
    /// It differs from `dH(x)` unless `H` is linear. `None` if the energy has no value nearby.
    fn discrete_gradient(
        &mut self,
        x: &Point<Y>,
        energy: &Jet2<Y::Manifold>,
    ) -> Option<Vector<Y::Manifold>> {
        let Self { system, sizes, radius, rng } = self;
        let inside = |y: &Point<Y>| {
            system.manifold().defect(y).is_finite() && system.energy_at(y).is_finite()
        };
        let (y, d) = sizes.draw(x, *radius, rng, &mut 0, inside)?;
        let mean = (energy.df + differential_at(system.energy(), x, &d)) * 0.5;
        let end = system.energy_at(&y);
        let along: Balance = (0..Dim::<Y>::LEN).map(|i| -mean[i] * d[i]).collect();
        let defect = end - energy.value + along.sum();
        // For a linear energy, the correction is the rounding of its values.
        let rounding = 64.0 * f64::EPSILON * (end.abs() + energy.value.abs() + along.terms());
        if defect.abs() <= rounding {
            return Some(mean);
        }
        let flat = system.metric().at(&ChartPoint::centre(x)).ok()?.flat(&d);
        let w = mean + flat * (defect / flat.dot(&d));
        Some(if w.is_finite() { w } else { mean })
    }
}
