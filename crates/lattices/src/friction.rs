//! The terms of the friction, place by place: `ρ ≥ 0` and `⟨b, dH⟩ = 0` at each site and on each bond.

use metriplectic_fields::Column;

use crate::Onsager;
use crate::error::{LatticeError, Place, Tried};
use crate::lattice::{AtSites, Differentials, Lattice};
use crate::model::{Model, PointOf, VectorOf};
use crate::parallel;
use crate::points::Points;
use crate::report::{LatticeLaw, Laws, RATES};
use crate::verify::cancels;

const ANNIHILATES: &str =
    "; build each b from the differentials of the energy that the closure is given";

/// A term `ρ b bᵀ` at one place.
pub(crate) struct Term {
    place: Place,
    /// `ρ`.
    rate: f64,
    /// `⟨b, dH⟩` and the sizes of its terms.
    along_energy: [f64; 2],
    /// `⟨b, dS⟩`.
    force: f64,
}

impl Term {
    /// The entropy `ρ⟨b, dS⟩²` that it produces in a unit of time.
    pub(crate) fn production(&self) -> f64 {
        self.rate * self.force * self.force
    }

    /// # Errors
    ///
    /// [`LatticeError::NegativeRate`].
    pub(crate) fn negative_rate(&self, tried: Tried, laws: &mut Laws) -> Result<(), LatticeError> {
        let &Self { place, rate, .. } = self;
        let found = || LatticeLaw::new(RATES, [(-rate).max(0.0), 0.0], place);
        laws.note(found, rate >= 0.0 || rate.is_nan(), || LatticeError::NegativeRate {
            place,
            tried,
            rate,
            entries: Vec::new(),
        })
    }

    /// # Errors
    ///
    /// [`LatticeError::Broken`] if it changes the energy.
    pub(crate) fn keeps_energy(&self, tried: Tried, laws: &mut Laws) -> Result<(), LatticeError> {
        let law = match self.place {
            Place::Bond { .. } => "b·(dH_i, dH_j) = 0",
            Place::Site(_) | Place::Total => "b·dH = 0",
        };
        cancels((law, ANNIHILATES), (self.place, tried), self.along_energy, laws)
    }
}

impl<P: Model> Lattice<P> {
    /// Checks every term of the friction, and returns the first error in the order of the places.
    ///
    /// # Errors
    ///
    /// The first one of `check`.
    pub(crate) fn each_term(
        &self,
        x: &Points<P::Manifold>,
        all: &Differentials,
        laws: &mut Laws,
        check: impl Fn(&Term, &mut Laws) -> Result<(), LatticeError> + Sync,
    ) -> Result<(), LatticeError> {
        let nothing = laws.fresh();
        let begin = || (nothing.clone(), Ok(()));
        let chunks = self.terms_of_chunks(x, all, begin, |(laws, verdict), term| {
            if verdict.is_ok() {
                *verdict = check(&term, laws);
            }
        });
        let mut first = Ok(());
        for (seen, verdict) in chunks {
            laws.merge(seen);
            first = first.and(verdict);
        }
        first
    }

    /// The results of visits to the terms of each chunk of sites and of bonds.
    pub(crate) fn terms_of_chunks<R: Send>(
        &self,
        x: &Points<P::Manifold>,
        all: &Differentials,
        begin: impl Fn() -> R + Sync,
        visit: impl Fn(&mut R, Term) + Sync,
    ) -> Vec<R> {
        let at = (&**x, all.reader::<P>());
        let mut results = parallel::map(self.sites(), |sites| {
            let mut result = begin();
            sites.for_each(|site| self.look_at_site(site, at, |term| visit(&mut result, term)));
            result
        });
        if P::BOND_FRICTION {
            results.extend(parallel::map(self.layout.bonds().len(), |bonds| {
                let mut result = begin();
                bonds.for_each(|bond| self.look_at_bond(bond, at, |term| visit(&mut result, term)));
                result
            }));
        }
        results
    }

    fn look_at_site(
        &self,
        site: usize,
        at: (&[PointOf<P>], AtSites<'_, P>),
        mut visit: impl FnMut(Term),
    ) {
        self.site_terms(site, at, |[w, s], Onsager { rate, b }| {
            let along_energy = [b.dot(w), b.abs().dot(&w.abs())];
            visit(Term { place: Place::Site(site), rate, along_energy, force: b.dot(s) });
        });
    }

    fn look_at_bond(
        &self,
        bond: usize,
        at: (&[PointOf<P>], AtSites<'_, P>),
        mut visit: impl FnMut(Term),
    ) {
        let place = self.place_of(bond);
        let dot = |[bi, bj]: &[VectorOf<P>; 2], [i, j]: [&VectorOf<P>; 2]| bi.dot(i) + bj.dot(j);
        self.bond_terms(bond, at, |[[wi, si], [wj, sj]], Onsager { rate, b }| {
            let terms = dot(&b.map(|b| b.abs()), [&wi.abs(), &wj.abs()]);
            let along_energy = [dot(&b, [wi, wj]), terms];
            visit(Term { place, rate, along_energy, force: dot(&b, [si, sj]) });
        });
    }
}
