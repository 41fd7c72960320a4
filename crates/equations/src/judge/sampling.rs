//! The states at which a model is judged: the start, and states around it at which it has values.

use super::table::Row;
use rand::RngExt;
use rand::rngs::ChaCha8Rng;

use super::at::{At, Jet2};
use crate::{ENERGY, ENTROPY};

/// How often a sample is drawn again, at a quarter of the distance, until the model has values there.
const DRAWS: i32 = 12;

/// An entry below this fraction of the distance over which the energy changes counts as zero.
const NEGLIGIBLE: f64 = 1e-6;

/// The sizes of a state: one number for each direction of the chart, in the unit of its entry.
#[derive(Clone, Debug)]
pub struct CoordinateScales {
    /// The sizes that round-off and difference quotients are relative to. They are positive.
    pub units: Row,
    /// The sizes of the entries themselves wherever they are not zero, however small.
    own: Row,
}

impl CoordinateScales {
    /// The sizes at a state.
    ///
    /// An entry has a [size](crate::Equations::scales). If this is zero or negligible, the size is the distance `ℓ_i`
    /// over which the energy changes by the sum `E` of its terms,
    ///
    /// ```math
    /// |H_i|\, \ell_i + \tfrac12 |H_{ii}|\, \ell_i^2 = E, \qquad
    /// E = \sum_j |H_j x_j| + \tfrac12 |H_{jj}| x_j^2 ,
    /// ```
    ///
    /// The entropy takes the place of an energy that does not depend on the entry. The formula has the unit of
    /// `x_i` in every unit of `H`. If neither field depends on the entry, its size is the largest of the other
    /// sizes. If every entry is zero, no entry tells `E`: it is then the least change over a distance of 1, so that the
    /// largest size is 1 and all of them change the field by the same.
    pub(crate) fn at(at: At<'_>) -> Self {
        let own = at.scales();
        let largest = own.iter().copied().fold(0.0, f64::max);
        let others = if largest > 0.0 { largest } else { 1.0 };
        let fields = [ENERGY, ENTROPY].map(|law| distances(&at.jet2(law), &own));
        let units = own.iter().enumerate().map(|(i, &own)| {
            let known = fields.iter().map(|field| field[i]).find(|&d| d > 0.0 && d.is_finite());
            let distance = known.unwrap_or(others);
            if own <= NEGLIGIBLE * distance { distance } else { own }
        });
        let units: Row = units.collect();
        let own = own.iter().zip(&units).map(|(&own, &unit)| if own > 0.0 { own } else { unit });
        Self { own: own.collect(), units }
    }

    /// Draws a random state around `x` that is `accepted`, within `radius` of these sizes or nearer. It counts
    /// each state that is not accepted in `passed_over`.
    pub(crate) fn draw(
        &self,
        at: At<'_>,
        radius: f64,
        rng: &mut ChaCha8Rng,
        passed_over: &mut usize,
        accepted: impl Fn(At<'_>) -> bool,
    ) -> Option<(Row, Row)> {
        (0..=DRAWS).find_map(|draw| {
            let sizes = if draw == 0 { &self.units } else { &self.own };
            let reach = radius * 0.25_f64.powi(draw);
            let q: Row =
                sizes.iter().map(|size| reach * size * rng.random_range(-1.0..1.0)).collect();
            let y = at.chart(&q);
            let found = accepted(at.moved_to(&y));
            *passed_over += usize::from(!found);
            found.then_some((y, q))
        })
    }
}

/// The size of the terms of a field, `Σ_i |f_i| ℓ_i + ½|f_ii| ℓ_i²`: what it changes by over the distances
/// `ℓ_i`.
pub(super) fn terms(jet: &Jet2, sizes: &[f64]) -> f64 {
    let term = |(i, size): (usize, &f64)| {
        jet.df[i].abs() * size + 0.5 * jet.hf[(i, i)].abs() * size * size
    };
    sizes.iter().enumerate().map(term).sum()
}

/// The distance along each direction over which a field changes by the size of its terms; at a state of zeros by the
/// least change over a distance of 1.
fn distances(jet: &Jet2, sizes: &[f64]) -> Row {
    let over_one = |i: usize| jet.df[i].abs() + 0.5 * jet.hf[(i, i)].abs();
    let least = || {
        let changes = (0..sizes.len()).map(over_one).filter(|&change| change > 0.0);
        changes.fold(f64::INFINITY, f64::min)
    };
    let is_zero = sizes.iter().all(|&size| size == 0.0);
    let change = if is_zero { least() } else { terms(jet, sizes) };
    let distance = |i: usize| {
        let (slope, bend) = (jet.df[i].abs(), jet.hf[(i, i)].abs());
        2.0 * change / (slope + slope.hypot((2.0 * change * bend).sqrt()))
    };
    (0..sizes.len()).map(distance).collect()
}
