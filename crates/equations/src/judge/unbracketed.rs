//! Directions in which friction alone moves a state.

use super::at::At;
use crate::{Covectors, ENERGY, ENTROPY, Part};

/// The directions that the dissipation of a metric moves at a state and the bracket does not, if there are others that it does.
///
/// With the canonical metric on its factor, a parameter is one of them: `K dS` moves it wherever `H` or `S` depends on it.
pub(super) fn directions(at: At<'_>) -> Vec<usize> {
    let (model, n) = (at.model, at.n());
    if model.is_zero(Part::Irreversible) || !model.adapts() || model.is_zero(Part::Reversible) {
        return Vec::new();
    }
    let [(_, energy), (_, entropy)] = [ENERGY, ENTROPY].map(|law| at.jet(law));
    let w = Covectors { energy: &energy, entropy: &entropy };
    // What a metric cannot say is a law of its own.
    let (Ok(bracket), Ok(friction)) =
        (at.tensor(Part::Reversible, w), at.tensor(Part::Irreversible, w))
    else {
        return Vec::new();
    };
    let is_still = |i: usize| (0..n).all(|j| bracket[(i, j)] == 0.0);
    if (0..n).all(is_still) {
        return Vec::new();
    }
    (0..n).filter(|&i| is_still(i) && (0..n).any(|j| friction[(i, j)] != 0.0)).collect()
}
