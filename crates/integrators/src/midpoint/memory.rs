//! The memory of a scheme.

use metriplectic_fields::{Column, Dimension, Square};

use super::jacobian::KeptJacobian;
use super::predictor::{DIFFERENCES, Predictor};
use crate::newton::Inverse;
use crate::round_off::compensation::Compensation;
use crate::step::{Dim, Memory, RestoreError, Saved};

/// The memory of a [`Scheme`](crate::Scheme) from one step to the next: the displacements, from which the next one is
/// extrapolated; the inverse of a Jacobian, which is used as long as it contracts; and what rounding has
/// lost of the position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MidpointMemory<N: Dimension> {
    pub(super) predictor: Predictor<N>,
    pub(super) jacobian: KeptJacobian<N>,
    pub(super) compensation: Compensation<N>,
}

/// The memory of a scheme for a system.
pub(super) type MemoryOf<Y> = MidpointMemory<Dim<Y>>;

impl<N: Dimension> Default for MidpointMemory<N> {
    fn default() -> Self {
        let (predictor, compensation) = (Predictor::default(), Compensation::NONE);
        Self { predictor, jacobian: KeptJacobian::default(), compensation }
    }
}

impl<N: Dimension> MidpointMemory<N> {
    /// The rate `h|K'|` of the friction where the kept Jacobian was formed.
    pub(super) fn friction(&self) -> f64 {
        self.jacobian.inverse.as_ref().map_or(0.0, |inverse| inverse.friction)
    }
}

/// The names of the displacements in a checkpoint.
pub(crate) const NAMES: [&str; DIFFERENCES] = [
    "displacement",
    "first difference",
    "second difference",
    "third difference",
    "fourth difference",
    "fifth difference",
    "sixth difference",
    "seventh difference",
];

impl<N: Dimension> Memory for MidpointMemory<N> {
    fn rescaled(&self, ratio: f64) -> Self {
        Self { predictor: self.predictor.rescaled(ratio), ..*self }
    }

    fn save(&self, saved: &mut Saved) {
        let n = N::LEN;
        let column = |v: &N::Vector<f64>| {
            let v = *v;
            (0..n).map(move |i| v[i])
        };
        let Predictor { differences, known } = &self.predictor;
        for (name, difference) in NAMES.iter().zip(differences).take(*known) {
            saved.put(*name, column(difference));
        }
        if let KeptJacobian { inverse: Some(inverse), h, length } = &self.jacobian {
            let Inverse { matrix, round_off, residual_bound, contraction, first, friction, age } =
                inverse;
            saved.put("inverse", (0..n * n).map(|k| matrix[(k / n, k % n)]));
            saved.put("round-off of the solution", column(round_off));
            let numbers =
                [*residual_bound, *contraction, *first, *friction, f64::from(*age), *h, *length];
            saved.put("what the inverse was formed for", numbers);
        }
        if let Some(lost) = &self.compensation.0 {
            saved.put("compensation", column(lost));
        }
    }

    fn restore(saved: &Saved) -> Result<Self, RestoreError> {
        let n = N::LEN;
        let column = |name| -> Result<Option<N::Vector<f64>>, RestoreError> {
            let list = saved.get(name, n)?;
            Ok(list.map(|list| N::Vector::<f64>::from_index(|i| list[i])))
        };
        let mut memory = Self::default();
        for (name, slot) in NAMES.into_iter().zip(&mut memory.predictor.differences) {
            let Some(difference) = column(name)? else { break };
            *slot = difference;
            memory.predictor.known += 1;
        }
        let matrix = saved.get("inverse", n * n)?;
        let round_off = column("round-off of the solution")?;
        let numbers = saved.get("what the inverse was formed for", 7)?;
        if let (Some(matrix), Some(round_off), Some(numbers)) = (matrix, round_off, numbers) {
            let [residual_bound, contraction, first, friction, age, h, length] =
                [0, 1, 2, 3, 4, 5, 6].map(|k| numbers[k]);
            if !(0.0..=f64::from(u32::MAX)).contains(&age) {
                return Err(RestoreError::Damaged { what: "age of the inverse", value: age });
            }
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "it is in range"
            )]
            let age = age as u32;
            let matrix = N::Matrix::<f64>::from_entries(|i, j| matrix[i * n + j]);
            let inverse =
                Inverse { matrix, round_off, residual_bound, contraction, first, friction, age };
            memory.jacobian = KeptJacobian { inverse: Some(inverse), h, length };
        }
        memory.compensation = Compensation(column("compensation")?);
        Ok(memory)
    }
}
