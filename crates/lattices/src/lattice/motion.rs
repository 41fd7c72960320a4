//! Sums over sites and bonds: the velocity, and the friction in it.

use metriplectic_fields::Column;

use super::{AtSites, Differentials, Given, Lattice, dimension};
use crate::double::Double;
use crate::model::{Model, PointOf, VectorOf};
use crate::onsager::Onsager;
use crate::vector::SiteVector;

/// The differentials of energy and entropy at a site.
type Both<'a, P> = [&'a VectorOf<P>; 2];

impl<P: Model> Lattice<P> {
    /// Visits the terms of the friction at a site, with the differentials there.
    #[inline(always)]
    pub(crate) fn site_terms(
        &self,
        site: usize,
        (x, all): (&[PointOf<P>], AtSites<'_, P>),
        mut visit: impl FnMut(Both<'_, P>, Onsager<VectorOf<P>>),
    ) {
        let [w, s] = all.at(site);
        self.parts.site_friction(site, &x[site], [&w, &s], |term| visit([&w, &s], term));
    }

    /// Visits the terms of the friction in a bond, with the differentials at its sites.
    #[inline(always)]
    pub(crate) fn bond_terms(
        &self,
        bond: usize,
        (x, all): (&[PointOf<P>], AtSites<'_, P>),
        mut visit: impl FnMut([Both<'_, P>; 2], Onsager<[VectorOf<P>; 2]>),
    ) {
        let [i, j] = self.layout.bonds()[bond];
        let (i, j) = (i as usize, j as usize);
        let ([wi, si], [wj, sj]) = (all.at(i), all.at(j));
        let both = [[&wi, &si], [&wj, &sj]];
        self.parts.bond_friction(bond, [&x[i], &x[j]], both, |term| visit(both, term));
    }

    /// The velocity `v = Π w + Σ K s` at each site and the total production `Σ ρ (b·s)²`; `None` if a term is not a
    /// number. Without `REVERSIBLE` it is the one of the friction alone.
    pub(crate) fn motion_along<const REVERSIBLE: bool>(
        &self,
        x: &[PointOf<P>],
        all: &Differentials,
    ) -> Option<(SiteVector, f64)> {
        let all = all.reader::<P>();
        let mut v = self.vectors.numbers(self.sites() * dimension::<P>());
        let bonds = self.layout.bonds();
        let given = if P::BOND_FRICTION { Given::Vector } else { Given::Nothing };
        let partial = self.layout.scatter(&mut v, &mut self.slots(given), |mut part| {
            // The second sum is not a number if a term is not finite.
            let (mut production, mut probe) = (0.0, 0.0);
            for site in part.sites.clone() {
                let [w, s] = all.at(site);
                let mut v = if REVERSIBLE {
                    self.parts.reversible(&x[site], &w, &s)
                } else {
                    VectorOf::<P>::zero()
                };
                self.parts.site_friction(site, &x[site], [&w, &s], |term| {
                    let force = term.b.dot(&s);
                    v += term.b * (term.rate * force);
                    production += term.rate * force * force;
                });
                probe += probed(&v);
                part.set(site, 0, &v);
            }
            if P::BOND_FRICTION {
                for bond in part.bonds.clone() {
                    let ends = bonds[bond];
                    let [i, j] = ends.map(|site| site as usize);
                    let ([wi, si], [wj, sj]) = (all.at(i), all.at(j));
                    let mut v = [VectorOf::<P>::zero(); 2];
                    self.parts.bond_friction(
                        bond,
                        [&x[i], &x[j]],
                        [[&wi, &si], [&wj, &sj]],
                        |term| {
                            let [bi, bj] = term.b;
                            let force = bi.dot(&si) + bj.dot(&sj);
                            v[0] += bi * (term.rate * force);
                            v[1] += bj * (term.rate * force);
                            production += term.rate * force * force;
                        },
                    );
                    probe += probed(&v[0]) + probed(&v[1]);
                    part.add(ends, &[v]);
                }
            }
            [production, probe]
        });
        let partial = partial.into_iter().map(|[part, probe]| {
            let mut production = Double::default();
            production.add(part);
            (production, probe)
        });
        let sum = self.layout.sum(partial.collect(), |mut a: (Double, f64), b| {
            a.0.merge(b.0);
            (a.0, a.1 + b.1)
        });
        let (production, probe) = sum.unwrap_or_default();
        let production = production.value();
        let is_finite = !f64::is_nan(probe) && production.is_finite();
        is_finite.then(|| (self.vector(v), production))
    }
}

/// Zero for finite numbers, and not a number otherwise.
#[inline]
pub(crate) fn probed<V: Column<f64>>(v: &V) -> f64 {
    let mut sum = 0.0;
    for k in 0..V::LEN {
        sum += v[k];
    }
    sum * 0.0
}
