//! States inside an explicit step.
//!
//! The polynomial of Hairer, Nørsett, Wanner (Solving ODEs I, §II.6) in the chart of the stages, with the end of
//! the step on the laws and the rates there: it is continuous from step to step, with its derivative. The
//! entropy has the same polynomial with its production; where that is not monotone, the cubic with the same
//! ends and limited slopes (Fritsch, Carlson 1980); and where the entropy has not risen, a constant. The state
//! is then moved onto the laws.

use super::flow::StageFlow;
use super::memory::{LastStep, MemoryOf};
use super::stage::{combined, produced, stage};
use super::trial::Done;
use crate::step::dense;
use crate::step::{Element, Promises, Vector, both};

/// The state at the fraction `θ` of a step.
pub(super) fn between<F: StageFlow>(
    done: &Done<'_, F>,
    promises: Promises,
    memory: &mut MemoryOf<F>,
    theta: f64,
) -> Option<Element<F>> {
    let &Done { tableau, ends: step } = done;
    let flow = step.flow;
    if theta <= 0.0 || step.x == step.end {
        return Some(step.x.clone());
    }
    if theta >= 1.0 {
        return Some(step.end.clone());
    }
    let known = memory.last.as_mut().and_then(|last| {
        more_stages(done, last)?;
        Some(&*last)
    });
    // A step that was taken in parts has no stages.
    let Some(last) = known else { return dense::between(step, promises, theta) };
    let (h, line) = (step.h, last.end.map(|q| theta * q));
    let ends = [&last.stages[0], &last.stages[tableau.rows().len() + 1]];
    let mut rows: Vec<(F::Vector, f64)> = Vec::with_capacity(tableau.dense.len());
    for row in tableau.dense {
        rows.push((combined(1.0, row, &last.stages), produced(row, &last.stages)));
    }
    let mut higher = vec![0.0; rows.len()];
    let q = last.end.with(|i| {
        let slopes = both(ends, |end| h * end.velocity.get(i));
        for (number, (row, _)) in higher.iter_mut().zip(&rows) {
            *number = h * row.get(i);
        }
        polynomial(last.end.get(i), slopes, &higher, theta)
    });
    let target = promises.entropy.then(|| {
        let slopes = both(ends, |end| h * end.production);
        for (number, (_, row)) in higher.iter_mut().zip(&rows) {
            *number = h * row;
        }
        let [start, end] = step.values;
        entropy([start.entropy, end.entropy], slopes, &higher, theta)
    });
    let on_line = || flow.stage(step.x, &line).unwrap_or_else(|| step.x.clone());
    let y = flow.stage(step.x, &q).unwrap_or_else(on_line);
    let target = dense::Target::new(step, promises, theta, target);
    Some(target.reached_from(&y, on_line))
}

/// Takes the stages that only the dense output needs, once.
fn more_stages<F: StageFlow>(
    &Done { tableau, ends: step }: &Done<'_, F>,
    last: &mut LastStep<F::Vector>,
) -> Option<()> {
    let flow = step.flow;
    for row in tableau.more_stages {
        if last.known == tableau.rows().len() + 2 + tableau.more_stages.len() {
            break;
        }
        let q = combined(step.h, row, &last.stages);
        last.stages[last.known] = stage(flow, step.x, &q)?;
        last.known += 1;
    }
    Some(())
}

/// The dense output of one entry, from 0 to `end`, with the slopes at both ends.
fn polynomial(end: f64, slopes: [f64; 2], higher: &[f64], theta: f64) -> f64 {
    let rest = 1.0 - theta;
    // (1 − θ) (c₁ + θ (c₂ + (1 − θ) (c₃ + …))).
    let nested = higher.iter().enumerate().rev().fold(0.0, |sum, (k, c)| {
        let factor = if k % 2 == 0 { rest } else { theta };
        factor * (c + sum)
    });
    dense::cubic(end, slopes, theta) + theta * rest * theta * nested
}

/// The entropy at the fraction `θ`, between that of the start and that of the end, and never falling. A rise
/// that is not positive is round-off: the entropy is then the one at the start.
fn entropy([start, end]: [f64; 2], slopes: [f64; 2], higher: &[f64], theta: f64) -> f64 {
    let rise = end - start;
    if rise <= 0.0 {
        return start;
    }
    let at = |theta: f64| polynomial(rise, slopes, higher, theta);
    let nodes = (0..=NODES).map(|k| at(f64::from(k) / f64::from(NODES)));
    let is_monotone = nodes.clone().zip(nodes.skip(1)).all(|(a, b)| a < b);
    let risen = if is_monotone {
        at(theta)
    } else {
        dense::cubic(rise, dense::limited(rise, slopes), theta)
    };
    (start + risen.clamp(0.0, rise)).min(end)
}

/// Intervals on which the polynomial of the entropy is compared with a monotone function. One of degree 7 that is
/// monotone on these nodes has no room for a fall that is more than a small fraction of the rise of an interval.
/// A factor of four fails `explicit/dense.rs::an_entropy_that_falls_between_two_states_is_limited`.
const NODES: u32 = 32;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_rows_of_the_polynomial_are_the_cubic_of_hermite() {
        // f = t² (1 − t)² vanishes at both ends with its slope, and is the first higher row.
        for theta in [0.1, 0.4, 0.9_f64] {
            let value = polynomial(0.0, [0.0; 2], &[1.0], theta);
            assert!((value - theta.powi(2) * (1.0 - theta).powi(2)).abs() < 1e-16);
        }
    }

    #[test]
    fn an_entropy_between_two_states_never_falls() {
        let falling = [0.5, -3.0, 2.0, -1.0];
        for rise in [1.0, 1e-9, 0.0, -1e-16] {
            let at = |k: u32| entropy([2.0, 2.0 + rise], [0.0, 9.0], &falling, f64::from(k) / 40.0);
            assert!((0..40).all(|k| at(k) <= at(k + 1)), "{rise}");
            assert!(at(40) <= 2.0 + rise.max(0.0));
        }
    }

    #[test]
    fn an_entropy_that_falls_between_two_states_is_limited() {
        // A cubic that falls in the interval of this half width around the middle of a 32nd.
        let is_limited = |w: f64| {
            let m: f64 = 0.5 + 1.0 / 64.0;
            let a = ((m.powi(3) + (1.0 - m).powi(3)) / 3.0 - w * w).recip();
            let slopes = [m * m, (1.0 - m).powi(2)].map(|square| a * (square - w * w));
            let inside = entropy([0.0, 1.0], slopes, &[], 0.3);
            (inside - dense::cubic(1.0, slopes, 0.3)).abs() > 1e-6
        };
        assert!(is_limited(0.018) && !is_limited(0.006));
    }
}
