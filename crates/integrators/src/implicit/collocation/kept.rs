//! The derivatives of a step in a checkpoint, which serve the steps after it.

use super::linear::Linear;
use crate::collocation::tableau::{GAUSS, RADAU, Tableau};
use crate::implicit::algebra::Matrix;
use crate::numbers::{Lengths, List};
use crate::step::{RestoreError, Saved};

const SLOPE: &str = "derivatives of the stages";
const INVERSE: &str = "inverse of the stages";
const SENSITIVITY: &str = "sensitivity of the stages";
const VECTORS: [&str; 4] = [
    "round-off of the terms of the stages",
    "round-off of the stages",
    "round-off of the stages by points",
    "displacement of the derivatives of the stages",
];
const NUMBERS: &str = "step of the derivatives of the stages";

/// The coefficients of so many stages, of a method that damps or of one that does not.
fn tableau(stages: f64, one_sided: f64) -> Option<&'static Tableau> {
    let all = if one_sided > 0.0 { &RADAU[..] } else { &GAUSS[..] };
    all.iter().find(|tableau| (tableau.stages as f64 - stages).abs() < 0.5)
}

impl<L: Lengths> Linear<L> {
    /// Puts all of its numbers into a checkpoint.
    pub(super) fn save(&self, saved: &mut Saved) {
        let matrices =
            [(SLOPE, &self.slope), (INVERSE, &self.inverse), (SENSITIVITY, &self.sensitivity)];
        for (name, matrix) in matrices {
            saved.put(name, matrix.numbers().iter().copied());
        }
        let vectors = [&self.rounded, &self.terms, &self.moved, &self.displaced];
        for (name, v) in VECTORS.into_iter().zip(vectors) {
            saved.put(name, v.numbers().iter().copied());
        }
        let Tableau { stages, one_sided, .. } = *self.tableau;
        let one_sided = f64::from(u8::from(one_sided));
        let step = [self.h, self.friction, self.rotation, f64::from(self.age)];
        saved.put(NUMBERS, step.into_iter().chain([stages as f64, one_sided]));
    }

    /// Reads them from a checkpoint, if it has them.
    pub(super) fn restored(saved: &Saved) -> Result<Option<Self>, RestoreError> {
        let Some(numbers) = saved.get(NUMBERS, 6)? else { return Ok(None) };
        let n = saved.list(VECTORS[0])?.map_or(0, |list| list.len());
        let missing = |what: &'static str| RestoreError::Length { what, found: 0, expected: n };
        if n != L::directions(n) {
            let (found, expected) = (n, L::directions(n));
            return Err(RestoreError::Length { what: VECTORS[0], found, expected });
        }
        let vector = |name| Ok(L::Vector::of(&saved.get(name, n)?.ok_or_else(|| missing(name))?));
        let matrix = |name| {
            let list = saved.get(name, n * n)?.ok_or_else(|| missing(name))?;
            Ok(Matrix::of(n, |i, j| list[i * n + j]))
        };
        let [h, friction, rotation, age, stages, one_sided] =
            [0, 1, 2, 3, 4, 5].map(|k| numbers[k]);
        let damaged = |value| RestoreError::Damaged { what: NUMBERS, value };
        let known = (0..=u32::from(u8::MAX)).find(|&known| f64::from(known) >= age);
        Ok(Some(Self {
            tableau: tableau(stages, one_sided).ok_or_else(|| damaged(stages))?,
            h,
            slope: matrix(SLOPE)?,
            inverse: matrix(INVERSE)?,
            rounded: vector(VECTORS[0])?,
            terms: vector(VECTORS[1])?,
            sensitivity: matrix(SENSITIVITY)?,
            moved: vector(VECTORS[2])?,
            displaced: vector(VECTORS[3])?,
            friction,
            rotation,
            age: known.ok_or_else(|| damaged(age))?,
        }))
    }
}
