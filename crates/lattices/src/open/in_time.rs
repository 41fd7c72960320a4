//! The energy of a lattice that depends on time: that of the lattice, and one more of each site.

use metriplectic_fields::{Evaluation, Jet1, Real, ScalarField, Space};

use crate::double::Double;
use crate::gather::Gathers;
use crate::model::{Model, PairManifold, PairOf, PointOf, VectorOf};
use crate::onsager::Onsager;
use crate::parallel;

/// A point of a site with derivatives.
type RealPointOf<P> = <<P as Model>::Manifold as Space>::Point<Real>;
/// An energy `h(t, i, x_i)` of a site that depends on time.
pub(super) type Field<P> = dyn Fn(Real, usize, &RealPointOf<P>) -> Real + Send + Sync;

/// The parts of a lattice, with the energy that it has at a time.
#[expect(missing_debug_implementations, reason = "closures have no `Debug`")]
pub struct AtTime<'a, P: Model> {
    pub(super) parts: &'a P,
    pub(super) fields: &'a [Box<Field<P>>],
    pub(super) time: f64,
}

impl<P: Model> AtTime<'_, P> {
    /// The energy of a site that depends on time.
    fn in_time(&self, site: usize) -> impl Fn(&RealPointOf<P>) -> Real {
        move |x| {
            let t = Real::from(self.time);
            self.fields.iter().fold(Real::from(0.0), |sum, field| sum + field(t, site, x))
        }
    }
}

impl<P: Model> Model for AtTime<'_, P> {
    type Manifold = P::Manifold;
    type EnergyGather = P::EnergyGather;
    type EntropyGather = P::EntropyGather;

    const SUMS: usize = P::SUMS;
    const ENTROPY: bool = P::ENTROPY;
    const BOND_ENERGY: bool = P::BOND_ENERGY;
    const BOND_FRICTION: bool = P::BOND_FRICTION;
    const TERMS: [usize; 2] = P::TERMS;

    fn manifold(&self) -> &P::Manifold {
        self.parts.manifold()
    }

    #[inline]
    fn energy(&self, site: usize, x: &PointOf<P>) -> Jet1<P::Manifold> {
        let still = self.parts.energy(site, x);
        if self.fields.is_empty() {
            return still;
        }
        let moving = ScalarField::<P::Manifold>::jet1(&self.in_time(site), x);
        Jet1 { value: still.value + moving.value, df: still.df + moving.df }
    }

    #[inline]
    fn bond_energy(&self, bond: usize, x: &PairOf<P>) -> Jet1<PairManifold<P>> {
        self.parts.bond_energy(bond, x)
    }

    #[inline]
    fn gathers(&self) -> &Gathers<P::EnergyGather, P::EntropyGather> {
        self.parts.gathers()
    }

    #[inline]
    fn entropy(&self, site: usize, x: &PointOf<P>) -> Jet1<P::Manifold> {
        self.parts.entropy(site, x)
    }

    fn values(&self, site: usize, x: &PointOf<P>) -> [f64; 2] {
        let [energy, entropy] = self.parts.values(site, x);
        if self.fields.is_empty() {
            return [energy, entropy];
        }
        [energy + ScalarField::<P::Manifold>::at::<f64>(&self.in_time(site), x), entropy]
    }

    fn bond_value(&self, bond: usize, x: &PairOf<P>) -> f64 {
        self.parts.bond_value(bond, x)
    }

    #[inline]
    fn sum(&self, index: usize, site: usize, x: &PointOf<P>) -> Jet1<P::Manifold> {
        self.parts.sum(index, site, x)
    }

    fn evaluations(
        &self,
        site: &PointOf<P>,
        bond: Option<&PairOf<P>>,
        put: &mut dyn FnMut(&'static str, Evaluation),
    ) {
        self.parts.evaluations(site, bond, put);
        self.fields.iter().for_each(|_| put("energy in time", Evaluation::Function));
    }

    fn has_bracket(&self) -> bool {
        self.parts.has_bracket()
    }

    #[inline]
    fn reversible(&self, x: &PointOf<P>, w: &VectorOf<P>, s: &VectorOf<P>) -> VectorOf<P> {
        self.parts.reversible(x, w, s)
    }

    #[inline]
    fn site_friction(
        &self,
        site: usize,
        x: &PointOf<P>,
        differentials: [&VectorOf<P>; 2],
        visit: impl FnMut(Onsager<VectorOf<P>>),
    ) {
        self.parts.site_friction(site, x, differentials, visit);
    }

    #[inline]
    fn bond_friction(
        &self,
        bond: usize,
        x: [&PointOf<P>; 2],
        differentials: [[&VectorOf<P>; 2]; 2],
        visit: impl FnMut(Onsager<[VectorOf<P>; 2]>),
    ) {
        self.parts.bond_friction(bond, x, differentials, visit);
    }
}

/// Sums a number of each site over all energies that depend on time, in double digits and in a fixed order.
pub(super) fn sum<P: Model>(
    fields: &[Box<Field<P>>],
    x: &[PointOf<P>],
    number: impl Fn(&Field<P>, usize, &RealPointOf<P>) -> f64 + Sync,
) -> f64 {
    if fields.is_empty() {
        return 0.0;
    }
    let sums = parallel::map(x.len(), |sites| {
        let mut sum = Double::default();
        for site in sites {
            let x = P::Manifold::constant(&x[site]);
            fields.iter().for_each(|field| sum.add(number(&**field, site, &x)));
        }
        sum
    });
    let sum = parallel::tree(sums, &|mut a, b| {
        a.merge(b);
        a
    });
    sum.unwrap_or_default().value()
}
