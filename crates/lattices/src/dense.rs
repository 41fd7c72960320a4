//! A lattice as a system in plain numbers, of which implicit methods take steps with Jacobians of all pairs of variables.
//!
//! The entries are those of the points, site by site. The Jacobians are formed by [`Differences`], because friction is a closure of
//! numbers without derivatives; the equation of a step needs none, so both laws are exact. The [paths](crate::paths) of steps are those of
//! the sites.

use metriplectic_dynamics::SecondLaw;
use metriplectic_dynamics::invariants::Kind;
use metriplectic_equations::{
    Apart, Covectors, Differences, ENERGY, ENTROPY, Equations, Evaluated, Part, Paths, PointError,
    Sizes,
};
use metriplectic_fields::{Column as _, Space as _};
use metriplectic_integrators::{
    Control, DiscreteGradient, Element, Flow, FromEquations, Gauss, Laws, Listed as _, MethodError,
    Promises, Radau, Refusal, Scheme, StageFlow as _, StepEnds, StepError, StepStart, Stepper,
    Taken, Values, Vector as _,
};
use metriplectic_manifolds::{Canonical, Euclidean, Manifold as _, Retraction};

use crate::flow::listed;
use crate::lattice::{Lattice, differentials_at, dimension};
use crate::model::{Model, VectorOf};
use crate::vector::SiteVector;

/// A lattice in plain numbers.
pub(crate) struct Dense<'a, P>(pub(crate) &'a Lattice<P>);

impl<P: Model> Dense<'_, P> {
    /// The vector with these numbers.
    pub(crate) fn vector(&self, numbers: &[f64]) -> SiteVector {
        self.0.vector_of(|site| column::<P>(numbers, site))
    }
}

/// The part of a site of a vector.
pub(crate) fn column<P: Model>(numbers: &[f64], site: usize) -> VectorOf<P> {
    let own = &numbers[site * dimension::<P>()..][..dimension::<P>()];
    VectorOf::<P>::from_index(|k| own[k])
}

/// Writes the part of a site of a vector.
pub(crate) fn put<P: Model>(v: &VectorOf<P>, site: usize, numbers: &mut [f64]) {
    let own = &mut numbers[site * dimension::<P>()..][..dimension::<P>()];
    own.iter_mut().enumerate().for_each(|(k, to)| *to = v[k]);
}

impl<P: Model> Equations for Dense<'_, P> {
    fn sizes(&self) -> Sizes {
        let mut length = 0;
        P::Manifold::assemble(&mut || {
            length += 1;
            1.0
        });
        let of_all = |length: usize| self.0.sites() * length;
        let (entries, directions) = (of_all(length), of_all(dimension::<P>()));
        Sizes { entries, directions, laws: ENTROPY + 1 + P::SUMS }
    }

    fn values(&self, _: f64, x: &[f64], values: &mut [f64]) {
        let laws = self.0.laws(&listed(x));
        (values[ENERGY], values[ENTROPY]) = (laws.energy, laws.entropy);
        values[ENTROPY + 1..].copy_from_slice(&laws.invariants);
    }

    fn differentials(&self, _: f64, x: &[f64], values: &mut [f64], w: &mut [f64]) {
        let (n, x) = (self.0.sites() * dimension::<P>(), listed(x));
        let jets = self.0.jets(&x);
        let laws = jets.laws();
        (values[ENERGY], values[ENTROPY]) = (laws.energy, laws.entropy);
        values[ENTROPY + 1..].copy_from_slice(&laws.invariants);
        for site in 0..self.0.sites() {
            for (law, df) in differentials_at::<P>(&jets.all, site).iter().enumerate() {
                put::<P>(df, site, &mut w[law * n..][..n]);
            }
            for k in 0..P::SUMS {
                let df = self.0.parts.sum(k, site, &x[site]).df;
                put::<P>(&df, site, &mut w[(ENTROPY + 1 + k) * n..][..n]);
            }
        }
    }

    fn velocity(&self, _: f64, x: &[f64], v: &mut [f64]) -> Option<f64> {
        let (velocity, production) = self.0.motion(&listed(x))?;
        v.copy_from_slice(&velocity.to_list());
        Some(production)
    }

    fn second_law(&self) -> SecondLaw {
        self.0.entropy_law()
    }

    fn evaluated(&self, x: &[f64]) -> Vec<Evaluated> {
        self.0.evaluated(&listed(x))
    }

    fn kind(&self, _: usize) -> Kind {
        Kind::Momentum
    }

    fn check(&self, x: &[f64]) -> Result<(), PointError> {
        self.0.element(x).map(|_| ())
    }

    fn defect(&self, x: &[f64]) -> f64 {
        self.0.defect(&listed(x))
    }

    fn scales(&self, x: &[f64], sizes: &mut [f64]) {
        for (site, x) in listed::<P::Manifold>(x).iter().enumerate() {
            put::<P>(&P::Manifold::scales(x), site, sizes);
        }
    }

    fn chart(&self, x: &[f64], q: &[f64], y: &mut [f64]) {
        let mut y = y.iter_mut();
        for (site, x) in listed::<P::Manifold>(x).iter().enumerate() {
            let end = P::Manifold::chart(x, &column::<P>(q, site));
            P::Manifold::write(&end, &mut |entry| {
                *y.next().expect("a slice has the entries of a state") = entry;
            });
        }
    }

    fn coordinates(&self, x: &[f64], y: &[f64], to: &mut [f64]) -> bool {
        let (x, y) = (listed::<P::Manifold>(x), listed::<P::Manifold>(y));
        (0..self.0.sites()).fold(true, |is_near, site| {
            let q: VectorOf<P> = P::Manifold::coordinates(&x[site], &y[site]);
            put::<P>(&q, site, to);
            is_near && q.is_finite() && P::Manifold::is_near(&q)
        })
    }
}

impl<P: Model> Apart for Dense<'_, P> {
    fn has_charts(&self) -> bool {
        !P::Manifold::IS_VECTOR_SPACE
    }

    fn paths(&self) -> Option<&dyn Paths> {
        Some(self)
    }

    fn is_zero(&self, part: Part) -> bool {
        match part {
            Part::Reversible => !self.0.parts.has_bracket(),
            Part::Gyroscopic => true,
            Part::Irreversible => !P::ENTROPY,
        }
    }

    fn apply(&self, part: Part, _: f64, x: &[f64], w: Covectors<'_>, alpha: &[f64], v: &mut [f64]) {
        let (lattice, x) = (self.0, listed::<P::Manifold>(x));
        v.fill(0.0);
        let at = |numbers: &[f64], site: usize| column::<P>(numbers, site);
        for site in 0..lattice.sites() {
            let (s, alpha) = (at(w.entropy, site), at(alpha, site));
            let mut sum = VectorOf::<P>::zero();
            if part == Part::Reversible {
                sum = lattice.parts.reversible(&x[site], &alpha, &s);
            } else {
                let both = [&at(w.energy, site), &s];
                lattice.parts.site_friction(site, &x[site], both, |term| {
                    sum += term.b * (term.rate * term.b.dot(&alpha));
                });
            }
            put::<P>(&sum, site, v);
        }
        let has_bonds = part == Part::Irreversible && P::BOND_FRICTION;
        for (bond, ends) in lattice.layout.bonds().iter().enumerate().filter(|_| has_bonds) {
            let [i, j] = ends.map(|site| site as usize);
            let [first, second] = [i, j].map(|site| [at(w.energy, site), at(w.entropy, site)]);
            let both = [[&first[0], &first[1]], [&second[0], &second[1]]];
            let [a, b] = [i, j].map(|site| at(alpha, site));
            let mut sums = [at(v, i), at(v, j)];
            lattice.parts.bond_friction(bond, [&x[i], &x[j]], both, |term| {
                let force = term.rate * (term.b[0].dot(&a) + term.b[1].dot(&b));
                sums[0] += term.b[0] * force;
                sums[1] += term.b[1] * force;
            });
            put::<P>(&sums[0], i, v);
            put::<P>(&sums[1], j, v);
        }
    }
}

/// A lattice behind a pointer, as implicit methods know it.
type Plain<'a> = FromEquations<&'a dyn Equations>;

/// Calls `f` with a lattice in plain numbers.
fn in_numbers<P: Model, T>(lattice: &Lattice<P>, f: impl FnOnce(&Plain<'_>) -> T) -> T {
    f(&FromEquations(&Differences(Dense(lattice))))
}

/// Writes the laws of a lattice.
fn written(laws: &Laws<Vec<f64>>) -> Laws<Values> {
    let &Laws { energy, entropy, ref invariants } = laws;
    Laws { energy, entropy, invariants: Values::of(invariants) }
}

/// Calls `f` with the start of a step in plain numbers.
fn with_start<P: Model, T>(
    start: &StepStart<'_, Lattice<P>>,
    f: impl FnOnce(&StepStart<'_, Plain<'_>>) -> T,
) -> T {
    in_numbers(start.flow, |flow| {
        f(&StepStart {
            flow,
            x: &Lattice::<P>::write(start.x),
            time: start.time,
            values: written(&start.values),
            reference: written(&start.reference),
            allowed: None,
        })
    })
}

/// Calls `f` with the ends of a step in plain numbers.
fn with_ends<P: Model, T>(
    step: &StepEnds<'_, Lattice<P>>,
    f: impl FnOnce(&StepEnds<'_, Plain<'_>>) -> T,
) -> T {
    let [x, end] = [step.x, step.end].map(Lattice::<P>::write);
    let [before, after] = step.values.map(written);
    let (values, reference) = ([&before, &after], &written(step.reference));
    in_numbers(step.flow, |flow| {
        f(&StepEnds { flow, x: &x, end: &end, h: step.h, values, reference })
    })
}

/// Reads a step of a lattice.
fn typed<P: Model>(taken: Taken<Plain<'_>>) -> Taken<Lattice<P>> {
    let Taken { x, values: Laws { energy, entropy, invariants }, evidence, effort } = taken;
    let values = Laws { energy, entropy, invariants: invariants.as_ref().to_vec() };
    Taken { x: listed(&x), values, evidence, effort }
}

/// The steps of an implicit method of a lattice: those of the lattice in plain numbers.
macro_rules! implicit {
    ($([$($generics:tt)*] $method:ty $(where $($bound:ty: $of:path),+)?;)+) => {$(
        impl<P: Model, $($generics)*> Stepper<Lattice<P>> for $method
        $(where $($bound: $of),+)?
        {
            type Memory = <Self as Stepper<Plain<'static>>>::Memory;

            fn name(&self) -> String {
                Stepper::<Plain<'_>>::name(self)
            }

            fn order(&self) -> u32 {
                Stepper::<Plain<'_>>::order(self)
            }

            fn control(&self) -> Control {
                Stepper::<Plain<'_>>::control(self)
            }

            fn damps(&self) -> bool {
                Stepper::<Plain<'_>>::damps(self)
            }

            fn promises(&self, lattice: &Lattice<P>) -> Promises {
                in_numbers(lattice, |flow| self.promises(flow))
            }

            fn serves(&self, lattice: &Lattice<P>) -> Result<(), MethodError> {
                in_numbers(lattice, |flow| self.serves(flow))
            }

            fn step(
                &self,
                start: &StepStart<'_, Lattice<P>>,
                h: f64,
                memory: &mut Self::Memory,
            ) -> Result<Taken<Lattice<P>>, StepError> {
                with_start(start, |start| {
                    self.step(start, h, memory).map(typed)
                })
            }

            fn attempt(
                &self,
                start: &StepStart<'_, Lattice<P>>,
                h: f64,
                memory: &mut Self::Memory,
            ) -> Result<Taken<Lattice<P>>, Refusal> {
                with_start(start, |start| {
                    self.attempt(start, h, memory).map(typed)
                })
            }

            fn error(
                &self,
                step: &StepEnds<'_, Lattice<P>>,
                memory: &Self::Memory,
                norm: impl Fn(&SiteVector) -> f64,
            ) -> Option<f64> {
                let lattice = Dense(step.flow);
                with_ends(step, |step| {
                    self.error(step, memory, |error| norm(&lattice.vector(error.numbers())))
                })
            }

            fn between(
                &self,
                step: &StepEnds<'_, Lattice<P>>,
                memory: &mut Self::Memory,
                theta: f64,
            ) -> Option<Element<Lattice<P>>> {
                with_ends(step, |step| self.between(step, memory, theta).map(|x| listed(&x)))
            }
        }
    )+};
}

implicit! {
    [R, W] Scheme<R, W> where R: Retraction<Euclidean<1>, Canonical>, W: DiscreteGradient;
    [const S: usize] Gauss<S>;
    [const S: usize] Radau<S>;
}
