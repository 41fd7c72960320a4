//! The rise of the entropy near an equilibrium, where it is below the round-off of its values.
//!
//! It is the integral of [typed systems](crate::system), in a text that knows no type of a system.

use metriplectic_equations::{ENERGY, ENTROPY, Equations};
use smallvec::SmallVec;

use super::projection::{dot, sum};
use super::rows::NO_CLOCK;
use super::{displacement, scales};
use crate::round_off::bound::INDEPENDENT;
use crate::step::{Directions, Vector as _};
use crate::system::ROUNDING;

/// A law along a line: its differentials at the start, in the middle and at the end, made independent of others.
#[derive(Clone, Debug)]
struct Along {
    w: [Directions; 3],
    /// The absolute terms of the differential in the middle.
    terms: Directions,
    /// The components `s_i ∂_iF` of the differential in the middle, with the sizes `s` of the entries.
    hat: Directions,
    square: f64,
}

impl Along {
    /// Removes the part that depends on another law.
    fn without(self, law: &Self) -> Self {
        let share = dot(&law.hat, &self.hat) / law.square;
        let with = |a: &Directions, b: &Directions, share: f64| {
            Directions::zip([a, b], |[a, b]| a + b * share)
        };
        let w = [0, 1, 2].map(|k| with(&self.w[k], &law.w[k], -share));
        let hat = Directions::zip([&self.hat, &law.hat], |[a, b]| a - b * share);
        let terms = with(&self.terms, &law.terms, share.abs());
        let square = dot(&hat, &hat);
        Self { w, terms, hat, square }
    }
}

/// Returns whether the entropy falls from `x` to the near state `y` by more than the error of the integral. The error
/// is its rounding, and the difference of Simpson's rule and the trapezoidal rule, which agree on a quadratic entropy. A
/// system whose parts are not known apart has no differentials along a chart, and cannot say.
pub(super) fn falls(system: &dyn Equations, x: &[f64], y: &[f64]) -> bool {
    let Some(model) = system.model() else { return false };
    let Some(d) = displacement(system, x, y) else { return false };
    let sizes = scales(system, x);
    let law = |law: usize| {
        let w = [0.0, 0.5, 1.0].map(|t| {
            let mut w = d.zero();
            model.differential_at(law, NO_CLOCK, x, d.map(|d| d * t).numbers(), w.numbers_mut());
            w
        });
        let units = Directions::zip([&sizes, &d], |[size, d]| size.max(d.abs()));
        let hat = Directions::zip([&units, &w[1]], |[unit, w]| unit * w);
        let (terms, square) = (w[1].map(f64::abs), dot(&hat, &hat));
        Along { w, terms, hat, square }
    };
    let mut laws: SmallVec<[Along; 2]> = SmallVec::new();
    laws.push(law(ENERGY));
    let independent = |whole: Along, laws: &[Along]| {
        // The second pass removes the rounding error of the first.
        (0..2).fold(whole, |rest, _| {
            laws.iter().filter(|law| law.square > 0.0).fold(rest, Along::without)
        })
    };
    for invariant in ENTROPY + 1..system.sizes().laws {
        let whole = law(invariant);
        let square = whole.square;
        let rest = independent(whole, &laws);
        if rest.square > INDEPENDENT * INDEPENDENT * square {
            laws.push(rest);
        }
    }
    let entropy = independent(law(ENTROPY), &laws);
    let [before, between, after] = entropy.w.each_ref().map(|w| dot(w, &d));
    let (simpson, trapezoid) = ((before + 4.0 * between + after) / 6.0, 0.5 * (before + after));
    let rounding = sum(&entropy.terms, &d, |terms, d| terms * d.abs())
        + sum(&entropy.w[1], &sizes, |w, size| w.abs() * size);
    simpson + (simpson - trapezoid).abs() + ROUNDING * f64::EPSILON * rounding < 0.0
}
