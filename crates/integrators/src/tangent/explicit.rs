//! The tangent of an explicit step: its stages and its projection at dual numbers.
//!
//! A stage costs one evaluation of the second derivatives of `H`, `S` and `L_a`, whatever the number of columns; each column
//! is then evaluated at a dual number, with `δw = Hf δ` as the derivative of a differential. The columns are those of the
//! tangent, and one along the size of the step.
//!
//! The step size, the branch of the step (targeted or free) and the errors that were allowed are those of the step that was taken.

use metriplectic_dynamics::{Metriplectic, SecondLaw};
use metriplectic_fields::{Column as _, Dimension as _, ScalarField, Space, Square as _, Vector};
use metriplectic_manifolds::{Manifold, MovingBase};
use num_dual::Dual64;

use super::columns::Columns;
use super::duals::{Dual, Fields, Numbers, derivative};
use super::error::Unlinearised;
use super::landing::{Aim, DualPoint, Landing};
use super::linearised::{Linearised, Piece, Propagated, Targets};
use crate::explicit::{
    CHEBYSHEV, Coefficients, DormandPrince5, DormandPrince8, ExplicitRungeKutta, Recursion, Row,
    RungeKuttaChebyshev, Tableau,
};
use crate::step::{Dim, EntropyStep};

/// The rates and the production of a stage, for each column.
struct Stage<Y: Metriplectic> {
    rates: Vec<Dual<Y>>,
    production: Numbers,
}

/// A step at dual numbers.
struct Step<'a, Y: Metriplectic> {
    system: &'a Y,
    piece: &'a Piece<'a, Y>,
    /// The directions of the start, for each column.
    starts: Vec<Vector<Y::Manifold>>,
    /// The size of the step, for each column.
    sizes: Numbers,
}

/// Directions: of the start, of the size of the step, and of the values of the laws.
struct Directions<Y: Metriplectic> {
    starts: Vec<Vector<Y::Manifold>>,
    sizes: Numbers,
    energy: Numbers,
    invariants: Vec<Numbers>,
    entropy: Numbers,
}

impl<Y: Metriplectic> Directions<Y> {
    /// Takes the columns of a tangent, and one along the size of the step, which moves no law.
    fn of(columns: &Columns<Y>, targets: &Targets<Y>, h: f64) -> Self {
        let n = Dim::<Y>::LEN;
        let law = |value: f64, row: &Vector<Y::Manifold>| -> Numbers {
            (0..=n).map(|c| Dual64::new(value, if c < n { row[c] } else { 0.0 })).collect()
        };
        let laws = &columns.laws;
        let listed = targets.invariants.as_ref().iter().zip(&laws.invariants);
        let mut starts: Vec<_> = (0..n).map(|j| columns.t.column_at(j)).collect();
        starts.push(Vector::<Y::Manifold>::zero());
        let along = |j| if j == n { 1.0 } else { 0.0 };
        Self {
            starts,
            sizes: (0..=n).map(|j| Dual64::new(h, along(j))).collect(),
            energy: law(targets.energy, &laws.energy),
            invariants: listed.map(|(value, row)| law(*value, row)).collect(),
            entropy: law(targets.entropy, &laws.entropy),
        }
    }
}

/// The end of a step, and the entropy that was produced.
struct Ended<Y: Metriplectic> {
    points: Vec<DualPoint<Y>>,
    produced: Numbers,
}

impl<Y: Metriplectic<Manifold: MovingBase>> Step<'_, Y> {
    /// `h Σ_j w_j k_j` for a column.
    fn combined(&self, row: Row, stages: &[Stage<Y>], column: usize) -> Dual<Y> {
        let sum = row.iter().fold(Dual::<Y>::zero(), |sum, &(stage, w)| {
            sum + stages[stage].rates[column] * Dual64::from(w)
        });
        sum * self.sizes[column]
    }

    /// The stage at the coordinates `q`, for each column.
    fn stage(&self, q: impl Fn(usize) -> Dual<Y>) -> Option<Stage<Y>> {
        let x = self.piece.x;
        let points: Vec<_> = (self.starts.iter().enumerate())
            .map(|(c, delta)| (q(c), Y::Manifold::stage_from(x, delta, &q(c))))
            .collect();
        let fields = Fields::at(self.system, Y::Manifold::real(&points.first()?.1))?;
        let mut stage = Stage { rates: Vec::new(), production: Vec::new() };
        for ((q, y), delta) in points.iter().zip(&self.starts) {
            let moved = derivative(&Y::Manifold::coordinates(&fields.y, y));
            let (velocity, production) = fields.motion(self.system, &moved)?;
            stage.rates.push(Y::Manifold::stage_rates_from((x, delta), (q, y), &velocity));
            stage.production.push(production);
        }
        Some(stage)
    }

    /// The end before the projection and the production of entropy, by the rows of a tableau.
    fn by_rows(&self, tableau: &Tableau) -> Option<(Vec<Dual<Y>>, Numbers)> {
        let mut stages = vec![self.stage(|_| Dual::<Y>::zero())?];
        for row in tableau.rows() {
            let next = self.stage(|c| self.combined(row, &stages, c))?;
            stages.push(next);
        }
        let weights = tableau.weights();
        let rise = |c: usize| {
            let terms = weights.iter().map(|&(j, w)| stages[j].production[c] * w);
            terms.fold(Dual64::from(0.0), |sum, term| sum + term) * self.sizes[c]
        };
        let columns = 0..self.starts.len();
        let ends = columns.clone().map(|c| self.combined(weights, &stages, c)).collect();
        Some((ends, columns.map(rise).collect()))
    }

    /// The end before the projection and the production of entropy, by the recursion of Chebyshev with so many stages.
    fn by_recursion(&self, count: u32) -> Option<(Vec<Dual<Y>>, Numbers)> {
        let columns = 0..self.starts.len();
        let first = self.stage(|_| Dual::<Y>::zero())?;
        let mut coefficients = Coefficients::new(count);
        let mut before: Vec<_> =
            columns.clone().map(|_| (Dual::<Y>::zero(), Dual64::from(0.0))).collect();
        let mut last: Vec<_> = columns
            .map(|c| {
                let h = self.sizes[c] * coefficients.first;
                (first.rates[c] * h, first.production[c] * h)
            })
            .collect();
        for _ in 2..=count {
            let Recursion { mu, nu, rate, start_rate } = coefficients.next();
            let stage = self.stage(|c| last[c].0)?;
            for (c, ((q, produced), before)) in last.iter_mut().zip(&mut before).enumerate() {
                let h = self.sizes[c];
                let (mu, nu, rate, start) =
                    (Dual64::from(mu), Dual64::from(nu), h * rate, h * start_rate);
                let rates = stage.rates[c] * rate + first.rates[c] * start;
                let production = stage.production[c] * rate + first.production[c] * start;
                let next =
                    (*q * mu + before.0 * nu + rates, *produced * mu + before.1 * nu + production);
                *before = (*q, *produced);
                (*q, *produced) = next;
            }
        }
        Some(last.into_iter().unzip())
    }

    /// The unit of each entry in which the end is moved onto the laws, for each column.
    fn units(&self, ends: &[Dual<Y>]) -> Vec<Dual<Y>> {
        let size = |c: usize| self.sizes_along(&self.starts[c]);
        match &self.piece.allowed {
            Some(allowed) => {
                vec![Dual::<Y>::from_index(|i| Dual64::from(allowed[i])); ends.len()]
            }
            None => (ends.iter().enumerate())
                .map(|(c, end)| {
                    let size = size(c);
                    Dual::<Y>::from_index(|i| {
                        // A parameter has no unit: no projection moves it.
                        if i >= self.piece.moving {
                            return Dual64::from(0.0);
                        }
                        let end = super::duals::magnitude(end[i]);
                        if end.re > size[i].re { end } else { size[i] }
                    })
                })
                .collect(),
        }
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
    (system, piece): (&Y, &Piece<'_, Y>),
    directions: Directions<Y>,
) -> Result<Ended<Y>, Unlinearised> {
    let Directions { starts, sizes, energy, invariants, entropy } = directions;
    let step = Step { system, piece, starts, sizes };
    let (ends, rises) = match piece.stage_count {
        Some(count) => step.by_recursion(count),
        None => step.by_rows(tableau),
    }
    .ok_or(Unlinearised::NotSmooth)?;
    let (starts, columns) = (&step.starts, ends.iter().enumerate());
    let points =
        columns.map(|(c, end)| Y::Manifold::stage_from(piece.x, &starts[c], end)).collect();
    let produced: Numbers = entropy.iter().zip(rises).map(|(s, rise)| *s + rise).collect();
    let is_targeted = piece.entropy_step == Some(EntropyStep::Targeted);
    let units = step.units(&ends);
    let entropy = is_targeted.then(|| produced.clone());
    let aim = Aim { energy, invariants, entropy, units };
    let points = Landing { system, aim: &aim }.land(points)?;
    reproduced::<Y>(piece, &points[0])?;
    Ok(Ended { points, produced })
}

/// The step of a tableau with its derivatives.
fn propagate<Y: Metriplectic<Manifold: MovingBase>>(
    tableau: &Tableau,
    system: &Y,
    piece: &Piece<'_, Y>,
    columns: &Columns<Y>,
) -> Result<Propagated<Y>, Unlinearised> {
    let n = Dim::<Y>::LEN;
    let is_exact = system.second_law() == SecondLaw::Exact;
    let mut columns = columns.clone();
    columns.laws.entropy_is_known = is_exact;
    if piece.entropy_step == Some(EntropyStep::Held) {
        return Ok(Propagated { columns, along_h: Vector::<Y::Manifold>::zero() });
    }
    let directions = Directions::of(&columns, &piece.targets, piece.h);
    let Ended { points, produced } = taken(tableau, (system, piece), directions)?;
    let column = |c: usize| -> Vector<Y::Manifold> {
        derivative(&Y::Manifold::coordinates(piece.end, &points[c]))
    };
    for c in 0..n {
        let column = column(c);
        for i in 0..n {
            columns.t[(i, c)] = column[i];
        }
    }
    if piece.entropy_step == Some(EntropyStep::Targeted) {
        columns.laws.entropy = Vector::<Y::Manifold>::from_index(|c| produced[c].eps);
    } else if is_exact {
        let jet = ScalarField::jet1(system.entropy(), piece.end);
        columns.laws.entropy = columns.t.transpose_times(&jet.df);
    }
    Ok(Propagated { columns, along_h: column(n) })
}

/// The step of a tableau, transposed.
///
/// The values of the laws are those at the start of the step, and so are their derivatives: `dH(x_k) T_k = dH(x₀) T_0`.
fn pull_back<Y: Metriplectic<Manifold: MovingBase>>(
    tableau: &Tableau,
    system: &Y,
    piece: &Piece<'_, Y>,
    costate: &Vector<Y::Manifold>,
) -> Result<Vector<Y::Manifold>, Unlinearised> {
    if piece.entropy_step == Some(EntropyStep::Held) {
        return Ok(*costate);
    }
    let here = Columns::start(system, piece.x);
    let directions = Directions::of(&here, &piece.targets, piece.h);
    let Ended { points, .. } = taken(tableau, (system, piece), directions)?;
    Ok(Vector::<Y::Manifold>::from_index(|c| {
        let end: Vector<Y::Manifold> = derivative(&Y::Manifold::coordinates(piece.end, &points[c]));
        costate.dot(&end)
    }))
}

/// How far the step that is differentiated may end from the one that was taken, relative to the sizes of the entries.
const NEAR: f64 = 1e-9;

/// Refuses a step that is not the one that was taken.
fn reproduced<Y: Metriplectic>(
    piece: &Piece<'_, Y>,
    end: &<Y::Manifold as Space>::Point<Dual64>,
) -> Result<(), Unlinearised> {
    let off = Y::Manifold::coordinates(piece.end, &Y::Manifold::real(end));
    let moved = Y::Manifold::coordinates(piece.x, piece.end);
    let (at_start, at_end) = (Y::Manifold::scales(piece.x), Y::Manifold::scales(piece.end));
    let off = (0..Dim::<Y>::LEN).fold(0.0, |worst: f64, i| {
        let size = at_start[i].max(at_end[i]).max(moved[i].abs());
        if off[i] == 0.0 { worst } else { worst.max(off[i].abs() / size) }
    });
    if off <= NEAR { Ok(()) } else { Err(Unlinearised::NotReproduced { off }) }
}

macro_rules! linearised {
    ($($method:ty => $tableau:expr),+) => {$(
        impl<Y: Metriplectic<Manifold: MovingBase>> Linearised<Y> for $method {
            fn propagate(
                &self,
                system: &Y,
                step: &Piece<'_, Y>,
                columns: &Columns<Y>,
            ) -> Result<Propagated<Y>, Unlinearised> {
                let tableau: fn(&$method) -> &'static Tableau = $tableau;
                propagate(tableau(self), system, step, columns)
            }

            fn pull_back(
                &self,
                system: &Y,
                step: &Piece<'_, Y>,
                costate: &Vector<Y::Manifold>,
            ) -> Result<Vector<Y::Manifold>, Unlinearised> {
                let tableau: fn(&$method) -> &'static Tableau = $tableau;
                pull_back(tableau(self), system, step, costate)
            }
        }
    )+};
}
linearised!(
    DormandPrince5 => |_| DormandPrince5::TABLEAU,
    DormandPrince8 => |_| DormandPrince8::TABLEAU,
    RungeKuttaChebyshev => |_| &CHEBYSHEV,
    ExplicitRungeKutta => |method| method.tableau()
);
