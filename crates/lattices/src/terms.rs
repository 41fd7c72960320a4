//! The sizes of the terms that the velocities of a lattice are summed of.

use metriplectic_fields::Column;
use metriplectic_integrators::{Flow as _, Vector as _};

use crate::lattice::{Lattice, differentials_at, dimension};
use crate::model::{Model, VectorOf};
use crate::parallel;
use crate::points::Points;
use crate::random::Use;
use crate::vector::SiteVector;

/// The displacement of a difference quotient, relative to the sizes of the entries.
const STEP: f64 = 1e-6;

impl<P: Model> Lattice<P> {
    fn largest(&self, f: impl Fn(usize) -> VectorOf<P> + Sync) -> VectorOf<P> {
        let max = |a: VectorOf<P>, b: VectorOf<P>| VectorOf::<P>::from_index(|k| a[k].max(b[k]));
        let zero = VectorOf::<P>::zero();
        let parts = parallel::map(self.sites(), |sites| sites.map(&f).fold(zero, max));
        parts.into_iter().fold(zero, max)
    }

    /// The sizes of the terms that a velocity is summed of: `Σ_j |Π_kj||w_j|` with the terms of `w` apart, those of
    /// the friction, and what the rounding of the entries makes of it.
    pub(crate) fn terms(
        &self,
        x: &Points<P::Manifold>,
        v: &SiteVector,
        sizes: &SiteVector,
    ) -> Option<SiteVector> {
        let n = dimension::<P>();
        let (all, _) = self.differentials::<false>(x);
        let bonds = self.layout.bonds();
        let mut forces = self.largest(|site| self.parts.energy(site, &x[site]).df.abs());
        let mut friction = VectorOf::<P>::zero();
        for (bond, ends) in bonds.iter().enumerate() {
            let [i, j] = ends.map(|site| site as usize);
            if P::BOND_ENERGY {
                let pair = (x[i].clone(), x[j].clone());
                let df = self.parts.bond_energy(bond, &pair).df;
                for k in 0..n {
                    forces[k] = forces[k].max(2.0 * df[k].abs().max(df[n + k].abs()));
                }
            }
            self.bond_terms(bond, (x, all.reader()), |[[_, si], [_, sj]], term| {
                let [bi, bj] = term.b.map(|b| b.abs());
                let force = term.rate * (bi.dot(&si.abs()) + bj.dot(&sj.abs()));
                for k in 0..n {
                    friction[k] = friction[k].max(2.0 * force * bi[k].max(bj[k]));
                }
            });
        }
        let reversible = self.largest(|site| {
            let [_, s] = differentials_at::<P>(&all, site);
            (0..n).fold(VectorOf::<P>::zero(), |sum, j| {
                let column = VectorOf::<P>::basis(j) * forces[j];
                sum + self.parts.reversible(&x[site], &column, &s).abs()
            })
        });
        let irregular = self.irregular(Use::Rounding, v);
        let noise = SiteVector::zip([&irregular, sizes], |[next, size]| next * size * STEP);
        let there = self.rates(x, &noise)?;
        let change = SiteVector::zip([&there, v], |[there, v]| (there - v) * STEP.recip());
        let rounded = change.by_kind();
        let terms = VectorOf::<P>::from_index(|k| reversible[k] + friction[k] + rounded.get(k));
        Some(self.same(&terms))
    }
}
