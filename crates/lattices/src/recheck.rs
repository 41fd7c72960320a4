//! The laws of friction and of the bracket on every site and bond, at a state that a run has reached.
//!
//! They are checked at the end of a run and where a step fails: on the way they would cost `O(N)` and say less than
//! the laws of the totals, which every step keeps.

use metriplectic_fields::Column;

use crate::Onsager;
use crate::error::{LatticeError, Place, Tried};
use crate::lattice::{Lattice, differentials_at};
use crate::model::{Model, VectorOf};
use crate::points::Points;

/// What is left of terms that should cancel, relative to them. It is ten times that at the start.
const CANCELS: f64 = 1e-8;

/// The entropy that a negative rate destroys, relative to all production, that is round-off.
const DESTROYED: f64 = 1e-8;

/// A term of friction at one place.
struct Term {
    place: Place,
    rate: f64,
    /// `⟨b, dH⟩` and the sizes of its terms.
    along_energy: [f64; 2],
    /// `⟨b, dS⟩`.
    force: f64,
}

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
        let (all, _) = self.differentials::<false>(x);
        for site in 0..self.sites() {
            let [w, s] = differentials_at::<P>(&all, site);
            let v = self.parts.reversible(&x[site], &w, &s);
            broken("Π dS = 0", Place::Site(site), [s.dot(&v), s.abs().dot(&v.abs())])?;
        }
        let mut production = 0.0;
        self.each_term(x, &all, |term| {
            production += (term.rate * term.force * term.force).abs();
            Ok(())
        })?;
        self.each_term(x, &all, |Term { place, rate, along_energy, force }| {
            broken("b·dH = 0", place, along_energy)?;
            if rate < 0.0 && -rate * force * force > DESTROYED * production {
                return Err(LatticeError::NegativeRate { place, tried: Tried::Reached, rate });
            }
            Ok(())
        })
    }

    /// Visits every term of friction until one is refused.
    fn each_term(
        &self,
        x: &Points<P::Manifold>,
        all: &[f64],
        mut visit: impl FnMut(Term) -> Result<(), LatticeError>,
    ) -> Result<(), LatticeError> {
        let mut result = Ok(());
        for site in 0..self.sites() {
            let [w, s] = differentials_at::<P>(all, site);
            self.parts.site_friction(site, &x[site], [&w, &s], |Onsager { rate, b }| {
                let along_energy = [b.dot(&w), b.abs().dot(&w.abs())];
                if result.is_ok() {
                    let place = Place::Site(site);
                    result = visit(Term { place, rate, along_energy, force: b.dot(&s) });
                }
            });
        }
        if !P::BOND_FRICTION {
            return result;
        }
        for (bond, ends) in self.layout.bonds().iter().enumerate() {
            let [i, j] = ends.map(|site| site as usize);
            let [[wi, si], [wj, sj]] = [i, j].map(|site| differentials_at::<P>(all, site));
            let dot = |b: &[VectorOf<P>; 2], ends: [&VectorOf<P>; 2]| {
                b[0].dot(ends[0]) + b[1].dot(ends[1])
            };
            let state = [[&wi, &si], [&wj, &sj]];
            self.parts.bond_friction(bond, [&x[i], &x[j]], state, |Onsager { rate, b }| {
                let terms = dot(&b.map(|b| b.abs()), [&wi.abs(), &wj.abs()]);
                let along_energy = [dot(&b, [&wi, &wj]), terms];
                if result.is_ok() {
                    let (place, force) = (self.place_of(bond), dot(&b, [&si, &sj]));
                    result = visit(Term { place, rate, along_energy, force });
                }
            });
        }
        result
    }
}

/// A law whose terms do not cancel.
fn broken(law: &'static str, place: Place, [rest, terms]: [f64; 2]) -> Result<(), LatticeError> {
    if rest.abs() > CANCELS * terms + f64::MIN_POSITIVE {
        let size = rest.abs() / terms;
        return Err(LatticeError::Broken { law, place, tried: Tried::Reached, size, remedy: "" });
    }
    Ok(())
}
