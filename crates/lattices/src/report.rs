//! Every law of a lattice, with the place where it is worst.

use std::fmt;
use std::sync::Arc;

use crate::error::{LatticeError, Place};

/// The law of the rates of the friction.
pub(crate) const RATES: &str = "ρ ≥ 0";

/// A law of a lattice, at the place where it is worst.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LatticeLaw {
    /// The law as a formula.
    pub law: &'static str,
    /// The violation, relative to the terms that should cancel; of a rate or a temperature, the part of it below zero.
    pub size: f64,
    /// The violation there that is taken for round-off.
    pub allowed: f64,
    /// The site, the bond, or the sum over all of them.
    pub place: Place,
    /// The port or the bath whose law it is.
    pub part: Option<Arc<str>>,
    /// True if the law holds there, and so at all places that were tried.
    pub holds: bool,
}

impl LatticeLaw {
    /// A law at a place, with its violation and what is allowed; [`Laws::note`] says whether it holds.
    pub(crate) fn new(law: &'static str, [size, allowed]: [f64; 2], place: Place) -> Self {
        Self { law, size, allowed, place, part: None, holds: true }
    }

    /// Returns whether the law is worse here than at another place: broken, or nearer to it.
    fn is_worse_than(&self, other: &Self) -> bool {
        if self.holds != other.holds {
            return other.holds;
        }
        // Violations of 0 that allow nothing are as good as each other.
        let part = |law: &Self| if law.size > 0.0 { law.size / law.allowed } else { 0.0 };
        (part(self), self.size) > (part(other), other.size)
    }
}

impl fmt::Display for LatticeLaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { law, size, allowed, place, part, holds } = self;
        let mark = if *holds { "ok    " } else { "BROKEN" };
        write!(f, "{mark}  {law:<22} {size:9.2e}  (allowed {allowed:.0e})  {place}")?;
        part.as_ref().map_or(Ok(()), |part| write!(f, ", {part}"))
    }
}

/// Every law of a lattice at its worst place, and the first error if there is one; see
/// [`Lattice::report`](crate::Lattice::report) and [`OpenLattice::report`](crate::OpenLattice::report).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LatticeReport {
    /// The laws, in the order in which they are tried. The list is empty where a point or a value is not finite.
    pub laws: Vec<LatticeLaw>,
    /// The sites and the bonds of the lattice. The friction was tried at all of them.
    pub size: [usize; 2],
    /// The sites and the bonds at which the closures were tried.
    pub tried: [usize; 2],
    /// The result of `verify`.
    pub verdict: Result<(), LatticeError>,
}

impl fmt::Display for LatticeReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { laws, size: [sites, bonds], tried, verdict } = self;
        writeln!(
            f,
            "lattice judged at {} of {sites} sites and {} of {bonds} bonds, its friction at all of them",
            tried[0], tried[1]
        )?;
        for law in laws {
            writeln!(f, "  {law}")?;
        }
        match verdict {
            Ok(()) => write!(f, "verdict: the lattice keeps its laws"),
            Err(error) => write!(f, "verdict: {error}"),
        }
    }
}

/// A listener to the laws that are looked at: the first one that is broken is an error, or all are listed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Laws(Option<Vec<LatticeLaw>>);

impl Laws {
    /// The first law that is broken is an error, and nothing is listed.
    pub(crate) const fn first() -> Self {
        Self(None)
    }

    /// All laws are listed, and a broken one is no error.
    pub(crate) const fn all() -> Self {
        Self(Some(Vec::new()))
    }

    /// All laws are listed after these.
    pub(crate) const fn of(laws: Vec<LatticeLaw>) -> Self {
        Self(Some(laws))
    }

    /// A listener of the same kind that has seen nothing yet.
    pub(crate) fn fresh(&self) -> Self {
        Self(self.0.as_ref().map(|_| Vec::new()))
    }

    /// Notes a law at a place.
    ///
    /// # Errors
    ///
    /// `error`, if the law is broken and they are not listed.
    pub(crate) fn note<E>(
        &mut self,
        found: impl FnOnce() -> LatticeLaw,
        holds: bool,
        error: impl FnOnce() -> E,
    ) -> Result<(), E> {
        match &mut self.0 {
            Some(laws) => {
                add(laws, LatticeLaw { holds, ..found() });
                Ok(())
            }
            None if holds => Ok(()),
            None => Err(error()),
        }
    }

    /// Adds what was seen elsewhere.
    pub(crate) fn merge(&mut self, other: Self) {
        if let (Some(laws), Some(others)) = (&mut self.0, other.0) {
            others.into_iter().for_each(|law| add(laws, law));
        }
    }

    /// Forgets the laws that are broken, apart from this one.
    pub(crate) fn forgive_all_but(&mut self, law: &'static str) {
        self.0.iter_mut().for_each(|laws| laws.retain(|found| found.holds || found.law == law));
    }

    /// Returns whether all laws that are listed hold.
    pub(crate) fn hold(&self) -> bool {
        self.0.iter().flatten().all(|law| law.holds)
    }

    /// Returns whether nothing is listed.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.as_ref().is_none_or(Vec::is_empty)
    }

    pub(crate) fn into_list(self) -> Vec<LatticeLaw> {
        self.0.unwrap_or_default()
    }
}

/// Adds a law to a list with each of them at its worst place.
fn add(laws: &mut Vec<LatticeLaw>, found: LatticeLaw) {
    match laws.iter_mut().find(|law| law.law == found.law) {
        Some(law) if found.is_worse_than(law) => *law = found,
        Some(_) => {}
        None => laws.push(found),
    }
}
