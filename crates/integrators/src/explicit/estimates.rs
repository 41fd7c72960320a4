//! Estimates of the error and of the stability of a step, from its stages.

use super::chebyshev;
use super::dormand_prince::{EIGHT, FIVE};
use super::flow::StageFlow;
use super::memory::{LastStep, MemoryOf};
use super::spectrum::Spectrum;
use super::stage::combined;
use super::tableau::{Compiled, ESTIMATED, Row, Stages, Tableau};
use super::trial::Done;
use crate::step::{LedgerErrors, LimitingSites, Vector, both};

/// Whether the rates between the last stage and the end differ by as much as at the edge of the region of
/// stability: `h |k_e − k_s| / |q_e − q_s|` of Hairer, Wanner (Solving ODEs II, §IV.2), relative to these sizes
/// of the entries.
pub(super) fn is_at_the_edge<V: Vector>(
    (tableau, h): (&Tableau, f64),
    sizes: &V,
    last: &LastStep<V>,
    rates: &V,
) -> bool {
    let rates_before = &last.stages[tableau.rows().len()].velocity;
    let vectors = [&last.end, &last.before, sizes, rates, rates_before];
    let [distance, change] = V::norms_of(vectors, |[end, before, size, rate, rate_before]| {
        let size = size.max(end.abs());
        both([end - before, h * (rate - rate_before)], |change| {
            if change == 0.0 { 0.0 } else { change / size }
        })
    });
    distance > 64.0 * f64::EPSILON && change > tableau.stability * distance
}

/// The error of a step in units of the one allowed. A step that was taken in parts has the estimate of the flow.
pub(super) fn error<F: StageFlow>(
    &Done { tableau, ends: step }: &Done<'_, F>,
    memory: &MemoryOf<F>,
    norm: impl Fn(&F::Vector) -> f64,
) -> Option<f64> {
    let flow = step.flow;
    let h = step.h;
    let Some(last) = memory.last.as_ref() else {
        return Some(norm(&flow.local_error(step.x, step.end, h)?));
    };
    match (tableau.stages, tableau.errors) {
        (Stages::Chebyshev, _) => return Some(norm(&chebyshev::error(last, h))),
        // The estimate of the flow has an error of order 5.
        (Stages::Rows(_), [[], _]) if tableau.order <= ESTIMATED => {
            return Some(norm(&flow.local_error(step.x, step.end, h)?));
        }
        (Stages::Rows(_), [[], _]) => return None,
        (Stages::Rows(_), _) => {}
    }
    // The sums of rows that are constants are written out, and not in a closure that is called.
    let [fifth, third] = match tableau.compiled {
        Some(Compiled::Eight) => {
            const ROWS: [Row; 2] = EIGHT.errors;
            // One after the other, so that many sites have one array for both.
            let fifth = norm(&combined(h, ROWS[0], &last.stages));
            let third = norm(&combined(h, ROWS[1], &last.stages));
            [fifth, third]
        }
        Some(Compiled::Five) => {
            const ROW: Row = FIVE.errors[0];
            [norm(&combined(h, ROW, &last.stages)), 0.0]
        }
        None => both(tableau.errors, |row| norm(&combined(h, row, &last.stages))),
    };
    // Hairer's e₅²/√(e₅² + e₃²/100) is of the order of the method; a method with one error has that.
    // A tenth of the least number is zero.
    let whole = fifth.hypot(0.1 * third);
    Some(if third > 0.0 && whole > 0.0 { fifth * (fifth / whole) } else { fifth })
}

/// The errors of what a step has booked; `None` without an embedded estimate.
#[cold]
pub(super) fn of_the_ledger<F: StageFlow>(
    tableau: &Tableau,
    flow: &F,
    h: f64,
    last: &LastStep<F::Vector>,
) -> Option<LedgerErrors> {
    let row = |row: Row| combined(h, row, &last.stages);
    let errors = match (tableau.stages, tableau.errors) {
        (Stages::Chebyshev, _) => chebyshev::error(last, h),
        (Stages::Rows(_), [[], _]) => return None,
        (Stages::Rows(_), [only, []]) => row(only),
        (Stages::Rows(_), [fifth, third]) => {
            Vector::zip([&row(fifth), &row(third)], |[fifth, third]| {
                if third == 0.0 { fifth } else { fifth * (fifth / fifth.hypot(0.1 * third)) }
            })
        }
    };
    flow.ledger_errors(&errors)
}

/// The sites with the largest embedded error and the stiffest motion. The stiff direction is the one of the power
/// method for the spectral radius; without it, and at the edge of the region of stability, it is the change of the
/// rates between the last stage and the end of the step.
pub(super) fn limiting_sites<F: StageFlow>(
    &Done { tableau, ends: step }: &Done<'_, F>,
    memory: &MemoryOf<F>,
    allowed: &F::Vector,
) -> LimitingSites {
    let flow = step.flow;
    let (x, h) = (step.x, step.h);
    let largest = |v: Option<F::Vector>| v.and_then(|v| v.largest_site(allowed));
    let Some(last) = memory.last.as_ref() else {
        return LimitingSites::new(largest(flow.local_error(x, step.end, h)), None);
    };
    if let Stages::Chebyshev = tableau.stages {
        let stiffest = |found: &Spectrum<_>| found.stiffest_site(&flow.sizes(x));
        let stiffness = memory.spectrum.as_ref().and_then(stiffest);
        return LimitingSites::new(largest(Some(chebyshev::error(last, h))), stiffness);
    }
    let error = match tableau.errors {
        [[], _] => flow.local_error(x, step.end, h),
        [row, _] => Some(combined(h, row, &last.stages)),
    };
    let (error, count) = (largest(error), tableau.rows().len());
    let [before, rates] = [count, count + 1].map(|stage| &last.stages[stage].velocity);
    let stiffness = if last.at_the_edge {
        let change = Vector::zip([rates, before], |[rates, before]| rates - before);
        change.largest_site(&flow.sizes(x))
    } else {
        None
    };
    LimitingSites::new(error, stiffness)
}
