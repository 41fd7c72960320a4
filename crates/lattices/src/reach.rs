//! How far the entries of a lattice move soon.
//!
//! An entry that is zero at all sites has no size yet. It gets the largest displacement in a step of the classical
//! method of order 4 over a quarter of the shortest time of the motion: of the span of the run, and of the times in
//! which entries and velocities change by their own size. The same numbers serve all sites.

use metriplectic_fields::Column;
use metriplectic_integrators::{Flow as _, Scales, Vector as _};

use crate::lattice::{Lattice, differentials_at, dimension};
use crate::model::{Model, VectorOf};
use crate::parallel;
use crate::points::Points;
use crate::random::Random;
use crate::vector::SiteVector;

/// How often the time is cut, if the step leaves the domain.
const CUTS: usize = 10;
/// The displacement of a difference quotient, relative to the sizes of the entries.
const STEP: f64 = 1e-6;

impl<P: Model> Lattice<P> {
    /// The sizes that the entries reach soon; `None` if nothing moves.
    pub(crate) fn sizes_soon(
        &self,
        x: &Points<P::Manifold>,
        span: f64,
    ) -> Option<Scales<SiteVector>> {
        let sizes = self.largest_sizes(x);
        let origin = self.same(&VectorOf::<P>::zero());
        let v = self.rates(x, &origin)?;
        let speeds = self.largest_entries(&v);
        let mut time = span;
        for k in 0..dimension::<P>() {
            if sizes[k] > 0.0 && speeds[k] > 0.0 {
                time = time.min(sizes[k] / speeds[k]);
            }
        }
        let ahead = |v: &SiteVector, t: f64| v.map(|v| t * v);
        if let Some(there) = self.rates(x, &ahead(&v, STEP * time)) {
            let change = SiteVector::zip([&there, &v], |[there, v]| there - v);
            let changes = self.largest_entries(&change);
            for k in 0..dimension::<P>() {
                let bend = STEP * time * (speeds[k] / changes[k]);
                if bend > 0.0 {
                    time = time.min(bend);
                }
            }
        }
        let mut h = 0.25 * time;
        let end = (0..CUTS).find_map(|_| {
            let end = self.classical_step(x, &v, h);
            h *= 0.25;
            end
        })?;
        let reached = self.largest_entries(&end);
        let soon = VectorOf::<P>::from_index(|k| sizes[k].max(reached[k]));
        let terms = self.terms(x, &v, &soon)?;
        (soon.is_finite() && terms.is_finite())
            .then(|| Scales { sizes: self.same(&soon), terms: self.same(&terms) })
    }

    /// The displacement of a step of the classical Runge-Kutta method; `None` if it leaves the domain.
    fn classical_step(
        &self,
        x: &Points<P::Manifold>,
        v: &SiteVector,
        h: f64,
    ) -> Option<SiteVector> {
        let second = self.rates(x, &v.map(|v| 0.5 * h * v))?;
        let third = self.rates(x, &second.map(|v| 0.5 * h * v))?;
        let last = self.rates(x, &third.map(|v| h * v))?;
        Some(SiteVector::zip([v, &second, &third, &last], |[first, second, third, last]| {
            (first + (second + third) * 2.0 + last) * (h / 6.0)
        }))
    }

    /// The largest absolute value of each entry.
    fn largest_entries(&self, v: &SiteVector) -> VectorOf<P> {
        let reader = v.reader();
        self.largest(|site| reader.at::<VectorOf<P>>(site).abs())
    }

    fn largest(&self, f: impl Fn(usize) -> VectorOf<P> + Sync) -> VectorOf<P> {
        let max = |a: VectorOf<P>, b: VectorOf<P>| VectorOf::<P>::from_index(|k| a[k].max(b[k]));
        let zero = VectorOf::<P>::zero();
        let parts = parallel::map(self.sites(), |sites| sites.map(&f).fold(zero, max));
        parts.into_iter().fold(zero, max)
    }

    /// The sizes of the terms that a velocity is summed of: `Σ_j |Π_kj||w_j|` with the terms of `w` apart, those of
    /// the friction, and what the rounding of the entries makes of it.
    fn terms(
        &self,
        x: &Points<P::Manifold>,
        v: &SiteVector,
        sizes: &VectorOf<P>,
    ) -> Option<VectorOf<P>> {
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
            let [[wi, si], [wj, sj]] = [i, j].map(|site| differentials_at::<P>(&all, site));
            self.parts.bond_friction(bond, [&x[i], &x[j]], [[&wi, &si], [&wj, &sj]], |term| {
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
        let mut random = Random::new(2);
        let noise = v.with(|i| random.next() * sizes[i % n] * STEP);
        let there = self.rates(x, &noise)?;
        let change = SiteVector::zip([&there, v], |[there, v]| (there - v) * STEP.recip());
        let rounded = self.largest_entries(&change);
        Some(VectorOf::<P>::from_index(|k| reversible[k] + friction[k] + rounded[k]))
    }
}
