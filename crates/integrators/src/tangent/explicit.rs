//! The tangent of an explicit step: its stages and its projection at dual numbers.
//!
//! A stage costs one evaluation of the second derivatives of `H`, `S` and `L_a`, whatever the number of columns; each column
//! is then evaluated at a dual number, with `δw = Hf δ` as the derivative of a differential. The columns are those of the
//! tangent, and one along the size of the step.
//!
//! The step size, the branch of the step (targeted or free) and the errors that were allowed are those of the step that was taken.

use metriplectic_dynamics::{Metriplectic, SecondLaw};
use metriplectic_fields::{Column as _, Dimension as _, Matrix, Space, Square as _, Vector};
use metriplectic_manifolds::{Manifold, MovingBase};
use num_dual::Dual64;

use super::columns::{Columns, LawOfStart};
use super::duals::{Dual, Fields, Numbers, derivative};
use super::error::Unlinearised;
use super::landing::{Aim, Landing};
use super::linearised::{Linearised, Piece, Propagated};
use crate::explicit::{DormandPrince5, DormandPrince8, ExplicitRungeKutta, Row, Tableau};
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

impl<'a, Y: Metriplectic<Manifold: MovingBase>> Step<'a, Y> {
    fn new(system: &'a Y, piece: &'a Piece<'a, Y>, t: &Matrix<Y::Manifold>) -> Self {
        let n = Dim::<Y>::LEN;
        let mut starts: Vec<_> = (0..n).map(|j| t.column_at(j)).collect();
        starts.push(Vector::<Y::Manifold>::zero());
        let along = |j| if j == n { 1.0 } else { 0.0 };
        let sizes = (0..=n).map(|j| Dual64::new(piece.h, along(j))).collect();
        Self { system, piece, starts, sizes }
    }

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

    /// All stages of the step.
    fn stages(&self, tableau: &Tableau) -> Option<Vec<Stage<Y>>> {
        let mut stages = vec![self.stage(|_| Dual::<Y>::zero())?];
        for row in tableau.rows() {
            let next = self.stage(|c| self.combined(row, &stages, c))?;
            stages.push(next);
        }
        Some(stages)
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
    let step = Step::new(system, piece, &columns.t);
    let stages = step.stages(tableau).ok_or(Unlinearised::NotSmooth)?;
    let count = step.starts.len();
    let ends: Vec<_> = (0..count).map(|c| step.combined(tableau.weights(), &stages, c)).collect();
    let rise = |c: usize| {
        let terms = tableau.weights().iter().map(|&(j, w)| stages[j].production[c] * w);
        terms.fold(Dual64::from(0.0), |sum, term| sum + term) * step.sizes[c]
    };
    let points =
        (0..count).map(|c| Y::Manifold::stage_from(piece.x, &step.starts[c], &ends[c])).collect();
    // The size of the step moves no target.
    let law = |law: &LawOfStart<Vector<Y::Manifold>>| -> Numbers {
        (0..count).map(|c| Dual64::new(law.value, if c < n { law.row[c] } else { 0.0 })).collect()
    };
    let produced: Numbers =
        law(&columns.laws.entropy).iter().enumerate().map(|(c, s)| *s + rise(c)).collect();
    let is_targeted = piece.entropy_step == Some(EntropyStep::Targeted);
    let aim = Aim {
        energy: law(&columns.laws.energy),
        invariants: columns.laws.invariants.iter().map(law).collect(),
        entropy: is_targeted.then(|| produced.clone()),
        units: step.units(&ends),
    };
    let landed = Landing { system, aim: &aim }.land(points)?;
    reproduced::<Y>(piece, &landed[0])?;
    let column = |c: usize| -> Vector<Y::Manifold> {
        derivative(&Y::Manifold::coordinates(piece.end, &landed[c]))
    };
    for c in 0..n {
        let column = column(c);
        for i in 0..n {
            columns.t[(i, c)] = column[i];
        }
    }
    if is_targeted {
        let row = Vector::<Y::Manifold>::from_index(|c| produced[c].eps);
        columns.laws.entropy = LawOfStart { value: produced[0].re, row };
    } else if is_exact {
        let jet = metriplectic_fields::ScalarField::jet1(system.entropy(), piece.end);
        let row = columns.t.transpose_times(&jet.df);
        columns.laws.entropy = LawOfStart { value: jet.value, row };
    }
    Ok(Propagated { columns, along_h: column(n) })
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
        }
    )+};
}
linearised!(
    DormandPrince5 => |_| DormandPrince5::TABLEAU,
    DormandPrince8 => |_| DormandPrince8::TABLEAU,
    ExplicitRungeKutta => |method| method.tableau()
);
