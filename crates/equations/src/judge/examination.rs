//! The examination of a model: every law, at the start and at samples around it.

use super::table::{Row, zeros};
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;

use super::at::{At, Jet2, Place, all_finite, dot};
use super::balance::Balance;
use super::domain::value_not_finite;
use super::findings::Findings;
use super::sampling::CoordinateScales;
use super::{bracket, dissipation, fields, force, invariants, metric};
use crate::{ENERGY, ENTROPY, ModelError, Report};

/// A seed, so that a model fails in the same way each time.
const SEED: u64 = 0x4745_4e45_5249_4321;

/// An examination of a model around a start.
pub(super) struct Examination<'a> {
    start: At<'a>,
    /// The sizes of the coordinates at the start.
    sizes: CoordinateScales,
    /// The distance within which states are drawn, relative to these sizes.
    radius: f64,
    rng: ChaCha8Rng,
}

impl<'a> Examination<'a> {
    pub(super) fn around(start: At<'a>, radius: f64) -> Self {
        let rng = ChaCha8Rng::seed_from_u64(SEED);
        Self { start, sizes: CoordinateScales::at(start), radius, rng }
    }

    /// Draws a state around the start at which the model has values.
    pub(super) fn sample(&mut self, report: &mut Report) -> Option<Row> {
        let Self { start, sizes, radius, rng } = self;
        // Outside the domain of an open chart, where the defect is infinite, or of a field, there is no model.
        let inside =
            |at: At<'_>| at.model.defect(at.x).is_finite() && value_not_finite(at).is_none();
        let (x, _) = sizes.draw(*start, *radius, rng, &mut report.passed_over, inside)?;
        Some(x)
    }

    /// Judges the model at a state: its derivatives along the `axes`, and every law.
    pub(super) fn at(
        &mut self,
        x: &[f64],
        axes: &[usize],
        report: &mut Report,
    ) -> Result<(), ModelError> {
        report.judged += 1;
        let at = self.start.moved_to(x);
        let (energy, entropy) = (at.finite_jet2(ENERGY)?, at.finite_jet2(ENTROPY)?);
        metric::examine(at)?;
        let w = self.discrete_gradient(at, &energy);
        let place = Place { at, units: &self.sizes.units, energy, entropy };
        // A wrong derivative breaks other laws too, and is reported as their cause.
        let compared = fields::TensorSlopes::at(&place).and_then(|slopes| {
            axes.iter().try_for_each(|&axis| fields::compare(&place, &slopes, axis))
        });
        let mut findings = Findings { point: at.point(), laws: &mut report.laws, first: None };
        bracket::examine(&place, &mut findings)?;
        force::examine(&place, w.as_deref(), &mut findings)?;
        dissipation::examine(&place, w.as_deref(), &mut findings)?;
        invariants::examine(&place, &mut findings)?;
        compared?;
        findings.first.map_or(Ok(()), Err)?;
        fields::compare_dissipation(&place, axes)
    }

    /// Computes a discrete gradient of the energy between `x` and a state near it, in the chart at `x`: the
    /// mean of the two differentials with Gonzalez' correction,
    ///
    /// ```math
    /// w = \bar w + \frac{H(y) - H(x) - \langle \bar w, d \rangle}{G(d, d)}\, ♭d, \qquad
    /// \bar w = \tfrac12 (dH(x) + dH(y)), \qquad y = \varphi_x(d) .
    /// ```
    ///
    /// It differs from `dH(x)` unless `H` is linear. `None` if the energy has no value nearby.
    fn discrete_gradient(&mut self, at: At<'_>, energy: &Jet2) -> Option<Row> {
        let Self { sizes, radius, rng, .. } = self;
        let n = at.n();
        let inside = |at: At<'_>| at.model.defect(at.x).is_finite() && at.value(ENERGY).is_finite();
        let (y, d) = sizes.draw(at, *radius, rng, &mut 0, inside)?;
        let mut there = zeros(n);
        at.model.differential_at(ENERGY, at.t, at.x, &d, &mut there);
        let mean: Row = (0..n).map(|i| (energy.df[i] + there[i]) * 0.5).collect();
        let end = at.moved_to(&y).value(ENERGY);
        let along: Balance = (0..n).map(|i| -mean[i] * d[i]).collect();
        let defect = end - energy.value + along.sum();
        // For a linear energy, the correction is the rounding of its values.
        let rounding = 64.0 * f64::EPSILON * (end.abs() + energy.value.abs() + along.terms());
        if defect.abs() <= rounding {
            return Some(mean);
        }
        let mut flat = zeros(n);
        at.model.flat(at.x, &d, &mut flat).ok()?;
        let factor = defect / dot(&flat, &d);
        let w: Row = (0..n).map(|i| mean[i] + flat[i] * factor).collect();
        Some(if all_finite(&w) { w } else { mean })
    }
}
