//! The motion of a system along directions, from the second derivatives of its fields.

use metriplectic_dynamics::system::Point;
use metriplectic_dynamics::velocity::{Covectors, irreversible};
use metriplectic_dynamics::{Bracket as _, Dissipation as _, Invariants as _, Metriplectic};
use metriplectic_fields::{
    ChartPoint, Column as _, Dimension as _, Jet2, Matrix, Real, Space, Square as _, Vector,
    Velocity,
};
use num_dual::Dual64;

use super::model::{AlongParameter, Model, second};
use crate::step::{CountOf, Dim};

/// Components with one derivative each.
pub(super) type Dual<Y> = Vector<<Y as Metriplectic>::Manifold, Dual64>;

/// A point of a system whose entries carry two derivatives.
pub(super) type Hyperdual<Y> = <<Y as Metriplectic>::Manifold as Space>::Point<Real>;

/// A number with a derivative along each column.
pub(super) type Numbers = Vec<Dual64>;

/// A direction of the state, and the parameter that moves with it.
#[derive(Debug)]
pub(super) struct Direction<Y: Metriplectic> {
    pub(super) delta: Vector<Y::Manifold>,
    pub(super) parameter: Option<usize>,
}

impl<Y: Metriplectic> Clone for Direction<Y> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<Y: Metriplectic> Copy for Direction<Y> {}

/// The second derivatives of all fields at a point, which serve all columns.
pub(super) struct Fields<Y: Metriplectic> {
    pub(super) y: Point<Y>,
    pub(super) jets: Covectors<CountOf<Y>, Jet2<Y::Manifold>>,
    /// The derivatives along parameters, field by field.
    along: Vec<AlongParameter<Y>>,
    parameters: usize,
}

/// The number of the energy and of the entropy among the fields; invariants stand behind them.
pub(super) const ENERGY: usize = 0;
pub(super) const ENTROPY: usize = 1;

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
    pub(super) fn at(model: &impl Model<System = Y>, y: Point<Y>) -> Option<Self> {
        let jets = second(model.system(), &y);
        let along = model.along_parameters(&y);
        let listed = jets.invariants.as_ref().iter().flatten();
        let finite = jets.energy.is_finite()
            && jets.entropy.is_finite()
            && listed.clone().all(|(_, jet)| jet.is_finite())
            && along.iter().all(|(slope, bend)| slope.is_finite() && bend.is_finite());
        finite.then(|| Self { y, jets, along, parameters: model.parameters() })
    }

    /// The derivatives of a field along a parameter.
    fn along_parameter(&self, field: usize, k: usize) -> &AlongParameter<Y> {
        &self.along[field * self.parameters + k]
    }

    /// The jet of a field along a direction: the value and the differential.
    pub(super) fn along(
        &self,
        field: usize,
        jet: &Jet2<Y::Manifold>,
        direction: &Direction<Y>,
    ) -> (Dual64, Dual<Y>) {
        let Direction { delta, parameter } = direction;
        let (mut value, mut covector) = along::<Y>(jet, delta);
        if let Some(k) = *parameter {
            let (slope, bend) = self.along_parameter(field, k);
            value.eps += slope;
            for i in 0..Dim::<Y>::LEN {
                covector[i].eps += bend[i];
            }
        }
        (value, covector)
    }

    /// The place in the chart at the point that moves along `δ`.
    pub(super) fn place(&self, delta: &Vector<Y::Manifold>) -> ChartPoint<Y::Manifold, Dual64> {
        let q = Dual::<Y>::from_index(|i| Dual64::new(0.0, delta[i]));
        ChartPoint { base: self.y.clone(), q }
    }
}

/// How the velocity `v = Π dH + K dS`, as it is written by hand, and the production `σ = ⟨dS, K dS⟩` change along directions.
pub(super) enum Motion<Y: Metriplectic> {
    /// By the derivatives of the tensors.
    Linear(Box<Linear<Y>>),
    /// At dual numbers, direction by direction: where friction is projected, or a force acts.
    ByDuals,
}

/// The derivatives of the velocity and of the production.
type Slopes<Y> = (Matrix<<Y as Metriplectic>::Manifold>, Vector<<Y as Metriplectic>::Manifold>);

/// The velocity and the production with their derivatives along the state and along covectors.
pub(super) struct Linear<Y: Metriplectic> {
    v: Vector<Y::Manifold>,
    production: f64,
    /// Along the state.
    along: Slopes<Y>,
    /// Along `dH` and `dS`.
    covectors: [Slopes<Y>; 2],
}

impl<Y: Metriplectic> Linear<Y> {
    fn new(system: &Y, fields: &Fields<Y>) -> Option<Self> {
        let [h, s] = [&fields.jets.energy, &fields.jets.entropy];
        let z = ChartPoint::<Y::Manifold>::centre(&fields.y);
        let g = system.metric_at(&z);
        let pi = system.bracket().linearise(&system.bracket_args(&g, &s.df), &h.df).ok()?;
        let k = system.dissipation().linearise(&g, &h.df, &s.df).ok()?;
        let friction = k.along_z + k.along_w * h.hf + k.tensor * s.hf;
        let motion = pi.along_z + pi.tensor * h.hf + pi.along_s * s.hf;
        let production = friction.transpose_times(&s.df) + s.hf.transpose_times(&k.value);
        let along_energy = (pi.tensor + k.along_w, k.along_w.transpose_times(&s.df));
        let along_entropy = (pi.along_s + k.tensor, k.tensor.transpose_times(&s.df) + k.value);
        Some(Self {
            v: pi.value + k.value,
            production: s.df.dot(&k.value),
            along: (motion + friction, production),
            covectors: [along_energy, along_entropy],
        })
    }

    /// The derivatives along a direction.
    #[inline]
    fn along(&self, fields: &Fields<Y>, direction: &Direction<Y>) -> (Vector<Y::Manifold>, f64) {
        let (motion, production) = &self.along;
        let delta = &direction.delta;
        let (mut v, mut rise) = (*motion * *delta, production.dot(delta));
        if let Some(k) = direction.parameter {
            for (field, (tensor, row)) in self.covectors.iter().enumerate() {
                let (_, bend) = fields.along_parameter(field, k);
                v += *tensor * *bend;
                rise += row.dot(bend);
            }
        }
        (v, rise)
    }
}

impl<Y: Metriplectic> Fields<Y> {
    /// Prepares the motion along directions.
    pub(super) fn motion(&self, system: &Y) -> Option<Motion<Y>> {
        if Y::Invariants::COUNT > 0 || system.bracket().is_forced() {
            return Some(Motion::ByDuals);
        }
        Some(Motion::Linear(Box::new(Linear::new(system, self)?)))
    }

    /// The velocity and the production where the point moves along a direction.
    pub(super) fn moved(
        &self,
        system: &Y,
        motion: &Motion<Y>,
        direction: &Direction<Y>,
    ) -> Option<(Dual<Y>, Dual64)> {
        let Motion::Linear(linear) = motion else { return self.by_duals(system, direction) };
        let (slope, rise) = linear.along(self, direction);
        let v = Dual::<Y>::from_index(|i| Dual64::new(linear.v[i], slope[i]));
        Some((v, Dual64::new(linear.production, rise)))
    }

    fn by_duals(&self, system: &Y, direction: &Direction<Y>) -> Option<(Dual<Y>, Dual64)> {
        let listed = self.jets.invariants.as_ref();
        let of = |field, jet: &Jet2<Y::Manifold>| self.along(field, jet, direction).1;
        let w = Covectors::<CountOf<Y>, Dual<Y>> {
            energy: of(ENERGY, &self.jets.energy),
            entropy: of(ENTROPY, &self.jets.entropy),
            invariants: CountOf::<Y>::array(|k| {
                listed[k].as_ref().map(|(kind, jet)| (*kind, of(ENTROPY + 1 + k, jet)))
            }),
        };
        let x = self.place(&direction.delta);
        let g = system.metric_at(&x);
        let args = system.bracket_args(&g, &w.entropy);
        let reversible = system.bracket().apply(&args, &w.energy).ok()?;
        let friction = irreversible(system, &g, &w).ok()?;
        Some((reversible + friction, w.entropy.dot(&friction)))
    }

    /// The velocity of components at the place that moves along `δ`, as it is written by hand.
    pub(super) fn embedded(
        &self,
        delta: &Vector<Y::Manifold>,
        v: &Dual<Y>,
    ) -> Velocity<Y::Manifold, Dual64> {
        Y::Manifold::embed(&self.place(delta), v)
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
