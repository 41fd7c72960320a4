//! The laws of friction and of the bracket on every site and bond, at a state that a run has reached.
//!
//! They are checked at the end of a run and where a step fails: on the way they would cost `O(N)` and say less than
//! the laws of the totals, which every step keeps.

use metriplectic_fields::Column;

use crate::error::{LatticeError, Place, Tried};
use crate::lattice::{Lattice, differentials_at};
use crate::model::Model;
use crate::points::Points;
use crate::verify::cancels;

/// The entropy that a negative rate destroys, relative to all production, that is round-off.
const DESTROYED: f64 = 1e-8;

impl<P: Model> Lattice<P> {
    /// Checks `Π dS = 0` at every site, and `ρ ≥ 0` and `⟨b, dH⟩ = 0` for every term of friction.
    ///
    /// At an equilibrium `Π dH` and `b` may be all round-off. A law that is wrong is broken at a state nearby too.
    ///
    /// # Errors
    ///
    /// [`LatticeError::Broken`] or [`LatticeError::NegativeRate`], with its site or bond.
    pub(crate) fn recheck_all(&self, x: &Points<P::Manifold>) -> Result<(), LatticeError> {
        match self.recheck_at(x) {
            Err(found @ LatticeError::Broken { .. }) => {
                let (y, _) = self.near(x, &self.own_sizes(x));
                if self.recheck_at(&y).is_err() { Err(found) } else { Ok(()) }
            }
            verdict => verdict,
        }
    }

    /// Checks these laws at one state.
    fn recheck_at(&self, x: &Points<P::Manifold>) -> Result<(), LatticeError> {
        let tried = Tried::Reached;
        let (all, _) = self.differentials::<false>(x);
        for site in 0..self.sites() {
            let [w, s] = differentials_at::<P>(&all, site);
            let v = self.parts.reversible(&x[site], &w, &s);
            let rest_and_terms = [s.dot(&v), s.abs().dot(&v.abs())];
            cancels("Π dS = 0", (Place::Site(site), tried), rest_and_terms, "")?;
        }
        let production = self.sum_over_terms(x, &all, |term| term.production().abs());
        self.each_term(x, &all, |term| {
            term.keeps_energy(tried)?;
            let destroys = -term.production() > DESTROYED * production;
            if destroys { term.negative_rate(tried) } else { Ok(()) }
        })
    }
}
