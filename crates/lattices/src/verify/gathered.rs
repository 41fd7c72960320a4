//! The derivatives of what energy and entropy gather over bonds.

use metriplectic_fields::{Column, Space, Vector};

use super::{STEP, Slope, Trial, quotient, samples};
use crate::error::{LatticeError, Place};
use crate::gather::Gather;
use crate::lattice::dimension;
use crate::model::{Model, PairManifold, VectorOf};

impl<P: Model> Trial<'_, P> {
    /// Compares the derivatives of `φ` at sampled bonds, and those of `g` at sampled sites, with differences of values.
    pub(super) fn gathered_derivatives<G: Gather<P::Manifold>>(
        &mut self,
        what: &'static str,
        gather: &G,
        sizes: &VectorOf<P>,
    ) -> Result<(), LatticeError> {
        if !G::PRESENT {
            return Ok(());
        }
        let (lattice, n) = (self.lattice, dimension::<P>());
        let sums = lattice.gathered(gather, self.y);
        for bond in samples(lattice.layout.bonds().len()) {
            let x = lattice.pair(self.y, bond);
            let both = Vector::<PairManifold<P>>::from_index(|k| sizes[k % n]);
            let u = self.random.vector(&both);
            let moved = |t: f64| PairManifold::<P>::chart(&x, &(u * t));
            let ends = [STEP, -STEP].map(|t| gather.weight(&moved(t)).value);
            let phi = gather.weight(&x);
            let slope = Slope::of(&phi.df, &u);
            quotient(what, lattice.place_of(bond), phi.value, slope, ends)?;
        }
        for site in samples(lattice.sites()) {
            let (x, rho, place) = (&self.y[site], sums[2 * site], Place::Site(site));
            let u = self.random.vector(sizes);
            let moved = |t: f64| P::Manifold::chart(x, &(u * t));
            let ends = [STEP, -STEP].map(|t| gather.embedded(&moved(t), rho).jet.value);
            let g = gather.embedded(x, rho);
            quotient(what, place, g.jet.value, Slope::of(&g.jet.df, &u), ends)?;
            let sum = g.along_rho * rho;
            let ends = [STEP, -STEP].map(|t| gather.embedded(x, rho * (1.0 + t)).jet.value);
            quotient(what, place, g.jet.value, Slope { sum, terms: sum.abs() }, ends)?;
        }
        Ok(())
    }
}
