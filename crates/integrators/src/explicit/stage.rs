//! The stages of an explicit step.

use super::flow::StageFlow;
use super::tableau::{Row, STAGES};
use crate::step::{Element, Vector};

/// The motion at a state, or that of a stage in the chart at the start of its step.
#[derive(Clone, Debug)]
pub(super) struct Here<V> {
    pub(super) velocity: V,
    pub(super) production: f64,
}

impl<V: Vector> Here<V> {
    /// As many at rest as there may be stages; `zero` is the velocity.
    pub(super) fn at_rest(zero: &V) -> [Self; STAGES] {
        std::array::from_fn(|_| Self { velocity: zero.clone(), production: 0.0 })
    }
}

/// The rates and the entropy production of a stage at the coordinates `q`.
#[inline]
pub(super) fn stage<F: StageFlow>(
    flow: &F,
    x: &Element<F>,
    q: &F::Vector,
) -> Option<Here<F::Vector>> {
    let y = flow.stage(x, q)?;
    let (v, production) = flow.motion(&y)?;
    Some(Here { velocity: flow.stage_rates(x, (q, &y), &v), production })
}

/// `h Σ_j w_j k_j` over the rates of the stages.
#[inline(always)]
pub(super) fn combined<V: Vector>(h: f64, row: Row, stages: &[Here<V>; STAGES]) -> V {
    if row.is_empty() {
        return stages[0].velocity.zero();
    }
    V::combination(h, row.len(), |j| {
        let (stage, w) = row[j];
        (w, &stages[stage].velocity)
    })
}

/// `Σ_j w_j σ_j` over the entropy production of the stages.
#[inline(always)]
pub(super) fn produced<V>(row: Row, stages: &[Here<V>; STAGES]) -> f64 {
    row.iter().fold(0.0, |sum, &(j, w)| sum + w * stages[j].production)
}
