//! States inside an explicit step.
//!
//! The polynomial of Hairer, Nørsett, Wanner (Solving ODEs I, §II.6) in the chart of the stages, with the end of
//! the step on the laws and the rates there: it is continuous from step to step, with its derivative. The
//! entropy has the same polynomial with its production; where that is not monotone, the cubic with the same
//! ends and limited slopes (Fritsch, Carlson 1980); and where the entropy has not risen, a constant. The state
//! is then moved onto the laws.

use metriplectic_dynamics::SecondLaw;

use super::flow::{StageFlow, Target};
use super::memory::{LastStep, MemoryOf, combined};
use super::step::{stage, with_entropy};
use super::tableau::Tableau;
use crate::method::{Element, StepEnds, Vector};

/// The state at the fraction `θ` of a step.
pub(super) fn between<F: StageFlow>(
    tableau: &'static Tableau,
    flow: &F,
    step: &StepEnds<'_, F>,
    memory: &mut MemoryOf<F>,
    theta: f64,
) -> Option<Element<F>> {
    if step.x == step.end {
        return Some(step.x.clone());
    }
    let last = memory.last.as_mut()?;
    more_stages(tableau, flow, step, last)?;
    let last = &*last;
    let rows = tableau.dense.iter().map(|row| combined(row, &last.stages));
    let h = step.h;
    let (rates, end) = (&last.stages[0].0, &last.stages[tableau.stages.len() + 1].0);
    let mut higher = rows.clone().map(|(row, _)| row).collect::<Vec<_>>();
    higher.iter_mut().for_each(|row| *row = row.map(|q| h * q));
    let q = last.end.with(|i| {
        let numbers: Vec<f64> = higher.iter().map(|row| row.get(i)).collect();
        polynomial([last.end.get(i), h * rates.get(i), h * end.get(i)], &numbers, theta)
    });
    let y = flow.stage(step.x, &q)?;
    let exact = flow.entropy_law() == SecondLaw::Exact;
    let entropy = if exact {
        let ends = step.values.map(|laws| laws.entropy);
        let slopes = [h * last.stages[0].1, h * last.stages[tableau.stages.len() + 1].1];
        let higher: Vec<f64> = rows.map(|(_, row)| h * row).collect();
        entropy(ends, slopes, &higher, theta)
    } else {
        0.0
    };
    let laws = with_entropy(step.reference, entropy);
    let onto = |with_entropy| {
        let target = Target { laws: &laws, with_entropy, limit: None };
        flow.project(y.clone(), &target).ok().map(|end| end.x)
    };
    if exact { onto(true).or_else(|| onto(false)) } else { onto(false) }
}

/// Takes the stages that only the dense output needs, once.
fn more_stages<F: StageFlow>(
    tableau: &'static Tableau,
    flow: &F,
    step: &StepEnds<'_, F>,
    last: &mut LastStep<F::Vector>,
) -> Option<()> {
    for row in tableau.more_stages {
        if last.known == tableau.stages.len() + 2 + tableau.more_stages.len() {
            break;
        }
        let q = combined(row, &last.stages).0.map(|q| step.h * q);
        last.stages[last.known] = stage(flow, step.x, &q)?;
        last.known += 1;
    }
    Some(())
}

/// The dense output of one entry, from 0 to `end`, with the slopes at both ends.
fn polynomial([end, first, last]: [f64; 3], higher: &[f64], theta: f64) -> f64 {
    let rest = 1.0 - theta;
    let bend = first - end;
    // θ (c₁ + (1 − θ) (c₂ + θ (c₃ + (1 − θ) (c₄ + …)))).
    let nested = higher.iter().enumerate().rev().fold(0.0, |sum, (k, c)| {
        let factor = if k % 2 == 0 { rest } else { theta };
        factor * (c + sum)
    });
    theta * (end + rest * (bend + theta * (end - last - bend + nested)))
}

/// The entropy at the fraction `θ`, between that of the start and that of the end, and never falling.
fn entropy([start, end]: [f64; 2], slopes: [f64; 2], higher: &[f64], theta: f64) -> f64 {
    let rise = end - start;
    if rise <= 0.0 {
        return start;
    }
    let at = |theta: f64| polynomial([rise, slopes[0], slopes[1]], higher, theta);
    let n = 64;
    let nodes = (0..=n).map(|k| at(f64::from(k) / f64::from(n)));
    let is_monotone = nodes.clone().zip(nodes.skip(1)).all(|(a, b)| a <= b);
    if is_monotone {
        return start + at(theta).clamp(0.0, rise);
    }
    // Slopes of at most three times the mean make the cubic monotone.
    let [first, last] = slopes.map(|slope| slope.clamp(0.0, 3.0 * rise));
    start + polynomial([rise, first, last], &[], theta).clamp(0.0, rise)
}
