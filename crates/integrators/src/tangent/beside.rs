//! The derivative of a step by differences of steps beside it.
//!
//! ```math
//! T' e_j = \frac{4 D_\varepsilon - D_{2\varepsilon}}{3} + O(\varepsilon^4), \qquad
//! D_\varepsilon = \frac{\Phi_h(x + \varepsilon\, T e_j) - \Phi_h(x - \varepsilon\, T e_j)}{2\varepsilon},
//! ```
//!
//! with the same size, the same random numbers and the same branch of the method. It has some ten digits, and serves each kind
//! of system with each method. The values of the laws at the start of a step beside another one are those on the way there: so the
//! first law of tangents does not drift.

use nalgebra::{DMatrix, DVector};

use super::columns::{Carried, Moved};
use super::error::Unlinearised;
use super::explicit::NEAR;
use super::part::{Again, Part, memory_before};
use super::smooth::SmoothFlow;
use crate::step::{Element, Flow, Laws, Memory as _, StepStart, Stepper, Taken, Vector as _};

/// The displacement `ε` of an entry beside a step, relative to its size. At the fifth root of round-off the errors by truncation and
/// by round-off are equal where a step bends over a size; this one is shorter, because the projection of an explicit step bends
/// over a hundredth of it where its laws are nearly dependent.
/// A factor of four fails `tests/tangents/beside.rs::derivatives_by_differences_have_ten_digits`.
const STEP: f64 = 2e-5;

/// The steps beside one that was taken.
struct Beside<'a, F: Flow, M> {
    flow: &'a F,
    method: &'a M,
    step: &'a Part<F>,
    again: &'a Again<F::Vector>,
}

/// All numbers of a vector, those of a ledger too.
pub(super) fn list<F: Flow>(v: &F::Vector) -> DVector<f64> {
    DVector::from_vec(v.to_list())
}

impl<F: SmoothFlow, M: Stepper<F>> Beside<'_, F, M> {
    /// The sizes of all directions. The clock has that of the step.
    fn sizes(&self) -> DVector<f64> {
        let Self { flow, step, again, .. } = *self;
        let [start, end] = [&step.x, &step.end].map(|x| flow.sizes(x));
        let sizes = F::Vector::zip([&again.sizes, &start, &end], |[run, a, b]| run.max(a).max(b));
        let mut sizes = list::<F>(&sizes);
        if let Some(clock) = flow.clock() {
            sizes[clock] = step.h.abs();
        }
        sizes
    }

    /// The end of the step of size `h` from another start, whose laws have these values.
    fn end(
        &self,
        x: &Element<F>,
        (time, h): (f64, f64),
        onto: impl Fn(&mut Laws<F::Numbers>),
    ) -> Result<Taken<F>, Unlinearised> {
        let Self { flow, method, step, again } = *self;
        let mut memory = memory_before::<F, M>(Some(again))?;
        let values = flow.laws(x);
        // The laws are as far from their references as those at the start. Linear ones would be off by the square of the displacement, which
        // is more than the errors that are allowed.
        let (here, run) = (flow.laws(&step.x), &step.reference);
        let mut reference = values.clone();
        reference.energy += run.energy - here.energy;
        reference.entropy += run.entropy - here.entropy;
        for k in 0..run.invariants.as_ref().len() {
            reference.invariants[k] += run.invariants[k] - here.invariants[k];
        }
        onto(&mut reference);
        let start = StepStart { flow, x, time, values, reference, allowed: step.allowed.clone() };
        let taken = method.step(&start, h, &mut memory).map_err(|_| Unlinearised::Singular)?;
        let is_alike = taken.evidence.entropy_step == step.entropy_step
            && (taken.effort.splits > 0) == step.in_parts
            && (step.stage_count.is_none() || memory.stage_count() == step.stage_count);
        if is_alike { Ok(taken) } else { Err(Unlinearised::Branch) }
    }

    /// The displacement from the end of the step that was taken.
    fn off_end(&self, taken: &Taken<F>) -> Result<DVector<f64>, Unlinearised> {
        let displacement = self.flow.between(&self.step.end, &taken.x);
        displacement.map(|d| list::<F>(&d)).ok_or(Unlinearised::Singular)
    }

    /// Refuses a step that does not end where the one that was taken does.
    fn reproduced(&self, sizes: &DVector<f64>) -> Result<(), Unlinearised> {
        let Part { x, time, h, .. } = self.step;
        let off = self.off_end(&self.end(x, (*time, *h), |_| {})?)?;
        let sized = (0..self.again.sizes.len()).filter(|i| off[*i] != 0.0);
        let off = sized.map(|i| off[i].abs() / sizes[i]).fold(0.0, f64::max);
        if off <= NEAR { Ok(()) } else { Err(Unlinearised::NotReproduced { off }) }
    }

    /// The column at the end from that at the start, and the derivative of the entropy at the end.
    fn column(
        &self,
        column: &DVector<f64>,
        laws: impl Fn(f64, &mut Laws<F::Numbers>),
        sizes: &DVector<f64>,
    ) -> Result<(DVector<f64>, Option<f64>), Unlinearised> {
        let Part { x, time, h, .. } = self.step;
        let n = self.again.sizes.len();
        // Nothing depends on what was booked before.
        let moves = |i: &usize| *i <= n && column[*i] != 0.0;
        let moving: Vec<usize> = (0..column.len()).filter(moves).collect();
        if moving.is_empty() {
            return Ok((column.clone(), None));
        }
        let sized = moving.iter().filter(|i| sizes[**i] > 0.0);
        let ratio = sized.map(|i| column[*i].abs() / sizes[*i]).fold(0.0, f64::max);
        if !(ratio > 0.0 && ratio.is_finite()) {
            return Err(Unlinearised::NoSize);
        }
        let e = STEP / ratio;
        let end = |e: f64| {
            let d = self.again.sizes.with(|i| e * column[i]);
            let shifted = time + self.flow.clock().map_or(0.0, |clock| e * column[clock]);
            self.end(&self.flow.moved(x, &d), (shifted, *h), |of| laws(e, of))
        };
        let slope = |e: f64| {
            let [after, before] = [end(e)?, end(-e)?];
            let entropy = (after.values.entropy - before.values.entropy) / (2.0 * e);
            Ok(((self.off_end(&after)? - self.off_end(&before)?) / (2.0 * e), entropy))
        };
        let [(near, rise), (wide, risen)] = [slope(e)?, slope(2.0 * e)?];
        Ok(((near * 4.0 - wide) / 3.0, Some((4.0 * rise - risen) / 3.0)))
    }

    /// The derivative along the size of the step; NaN where steps of other sizes are not alike.
    fn along_h(&self) -> DVector<f64> {
        let Part { x, time, h, .. } = self.step;
        let end = |factor: f64| self.off_end(&self.end(x, (*time, h * factor), |_| {})?);
        let slope =
            || Ok::<_, Unlinearised>((end(1.0 + STEP)? - end(1.0 - STEP)?) / (2.0 * STEP * h));
        let all = self.again.sizes.to_list().len();
        slope().unwrap_or_else(|_| DVector::from_element(all, f64::NAN))
    }
}

/// Computes the derivatives at the end of a step from those at its start.
///
/// # Errors
///
/// [`Unlinearised::Branch`] if a step beside it takes another branch of the method, and [`Unlinearised::NoSize`] if every entry that
/// moves has been zero in the run.
pub(crate) fn propagate<F: SmoothFlow, M: Stepper<F>>(
    flow: &F,
    method: &M,
    step: &Part<F>,
    carried: &Carried,
) -> Result<Moved, Unlinearised> {
    let again = step.again.as_ref().ok_or(Unlinearised::Singular)?;
    let beside = Beside { flow, method, step, again };
    let sizes = beside.sizes();
    beside.reproduced(&sizes)?;
    let mut carried = carried.clone();
    let (rows, here) = (&carried.laws, flow.law_rows(&step.x));
    let mut entropy = rows.entropy.clone();
    let mut t = DMatrix::zeros(carried.t.nrows(), carried.t.ncols());
    for j in 0..t.ncols() {
        // By as much as the derivative of each law has drifted on the way.
        let laws = |e: f64, laws: &mut Laws<F::Numbers>| {
            laws.energy += e * (rows.energy[j] - here.energy.dot(&carried.t.column(j)));
            for (k, (row, df)) in rows.invariants.iter().zip(&here.invariants).enumerate() {
                laws.invariants[k] += e * (row[j] - df.dot(&carried.t.column(j)));
            }
        };
        let column = carried.t.column(j).into_owned();
        let (column, slope) = beside.column(&column, laws, &sizes)?;
        t.set_column(j, &column);
        if let Some(slope) = slope {
            entropy[j] = slope;
        }
    }
    carried.laws.entropy = entropy;
    carried.laws.entropy_is_known = false;
    Ok(Moved { carried: Carried { t, ..carried }, along_h: beside.along_h() })
}

/// Computes the derivative of a loss along the start of a step from that along its end.
///
/// # Errors
///
/// The errors of [`propagate`].
pub(crate) fn pull_back<F: SmoothFlow, M: Stepper<F>>(
    flow: &F,
    method: &M,
    step: &Part<F>,
    costate: &DVector<f64>,
) -> Result<DVector<f64>, Unlinearised> {
    let here = Carried::start(flow.law_rows(&step.x));
    Ok(propagate(flow, method, step, &here)?.carried.t.tr_mul(costate))
}
