//! The derivative of a step by differences of steps beside it.
//!
//! ```math
//! T' e_j = \frac{r^2 D_\varepsilon - D_{r\varepsilon}}{r^2 - 1} + O(\varepsilon^4), \qquad
//! D_\varepsilon = \frac{\Phi_h(x + \varepsilon\, T e_j) - \Phi_h(x - \varepsilon\, T e_j)}{2\varepsilon},
//! ```
//!
//! with the same size, the same random numbers and the same branch of the method. It has some ten digits, and serves each kind
//! of system with each method. Where the charts of a curved space are known by their values alone
//! ([`ByCharts`](metriplectic_equations::ByCharts)), it has eight or nine. `ε` is a fraction of the sizes of what is displaced. Where the two
//! quotients differ, it is smaller; where the other entries hardly respond, because an entry is small beside the distance over which the
//! step bends, it is larger.
//!
//! The values of the laws at the start of a step beside another one are those on the way there: so the first law of tangents does not
//! drift.

use nalgebra::{DMatrix, DVector};

use super::certificate::worse;
use super::columns::{Carried, LawRows, Moved};
use super::error::Unlinearised;
use super::explicit::NEAR;
use super::part::{Again, Part, memory_before};
use super::smooth::SmoothFlow;
use crate::round_off::bound::SUMMED;
use crate::step::{Element, Flow, Laws, Memory as _, StepStart, Stepper, Taken, Vector as _};

/// The displacement `ε` of an entry beside a step, relative to its size. At the fifth root of round-off the errors by truncation and
/// by round-off are equal where a step bends over a size; this one is shorter, because the projection of an explicit step bends
/// over a hundredth of it where its laws are nearly dependent.
/// A factor of four fails `tests/tangents/beside.rs::derivatives_by_differences_have_ten_digits`.
const STEP: f64 = 2e-5;
/// The ratio `r` of the displacements of the two pairs of steps.
const RATIO: f64 = 16.0;
/// The difference of their quotients, relative to one of them, above which nearer steps are taken.
const BENT: f64 = 3e-4;
/// The response of the other entries, relative to that of the one whose size bounds the displacement, below which farther steps
/// are tried.
const WEAK: f64 = 1e-2;
/// How often nearer or farther steps are tried.
const TRIES: usize = 12;
/// The displacement of a parameter, relative to its value.
const WIDE: f64 = 0.1;
/// The shortest displacement of a time, in its roundings.
const INSTANT: f64 = 1024.0 * f64::EPSILON;

/// The round-off of differences of the laws, relative to their terms and to the size of a direction.
pub(super) fn rounding() -> f64 {
    16.0 * f64::EPSILON / STEP
}

/// The displacement of a parameter with this value.
pub(super) fn displacement(value: f64) -> f64 {
    STEP * value.abs()
}

/// The parameters of a system, and the systems beside it.
pub(super) trait Parameters<F> {
    /// Returns the values of the parameters.
    fn values(&self) -> &[f64];

    /// Builds the system whose parameters are displaced by these numbers.
    ///
    /// # Errors
    ///
    /// [`Unlinearised::NoSystem`] if the closure of the system refuses them.
    fn displaced(&self, by: &[f64]) -> Result<F, Unlinearised>;

    /// Computes the differentials of the laws in all directions, if those along the parameters are known.
    fn known_rows(&self, x: &Element<F>) -> Option<LawRows<DVector<f64>>>
    where
        F: Flow,
    {
        let _ = x;
        None
    }
}

/// The parameters of a system without parameters.
pub(super) struct NoParameters;

impl<F> Parameters<F> for NoParameters {
    fn values(&self) -> &[f64] {
        &[]
    }

    fn displaced(&self, _: &[f64]) -> Result<F, Unlinearised> {
        Err(Unlinearised::NoSystem)
    }
}

/// A flow with a method and the parameters of its system.
pub(super) type Moving<'a, F, M> = (&'a F, &'a M, &'a dyn Parameters<F>);

/// The steps beside one that was taken.
struct Beside<'a, F: Flow, M> {
    flow: &'a F,
    method: &'a M,
    parameters: &'a dyn Parameters<F>,
    step: &'a Part<F>,
    again: &'a Again<F::Vector>,
}

/// All numbers of a vector, those of a ledger too.
pub(super) fn list<F: Flow>(v: &F::Vector) -> DVector<f64> {
    DVector::from_vec(v.to_list())
}

impl<F: SmoothFlow, M: Stepper<F>> Beside<'_, F, M> {
    /// The sizes of all directions. The clock has that of the whole step.
    fn sizes(&self) -> DVector<f64> {
        let Self { flow, step, again, .. } = *self;
        let [start, end] = [&step.x, &step.end].map(|x| flow.sizes(x));
        let sizes = F::Vector::zip([&again.sizes, &start, &end], |[run, a, b]| run.max(a).max(b));
        let mut sizes = list::<F>(&sizes);
        // An entry that has been zero has the size of the largest one.
        let mut point = sizes.rows_mut(0, again.sizes.len());
        let largest = point.max();
        point.iter_mut().filter(|size| **size == 0.0).for_each(|size| *size = largest);
        if let Some(clock) = flow.clock() {
            sizes[clock] = again.whole.abs();
        }
        let (n, values) = (sizes.len(), self.parameters.values());
        sizes = sizes.resize_vertically(n + values.len(), 0.0);
        values.iter().enumerate().for_each(|(k, value)| sizes[n + k] = value.abs());
        sizes
    }

    /// The end of the step of size `h` of a flow from another start, whose laws have these values.
    fn end(
        &self,
        flow: &F,
        x: &Element<F>,
        (time, h): (f64, f64),
        onto: impl Fn(&mut Laws<F::Numbers>),
    ) -> Result<Taken<F>, Unlinearised> {
        let Self { method, step, again, .. } = *self;
        let mut memory = memory_before::<F, M>(Some(again))?;
        let values = flow.laws(x);
        // The laws are as far from their references as those at the start. Linear ones would be off by the square of the displacement, which
        // is more than the errors that are allowed.
        let (here, run) = (self.flow.laws(&step.x), &step.reference);
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
        let off = self.off_end(&self.end(self.flow, x, (*time, *h), |_| {})?)?;
        let sized = (0..self.again.sizes.len()).filter(|i| off[*i] != 0.0);
        let off = sized.map(|i| off[i].abs() / sizes[i]).fold(0.0, f64::max);
        if off <= NEAR { Ok(()) } else { Err(Unlinearised::NotReproduced { off }) }
    }

    /// The column at the end from that at the start.
    fn column(
        &self,
        column: &DVector<f64>,
        laws: impl Fn(f64, &mut Laws<F::Numbers>),
        sizes: &DVector<f64>,
    ) -> Result<DVector<f64>, Unlinearised> {
        let n = self.flow.directions();
        let relative = |v: &DVector<f64>, i: usize| {
            // Nothing depends on what was booked before.
            let is_booked =
                (self.again.sizes.len()..n).contains(&i) && self.flow.clock() != Some(i);
            if is_booked || sizes[i] == 0.0 { 0.0 } else { v[i].abs() / sizes[i] }
        };
        let norm = |v: &DVector<f64>| (0..v.len()).map(|i| relative(v, i)).fold(0.0, worse);
        let ratio = norm(column);
        if ratio == 0.0 {
            let moves = |i: usize| i < self.again.sizes.len() && column[i] != 0.0;
            let is_unsized = (0..column.len()).any(moves);
            return if is_unsized { Err(Unlinearised::NoSize) } else { Ok(column.clone()) };
        }
        let mut e = STEP / ratio;
        if let Some(clock) = self.flow.clock().filter(|clock| column[*clock] != 0.0) {
            e = e.max(INSTANT * self.step.time.abs() / column[clock].abs());
        }
        let slope = |e: f64| self.quotient(column, e, &laws);
        let apart = |a: &DVector<f64>, b: &DVector<f64>| norm(&(a - b));
        let (mut near, mut far) = (slope(e), slope(RATIO * e));
        for tries in 0.. {
            match (&near, &far) {
                (Ok(near), Ok(far)) if apart(near, far) <= BENT * norm(near) => break,
                (Err(cause), _) if tries == TRIES => return Err(*cause),
                (Ok(_), _) if tries == TRIES => return Err(Unlinearised::Bent),
                _ => {}
            }
            e /= RATIO;
            far = std::mem::replace(&mut near, slope(e));
        }
        let (mut near, mut far) = (near?, far?);
        // Where a small entry bounds the displacement, round-off hides the response of the others.
        let bounds = (0..column.len()).find(|i| relative(column, *i) >= ratio);
        let others = |v: &DVector<f64>| {
            (0..n).filter(|i| Some(*i) != bounds).map(|i| relative(v, i)).fold(0.0, f64::max)
        };
        let error = |near: &DVector<f64>, far: &DVector<f64>, e: f64| apart(near, far) + SUMMED / e;
        let values = self.parameters.values();
        let along = (0..values.len()).map(|k| relative(column, n + k)).fold(0.0, f64::max);
        for _ in 0..TRIES {
            if others(&far) > WEAK * ratio || along * e * RATIO * RATIO > WIDE {
                break;
            }
            let Ok(farther) = slope(RATIO * RATIO * e) else { break };
            let is_better = error(&far, &farther, RATIO * e) < error(&near, &far, e);
            if !is_better {
                break;
            }
            (near, far, e) = (far, farther, RATIO * e);
        }
        Ok((near * (RATIO * RATIO) - far) / (RATIO * RATIO - 1.0))
    }

    /// The central difference quotient along a column.
    fn quotient(
        &self,
        column: &DVector<f64>,
        e: f64,
        laws: impl Fn(f64, &mut Laws<F::Numbers>),
    ) -> Result<DVector<f64>, Unlinearised> {
        let Part { x, time, h, .. } = self.step;
        let n = self.flow.directions();
        let late = self.flow.clock().map_or(0.0, |clock| column[clock]);
        // The displacement that a time has after rounding.
        let e = if late == 0.0 { e } else { ((time + e * late) - time) / late };
        let parameters = column.rows(n, column.len() - n);
        let end = |e: f64| {
            let other = if parameters.iter().any(|along| *along != 0.0) {
                Some(self.parameters.displaced((parameters * e).as_slice())?)
            } else {
                None
            };
            let flow = other.as_ref().unwrap_or(self.flow);
            let d = self.again.sizes.with(|i| e * column[i]);
            let end =
                self.end(flow, &flow.moved(x, &d), (time + e * late, *h), |of| laws(e, of))?;
            self.off_end(&end)
        };
        let mut slope = ((end(e)? - end(-e)?) / (2.0 * e)).resize_vertically(column.len(), 0.0);
        // Time goes on, and nothing moves the parameters.
        for i in self.flow.clock().into_iter().chain(n..column.len()) {
            slope[i] = column[i];
        }
        Ok(slope)
    }

    /// The derivative along the size of the step; NaN where steps of other sizes are not alike.
    fn along_h(&self) -> DVector<f64> {
        let Self { flow, step, again, .. } = *self;
        let Part { x, time, h, .. } = step;
        let by = STEP * again.whole;
        let end = |h: f64| self.off_end(&self.end(flow, x, (*time, h), |_| {})?);
        let slope = || Ok::<_, Unlinearised>((end(h + by)? - end(h - by)?) / (2.0 * by));
        let known = if h.abs() > 2.0 * by.abs() && !again.is_still {
            slope().ok()
        } else {
            // So short a step is one along the velocity, and one of another size may end beyond a corner.
            let still = flow.sizes(&step.end).zero();
            flow.rates(&step.end, &still).map(|rates| list::<F>(&rates))
        };
        let mut along_h =
            known.unwrap_or_else(|| DVector::from_element(flow.directions(), f64::NAN));
        if let Some(clock) = flow.clock() {
            along_h[clock] = 1.0;
        }
        along_h
    }
}

/// Computes the differentials of the laws along the state and along the parameters, by differences where these are not known.
///
/// # Errors
///
/// [`Unlinearised::NoSystem`] if there is no system beside it.
pub(super) fn law_rows<F: SmoothFlow>(
    flow: &F,
    parameters: &dyn Parameters<F>,
    x: &Element<F>,
) -> Result<LawRows<DVector<f64>>, Unlinearised> {
    if let Some(rows) = parameters.known_rows(x) {
        return Ok(rows);
    }
    let (n, values) = (flow.directions(), parameters.values());
    let rows = flow.law_rows(x);
    let mut rows = rows.map(|row| row.clone().resize_vertically(n + values.len(), 0.0));
    for (k, value) in values.iter().enumerate() {
        let laws = |e: f64| {
            let by = DVector::from_fn(values.len(), |i, _| if i == k { e } else { 0.0 });
            let Laws { energy, entropy, invariants } = parameters.displaced(by.as_slice())?.laws(x);
            let laws = [energy, entropy].into_iter().chain(invariants.as_ref().iter().copied());
            Ok(DVector::from_iterator(2 + invariants.as_ref().len(), laws))
        };
        let slope = |e: f64| Ok((laws(e)? - laws(-e)?) / (2.0 * e));
        let e = displacement(*value);
        let slope = (slope(e)? * 4.0 - slope(2.0 * e)?) / 3.0;
        rows.set(n + k, slope[0], slope[1]);
        rows.invariants.iter_mut().zip(&slope.as_slice()[2..]).for_each(|(row, s)| row[n + k] = *s);
    }
    Ok(rows)
}

/// Computes the derivatives at the end of a step from those at its start.
///
/// # Errors
///
/// [`Unlinearised::Branch`] if a step beside it takes another branch of the method, and [`Unlinearised::NoSize`] if every entry that
/// moves has been zero in the run.
pub(crate) fn propagate<F: SmoothFlow, M: Stepper<F>>(
    (flow, method, parameters): Moving<'_, F, M>,
    step: &Part<F>,
    carried: &Carried,
) -> Result<Moved, Unlinearised> {
    let again = step.again.as_ref().ok_or(Unlinearised::Singular)?;
    let beside = Beside { flow, method, parameters, step, again };
    let sizes = beside.sizes();
    beside.reproduced(&sizes)?;
    let carried = carried.clone();
    let (rows, here) = (&carried.laws, law_rows(flow, parameters, &step.x)?);
    let mut t = DMatrix::zeros(carried.t.nrows(), carried.t.ncols());
    let still = flow.clock().filter(|_| again.is_still);
    for j in 0..t.ncols() {
        // By as much as the derivative of each law has drifted on the way.
        let laws = |e: f64, laws: &mut Laws<F::Numbers>| {
            laws.energy += e * (rows.energy[j] - here.energy.dot(&carried.t.column(j)));
            for (k, (row, df)) in rows.invariants.iter().zip(&here.invariants).enumerate() {
                laws.invariants[k] += e * (row[j] - df.dot(&carried.t.column(j)));
            }
        };
        let mut column = carried.t.column(j).into_owned();
        if let Some(clock) = still {
            column[clock] = 0.0;
        }
        t.set_column(j, &beside.column(&column, laws, &sizes)?);
    }
    Ok(Moved { carried: Carried { t, ..carried }, along_h: beside.along_h() })
}

/// Computes the derivative of a loss along the start of a step from that along its end.
///
/// # Errors
///
/// The errors of [`propagate`].
pub(crate) fn pull_back<F: SmoothFlow, M: Stepper<F>>(
    of: Moving<'_, F, M>,
    step: &Part<F>,
    costate: &DVector<f64>,
) -> Result<DVector<f64>, Unlinearised> {
    let (flow, _, parameters) = of;
    let here = Carried::start(law_rows(flow, parameters, &step.x)?);
    Ok(propagate(of, step, &here)?.carried.t.tr_mul(costate))
}
