//! The values and derivatives of what energy and entropy gather over bonds.

use metriplectic_fields::Space;

use super::{Slope, Trial, quotient};
use crate::error::{LatticeError, Place};
use crate::gather::{Embedded, Gather};
use crate::lattice::Lattice;
use crate::model::{Model, PairManifold};
use crate::parallel;
use crate::points::Points;
use crate::report::Laws;

impl<P: Model> Lattice<P> {
    /// Looks for values and derivatives of `φ` and `g` that are no numbers.
    pub(super) fn verify_gathered<G: Gather<P::Manifold>>(
        &self,
        what: &'static str,
        gather: &G,
        x: &Points<P::Manifold>,
    ) -> Result<(), LatticeError> {
        if !G::PRESENT {
            return Ok(());
        }
        let not_finite = |place| Err(LatticeError::NotFinite { what, place });
        let on = |bond: usize| {
            let is_finite = gather.weight(&self.pair(x, bond)).is_finite();
            if is_finite { Ok(()) } else { not_finite(self.place_of(bond)) }
        };
        let bonds = self.layout.bonds().len();
        parallel::map(bonds, |mut bonds| bonds.try_for_each(on))
            .into_iter()
            .collect::<Result<(), _>>()?;
        let sums = self.gathered(gather, x);
        let at = |site: usize| {
            let Embedded { jet, along_rho } = gather.embedded(&x[site], sums[2 * site]);
            let is_finite = jet.is_finite() && along_rho.is_finite();
            if is_finite { Ok(()) } else { not_finite(Place::Site(site)) }
        };
        parallel::map(self.sites(), |mut sites| sites.try_for_each(at)).into_iter().collect()
    }
}

impl<P: Model> Trial<'_, P> {
    /// Compares the derivatives of `φ` at these bonds, and those of `g` at these sites, with differences of values.
    pub(super) fn gathered_derivatives<G: Gather<P::Manifold>>(
        &self,
        of: (&'static str, &'static str),
        gather: &G,
        (sites, bonds): (impl Iterator<Item = usize>, impl Iterator<Item = usize>),
        laws: &mut Laws,
    ) -> Result<(), LatticeError> {
        if !G::PRESENT {
            return Ok(());
        }
        let lattice = self.lattice;
        let sums = lattice.gathered(gather, self.y);
        for bond in bonds {
            let x = lattice.pair(self.y, bond);
            let u = self.random_along(bond);
            let moved = |t: f64| PairManifold::<P>::chart(&x, &(u * t));
            let phi = gather.weight(&x);
            let (slope, at) = (Slope::of(&phi.df, &u), (lattice.place_of(bond), self.tried));
            quotient(of, at, (phi.value, slope), &|t| gather.weight(&moved(t)).value, laws)?;
        }
        for site in sites {
            let (x, rho) = (&self.y[site], sums[2 * site]);
            let at = (Place::Site(site), self.tried);
            let u = self.along(site);
            let moved = |t: f64| P::Manifold::chart(x, &(u * t));
            let g = gather.embedded(x, rho);
            let value = |t| gather.embedded(&moved(t), rho).jet.value;
            quotient(of, at, (g.jet.value, Slope::of(&g.jet.df, &u)), &value, laws)?;
            let sum = g.along_rho * rho;
            let value = |t: f64| gather.embedded(x, rho * (1.0 + t)).jet.value;
            quotient(of, at, (g.jet.value, Slope { sum, terms: sum.abs() }), &value, laws)?;
        }
        Ok(())
    }
}
