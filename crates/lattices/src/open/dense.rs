//! Ports and baths in an implicit step of an open lattice.

use metriplectic_fields::Column as _;

use super::OpenLattice;
use super::parts::Exchanged;
use crate::dense::{column, put};
use crate::flow::listed;
use crate::model::{Model, VectorOf};

impl<P: Model> OpenLattice<P> {
    /// The effects of ports and baths with these covectors `w_H` and `w_S` of energy and entropy.
    ///
    /// A port carries no entropy, `⟨dS, F⟩ = 0`. Where `w_S` is a discrete gradient it differs from the differential, and in a step
    /// a port has the velocity `F − ♯w_S ⟨w_S, F⟩/⟨w_S, ♯w_S⟩`, as in a typed system.
    pub(super) fn exchanged_in_a_step(
        &self,
        t: f64,
        x: &[f64],
        [w, s]: [&[f64]; 2],
    ) -> Exchanged<VectorOf<P>> {
        let at = |site: usize| [w, s].map(|w| column::<P>(w, site));
        let mut exchanged = self.exchanged_with(t, &listed::<P::Manifold>(x), at);
        let along_entropy = |a: &[f64]| s.iter().zip(a).map(|(s, a)| s * a).sum::<f64>();
        let [square, warmed] = [s, w].map(along_entropy);
        let (mut entry, mut fraction, count) = (0, 0.0, exchanged.velocities.len());
        for (k, part) in self.parts.iter().enumerate() {
            let end = exchanged.firsts.get(k + 1).copied().unwrap_or(count);
            let own = &exchanged.velocities[exchanged.firsts[k]..end];
            let carried: f64 = own.iter().map(|(site, v)| at(*site)[1].dot(v)).sum();
            if !part.is_bath() && carried != 0.0 {
                fraction += carried / square;
                exchanged.entries[entry] -= carried / square * warmed;
            }
            entry += if part.is_bath() { 2 } else { 1 };
        }
        if fraction != 0.0 {
            let along = |site: usize| (site, at(site)[1] * -fraction);
            exchanged.velocities.extend((0..self.lattice.sites()).map(along));
        }
        exchanged
    }

    /// Adds velocities at sites.
    pub(super) fn add_to(&self, v: &mut [f64], velocities: &[(usize, VectorOf<P>)]) {
        for &(site, more) in velocities {
            let sum = column::<P>(v, site) + more;
            put::<P>(&sum, site, v);
        }
    }
}
