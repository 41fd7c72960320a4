//! The builder of a [`Lattice`].

mod fields;

use std::fmt;

use metriplectic_dynamics::Bracket;
use metriplectic_dynamics::bracket::NaturalBracket;
use metriplectic_fields::{Real, ScalarField, Vector};
use metriplectic_manifolds::{Canonical, Manifold, Product, Riemannian, Times};

use crate::error::LatticeError;
use crate::fields::{Absent, ConservedSums, InOrder, LocalData, LocalField, Uniform, WithData};
use crate::gather::{Gather, Gathers};
use crate::graph::Graph;
use crate::lattice::Lattice;
use crate::layout::Layout;
use crate::model::{Data, Fields, Friction, Parts};
use crate::neighbours::{Alone, Neighbours};
use crate::onsager::{
    BondFriction, BondState, Frictionless, Onsager, SiteFriction, SiteState, Terms,
};

/// A lattice in the making: each method gives or replaces one part.
#[derive(Clone)]
#[must_use = "a builder does nothing until `build` is called"]
pub struct LatticeBuilder<M, B, F, K, L, D> {
    graph: Graph,
    parts: Parts<M, B, F, K, L, D>,
    has_bond_entropy: bool,
}

// By hand, because closures have no `Debug`.
impl<M: fmt::Debug, B, F, K, L, D> fmt::Debug for LatticeBuilder<M, B, F, K, L, D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LatticeBuilder")
            .field("manifold", &self.parts.manifold)
            .field("sites", &self.graph.sites())
            .finish_non_exhaustive()
    }
}

/// A builder that has been given nothing.
type Empty<M> = LatticeBuilder<
    M,
    <M as NaturalBracket>::Bracket,
    Fields<Absent, Absent, Absent, Gathers<Absent, Absent>>,
    Friction<Frictionless, Frictionless>,
    (),
    Data<(), ()>,
>;

impl Lattice<()> {
    /// Starts a lattice with a point of the manifold at each site of a graph, and the manifold's natural bracket
    /// (Lie-Poisson on the dual of a Lie algebra, none elsewhere).
    ///
    /// A chain of masses and springs with heat: `x = (q, p, s)` at each site.
    ///
    /// ```
    /// use metriplectic_dynamics::Poisson;
    /// use metriplectic_fields::Real;
    /// use metriplectic_integrators::{DormandPrince5, Method, Span};
    /// use metriplectic_lattices::{Graph, Lattice, Onsager};
    /// use metriplectic_manifolds::Euclidean;
    /// use nalgebra::{Matrix3, Vector3, vector};
    /// use num_dual::DualNum;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let canonical = Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    /// let chain = Lattice::on(Graph::ring(50), Euclidean::<3>)
    ///     .bracket(Poisson::constant(canonical)?)
    ///     .energy(|x: &Vector3<Real>| x.y * x.y * 0.5 + x.z.exp())
    ///     .bond_energy(|(x, y): &(Vector3<Real>, Vector3<Real>)| {
    ///         let r = y.x - x.x;
    ///         r * r * 0.5 + r.powi(4) * 0.25
    ///     })
    ///     .entropy(|x: &Vector3<Real>| x.z)
    ///     .bond_onsager(|bond| {
    ///         // Differentials of the energy: (force, velocity, temperature).
    ///         let [u, v] = bond.w;
    ///         let slip = 0.5 * (v.y - u.y);
    ///         let friction = 0.2 * u.z * v.z / (u.z + v.z);
    ///         [Onsager {
    ///             rate: friction,
    ///             b: [vector![0.0, -1.0, -slip / u.z], vector![0.0, 1.0, -slip / v.z]],
    ///         }]
    ///     })
    ///     .conserved(|x: &Vector3<Real>| x.y)
    ///     .build()?;
    /// let start = chain.points(|i| vector![0.1 * (i as f64).sin(), 0.0, 0.0]);
    /// let run = DormandPrince5.run(&chain, start, Span::until(2.0).tolerance(1e-6).at_most(2))?;
    /// let certificate = run.certificate();
    /// assert!(certificate.keeps_energy() && certificate.keeps_entropy());
    /// # Ok(())
    /// # }
    /// ```
    pub fn on<M: NaturalBracket>(graph: Graph, manifold: M) -> Empty<M> {
        let bracket = manifold.natural_bracket();
        let parts = Parts {
            manifold,
            bracket,
            fields: Fields::default(),
            friction: Friction::default(),
            sums: (),
            data: Data::default(),
        };
        LatticeBuilder { graph, parts, has_bond_entropy: false }
    }
}

impl<M, B, F, K, L, D> LatticeBuilder<M, B, F, K, L, D> {
    fn with<B2, F2, K2, L2, D2>(
        self,
        replace: impl FnOnce(Parts<M, B, F, K, L, D>) -> Parts<M, B2, F2, K2, L2, D2>,
    ) -> LatticeBuilder<M, B2, F2, K2, L2, D2> {
        let Self { graph, parts, has_bond_entropy } = self;
        LatticeBuilder { graph, parts: replace(parts), has_bond_entropy }
    }

    fn with_fields<F2>(self, replace: impl FnOnce(F) -> F2) -> LatticeBuilder<M, B, F2, K, L, D> {
        self.with(|Parts { manifold, bracket, fields, friction, sums, data }| {
            let fields = replace(fields);
            Parts { manifold, bracket, fields, friction, sums, data }
        })
    }

    fn with_friction<K2>(self, replace: impl FnOnce(K) -> K2) -> LatticeBuilder<M, B, F, K2, L, D> {
        self.with(|Parts { manifold, bracket, fields, friction, sums, data }| {
            let friction = replace(friction);
            Parts { manifold, bracket, fields, friction, sums, data }
        })
    }

    fn with_data<D2>(self, replace: impl FnOnce(D) -> D2) -> LatticeBuilder<M, B, F, K, L, D2> {
        self.with(|Parts { manifold, bracket, fields, friction, sums, data }| {
            let data = replace(data);
            Parts { manifold, bracket, fields, friction, sums, data }
        })
    }

    fn with_sum<T>(self, last: T) -> LatticeBuilder<M, B, F, K, (L, T), D> {
        self.with(|Parts { manifold, bracket, fields, friction, sums, data }| Parts {
            manifold,
            bracket,
            fields,
            friction,
            sums: (sums, last),
            data,
        })
    }

    /// Sets the Poisson tensor of each site: every bracket of
    /// [`metriplectic_dynamics`](metriplectic_dynamics::bracket), with the canonical metric of the manifold. On a
    /// product it is a pair.
    pub fn bracket<B2>(self, bracket: B2) -> LatticeBuilder<M, B2, F, K, L, D> {
        self.with(|Parts { manifold, fields, friction, sums, data, .. }| Parts {
            manifold,
            bracket,
            fields,
            friction,
            sums,
            data,
        })
    }
}

#[allow(
    clippy::type_complexity,
    reason = "the type of a builder lists the parts of the lattice, and a name for it would hide them"
)]
impl<M, B, H, V, S, G, KB, KS, L, D, E>
    LatticeBuilder<M, B, Fields<H, V, S, G>, Friction<KB, KS>, L, Data<D, E>>
where
    M: Manifold + Times<M>,
    D: LocalData,
    E: LocalData,
{
    /// Gives each site data, which the methods with a name in `_with` pass to their closures: masses, bath
    /// temperatures. Give them before these closures.
    pub fn site_data<T: Sync>(
        self,
        data: Vec<T>,
    ) -> LatticeBuilder<M, B, Fields<H, V, S, G>, Friction<KB, KS>, L, Data<Vec<T>, E>> {
        self.with_data(|Data { bonds, .. }| Data { sites: data, bonds })
    }

    /// Gives each bond data, in the order of the bonds of the graph: spring constants, conductivities.
    pub fn bond_data<T: Sync>(
        self,
        data: Vec<T>,
    ) -> LatticeBuilder<M, B, Fields<H, V, S, G>, Friction<KB, KS>, L, Data<D, Vec<T>>> {
        self.with_data(|Data { sites, .. }| Data { sites, bonds: data })
    }

    /// Sets the friction in a bond: `R` terms `ρ b bᵀ` from the points at its sites and the differentials of the
    /// total energy there, which must annihilate each `b`.
    pub fn bond_onsager<T, const R: usize>(
        self,
        terms: T,
    ) -> LatticeBuilder<M, B, Fields<H, V, S, G>, Friction<Terms<T, R>, KS>, L, Data<D, E>>
    where
        T: Fn(&BondState<'_, M, E::Item>) -> [Onsager<[Vector<M>; 2]>; R] + Sync,
    {
        self.with_friction(|Friction { sites, .. }| Friction { bonds: Terms(terms), sites })
    }

    /// Sets the friction within a site: `R` terms `ρ b bᵀ` from its point and the differential of the total energy
    /// there, which must annihilate each `b`.
    pub fn site_onsager<T, const R: usize>(
        self,
        terms: T,
    ) -> LatticeBuilder<M, B, Fields<H, V, S, G>, Friction<KB, Terms<T, R>>, L, Data<D, E>>
    where
        T: Fn(&SiteState<'_, M, D::Item>) -> [Onsager<Vector<M>>; R] + Sync,
    {
        self.with_friction(|Friction { bonds, .. }| Friction { bonds, sites: Terms(terms) })
    }

    /// Appends a function of a site whose sum over the lattice is conserved: the momentum, the mass. Each step
    /// conserves the sum to round-off.
    pub fn conserved<T: ScalarField<M> + Sync>(
        self,
        sum: T,
    ) -> LatticeBuilder<M, B, Fields<H, V, S, G>, Friction<KB, KS>, (L, Uniform<T>), Data<D, E>>
    {
        self.with_sum(Uniform(sum))
    }

    /// Appends such a function of a point and the data of its site.
    pub fn conserved_with<T: Fn(&M::Point<Real>, &D::Item) -> Real + Sync>(
        self,
        sum: T,
    ) -> LatticeBuilder<M, B, Fields<H, V, S, G>, Friction<KB, KS>, (L, WithData<T>), Data<D, E>>
    {
        self.with_sum(WithData(sum))
    }
}

#[allow(
    clippy::type_complexity,
    reason = "the type of a builder lists the parts of the lattice, and a name for it would hide them"
)]
impl<M, B, H, V, S, GE, GS, KB, KS, L, D, E>
    LatticeBuilder<M, B, Fields<H, V, S, Gathers<GE, GS>>, Friction<KB, KS>, L, Data<D, E>>
where
    M: Manifold + Times<M>,
    D: LocalData,
    E: LocalData,
{
    /// Checks the graph and the structure, and finishes the lattice in `O(N)`. Every run checks the laws that need
    /// points, by [`Lattice::verify`].
    ///
    /// # Errors
    ///
    /// [`LatticeError`] if the parts do not make a lattice.
    pub fn build(
        self,
    ) -> Result<
        Lattice<Parts<M, B, Fields<H, V, S, Gathers<GE, GS>>, Friction<KB, KS>, L, Data<D, E>>>,
        LatticeError,
    >
    where
        Canonical: Riemannian<M>,
        B: Bracket<M, Canonical> + Sync,
        H: LocalField<M, D::Item>,
        V: LocalField<Product<M, M>, E::Item>,
        S: LocalField<M, D::Item>,
        GE: Gather<M>,
        GS: Gather<M>,
        KB: BondFriction<M, E::Item>,
        KS: SiteFriction<M, D::Item>,
        L: ConservedSums<M, D::Item>,
        E: InOrder,
    {
        self.part(0, Box::new(Alone))
    }

    /// Finishes the part with this number of a lattice that is cut into as many parts as there are neighbours.
    pub(crate) fn part(
        self,
        number: usize,
        neighbours: Box<dyn Neighbours>,
    ) -> Result<
        Lattice<Parts<M, B, Fields<H, V, S, Gathers<GE, GS>>, Friction<KB, KS>, L, Data<D, E>>>,
        LatticeError,
    >
    where
        Canonical: Riemannian<M>,
        B: Bracket<M, Canonical> + Sync,
        H: LocalField<M, D::Item>,
        V: LocalField<Product<M, M>, E::Item>,
        S: LocalField<M, D::Item>,
        GE: Gather<M>,
        GS: Gather<M>,
        KB: BondFriction<M, E::Item>,
        KS: SiteFriction<M, D::Item>,
        L: ConservedSums<M, D::Item>,
        E: InOrder,
    {
        let Self { graph, mut parts, has_bond_entropy } = self;
        let graph = graph.checked()?;
        let counts = [
            ("sites", parts.data.sites.count(), graph.sites()),
            ("bonds", parts.data.bonds.count(), graph.bonds().len()),
        ];
        for (of, found, expected) in counts {
            if let Some(found) = found.filter(|&found| found != expected) {
                return Err(LatticeError::Data { of, found, expected });
            }
        }
        if has_bond_entropy {
            return Err(LatticeError::EntropyOnBonds);
        }
        let has_friction = KB::PRESENT || KS::PRESENT;
        if has_friction != (S::PRESENT || GS::PRESENT) {
            return Err(LatticeError::EntropyWithoutFriction);
        }
        if !has_friction && Bracket::<M, Canonical>::is_zero(&parts.bracket) {
            return Err(LatticeError::NothingMoves);
        }
        if Bracket::<M, Canonical>::is_forced(&parts.bracket) {
            return Err(LatticeError::ForcedBracket);
        }
        let layout = Layout::part(&graph, number, neighbours)?;
        match layout.order() {
            Some(order) => parts.data.bonds.arrange(order),
            None => parts.data.bonds.keep(layout.bonds_of_graph()),
        }
        parts.data.sites.keep(layout.sites_of_graph());
        Ok(Lattice::new(parts, layout))
    }
}
