//! The flow of a vector field of one's own on the states of a system.

use super::dormand_prince::FIVE;
use super::flow::StageFlow;
use super::stage::{Here, combined};
use super::tableau::Stages;
use crate::step::{Element, Vector as _};

/// Follows the vector field `velocity` from `x` for the time `s`, by one step of Dormand's and Prince's method of order 5 in
/// the chart of the stages. The laws of the system are not looked at. `None` where the field has no value, and beyond the
/// chart.
pub(crate) fn along<F: StageFlow>(
    flow: &F,
    x: &Element<F>,
    s: f64,
    velocity: impl Fn(&Element<F>) -> Option<F::Vector>,
) -> Option<Element<F>> {
    let Stages::Rows(rows) = FIVE.stages else { return None };
    let first = velocity(x)?;
    let zero = first.zero();
    let rates = |q: &F::Vector, y: &Element<F>, v: &F::Vector| Here {
        velocity: flow.stage_rates(x, (q, y), v),
        production: 0.0,
    };
    let mut stages = Here::at_rest(&zero);
    stages[0] = rates(&zero, x, &first);
    for (i, row) in rows.iter().enumerate() {
        let q = combined(s, row, &stages);
        let y = flow.stage(x, &q)?;
        stages[i + 1] = rates(&q, &y, &velocity(&y)?);
    }
    let end = combined(s, FIVE.end, &stages);
    let is_finite = (0..end.len()).all(|i| end.get(i).is_finite());
    if is_finite { flow.stage(x, &end) } else { None }
}
