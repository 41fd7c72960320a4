//! The residual of a step with stages, `h V_i − h v_i`, along a direction.

use metriplectic_dynamics::velocity::{irreversible, reversible};
use metriplectic_dynamics::{Metriplectic, SecondLaw};
use metriplectic_fields::{Column as _, Dimension as _, ScalarField, Vector, power_of_two};
use metriplectic_manifolds::{InnerProduct as _, MovingBase};
use num_dual::{Dual64, DualNum as _};

use super::super::duals::{Dual, along, derivative};
use super::super::error::Unlinearised;
use super::heat::{AtStage, Flat, Heating};
use super::law::Laws;
use super::moved::{Around, Direction, Moved};
use crate::step::CountOf;

/// The derivatives of a step along a direction.
pub(super) struct Derivative<Y: Metriplectic> {
    /// Of the residuals of the stages.
    pub(super) residual: Vec<Vector<Y::Manifold>>,
    /// Of the start.
    pub(super) start: Vector<Y::Manifold>,
    /// Of the end.
    pub(super) end: Vector<Y::Manifold>,
    /// Of the entropy that is produced.
    pub(super) produced: f64,
}

/// The equation of a step around its root.
pub(super) struct Equation<'a, Y: Metriplectic> {
    pub(super) around: Around<'a, Y>,
    directions: Vec<Direction<Y>>,
    moved: Vec<Moved<Y>>,
    laws: Laws<Y>,
}

impl<'a, Y: Metriplectic<Manifold: MovingBase>> Equation<'a, Y> {
    pub(super) fn new(around: Around<'a, Y>) -> Result<Self, Unlinearised> {
        let directions = Direction::all(around.root.tableau.stages);
        let moved: Vec<_> = directions.iter().map(|d| around.moved(d)).collect();
        let laws = Laws::new(&around, &directions, &moved);
        if !laws.list.iter().all(super::law::LawAlong::is_finite) {
            return Err(Unlinearised::NotSmooth);
        }
        Ok(Self { around, directions, moved, laws })
    }

    /// The derivatives along all directions; the last one is that of the size of the step.
    pub(super) fn derivatives(&self) -> Result<Vec<Derivative<Y>>, Unlinearised> {
        (0..self.directions.len()).map(|number| self.derivative(number)).collect()
    }

    /// The covectors `♭v_i`.
    fn flat(&self, moved: &Moved<Y>) -> Option<Flat<Y>> {
        let weights = &self.around.root.tableau.weights;
        let inverse = moved.size.recip();
        let largest = moved.stages.iter().fold(0.0_f64, |most, stage| {
            let v = Vector::<Y::Manifold>::from_index(|c| stage.displacement[c].re);
            most.max(v.magnitude())
        });
        let unit = if largest > 0.0 { power_of_two(largest / moved.size.re.abs()) } else { 1.0 };
        let (mut flat, mut square) = (Vec::new(), Dual64::from(0.0));
        for (stage, weight) in moved.stages.iter().zip(weights) {
            let v = stage.displacement * (inverse / unit);
            let g = self.around.system.metric_at(&stage.place);
            let lower = g.inner().ok()?.flat(&v);
            square += moved.size * *weight * lower.dot(&v);
            flat.push(lower * Dual64::from(unit));
        }
        Some(Flat { flat, square: square * unit * unit })
    }

    fn derivative(&self, number: usize) -> Result<Derivative<Y>, Unlinearised> {
        let (around, moved) = (&self.around, &self.moved[number]);
        let (system, tableau) = (around.system, around.root.tableau);
        let flat = self.flat(moved).ok_or(Unlinearised::Singular)?;
        let mut w = self.differentials(moved);
        let lost = |law: usize| self.laws.list[law].lost(&tableau.weights, moved, number);
        let share = |law: usize| {
            if flat.square.re == 0.0 { Dual64::from(0.0) } else { lost(law) / flat.square }
        };
        let places = &self.laws.places;
        let is_exact = system.second_law() == SecondLaw::Exact;
        let shares: [_; 2] = match (&around.root.heats, is_exact) {
            (Some(_), _) => [None, None],
            (None, true) => [Some(share(places.energy)), Some(share(places.entropy))],
            (None, false) => [Some(share(places.energy)), None],
        };
        let listed = CountOf::<Y>::array(|a| places.invariants.as_ref()[a].map(|(_, l)| share(l)));
        for (w, flat) in w.iter_mut().zip(&flat.flat) {
            if let Some(share) = shares[0] {
                w.energy += *flat * share;
            }
            if let Some(share) = shares[1] {
                w.entropy += *flat * share;
            }
            for (a, share) in listed.as_ref().iter().enumerate() {
                if let (Some((_, l)), Some(share)) = (&mut w.invariants[a], share) {
                    *l += *flat * *share;
                }
            }
        }
        let mut heat = None;
        if let Some(start) = &around.root.heats {
            let jet = ScalarField::<Y::Manifold>::jet2(system.energy(), around.piece.x);
            let (energy, lost) =
                (along::<Y>(&jet, &moved.start).1, [lost(places.energy), lost(places.entropy)]);
            let direction = &self.directions[number];
            let heating = Heating { around, start, direction, moved, flat: &flat, energy, lost };
            heat = Some(heating.add(&mut w)?);
        }
        let mut produced = heat.as_ref().map_or(0.0, |heat| heat.gain.eps);
        let mut residual = Vec::new();
        for (i, (stage, w)) in moved.stages.iter().zip(&w).enumerate() {
            let g = system.metric_at(&stage.place);
            let friction = irreversible(system, &g, w).map_err(|_| Unlinearised::Singular)?;
            let mut velocity =
                reversible(system, &g, w).map_err(|_| Unlinearised::Singular)? + friction;
            if let Some(heat) = &heat {
                velocity += heat.velocity[i];
            }
            produced += (moved.size * w.entropy.dot(&friction) * tableau.weights[i]).eps;
            residual.push(derivative(&(velocity * moved.size - stage.displacement)));
        }
        Ok(Derivative { residual, start: moved.start, end: moved.end, produced })
    }

    /// The differentials of all fields at the stages.
    fn differentials(&self, moved: &Moved<Y>) -> Vec<AtStage<Y>> {
        let Laws { list, places } = &self.laws;
        let stages = moved.stages.iter().enumerate();
        let here = |(i, stage): (usize, &super::moved::MovedStage<Y>)| {
            let covector = |law: usize| -> Dual<Y> { list[law].covector(i, &stage.delta) };
            AtStage::<Y> {
                energy: covector(places.energy),
                entropy: covector(places.entropy),
                invariants: CountOf::<Y>::array(|a| {
                    places.invariants.as_ref()[a].map(|(kind, law)| (kind, covector(law)))
                }),
            }
        };
        stages.map(here).collect()
    }
}
