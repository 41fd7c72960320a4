//! Implicit steps of an open lattice: those of the lattice in plain numbers, with its ports and baths as a force.

use metriplectic_dynamics::SecondLaw;
use metriplectic_dynamics::invariants::Kind;
use metriplectic_equations::{
    Apart, Covectors, Differences, Equations, Part, Paths, PointError, Sizes,
};
use metriplectic_fields::Column as _;
use metriplectic_integrators::open::{Exchanged, OpenFlow, OpenSteps};
use metriplectic_integrators::{
    Control, Directions, DiscreteGradient, Element, Entries, Flow as _, Gauss, Laws, Listed as _,
    MethodError, Promises, Radau, Refusal, Scheme, StepEnds, StepError, StepStart, Stepper, Taken,
    Vector as _,
};
use metriplectic_manifolds::{Canonical, Euclidean, Retraction};

use super::OpenLattice;
use super::parts::Exchanged as OfParts;
use super::vector::OpenSiteVector;
use crate::dense::{Dense, column, put};
use crate::flow::listed;
use crate::lattice::Lattice;
use crate::model::{Model, VectorOf};
use crate::points::Points;

/// An open lattice in plain numbers, and its closed part.
struct Driven<'a, P: Model>(&'a OpenLattice<P>, Dense<'a, P>);

impl<'a, P: Model> Driven<'a, P> {
    const fn of(lattice: &'a OpenLattice<P>) -> Self {
        Self(lattice, Dense(&lattice.lattice))
    }

    const fn closed(&self) -> &Dense<'a, P> {
        &self.1
    }

    /// The effects of ports and baths with these covectors `w_H` and `w_S` of energy and entropy.
    ///
    /// A port carries no entropy, `⟨dS, F⟩ = 0`. Where `w_S` is a discrete gradient it differs from the differential, and in a step
    /// a port has the velocity `F − ♯w_S ⟨w_S, F⟩/⟨w_S, ♯w_S⟩`, as in a typed system.
    fn exchanged(&self, t: f64, x: &[f64], [w, s]: [&[f64]; 2]) -> OfParts<VectorOf<P>> {
        let lattice = self.0;
        let at = |site: usize| [w, s].map(|w| column::<P>(w, site));
        let mut exchanged = lattice.exchanged_with(t, &listed::<P::Manifold>(x), at);
        let along_entropy = |a: &[f64]| s.iter().zip(a).map(|(s, a)| s * a).sum::<f64>();
        let [square, warmed] = [s, w].map(along_entropy);
        let (mut entry, mut fraction, count) = (0, 0.0, exchanged.velocities.len());
        for (k, part) in lattice.parts.iter().enumerate() {
            let end = exchanged.firsts.get(k + 1).copied().unwrap_or(count);
            let own = &exchanged.velocities[exchanged.firsts[k]..end];
            let carried: f64 = own.iter().map(|(site, v)| at(*site)[1].dot(v)).sum();
            if !part.is_bath() && carried != 0.0 {
                fraction += carried / square;
                exchanged.entries[entry] -= carried / square * warmed;
            }
            entry += if part.is_bath() { 2 } else { 1 };
        }
        if fraction != 0.0 {
            let along = |site: usize| (site, at(site)[1] * -fraction);
            exchanged.velocities.extend((0..lattice.lattice.sites()).map(along));
        }
        exchanged
    }
}

impl<P: Model> Equations for Driven<'_, P> {
    fn sizes(&self) -> Sizes {
        self.closed().sizes()
    }

    fn values(&self, t: f64, x: &[f64], values: &mut [f64]) {
        self.closed().values(t, x, values);
    }

    fn differentials(&self, t: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        self.closed().differentials(t, x, values, w);
    }

    fn velocity(&self, t: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        let points = listed::<P::Manifold>(x);
        let (all, _) = self.0.lattice.differentials::<false>(&points);
        let (velocity, production) = self.0.velocity_along(t, &points, &all)?;
        v.copy_from_slice(&velocity.v.to_list());
        Some(production)
    }

    fn second_law(&self) -> SecondLaw {
        self.closed().second_law()
    }

    fn kind(&self, invariant: usize) -> Kind {
        self.closed().kind(invariant)
    }

    fn check(&self, x: &[f64]) -> Result<(), PointError> {
        self.closed().check(x)
    }

    fn defect(&self, x: &[f64]) -> f64 {
        self.closed().defect(x)
    }

    fn scales(&self, x: &[f64], sizes: &mut [f64]) {
        self.closed().scales(x, sizes);
    }

    fn chart(&self, x: &[f64], q: &[f64], y: &mut [f64]) {
        self.closed().chart(x, q, y);
    }

    fn coordinates(&self, x: &[f64], y: &[f64], q: &mut [f64]) -> bool {
        self.closed().coordinates(x, y, q)
    }
}

impl<P: Model> Apart for Driven<'_, P> {
    fn has_charts(&self) -> bool {
        self.closed().has_charts()
    }

    fn paths(&self) -> Option<&dyn Paths> {
        self.closed().paths()
    }

    fn is_zero(&self, part: Part) -> bool {
        match part {
            Part::Gyroscopic => self.0.parts.is_empty(),
            Part::Reversible | Part::Irreversible => self.closed().is_zero(part),
        }
    }

    fn apply(&self, part: Part, t: f64, x: &[f64], w: Covectors<'_>, alpha: &[f64], v: &mut [f64]) {
        if part != Part::Gyroscopic {
            return self.closed().apply(part, t, x, w, alpha, v);
        }
        v.fill(0.0);
        for (site, more) in self.exchanged(t, x, [w.energy, w.entropy]).velocities {
            let sum = column::<P>(v, site) + more;
            put::<P>(&sum, site, v);
        }
    }
}

impl<P: Model> OpenFlow for OpenLattice<P> {
    type Point = Points<P::Manifold>;

    fn with_equations<T>(&self, f: impl FnOnce(&dyn Equations) -> T) -> T {
        f(&Differences(Driven::of(self)))
    }

    fn entries(&self, x: &Self::Point) -> Entries {
        Lattice::<P>::write(x)
    }

    fn point(&self, entries: &[f64]) -> Self::Point {
        listed(entries)
    }

    fn direction(&self, v: &Directions, entries: &[f64]) -> OpenSiteVector {
        let mut beside = vec![0.0];
        beside.extend(entries);
        OpenSiteVector::new(Dense(&self.lattice).vector(v.numbers()), beside)
    }

    fn laws_of_point(&self, x: &Self::Point) -> Laws<Vec<f64>> {
        self.lattice.laws(x)
    }

    fn exchanged(&self, t: f64, x: &[f64], w: [&[f64]; 2]) -> Option<Exchanged> {
        if self.baths(t).iter().any(|(_, temperature)| *temperature < 0.0) {
            return None;
        }
        let OfParts { entries, production, .. } = Driven::of(self).exchanged(t, x, w);
        let is_finite = production.is_finite() && entries.iter().all(|rate| rate.is_finite());
        is_finite.then_some(Exchanged { entries, production })
    }

    fn bath_count(&self) -> usize {
        self.parts.iter().filter(|part| part.is_bath()).count()
    }

    fn baths(&self, t: f64) -> Vec<(usize, f64)> {
        let mut heat = 0;
        let of_part = self.parts.iter().filter_map(|part| {
            let here = heat;
            heat += if part.is_bath() { 2 } else { 1 };
            part.temperature(t).map(|temperature| (here, temperature))
        });
        of_part.collect()
    }
}

/// The steps of an implicit method of an open lattice.
macro_rules! implicit {
    ($([$($generics:tt)*] $method:ty $(where $($bound:ty: $of:path),+)?;)+) => {$(
        impl<P: Model, $($generics)*> Stepper<OpenLattice<P>> for $method
        $(where $($bound: $of),+)?
        {
            type Memory = <Self as OpenSteps>::Memory;

            fn name(&self) -> String {
                OpenSteps::name(self)
            }

            fn order(&self) -> u32 {
                OpenSteps::order(self)
            }

            fn control(&self) -> Control {
                OpenSteps::control(self)
            }

            fn damps(&self) -> bool {
                OpenSteps::damps(self)
            }

            fn promises(&self, lattice: &OpenLattice<P>) -> Promises {
                Promises::all_laws(lattice.entropy_law() == SecondLaw::Exact)
            }

            fn serves(&self, lattice: &OpenLattice<P>) -> Result<(), MethodError> {
                OpenSteps::serves(self, lattice)
            }

            fn step(
                &self,
                start: &StepStart<'_, OpenLattice<P>>,
                h: f64,
                memory: &mut Self::Memory,
            ) -> Result<Taken<OpenLattice<P>>, StepError> {
                OpenSteps::step(self, start, h, memory)
            }

            fn attempt(
                &self,
                start: &StepStart<'_, OpenLattice<P>>,
                h: f64,
                memory: &mut Self::Memory,
            ) -> Result<Taken<OpenLattice<P>>, Refusal> {
                OpenSteps::attempt(self, start, h, memory)
            }

            fn error(
                &self,
                step: &StepEnds<'_, OpenLattice<P>>,
                memory: &Self::Memory,
                norm: impl Fn(&OpenSiteVector) -> f64,
            ) -> Option<f64> {
                OpenSteps::error(self, step, memory, norm)
            }

            fn between(
                &self,
                step: &StepEnds<'_, OpenLattice<P>>,
                memory: &mut Self::Memory,
                theta: f64,
            ) -> Option<Element<OpenLattice<P>>> {
                OpenSteps::between(self, step, memory, theta)
            }
        }
    )+};
}

implicit! {
    [R, W] Scheme<R, W> where R: Retraction<Euclidean<1>, Canonical>, W: DiscreteGradient;
    [const S: usize] Gauss<S>;
    [const S: usize] Radau<S>;
}
