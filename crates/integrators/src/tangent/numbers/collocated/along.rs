//! Numbers and vectors along the unknowns of a step with stages.
//!
//! The derivatives stand in columns: those along the start `x`, then those along the displacements `Y_i` of the stages, that along the
//! size `h`, and those along the parameters.

use nalgebra::{DMatrix, DVector};

use super::super::StepOfModel;
use crate::collocation::{STAGES, Tableau};
use crate::implicit::{Matrix, Parts, Second, StageRoot, law_along_parameters};
use crate::numbers::AtRunTime;
use crate::step::{Directions, Entries};

/// A number with its derivatives.
#[derive(Clone, Debug)]
pub(in crate::tangent::numbers) struct Number {
    pub(in crate::tangent::numbers) value: f64,
    pub(in crate::tangent::numbers) row: DVector<f64>,
}

impl Number {
    pub(in crate::tangent::numbers) fn zero(columns: usize) -> Self {
        Self { value: 0.0, row: DVector::zeros(columns) }
    }

    /// `a x + b y`.
    pub(in crate::tangent::numbers) fn sum([a, b]: [f64; 2], [x, y]: [&Self; 2]) -> Self {
        Self { value: x.value * a + y.value * b, row: &x.row * a + &y.row * b }
    }

    pub(in crate::tangent::numbers) fn scaled(&self, c: f64) -> Self {
        Self { value: self.value * c, row: &self.row * c }
    }

    pub(in crate::tangent::numbers) fn times(&self, other: &Self) -> Self {
        let row = &self.row * other.value + &other.row * self.value;
        Self { value: self.value * other.value, row }
    }

    pub(in crate::tangent::numbers) fn over(&self, other: &Self) -> Self {
        let value = self.value / other.value;
        Self { value, row: (&self.row - &other.row * value) / other.value }
    }

    /// `|x|`.
    pub(in crate::tangent::numbers) fn magnitude(&self) -> Self {
        self.scaled(if self.value < 0.0 { -1.0 } else { 1.0 })
    }
}

/// A vector with its derivatives.
#[derive(Clone, Debug)]
pub(in crate::tangent::numbers) struct Along {
    pub(in crate::tangent::numbers) value: DVector<f64>,
    pub(in crate::tangent::numbers) slope: DMatrix<f64>,
}

impl Along {
    pub(in crate::tangent::numbers) fn zero(n: usize, columns: usize) -> Self {
        Self { value: DVector::zeros(n), slope: DMatrix::zeros(n, columns) }
    }

    /// `⟨v, w⟩`.
    pub(in crate::tangent::numbers) fn dot(&self, other: &Self) -> Number {
        let row = self.slope.tr_mul(&other.value) + other.slope.tr_mul(&self.value);
        Number { value: self.value.dot(&other.value), row }
    }

    /// `v += c w`.
    pub(in crate::tangent::numbers) fn add(&mut self, c: f64, other: &Self) {
        self.value.axpy(c, &other.value, 1.0);
        self.slope += &other.slope * c;
    }

    /// `v += c w` with a number that has derivatives.
    pub(in crate::tangent::numbers) fn add_times(&mut self, c: &Number, other: &Self) {
        self.add(c.value, other);
        self.slope.ger(1.0, &other.value, &c.row, 1.0);
    }

    pub(in crate::tangent::numbers) fn scaled(&self, c: f64) -> Self {
        Self { value: &self.value * c, slope: &self.slope * c }
    }

    pub(in crate::tangent::numbers) fn numbers(&self) -> Directions {
        Directions::of(self.value.as_slice())
    }
}

/// A matrix of a model.
pub(in crate::tangent::numbers) fn dense(matrix: &Matrix<AtRunTime>, n: usize) -> DMatrix<f64> {
    DMatrix::from_row_slice(n, n, matrix.numbers())
}

/// The column of a list.
pub(in crate::tangent::numbers) fn column(v: &Directions) -> DVector<f64> {
    DVector::from_column_slice(v.numbers())
}

/// A number for each stage.
pub(in crate::tangent::numbers) type Coefficients = [f64; STAGES];

/// A step around its root.
pub(in crate::tangent::numbers) struct Around<'a> {
    pub(in crate::tangent::numbers) parts: Parts<'a, AtRunTime>,
    pub(in crate::tangent::numbers) step: &'a StepOfModel<'a>,
    pub(in crate::tangent::numbers) tableau: &'static Tableau,
    /// The displacements `Y_i`.
    pub(in crate::tangent::numbers) displacements: Vec<DVector<f64>>,
    root: StageRoot,
}

impl<'a> Around<'a> {
    /// The step around the root of the velocities of its stages; `None` if it is not found.
    pub(in crate::tangent::numbers) fn new(
        step: &'a StepOfModel<'a>,
        tableau: &'static Tableau,
    ) -> Option<Self> {
        let &StepOfModel { model, x, end, h, stage_velocities, .. } = step;
        let root = StageRoot::new(tableau, model, ([x, end], h), stage_velocities)?;
        let displacements = root.displacements.iter().map(column).collect();
        Some(Self { parts: Parts::of(model), step, tableau, displacements, root })
    }

    /// The end of the root.
    pub(in crate::tangent::numbers) fn end(&self) -> &[f64] {
        self.root.end.as_ref()
    }

    /// The entries that are not warmed, if what is lost of the energy becomes heat.
    pub(in crate::tangent::numbers) fn still(&self) -> Option<&[bool]> {
        self.root.still.as_deref()
    }

    pub(in crate::tangent::numbers) fn n(&self) -> usize {
        self.step.x.len()
    }

    /// The number of columns.
    pub(in crate::tangent::numbers) fn columns(&self) -> usize {
        self.size_column() + 1 + self.step.parameters
    }

    /// The column of the size `h`, behind those of vectors.
    pub(in crate::tangent::numbers) fn size_column(&self) -> usize {
        self.n() * (self.tableau.stages + 1)
    }

    /// The size `h` itself.
    pub(in crate::tangent::numbers) fn size(&self) -> Number {
        let mut size = Number { value: self.step.h, ..Number::zero(self.columns()) };
        size.row[self.size_column()] = 1.0;
        size
    }

    /// The derivatives of a law and of its differential along the parameters, at a state that stays where it is.
    pub(in crate::tangent::numbers) fn along_parameters(
        &self,
        law: usize,
        x: &[f64],
    ) -> (DVector<f64>, DMatrix<f64>) {
        law_along_parameters(self.step.model, law, x, self.step.parameters)
    }

    /// Sets the columns of the parameters.
    pub(in crate::tangent::numbers) fn set_along_parameters(
        &self,
        slope: &mut DMatrix<f64>,
        along: &DMatrix<f64>,
    ) {
        slope.columns_mut(self.size_column() + 1, along.ncols()).copy_from(along);
    }

    /// The differential of a law at a state that moves by `c₀ δx + Σ_j c_j δY_j`.
    pub(in crate::tangent::numbers) fn covector(
        &self,
        (law, x): (usize, &Entries),
        moves: (f64, &Coefficients),
    ) -> Along {
        let Second { df, hf } = self.parts.second(law, x);
        let mut slope = self.spread(moves, &dense(&hf, self.n()));
        self.set_along_parameters(&mut slope, &self.along_parameters(law, x).1);
        Along { value: column(&df), slope }
    }

    /// `Σ_j c_j Y_j`.
    pub(in crate::tangent::numbers) fn combined(&self, c: &Coefficients) -> DVector<f64> {
        let zero = DVector::zeros(self.n());
        self.displacements.iter().zip(c).fold(zero, |sum, (y, c)| sum + y * *c)
    }

    /// The state `x + Σ_j c_j Y_j`.
    pub(in crate::tangent::numbers) fn state(&self, c: &Coefficients) -> Entries {
        let q = self.combined(c);
        let mut state = Entries::from(self.step.x);
        state.iter_mut().zip(q.iter()).for_each(|(x, q)| *x += q);
        state
    }

    /// The derivatives `A δ` along a motion `δ = c₀ δx + Σ_j c_j δY_j`.
    pub(in crate::tangent::numbers) fn spread(
        &self,
        (start, c): (f64, &Coefficients),
        a: &DMatrix<f64>,
    ) -> DMatrix<f64> {
        let n = self.n();
        let mut spread = DMatrix::zeros(a.nrows(), self.columns());
        let all = std::iter::once(&start).chain(c).take(self.tableau.stages + 1);
        for (block, c) in all.enumerate() {
            if *c != 0.0 {
                spread.columns_mut(block * n, n).copy_from(&(a * *c));
            }
        }
        spread
    }

    /// The displacement `Y_i`.
    pub(in crate::tangent::numbers) fn displacement(&self, i: usize) -> Along {
        let mut c = [0.0; STAGES];
        c[i] = 1.0;
        let slope = self.spread((0.0, &c), &DMatrix::identity(self.n(), self.n()));
        Along { value: self.displacements[i].clone(), slope }
    }
}
