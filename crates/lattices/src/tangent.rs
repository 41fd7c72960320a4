//! The derivatives of runs of lattices, by differences of steps.

use metriplectic_fields::{Column as _, Real, Space, Vector as Components};
use metriplectic_integrators::tangent::{
    Differentiated, LawRows, SmoothFlow, between, smooth_open_flow,
};
use metriplectic_integrators::{Element, Stepper};
use nalgebra::{DMatrix, DVector};

use crate::lattice::{Lattice, differentials_at, dimension};
use crate::model::{Model, VectorOf};
use crate::open::OpenLattice;
use crate::points::Points;

/// A point with derivatives for each site.
type Moving<P> = Vec<<<P as Model>::Manifold as Space>::Point<Real>>;

/// Writes the part of a site of a covector.
fn put<P: Model>(df: &VectorOf<P>, site: usize, row: &mut DVector<f64>) {
    (0..dimension::<P>()).for_each(|k| row[site * dimension::<P>() + k] = df[k]);
}

impl<P: Model> SmoothFlow for Lattice<P> {
    type Moving = Moving<P>;

    fn directions(&self) -> usize {
        self.sites() * dimension::<P>()
    }

    fn law_rows(&self, x: &Points<P::Manifold>) -> LawRows<DVector<f64>> {
        let (jets, zero) = (self.jets(x), DVector::zeros(self.directions()));
        let [mut energy, mut entropy] = [zero.clone(), zero.clone()];
        let mut sums = vec![zero; P::SUMS];
        for site in 0..self.sites() {
            let [dh, ds] = differentials_at::<P>(&jets.all, site);
            put::<P>(&dh, site, &mut energy);
            put::<P>(&ds, site, &mut entropy);
            for (k, sum) in sums.iter_mut().enumerate() {
                put::<P>(&self.parts.sum(k, site, &x[site]).df, site, sum);
            }
        }
        LawRows::new(energy, entropy, sums)
    }

    fn turn(&self, from: &Points<P::Manifold>, to: &Points<P::Manifold>) -> Option<DMatrix<f64>> {
        if P::Manifold::IS_VECTOR_SPACE || from == to {
            return None;
        }
        let (n, d) = (self.directions(), dimension::<P>());
        let mut whole = DMatrix::identity(n, n);
        for site in 0..self.sites() {
            let Some(turn) = between::<P::Manifold>(&from[site], &to[site]) else { continue };
            for (i, j) in (0..d).flat_map(|i| (0..d).map(move |j| (i, j))) {
                whole[(site * d + i, site * d + j)] = turn[(i, j)];
            }
        }
        Some(whole)
    }

    /// In `⌈n/2⌉` evaluations for `n` directions of all sites.
    fn differential(
        &self,
        f: &dyn Fn(&Moving<P>) -> Real,
        x: &Points<P::Manifold>,
    ) -> (f64, DVector<f64>) {
        let n = self.directions();
        let (mut df, mut value) = (DVector::zeros(n), 0.0);
        for i in (0..n).step_by(2) {
            let part = |k: usize, direction: usize| if k == direction { 1.0 } else { 0.0 };
            let there = f(&moved::<P>(x, |k| Real::new(0.0, part(k, i), part(k, i + 1), 0.0)));
            (value, df[i]) = (there.re, there.eps1);
            if let Some(next) = df.get_mut(i + 1) {
                *next = there.eps2;
            }
        }
        (value, df)
    }

    fn moving(&self, x: &Points<P::Manifold>, v: &DVector<f64>) -> Moving<P> {
        moved::<P>(x, |k| Real::new(0.0, v[k], 0.0, 0.0))
    }

    fn coordinates(&self, y: &Points<P::Manifold>, there: &Moving<P>) -> Vec<[f64; 2]> {
        let sites = y.iter().zip(there).flat_map(|(y, there)| {
            let q = P::Manifold::coordinates(y, there);
            (0..dimension::<P>()).map(move |k| [q[k].re, q[k].eps1])
        });
        sites.collect()
    }
}

/// The points that are displaced by these numbers, one for each direction of all sites.
fn moved<P: Model>(x: &Points<P::Manifold>, q: impl Fn(usize) -> Real) -> Moving<P> {
    let site = |(site, x): (usize, &<P::Manifold as Space>::Point<f64>)| {
        let q = |k| q(site * dimension::<P>() + k);
        P::Manifold::chart(x, &Components::<P::Manifold, Real>::from_index(q))
    };
    x.iter().enumerate().map(site).collect()
}

/// By differences of steps.
impl<P: Model, M: Stepper<Self>> Differentiated<M> for Lattice<P> {
    type MovingWide = Moving<P>;

    fn moved_along(&self, x: &Element<Self>, v: &DVector<f64>) -> Moving<P> {
        self.moving(x, v)
    }

    fn coordinates_around(&self, y: &Element<Self>, there: &Moving<P>) -> Vec<[f64; 2]> {
        SmoothFlow::coordinates(self, y, there)
    }
}

smooth_open_flow! { [P: Model] OpenLattice<P>, moving: Moving<P> }
