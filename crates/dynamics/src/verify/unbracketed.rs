//! Directions in which friction alone moves a state.

use metriplectic_fields::{ChartPoint, Dimension, ScalarField};

use crate::bracket::Bracket;
use crate::dissipation::Dissipation;
use crate::metriplectic::{Dim, Metriplectic, Point};

/// The directions that the dissipation of a metric moves at a point and the bracket does not, if there are others that it does.
///
/// With the canonical metric on its factor, a parameter is one of them: `K dS` moves it wherever `H` or `S` depends on it.
pub(super) fn directions<Y: Metriplectic + ?Sized>(system: &Y, x: &Point<Y>) -> Vec<usize> {
    let (k, n) = (system.dissipation(), Dim::<Y>::LEN);
    if k.is_none() || !k.adapts() || system.bracket().is_zero() {
        return Vec::new();
    }
    let centre = ChartPoint::<Y::Manifold>::centre(x);
    let g = system.metric_at(&centre);
    let (dh, ds) = (system.energy().jet1(x).df, system.entropy().jet1(x).df);
    let tensors = (system.bracket().tensor(&system.bracket_args(&g, &ds)), k.tensor(&g, &dh));
    // What a metric cannot say is a law of its own.
    let (Ok(bracket), Ok(friction)) = tensors else { return Vec::new() };
    let is_still = |i: usize| (0..n).all(|j| bracket[(i, j)] == 0.0);
    if (0..n).all(is_still) {
        return Vec::new();
    }
    (0..n).filter(|&i| is_still(i) && (0..n).any(|j| friction[(i, j)] != 0.0)).collect()
}
