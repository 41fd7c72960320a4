//! Which sites are bonded.

use crate::error::LatticeError;

/// Sites `0, 1, …, n − 1` and the bonds between them.
///
/// A bond has a direction: the closures of a lattice are given its first site, then its second one. Two sites may
/// have several bonds.
///
/// ```
/// use metriplectic_lattices::{Boundary, Graph};
/// assert_eq!(Graph::ring(5).bonds().last(), Some(&[4, 0]));
/// assert_eq!(Graph::square([3, 4], Boundary::Open).bonds().len(), 2 * 4 + 3 * 3);
/// assert_eq!(Graph::from_bonds(3, [[0, 2], [1, 2]]).sites(), 3);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Graph {
    sites: usize,
    bonds: Vec<[u32; 2]>,
    /// The first bond that does not fit.
    refused: Option<LatticeError>,
}

/// The sites are the nodes by their indices, and the bonds are the edges in their order, from the source to the target of
/// each. Weights are not read: hand them to [`bond_data`](crate::LatticeBuilder::bond_data), which has the same order.
/// An edge from a node to itself is refused when the lattice is built.
///
/// ```
/// use metriplectic_lattices::{Graph, Lattice, LatticeError};
/// use metriplectic_dynamics::Symplectic;
/// use metriplectic_fields::Real;
/// use metriplectic_manifolds::Euclidean;
/// use nalgebra::Vector2;
/// use petgraph::graph::UnGraph;
///
/// // Masses in kg at the nodes, and springs in N/m on the edges, of a triangle with a tail.
/// let mut body = UnGraph::<f64, f64>::default();
/// let [a, b, c, d] = [1.0, 2.0, 1.0, 4.0].map(|mass| body.add_node(mass));
/// body.extend_with_edges([(a, b, 3.0), (b, c, 3.0), (c, a, 5.0), (c, d, 1.0)]);
///
/// let graph = Graph::from(&body);
/// assert_eq!(graph.sites(), 4);
/// assert_eq!(graph.bonds(), [[0, 1], [1, 2], [2, 0], [2, 3]]);
///
/// let springs = Lattice::on(graph, Euclidean::<2>)
///     .bracket(Symplectic)
///     .site_data(body.node_weights().copied().collect())
///     .bond_data(body.edge_weights().copied().collect())
///     .energy_with(|x: &Vector2<Real>, mass| x.y * x.y / (2.0 * mass))
///     .bond_energy_with(|(x, y): &(Vector2<Real>, Vector2<Real>), k| (y.x - x.x) * (y.x - x.x) * (0.5 * k))
///     .build()?;
/// springs.verify(&springs.points(|i| Vector2::new(i as f64, 0.0)))?;
/// # Ok::<(), LatticeError>(())
/// ```
#[cfg(feature = "petgraph")]
impl<N, E, Ty: petgraph::EdgeType, Ix: petgraph::graph::IndexType>
    From<&petgraph::Graph<N, E, Ty, Ix>> for Graph
{
    fn from(graph: &petgraph::Graph<N, E, Ty, Ix>) -> Self {
        let ends =
            |edge: &petgraph::graph::Edge<E, Ix>| [edge.source().index(), edge.target().index()];
        Self::from_bonds(graph.node_count(), graph.raw_edges().iter().map(ends))
    }
}

/// Boundary of a regular lattice behind its last site.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Boundary {
    /// No further site.
    Open,
    /// The first site again.
    Periodic,
}

/// The most sites, and the most bonds, that can be numbered.
const MOST: usize = u32::MAX as usize;

impl Graph {
    /// A row of sites, each bonded to the next.
    #[must_use]
    pub fn chain(sites: usize) -> Self {
        Self::grid([sites], Boundary::Open)
    }

    /// A row of sites whose last one is bonded to the first.
    #[must_use]
    pub fn ring(sites: usize) -> Self {
        Self::grid([sites], Boundary::Periodic)
    }

    /// A square lattice of `nx × ny` sites; site `(i, j)` has the number `i + nx j`.
    #[must_use]
    pub fn square(sizes: [usize; 2], boundary: Boundary) -> Self {
        Self::grid(sizes, boundary)
    }

    /// A cubic lattice of `nx × ny × nz` sites; site `(i, j, k)` has the number `i + nx (j + ny k)`.
    #[must_use]
    pub fn cubic(sizes: [usize; 3], boundary: Boundary) -> Self {
        Self::grid(sizes, boundary)
    }

    /// A graph of `sites` sites with these bonds, from the first to the second site of each pair. A bond that does
    /// not fit is refused when the lattice is built, or by [`checked`](Self::checked).
    #[must_use]
    pub fn from_bonds(sites: usize, bonds: impl IntoIterator<Item = [usize; 2]>) -> Self {
        let mut graph = Self::without_bonds(sites);
        for [from, to] in bonds {
            if graph.refused.is_some() {
                break;
            }
            graph.bond(from, to);
        }
        graph
    }

    /// The number of sites.
    #[must_use]
    pub const fn sites(&self) -> usize {
        self.sites
    }

    /// The bonds, each with its first and its second site.
    #[must_use]
    pub fn bonds(&self) -> &[[u32; 2]] {
        &self.bonds
    }

    /// Returns the graph if it can carry a lattice. A lattice checks its graph when it is built; check a graph that is
    /// read from a file before.
    ///
    /// ```
    /// use metriplectic_lattices::{Graph, LatticeError};
    ///
    /// fn read(sites: usize, bonds: &[[usize; 2]]) -> Result<Graph, LatticeError> {
    ///     Graph::from_bonds(sites, bonds.iter().copied()).checked()
    /// }
    /// # fn main() -> Result<(), LatticeError> {
    /// let triangle = read(3, &[[0, 1], [1, 2], [2, 0]])?;
    /// assert_eq!(triangle.bonds().len(), 3);
    /// let error = read(3, &[[0, 1], [1, 3]]).unwrap_err();
    /// assert_eq!(error, LatticeError::BondToNowhere { bond: 1, site: 3, sites: 3 });
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    ///
    /// [`LatticeError`] if it has no sites, or more sites or bonds than can be numbered, or a bond that does not fit.
    pub fn checked(self) -> Result<Self, LatticeError> {
        if self.sites == 0 {
            return Err(LatticeError::NoSites);
        }
        match &self.refused {
            Some(refused) => Err(refused.clone()),
            None => Ok(self),
        }
    }

    fn without_bonds(sites: usize) -> Self {
        let refused = (sites > MOST).then_some(LatticeError::TooManySites { sites, most: MOST });
        Self { sites, bonds: Vec::new(), refused }
    }

    fn grid<const D: usize>(sizes: [usize; D], boundary: Boundary) -> Self {
        let sites = sizes.iter().try_fold(1_usize, |sites, &size| sites.checked_mul(size));
        let mut graph = Self::without_bonds(sites.unwrap_or(usize::MAX));
        // Along a side of `size` sites there are `size − 1` bonds, and one more if it is closed.
        let along = |size: usize| match boundary {
            Boundary::Open => graph.sites - graph.sites / size,
            Boundary::Periodic => graph.sites,
        };
        if graph.refused.is_none() && graph.sites > 0 {
            let bonds = sizes.map(along).iter().sum();
            graph.reserve(bonds);
        }
        if graph.refused.is_some() {
            return graph;
        }
        for site in 0..graph.sites {
            let mut stride = 1;
            for size in sizes {
                let place = site / stride % size;
                if place + 1 < size {
                    graph.bond(site, site + stride);
                } else if boundary == Boundary::Periodic {
                    graph.bond(site, site - place * stride);
                }
                stride *= size;
            }
        }
        graph
    }

    /// Makes room for so many bonds, or refuses the graph.
    fn reserve(&mut self, bonds: usize) {
        if bonds > MOST {
            self.refused = Some(LatticeError::TooManyBonds { bonds, most: MOST });
        } else if self.bonds.try_reserve_exact(bonds).is_err() {
            self.refused = Some(LatticeError::NoMemory { bonds });
        }
    }

    fn bond(&mut self, from: usize, to: usize) {
        let (bond, sites) = (self.bonds.len(), self.sites);
        if bond == MOST {
            let bonds = bond.saturating_add(1);
            self.refused.get_or_insert(LatticeError::TooManyBonds { bonds, most: MOST });
            return;
        }
        let number = |site: usize| u32::try_from(site).ok().filter(|_| site < sites);
        match (number(from), number(to)) {
            (Some(site), Some(_)) if from == to => {
                let site = site as usize;
                self.refused.get_or_insert(LatticeError::BondToItself { bond, site });
            }
            (Some(from), Some(to)) => self.bonds.push([from, to]),
            (None, _) => {
                self.refused.get_or_insert(LatticeError::BondToNowhere { bond, site: from, sites });
            }
            (_, None) => {
                self.refused.get_or_insert(LatticeError::BondToNowhere { bond, site: to, sites });
            }
        }
    }
}
