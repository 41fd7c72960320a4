//! The motion of a system at dual numbers, from the second derivatives of its fields.

use metriplectic_dynamics::velocity::{Covectors, Gradient, irreversible};
use metriplectic_dynamics::{Bracket as _, Metriplectic, system::Point};
use metriplectic_fields::{
    ChartPoint, Column as _, Dimension as _, Jet2, ScalarField, Space, Vector, Velocity,
};
use num_dual::Dual64;

use crate::step::CountOf;

/// Components with one derivative each.
pub(super) type Dual<Y> = Vector<<Y as Metriplectic>::Manifold, Dual64>;

/// A number with a derivative along each column.
pub(super) type Numbers = Vec<Dual64>;

/// The second derivatives of all fields at a point, which serve all columns.
#[derive(Debug)]
pub(super) struct Fields<Y: Metriplectic> {
    pub(super) y: Point<Y>,
    pub(super) jets: Covectors<CountOf<Y>, Jet2<Y::Manifold>>,
}

/// The jets of all fields at a point.
struct Second<'a, M: Space>(&'a M::Point<f64>);

impl<M: Space> Gradient<M> for Second<'_, M> {
    type Covector = Jet2<M>;

    fn of(&mut self, f: &impl ScalarField<M>) -> Jet2<M> {
        f.jet2(self.0)
    }
}

/// A jet along `δ`: the value and the differential.
pub(super) fn along<Y: Metriplectic>(
    jet: &Jet2<Y::Manifold>,
    delta: &Vector<Y::Manifold>,
) -> (Dual64, Dual<Y>) {
    let bend = jet.hf * *delta;
    let value = Dual64::new(jet.value, jet.df.dot(delta));
    (value, Dual::<Y>::from_index(|i| Dual64::new(jet.df[i], bend[i])))
}

impl<Y: Metriplectic> Fields<Y> {
    /// Evaluates all fields; `None` if a second derivative is not finite.
    pub(super) fn at(system: &Y, y: Point<Y>) -> Option<Self> {
        let mut second = Second::<Y::Manifold>(&y);
        let laws = [second.of(system.energy()), second.of(system.entropy())];
        let jets = Covectors::new(laws, system.invariants(), &mut second);
        let listed = jets.invariants.as_ref().iter().flatten();
        let finite = jets.energy.is_finite()
            && jets.entropy.is_finite()
            && listed.clone().all(|(_, jet)| jet.is_finite());
        finite.then_some(Self { y, jets })
    }

    /// The differentials along `δ`.
    fn covectors(&self, delta: &Vector<Y::Manifold>) -> Covectors<CountOf<Y>, Dual<Y>> {
        let listed = self.jets.invariants.as_ref();
        Covectors {
            energy: along::<Y>(&self.jets.energy, delta).1,
            entropy: along::<Y>(&self.jets.entropy, delta).1,
            invariants: CountOf::<Y>::array(|k| {
                listed[k].map(|(kind, jet)| (kind, along::<Y>(&jet, delta).1))
            }),
        }
    }

    /// The place in the chart at the point that moves along `δ`.
    pub(super) fn place(&self, delta: &Vector<Y::Manifold>) -> ChartPoint<Y::Manifold, Dual64> {
        let q = Dual::<Y>::from_index(|i| Dual64::new(0.0, delta[i]));
        ChartPoint { base: self.y.clone(), q }
    }

    /// The velocity `Π dH + K dS`, as it is written by hand, and the production `⟨dS, K dS⟩`, where the point moves
    /// along `δ`.
    pub(super) fn motion(
        &self,
        system: &Y,
        delta: &Vector<Y::Manifold>,
    ) -> Option<(Velocity<Y::Manifold, Dual64>, Dual64)> {
        let (w, x) = (self.covectors(delta), self.place(delta));
        let g = system.metric_at(&x);
        let args = system.bracket_args(&g, &w.entropy);
        let reversible = system.bracket().apply(&args, &w.energy).ok()?;
        let friction = irreversible(system, &g, &w).ok()?;
        let velocity = Y::Manifold::embed(&x, &(reversible + friction));
        Some((velocity, w.entropy.dot(&friction)))
    }
}

/// The derivatives of dual components.
pub(super) fn derivative<V: metriplectic_fields::Column<f64>>(
    v: &impl metriplectic_fields::Column<Dual64>,
) -> V {
    V::from_index(|i| v[i].eps)
}

/// The absolute value with its derivative on the side of the number.
pub(super) fn magnitude(x: Dual64) -> Dual64 {
    if x.re < 0.0 { -x } else { x }
}
