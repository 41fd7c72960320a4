//! Derivatives that are as exact as asked for.

use nalgebra::DVector;

use super::certificate::worse;
use super::differentiated::Differentiated;
use super::smooth::{FlowOf, SmoothFlow as _};
use super::state::TangentState;
use crate::round_off::bound::SUMMED;
use crate::run::schedule::{Schedule, Size};
use crate::step::Stepper;

/// How often a run is refined at most.
/// A factor of four fails `tests/tangent/refined.rs::an_accuracy_that_is_not_reached_is_an_error`.
pub(super) const REFINEMENTS: usize = 12;
/// The factor of a tolerance between two runs.
/// A factor of four fails `tests/tangent/refined.rs::derivatives_of_a_state_at_rest_reach_the_accuracy`.
const TENTH: f64 = 0.1;

/// The schedule with a tenth of its tolerance, or with halves of its steps, after a run with a method of an order and with steps up to
/// the largest one.
///
/// A state at rest follows any tolerance with any steps, and its derivatives do not: so the steps of a finer run are no longer than
/// those with which an error of this order is a tenth.
pub(super) fn refined(schedule: &Schedule, order: u32, largest: f64) -> Schedule {
    let mut finer = schedule.clone();
    match &mut finer.size {
        Size::Tolerance(adaptive) => {
            let shorter = TENTH.powf(f64::from(order).recip()) * largest;
            adaptive.tighten(TENTH, if largest > 0.0 { shorter } else { f64::MAX });
        }
        Size::Fixed(h) => {
            *h *= 0.5;
            finer.count = finer.count.map(|count| count.saturating_mul(2));
            finer.every = finer.every.saturating_mul(2);
        }
    }
    finer
}

/// How far the derivatives at two ends differ: the largest of `|T_j − T'_j|/|T'_j|` over the columns, with entries in units of the
/// [sizes](metriplectic_manifolds::Manifold::scales) of the state.
///
/// An entry of the state that is zero has no size: its row is compared with its own largest derivative, along the entries
/// of the start that have none either, or along the others in their units.
pub(super) fn difference<D: Differentiated<M>, M: Stepper<FlowOf<D>>>(
    system: &D,
    start: &TangentState<FlowOf<D>>,
    [coarse, fine]: [&TangentState<FlowOf<D>>; 2],
) -> f64 {
    let (n, all) = (system.as_flow().directions(), fine.carried.t.ncols());
    let turn = system.as_flow().turn(&coarse.point, &fine.point);
    let (rows, units) = (system.units(&fine.point), system.units(&start.point));
    let size = |column: &DVector<f64>| {
        (0..n).filter(|i| rows[*i] > 0.0).map(|i| column[i].abs() / rows[i]).fold(0.0, worse)
    };
    let row = |i: usize, j: usize| {
        let alike = (0..all).filter(|k| (units[*k] > 0.0) == (units[j] > 0.0));
        let unit = |k: usize| if units[k] > 0.0 { units[k] / units[j] } else { 1.0 };
        alike.map(|k| fine.carried.t[(i, k)].abs() * unit(k)).fold(0.0, worse)
    };
    let columns = (0..all).map(|j| {
        let [before, after] =
            [coarse, fine].map(|state| state.carried.t.view((0, j), (n, 1)).column(0).into_owned());
        let before = turn.as_ref().map_or_else(|| before.clone(), |turn| turn * &before);
        let apart = &after - before;
        let unsized_rows = (0..n).filter(|i| rows[*i] == 0.0 && apart[*i] != 0.0);
        let unsized_rows = unsized_rows.map(|i| apart[i].abs() / row(i, j)).fold(0.0, worse);
        (j, size(&apart), size(&after), unsized_rows)
    });
    columns.fold(0.0, |worst, (j, off, size, unsized_rows)| {
        // A direction on which nothing depends, or whose deviation has decayed, has a column of rounding.
        let is_rounding = units[j] > 0.0 && off * units[j] <= SUMMED;
        let sized = if off == 0.0 || is_rounding { 0.0 } else { off / size };
        worse(worse(worst, sized), unsized_rows)
    })
}
