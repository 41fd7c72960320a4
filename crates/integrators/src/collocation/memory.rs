//! The memory of methods with stages.

use metriplectic_fields::{Column, Dimension, Vector};
use metriplectic_manifolds::Manifold;

use super::chart::StepChart;
use super::covectors::{Stages, combined};
use super::tableau::{STAGES, Tableau};
use crate::round_off::compensation::Compensation;
use crate::step::{FARTHEST, Memory, RestoreError, Saved};

/// The memory of [`Gauss`](crate::Gauss) and [`Radau`](crate::Radau) from one step to the next: the velocities of the
/// stages, whose polynomial is continued, and the digits that rounding has lost of the position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StageMemory<N: Dimension> {
    /// The velocities of the stages of the last step, in the frame at the state reached.
    pub(super) velocities: Option<Continued<N>>,
    pub(super) compensation: Compensation<N>,
    /// The last step, for its error and for what lies inside it.
    pub(super) last: Option<LastStep<N>>,
}

/// The polynomial of a step, as it is continued.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Continued<N: Dimension> {
    /// The velocities of the stages.
    pub(super) k: Stages<N::Vector<f64>>,
    /// How many there are.
    pub(super) stages: usize,
    /// The size of the step.
    pub(super) h: f64,
}

/// A step that was taken whole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LastStep<N: Dimension> {
    /// The velocities of the stages, in the frame at its start.
    pub(super) k: Stages<N::Vector<f64>>,
    /// The matrix `(I − γhJ)⁻¹` there.
    pub(super) filter: N::Matrix<f64>,
}

impl<N: Dimension> Default for StageMemory<N> {
    fn default() -> Self {
        Self { velocities: None, compensation: Compensation::NONE, last: None }
    }
}

impl<N: Dimension> StageMemory<N> {
    /// The velocities of a step of size `h`, on the continued polynomial; none before the first step, and after one
    /// that was [far shorter](FARTHEST).
    pub(super) fn guess(&self, tableau: &Tableau, h: f64) -> Option<Stages<N::Vector<f64>>> {
        let Continued { k, stages, h: before } = self.velocities?;
        let ratio = h / before;
        // Not so if it is not a number.
        let is_near = ratio > 0.0 && ratio <= FARTHEST;
        if stages != tableau.stages || !is_near {
            return None;
        }
        Some(std::array::from_fn(|i| {
            let tau = 1.0 + tableau.nodes[i] * ratio;
            combined(stages, &tableau.velocity(tau), &k)
        }))
    }

    /// Notes the step from `x` with these velocities of its stages.
    pub(super) fn note<M: Manifold<Dim = N>>(
        &mut self,
        tableau: &Tableau,
        x: &M::Point<f64>,
        h: f64,
        k: &Stages<Vector<M>>,
        chart: &StepChart<M>,
        end: &M::Point<f64>,
    ) {
        let mut there = [Vector::<M>::zero(); STAGES];
        let half = chart.d * 0.5;
        for i in 0..tableau.stages {
            let middle = chart.to_middle(x, &k[i]);
            there[i] = super::chart::in_chart_at::<M>(end, &chart.z, &half, &middle);
        }
        self.velocities = super::covectors::all_finite::<N>(&there).then_some(Continued {
            k: there,
            stages: tableau.stages,
            h,
        });
    }
}

/// The names of the velocities in a checkpoint.
pub(crate) const NAMES: [&str; STAGES] =
    ["velocity of stage 1", "velocity of stage 2", "velocity of stage 3", "velocity of stage 4"];

impl<N: Dimension> Memory for StageMemory<N> {
    fn rescaled(&self, _: f64) -> Self {
        Self { last: None, ..*self }
    }

    fn stage_velocities(&self) -> Vec<f64> {
        let all = self.last.iter().flat_map(|last| last.k);
        all.flat_map(|k| (0..N::LEN).map(move |i| k[i])).collect()
    }

    fn save(&self, saved: &mut Saved) {
        let column = |v: &N::Vector<f64>| (0..N::LEN).map(|i| v[i]).collect::<Vec<f64>>();
        if let Some(Continued { k, stages, h }) = &self.velocities {
            for (name, k) in NAMES.iter().zip(k).take(*stages) {
                saved.put(*name, column(k));
            }
            saved.put("size of the step of the stages", [*h]);
        }
        if let Some(lost) = &self.compensation.0 {
            saved.put("compensation", column(lost));
        }
    }

    fn restore(saved: &Saved) -> Result<Self, RestoreError> {
        let column = |name| -> Result<Option<N::Vector<f64>>, RestoreError> {
            let list = saved.get(name, N::LEN)?;
            Ok(list.map(|list| N::Vector::<f64>::from_index(|i| list[i])))
        };
        let (mut k, mut stages) = ([N::Vector::<f64>::zero(); STAGES], 0);
        for name in NAMES {
            let Some(velocity) = column(name)? else { break };
            k[stages] = velocity;
            stages += 1;
        }
        let h = saved.get("size of the step of the stages", 1)?.map(|list| list[0]);
        let velocities = match h {
            Some(h) if stages > 0 && h != 0.0 => Some(Continued { k, stages, h }),
            Some(value) => {
                let what = "size of the step of the stages";
                return Err(RestoreError::Damaged { what, value });
            }
            None => None,
        };
        let compensation = Compensation(column("compensation")?);
        Ok(Self { velocities, compensation, last: None })
    }
}
