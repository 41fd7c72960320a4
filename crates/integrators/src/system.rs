//! Every metriplectic system is a flow, and one on which explicit methods run.

mod reach;
mod recheck;
mod referred_rise;
mod stages;

use metriplectic_dynamics::invariants::{Kind, Visitor};
use metriplectic_dynamics::velocity::{
    Covectors, Gradient, differentials, irreversible, projected_fractions,
};
use metriplectic_dynamics::{
    Dissipation, InNumbers, Invariants, Metriplectic, ModelError, SecondLaw, system::Point,
};
use metriplectic_equations::Evaluated;
use metriplectic_fields::{ChartPoint, Column, Dimension, ScalarField, Space, stack};
use metriplectic_manifolds::{InnerProduct as _, Manifold, PointError};

use reach::Around;
pub(crate) use recheck::{NO_CLOCK, recheck};
pub(crate) use referred_rise::ROUNDING;
pub(crate) use stages::JetsOf;
pub use stages::LawJets;
pub(crate) use stages::{CONSERVED, CORRECTIONS, OFF, STAGNATED};

use crate::explicit::{StageFlow as _, Target};
use crate::round_off::bound::{SizesAt, of_an_increment, size_of_terms, sizes_on_a_step};
use crate::step::compiled::{has_explicit, has_implicit};
use crate::step::{
    Components, CountOf, Dim, Directions, Entries, Flow, FlowVisitor, Laws, Listed, Numbers,
    Recheck, Scales, Values, Written, initial_scales,
};
use metriplectic_manifolds::Riemannian as _;

type Tangent<Y> = Components<metriplectic_fields::Vector<<Y as Metriplectic>::Manifold>>;

impl<Y: Metriplectic> Flow for Y {
    type Space = Y::Manifold;
    type Numbers = Numbers<Y>;
    type Vector = Tangent<Y>;

    #[inline]
    fn room(&self, work: &mut dyn FnMut()) {
        stack::with_room::<Dim<Y>, ()>(work);
    }

    #[inline]
    fn laws(&self, x: &Point<Y>) -> Laws<Numbers<Y>> {
        let [energy, entropy] = [self.energy_at(x), self.entropy_at(x)];
        Laws { energy, entropy, invariants: values(self, x) }
    }

    fn term_sizes(&self, x: &Point<Y>) -> Laws<Numbers<Y>> {
        Laws {
            energy: size_of_terms::<Y::Manifold>(self.energy(), x),
            entropy: size_of_terms::<Y::Manifold>(self.entropy(), x),
            invariants: of_each(self, &mut SizesAt::<Y::Manifold>(x)),
        }
    }

    fn rates(&self, x: &Point<Y>, d: &Tangent<Y>) -> Option<Tangent<Y>> {
        reach::velocity(self, x, d.0).map(Components)
    }

    #[inline]
    fn sizes(&self, x: &Point<Y>) -> Tangent<Y> {
        Components(Y::Manifold::scales(x))
    }

    fn moved(&self, x: &Point<Y>, d: &Tangent<Y>) -> Point<Y> {
        Y::Manifold::chart(x, &d.0)
    }

    fn displacement(&self, x: &Point<Y>, y: &Point<Y>) -> Option<Tangent<Y>> {
        let q = Y::Manifold::coordinates(x, y);
        (q.is_finite() && Y::Manifold::is_near(&q)).then_some(Components(q))
    }

    fn production(&self, x: &Point<Y>) -> Option<f64> {
        let centre = ChartPoint::<Y::Manifold>::centre(x);
        let w = differentials(self, &centre);
        let production = w.entropy.dot(&irreversible(self, &self.metric_at(&centre), &w).ok()?);
        production.is_finite().then_some(production)
    }

    fn onto(
        &self,
        y: &Point<Y>,
        laws: &Laws<Numbers<Y>>,
        entropy: Option<f64>,
    ) -> Option<Point<Y>> {
        let laws = Laws { entropy: entropy.unwrap_or(laws.entropy), ..*laws };
        let with_entropy = entropy.is_some();
        let target = Target { laws: &laws, with_entropy, limit: None, units: None, error: None };
        self.project(y.clone(), &target).ok().map(|end| end.x)
    }

    fn element(&self, entries: &[f64]) -> Result<Point<Y>, PointError> {
        self.manifold().from_entries(entries)
    }

    #[inline]
    fn entropy_law(&self) -> SecondLaw {
        self.second_law()
    }

    fn evaluated(&self, x: &Point<Y>) -> Vec<Evaluated> {
        metriplectic_dynamics::metriplectic::evaluated(self, x)
    }

    fn kinds(&self) -> Vec<Kind> {
        struct Kinds(Vec<Kind>);
        impl<M: Space> Visitor<M> for Kinds {
            fn visit(&mut self, kind: Kind, _: &impl ScalarField<M>) {
                self.0.push(kind);
            }
        }
        let mut kinds = Kinds(Vec::new());
        self.invariants().each(&mut kinds);
        kinds.0
    }

    fn is_projected(&self) -> bool {
        self.dissipation().is_projected()
    }

    fn default_friction(&self, x: &Point<Y>) -> Option<f64> {
        default_friction(self, x)
    }

    fn check(&self, x0: &Point<Y>) -> Result<(), ModelError> {
        self.check_start(x0)
    }

    #[inline]
    fn is_verified(&self) -> bool {
        Metriplectic::is_verified(self)
    }

    #[inline]
    fn rechecks(&self, _: Recheck) -> bool {
        true
    }

    fn recheck(&self, x: &Point<Y>, occasion: Recheck) -> Result<(), ModelError> {
        InNumbers(self).at(x, |system, x| recheck(system, x, occasion))
    }

    #[inline]
    fn defect(&self, x: &Point<Y>) -> f64 {
        self.manifold().defect(x)
    }

    fn energy_sizes(&self, ends: [&Point<Y>; 2]) -> [f64; 2] {
        sizes_on_a_step(self, ends)
    }

    fn entropy_round_off(&self, ends: [&Point<Y>; 2]) -> f64 {
        of_an_increment(self, ends)
    }

    fn dependent_invariant(&self, x: &Point<Y>) -> Option<(usize, f64)> {
        dependent_invariant(self, x)
    }

    fn reach(&self, x: &Point<Y>, span: f64) -> Option<Scales<Tangent<Y>>> {
        // A constant, so that only one of the two is compiled.
        if const { reach::is_small(<Dim<Y> as Dimension>::LEN) } {
            let sizes = Self::directions(&self.sizes(x));
            let Scales { sizes, terms } = reach::reach(&Around { system: self, x }, &sizes, span)?;
            Some(Scales { sizes: Self::vector(&sizes), terms: Self::vector(&terms) })
        } else {
            initial_scales(self, x, span)
        }
    }

    fn velocity_terms(
        &self,
        x: &Point<Y>,
        v: &Tangent<Y>,
        sizes: &Tangent<Y>,
    ) -> Option<Tangent<Y>> {
        let (v, sizes) = (Self::directions(v), Self::directions(sizes));
        let terms = reach::terms_of_many(&Around { system: self, x }, &v, &sizes)?;
        Some(Self::vector(&terms))
    }

    fn rates_and_terms(&self, x: &Point<Y>) -> Option<[Tangent<Y>; 2]> {
        let sizes = Self::directions(&self.sizes(x));
        let [v, terms] = reach::velocity_and_terms(&Around { system: self, x }, &sizes)?;
        Some([Self::vector(&v), Self::vector(&terms)])
    }

    /// In plain numbers, so that a run is compiled with this library.
    fn visit<V: FlowVisitor<Y>>(&self, visitor: V) -> V::Output {
        visitor.answered(self, &InNumbers(self))
    }

    /// The estimate `e` of the local error, in the chart at `x`; see the [controller](crate::run::controller).
    #[inline(never)]
    fn local_error(&self, x: &Point<Y>, end: &Point<Y>, h: f64) -> Option<Tangent<Y>> {
        let q = Y::Manifold::coordinates(x, end);
        if !Y::Manifold::is_near(&q) {
            return None;
        }
        let f = |q| self.velocity(&ChartPoint { base: x.clone(), q }).ok();
        let (start, there) = (f(Column::zero())?, f(q)?);
        let middle = f(q * 0.5 - (there - start) * (h / 8.0))?;
        Some(Components(q - (start + middle * 4.0 + there) * (h / 6.0)))
    }
}

impl<Y: Metriplectic> Listed for Y {
    type Layout = ();

    fn layout(&self) -> &() {
        &()
    }

    #[inline]
    fn read((): &(), entries: &[f64]) -> Point<Y> {
        let mut entries = entries.iter();
        Y::Manifold::assemble(&mut || *entries.next().expect("a state has all of its entries"))
    }

    #[inline]
    fn write(x: &Point<Y>) -> Entries {
        let mut count = 0;
        Y::Manifold::write(x, &mut |_| count += 1);
        let mut entries = Entries::zeros(count);
        let mut to = entries.iter_mut();
        let mut put = |entry| *to.next().expect("there is room for all entries") = entry;
        Y::Manifold::write(x, &mut put);
        entries
    }
}

impl<Y: Metriplectic> Written for Y {
    const HAS_EXPLICIT: bool =
        Y::Invariants::COUNT == 0 && has_explicit(<Dim<Y> as Dimension>::LEN, Y::Manifold::ENTRIES);

    const HAS_IMPLICIT: bool = Y::Manifold::IS_VECTOR_SPACE
        && Y::Metric::IS_CANONICAL
        && Y::Invariants::COUNT == 0
        && has_implicit(<Dim<Y> as Dimension>::LEN);

    #[inline]
    fn vector(directions: &Directions) -> Tangent<Y> {
        let numbers = &directions.numbers()[..Dim::<Y>::LEN];
        Components(Column::from_index(|i| numbers[i]))
    }

    #[inline]
    fn directions(v: &Tangent<Y>) -> Directions {
        let mut directions = Directions::zeros(Dim::<Y>::LEN);
        let to = directions.numbers_mut().iter_mut().enumerate();
        to.for_each(|(i, to)| *to = v.0[i]);
        directions
    }

    #[inline]
    fn numbers(values: &Values) -> Numbers<Y> {
        let values = values.as_ref();
        CountOf::<Y>::array(|k| values[k])
    }
}

/// The size of the default friction of a system at a point, for [`Flow::default_friction`].
pub(crate) fn default_friction<Y: Metriplectic>(system: &Y, x: &Point<Y>) -> Option<f64> {
    if !system.dissipation().is_default() {
        return None;
    }
    let centre = ChartPoint::<Y::Manifold>::centre(x);
    let w = differentials(system, &centre).energy;
    let w = system.metric_at(&centre).inner().ok()?.orthonormal(&w);
    Some(w.dot(&w))
}

/// The further invariants of a system at a point.
fn values<Y: Metriplectic>(system: &Y, x: &Point<Y>) -> Numbers<Y> {
    struct Values<'a, M: Space>(&'a M::Point<f64>);
    impl<M: Space> Gradient<M> for Values<'_, M> {
        type Covector = f64;

        #[inline]
        fn of(&mut self, f: &impl ScalarField<M>) -> f64 {
            f.at(self.0)
        }
    }
    of_each(system, &mut Values::<Y::Manifold>(x))
}

/// A number for each of the further invariants.
#[inline]
fn of_each<Y: Metriplectic>(
    system: &Y,
    number: &mut impl Gradient<Y::Manifold, Covector = f64>,
) -> Numbers<Y> {
    if const { Y::Invariants::COUNT == 0 } {
        return CountOf::<Y>::array(|_| 0.0);
    }
    let numbers = Covectors::new([0.0; 2], system.invariants(), number);
    CountOf::<Y>::array(|k| numbers.invariants[k].map_or(0.0, |(_, value)| value))
}

/// The further invariant that has the least independent fraction at `x`, and this fraction, if it is small
/// enough to be the cause of a failure.
fn dependent_invariant<Y: Metriplectic>(system: &Y, x: &Point<Y>) -> Option<(usize, f64)> {
    least_dependent(projected_fractions(system, &ChartPoint::centre(x)))
}

/// The further invariant with the least of these independent fractions, and this fraction, if it is small enough to be the cause
/// of a failure.
pub(crate) fn least_dependent(fractions: Vec<f64>) -> Option<(usize, f64)> {
    let least = fractions.into_iter().enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
    least.filter(|(_, fraction)| *fraction < DEPENDENT)
}

/// The independent fraction of a further invariant's differential that explains a failure.
/// A factor of four fails `system.rs::an_invariant_with_a_thousandth_that_is_independent_explains_a_failure`.
const DEPENDENT: f64 = 1e-3;

#[cfg(test)]
mod tests {
    use super::*;
    use metriplectic_dynamics::System;
    use metriplectic_fields::Real;
    use metriplectic_manifolds::Euclidean;
    use nalgebra::{Vector3, vector};

    #[test]
    fn an_invariant_with_a_thousandth_that_is_independent_explains_a_failure() {
        let system = System::on(Euclidean::<3>)
            .energy(|x: &Vector3<Real>| x.z)
            .entropy(|x: &Vector3<Real>| -x.x)
            .casimir(|x: &Vector3<Real>| x.z + x.y * x.y)
            .build()
            .unwrap();
        // Beside dH it is 2y dy, in units of y against those of z.
        let found = |y: f64| dependent_invariant(&system, &vector![0.0, y, 1.0]);
        assert!(found(0.02).is_some_and(|(index, _)| index == 0) && found(0.04).is_none());
    }
}
