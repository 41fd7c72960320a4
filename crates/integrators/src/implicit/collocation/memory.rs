//! The memory of methods with stages from one step to the next: as [`StageMemory`](crate::StageMemory), in plain numbers and under its
//! names.

use std::fmt;

use super::chart::StepChart;
use super::covectors::{all_finite, combined, each_stage};
use super::equation::Unknowns;
use super::linear::Linear;
use crate::collocation::memory::NAMES;
use crate::collocation::tableau::Tableau;
use crate::implicit::algebra::Matrix;
use crate::implicit::drift::Compensation;
use crate::implicit::parts::Parts;
use crate::numbers::{Lengths, List};
use crate::step::{FARTHEST, Memory, RestoreError, Saved, Vector as _};

/// The memory of a method with stages for a model in plain numbers.
#[doc(hidden)]
#[allow(private_bounds, reason = "no other crate makes one")]
pub struct StageNumbers<L: Lengths> {
    /// The velocities of the stages of the last step.
    velocities: Option<Continued<L>>,
    /// The derivatives of an earlier step.
    pub(super) linear: Option<Linear<L>>,
    pub(super) compensation: Compensation<L>,
    /// The last step, for its error and for what lies inside it.
    pub(super) last: Option<LastStep<L>>,
}

/// The polynomial of a step, as it is continued.
struct Continued<L: Lengths> {
    /// The velocities of the stages.
    k: Unknowns<L>,
    /// How many there are.
    stages: usize,
    /// The size of the step.
    h: f64,
}

/// A step that was taken whole.
pub(super) struct LastStep<L: Lengths> {
    /// The velocities of the stages.
    pub(super) k: Unknowns<L>,
    /// The matrix `(I − γhJ)⁻¹` there, if it is not that of the derivatives in the memory.
    filter: Option<Matrix<L>>,
}

// By hand, because lengths have none of these.
impl<L: Lengths> Clone for StageNumbers<L> {
    fn clone(&self) -> Self {
        let last = self.last.as_ref();
        let last =
            last.map(|LastStep { k, filter }| LastStep { k: k.clone(), filter: filter.clone() });
        Self { last, ..self.without_last(self.linear.clone()) }
    }
}

impl<L: Lengths> fmt::Debug for StageNumbers<L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let velocities = self.velocities.as_ref().map(|Continued { k, .. }| k);
        f.debug_struct("StageNumbers").field("velocities", &velocities).finish_non_exhaustive()
    }
}

impl<L: Lengths> Default for StageNumbers<L> {
    fn default() -> Self {
        Self { velocities: None, linear: None, compensation: Compensation(None), last: None }
    }
}

#[allow(private_bounds, reason = "no other crate makes one")]
impl<L: Lengths> StageNumbers<L> {
    /// The memory without its last step, with these derivatives.
    fn without_last(&self, linear: Option<Linear<L>>) -> Self {
        let velocities = self.velocities.as_ref();
        let velocities =
            velocities.map(|&Continued { ref k, stages, h }| Continued { k: k.clone(), stages, h });
        Self { velocities, linear, compensation: self.compensation.clone(), last: None }
    }

    /// The memory itself, if its vectors have this length, as those of every step do.
    pub(super) fn keep_length(&mut self, n: usize) {
        let velocities = self.velocities.iter().flat_map(|Continued { k, .. }| k);
        let last = self.last.iter().flat_map(|LastStep { k, .. }| k);
        let has = |list: &L::Vector| list.numbers().len() == n;
        if !velocities.chain(last).chain(&self.compensation.0).all(has) {
            *self = Self::default();
        }
    }

    /// Keeps the velocities of the stages of a step that was taken, and its derivatives if they serve the next one.
    pub(super) fn keep(&mut self, k: Unknowns<L>, mut linear: Linear<L>, is_kept: bool) {
        let mut filter = None;
        if is_kept {
            linear.age += 1;
            self.linear = Some(linear);
        } else {
            filter = Some(linear.inverse);
            self.linear = None;
        }
        self.last = Some(LastStep { k, filter });
    }

    /// The velocities of the stages of the last step, and the matrix `(I − γhJ)⁻¹` there.
    pub(super) fn last_step(&self) -> Option<(&Unknowns<L>, &Matrix<L>)> {
        let LastStep { k, filter } = self.last.as_ref()?;
        let of_kept = || self.linear.as_ref().map(|linear| &linear.inverse);
        Some((k, filter.as_ref().or_else(of_kept)?))
    }

    /// The velocities of a step of size `h`, on the continued polynomial; none before the first step, and after one that was
    /// [far shorter](FARTHEST).
    pub(super) fn guess(
        &self,
        parts: &Parts<'_, L>,
        tableau: &Tableau,
        h: f64,
    ) -> Option<Unknowns<L>> {
        let &Continued { ref k, stages, h: before } = self.velocities.as_ref()?;
        let ratio = h / before;
        // Not so if it is not a number.
        let is_near = ratio > 0.0 && ratio <= FARTHEST;
        if stages != tableau.stages || !is_near {
            return None;
        }
        Some(each_stage(parts, stages, |i| {
            let tau = 1.0 + tableau.nodes[i] * ratio;
            combined(1.0, stages, &tableau.velocity(tau), k)
        }))
    }

    /// Notes a step of size `h` from `x` with these velocities of its stages.
    pub(super) fn note(
        &mut self,
        tableau: &Tableau,
        (parts, x, h): (&Parts<'_, L>, &L::State, f64),
        k: &Unknowns<L>,
    ) {
        let stages = tableau.stages;
        let carried = (!parts.is_flat()).then(|| {
            let u = combined(h, stages, &tableau.weights, k);
            let chart = StepChart::of(parts, x, u)?;
            let half = chart.d.map(|d| d * 0.5);
            Some(each_stage(parts, stages, |i| {
                let middle = chart.to_middle(parts, x, &k[i]);
                parts.velocity_at(&chart.end, (&chart.z, &half), &middle)
            }))
        });
        let k = match &carried {
            Some(None) => return self.velocities = None,
            Some(Some(carried)) => carried,
            None => k,
        };
        self.velocities = all_finite::<L>(k).then(|| Continued { k: k.clone(), stages, h });
    }
}

impl<L: Lengths> Memory for StageNumbers<L> {
    fn rescaled(&self, ratio: f64) -> Self {
        let linear = self.linear.as_ref().filter(|_| ratio.to_bits() == 1.0_f64.to_bits());
        self.without_last(linear.cloned())
    }

    fn stage_velocities(&self) -> Vec<f64> {
        let all = self.last.iter().flat_map(|last| &last.k);
        all.flat_map(|k| k.numbers().iter().copied()).collect()
    }

    fn save(&self, saved: &mut Saved) {
        let column = |v: &L::Vector| v.numbers().to_vec();
        if let Some(Continued { k, stages, h }) = &self.velocities {
            for (name, k) in NAMES.iter().zip(k).take(*stages) {
                saved.put(*name, column(k));
            }
            saved.put("size of the step of the stages", [*h]);
        }
        if let Some(linear) = &self.linear {
            linear.save(saved);
        }
        if let Some(lost) = &self.compensation.0 {
            saved.put("compensation", column(lost));
        }
    }

    fn restore(saved: &Saved) -> Result<Self, RestoreError> {
        let column = |name: &'static str| -> Result<Option<L::Vector>, RestoreError> {
            let Some(list) = saved.list(name)? else { return Ok(None) };
            let (found, expected) = (list.len(), L::directions(list.len()));
            if found != expected {
                return Err(RestoreError::Length { what: name, found, expected });
            }
            Ok(Some(L::Vector::of(&list)))
        };
        let mut known = Vec::new();
        for name in NAMES {
            let Some(velocity) = column(name)? else { break };
            known.push(velocity);
        }
        let h = saved.get("size of the step of the stages", 1)?.map(|list| list[0]);
        let velocities = match (h, known.first()) {
            (Some(h), Some(first)) if h != 0.0 => {
                let n = first.numbers().len();
                let of_stage = |i: usize| known.get(i).cloned();
                let k =
                    std::array::from_fn(|i| of_stage(i).unwrap_or_else(|| L::Vector::room(|| n)));
                Some(Continued { k, stages: known.len(), h })
            }
            (Some(value), _) => {
                let what = "size of the step of the stages";
                return Err(RestoreError::Damaged { what, value });
            }
            (None, _) => None,
        };
        let compensation = Compensation(column("compensation")?);
        Ok(Self { velocities, linear: Linear::restored(saved)?, compensation, last: None })
    }
}
