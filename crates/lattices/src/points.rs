//! States of a lattice.

use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};
use std::sync::Arc;

use metriplectic_integrators::StateSpace;
use metriplectic_manifolds::Manifold;

use crate::pool::{Buffer, Pool};

/// The space of the states of a lattice: a point of `M` for each site.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sites<M>(PhantomData<M>);

impl<M: Manifold> StateSpace for Sites<M> {
    type Element = Points<M>;

    /// The entries of all points, site by site.
    fn numbers(x: &Points<M>) -> Vec<f64> {
        x.iter().flat_map(M::entries).collect()
    }
}

/// A point for each site, in the order of the sites; made by [`Lattice::points`](crate::Lattice::points). It is a
/// slice of points. Copies share their points until one is changed.
#[derive(Clone, Debug, PartialEq)]
pub struct Points<M: Manifold>(Arc<Buffer<M::Point<f64>>>);

impl<M: Manifold> Points<M> {
    /// As many points, which mean nothing yet.
    pub(crate) fn like(&self) -> Self {
        Self(Arc::new(self.0.pool().take(self.len(), || self.to_vec())))
    }

    /// Gives up the arrays of other states that are used no more.
    pub(crate) fn clear_others(&self) {
        self.0.pool().clear();
    }
}

/// Points that come from elsewhere.
impl<M: Manifold> From<Vec<M::Point<f64>>> for Points<M> {
    fn from(points: Vec<M::Point<f64>>) -> Self {
        Self(Arc::new(Pool::default().adopt(points)))
    }
}

impl<M: Manifold> Deref for Points<M> {
    type Target = [M::Point<f64>];

    #[inline]
    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl<M: Manifold> DerefMut for Points<M> {
    #[inline]
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut *Arc::make_mut(&mut self.0)
    }
}
