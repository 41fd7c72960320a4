//! The friction of all sites and bonds: `ρ ≥ 0` and `b·dH = 0`.

use metriplectic_fields::Column;

use super::cancels;
use crate::error::{LatticeError, Place, Tried};
use crate::lattice::{Lattice, differentials_at};
use crate::model::Model;
use crate::parallel;
use crate::points::Points;

const ANNIHILATES: &str =
    "; build each b from the differentials of the energy that the closure is given";

impl<P: Model> Lattice<P> {
    /// Verifies the terms of the friction at a state, in `O(N)`.
    pub(super) fn verify_friction(
        &self,
        x: &Points<P::Manifold>,
        tried: Tried,
    ) -> Result<(), LatticeError> {
        let (all, _) = self.differentials::<false>(x);
        let at = |site| self.verify_site_friction(site, x, &all, tried);
        parallel::map(self.sites(), |mut sites| sites.try_for_each(at))
            .into_iter()
            .collect::<Result<(), _>>()?;
        if !P::BOND_FRICTION {
            return Ok(());
        }
        let on = |bond| self.verify_bond_friction(bond, x, &all, tried);
        let bonds = self.layout.bonds().len();
        parallel::map(bonds, |mut bonds| bonds.try_for_each(on)).into_iter().collect()
    }

    fn verify_site_friction(
        &self,
        site: usize,
        x: &Points<P::Manifold>,
        all: &[f64],
        tried: Tried,
    ) -> Result<(), LatticeError> {
        let ([w, s], at) = (differentials_at::<P>(all, site), (Place::Site(site), tried));
        let mut first = Ok(());
        self.parts.site_friction(site, &x[site], [&w, &s], |term| {
            let rest_and_terms = [term.b.dot(&w), term.b.abs().dot(&w.abs())];
            let checked = rate(term.rate, at)
                .and_then(|()| cancels("b·dH = 0", at, rest_and_terms, ANNIHILATES));
            if first.is_ok() {
                first = checked;
            }
        });
        first
    }

    fn verify_bond_friction(
        &self,
        bond: usize,
        x: &Points<P::Manifold>,
        all: &[f64],
        tried: Tried,
    ) -> Result<(), LatticeError> {
        let [i, j] = self.layout.bonds()[bond].map(|site| site as usize);
        let [[wi, si], [wj, sj]] = [i, j].map(|site| differentials_at::<P>(all, site));
        let at = (self.place_of(bond), tried);
        let mut first = Ok(());
        self.parts.bond_friction(bond, [&x[i], &x[j]], [[&wi, &si], [&wj, &sj]], |term| {
            let [bi, bj] = term.b;
            let rest = bi.dot(&wi) + bj.dot(&wj);
            let terms = bi.abs().dot(&wi.abs()) + bj.abs().dot(&wj.abs());
            let checked = rate(term.rate, at)
                .and_then(|()| cancels("b·(dH_i, dH_j) = 0", at, [rest, terms], ANNIHILATES));
            if first.is_ok() {
                first = checked;
            }
        });
        first
    }
}

fn rate(rate: f64, (place, tried): (Place, Tried)) -> Result<(), LatticeError> {
    if rate < 0.0 { Err(LatticeError::NegativeRate { place, tried, rate }) } else { Ok(()) }
}
