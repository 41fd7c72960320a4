//! Errors of a lattice.

use std::fmt;

use metriplectic_dynamics::ModelError;
use metriplectic_manifolds::PointError;

/// A lattice that cannot be built, or that breaks a law at the start of a run. `size` is relative to the terms that
/// should cancel.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LatticeError {
    /// A graph without sites.
    #[error("the graph has no sites; give it at least one")]
    NoSites,
    /// More sites than can be numbered.
    #[error("the graph has {sites} sites, and at most {most} can be numbered")]
    TooManySites {
        /// How many there are.
        sites: usize,
        /// The most.
        most: usize,
    },
    /// More bonds than can be numbered.
    #[error("the graph has {bonds} bonds, and at most {most} can be numbered; give it fewer sites")]
    TooManyBonds {
        /// How many there are.
        bonds: usize,
        /// The most.
        most: usize,
    },
    /// More parts than chunks of sites.
    #[error(
        "{parts} parts of a lattice need as many chunks of 1024 sites, and the graph has {chunks}; cut it into fewer"
    )]
    TooManyParts {
        /// How many parts there should be.
        parts: usize,
        /// How many chunks there are.
        chunks: usize,
    },
    /// A list of bonds for which there is no memory.
    #[error("there is no memory for the {bonds} bonds of the graph; give it fewer sites")]
    NoMemory {
        /// How many bonds there are.
        bonds: usize,
    },
    /// A bond to a site that is not there.
    #[error("bond {bond} ends at site {site}, and the graph has {sites} sites, numbered from 0")]
    BondToNowhere {
        /// The bond, in the order of the list.
        bond: usize,
        /// The site.
        site: usize,
        /// How many sites there are.
        sites: usize,
    },
    /// A bond whose two sites are one.
    #[error(
        "bond {bond} joins site {site} to itself; what it contributes is a function of the site, and belongs \
         into `.energy(..)`"
    )]
    BondToItself {
        /// The bond, in the order of the list.
        bond: usize,
        /// The site.
        site: usize,
    },
    /// Data for another number of sites or bonds.
    #[error("there are data for {found} {of}, and the graph has {expected}")]
    Data {
        /// Sites or bonds.
        of: &'static str,
        /// How many data there are.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
    /// An entropy on bonds.
    #[error(
        "an entropy on bonds is refused: Π dS = 0 holds site by site only for a sum over sites; take the entropy, or \
         the internal energy, of each site as one of its variables, and give the bonds an energy; where the bracket \
         leaves the variables of the entropy alone, give it by `.gather_entropy(..)`"
    )]
    EntropyOnBonds,
    /// Neither a bracket nor friction.
    #[error("nothing moves: the bracket is zero and there is no friction; give one of the two")]
    NothingMoves,
    /// Friction without an entropy, or an entropy without friction.
    #[error(
        "friction and entropy belong together, and only one of them is there; give `.entropy(..)` and \
         `.bond_onsager(..)` or `.site_onsager(..)`"
    )]
    EntropyWithoutFriction,
    /// A bracket with a force.
    #[error(
        "the bracket has a force, whose heat belongs to no entropy of the lattice; give the friction of a site by \
         `.site_onsager(..)`"
    )]
    ForcedBracket,
    /// Points for another number of sites.
    #[error("the start has {found} points, and the graph has {expected} sites")]
    Points {
        /// How many there are.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
    /// The start is no point of the manifold at a site.
    #[error("the start at {place}: {cause}")]
    Start {
        /// The place.
        place: Place,
        /// Why.
        cause: PointError,
    },
    /// A value or a derivative at the start that is not a finite number.
    #[error("the {what} at {place} is not a finite number; start where the model is defined")]
    NotFinite {
        /// Which part of the model.
        what: &'static str,
        /// The place.
        place: Place,
    },
    /// A law that is broken at a site or a bond.
    #[error(
        "{law} is broken at {place}, {tried}{}: the rest is {size:.1e} of the terms{remedy}",
        Entries(entries)
    )]
    Broken {
        /// The law.
        law: &'static str,
        /// The place.
        place: Place,
        /// At which state.
        tried: Tried,
        /// The entries of the state at the site, or at both sites of the bond.
        entries: Vec<f64>,
        /// The rest, relative to the terms that should cancel.
        size: f64,
        /// The remedy.
        remedy: &'static str,
    },
    /// A negative rate of friction.
    #[error(
        "the friction at {place}, {tried}{}, has the negative rate {rate:.3e}, and would destroy entropy",
        Entries(entries)
    )]
    NegativeRate {
        /// The place.
        place: Place,
        /// At which state.
        tried: Tried,
        /// The entries of the state at the site, or at both sites of the bond.
        entries: Vec<f64>,
        /// The rate.
        rate: f64,
    },
    /// A derivative that is not the one of the values.
    #[error(
        "the {what} at {place} has the derivative {derivative:.6e} along a direction in which its values change at \
         the rate {quotient:.6e}: the closure loses a derivative, as `x.re` and `Real::from(f64)` do"
    )]
    WrongDerivative {
        /// Which part of the model.
        what: &'static str,
        /// The place.
        place: Place,
        /// The derivative by dual numbers.
        derivative: f64,
        /// The difference quotient of the values.
        quotient: f64,
    },
    /// A sum that is not conserved.
    #[error("conserved sum {index} changes at the start at a rate of {size:.1e} of its terms")]
    NotConserved {
        /// Which one, in the order of the list, counted from 0.
        index: usize,
        /// The rate, relative to the sizes of its terms.
        size: f64,
    },
    /// A port or a bath of an [`OpenLattice`](crate::OpenLattice) that breaks a law.
    #[error(transparent)]
    Surroundings(Box<ModelError>),
}

metriplectic_equations::debug_is_the_sentence!(LatticeError);

/// The entries of a state, if they are known.
struct Entries<'a>(&'a [f64]);

impl fmt::Display for Entries<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() { Ok(()) } else { write!(f, " with the entries {:?}", self.0) }
    }
}

/// The state at which a law was tried.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Tried {
    /// The start of the run.
    Start,
    /// A state that the run has reached.
    Reached,
    /// A state whose entries differ from the start at random, and along the velocity.
    Near {
        /// By this fraction of each entry, or of the largest one of its kind where it is zero.
        fraction: f64,
    },
}

impl fmt::Display for Tried {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Start => f.write_str("at the start"),
            Self::Reached => f.write_str("at a state of the run"),
            Self::Near { fraction } => {
                write!(
                    f,
                    "at a state whose entries differ from the start by {fraction:.0e} of their sizes"
                )
            }
        }
    }
}

/// A site, a bond, or all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Place {
    /// A site.
    Site(usize),
    /// A bond, in the order of the graph, with its two sites.
    Bond {
        /// Its number.
        bond: usize,
        /// Its sites.
        sites: [usize; 2],
    },
    /// The sum over all sites and bonds.
    Total,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Site(site) => write!(f, "site {site}"),
            Self::Bond { bond, sites: [from, to] } => {
                write!(f, "bond {bond}, from site {from} to site {to}")
            }
            Self::Total => f.write_str("the sum over the lattice"),
        }
    }
}

metriplectic_integrators::passed_on_as_error!(LatticeError);
