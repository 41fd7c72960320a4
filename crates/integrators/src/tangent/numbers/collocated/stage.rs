//! A stage with its covectors, and its velocity along the unknowns of the step.

use metriplectic_fields::power_of_two;
use nalgebra::DMatrix;

use super::super::super::error::Unlinearised;
use super::along::{Along, Around, Number, column, dense};
use crate::implicit::{
    Columns, Matrix, OfLaws, VelocityJet, WithJacobian, reversible_jet, whole_velocity_jet,
};
use crate::numbers::AtRunTime;
use crate::step::{Directions, Entries};

/// The covectors `♭v_i` in units: `Y_i/υ` with a power of two `υ`, and `Σ b_i |Y_i/υ|²`.
pub(super) struct Flat {
    pub(super) flat: Vec<Along>,
    pub(super) square: Number,
    /// The unit `υ`.
    pub(super) unit: f64,
}

impl Flat {
    pub(super) fn of(around: &Around<'_>) -> Self {
        let largest = around.displacements.iter().fold(0.0_f64, |most, y| most.max(y.amax()));
        let unit = if largest > 0.0 { power_of_two(largest) } else { 1.0 };
        let (mut flat, mut square) = (Vec::new(), Number::zero(around.columns()));
        for i in 0..around.tableau.stages {
            let y = around.displacement(i).scaled(unit.recip());
            square = Number::sum([1.0, around.tableau.weights[i]], [&square, &y.dot(&y)]);
            flat.push(y);
        }
        Self { flat, square, unit }
    }

    /// The share `δ/D` of a stage, by which a covector is corrected along `Y_i/υ`.
    pub(super) fn share(&self, lost: &Number) -> Number {
        if self.square.value == 0.0 {
            return Number::zero(lost.row.len());
        }
        lost.scaled(self.unit.recip()).over(&self.square)
    }
}

/// The state of a stage, with its covectors.
pub(super) struct Stage {
    pub(super) place: Entries,
    /// The derivative of the place.
    pub(super) moved: DMatrix<f64>,
    pub(super) w: OfLaws<Along>,
}

impl Stage {
    /// Vectors along the unknowns and the parameters, by the chain rule: from their derivatives along the place and along each covector,
    /// for which `jets` is asked with those of the place, a multiple of the identity, and of the covectors; and from those along
    /// parameters alone.
    pub(super) fn chained<const K: usize>(
        &self,
        around: &Around<'_>,
        jets: impl Fn(
            &Entries,
            Columns,
            &OfLaws<WithJacobian<AtRunTime>>,
        ) -> Option<[WithJacobian<AtRunTime>; K]>,
    ) -> Result<[Along; K], Unlinearised> {
        let (n, columns) = self.moved.shape();
        let mut along: [Along; K] = std::array::from_fn(|_| Along::zero(n, columns));
        let all = [&self.w.energy, &self.w.entropy].into_iter().chain(&self.w.invariants);
        let arguments = std::iter::once(&self.moved).chain(all.map(|w| &w.slope));
        let seeded = |argument: usize| {
            let mut number = 0;
            self.w.map(|w| {
                number += 1;
                let own = if number == argument { 1.0 } else { 0.0 };
                WithJacobian::new(w.numbers(), Matrix::scaled_one(n, own))
            })
        };
        for (argument, slope) in arguments.enumerate() {
            let at = Columns::Directions(if argument == 0 { 1.0 } else { 0.0 });
            let jets = jets(&self.place, at, &seeded(argument)).ok_or(Unlinearised::Singular)?;
            for (along, jet) in along.iter_mut().zip(jets) {
                along.value = column(&jet.value);
                along.slope += dense(&jet.slope, n) * slope;
            }
        }
        let count = around.step.parameters;
        for first in (0..count).step_by(n) {
            let len = n.min(count - first);
            let (chunk, w) = (Columns::Parameters(first..first + len), seeded(0));
            let jets = jets(&self.place, chunk, &w).ok_or(Unlinearised::Singular)?;
            for (along, jet) in along.iter_mut().zip(jets) {
                let mut to = along.slope.columns_mut(around.size_column() + 1 + first, len);
                to += dense(&jet.slope, n).columns(0, len);
            }
        }
        Ok(along)
    }

    /// The velocity, and the part of friction and force in it.
    pub(super) fn velocity(&self, around: &Around<'_>) -> Result<[Along; 2], Unlinearised> {
        let parts = &around.parts;
        self.chained(around, |x, columns, w| {
            let jet = whole_velocity_jet(parts, x, columns, w)?;
            let VelocityJet { velocity, irreversible, .. } = jet;
            let n = parts.n();
            let none = || WithJacobian::new(Directions::zeros(n), Matrix::zeros(n));
            Some([velocity, irreversible.unwrap_or_else(none)])
        })
    }

    /// The part of the bracket.
    pub(super) fn reversible(&self, around: &Around<'_>) -> Result<Along, Unlinearised> {
        let jets =
            |x: &Entries, columns, w: &_| Some([reversible_jet(&around.parts, x, columns, w)?]);
        let [v] = self.chained(around, jets)?;
        Ok(v)
    }
}
