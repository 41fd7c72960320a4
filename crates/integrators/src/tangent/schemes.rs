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

use super::certificate::BROKEN;
use super::columns::Columns;
use super::error::Unlinearised;
use super::frames::turned;
use super::linearised::{Linearised, Piece, Propagated};
use crate::discrete_gradient::{DiscreteGradient, Gonzalez, MeanValue, SymmetricItohAbe};
use crate::midpoint::{Residual, Scheme};
use crate::newton::Equation as _;
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

/// The linearisation of a step from one of its ends.
struct Shot<Y: Metriplectic> {
    path: StepPathJet<Y::Manifold>,
    jacobian: Matrix<Y::Manifold>,
}

/// An unknown, and its path.
type Path<Y> = (Vector<<Y as Metriplectic>::Manifold>, StepPathJet<<Y as Metriplectic>::Manifold>);

/// Corrections of the unknown of a path with a known end.
const CORRECTIONS: usize = 8;

/// The path of a retraction from `x` to `y`, by Newton's method on its end, which begins at the geodesic.
fn path<Y, R>(system: &Y, retraction: &R, [x, y]: [&Point<Y>; 2]) -> Option<Path<Y>>
where
    Y: Metriplectic,
    R: Retraction<Y::Manifold, Y::Metric>,
{
    let metric = system.metric();
    let mut u = metric.log(x, y).ok()?;
    let mut before = f64::INFINITY;
    for _ in 0..CORRECTIONS {
        let path = retraction.step_path_jet(metric, x, &u).ok()?;
        let off = Y::Manifold::coordinates(&path.end, y);
        let size = off.magnitude();
        // The last digits of the end are rounding.
        if size == 0.0 || size >= 0.5 * before {
            return Some((u, path));
        }
        before = size;
        u += path.dend.solve(&off)?;
    }
    let path = retraction.step_path_jet(metric, x, &u).ok()?;
    Some((u, path))
}

impl<R, W: DiscreteGradient> Scheme<R, W> {
    /// Linearises the step of size `h` from `x` to `y` along its unknown.
    fn shot<Y>(&self, system: &Y, [x, y]: [&Point<Y>; 2], h: f64) -> Option<Shot<Y>>
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric>,
    {
        let (u, path) = path(system, &self.retraction, [x, y])?;
        let jacobian = Residual::new(system, self, x, h).linearise(&u)?.jacobian;
        Some(Shot { path, jacobian })
    }
}

/// Both linearisations of a step, in one frame at `z` and in those of the stored ends.
struct Both<Y: Metriplectic> {
    /// `∂R/∂u`.
    a: Matrix<Y::Manifold>,
    /// `−∂R/∂v`.
    b: Matrix<Y::Manifold>,
    /// `∂x'/∂u`.
    e: Matrix<Y::Manifold>,
    /// `∂x/∂v`.
    f: Matrix<Y::Manifold>,
    d: Vector<Y::Manifold>,
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

    fn both<Y>(&self, system: &Y, &Piece { x, end, h, .. }: &Piece<'_, Y>) -> Option<Both<Y>>
    where
        Y: Metriplectic,
        R: Retraction<Y::Manifold, Y::Metric>,
    {
        let there = self.shot(system, [x, end], h)?;
        let back = self.shot(system, [end, x], -h)?;
        Some(Both {
            a: there.jacobian,
            b: turned::<Y::Manifold>(back.jacobian, &back.path.z, &there.path.z),
            e: turned::<Y::Manifold>(there.path.dend, &there.path.end, end),
            f: turned::<Y::Manifold>(back.path.dend, &back.path.end, x),
            d: there.path.d,
            units: units::<Y>(x, end, &there.path.d),
        })
    }
}

impl<Y: Metriplectic> Both<Y> {
    /// `J = E A⁻¹ B F⁻¹`, and `∂x'/∂h`.
    #[allow(
        clippy::type_complexity,
        reason = "a derivative and its column along h, which the caller takes apart"
    )]
    fn derivative(&self, h: f64) -> Option<(Matrix<Y::Manifold>, Vector<Y::Manifold>)> {
        let Self { a, b, e, f, d, units } = self;
        let a = scaled::<Y>(a, units).factor()?;
        let solve = |r: Vector<Y::Manifold>| {
            let hat = a.solve(&each::<Y>(&r, |i| 1.0 / units[i]))?;
            Some(*e * each::<Y>(&hat, |i| units[i]))
        };
        let inverse = scaled::<Y>(f, units).inverse()?;
        let inverse =
            Matrix::<Y::Manifold>::from_entries(|i, j| inverse[(i, j)] * units[i] / units[j]);
        let right = *b * inverse;
        let mut j = Matrix::<Y::Manifold>::zeros();
        for k in 0..Dim::<Y>::LEN {
            let column = solve(right.column_at(k))?;
            for i in 0..Dim::<Y>::LEN {
                j[(i, k)] = column[i];
            }
        }
        // R = d − h V vanishes, so ∂R/∂h = −V = −d/h.
        Some((j, solve(*d * h.recip())?))
    }

    /// `λ ↦ Jᵀ λ = F⁻ᵀ Bᵀ A⁻ᵀ Eᵀ λ` for each row, without `J`.
    fn transposed<const K: usize>(
        &self,
        rows: [Vector<Y::Manifold>; K],
    ) -> Option<[Vector<Y::Manifold>; K]> {
        let Self { a, b, e, f, units, .. } = self;
        let factors = |m: &Matrix<Y::Manifold>| {
            let m = scaled::<Y>(m, units);
            Matrix::<Y::Manifold>::from_entries(|i, j| m[(j, i)]).factor()
        };
        let (a, f) = (factors(a)?, factors(f)?);
        let mut pulled = rows;
        for row in &mut pulled {
            let hat = a.solve(&each::<Y>(&e.transpose_times(row), |i| units[i]))?;
            let middle = b.transpose_times(&each::<Y>(&hat, |i| 1.0 / units[i]));
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
    fn propagate(
        &self,
        system: &Y,
        step: &Piece<'_, Y>,
        columns: &Columns<Y>,
    ) -> Result<Propagated<Y>, Unlinearised> {
        let derivative = || self.both(system, step)?.derivative(step.h);
        let (j, along_h) = derivative().ok_or(Unlinearised::Singular)?;
        Ok(Propagated { columns: columns.after(&j), along_h })
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
        let [before, after] =
            [step.x, step.end].map(|x| ScalarField::<Y::Manifold>::jet1(system.energy(), x).df);
        let pulled = || self.both(system, step)?.transposed([*costate, after]);
        let [point, energy] = pulled().ok_or(Unlinearised::Singular)?;
        first_law::<Y>(step.x, [&energy, &before])?;
        Ok(point)
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
fn units<Y: Metriplectic>(
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
