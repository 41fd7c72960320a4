//! The derivatives of every part of a model, compared with its values.

use super::at::{PartJet, Place};
use super::derivatives::{Derivatives, Mismatch, OF_CLOSURES, OF_SOLUTIONS, Values};
use super::dissipation::is_round_off;
use super::table::{Row, Table, zeros};
use crate::{Covectors, ENERGY, ENTROPY, ModelError, Part};
use smallvec::smallvec;

/// The derivatives of the tensors of a model at a state, evaluated once for all axes.
pub(super) struct TensorSlopes {
    /// `∂g/∂qᵏ`, if the metric is not constant.
    metric: Option<Vec<f64>>,
    /// `∂(Πα)/∂z` for a generic covector.
    bracket: Option<Table>,
}

impl TensorSlopes {
    pub(super) fn at(place: &Place<'_>) -> Result<Self, ModelError> {
        let &Place { at, units, .. } = place;
        let n = units.len();
        let mut slopes = vec![0.0; n * n * n];
        let metric = at.model.metric_slopes(at.x, &mut slopes).then_some(slopes);
        // A difference quotient beside another one proves nothing.
        if at.model.is_zero(Part::Reversible) || at.model.has_derivatives_by_differences() {
            return Ok(Self { metric, bracket: None });
        }
        let jet = at.linearise(Part::Reversible, place.differentials(), &generic(units));
        let jet = jet.map_err(|source| at.unusable(source))?;
        Ok(Self { metric, bracket: Some(jet.along_x) })
    }
}

/// Compares the derivatives of the fields, of the metric, and of the bracket along one axis of the chart.
///
/// Second derivatives are not compared. They enter only the Jacobian of Newton's method. If they are wrong, it
/// solves the same equation in more iterations, or fails.
pub(super) fn compare(
    place: &Place<'_>,
    slopes: &TensorSlopes,
    axis: usize,
) -> Result<(), ModelError> {
    compare_scalars(place, axis)?;
    let along = Along { place, axis };
    along.metric(slopes)?;
    along.bracket(slopes)
}

/// Compares the derivatives of energy, entropy and further invariants along one axis of the chart.
pub(super) fn compare_scalars(place: &Place<'_>, axis: usize) -> Result<(), ModelError> {
    let along = Along { place, axis };
    along.scalar(ENERGY, &place.energy.df)?;
    along.scalar(ENTROPY, &place.entropy.df)?;
    place.at.invariants().try_for_each(|law| along.scalar(law, &place.at.jet(law).1))
}

/// Compares the derivatives of the dissipation along the `axes`, also along the covector that it annihilates. No
/// law uses them, so a law that its values violate is named first.
pub(super) fn compare_dissipation(place: &Place<'_>, axes: &[usize]) -> Result<(), ModelError> {
    let &Place { at, units, .. } = place;
    let by_differences = at.model.has_derivatives_by_differences();
    if at.model.is_zero(Part::Irreversible) || axes.is_empty() || by_differences {
        return Ok(());
    }
    let alpha = generic(units);
    let jet = at.linearise(Part::Irreversible, place.differentials(), &alpha);
    let jet = jet.map_err(|source| at.unusable(source))?;
    let compared =
        axes.iter().try_for_each(|&axis| Along { place, axis }.dissipation(&jet, &alpha));
    compared.or_else(|error| if is_round_off(place) { Ok(()) } else { Err(error) })
}

/// One axis of the chart at a state.
struct Along<'a, 'b> {
    place: &'a Place<'b>,
    axis: usize,
}

impl Along<'_, '_> {
    /// The displacement by `t`.
    fn displacement(&self, t: f64) -> Row {
        let mut q = zeros(self.place.units.len());
        q[self.axis] = t;
        q
    }

    fn compare(
        &self,
        field: &'static str,
        derivatives: &Derivatives,
        values: Values<'_>,
    ) -> Result<(), ModelError> {
        let Some(Mismatch { derivative, quotient }) = derivatives.compare(values) else {
            return Ok(());
        };
        let (axis, point) = (self.axis, self.place.at.point());
        Err(ModelError::WrongDerivative { field, axis, point, derivative, quotient })
    }

    fn scalar(&self, law: usize, df: &[f64]) -> Result<(), ModelError> {
        let at = self.place.at;
        let (scale, df) = (self.place.units[self.axis], smallvec![df[self.axis]]);
        let derivatives = Derivatives { scale, df, units: smallvec![1.0], rounding: OF_CLOSURES };
        self.compare(super::at::name(law), &derivatives, &|t, values| {
            values.push(at.moved_to(&at.chart(&self.displacement(t))).value(law));
            Some(())
        })
    }

    fn metric(&self, slopes: &TensorSlopes) -> Result<(), ModelError> {
        let Some(slopes) = &slopes.metric else { return Ok(()) };
        let (at, sizes) = (self.place.at, self.place.units);
        let n = sizes.len();
        let df = Row::from_slice(&slopes[self.axis * n * n..][..n * n]);
        let units = Table::from_entries(n, |i, j| (sizes[i] * sizes[j]).recip());
        let units = units.entries().into();
        let derivatives = Derivatives { scale: sizes[self.axis], df, units, rounding: OF_CLOSURES };
        self.compare("metric", &derivatives, &|t, values| {
            let mut g = Table::zeros(n);
            at.model.metric(at.x, &self.displacement(t), g.entries_mut());
            values.extend_from_slice(g.entries());
            Some(())
        })
    }

    fn bracket(&self, slopes: &TensorSlopes) -> Result<(), ModelError> {
        let Some(slopes) = &slopes.bracket else { return Ok(()) };
        let (units, alpha) = (self.place.units, generic(self.place.units));
        let (scale, df) = (units[self.axis], slopes.column(self.axis));
        let derivatives =
            Derivatives { scale, df, units: Row::from_slice(units), rounding: OF_CLOSURES };
        self.compare("bracket", &derivatives, &|t, values| {
            let w = self.place.differentials();
            self.append(Part::Reversible, &self.displacement(t), w, &alpha, values)
        })
    }

    /// Appends the vector of a part at a displacement; `None` where it has none.
    fn append(
        &self,
        part: Part,
        q: &[f64],
        w: Covectors<'_>,
        alpha: &[f64],
        values: &mut Row,
    ) -> Option<()> {
        let (at, mut v) = (self.place.at, zeros(q.len()));
        at.model.apply(part, at.t, (at.x, q), w, alpha, &mut v).ok()?;
        values.append(&mut v);
        Some(())
    }

    fn dissipation(&self, jet: &PartJet, alpha: &[f64]) -> Result<(), ModelError> {
        let &Place { units, ref energy, .. } = self.place;
        let (w, here, axis) = (&energy.df, self.place.differentials(), self.axis);
        let (scale, df) = (units[axis], jet.along_x.column(axis));
        let along_x =
            Derivatives { scale, df, units: Row::from_slice(units), rounding: OF_SOLUTIONS };
        self.compare("dissipation", &along_x, &|t, values| {
            self.append(Part::Irreversible, &self.displacement(t), here, alpha, values)
        })?;

        // If a component of dH is negligible, its size is that of the largest energy of all components.
        let largest = w.iter().zip(units).map(|(w, unit)| (w * unit).abs()).fold(0.0, f64::max);
        let (own, borrowed) = (w[axis].abs(), largest / units[axis]);
        let scale = if own > 1e-6 * borrowed { own } else { borrowed };
        if scale == 0.0 {
            return Ok(());
        }
        let along_w = Derivatives { df: jet.along_w.column(axis), scale, ..along_x };
        let still = self.displacement(0.0);
        self.compare("dissipation, as a function of w,", &along_w, &|t, values| {
            let mut w = w.clone();
            w[axis] += t;
            let w = Covectors { energy: &w, ..here };
            self.append(Part::Irreversible, &still, w, alpha, values)
        })
    }
}

/// A covector that involves every column of a tensor.
pub(super) fn generic(units: &[f64]) -> Row {
    units.iter().enumerate().map(|(i, unit)| (1.0 + i as f64).sin() / unit).collect()
}
