//! The laws of the closures at a state that a run has reached.
//!
//! `Π dS = 0`, `ρ ≥ 0` and `⟨b, dH⟩ = 0` are checked on every site and bond. It costs two evaluations of the velocity,
//! at each 149th step of six or more evaluations. The derivatives of the closures are compared with their values at some
//! sites and bonds, at other ones after each step.

use metriplectic_fields::Column;

use crate::error::{LatticeError, Place, Tried};
use crate::friction::Term;
use crate::lattice::{Differentials, Lattice, differentials_at};
use crate::model::Model;
use crate::parallel;
use crate::points::Points;
use crate::random::{Random, Use};
use crate::report::Laws;
use crate::verify::{MOVED, NEARER, Sizes, Trial, cancels, casimir_remedy, golden, samples};

/// The entropy that a negative rate destroys, relative to all production, that is round-off.
const DESTROYED: f64 = 1e-8;

/// The sites, and the bonds, whose derivatives are compared on the way.
const LOOKED_AT: usize = 8;

/// Findings at the terms of the friction of a chunk.
#[derive(Default)]
struct Seen {
    broken: Option<Box<LatticeError>>,
    production: f64,
    negative: bool,
}

impl<P: Model> Lattice<P> {
    /// Checks the laws of all sites and bonds after a step, and derivatives at a few of them.
    ///
    /// # Errors
    ///
    /// Returns the errors of [`recheck_all`](Self::recheck_all).
    pub(crate) fn recheck_on_the_way(
        &self,
        x: &Points<P::Manifold>,
        step: usize,
    ) -> Result<(), LatticeError> {
        let mean = self.recheck_laws(x)?;
        let turns = |count: usize| {
            let first = step.wrapping_mul(LOOKED_AT);
            (0..LOOKED_AT.min(count)).map(move |k| golden(first.wrapping_add(k), count))
        };
        let [sites, bonds] = [self.sites(), self.layout.bonds().len()].map(turns);
        self.recheck_derivatives(x, mean, (sites, bonds))
    }

    /// Checks `Π dS = 0` at every site, `ρ ≥ 0` and `⟨b, dH⟩ = 0` for every term of friction, and the derivatives of
    /// the closures at up to 64 sites and bonds.
    ///
    /// At an equilibrium `Π dH` and `b` may be all round-off. A law that is wrong is broken at a state nearby too.
    ///
    /// # Errors
    ///
    /// [`LatticeError::Broken`], [`LatticeError::NegativeRate`] or [`LatticeError::WrongDerivative`], with its site or
    /// bond.
    pub(crate) fn recheck_all(&self, x: &Points<P::Manifold>) -> Result<(), LatticeError> {
        let mean = self.recheck_laws(x)?;
        let [sites, bonds] = [self.sites(), self.layout.bonds().len()].map(samples);
        self.recheck_derivatives(x, mean, (sites, bonds))
    }

    /// Checks the laws, and returns the sizes of energy and entropy of a site in the mean.
    fn recheck_laws(&self, x: &Points<P::Manifold>) -> Result<[f64; 2], LatticeError> {
        match self.recheck_at(x) {
            Err(found @ LatticeError::Broken { .. }) => {
                let sizes = self.own_sizes(x);
                let mut mean = None;
                // Friction that is wrong in a small region is right at a state beyond it.
                for fraction in [MOVED, NEARER * MOVED] {
                    match self.moved_near(fraction, x, &sizes).map(|y| self.recheck_at(&y)) {
                        Some(Err(_)) => return Err(found),
                        Some(Ok(here)) => mean = Some(here),
                        None => {}
                    }
                }
                mean.ok_or(found)
            }
            verdict => verdict,
        }
    }

    /// Checks these laws at one state.
    fn recheck_at(&self, x: &Points<P::Manifold>) -> Result<[f64; 2], LatticeError> {
        let tried = Tried::Reached;
        let (all, totals) = self.differentials::<true>(x);
        let count = self.sites() as f64;
        let mean = [totals.energy.size / count, totals.entropy.size / count];
        // Without an entropy there is no friction either.
        if !P::ENTROPY {
            return Ok(mean);
        }
        self.casimir_at(x, &all, tried)?;
        let (mut production, mut negative) = (0.0, false);
        let look = |seen: &mut Seen, term: Term| {
            if seen.broken.is_none() {
                seen.broken = term.keeps_energy(tried, &mut Laws::first()).err().map(Box::new);
            }
            seen.production += term.production().abs();
            seen.negative |= term.production() < 0.0;
        };
        for seen in self.terms_of_chunks(x, &all, Seen::default, look) {
            if let Some(law) = seen.broken {
                return Err(self.located(*law, x));
            }
            production += seen.production;
            negative |= seen.negative;
        }
        if !negative {
            return Ok(mean);
        }
        let verdict = self.each_term(x, &all, &mut Laws::first(), |term, laws| {
            let destroys = -term.production() > DESTROYED * production;
            if destroys { term.negative_rate(tried, laws) } else { Ok(()) }
        });
        verdict.map(|()| mean).map_err(|law| self.located(law, x))
    }

    /// Checks `Π dS = 0` at every site.
    ///
    /// # Errors
    ///
    /// [`LatticeError::Broken`].
    pub(crate) fn verify_casimir(
        &self,
        x: &Points<P::Manifold>,
        tried: Tried,
    ) -> Result<(), LatticeError> {
        if !P::ENTROPY {
            return Ok(());
        }
        let (all, _) = self.differentials::<false>(x);
        self.casimir_at(x, &all, tried)
    }

    /// Checks `Π dS = 0` at every site, with the differentials there.
    fn casimir_at(
        &self,
        x: &Points<P::Manifold>,
        all: &Differentials,
        tried: Tried,
    ) -> Result<(), LatticeError> {
        let casimir = |site: usize| {
            let [w, s] = differentials_at::<P>(all, site);
            let v = self.parts.reversible(&x[site], &w, &s);
            let rest_and_terms = [s.dot(&v), s.abs().dot(&v.abs())];
            let remedy = if tried == Tried::Start { casimir_remedy::<P>() } else { "" };
            let law = ("Π dS = 0", remedy);
            cancels(law, (Place::Site(site), tried), rest_and_terms, &mut Laws::first())
        };
        let sites = parallel::map(self.sites(), |mut sites| {
            sites.try_for_each(casimir).err().map(Box::new)
        });
        match sites.into_iter().flatten().next() {
            Some(law) => Err(self.located(*law, x)),
            None => Ok(()),
        }
    }

    /// Compares the derivatives of the closures at these sites and bonds with their values. A kink has no derivative, so
    /// a wrong one differs at a state nearby too.
    fn recheck_derivatives(
        &self,
        x: &Points<P::Manifold>,
        mean: [f64; 2],
        places: (impl Iterator<Item = usize> + Clone, impl Iterator<Item = usize> + Clone),
    ) -> Result<(), LatticeError> {
        let judge = |y: &Points<P::Manifold>| {
            let largest = self.largest_sizes(y);
            let look = |sizes| {
                let (tried, random) = (Tried::Reached, Random::new(Use::Reached));
                let trial = Trial { lattice: self, y, sizes, tried, random, mean };
                trial.derivatives_of(places.clone(), &mut Laws::first())
            };
            // As at the start: a difference that is not small decides nothing.
            look(Sizes::Own(largest)).or_else(|law| look(Sizes::Same(largest)).map_err(|_| law))
        };
        let Err(found) = judge(x) else { return Ok(()) };
        let (y, _) = self.near(x, &self.own_sizes(x), MOVED);
        if judge(&y).is_err() { Err(found) } else { Ok(()) }
    }
}
