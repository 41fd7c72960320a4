//! The laws of the surroundings of a lattice.

use std::sync::Arc;

use metriplectic_dynamics::ModelError;
use metriplectic_fields::Column;
use metriplectic_integrators::open::OpenFlow as _;
use metriplectic_manifolds::Manifold;

use super::parts::{AtSite, Part};
use super::{OpenLattice, StateOf};
use crate::error::{LatticeError, Place};
use crate::lattice::{Differentials, differentials_at};
use crate::model::{Model, VectorOf};
use crate::report::{LatticeLaw, LatticeReport, Laws};

/// The slope of a law along a velocity, relative to its terms, that is no round-off.
const BROKEN: f64 = 1e-8;

impl<P: Model> Part<P> {
    /// Returns whether it is a bath that takes energy alone.
    pub(super) fn is_cold(&self) -> bool {
        matches!(&self.kind, super::PartKind::Bath { temperature, .. } if temperature.is_zero())
    }
}

/// A slope of a law, and the sizes of its terms.
#[derive(Clone, Copy, Default)]
struct Slope {
    sum: f64,
    terms: f64,
}

impl Slope {
    fn add<M: Manifold>(
        &mut self,
        law: &metriplectic_fields::Vector<M>,
        v: &metriplectic_fields::Vector<M>,
    ) {
        self.sum += law.dot(v);
        self.terms += M::pairing_size(law, v);
    }

    fn size(self) -> f64 {
        // Numbers without digits are zeros.
        let least = f64::MIN_POSITIVE / f64::EPSILON;
        if self.sum.abs() <= least { 0.0 } else { self.sum.abs() / self.terms }
    }
}

impl<P: Model> OpenLattice<P> {
    /// Verifies the lattice at a state, as [`Lattice::verify`](crate::Lattice::verify) does, and its ports and baths at the
    /// time of that state. Every run verifies its start.
    ///
    /// # Errors
    ///
    /// The first [`LatticeError`]: that of a site or a bond, or [`LatticeError::Surroundings`] with the port or the bath.
    pub fn verify(&self, x0: &StateOf<P>) -> Result<(), LatticeError> {
        self.at(x0.time).verify(&x0.x)?;
        self.verify_parts(x0)
    }

    /// Lists every law that [`verify`](Self::verify) tries, with the site or the bond where it is worst, and the port or the
    /// bath. Read it when a new lattice misbehaves.
    pub fn report(&self, x0: &StateOf<P>) -> LatticeReport {
        let report = self.at(x0.time).report(&x0.x);
        let mut laws = Laws::of(report.laws);
        // The ports and baths have no state to be tried at, unless the lattice has.
        let verdict = match report.verdict {
            Err(law) if laws.is_empty() => Err(law),
            verdict => {
                // A part without values ends it, and is in the verdict.
                let _ = self.judge_parts(x0, &mut laws);
                verdict.and_then(|()| self.verify_parts(x0))
            }
        };
        LatticeReport { laws: laws.into_list(), verdict, ..report }
    }

    /// Verifies the lattice with its ports and baths at a state, and returns it with this certificate, which a further port
    /// or bath takes away, unless the lattice itself was verified. A run of it, from any start, checks the laws at that start alone, as that of a
    /// [verified](crate::Lattice::verified) lattice does. Use it for a study of many runs.
    ///
    /// # Errors
    ///
    /// The errors of [`verify`](Self::verify).
    pub fn verified(self, x0: &StateOf<P>) -> Result<Self, LatticeError> {
        self.verify(x0)?;
        Ok(Self { verified: true, ..self })
    }

    pub(super) fn verify_parts(&self, x0: &StateOf<P>) -> Result<(), LatticeError> {
        let looked_at = self.check_clock(x0).and_then(|()| self.look_at_parts(x0));
        looked_at.map_err(|law| LatticeError::Surroundings(Box::new(law)))
    }

    /// Checks at a state that sites exist, that ports carry no entropy, that ports and baths keep the conserved sums, that no
    /// temperature is negative, and that no friction has a negative rate.
    pub(super) fn look_at_parts(&self, state: &StateOf<P>) -> Result<(), ModelError> {
        self.judge_parts(state, &mut Laws::first())
    }

    /// Looks at the laws of all ports and baths.
    ///
    /// # Errors
    ///
    /// The first law that is broken; if `laws` are listed, a part without values.
    fn judge_parts(&self, state: &StateOf<P>, laws: &mut Laws) -> Result<(), ModelError> {
        // A state with too few points is refused by the lattice.
        if self.parts.is_empty() || state.x.len() != self.lattice.sites() {
            return Ok(());
        }
        let (all, _) = self.at(state.time).differentials::<false>(&state.x);
        self.parts.iter().try_for_each(|part| self.judge_part(part, state, &all, laws))
    }

    fn judge_part(
        &self,
        part: &Part<P>,
        state: &StateOf<P>,
        all: &Differentials,
        laws: &mut Laws,
    ) -> Result<(), ModelError> {
        let time = state.time;
        let found = |law, sizes, place| LatticeLaw {
            part: Some(Arc::clone(&part.name)),
            ..LatticeLaw::new(law, sizes, place)
        };
        let entries = |site: usize| P::Manifold::entries(&state.x[site]);
        let named = |site: usize| -> Arc<str> { format!("{} at site {site}", part.name).into() };
        let temperature = part.temperature(time);
        if let Some(temperature) = temperature {
            let holds = temperature >= 0.0 && temperature.is_finite();
            let below = if temperature.is_finite() { (-temperature).max(0.0) } else { f64::NAN };
            let place = part.sites.first().map_or(Place::Total, |&site| Place::Site(site));
            laws.note(
                || found("T ≥ 0", [below, 0.0], place),
                holds,
                || {
                    let bath = Arc::clone(&part.name);
                    ModelError::BathNotPositive { bath, temperature, time }
                },
            )?;
        }
        let mut sums = vec![Slope::default(); P::SUMS];
        for &site in &part.sites {
            if site >= self.lattice.sites() {
                let (part, point) = (named(site), Vec::new());
                return Err(ModelError::ExchangeNotFinite { part, time, point });
            }
            let x = &state.x[site];
            let [w, s] = differentials_at::<P>(all, site);
            let AtSite { v, least_rate, .. } =
                part.at_site((time, temperature.unwrap_or(0.0)), site, x, [&w, &s]);
            let place = Place::Site(site);
            if temperature.is_some() {
                let below = if least_rate.is_nan() { least_rate } else { (-least_rate).max(0.0) };
                let (rates, holds) =
                    (|| found("ρ ≥ 0 of baths", [below, 0.0], place), below == 0.0);
                laws.note(rates, holds, || {
                    let (bath, rate) = (named(site), least_rate);
                    ModelError::FrictionNotPositive { bath, rate, time }
                })?;
            }
            if !v.is_finite() {
                let (part, point) = (named(site), entries(site));
                return Err(ModelError::ExchangeNotFinite { part, time, point });
            }
            if temperature.is_none() {
                let mut carried = Slope::default();
                carried.add::<P::Manifold>(&s, &v);
                let size = carried.size();
                let work = || found("⟨dS, F⟩ = 0", [size, BROKEN], place);
                laws.note(work, size <= BROKEN || size.is_nan(), || {
                    let (port, point) = (named(site), entries(site));
                    ModelError::WorkCarriesEntropy { port, time, point, size }
                })?;
            }
            for (k, sum) in sums.iter_mut().enumerate() {
                let law: VectorOf<P> = self.lattice.parts.sum(k, site, x).df;
                sum.add::<P::Manifold>(&law, &v);
            }
        }
        for (index, sum) in sums.into_iter().enumerate() {
            let size = sum.size();
            let kept = || found("⟨dL, F⟩ = 0", [size, BROKEN], Place::Total);
            laws.note(kept, size <= BROKEN || size.is_nan(), || {
                let (part, point) = (Arc::clone(&part.name), Vec::new());
                ModelError::PortBreaksInvariant { part, index, time, point, size }
            })?;
        }
        Ok(())
    }
}
