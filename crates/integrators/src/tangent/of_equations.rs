//! The derivatives of runs of systems in plain numbers.

use metriplectic_equations::judge::Judge;
use metriplectic_equations::{ENERGY, ENTROPY, Equations, Model, ModelError, Sizes};
use metriplectic_fields::Real;
use nalgebra::{DMatrix, DVector};

use super::beside::{self, NoParameters};
use super::columns::{Carried, LawRows, Moved};
use super::differentiated::Differentiated;
use super::error::Unlinearised;
use super::exact::ExactSteps;
use super::numbers::{
    Derivative, StepOfModel, collocated, explicit_propagate, is_self_adjoint, schemes,
};
use super::part::Part;
use super::smooth::SmoothFlow;
use crate::collocation::Tableau;
use crate::compiled::explicit;
use crate::explicit::ExplicitRungeKutta;
use crate::implicit::{Collocation, is_flat, law_along_parameters};
use crate::numbers::FromEquations;
use crate::step::{
    Compiled, Directions, Entries, Flow as _, Laws, PathOfStep, Stepper, Vector as _,
};
use crate::system::NO_CLOCK;

/// The values of the laws that an explicit method moves the end of a step onto.
fn targets<S: Equations>(step: &Part<FromEquations<S>>) -> Laws<Vec<f64>> {
    let Laws { energy, entropy, invariants } = &step.reference;
    let invariants = AsRef::<[f64]>::as_ref(invariants).to_vec();
    Laws { energy: *energy, entropy: *entropy, invariants }
}

/// A step in plain numbers of a system, or of its model.
fn in_numbers<'a, S: Equations, Y: ?Sized>(
    model: &'a Y,
    step: &'a Part<FromEquations<S>>,
    (targets, parameters): (&'a Laws<Vec<f64>>, usize),
) -> StepOfModel<'a, Y> {
    StepOfModel {
        model,
        x: &step.x,
        end: &step.end,
        h: step.h,
        parameters,
        allowed: step.allowed.as_ref().map(|allowed| allowed.numbers()),
        targets,
        entropy_step: step.entropy_step,
        stage_count: step.stage_count,
        stage_velocities: &step.stage_velocities,
    }
}

impl<S: Equations> SmoothFlow for FromEquations<S> {
    type Moving = Vec<Real>;

    fn directions(&self) -> usize {
        self.0.sizes().directions
    }

    fn law_rows(&self, x: &Entries) -> LawRows<DVector<f64>> {
        let Sizes { directions: n, laws, .. } = self.0.sizes();
        let (mut values, mut w) = (vec![0.0; laws], vec![0.0; laws * n]);
        self.0.differentials(NO_CLOCK, x, &mut values, &mut w);
        let row = |law: usize| DVector::from_column_slice(&w[law * n..][..n]);
        LawRows::new(row(ENERGY), row(ENTROPY), (ENTROPY + 1..laws).map(row).collect())
    }

    fn turn(&self, from: &Entries, to: &Entries) -> Option<DMatrix<f64>> {
        if self.0.is_vector_space() || from == to {
            return None;
        }
        let (n, steps) = (self.directions(), self.steps_of_chart(to));
        let column = |k: usize| {
            let step = steps[k];
            let at = |step: f64| {
                let d = Directions::from_index(n, |i| if i == k { step } else { 0.0 });
                DVector::from_vec(self.coordinates_at(to, &self.moved(from, &d)))
            };
            (at(step) - at(-step)) / (2.0 * step)
        };
        Some(DMatrix::from_columns(&(0..n).map(column).collect::<Vec<_>>()))
    }

    /// In `⌈n/2⌉` evaluations on a vector space, and by differences of the function along the entries elsewhere.
    fn differential(&self, f: &dyn Fn(&Vec<Real>) -> Real, x: &Entries) -> (f64, DVector<f64>) {
        let (mut along_entries, mut value) = (DVector::zeros(x.len()), 0.0);
        for i in (0..x.len()).step_by(2) {
            let along = |k: usize, direction: usize| if k == direction { 1.0 } else { 0.0 };
            let seeded = |(k, x): (usize, &f64)| Real::new(*x, along(k, i), along(k, i + 1), 0.0);
            let there = f(&x.iter().enumerate().map(seeded).collect());
            value = there.re;
            along_entries[i] = there.eps1;
            if let Some(next) = along_entries.get_mut(i + 1) {
                *next = there.eps2;
            }
        }
        if self.0.is_vector_space() {
            return (value, along_entries);
        }
        let slope = |k: usize, _| along_entries.dot(&self.entries_along(x, k));
        (value, DVector::from_fn(self.directions(), slope))
    }

    fn moving(&self, x: &Entries, v: &DVector<f64>) -> Vec<Real> {
        let along = if self.0.is_vector_space() {
            v.clone()
        } else {
            let columns = (0..v.len()).map(|k| self.entries_along(x, k) * v[k]);
            columns.fold(DVector::zeros(x.len()), |sum, column| sum + column)
        };
        x.iter().zip(&along).map(|(x, v)| Real::new(*x, *v, 0.0, 0.0)).collect()
    }

    fn coordinates(&self, y: &Entries, there: &Vec<Real>) -> Vec<[f64; 2]> {
        if self.0.is_vector_space() {
            return y.iter().zip(there).map(|(y, there)| [there.re - y, there.eps1]).collect();
        }
        let at = |e: f64| {
            let z: Vec<f64> = there.iter().map(|there| there.re + e * there.eps1).collect();
            self.coordinates_at(y, &z)
        };
        let size = there.iter().fold(0.0, |most: f64, there| most.max(there.re.abs()));
        let sized = |there: &Real| if there.re == 0.0 { size } else { there.re.abs() };
        let largest =
            there.iter().fold(0.0, |most: f64, there| most.max(there.eps1.abs() / sized(there)));
        let step = if largest > 0.0 { f64::EPSILON.cbrt() / largest } else { 1.0 };
        let slopes = at(step).into_iter().zip(at(-step)).map(|(a, b)| (a - b) / (2.0 * step));
        at(0.0).into_iter().zip(slopes).map(|(q, slope)| [q, slope]).collect()
    }

    fn exact_steps(&self) -> Option<&dyn ExactSteps<Self>> {
        Some(self)
    }
}

impl<S: Equations> FromEquations<S> {
    /// The coordinates of a state in the chart at another one; NaN where they are not known.
    fn coordinates_at(&self, at: &[f64], y: &[f64]) -> Vec<f64> {
        let mut q = vec![0.0; self.directions()];
        if !self.0.coordinates(at, y, &mut q) {
            q.fill(f64::NAN);
        }
        q
    }

    /// The steps of differences of the chart at a state: fractions of the sizes of the directions, or of the largest one.
    fn steps_of_chart(&self, x: &Entries) -> Vec<f64> {
        let sizes = self.sizes(x).to_list();
        let largest = sizes.iter().copied().fold(0.0, f64::max);
        let largest = if largest > 0.0 { largest } else { 1.0 };
        let step = |size: f64| f64::EPSILON.cbrt() * if size > 0.0 { size } else { largest };
        sizes.into_iter().map(step).collect()
    }

    /// The derivative of the entries along a direction of the chart at a state.
    fn entries_along(&self, x: &Entries, k: usize) -> DVector<f64> {
        let step = self.steps_of_chart(x)[k];
        let at = |step: f64| {
            let d = Directions::from_index(self.directions(), |i| if i == k { step } else { 0.0 });
            DVector::from_column_slice(&self.moved(x, &d))
        };
        (at(step) - at(-step)) / (2.0 * step)
    }
}

/// How the derivatives of the steps of a method are formed.
enum Exactly<'a> {
    /// By its stages and its projection.
    Explicit(ExplicitRungeKutta),
    /// From both ends.
    Midpoint(&'a dyn Model, PathOfStep),
    /// At the root for its stages.
    Stages(&'a dyn Model, &'static Tableau),
}

impl<S: Equations> FromEquations<S> {
    /// How the steps of a method are differentiated; `None` for other steps beside them.
    fn exactly(&self, method: Option<Compiled>) -> Option<Exactly<'_>> {
        let method = method.filter(|_| self.0.is_vector_space())?;
        let known = self.0.model();
        let model = known.filter(|model| is_flat(*model));
        // Friction is kept off further invariants in the metric.
        let is_plain = known.is_none() || model.is_some() || self.0.sizes().laws == 2;
        let stages = |method: Option<Collocation>| Some(Exactly::Stages(model?, method?.tableau));
        match method {
            Compiled::Explicit(_) => explicit(method).filter(|_| is_plain).map(Exactly::Explicit),
            Compiled::Midpoint { line, .. } if is_self_adjoint(line) => {
                Some(Exactly::Midpoint(model?, line))
            }
            Compiled::Midpoint { .. } => None,
            Compiled::Gauss { stages: count } => stages(Collocation::gauss(count)),
            Compiled::Radau { stages: count } => stages(Collocation::radau(count)),
        }
    }
}

impl<S: Equations> ExactSteps<Self> for FromEquations<S> {
    fn has_steps(&self, method: Option<Compiled>) -> bool {
        self.exactly(method).is_some()
    }

    fn known_parameters(&self) -> usize {
        let known = self.0.model().filter(|model| !model.has_derivatives_by_differences());
        known.map_or(0, Model::parameters)
    }

    fn rows(&self, x: &Entries, parameters: usize) -> LawRows<DVector<f64>> {
        let mut rows = self.law_rows(x);
        let Some(model) = self.0.model().filter(|_| parameters > 0) else { return rows };
        let extend = |row: &mut DVector<f64>, law: usize| {
            let (along, _) = law_along_parameters(model, law, x, parameters);
            *row =
                DVector::from_iterator(row.len() + parameters, row.iter().chain(&along).copied());
        };
        extend(&mut rows.energy, ENERGY);
        extend(&mut rows.entropy, ENTROPY);
        rows.invariants.iter_mut().enumerate().for_each(|(k, row)| extend(row, ENTROPY + 1 + k));
        rows
    }

    fn carry(
        &self,
        method: Option<Compiled>,
        step: &Part<Self>,
        carried: &Carried,
    ) -> Result<Moved, Unlinearised> {
        let n = self.directions();
        let count = carried.t.nrows() - n;
        let targets = (&targets(step), count);
        let derivative = match self.exactly(method).ok_or(Unlinearised::Singular)? {
            Exactly::Explicit(method) => {
                let of = in_numbers(&self.0 as &dyn Equations, step, targets);
                return explicit_propagate(method.tableau(), &of, carried);
            }
            Exactly::Midpoint(model, line) => {
                schemes::derivative(&in_numbers(model, step, targets), line)
            }
            Exactly::Stages(model, tableau) => {
                collocated::derivative(&in_numbers(model, step, targets), tableau)
            }
        };
        let Derivative { along_x, along_parameters, along_h } = derivative?;
        let mut next = carried.clone();
        let moved = along_x * carried.t.rows(0, n) + along_parameters * carried.t.rows(n, count);
        next.t.rows_mut(0, n).copy_from(&moved);
        Ok(Moved { carried: next, along_h })
    }

    fn pull(
        &self,
        method: Option<Compiled>,
        step: &Part<Self>,
        costate: &DVector<f64>,
    ) -> Result<DVector<f64>, Unlinearised> {
        let n = self.directions();
        let count = costate.len() - n;
        let (targets, row) = ((&targets(step), count), &costate.as_slice()[..n]);
        let (start, along) = match self.exactly(method).ok_or(Unlinearised::Singular)? {
            Exactly::Midpoint(model, line) => {
                schemes::pull_back(&in_numbers(model, step, targets), line, row)
            }
            Exactly::Stages(model, tableau) => {
                collocated::pull_back(&in_numbers(model, step, targets), tableau, row)
            }
            Exactly::Explicit(_) => {
                let here = Carried::start(self.rows(&step.x, count));
                return Ok(self.carry(method, step, &here)?.carried.t.tr_mul(costate));
            }
        }?;
        let along = along + costate.rows(n, count);
        Ok(DVector::from_iterator(n + count, start.iter().chain(&along).copied()))
    }

    fn entropy_error(
        &self,
        method: Option<Compiled>,
        step: &Part<Self>,
        column: [&DVector<f64>; 2],
    ) -> Option<f64> {
        let targets = (&targets(step), column[0].len() - self.directions());
        let column = column.map(|column| column.as_slice());
        match self.exactly(method)? {
            Exactly::Explicit(_) => None,
            Exactly::Midpoint(model, line) => {
                schemes::entropy_law(&in_numbers(model, step, targets), line, column)
            }
            Exactly::Stages(model, tableau) => {
                collocated::entropy_law(&in_numbers(model, step, targets), tableau, column)
            }
        }
    }

    fn check_parameters(
        &self,
        x: &Entries,
        values: &[f64],
        displaced: &dyn Fn(&[f64]) -> Option<Self>,
    ) -> Result<(), ModelError> {
        let beside = |by: &[f64], f: &mut dyn FnMut(&dyn Model)| {
            displaced(by).is_some_and(|flow| flow.0.model().map(f).is_some())
        };
        Judge::of(&self.0, NO_CLOCK).check_parameters(x, values, &beside)
    }
}

/// The derivatives are exact on a [model](metriplectic_equations::Model) on a vector space with the canonical metric; to two thirds of the digits where it has
/// [differences](metriplectic_equations::Differences), and for explicit methods where its parts are not known apart. Other
/// methods and spaces have them by differences of steps: to some ten digits, and to eight or nine where the charts of a curved space are
/// known by their values alone ([`ByCharts`](metriplectic_equations::ByCharts)).
impl<S: Equations, M: Stepper<Self>> Differentiated<M> for FromEquations<S> {
    type MovingWide = Vec<Real>;

    fn takes_steps_beside(&self, method: &M) -> bool {
        !self.has_steps(method.compiled())
    }

    fn propagate(
        &self,
        method: &M,
        step: &Part<Self>,
        carried: &Carried,
    ) -> Result<Moved, Unlinearised> {
        let compiled = method.compiled();
        if self.has_steps(compiled) {
            self.carry(compiled, step, carried)
        } else {
            beside::propagate((self, method, &NoParameters), step, carried)
        }
    }

    fn pull_back(
        &self,
        method: &M,
        step: &Part<Self>,
        costate: &DVector<f64>,
    ) -> Result<DVector<f64>, Unlinearised> {
        let compiled = method.compiled();
        if self.has_steps(compiled) {
            self.pull(compiled, step, costate)
        } else {
            beside::pull_back((self, method, &NoParameters), step, costate)
        }
    }

    fn second_law_error(
        &self,
        method: &M,
        step: &Part<Self>,
        column: [&DVector<f64>; 2],
    ) -> Option<f64> {
        self.entropy_error(method.compiled(), step, column)
    }

    fn moved_along(&self, x: &Entries, v: &DVector<f64>) -> Vec<Real> {
        self.moving(x, v)
    }

    fn coordinates_around(&self, y: &Entries, there: &Vec<Real>) -> Vec<[f64; 2]> {
        SmoothFlow::coordinates(self, y, there)
    }
}
