//! The tangent of a self-adjoint implicit step, by two linearisations.
//!
//! The residual `R` of a step depends on the pair `(x, x')`. At fixed `x` the unknown `u` of the step from `x` varies `x'`:
//! `∂R/∂u = A` and `∂x'/∂u = E`. At fixed `x'` the unknown `v` of the step of size `−h` from `x'` to `x` varies `x`. The scheme
//! is self-adjoint, so the residual of this step is `−R` in the same frame at `z`: `∂R/∂v = −B` and `∂x/∂v = F`. Hence
//!
//! ```math
//! J = -\Bigl(\frac{\partial R}{\partial x'}\Bigr)^{-1} \frac{\partial R}{\partial x} = E A^{-1} B F^{-1} .
//! ```

use metriplectic_dynamics::system::Point;
use metriplectic_dynamics::{Metriplectic, SecondLaw};
use metriplectic_fields::{
    Column as _, Dimension as _, Factors as _, Matrix, ScalarField, Space as _, Square as _,
    Vector, power_of_two,
};
use metriplectic_manifolds::{
    Cayley, ChartMidpoint, Manifold as _, Projection, Retraction, Riemannian as _, StepPathJet,
    WeylMidpoint,
};
use num_dual::Dual64;

use super::CORRECTIONS;
use super::columns::Columns;
use super::error::Unlinearised;
use super::frames::{between, turned};
use super::linearised::{Linearised, Piece, Propagated};
use crate::discrete_gradient::{DiscreteGradient, Gonzalez, MeanValue, SymmetricItohAbe};
use crate::midpoint::{BothEnds, Residual, Scheme};
use crate::round_off::bound::BROKEN;
use crate::step::Dim;

/// A retraction or a discrete gradient that is the same seen from either end of a step:
/// [law 4](crate::laws) of retractions, and `w(x, x') = w(x', x)`.
///
/// It is a promise: the tangent of a [`Scheme`] uses it.
pub trait SelfAdjoint {}

macro_rules! self_adjoint {
    ($($part:ty),+) => { $(impl SelfAdjoint for $part {})+ };
}
self_adjoint!(WeylMidpoint, ChartMidpoint, Projection, Cayley);
self_adjoint!(Gonzalez, MeanValue, SymmetricItohAbe);

/// An unknown, and its path.
type Path<Y> = (Vector<<Y as Metriplectic>::Manifold>, StepPathJet<<Y as Metriplectic>::Manifold>);

/// The path of a retraction from `x` to `y`, by Newton's method on its end, which begins at the geodesic.
fn path<Y, R>(system: &Y, retraction: &R, [x, y]: [&Point<Y>; 2]) -> Option<Path<Y>>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
{
    let metric = system.metric();
    let mut u = metric.log(x, y).ok()?;
    let (mut before, scales) = (f64::INFINITY, Y::Manifold::scales(y));
    for _ in 0..CORRECTIONS {
        let path = retraction.step_path_jet(metric, x, &u).ok()?;
        let off = Y::Manifold::coordinates(&path.end, y);
        let size = off.magnitude();
        // The last digits of the end are rounding.
        let is_rounding =
            (0..Dim::<Y>::LEN).all(|i| off[i].abs() <= 2.0 * f64::EPSILON * scales[i]);
        if is_rounding || size >= 0.5 * before {
            return Some((u, path));
        }
        before = size;
        u += path.dend.solve(&off)?;
    }
    let path = retraction.step_path_jet(metric, x, &u).ok()?;
    Some((u, path))
}

/// Both linearisations of a step, in one frame at `z` and in those of the stored ends.
pub(super) struct Both<Y: Metriplectic> {
    /// `∂R/∂u` and `−∂R/∂v`, and what else the step knows there.
    pub(super) at: BothEnds<Y>,
    /// `∂x'/∂u`.
    e: Matrix<Y::Manifold>,
    /// `∂x/∂v`.
    f: Matrix<Y::Manifold>,
    /// The base of the step.
    pub(super) z: Point<Y>,
    /// Its displacement there.
    pub(super) d: Vector<Y::Manifold>,
    /// Its size.
    pub(super) h: f64,
    units: Vector<Y::Manifold>,
}

impl<R, W: DiscreteGradient> Scheme<R, W> {
    /// The derivative of the growth `h ⟨w_S, K̃ w_S⟩` of the entropy where the second end of a step moves along `δ`.
    fn growth<Y>(
        &self,
        system: &Y,
        [x, y]: [&Point<Y>; 2],
        h: f64,
        delta: &Vector<Y::Manifold>,
    ) -> Option<f64>
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric>,
    {
        let (u, path) = path(system, &self.retraction, [x, y])?;
        let along = turned::<Y::Manifold>(path.dend, &path.end, y).solve(delta)?;
        let moved = Vector::<Y::Manifold, Dual64>::from_index(|i| Dual64::new(u[i], along[i]));
        Some(Residual::new(system, self, x, h).defined(&moved).ok()?.1.eps)
    }

    /// Linearises a step from both of its ends, with the derivatives along covectors if they are asked for.
    pub(super) fn both<Y>(
        &self,
        system: &Y,
        [x, end]: [&Point<Y>; 2],
        h: f64,
        asks_covectors: bool,
    ) -> Option<Both<Y>>
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric>,
    {
        let (u, there) = path(system, &self.retraction, [x, end])?;
        let (_, back) = path(system, &self.retraction, [end, x])?;
        let there = StepPathJet {
            dend: turned::<Y::Manifold>(there.dend, &there.end, end),
            end: end.clone(),
            ..there
        };
        let turn = between::<Y::Manifold>(&back.z, &there.z);
        let [dz, dd] = [back.dz, back.dd].map(|a| turn.map_or(a, |turn| turn * a));
        let dend = turned::<Y::Manifold>(back.dend, &back.end, x);
        let d = there.d * -1.0;
        let back = StepPathJet { z: there.z.clone(), dz, d, dd, end: x.clone(), dend };
        let residual = Residual::between(system, self, x, h);
        let at = residual.both_ends((&u, end), [&there, &back], asks_covectors)?;
        let units = units::<Y>(x, end, &there.d);
        Some(Both { e: there.dend, f: back.dend, z: there.z, d: there.d, h, at, units })
    }
}

type FactorsOf<Y> =
    <Matrix<<Y as Metriplectic>::Manifold> as metriplectic_fields::Square<f64>>::Factors;

/// A matrix in units of the entries, factorised. Its solutions are refined once: then each row is solved to the round-off of its own
/// terms (Skeel 1980), so that an entry near rest has no digits of another one.
pub(super) struct Factored<Y: Metriplectic> {
    matrix: Matrix<Y::Manifold>,
    factors: FactorsOf<Y>,
}

impl<Y: Metriplectic> Factored<Y> {
    fn of(matrix: Matrix<Y::Manifold>) -> Option<Self> {
        Some(Self { factors: matrix.factor()?, matrix })
    }

    fn solve(&self, right: &Vector<Y::Manifold>) -> Option<Vector<Y::Manifold>> {
        let y = self.factors.solve(right)?;
        let left = *right - self.matrix * y;
        Some(y + self.factors.solve(&left)?)
    }
}

impl<Y: Metriplectic> Both<Y> {
    /// Factorises `∂R/∂u`.
    pub(super) fn factored(&self) -> Option<Factored<Y>> {
        Factored::of(scaled::<Y>(&self.at.jacobians[0], &self.units))
    }

    /// `E A⁻¹ r`: how the end moves where the residual changes by `−r`.
    pub(super) fn end_along(
        &self,
        a: &Factored<Y>,
        r: &Vector<Y::Manifold>,
    ) -> Option<Vector<Y::Manifold>> {
        let hat = a.solve(&each::<Y>(r, |i| 1.0 / self.units[i]))?;
        Some(self.e * each::<Y>(&hat, |i| self.units[i]))
    }

    /// `∂x'/∂h`: the residual `R = d − h V` vanishes, so `∂R/∂h = −V = −d/h`.
    pub(super) fn along_h(&self, a: &Factored<Y>) -> Option<Vector<Y::Manifold>> {
        self.end_along(a, &(self.d * self.h.recip()))
    }

    /// `J = E A⁻¹ B F⁻¹`.
    pub(super) fn derivative(&self, a: &Factored<Y>) -> Option<Matrix<Y::Manifold>> {
        let Self { f, units, .. } = self;
        let inverse = scaled::<Y>(f, units).inverse()?;
        let inverse =
            Matrix::<Y::Manifold>::from_entries(|i, j| inverse[(i, j)] * units[i] / units[j]);
        let right = self.at.jacobians[1] * inverse;
        let mut j = Matrix::<Y::Manifold>::zeros();
        for k in 0..Dim::<Y>::LEN {
            let column = self.end_along(a, &right.column_at(k))?;
            for i in 0..Dim::<Y>::LEN {
                j[(i, k)] = column[i];
            }
        }
        Some(j)
    }

    /// `λ ↦ (A⁻ᵀ Eᵀ λ, Jᵀ λ)` for each row, with `Jᵀ = F⁻ᵀ Bᵀ A⁻ᵀ Eᵀ`, without `J`.
    pub(super) fn transposed<const K: usize>(
        &self,
        rows: [Vector<Y::Manifold>; K],
    ) -> Option<[[Vector<Y::Manifold>; 2]; K]> {
        let Self { at, e, f, units, .. } = self;
        let [a, b] = &at.jacobians;
        let factors = |m: &Matrix<Y::Manifold>| {
            let m = scaled::<Y>(m, units);
            Factored::<Y>::of(Matrix::<Y::Manifold>::from_entries(|i, j| m[(j, i)]))
        };
        let (a, f) = (factors(a)?, factors(f)?);
        let mut pulled = rows.map(|row| [row; 2]);
        for [through, row] in &mut pulled {
            let hat = a.solve(&each::<Y>(&e.transpose_times(row), |i| units[i]))?;
            *through = each::<Y>(&hat, |i| 1.0 / units[i]);
            let middle = b.transpose_times(through);
            let hat = f.solve(&each::<Y>(&middle, |i| units[i]))?;
            *row = each::<Y>(&hat, |i| 1.0 / units[i]);
        }
        Some(pulled)
    }
}

impl<Y, R, W> Linearised<Y> for Scheme<R, W>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric> + SelfAdjoint,
    W: DiscreteGradient + SelfAdjoint,
{
    const SMOOTH_AT_REST: bool = true;

    fn propagate(
        &self,
        system: &Y,
        step: &Piece<'_, Y>,
        columns: &Columns<Y>,
    ) -> Result<Propagated<Y>, Unlinearised> {
        let propagated = || {
            let both = self.both(system, [step.x, step.end], step.h, false)?;
            let a = both.factored()?;
            let columns = columns.after(&both.derivative(&a)?);
            Some(Propagated { columns, along_h: both.along_h(&a)? })
        };
        propagated().ok_or(Unlinearised::Singular)
    }

    /// The derivatives of the growth along both ends are those along the unknowns of both shots.
    fn entropy_law(
        &self,
        system: &Y,
        step: &Piece<'_, Y>,
        [before, after]: [&Vector<Y::Manifold>; 2],
    ) -> Option<f64> {
        if system.second_law() != SecondLaw::Exact {
            return None;
        }
        let Piece { x, end, h, .. } = *step;
        let terms = [
            ScalarField::<Y::Manifold>::jet1(system.entropy(), end).df.dot(after),
            -ScalarField::<Y::Manifold>::jet1(system.entropy(), x).df.dot(before),
            -self.growth(system, [x, end], h, after)?,
            // The growth of the step of size −h is that of the step less its sign.
            self.growth(system, [end, x], -h, before)?,
        ];
        let (off, size) = (terms.iter().sum::<f64>(), terms.map(f64::abs).iter().sum::<f64>());
        Some(if off == 0.0 { 0.0 } else { off.abs() / size })
    }

    fn pull_back(
        &self,
        system: &Y,
        step: &Piece<'_, Y>,
        costate: &Vector<Y::Manifold>,
    ) -> Result<Vector<Y::Manifold>, Unlinearised> {
        let both = self.both(system, [step.x, step.end], step.h, false);
        let both = both.ok_or(Unlinearised::Singular)?;
        let [_, point] = both.pulled_back(step.x, costate)?;
        Ok(point)
    }
}

impl<Y: Metriplectic> Both<Y> {
    /// `A⁻ᵀ Eᵀ λ` and `Jᵀ λ`, if the first law of the step holds.
    pub(super) fn pulled_back(
        &self,
        x: &Point<Y>,
        costate: &Vector<Y::Manifold>,
    ) -> Result<[Vector<Y::Manifold>; 2], Unlinearised> {
        let [before, after] = self.at.energy;
        let pulled = self.transposed([*costate, after]).ok_or(Unlinearised::Singular)?;
        let [rows, [_, energy]] = pulled;
        first_law::<Y>(x, [&energy, &before])?;
        Ok(rows)
    }
}

/// Refuses a derivative that breaks `dH(x') J = dH(x)`, relative to the terms `|∂_iH| s_i` in units of the sizes of entries.
fn first_law<Y: Metriplectic>(
    x: &Point<Y>,
    [pulled, before]: [&Vector<Y::Manifold>; 2],
) -> Result<(), Unlinearised> {
    let sizes = Y::Manifold::scales(x);
    let sum = |f: &dyn Fn(usize) -> f64| (0..Dim::<Y>::LEN).map(|i| f(i) * sizes[i]).sum::<f64>();
    let off = sum(&|i| (pulled[i] - before[i]).abs());
    let terms = sum(&|i| pulled[i].abs() + before[i].abs());
    if off <= BROKEN * terms { Ok(()) } else { Err(Unlinearised::LawBroken { off: off / terms }) }
}

/// The unit of each entry, a power of two: in another one each number of a factorisation differs by a power of two, so that
/// its pivots are the same.
pub(super) fn units<Y: Metriplectic>(
    x: &Point<Y>,
    y: &Point<Y>,
    d: &Vector<Y::Manifold>,
) -> Vector<Y::Manifold> {
    let [a, b] = [x, y].map(Y::Manifold::scales);
    let whole = Y::Manifold::magnitude(x);
    Vector::<Y::Manifold>::from_index(|i| {
        let size = a[i].max(b[i]).max(d[i].abs());
        let size = if size > 0.0 { size } else { whole };
        if size > 0.0 { power_of_two(size) } else { 1.0 }
    })
}

/// The matrix `A_ij s_j/s_i` in the units `s`.
fn scaled<Y: Metriplectic>(
    a: &Matrix<Y::Manifold>,
    units: &Vector<Y::Manifold>,
) -> Matrix<Y::Manifold> {
    Matrix::<Y::Manifold>::from_entries(|i, j| a[(i, j)] * units[j] / units[i])
}

/// The vector `v_i f(i)`.
fn each<Y: Metriplectic>(v: &Vector<Y::Manifold>, f: impl Fn(usize) -> f64) -> Vector<Y::Manifold> {
    Vector::<Y::Manifold>::from_index(|i| v[i] * f(i))
}
