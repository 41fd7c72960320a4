//! The parts of a lattice, as its loops need them.

use metriplectic_dynamics::{Bracket, BracketArgs};
use metriplectic_fields::{ChartPoint, Column, Evaluation, Jet1, Vector};
use metriplectic_manifolds::{Canonical, Manifold, MetricAt, Product, Riemannian, Times};

use crate::fields::{ConservedSums, LocalData, LocalField};
use crate::gather::{Gather, Gathers};
use crate::onsager::{BondFriction, BondState, Onsager, SiteFriction, SiteState};

/// The functions and tensors of a lattice, site by site and bond by bond; [`Parts`] is the one implementation.
pub trait Model: Sync {
    /// The manifold of a site.
    type Manifold: Manifold + Times<Self::Manifold>;
    /// The sum over bonds that the energy gathers.
    type EnergyGather: Gather<Self::Manifold>;
    /// The sum over bonds that the entropy gathers.
    type EntropyGather: Gather<Self::Manifold>;

    /// How many conserved sums there are.
    const SUMS: usize;
    /// True if there is an entropy.
    const ENTROPY: bool;
    /// True if bonds have an energy.
    const BOND_ENERGY: bool;
    /// True if bonds have friction.
    const BOND_FRICTION: bool;
    /// How many terms of friction a site has, and a bond.
    const TERMS: [usize; 2];

    /// The manifold.
    fn manifold(&self) -> &Self::Manifold;

    /// The energy of a site.
    fn energy(&self, site: usize, x: &PointOf<Self>) -> Jet1<Self::Manifold>;

    /// The energy of a bond.
    fn bond_energy(&self, bond: usize, x: &PairOf<Self>) -> Jet1<PairManifold<Self>>;

    /// The sums over bonds that energy and entropy gather.
    fn gathers(&self) -> &Gathers<Self::EnergyGather, Self::EntropyGather>;

    /// The entropy of a site.
    fn entropy(&self, site: usize, x: &PointOf<Self>) -> Jet1<Self::Manifold>;

    /// The values of the energy and the entropy of a site.
    fn values(&self, site: usize, x: &PointOf<Self>) -> [f64; 2];

    /// The value of the energy of a bond.
    fn bond_value(&self, bond: usize, x: &PairOf<Self>) -> f64;

    /// A conserved function at a site.
    fn sum(&self, index: usize, site: usize, x: &PointOf<Self>) -> Jet1<Self::Manifold>;

    /// Passes on the names of the fields of a site and of a bond, and what their derivatives come from.
    fn evaluations(
        &self,
        site: &PointOf<Self>,
        bond: Option<&PairOf<Self>>,
        put: &mut dyn FnMut(&'static str, Evaluation),
    );

    /// Returns whether there is a bracket.
    fn has_bracket(&self) -> bool;

    /// `Π w` at a site; not a number where it has no value.
    fn reversible(
        &self,
        x: &PointOf<Self>,
        w: &VectorOf<Self>,
        s: &VectorOf<Self>,
    ) -> VectorOf<Self>;

    /// The terms of the friction at a site with these differentials of energy and entropy.
    fn site_friction(
        &self,
        site: usize,
        x: &PointOf<Self>,
        differentials: [&VectorOf<Self>; 2],
        visit: impl FnMut(Onsager<VectorOf<Self>>),
    );

    /// The terms of the friction in a bond with these differentials of energy and entropy at each site.
    fn bond_friction(
        &self,
        bond: usize,
        x: [&PointOf<Self>; 2],
        differentials: [[&VectorOf<Self>; 2]; 2],
        visit: impl FnMut(Onsager<[VectorOf<Self>; 2]>),
    );
}

/// A point of a site.
pub(crate) type PointOf<P> = <<P as Model>::Manifold as metriplectic_fields::Space>::Point<f64>;
/// Components at a site.
pub(crate) type VectorOf<P> = Vector<<P as Model>::Manifold>;
/// The points of a bond.
pub(crate) type PairOf<P> = (PointOf<P>, PointOf<P>);
/// The manifold of a bond.
pub(crate) type PairManifold<P> = Product<<P as Model>::Manifold, <P as Model>::Manifold>;

/// The functions and tensors that a user has written.
#[derive(Clone)]
#[expect(missing_debug_implementations, reason = "closures have no `Debug`")]
pub struct Parts<M, B, F, K, L, D> {
    pub(crate) manifold: M,
    pub(crate) bracket: B,
    pub(crate) fields: F,
    pub(crate) friction: K,
    pub(crate) sums: L,
    pub(crate) data: D,
}

/// The energy of a site, the energy of a bond, the entropy of a site, and what both laws gather over bonds.
#[derive(Clone, Copy, Debug, Default)]
pub struct Fields<H, V, S, G> {
    pub(crate) energy: H,
    pub(crate) bond_energy: V,
    pub(crate) entropy: S,
    pub(crate) gathers: G,
}

/// The friction in bonds and at sites.
#[derive(Clone, Copy, Debug, Default)]
pub struct Friction<KB, KS> {
    pub(crate) bonds: KB,
    pub(crate) sites: KS,
}

/// The data of the sites and of the bonds.
#[derive(Clone, Debug, Default)]
pub struct Data<D, E> {
    pub(crate) sites: D,
    pub(crate) bonds: E,
}

impl<M, B, H, V, S, GE, GS, KB, KS, L, D, E> Model
    for Parts<M, B, Fields<H, V, S, Gathers<GE, GS>>, Friction<KB, KS>, L, Data<D, E>>
where
    M: Manifold + Times<M>,
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
    D: LocalData,
    E: LocalData,
{
    type Manifold = M;
    type EnergyGather = GE;
    type EntropyGather = GS;

    const SUMS: usize = L::COUNT;
    const ENTROPY: bool = S::PRESENT || GS::PRESENT;
    const BOND_ENERGY: bool = V::PRESENT;
    const BOND_FRICTION: bool = KB::PRESENT;
    const TERMS: [usize; 2] = [KS::TERMS, KB::TERMS];

    fn manifold(&self) -> &M {
        &self.manifold
    }

    #[inline]
    fn energy(&self, site: usize, x: &M::Point<f64>) -> Jet1<M> {
        self.fields.energy.jet(x, self.data.sites.of(site))
    }

    #[inline]
    fn bond_energy(&self, bond: usize, x: &PairOf<Self>) -> Jet1<Product<M, M>> {
        self.fields.bond_energy.jet(x, self.data.bonds.of(bond))
    }

    #[inline]
    fn gathers(&self) -> &Gathers<GE, GS> {
        &self.fields.gathers
    }

    #[inline]
    fn entropy(&self, site: usize, x: &M::Point<f64>) -> Jet1<M> {
        self.fields.entropy.jet(x, self.data.sites.of(site))
    }

    fn values(&self, site: usize, x: &M::Point<f64>) -> [f64; 2] {
        let (fields, data) = (&self.fields, self.data.sites.of(site));
        [fields.energy.value(x, data), fields.entropy.value(x, data)]
    }

    fn bond_value(&self, bond: usize, x: &PairOf<Self>) -> f64 {
        self.fields.bond_energy.value(x, self.data.bonds.of(bond))
    }

    #[inline]
    fn sum(&self, index: usize, site: usize, x: &M::Point<f64>) -> Jet1<M> {
        self.sums.jet(index, x, self.data.sites.of(site))
    }

    fn evaluations(
        &self,
        site: &M::Point<f64>,
        bond: Option<&PairOf<Self>>,
        put: &mut dyn FnMut(&'static str, Evaluation),
    ) {
        let Fields { energy, bond_energy, entropy, .. } = &self.fields;
        energy.evaluations(site, &mut |from| put("energy of a site", from));
        if let Some(bond) = bond {
            bond_energy.evaluations(bond, &mut |from| put("energy of a bond", from));
        }
        entropy.evaluations(site, &mut |from| put("entropy of a site", from));
    }

    fn has_bracket(&self) -> bool {
        !Bracket::<M, Canonical>::is_zero(&self.bracket)
    }

    #[inline]
    fn reversible(&self, x: &M::Point<f64>, w: &Vector<M>, s: &Vector<M>) -> Vector<M> {
        let x = ChartPoint::<M>::centre(x);
        let g = MetricAt::new(&Canonical, &x);
        let at = BracketArgs { space: &self.manifold, g: &g, s };
        let not_a_number = |_| Vector::<M>::from_index(|_| f64::NAN);
        self.bracket.apply(&at, w).unwrap_or_else(not_a_number)
    }

    #[inline]
    fn site_friction(
        &self,
        site: usize,
        x: &M::Point<f64>,
        [w, s]: [&Vector<M>; 2],
        visit: impl FnMut(Onsager<Vector<M>>),
    ) {
        let data = self.data.sites.of(site);
        self.friction.sites.each(&SiteState { x, w, s, data }, visit);
    }

    #[inline]
    fn bond_friction(
        &self,
        bond: usize,
        x: [&M::Point<f64>; 2],
        [first, second]: [[&Vector<M>; 2]; 2],
        visit: impl FnMut(Onsager<[Vector<M>; 2]>),
    ) {
        let data = self.data.bonds.of(bond);
        let (w, s) = ([first[0], second[0]], [first[1], second[1]]);
        self.friction.bonds.each(&BondState { x, w, s, data }, visit);
    }
}
