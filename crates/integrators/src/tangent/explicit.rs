//! The tangent of an explicit step: its stages and its projection along directions.
//!
//! A stage costs one evaluation of the second derivatives of `H`, `S` and `L_a`, whatever the number of columns, and one of the
//! tensors with their derivatives. The columns are those of the tangent, and one along the size of the step; a parameter
//! of the fields moves no direction of the state by itself.
//!
//! The step size, the branch of the step (targeted or free) and the errors that were allowed are those of the step that was taken.

use metriplectic_dynamics::system::Point;
use metriplectic_dynamics::{Metriplectic, SecondLaw};
use metriplectic_fields::{Column as _, Dimension as _, ScalarField, Space, Square as _, Vector};
use metriplectic_manifolds::{Manifold, MovingBase};
use num_dual::Dual64;

use super::columns::Columns;
use super::duals::{Direction, Dual, Fields, Numbers, derivative};
use super::error::Unlinearised;
use super::landing::{Aim, Landed, Landing};
use super::linearised::{Linearised, Piece, Propagated, Targets};
use super::model::{Model, Plain};
use crate::explicit::{
    CHEBYSHEV, Coefficients, DormandPrince5, DormandPrince8, ExplicitRungeKutta, Recursion, Row,
    RungeKuttaChebyshev, Tableau,
};
use crate::step::{Dim, EntropyStep};

/// Components with their derivatives along all columns.
struct Along<V> {
    value: V,
    slopes: Vec<V>,
}

/// The end of a step and its production, along the columns.
type StagesAlong<Y> = (Along<Vector<<Y as Metriplectic>::Manifold>>, Along<f64>);

/// The rates and the production of a stage.
struct Stage<Y: Metriplectic> {
    rates: Along<Vector<Y::Manifold>>,
    production: Along<f64>,
}

/// A step along directions.
struct Step<'a, K: Model> {
    model: &'a K,
    piece: &'a Piece<'a, K::System>,
    /// The directions of the start, for each column; the last one is that of the size of the step.
    starts: Vec<Direction<K::System>>,
}

/// Directions: of the start and the parameters, and of the values of the laws.
struct Directions<Y: Metriplectic> {
    starts: Vec<Direction<Y>>,
    energy: Numbers,
    invariants: Vec<Numbers>,
    entropy: Numbers,
}

impl<Y: Metriplectic> Directions<Y> {
    /// Takes the columns of a tangent, and one along the size of the step, which moves no law.
    fn of<W: Metriplectic>(columns: &Columns<W>, targets: &Targets<Y>) -> Self {
        let (n, all) = (Dim::<Y>::LEN, Dim::<W>::LEN);
        let law = |value: f64, row: &Vector<W::Manifold>| -> Numbers {
            (0..=all).map(|c| Dual64::new(value, if c < all { row[c] } else { 0.0 })).collect()
        };
        let laws = &columns.laws;
        let listed = targets.invariants.as_ref().iter().zip(&laws.invariants);
        let column = |c: usize| Direction {
            delta: Vector::<Y::Manifold>::from_index(|i| columns.t[(i, c)]),
            parameter: c.checked_sub(n),
        };
        let still = Direction { delta: Vector::<Y::Manifold>::zero(), parameter: None };
        Self {
            starts: (0..all).map(column).chain([still]).collect(),
            energy: law(targets.energy, &laws.energy),
            invariants: listed.map(|(value, row)| law(*value, row)).collect(),
            entropy: law(targets.entropy, &laws.entropy),
        }
    }
}

/// The end of a step in the frame of the one that was taken, column by column, and the entropy that was produced.
struct Ended<Y: Metriplectic> {
    columns: Vec<Vector<Y::Manifold>>,
    produced: Numbers,
}

/// Components that move along a column.
fn dual<Y: Metriplectic>(value: &Vector<Y::Manifold>, slope: &Vector<Y::Manifold>) -> Dual<Y> {
    Dual::<Y>::from_index(|i| Dual64::new(value[i], slope[i]))
}

/// The sum of numbers with weights, times the size of the step, whose own column is the last one.
fn weighted(terms: &[(&Along<f64>, f64)], h: f64, columns: usize) -> Along<f64> {
    let sum = |of: &dyn Fn(&Along<f64>) -> f64| terms.iter().map(|(a, w)| of(a) * w).sum::<f64>();
    let value = sum(&|a| a.value);
    let mut slopes: Vec<f64> = (0..columns).map(|c| sum(&|a| a.slopes[c]) * h).collect();
    if let Some(last) = slopes.last_mut() {
        *last += value;
    }
    Along { value: value * h, slopes }
}

impl<K, Y> Step<'_, K>
where
    Y: Metriplectic<Manifold: MovingBase>,
    K: Model<System = Y>,
{
    /// `h Σ_j w_j k_j`.
    fn combined(&self, row: Row, stages: &[Stage<Y>]) -> Along<Vector<Y::Manifold>> {
        let h = self.piece.h;
        let zero = Vector::<Y::Manifold>::zero();
        let mut sum = Along { value: zero, slopes: vec![zero; self.starts.len()] };
        for &(stage, w) in row {
            let rates = &stages[stage].rates;
            sum.value += rates.value * w;
            let factor = h * w;
            for (slope, rate) in sum.slopes.iter_mut().zip(&rates.slopes) {
                *slope += *rate * factor;
            }
        }
        // The last column is that of the size.
        if let Some(last) = sum.slopes.last_mut() {
            *last += sum.value;
        }
        sum.value = sum.value * h;
        sum
    }

    /// The stage at the coordinates `q`.
    fn stage(&self, q: &Along<Vector<Y::Manifold>>) -> Option<Stage<Y>> {
        let (x, system) = (self.piece.x, self.model.system());
        let fields = Fields::at(self.model, Y::Manifold::stage(x, &q.value))?;
        let motion = fields.motion(system)?;
        let (zero, count) = (Vector::<Y::Manifold>::zero(), self.starts.len());
        let mut rates = Along { value: zero, slopes: Vec::with_capacity(count) };
        let mut production = Along { value: 0.0, slopes: Vec::with_capacity(count) };
        for (start, slope) in self.starts.iter().zip(&q.slopes) {
            let rate = if Y::Manifold::RATES_ARE_VELOCITIES {
                let direction = Direction { delta: start.delta + *slope, ..*start };
                let (v, rise) = fields.moved(system, &motion, &direction)?;
                (v, rise)
            } else {
                let q = dual::<Y>(&q.value, slope);
                let y = Y::Manifold::stage_from(x, &start.delta, &q);
                let delta = derivative(&Y::Manifold::coordinates(&fields.y, &y));
                let direction = Direction { delta, ..*start };
                let (v, rise) = fields.moved(system, &motion, &direction)?;
                let velocity = fields.embedded(&delta, &v);
                (Y::Manifold::stage_rates_from((x, &start.delta), (&q, &y), &velocity), rise)
            };
            let (rate, rise) = rate;
            (rates.value, production.value) = (rate.real(), rise.re);
            rates.slopes.push(derivative(&rate));
            production.slopes.push(rise.eps);
        }
        Some(Stage { rates, production })
    }

    /// The stage at the start.
    fn first(&self) -> Option<Stage<Y>> {
        let zero = Vector::<Y::Manifold>::zero();
        self.stage(&Along { value: zero, slopes: vec![zero; self.starts.len()] })
    }

    /// The end before the projection and the production of entropy, by the rows of a tableau.
    fn by_rows(&self, tableau: &Tableau) -> Option<StagesAlong<Y>> {
        let mut stages = vec![self.first()?];
        for row in tableau.rows() {
            let next = self.stage(&self.combined(row, &stages))?;
            stages.push(next);
        }
        let weights = tableau.weights();
        let terms: Vec<_> = weights.iter().map(|&(j, w)| (&stages[j].production, w)).collect();
        let produced = weighted(&terms, self.piece.h, self.starts.len());
        Some((self.combined(weights, &stages), produced))
    }

    /// The end before the projection and the production of entropy, by the recursion of Chebyshev with so many stages.
    fn by_recursion(&self, count: u32) -> Option<StagesAlong<Y>> {
        let (h, columns) = (self.piece.h, self.starts.len());
        let first = self.first()?;
        let mut coefficients = Coefficients::new(count);
        let zero = Vector::<Y::Manifold>::zero();
        let nothing = || {
            let q = Along { value: zero, slopes: vec![zero; columns] };
            (q, Along { value: 0.0, slopes: vec![0.0; columns] })
        };
        // h c k, where the size moves along the last column.
        let times_h = |stage: &Stage<Y>, c: f64| {
            let (rates, production) = (&stage.rates, &stage.production);
            let mut q: Vec<_> = rates.slopes.iter().map(|k| *k * (c * h)).collect();
            let mut p: Vec<_> = production.slopes.iter().map(|k| *k * (c * h)).collect();
            q[columns - 1] += rates.value * c;
            p[columns - 1] += production.value * c;
            let value = rates.value * (c * h);
            let q = Along { value, slopes: q };
            (q, Along { value: production.value * (c * h), slopes: p })
        };
        let mut before = nothing();
        let mut last = times_h(&first, coefficients.first);
        for _ in 2..=count {
            let Recursion { mu, nu, rate, start_rate } = coefficients.next();
            let stage = self.stage(&last.0)?;
            let (here, start) = (times_h(&stage, rate), times_h(&first, start_rate));
            let mut next = nothing();
            let terms = [(&last, mu), (&before, nu), (&here, 1.0), (&start, 1.0)];
            for ((q, p), w) in terms {
                next.0.value += q.value * w;
                next.1.value += p.value * w;
                for c in 0..columns {
                    next.0.slopes[c] += q.slopes[c] * w;
                    next.1.slopes[c] += p.slopes[c] * w;
                }
            }
            before = last;
            last = next;
        }
        Some(last)
    }

    /// The unit of each entry in which the end is moved onto the laws, for each column.
    fn units(&self, end: &Along<Vector<Y::Manifold>>) -> Vec<Dual<Y>> {
        if let Some(allowed) = &self.piece.allowed {
            let units = Dual::<Y>::from_index(|i| Dual64::from(allowed[i]));
            return vec![units; end.slopes.len()];
        }
        (self.starts.iter().zip(&end.slopes))
            .map(|(start, slope)| {
                let size = self.sizes_along(&start.delta);
                Dual::<Y>::from_index(|i| {
                    // A parameter has no unit: no projection moves it.
                    if i >= self.piece.moving {
                        return Dual64::from(0.0);
                    }
                    let end = super::duals::magnitude(Dual64::new(end.value[i], slope[i]));
                    if end.re > size[i].re { end } else { size[i] }
                })
            })
            .collect()
    }

    /// The sizes of the entries at the start along a direction. They are piecewise linear, so that a difference is exact
    /// but for its rounding; and the end of a step depends on them as little as on its projection.
    fn sizes_along(&self, delta: &Vector<Y::Manifold>) -> Dual<Y> {
        let x = self.piece.x;
        let here = Y::Manifold::scales(x);
        let length = (0..Dim::<Y>::LEN)
            .filter(|&i| delta[i] != 0.0 && here[i] > 0.0)
            .map(|i| f64::EPSILON.cbrt() * here[i] / delta[i].abs())
            .fold(f64::INFINITY, f64::min);
        if !length.is_finite() {
            return Dual::<Y>::from_index(|i| Dual64::from(here[i]));
        }
        let [after, before] =
            [length, -length].map(|e| Y::Manifold::scales(&Y::Manifold::chart(x, &(*delta * e))));
        Dual::<Y>::from_index(|i| Dual64::new(here[i], (after[i] - before[i]) / (2.0 * length)))
    }
}

/// The step of a tableau along directions.
fn taken<Y: Metriplectic<Manifold: MovingBase>>(
    tableau: &Tableau,
    model: &impl Model<System = Y>,
    piece: &Piece<'_, Y>,
    directions: Directions<Y>,
) -> Result<Ended<Y>, Unlinearised> {
    let Directions { starts, energy, invariants, entropy } = directions;
    let step = Step { model, piece, starts };
    let (end, rise) = match piece.stage_count {
        Some(count) => step.by_recursion(count),
        None => step.by_rows(tableau),
    }
    .ok_or(Unlinearised::NotSmooth)?;
    let points = (step.starts.iter().zip(&end.slopes))
        .map(|(start, slope)| {
            Y::Manifold::stage_from(piece.x, &start.delta, &dual::<Y>(&end.value, slope))
        })
        .collect();
    let rises = rise.slopes.iter().map(|slope| Dual64::new(rise.value, *slope));
    let produced: Numbers = entropy.iter().zip(rises).map(|(s, rise)| *s + rise).collect();
    let is_targeted = piece.entropy_step == Some(EntropyStep::Targeted);
    let units = step.units(&end);
    let entropy = is_targeted.then(|| produced.clone());
    let aim = Aim { energy, invariants, entropy, units };
    let parameters: Vec<_> = step.starts.iter().map(|start| start.parameter).collect();
    let landing = Landing { model, aim: &aim, parameters: &parameters };
    let Landed { points, reached, rounding } = landing.land(points, piece.end)?;
    reproduced::<Y>(piece, &reached, &rounding)?;
    let columns = points.iter().map(|y| derivative(&Y::Manifold::coordinates(piece.end, y)));
    Ok(Ended { columns: columns.collect(), produced })
}

/// The step of a tableau with its derivatives, and the end of the step in the wide system.
pub(super) fn propagate<Y, W>(
    tableau: &Tableau,
    model: &impl Model<System = Y>,
    piece: &Piece<'_, Y>,
    (wide, wide_end, columns): (&W, &Point<W>, &Columns<W>),
) -> Result<Propagated<W>, Unlinearised>
where
    Y: Metriplectic<Manifold: MovingBase>,
    W: Metriplectic,
{
    let (n, all) = (Dim::<Y>::LEN, Dim::<W>::LEN);
    let is_exact = wide.second_law() == SecondLaw::Exact;
    let mut columns = columns.clone();
    columns.laws.entropy_is_known = is_exact;
    if piece.entropy_step == Some(EntropyStep::Held) {
        return Ok(Propagated { columns, along_h: Vector::<W::Manifold>::zero() });
    }
    let directions = Directions::of(&columns, &piece.targets);
    let Ended { columns: ends, produced } = taken(tableau, model, piece, directions)?;
    for (c, end) in ends.iter().enumerate().take(all) {
        for i in 0..n {
            columns.t[(i, c)] = end[i];
        }
    }
    if piece.entropy_step == Some(EntropyStep::Targeted) {
        columns.laws.entropy = Vector::<W::Manifold>::from_index(|c| produced[c].eps);
    } else if is_exact {
        let jet = ScalarField::<W::Manifold>::jet1(wide.entropy(), wide_end);
        columns.laws.entropy = columns.t.transpose_times(&jet.df);
    }
    let along_h = Vector::<W::Manifold>::from_index(|i| if i < n { ends[all][i] } else { 0.0 });
    Ok(Propagated { columns, along_h })
}

/// The step of a tableau, transposed.
///
/// The values of the laws are those at the start of the step, and so are their derivatives: `dH(x_k) T_k = dH(x₀) T_0`.
pub(super) fn pull_back<Y, W>(
    tableau: &Tableau,
    model: &impl Model<System = Y>,
    piece: &Piece<'_, Y>,
    (wide, wide_start, costate): (&W, &Point<W>, &Vector<W::Manifold>),
) -> Result<Vector<W::Manifold>, Unlinearised>
where
    Y: Metriplectic<Manifold: MovingBase>,
    W: Metriplectic,
{
    if piece.entropy_step == Some(EntropyStep::Held) {
        return Ok(*costate);
    }
    let n = Dim::<Y>::LEN;
    let here = Columns::start(wide, wide_start);
    let directions = Directions::of(&here, &piece.targets);
    let Ended { columns, .. } = taken(tableau, model, piece, directions)?;
    let row = Vector::<Y::Manifold>::from_index(|i| costate[i]);
    Ok(Vector::<W::Manifold>::from_index(|c| {
        let stays = if c < n { 0.0 } else { costate[c] };
        row.dot(&columns[c]) + stays
    }))
}

/// How far a step or a jump that is differentiated may end from the one that was taken, and the function of an event from zero, relative to
/// the sizes of the entries.
/// A factor of four fails `tangent/explicit.rs::a_step_that_ends_a_billionth_beside_the_one_that_was_taken_is_another`.
pub(super) const NEAR: f64 = 1e-9;

/// Refuses a step that is not the one that was taken, but for a displacement that is round-off.
pub(super) fn reproduced<Y: Metriplectic>(
    piece: &Piece<'_, Y>,
    end: &Point<Y>,
    rounding: &Vector<Y::Manifold>,
) -> Result<(), Unlinearised> {
    let off = Y::Manifold::coordinates(piece.end, end);
    let moved = Y::Manifold::coordinates(piece.x, piece.end);
    let (at_start, at_end) = (Y::Manifold::scales(piece.x), Y::Manifold::scales(piece.end));
    let off = (0..Dim::<Y>::LEN).fold(0.0, |worst: f64, i| {
        let size = at_start[i].max(at_end[i]).max(moved[i].abs());
        if off[i].abs() <= rounding[i] { worst } else { worst.max(off[i].abs() / size) }
    });
    if off <= NEAR { Ok(()) } else { Err(Unlinearised::NotReproduced { off }) }
}

macro_rules! linearised {
    ($($method:ty),+) => {$(
        impl<Y: Metriplectic<Manifold: MovingBase>> Linearised<Y> for $method {
            fn propagate(
                &self,
                system: &Y,
                step: &Piece<'_, Y>,
                columns: &Columns<Y>,
            ) -> Result<Propagated<Y>, Unlinearised> {
                let wide = (system, step.end, columns);
                propagate(self.rows(), &Plain(system), step, wide)
            }

            fn pull_back(
                &self,
                system: &Y,
                step: &Piece<'_, Y>,
                costate: &Vector<Y::Manifold>,
            ) -> Result<Vector<Y::Manifold>, Unlinearised> {
                pull_back(self.rows(), &Plain(system), step, (system, step.x, costate))
            }
        }
    )+};
}
linearised!(DormandPrince5, DormandPrince8, RungeKuttaChebyshev, ExplicitRungeKutta);

/// A method with a tableau.
pub(super) trait Rows {
    fn rows(&self) -> &'static Tableau;
}

macro_rules! rows {
    ($($method:ty => $tableau:expr),+) => {$(
        impl Rows for $method {
            fn rows(&self) -> &'static Tableau {
                let tableau: fn(&$method) -> &'static Tableau = $tableau;
                tableau(self)
            }
        }
    )+};
}
rows!(
    DormandPrince5 => |_| DormandPrince5::TABLEAU,
    DormandPrince8 => |_| DormandPrince8::TABLEAU,
    RungeKuttaChebyshev => |_| &CHEBYSHEV,
    ExplicitRungeKutta => |method| method.tableau()
);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::step::Flow as _;
    use metriplectic_dynamics::{Symplectic, System};
    use metriplectic_fields::Real;
    use metriplectic_manifolds::Euclidean;
    use nalgebra::{Vector2, vector};

    #[test]
    fn a_step_that_ends_a_billionth_beside_the_one_that_was_taken_is_another() {
        let system = System::on(Euclidean::<2>)
            .bracket(Symplectic)
            .energy(|x: &Vector2<Real>| x.norm_squared() * 0.5)
            .build()
            .unwrap();
        // Of an entry in units of its own, beside a large one.
        let (x, end) = (vector![1e9, 1e-3], vector![1e9, 2e-3]);
        let ends_at = |off: f64| {
            let (allowed, targets) = (None, system.laws(&x));
            let (entropy_step, stage_count) = (None, None);
            let (moving, stage_velocities) = (2, &[][..]);
            let piece = Piece::<'_, _> {
                x: &x,
                end: &end,
                h: 0.1,
                moving,
                allowed,
                targets,
                entropy_step,
                stage_count,
                stage_velocities,
            };
            let there = vector![end.x, end.y * (1.0 + off)];
            fn same<Y: Metriplectic>(_: &Y, piece: &Piece<'_, Y>, there: &Point<Y>) -> bool {
                reproduced(piece, there, &Vector::<Y::Manifold>::zero()).is_ok()
            }
            same(&system, &piece, &there)
        };
        assert!(ends_at(5e-10) && !ends_at(2e-9));
    }
}
