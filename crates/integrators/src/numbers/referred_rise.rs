//! The rise of the entropy near an equilibrium, where it is below the round-off of its values.
//!
//! It is the integral of [typed systems](crate::system), in a text that knows no type of a system.

use metriplectic_equations::room::with_numbers;
use metriplectic_equations::{ENERGY, ENTROPY, Equations, Sizes};
use smallvec::SmallVec;

use crate::round_off::bound::INDEPENDENT;
use crate::system::{NO_CLOCK, ROUNDING};

/// The vectors of a law along a line, one after another: its differentials at the start, in the middle and at the end; the
/// components `s_i ∂_iF` of the one in the middle, with the sizes `s` of the entries; and the absolute terms of that one.
const VECTORS: usize = 5;

/// Returns whether the entropy falls from `x` to the near state `y` by more than the error of the integral. The error
/// is its rounding, and the difference of Simpson's rule and the trapezoidal rule, which agree on a quadratic entropy. A
/// system whose parts are not known apart has no differentials along a chart, and cannot say.
pub(crate) fn falls(system: &dyn Equations, x: &[f64], y: &[f64]) -> bool {
    let Some(model) = system.model() else { return false };
    let Sizes { directions: n, laws, .. } = system.sizes();
    // In one array for all, because a run near its equilibrium asks on each step.
    with_numbers((VECTORS * laws + 3) * n, |room| {
        let (d, room) = room.split_at_mut(n);
        let (sizes, room) = room.split_at_mut(n);
        let (q, room) = room.split_at_mut(n);
        if !system.coordinates(x, y, d) {
            return false;
        }
        system.scales(x, sizes);
        let (mut squares, mut left) = (SmallVec::<[f64; 4]>::new(), room);
        let mut before: SmallVec<[&[f64]; 4]> = SmallVec::new();
        for law in std::iter::once(ENERGY).chain(ENTROPY + 1..laws).chain([ENTROPY]) {
            let (along, rest) = left.split_at_mut(VECTORS * n);
            left = rest;
            for (w, t) in along.chunks_exact_mut(n).zip([0.0, 0.5, 1.0]) {
                q.iter_mut().zip(&*d).for_each(|(q, d)| *q = d * t);
                model.differential_at(law, NO_CLOCK, x, q, w);
            }
            for i in 0..n {
                let w = along[n + i];
                along[3 * n + i] = sizes[i].max(d[i].abs()) * w;
                along[4 * n + i] = w.abs();
            }
            let hat = 3 * n..4 * n;
            let whole = dot(&along[hat.clone()], &along[hat.clone()]);
            let mut square = whole;
            // The second pass removes the rounding error of the first.
            for _ in 0..2 {
                for (of_law, of_square) in before.iter().zip(&squares) {
                    let share = dot(&of_law[hat.clone()], &along[hat.clone()]) / of_square;
                    let (vectors, terms) = along.split_at_mut(4 * n);
                    add(vectors, &of_law[..4 * n], -share);
                    add(terms, &of_law[4 * n..], share.abs());
                    square = dot(&along[hat.clone()], &along[hat.clone()]);
                }
            }
            if law == ENTROPY {
                let [before, between, after] = [0, n, 2 * n].map(|k| dot(&along[k..k + n], d));
                let simpson = (before + 4.0 * between + after) / 6.0;
                let trapezoid = 0.5 * (before + after);
                let of_terms = along[4 * n..]
                    .iter()
                    .zip(&*d)
                    .fold(0.0, |sum, (terms, d)| sum + terms * d.abs());
                let of_middle = along[n..2 * n]
                    .iter()
                    .zip(&*sizes)
                    .fold(0.0, |sum, (w, size)| sum + w.abs() * size);
                let rounding = ROUNDING * f64::EPSILON * (of_terms + of_middle);
                return simpson + (simpson - trapezoid).abs() + rounding < 0.0;
            }
            let is_independent = law == ENERGY || square > INDEPENDENT * INDEPENDENT * whole;
            if is_independent && square > 0.0 {
                before.push(along);
                squares.push(square);
            }
        }
        false
    })
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |sum, (a, b)| sum + a * b)
}

/// Adds a multiple of a list to another one.
fn add(to: &mut [f64], of: &[f64], factor: f64) {
    to.iter_mut().zip(of).for_each(|(to, of)| *to += of * factor);
}
