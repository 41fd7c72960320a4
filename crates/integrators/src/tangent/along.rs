//! Derivatives of a step along the start and along the parameters of a system.

use metriplectic_dynamics::{Differentiable, Metriplectic};
use metriplectic_fields::{Dimension as _, Vector};
use metriplectic_manifolds::{MovingBase, Retraction};

use super::columns::Columns;
use super::error::Unlinearised;
use super::explicit::{self, Rows as _};
use super::linearised::{Linearised, Propagated};
use super::model::WithParameters;
use super::parameters::{end_along_parameters, pulled_back, with_parameters};
use super::part::{Part, Wide};
use super::schemes::SelfAdjoint;
use crate::discrete_gradient::DiscreteGradient;
use crate::explicit::{DormandPrince5, DormandPrince8, ExplicitRungeKutta, RungeKuttaChebyshev};
use crate::midpoint::Scheme;
use crate::step::Dim;

/// A method whose steps can be differentiated along the start and the parameters of a system.
///
/// Parameters do not move, so a method may treat them apart: its equations are then those of the `n` directions of the state,
/// with `P` right-hand sides. The default differentiates the step of the [wide](Differentiable::wide) system along all
/// `n + P` directions alike.
///
/// Laws: both are those of [`Linearised`] for the wide system.
#[diagnostic::on_unimplemented(
    message = "the steps of `{Self}` have no tangent on this system",
    note = "a `Scheme` has one if its retraction and its discrete gradient are symmetric (`SelfAdjoint`): not `Exponential`, \
            and not `ItohAbe`",
    note = "`DormandPrince5`, `DormandPrince8`, `RungeKuttaChebyshev` and `ExplicitRungeKutta` have one on every space of this library (`MovingBase`)"
)]
pub trait LinearisedAlong<D: Differentiable>: Linearised<D::Wide> {
    /// Computes the tangent at the end of a step from that at its start.
    ///
    /// # Errors
    ///
    /// [`Unlinearised`] if the step has no derivative.
    fn propagate_along(
        &self,
        system: &D,
        step: &Part<D>,
        columns: &Columns<D::Wide>,
    ) -> Result<Propagated<D::Wide>, Unlinearised> {
        step.with(system, |piece| self.propagate(system.wide(), piece, columns))
    }

    /// Computes the derivative of a loss along start and parameters of a step from that along its end.
    ///
    /// # Errors
    ///
    /// [`Unlinearised`] if the step has no derivative.
    fn pull_back_along(
        &self,
        system: &D,
        step: &Part<D>,
        costate: &Vector<<D::Wide as Metriplectic>::Manifold>,
    ) -> Result<Vector<<D::Wide as Metriplectic>::Manifold>, Unlinearised> {
        step.with(system, |piece| self.pull_back(system.wide(), piece, costate))
    }
}

/// Where the parameters enter the energy, the entropy and the further invariants alone.
fn moves_fields_alone<D: Differentiable>(system: &D) -> bool {
    Dim::<D>::LEN < Dim::<Wide<D>>::LEN && !system.tensors_depend()
}

macro_rules! by_stages {
    ($($method:ty),+) => {$(
        impl<D> LinearisedAlong<D> for $method
        where
            D: Differentiable<Manifold: MovingBase>,
            Self: Linearised<D::Wide>,
        {
            fn propagate_along(
                &self,
                system: &D,
                step: &Part<D>,
                columns: &Columns<D::Wide>,
            ) -> Result<Propagated<D::Wide>, Unlinearised> {
                if !moves_fields_alone(system) {
                    return step.with(system, |piece| self.propagate(system.wide(), piece, columns));
                }
                let (model, end) = (WithParameters(system), system.widened(&step.end));
                let wide = (system.wide(), &end, columns);
                explicit::propagate(self.rows(), &model, &step.narrow(), wide)
            }

            fn pull_back_along(
                &self,
                system: &D,
                step: &Part<D>,
                costate: &Vector<<D::Wide as Metriplectic>::Manifold>,
            ) -> Result<Vector<<D::Wide as Metriplectic>::Manifold>, Unlinearised> {
                if !moves_fields_alone(system) {
                    return step.with(system, |piece| self.pull_back(system.wide(), piece, costate));
                }
                let (model, start) = (WithParameters(system), system.widened(&step.x));
                let wide = (system.wide(), &start, costate);
                explicit::pull_back(self.rows(), &model, &step.narrow(), wide)
            }
        }
    )+};
}
by_stages!(DormandPrince5, DormandPrince8, RungeKuttaChebyshev, ExplicitRungeKutta);

impl<D, R, W> LinearisedAlong<D> for Scheme<R, W>
where
    D: Differentiable,
    R: Retraction<D::Manifold, D::Metric> + SelfAdjoint,
    W: DiscreteGradient + SelfAdjoint,
    Self: Linearised<D::Wide>,
{
    fn propagate_along(
        &self,
        system: &D,
        step: &Part<D>,
        columns: &Columns<D::Wide>,
    ) -> Result<Propagated<D::Wide>, Unlinearised> {
        if !(W::IS_DIFFERENTIAL && moves_fields_alone(system)) {
            return step.with(system, |piece| self.propagate(system.wide(), piece, columns));
        }
        let propagated = || {
            let both = self.both(system, [&step.x, &step.end], step.h, true)?;
            let a = both.factored()?;
            let along = end_along_parameters(system, [&step.x, &step.end], &both, &a)?;
            let (j, along_h) = (both.derivative(&a)?, both.along_h(&a)?);
            Some(with_parameters::<D>(columns, &j, (&along, &along_h)))
        };
        propagated().ok_or(Unlinearised::Singular)
    }

    fn pull_back_along(
        &self,
        system: &D,
        step: &Part<D>,
        costate: &Vector<<D::Wide as Metriplectic>::Manifold>,
    ) -> Result<Vector<<D::Wide as Metriplectic>::Manifold>, Unlinearised> {
        if !(W::IS_DIFFERENTIAL && moves_fields_alone(system)) {
            return step.with(system, |piece| self.pull_back(system.wide(), piece, costate));
        }
        let both = self.both(system, [&step.x, &step.end], step.h, true);
        let both = both.ok_or(Unlinearised::Singular)?;
        pulled_back(system, [&step.x, &step.end], &both, costate)
    }
}
