//! The tangents of retractions: those of their schemes with the default options.

use metriplectic_dynamics::{Differentiable, Metriplectic};
use metriplectic_fields::Vector;
use metriplectic_manifolds::{Cayley, ChartMidpoint, Projection, WeylMidpoint};

use super::along::LinearisedAlong;
use super::columns::Columns;
use super::error::Unlinearised;
use super::linearised::{Linearised, Piece, Propagated};
use super::part::Part;
use crate::midpoint::Scheme;

macro_rules! by_default {
    ($($retraction:ty),+) => {$(
        impl<Y: Metriplectic> Linearised<Y> for $retraction
        where
            Scheme<Self>: Linearised<Y>,
        {
            const SMOOTH_AT_REST: bool = <Scheme<Self> as Linearised<Y>>::SMOOTH_AT_REST;

            fn propagate(
                &self,
                system: &Y,
                step: &Piece<'_, Y>,
                columns: &Columns<Y>,
            ) -> Result<Propagated<Y>, Unlinearised> {
                Scheme::new(*self).propagate(system, step, columns)
            }

            fn entropy_law(
                &self,
                system: &Y,
                step: &Piece<'_, Y>,
                column: [&Vector<Y::Manifold>; 2],
            ) -> Option<f64> {
                Scheme::new(*self).entropy_law(system, step, column)
            }

            fn pull_back(
                &self,
                system: &Y,
                step: &Piece<'_, Y>,
                costate: &Vector<Y::Manifold>,
            ) -> Result<Vector<Y::Manifold>, Unlinearised> {
                Scheme::new(*self).pull_back(system, step, costate)
            }
        }

        impl<D: Differentiable> LinearisedAlong<D> for $retraction
        where
            Self: Linearised<D::Wide>,
            Scheme<Self>: LinearisedAlong<D>,
        {
            fn propagate_along(
                &self,
                system: &D,
                step: &Part<D>,
                columns: &Columns<D::Wide>,
            ) -> Result<Propagated<D::Wide>, Unlinearised> {
                Scheme::new(*self).propagate_along(system, step, columns)
            }

            fn pull_back_along(
                &self,
                system: &D,
                step: &Part<D>,
                costate: &Vector<<D::Wide as Metriplectic>::Manifold>,
            ) -> Result<Vector<<D::Wide as Metriplectic>::Manifold>, Unlinearised> {
                Scheme::new(*self).pull_back_along(system, step, costate)
            }
        }
    )+};
}
by_default!(WeylMidpoint, ChartMidpoint, Projection, Cayley);
