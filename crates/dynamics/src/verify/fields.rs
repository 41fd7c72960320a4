//! The derivatives of every part of a model, compared with its values.

use metriplectic_fields::{
    ChartPoint, Column, Dimension, Matrix, ScalarField, Space, Square, Vector,
};
use metriplectic_manifolds::{Manifold, Riemannian, Slopes};

use super::derivatives::{Derivatives, Mismatch, OF_CLOSURES, OF_SOLUTIONS, Values};
use super::dissipation::is_round_off;
use super::place::{Place, unusable};
use super::table::{Table, append, components};
use crate::bracket::Bracket;
use crate::dissipation::{Dissipation, DissipationJet};
use crate::invariants::{Invariants, Kind, Visitor};
use crate::metriplectic::{Dim, Metriplectic};
use crate::model_error::ModelError;

/// The derivatives of the tensors of a model at a point, evaluated once for all axes.
pub(super) struct TensorSlopes<M: Manifold> {
    metric: Slopes<M>,
    /// `∂(Πα)/∂z` for a generic covector.
    bracket: Option<Matrix<M>>,
}

impl<M: Manifold> TensorSlopes<M> {
    pub(super) fn at<Y: Metriplectic<Manifold = M> + ?Sized>(
        &Place { system, x, units, ref entropy, .. }: &Place<'_, Y>,
    ) -> Result<Self, ModelError> {
        let (metric, bracket) = (system.metric().slopes(x), system.bracket());
        if bracket.is_zero() {
            return Ok(Self { metric, bracket: None });
        }
        let (alpha, centre) = (generic::<M>(units), ChartPoint::centre(x));
        let g = system.metric_at(&centre);
        let jet = bracket.linearise(&system.bracket_args(&g, &entropy.df), &alpha);
        Ok(Self { metric, bracket: Some(jet.map_err(unusable::<M>(x))?.along_z) })
    }
}

/// Compares the derivatives of the fields, of the metric, and of the bracket along one axis of the chart.
///
/// Second derivatives are not compared. They enter only the Jacobian of Newton's method. If they are wrong, it
/// solves the same equation in more iterations, or fails.
pub(super) fn compare<Y: Metriplectic + ?Sized>(
    place: &Place<'_, Y>,
    slopes: &TensorSlopes<Y::Manifold>,
    axis: usize,
) -> Result<(), ModelError> {
    compare_scalars(place, axis)?;
    let along = Along { place, axis };
    along.metric(slopes)?;
    along.bracket(slopes)
}

/// Compares the derivatives of energy, entropy and further invariants along one axis of the chart.
pub(super) fn compare_scalars<Y: Metriplectic + ?Sized>(
    place: &Place<'_, Y>,
    axis: usize,
) -> Result<(), ModelError> {
    let along = Along { place, axis };
    along.scalar("energy", place.system.energy(), &place.energy.df)?;
    along.scalar("entropy", place.system.entropy(), &place.entropy.df)?;
    along.invariants()
}

/// Compares the derivatives of the dissipation along the `axes`, also along the covector that it annihilates. No
/// law uses them, so a law that its values violate is named first.
pub(super) fn compare_dissipation<Y: Metriplectic + ?Sized>(
    place: &Place<'_, Y>,
    axes: &[usize],
) -> Result<(), ModelError> {
    let &Place { system, x, units, ref energy, .. } = place;
    if system.dissipation().is_none() || axes.is_empty() {
        return Ok(());
    }
    let (alpha, centre) = (generic::<Y::Manifold>(units), ChartPoint::centre(x));
    let g = system.metric_at(&centre);
    let jet = system.dissipation().linearise(&g, &energy.df, &alpha);
    let jet = jet.map_err(unusable::<Y::Manifold>(x))?;
    let compared =
        axes.iter().try_for_each(|&axis| Along { place, axis }.dissipation(&jet, &alpha));
    compared.or_else(|error| if is_round_off(place) { Ok(()) } else { Err(error) })
}

/// One axis of the chart at a point.
struct Along<'a, 'b, Y: Metriplectic + ?Sized> {
    place: &'a Place<'b, Y>,
    axis: usize,
}

impl<Y: Metriplectic + ?Sized> Along<'_, '_, Y> {
    /// The point at the distance `t`.
    fn at(&self, t: f64) -> ChartPoint<Y::Manifold> {
        let q = Vector::<Y::Manifold>::basis(self.axis) * t;
        ChartPoint { base: self.place.x.clone(), q }
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
        let (axis, point) = (self.axis, Y::Manifold::entries(self.place.x));
        Err(ModelError::WrongDerivative { field, axis, point, derivative, quotient })
    }

    fn scalar(
        &self,
        field: &'static str,
        f: &impl ScalarField<Y::Manifold>,
        df: &Vector<Y::Manifold>,
    ) -> Result<(), ModelError> {
        let (scale, df) = (self.place.units[self.axis], vec![df[self.axis]]);
        let derivatives = Derivatives { scale, df, units: vec![1.0], rounding: OF_CLOSURES };
        self.compare(field, &derivatives, &|t, values| {
            values.push(f.at::<f64>(&self.at(t).point()));
            Some(())
        })
    }

    fn invariants(&self) -> Result<(), ModelError> {
        let mut compared = Compared { along: self, outcome: Ok(()) };
        self.place.system.invariants().each(&mut compared);
        compared.outcome
    }

    fn metric(&self, slopes: &TensorSlopes<Y::Manifold>) -> Result<(), ModelError> {
        let Some(slopes) = &slopes.metric else { return Ok(()) };
        let sizes = self.place.units;
        let (scale, df) = (sizes[self.axis], Table::of(&slopes[self.axis]).entries().to_vec());
        let units = Table::from_entries(Dim::<Y>::LEN, |i, j| (sizes[i] * sizes[j]).recip());
        let units = units.entries().to_vec();
        let derivatives = Derivatives { scale, df, units, rounding: OF_CLOSURES };
        self.compare("metric", &derivatives, &|t, values| {
            let g: Matrix<Y::Manifold> = self.place.system.metric().matrix(&self.at(t));
            values.extend_from_slice(Table::of(&g).entries());
            Some(())
        })
    }

    fn bracket(&self, slopes: &TensorSlopes<Y::Manifold>) -> Result<(), ModelError> {
        let &Place { system, units, ref entropy, .. } = self.place;
        let (bracket, alpha) = (system.bracket(), generic::<Y::Manifold>(units));
        let Some(slopes) = &slopes.bracket else { return Ok(()) };
        let slopes = slopes.column_at(self.axis);
        let (scale, df, units) = (units[self.axis], components(&slopes), components(units));
        let derivatives = Derivatives { scale, df, units, rounding: OF_CLOSURES };
        self.compare("bracket", &derivatives, &|t, values| {
            let at = self.at(t);
            let g = system.metric_at(&at);
            let column = bracket.apply(&system.bracket_args(&g, &entropy.df), &alpha).ok()?;
            append(values, &column);
            Some(())
        })
    }

    fn dissipation(
        &self,
        jet: &DissipationJet<Y::Manifold>,
        alpha: &Vector<Y::Manifold>,
    ) -> Result<(), ModelError> {
        let &Place { system, units, ref energy, .. } = self.place;
        let (k, w, axis) = (system.dissipation(), energy.df, self.axis);
        let (scale, df) = (units[axis], components(&jet.along_z.column_at(axis)));
        let along_z = Derivatives { scale, df, units: components(units), rounding: OF_SOLUTIONS };
        self.compare("dissipation", &along_z, &|t, values| {
            append(values, &k.apply(&system.metric_at(&self.at(t)), &w, alpha).ok()?);
            Some(())
        })?;

        // If a component of dH is negligible, its size is that of the largest energy of all components.
        let largest = (0..Dim::<Y>::LEN).map(|i| (w[i] * units[i]).abs()).fold(0.0, f64::max);
        let (own, borrowed) = (w[axis].abs(), largest / units[axis]);
        let scale = if own > 1e-6 * borrowed { own } else { borrowed };
        if scale == 0.0 {
            return Ok(());
        }
        let (df, centre) = (components(&jet.along_w.column_at(axis)), self.at(0.0));
        let g = system.metric_at(&centre);
        let along_w = Derivatives { df, scale, ..along_z };
        self.compare("dissipation, as a function of w,", &along_w, &|t, values| {
            let w = w + Vector::<Y::Manifold>::basis(axis) * t;
            append(values, &k.apply(&g, &w, alpha).ok()?);
            Some(())
        })
    }
}

/// Compares the invariants, one after the other.
struct Compared<'a, 'b, 'c, Y: Metriplectic + ?Sized> {
    along: &'a Along<'b, 'c, Y>,
    outcome: Result<(), ModelError>,
}

impl<Y: Metriplectic + ?Sized> Visitor<Y::Manifold> for Compared<'_, '_, '_, Y> {
    fn visit(&mut self, _: Kind, f: &impl ScalarField<Y::Manifold>) {
        if self.outcome.is_ok() {
            self.outcome = self.along.scalar("invariant", f, &f.jet1(self.along.place.x).df);
        }
    }
}

/// A covector that involves every column of a tensor.
fn generic<M: Space>(units: &Vector<M>) -> Vector<M> {
    Vector::<M>::from_index(|i| (1.0 + i as f64).sin() / units[i])
}
