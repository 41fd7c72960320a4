//! Lattices with surroundings: ports that do work at sites, and baths that give heat there.
//!
//! ```math
//! x_i' = \Pi(x_i)\, w_i + \sum_j K_{ij} (s_i, s_j) + K_i s_i + \sum_a F_a(t, i, x_i) + \sum_b R_b(t, i, x_i) (T_b\, s_i - w_i)
//! ```
//!
//! with the differentials `w_i` and `s_i` of the total energy and entropy at a site, of which the energy may depend on time. The laws are those of
//! [open systems](metriplectic_integrators::open): `H − W_t − ΣW_a − ΣQ_b` stays what it was, and `S + ΣS_b` does not fall.
//! Neither the clock nor the ledger is an entry of a site.
//!
//! An entry of the ledger is a sum over the sites of its port or bath. It is summed in double digits, in chunks of a fixed
//! length that are merged in a fixed order, so its bits do not depend on the number of threads.

mod dense;
mod flow;
mod in_time;
mod noise;
mod parts;
mod verify;

use std::fmt;
use std::sync::Arc;

use metriplectic_fields::{Real, Space};
use metriplectic_integrators::OpenSpace;
use metriplectic_integrators::open::{Beside, Ledger, OpenState};

use crate::lattice::Lattice;
use crate::model::{Model, PointOf, VectorOf};
use crate::onsager::{Onsager, SiteState};
use crate::points::{Points, Sites};
use crate::vector::SiteVector;
use in_time::{AtTime, Field};
pub use noise::NoisySurroundings;
use parts::{Part, PartKind};

/// A [`Lattice`] with ports and baths at some of its sites; made by [`Lattice::opened`].
///
/// The explicit methods run it. So do the schemes, `Gauss` and `Radau` with up to 1024 variables; `Radau` takes a lattice
/// without an entropy of its own and with one bath.
///
/// ```
/// use metriplectic_fields::Real;
/// use metriplectic_integrators::{DormandPrince5, Method, Span};
/// use metriplectic_lattices::{Graph, Lattice, Onsager, SiteState};
/// use metriplectic_manifolds::Euclidean;
/// use nalgebra::{ComplexField, Vector1, vector};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// // Heat in a rod of 20 sites with the energy u and the entropy ln u, whose first site touches a bath at T = 2.
/// let rod = Lattice::on(Graph::chain(20), Euclidean::<1>)
///     .energy(|u: &Vector1<Real>| u.x)
///     .entropy(|u: &Vector1<Real>| u.x.ln())
///     .bond_onsager(|bond| {
///         let [u, v] = bond.x;
///         [Onsager { rate: u.x * v.x, b: [vector![1.0], vector![-1.0]] }]
///     })
///     .build()?
///     .opened()
///     .bath("oven", 2.0, [0], |_, at: &SiteState<'_, Euclidean<1>>| {
///         [Onsager { rate: at.x.x, b: vector![1.0] }]
///     });
/// let start = rod.start(rod.lattice().points(|_| vector![1.0]));
/// let run = DormandPrince5.run(&rod, start, Span::until(2000.0).tolerance(1e-6))?;
/// // The rod takes the temperature of the oven, and the heat is what its energy has gained.
/// let state = &run.last().point;
/// assert!(state.x.iter().all(|u| (u.x - 2.0).abs() < 1e-2));
/// let gained: f64 = state.x.iter().map(|u| u.x - 1.0).sum();
/// assert!((state.ledger.heat("oven").unwrap() - gained).abs() < 1e-12);
/// assert!(run.certificate().keeps_energy() && run.certificate().keeps_entropy());
/// # Ok(())
/// # }
/// ```
pub struct OpenLattice<P: Model> {
    lattice: Lattice<P>,
    /// The energies of sites that depend on time.
    fields: Vec<Box<Field<P>>>,
    parts: Vec<Part<P>>,
    /// True once its laws were verified, with those of its parts.
    verified: bool,
    /// A ledger without entries.
    empty: Ledger,
}

// By hand, because closures have no `Debug`.
impl<P: Model> fmt::Debug for OpenLattice<P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<&str> = self.parts.iter().map(|part| &*part.name).collect();
        f.debug_struct("OpenLattice")
            .field("lattice", &self.lattice)
            .field("parts", &names)
            .finish_non_exhaustive()
    }
}

/// A state of an open lattice.
pub(crate) type StateOf<P> = OpenState<Points<<P as Model>::Manifold>>;

/// The space of the states of an open lattice: points of `M` at the sites, with the time and a ledger.
pub type OpenSites<M> = OpenSpace<Sites<M>>;
/// A displacement or a rate of an open lattice.
type OpenSiteVector = Beside<SiteVector>;

impl<P: Model> Lattice<P> {
    /// The lattice with surroundings, which have no part yet.
    pub fn opened(self) -> OpenLattice<P> {
        OpenLattice {
            lattice: self,
            fields: Vec::new(),
            parts: Vec::new(),
            verified: false,
            empty: Ledger::of([]),
        }
    }
}

impl<P: Model> OpenLattice<P> {
    /// The lattice.
    pub const fn lattice(&self) -> &Lattice<P> {
        &self.lattice
    }

    /// The state in which a run starts at these points: its time is that of the run, and nothing is booked yet.
    pub fn start(&self, points: Points<P::Manifold>) -> StateOf<P> {
        OpenState { x: points, time: 0.0, ledger: self.empty.clone() }
    }

    /// Adds an energy `h(t, i, x_i)` of each site that depends on time, such as that of a field which turns: a closure of the time, of
    /// the number of the site and of its point. It does the work `Σ_i ∂_t h` on the lattice, which the ledger books as that of the
    /// [time](Ledger::parameter_work).
    ///
    /// ```
    /// use metriplectic_dynamics::bracket::AreaForm;
    /// use metriplectic_fields::Real;
    /// use metriplectic_integrators::{DormandPrince8, Method, Span};
    /// use metriplectic_lattices::{Graph, Lattice};
    /// use metriplectic_manifolds::Sphere;
    /// use nalgebra::{ComplexField, Vector3, vector};
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// // A ring of spins in a field that turns.
    /// let ring = Lattice::on(Graph::ring(8), Sphere::<2>::round())
    ///     .bracket(AreaForm)
    ///     .bond_energy(|(a, b): &(Vector3<Real>, Vector3<Real>)| -a.dot(b))
    ///     .build()?
    ///     .opened()
    ///     .energy_in_time(|t, _, n: &Vector3<Real>| -(n.x * t.cos() + n.y * t.sin()));
    /// let start = ring.start(ring.lattice().points(|_| vector![0.6, 0.0, 0.8]));
    /// let before = ring.energy_at(&start);
    /// let run = DormandPrince8.run(&ring, start, Span::until(20.0).tolerance(1e-9))?;
    /// let end = &run.last().point;
    /// let gained = ring.energy_at(end) - before;
    /// assert!((gained - end.ledger.parameter_work()).abs() < 1e-13 && gained.abs() > 0.1);
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn energy_in_time(
        mut self,
        energy: impl Fn(Real, usize, &<P::Manifold as Space>::Point<Real>) -> Real
        + Send
        + Sync
        + 'static,
    ) -> Self {
        self.fields.push(Box::new(energy));
        self.verified = false;
        self
    }

    /// Appends a port at some sites: a velocity `F(t, i, x_i)` in the frame of the chart at `x_i`, such as a force on a
    /// momentum. It does the work `⟨w_i, F⟩` and carries no entropy, `⟨s_i, F⟩ = 0`.
    #[must_use]
    pub fn work(
        self,
        name: impl Into<Arc<str>>,
        sites: impl IntoIterator<Item = usize>,
        velocity: impl Fn(f64, usize, &PointOf<P>) -> VectorOf<P> + Send + Sync + 'static,
    ) -> Self {
        let kind = PartKind::Port(Box::new(velocity));
        self.with(name.into(), sites, kind)
    }

    /// Appends a bath of a temperature `T`, a number or a closure of the time, at some sites. Its friction is a sum of
    /// terms `ρ b bᵀ` from a closure of the time and of the state of a site. As terms of a bath they need annihilate nothing.
    #[must_use]
    pub fn bath<const R: usize>(
        self,
        name: impl Into<Arc<str>>,
        temperature: impl metriplectic_dynamics::exchange::Temperature + Send + Sync + 'static,
        sites: impl IntoIterator<Item = usize>,
        friction: impl Fn(f64, &SiteState<'_, P::Manifold>) -> [Onsager<VectorOf<P>>; R]
        + Send
        + Sync
        + 'static,
    ) -> Self {
        let contacts =
            move |t: f64, at: &SiteState<'_, P::Manifold>, visit: &mut parts::Visit<'_, P>| {
                friction(t, at).into_iter().for_each(visit);
            };
        let temperature = Box::new(temperature);
        let contacts = Box::new(contacts);
        self.with(name.into(), sites, PartKind::Bath { temperature, contacts, terms: R })
    }

    fn with(
        mut self,
        name: Arc<str>,
        sites: impl IntoIterator<Item = usize>,
        kind: PartKind<P>,
    ) -> Self {
        self.parts.push(Part { name, sites: sites.into_iter().collect(), kind });
        let names = self.parts.iter().map(|part| (Arc::clone(&part.name), part.is_bath()));
        self.empty = Ledger::of(names);
        self.verified = false;
        self
    }

    /// The energy of the lattice at a state. The energy of a [state of a run](metriplectic_integrators::State) is the
    /// balance `H − W − Q` instead, which stays what it was at the start.
    pub fn energy_at(&self, state: &StateOf<P>) -> f64 {
        self.at(state.time).totals(&state.x)[0].sum.value()
    }

    /// The entropy of the lattice at a state, without that of the baths.
    pub fn entropy_at(&self, state: &StateOf<P>) -> f64 {
        self.lattice.totals(&state.x)[1].sum.value()
    }
}

impl<P: Model> OpenLattice<P> {
    /// The lattice with the energy that it has at a time.
    pub(crate) fn at(&self, time: f64) -> Lattice<AtTime<'_, P>> {
        let parts = AtTime { parts: &self.lattice.parts, fields: &self.fields, time };
        self.lattice.with_parts(parts)
    }
}
