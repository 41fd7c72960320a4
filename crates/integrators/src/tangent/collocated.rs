//! The tangent of a step with stages, by the implicit function theorem at its root.
//!
//! The unknowns `y = (z, hk)` of a [step](self::moved) solve `R(y) = 0`, and both of its ends are functions of them. So
//!
//! ```math
//! J = \frac{\partial x'}{\partial y} \begin{pmatrix} \partial R/\partial y \\ \partial x/\partial y \end{pmatrix}^{-1}
//! \begin{pmatrix} 0 \\ 1 \end{pmatrix} ,
//! ```
//!
//! with one evaluation of the residual at dual numbers for each unknown. Neither symmetry nor a discrete gradient of
//! a kind is needed, so the formula serves [`Gauss`] and [`Radau`] alike.

mod equation;
mod heat;
mod law;
mod moved;

use std::borrow::Cow;

use metriplectic_dynamics::{Differentiable, Metriplectic, SecondLaw};
use metriplectic_fields::{
    Column as _, Dimension as _, Matrix, ScalarField, Space as _, Square as _, Vector,
};
use metriplectic_manifolds::MovingBase;
use nalgebra::{DMatrix, DVector};

use self::equation::{Derivative, Equation};
use self::moved::Around;
use super::along::LinearisedAlong;
use super::columns::Columns;
use super::error::Unlinearised;
use super::factors::Refined;
use super::linearised::{Linearised, Piece, Propagated};
use super::schemes::units;
use crate::collocation::{Gauss, Radau, STAGES, StepRoot, Tableau};
use crate::step::Dim;

/// A step linearised at its root, in units of the entries.
struct AtRoot<Y: Metriplectic> {
    /// `(∂R/∂y, ∂x/∂y)`.
    matrix: DMatrix<f64>,
    /// `∂x'/∂y`.
    end: DMatrix<f64>,
    /// `(∂R/∂h, 0)`.
    along_h: DVector<f64>,
    /// The derivative of the production of entropy along `y`.
    produced: DVector<f64>,
    units: Vector<Y::Manifold>,
}

impl<Y: Metriplectic<Manifold: MovingBase>> AtRoot<Y> {
    fn of(
        tableau: &'static Tableau,
        system: &Y,
        piece: &Piece<'_, Y>,
    ) -> Result<Self, Unlinearised> {
        let (n, known) = (piece.moving, piece.stage_velocities);
        let velocities = (known.len() == n * STAGES).then(|| {
            std::array::from_fn(|stage| {
                Vector::<Y::Manifold>::from_index(
                    |c| if c < n { known[stage * n + c] } else { 0.0 },
                )
            })
        });
        let step = ([piece.x, piece.end], piece.h);
        let root =
            StepRoot::new(tableau, system, step, velocities).ok_or(Unlinearised::Singular)?;
        let zero = Vector::<Y::Manifold>::zero();
        super::explicit::reproduced::<Y>(piece, &root.end, &zero)?;
        let moved = Y::Manifold::coordinates(piece.x, piece.end);
        let units = units::<Y>(piece.x, piece.end, &moved);
        let equation = Equation::new(Around::new(system, piece, root))?;
        Ok(Self::assembled(&equation.derivatives()?, units))
    }

    fn assembled(derivatives: &[Derivative<Y>], units: Vector<Y::Manifold>) -> Self {
        let (n, size) = (Dim::<Y>::LEN, derivatives.len() - 1);
        let unit = |r: usize| units[r % n];
        let rows = |derivative: &Derivative<Y>, r: usize| {
            let (stage, c) = (r / n, r % n);
            derivative.residual.get(stage).map_or(derivative.start[c], |residual| residual[c])
        };
        let matrix =
            DMatrix::from_fn(size, size, |r, c| rows(&derivatives[c], r) * unit(c) / unit(r));
        let end = DMatrix::from_fn(n, size, |r, c| derivatives[c].end[r] * unit(c) / unit(r));
        let along_h = DVector::from_fn(size, |r, _| {
            if r < size - n { rows(&derivatives[size], r) / unit(r) } else { 0.0 }
        });
        let produced = DVector::from_fn(size, |c, _| derivatives[c].produced * unit(c));
        Self { matrix, end, along_h, produced, units }
    }

    /// The unknowns that move the start by a direction.
    fn right_side(&self, delta: &Vector<Y::Manifold>) -> DVector<f64> {
        let (n, size) = (Dim::<Y>::LEN, self.matrix.nrows());
        DVector::from_fn(
            size,
            |r, _| {
                if r < size - n { 0.0 } else { delta[r % n] / self.units[r % n] }
            },
        )
    }

    fn column(&self, y: &DVector<f64>) -> Vector<Y::Manifold> {
        let end = &self.end * y;
        Vector::<Y::Manifold>::from_index(|r| end[r] * self.units[r])
    }

    fn factors(&self) -> Option<Refined<'_>> {
        Refined::of(Cow::Borrowed(&self.matrix))
    }

    /// `J`, and `∂x'/∂h`.
    #[allow(
        clippy::type_complexity,
        reason = "a derivative and its column along h, which the caller takes apart"
    )]
    fn derivative(&self) -> Option<(Matrix<Y::Manifold>, Vector<Y::Manifold>)> {
        let factors = self.factors()?;
        let mut j = Matrix::<Y::Manifold>::zeros();
        for k in 0..Dim::<Y>::LEN {
            let y = factors.solve(&self.right_side(&Vector::<Y::Manifold>::basis(k)))?;
            let column = self.column(&y);
            for i in 0..Dim::<Y>::LEN {
                j[(i, k)] = column[i];
            }
        }
        Some((j, self.column(&-factors.solve(&self.along_h)?)))
    }

    /// `Jᵀ λ`, without `J`.
    fn transposed(&self, costate: &Vector<Y::Manifold>) -> Option<Vector<Y::Manifold>> {
        let (n, size) = (Dim::<Y>::LEN, self.matrix.nrows());
        let row = DVector::from_fn(n, |r, _| costate[r] * self.units[r]);
        let factors = Refined::of(Cow::Owned(self.matrix.transpose()))?;
        let y = factors.solve(&self.end.tr_mul(&row))?;
        Some(Vector::<Y::Manifold>::from_index(|c| y[size - n + c] / self.units[c]))
    }
}

/// The error of `dS(x') δ' − dS(x) δ = δΣ`, with the entropy `Σ` that the step says it has produced.
fn entropy_law<Y: Metriplectic<Manifold: MovingBase>>(
    at: &AtRoot<Y>,
    (system, step): (&Y, &Piece<'_, Y>),
    [before, after]: [&Vector<Y::Manifold>; 2],
) -> Option<f64> {
    let y = at.factors()?.solve(&at.right_side(before))?;
    let terms = [
        ScalarField::<Y::Manifold>::jet1(system.entropy(), step.end).df.dot(after),
        -ScalarField::<Y::Manifold>::jet1(system.entropy(), step.x).df.dot(before),
        -at.produced.dot(&y),
    ];
    let (off, size) = (terms.iter().sum::<f64>(), terms.map(f64::abs).iter().sum::<f64>());
    Some(if off == 0.0 { 0.0 } else { off.abs() / size })
}

macro_rules! linearised {
    ($($method:ident: $smooth:literal),+) => {$(
        impl<Y: Metriplectic<Manifold: MovingBase>, const S: usize> Linearised<Y> for $method<S> {
            const SMOOTH_AT_REST: bool = $smooth;

            fn propagate(
                &self,
                system: &Y,
                step: &Piece<'_, Y>,
                columns: &Columns<Y>,
            ) -> Result<Propagated<Y>, Unlinearised> {
                let at = AtRoot::of(Self::tableau(), system, step)?;
                let (j, along_h) = at.derivative().ok_or(Unlinearised::Singular)?;
                Ok(Propagated { columns: columns.after(&j), along_h })
            }

            fn entropy_law(
                &self,
                system: &Y,
                step: &Piece<'_, Y>,
                column: [&Vector<Y::Manifold>; 2],
            ) -> Option<f64> {
                if system.second_law() != SecondLaw::Exact {
                    return None;
                }
                let at = AtRoot::of(Self::tableau(), system, step).ok()?;
                entropy_law(&at, (system, step), column)
            }

            fn pull_back(
                &self,
                system: &Y,
                step: &Piece<'_, Y>,
                costate: &Vector<Y::Manifold>,
            ) -> Result<Vector<Y::Manifold>, Unlinearised> {
                let at = AtRoot::of(Self::tableau(), system, step)?;
                at.transposed(costate).ok_or(Unlinearised::Singular)
            }
        }

        impl<D, const S: usize> LinearisedAlong<D> for $method<S>
        where
            D: Differentiable,
            Self: Linearised<D::Wide>,
        {
        }
    )+};
}
linearised!(Gauss: true, Radau: false);
