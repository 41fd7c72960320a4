//! The points at which a model is judged: the start, and points around it at which it has values.

use metriplectic_fields::{Column, Dimension, Jet2, ScalarField, Space, Vector};
use metriplectic_manifolds::Manifold;
use rand::RngExt;
use rand::rngs::ChaCha8Rng;

use crate::metriplectic::{Metriplectic, Point};

/// How often a sample is drawn again, at a quarter of the distance, until the model has values there.
const DRAWS: i32 = 12;

/// An entry below this fraction of the distance over which the energy changes counts as zero.
const NEGLIGIBLE: f64 = 1e-6;

/// The sizes of a state: one number for each direction of the chart, in the unit of its entry.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CoordinateScales<M: Space> {
    /// The sizes that round-off and difference quotients are relative to. They are positive.
    pub(crate) units: Vector<M>,
    /// The sizes of the entries themselves wherever they are not zero, however small.
    own: Vector<M>,
}

impl<M: Manifold> CoordinateScales<M> {
    /// The sizes at `x`.
    ///
    /// An entry has a [size](Manifold::scales). If this is zero or negligible, the size is the distance `ℓ_i`
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
    pub(crate) fn at<Y: Metriplectic<Manifold = M> + ?Sized>(system: &Y, x: &Point<Y>) -> Self {
        let own = M::scales(x);
        let largest = (0..M::Dim::LEN).map(|i| own[i]).fold(0.0, f64::max);
        let others = if largest > 0.0 { largest } else { 1.0 };
        let fields = [distances(system.energy(), x, &own), distances(system.entropy(), x, &own)];
        let units = Vector::<M>::from_index(|i| {
            let known = fields.iter().map(|field| field[i]).find(|&d| d > 0.0 && d.is_finite());
            let distance = known.unwrap_or(others);
            if own[i] <= NEGLIGIBLE * distance { distance } else { own[i] }
        });
        let own = Vector::<M>::from_index(|i| if own[i] > 0.0 { own[i] } else { units[i] });
        Self { units, own }
    }

    /// Draws a random point around `x` that is `accepted`, within `radius` of these sizes or nearer. It counts
    /// each point that is not accepted in `passed_over`.
    pub(crate) fn draw(
        &self,
        x: &M::Point<f64>,
        radius: f64,
        rng: &mut ChaCha8Rng,
        passed_over: &mut usize,
        accepted: impl Fn(&M::Point<f64>) -> bool,
    ) -> Option<(M::Point<f64>, Vector<M>)> {
        (0..=DRAWS).find_map(|draw| {
            let sizes = if draw == 0 { &self.units } else { &self.own };
            let reach = radius * 0.25_f64.powi(draw);
            let q = Vector::<M>::from_index(|i| reach * sizes[i] * rng.random_range(-1.0..1.0));
            let y = M::chart(x, &q);
            let found = accepted(&y);
            *passed_over += usize::from(!found);
            found.then_some((y, q))
        })
    }
}

/// The size of the terms of a field, `Σ_i |f_i| ℓ_i + ½|f_ii| ℓ_i²`: what it changes by over the distances
/// `ℓ_i`.
pub(crate) fn terms<M: Space>(jet: &Jet2<M>, sizes: &Vector<M>) -> f64 {
    let term = |i| jet.df[i].abs() * sizes[i] + 0.5 * jet.hf[(i, i)].abs() * sizes[i] * sizes[i];
    (0..M::Dim::LEN).map(term).sum()
}

/// The distance along each direction over which a field changes by the size of its terms; at a state of zeros by the
/// least change over a distance of 1.
fn distances<M: Space>(f: &impl ScalarField<M>, x: &M::Point<f64>, sizes: &Vector<M>) -> Vector<M> {
    let jet = f.jet2(x);
    let is_zero = (0..M::Dim::LEN).all(|i| sizes[i] == 0.0);
    let over_one = |i| jet.df[i].abs() + 0.5 * jet.hf[(i, i)].abs();
    let least = || {
        (0..M::Dim::LEN).map(over_one).filter(|&change| change > 0.0).fold(f64::INFINITY, f64::min)
    };
    let change = if is_zero { least() } else { terms(&jet, sizes) };
    Vector::<M>::from_index(|i| {
        let (slope, bend) = (jet.df[i].abs(), jet.hf[(i, i)].abs());
        2.0 * change / (slope + slope.hypot((2.0 * change * bend).sqrt()))
    })
}
