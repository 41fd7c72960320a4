//! A law along a step with stages: its covectors and the number `δ` by which they miss its change, along all directions.

use metriplectic_dynamics::Metriplectic;
use metriplectic_dynamics::velocity::{Covectors, Gradient};
use metriplectic_fields::{Column as _, Dimension as _, Jet1, Jet2, ScalarField, Vector};
use metriplectic_manifolds::{Manifold, MovingBase};
use num_dual::Dual64;

use super::super::duals::{Dual, along};
use super::moved::{Around, Direction, Moved};
use crate::collocation::trust;
use crate::round_off::stable_gradient::{but_round_off, short};
use crate::step::{CountOf, Dim};

/// A field along a step.
pub(super) struct LawAlong<Y: Metriplectic> {
    stages: Vec<Jet2<Y::Manifold>>,
    /// At the start and at the end.
    ends: [Jet1<Y::Manifold>; 2],
    /// The change along the polynomial as an integral, for each direction; none where a difference of values is trusted alone.
    integrals: Vec<Dual64>,
    /// The weight of the integral.
    weight: f64,
}

impl<Y: Metriplectic> LawAlong<Y> {
    /// The differential at a stage.
    pub(super) fn covector(&self, stage: usize, delta: &Vector<Y::Manifold>) -> Dual<Y> {
        along::<Y>(&self.stages[stage], delta).1
    }

    pub(super) fn is_finite(&self) -> bool {
        self.stages.iter().all(Jet2::is_finite)
    }

    /// The sum `h Σ b_i ⟨dF(X_i), v_i⟩`, and the sizes of its terms and of those of its derivative.
    fn slope(&self, weights: &[f64], moved: &Moved<Y>) -> (Dual64, [f64; 2]) {
        let (mut sum, mut sizes) = (Dual64::from(0.0), [0.0; 2]);
        for (i, stage) in moved.stages.iter().enumerate() {
            let w = self.covector(i, &stage.delta);
            for c in 0..Dim::<Y>::LEN {
                let term = w[c] * stage.displacement[c] * weights[i];
                sum += term;
                sizes = [sizes[0] + term.re.abs(), sizes[1] + term.eps.abs()];
            }
        }
        (sum, sizes)
    }

    /// The number `δ`, along the direction `number`.
    pub(super) fn lost(&self, weights: &[f64], moved: &Moved<Y>, number: usize) -> Dual64 {
        let (slope, [size, along]) = self.slope(weights, moved);
        let [before, after] = &self.ends;
        let ends = [before.df.dot(&moved.start), after.df.dot(&moved.end)];
        let lost = Dual64::new(after.value - before.value, ends[1] - ends[0]) - slope;
        let Some(integral) = self.integrals.get(number) else { return lost };
        let lost = lost * (1.0 - self.weight) + (*integral - slope) * self.weight;
        // What is divided by the square of the velocity near rest must not be rounding.
        let along = along + ends[0].abs() + ends[1].abs();
        Dual64::new(but_round_off(lost.re, size), but_round_off(lost.eps, along))
    }
}

/// The fields of a system along a step.
pub(super) struct Laws<Y: Metriplectic> {
    pub(super) list: Vec<LawAlong<Y>>,
    /// The place of each field in the list.
    pub(super) places: Covectors<CountOf<Y>, usize>,
}

/// Evaluates one field after the other.
struct AlongSteps<'a, Y: Metriplectic> {
    around: &'a Around<'a, Y>,
    directions: &'a [Direction<Y>],
    moved: &'a [Moved<Y>],
    list: Vec<LawAlong<Y>>,
}

impl<Y: Metriplectic<Manifold: MovingBase>> Laws<Y> {
    pub(super) fn new(
        around: &Around<'_, Y>,
        directions: &[Direction<Y>],
        moved: &[Moved<Y>],
    ) -> Self {
        let system = around.system;
        let mut along = AlongSteps { around, directions, moved, list: Vec::new() };
        let laws = [along.of(system.energy()), along.of(system.entropy())];
        let places = Covectors::new(laws, system.invariants(), &mut along);
        Self { list: along.list, places }
    }
}

impl<Y: Metriplectic<Manifold: MovingBase>> AlongSteps<'_, Y> {
    /// The change of a field along the polynomial of the step, as an integral.
    fn integral(&self, f: &impl ScalarField<Y::Manifold>, direction: &Direction<Y>) -> Dual64 {
        let points = self.around.root.tableau.points().iter();
        points.fold(Dual64::from(0.0), |sum, point| {
            let y = self.around.along(direction, &point.position, &point.velocity);
            let value = f.at_real(&y);
            sum + Dual64::new(value.eps2, value.eps1eps2) * point.weight
        })
    }

    /// The fraction of the integral by the size of the change, and the function that says how far it is trusted.
    fn weight(&self, f: &impl ScalarField<Y::Manifold>, law: &LawAlong<Y>) -> f64 {
        let (tableau, Some(moved)) = (self.around.root.tableau, self.moved.first()) else {
            return 0.0;
        };
        let (scales, [before, after]) = (self.around.scales(), &law.ends);
        let (mut change, mut size) = (0.0, before.value.abs() + after.value.abs());
        for (i, stage) in moved.stages.iter().enumerate() {
            let v = Vector::<Y::Manifold>::from_index(|c| stage.displacement[c].re);
            let df = &law.stages[i].df;
            change += tableau.weights[i] * Y::Manifold::pairing_size(df, &v);
            size += tableau.weights[i] * df.abs().dot(&scales);
        }
        let fraction = short(change, size);
        if fraction == 0.0 {
            return 0.0;
        }
        let Some(still) = self.directions.first() else { return 0.0 };
        let slope = law.slope(&tableau.weights, moved).0.re;
        let lost = self.integral(f, still).re - slope;
        fraction * trust(lost, [change, f64::EPSILON * size], tableau.stages)
    }
}

impl<Y: Metriplectic<Manifold: MovingBase>> Gradient<Y::Manifold> for AlongSteps<'_, Y> {
    type Covector = usize;

    fn of(&mut self, f: &impl ScalarField<Y::Manifold>) -> usize {
        let Around { piece, points, .. } = self.around;
        let stages = points.iter().map(|x| f.jet2(x)).collect();
        let ends = [piece.x, piece.end].map(|x| f.jet1(x));
        let mut law = LawAlong { stages, ends, integrals: Vec::new(), weight: 0.0 };
        law.weight = self.weight(f, &law);
        if law.weight > 0.0 {
            law.integrals = self.directions.iter().map(|d| self.integral(f, d)).collect();
        }
        self.list.push(law);
        self.list.len() - 1
    }
}
