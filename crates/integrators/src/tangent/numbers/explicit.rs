//! The derivative of an explicit step of a model: its stages and its projection along directions.
//!
//! The text is that of [`crate::tangent`]'s explicit steps of systems in types. A stage costs one evaluation of the laws with their
//! Hessians and one of the parts with their derivatives, whatever the number of columns.

use metriplectic_dynamics::SecondLaw;
use metriplectic_equations::ENTROPY;
use nalgebra::{DMatrix, DVector};
use num_dual::Dual64;

use super::StepOfSystem;
use super::landing::{Aim, Along, Landing};
use crate::explicit::{Coefficients, Recursion, Row, Tableau};
use crate::implicit::{LawAt, Motion, laws_at};
use crate::step::EntropyStep;
use crate::tangent::columns::{Carried, Moved};
use crate::tangent::error::Unlinearised;
use crate::tangent::explicit::NEAR;

/// A number with its derivatives along all columns.
#[derive(Clone)]
pub(super) struct Number {
    pub(super) value: f64,
    pub(super) slopes: DVector<f64>,
}

/// The rates and the production of a stage.
struct Stage {
    rates: Along,
    production: Number,
}

/// A step along directions. The last column is that of the size of the step.
struct Step<'a, 'b> {
    of: &'a StepOfSystem<'b>,
    /// The directions of the start.
    starts: DMatrix<f64>,
    /// How the parameters move along them.
    parameters: DMatrix<f64>,
}

impl Number {
    fn zero(columns: usize) -> Self {
        Self { value: 0.0, slopes: DVector::zeros(columns) }
    }

    fn add(&mut self, w: f64, other: &Self) {
        self.value += w * other.value;
        self.slopes.axpy(w, &other.slopes, 1.0);
    }
}

impl Step<'_, '_> {
    /// The numbers of directions and of columns.
    fn lengths(&self) -> (usize, usize) {
        self.starts.shape()
    }

    /// `h Σ_j w_j k_j` of the rates and of the productions of stages.
    fn combined(&self, row: Row, stages: &[Stage]) -> (Along, Number) {
        let (n, columns) = self.lengths();
        let (mut q, mut p) = (Along::zero(n, columns), Number::zero(columns));
        for &(stage, w) in row {
            q.add(w, &stages[stage].rates);
            p.add(w, &stages[stage].production);
        }
        self.times_h(q, p)
    }

    /// The product with the size of the step, whose own column is the last one.
    fn times_h(&self, mut q: Along, mut p: Number) -> (Along, Number) {
        let (h, last) = (self.of.h, self.starts.ncols() - 1);
        q.slopes *= h;
        p.slopes *= h;
        q.slopes.column_mut(last).axpy(1.0, &q.value, 1.0);
        p.slopes[last] += p.value;
        q.value *= h;
        p.value *= h;
        (q, p)
    }

    /// The stage at the displacement `q`.
    fn stage(&self, q: &Along) -> Option<Stage> {
        let y: Vec<f64> = self.of.x.iter().zip(&q.value).map(|(x, q)| x + q).collect();
        let laws = laws_at(self.of.model, &y, self.of.parameters);
        if !laws.laws.iter().all(LawAt::is_finite) {
            return None;
        }
        let Motion { velocity, slope, production, rise, along, rise_along } = laws.motion(&y)?;
        let (directions, parameters) = (&self.starts + &q.slopes, &self.parameters);
        let rise = directions.tr_mul(&rise) + parameters.tr_mul(&rise_along);
        let production = Number { value: production, slopes: rise };
        let slopes = slope * directions + along * parameters;
        Some(Stage { rates: Along { value: velocity, slopes }, production })
    }

    /// The end before the projection and the production of entropy, by the rows of a tableau.
    fn by_rows(&self, tableau: &Tableau) -> Option<(Along, Number)> {
        let (n, columns) = self.lengths();
        let mut stages = vec![self.stage(&Along::zero(n, columns))?];
        for row in tableau.rows() {
            let next = self.stage(&self.combined(row, &stages).0)?;
            stages.push(next);
        }
        Some(self.combined(tableau.weights(), &stages))
    }

    /// The end before the projection and the production of entropy, by the recursion of Chebyshev with so many stages.
    fn by_recursion(&self, count: u32) -> Option<(Along, Number)> {
        let (n, columns) = self.lengths();
        let mut coefficients = Coefficients::new(count);
        let nothing = || (Along::zero(n, columns), Number::zero(columns));
        // h c k.
        let scaled = |stage: &Stage, c: f64| {
            let (mut q, mut p) = nothing();
            q.add(c, &stage.rates);
            p.add(c, &stage.production);
            self.times_h(q, p)
        };
        let first = self.stage(&nothing().0)?;
        let (mut before, mut last) = (nothing(), scaled(&first, coefficients.first));
        for _ in 2..=count {
            let Recursion { mu, nu, rate, start_rate } = coefficients.next();
            let stage = self.stage(&last.0)?;
            let (here, start) = (scaled(&stage, rate), scaled(&first, start_rate));
            let mut next = nothing();
            for ((q, p), w) in [(&last, mu), (&before, nu), (&here, 1.0), (&start, 1.0)] {
                next.0.add(w, q);
                next.1.add(w, p);
            }
            (before, last) = (last, next);
        }
        Some(last)
    }

    /// The units of the entries in which the end is moved onto the laws: an entry for each column.
    fn units(&self, end: &Along) -> Vec<Vec<Dual64>> {
        let (n, columns) = self.lengths();
        if let Some(allowed) = self.of.allowed {
            let units: Vec<Dual64> = allowed.iter().map(|unit| Dual64::from(*unit)).collect();
            return vec![units; columns];
        }
        let magnitude = |value: f64, slope: f64| {
            Dual64::new(value.abs(), if value < 0.0 { -slope } else { slope })
        };
        let unit = |i: usize, c: usize| {
            let size = magnitude(self.of.x[i], self.starts[(i, c)]);
            let end = magnitude(end.value[i], end.slopes[(i, c)]);
            if end.re > size.re { end } else { size }
        };
        (0..columns).map(|c| (0..n).map(|i| unit(i, c)).collect()).collect()
    }
}

/// Computes the derivatives at the end of a step from those at its start.
///
/// # Errors
///
/// [`Unlinearised`] if the step has no derivative, or is not the one that was taken.
pub(in crate::tangent) fn propagate(
    tableau: &Tableau,
    of: &StepOfSystem<'_>,
    carried: &Carried,
) -> Result<Moved, Unlinearised> {
    let n = of.x.len();
    let is_exact = of.model.second_law() == SecondLaw::Exact;
    let mut carried = carried.clone();
    carried.laws.entropy_is_known = is_exact;
    if of.entropy_step == Some(EntropyStep::Held) {
        return Ok(Moved { carried, along_h: DVector::zeros(n) });
    }
    let columns = carried.t.ncols();
    let whole = carried.t.clone().insert_column(columns, 0.0);
    let starts = whole.rows(0, n).into_owned();
    let parameters = whole.rows(n, of.parameters).into_owned();
    let step = Step { of, starts, parameters };
    let (end, rise) = match of.stage_count {
        Some(count) => step.by_recursion(count),
        None => step.by_rows(tableau),
    }
    .ok_or(Unlinearised::NotSmooth)?;
    // The values of the laws move along the columns, and not with the size of the step.
    let law = |value: f64, row: &DVector<f64>| -> Vec<Dual64> {
        (0..=columns).map(|c| Dual64::new(value, row.get(c).copied().unwrap_or(0.0))).collect()
    };
    let (targets, rows) = (of.targets, &carried.laws);
    let listed = targets.invariants.iter().zip(&rows.invariants);
    let rises = rise.slopes.iter().map(|slope| Dual64::new(rise.value, *slope));
    let produced: Vec<Dual64> =
        law(targets.entropy, &rows.entropy).iter().zip(rises).map(|(s, rise)| *s + rise).collect();
    let is_targeted = of.entropy_step == Some(EntropyStep::Targeted);
    let aim = Aim {
        energy: law(targets.energy, &rows.energy),
        invariants: listed.map(|(value, row)| law(*value, row)).collect(),
        entropy: is_targeted.then(|| produced.clone()),
        units: step.units(&end),
    };
    let points = Along {
        value: DVector::from_fn(n, |i, _| of.x[i] + end.value[i]),
        slopes: &step.starts + &end.slopes,
    };
    let landing = Landing { model: of.model, aim: &aim, parameters: &step.parameters };
    let landed = landing.land(points, of.end)?;
    reproduced(of, &landed.reached, &landed.rounding)?;
    carried.t.rows_mut(0, n).copy_from(&landed.slopes.columns(0, columns));
    if is_targeted {
        carried.laws.entropy = DVector::from_fn(columns, |c, _| produced[c].eps);
    } else if is_exact {
        let LawAt { df, along, .. } = &laws_at(of.model, of.end, of.parameters).laws[ENTROPY];
        let parameters = step.parameters.columns(0, columns);
        carried.laws.entropy = carried.t.rows(0, n).tr_mul(df) + parameters.tr_mul(along);
    }
    Ok(Moved { carried, along_h: landed.slopes.column(columns).into_owned() })
}

/// Refuses a step that is not the one that was taken, but for a displacement that is round-off.
fn reproduced(
    of: &StepOfSystem<'_>,
    end: &DVector<f64>,
    rounding: &DVector<f64>,
) -> Result<(), Unlinearised> {
    let off = (0..end.len()).fold(0.0, |worst: f64, i| {
        let (x, there) = (of.x[i], of.end[i]);
        let size = x.abs().max(there.abs()).max((there - x).abs());
        let off = (end[i] - there).abs();
        if off <= rounding[i] { worst } else { worst.max(off / size) }
    });
    if off <= NEAR { Ok(()) } else { Err(Unlinearised::NotReproduced { off }) }
}
