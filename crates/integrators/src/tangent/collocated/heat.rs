//! The heat of a step that damps, at dual numbers: what [`Radau`](crate::Radau) returns of the energy that friction has lost.
//!
//! The formulas are those of the step, on the branch that it took.

use metriplectic_dynamics::Metriplectic;
use metriplectic_dynamics::orthogonal::Orthogonal;
use metriplectic_dynamics::velocity::{Covectors, irreversible, reversible};
use metriplectic_fields::{Column as _, Dimension as _, Matrix, Square as _, Vector};
use metriplectic_manifolds::{InnerProduct as _, Manifold as _, MovingBase, Riemannian as _};
use num_dual::{Dual64, DualNum as _};

use super::super::duals::{Dual, magnitude};
use super::super::error::Unlinearised;
use super::moved::{Around, Direction, Moved, MovedStage};
use crate::collocation::{HeatStart, fraction, largest_entries};
use crate::step::{CountOf, Dim};

/// The covectors of all laws at a stage.
pub(super) type AtStage<Y> = Covectors<CountOf<Y>, Dual<Y>>;

/// The covectors `♭v_i` of the stages, and `D = h Σ b_i G(v_i, v_i)`.
pub(super) struct Flat<Y: Metriplectic> {
    pub(super) flat: Vec<Dual<Y>>,
    pub(super) square: Dual64,
}

/// A step that heats, along a direction.
pub(super) struct Heating<'a, Y: Metriplectic> {
    pub(super) around: &'a Around<'a, Y>,
    pub(super) start: &'a HeatStart<Dim<Y>>,
    pub(super) direction: &'a Direction<Y>,
    pub(super) moved: &'a Moved<Y>,
    pub(super) flat: &'a Flat<Y>,
    /// The differential of the energy at the start.
    pub(super) energy: Dual<Y>,
    /// The numbers `δ` by which the laws of energy and entropy are missed.
    pub(super) lost: [Dual64; 2],
}

/// The heat of the stages.
pub(super) struct Heat<Y: Metriplectic> {
    pub(super) velocity: Vec<Dual<Y>>,
    /// The entropy that is gained beside the production of friction.
    pub(super) gain: Dual64,
}

fn real<Y: Metriplectic>(v: &Dual<Y>) -> Vector<Y::Manifold> {
    Vector::<Y::Manifold>::from_index(|c| v[c].re)
}

/// A vector from its value and its derivative.
fn dual<Y: Metriplectic>(re: &Vector<Y::Manifold>, eps: &Vector<Y::Manifold>) -> Dual<Y> {
    Dual::<Y>::from_index(|c| Dual64::new(re[c], eps[c]))
}

fn applied<Y: Metriplectic>([t, dt]: &[Matrix<Y::Manifold>; 2], v: &Dual<Y>) -> Dual<Y> {
    let (re, eps) = (real::<Y>(v), Vector::<Y::Manifold>::from_index(|c| v[c].eps));
    dual::<Y>(&(*t * re), &(*t * eps + *dt * re))
}

impl<Y: Metriplectic<Manifold: MovingBase>> Heating<'_, Y> {
    /// The covector by which a stage is warmed, as a vector.
    fn sharp(&self, stage: &MovedStage<Y>, w: &AtStage<Y>) -> Result<Dual<Y>, Unlinearised> {
        let metric = self.around.system.metric();
        let g = metric.at(&stage.place).map_err(|_| Unlinearised::Singular)?;
        let mut normals = Orthogonal::<Dim<Y>, Dual64>::default();
        for i in (0..Dim::<Y>::LEN).filter(|i| self.start.is_still(*i)) {
            normals.push(&g, &Dual::<Y>::basis(i));
        }
        for (_, l) in w.invariants.as_ref().iter().flatten() {
            normals.push(&g, l);
        }
        Ok(g.sharp(&normals.project_covector(0, &w.entropy)))
    }

    /// The fraction of the heat that goes in these directions.
    fn fraction(&self, sharp: &[Dual<Y>], w: &[AtStage<Y>]) -> Result<f64, Unlinearised> {
        let energies: Vec<_> = w.iter().map(|w| real::<Y>(&w.energy)).collect();
        let largest = largest_entries(&energies);
        let of_stages = sharp.iter().zip(&energies).map(|(sharp, energy)| {
            let sharp = real::<Y>(sharp);
            (energy.dot(&sharp), Y::Manifold::pairing_size(&largest, &sharp))
        });
        let (warmed, units): (Vec<_>, Vec<_>) = of_stages.unzip();
        let fraction = fraction(&warmed, &units);
        // Between the two the fraction follows sizes, which have no derivative.
        let follows = fraction > 0.0 && fraction < 1.0;
        if follows { Err(Unlinearised::Branch) } else { Ok(fraction) }
    }

    /// Whether friction vanishes at every stage.
    fn is_reversible(&self, w: &[AtStage<Y>]) -> bool {
        self.moved.stages.iter().zip(w).all(|(stage, w)| {
            let g = self.around.system.metric_at(&stage.place);
            irreversible(self.around.system, &g, w).is_ok_and(|v| real::<Y>(&v).magnitude() == 0.0)
        })
    }

    /// Corrects the covectors of energy and entropy with heat.
    pub(super) fn add(&self, w: &mut [AtStage<Y>]) -> Result<Heat<Y>, Unlinearised> {
        let Self { around, moved, flat, .. } = self;
        let (weights, h) = (&around.root.tableau.weights, moved.size);
        let is_reversible = self.is_reversible(w);
        let sharp = moved.stages.iter().zip(w.iter()).map(|(stage, w)| self.sharp(stage, w));
        let sharp = sharp.collect::<Result<Vec<_>, _>>()?;
        let directed = self.fraction(&sharp, w)?;
        let lost =
            if is_reversible || directed == 0.0 { Dual64::from(0.0) } else { self.transient(w)? };
        let [delta, mut gain] = self.lost;
        if flat.square.re != 0.0 {
            let share = (-lost + 1.0) * delta / flat.square;
            for (w, flat) in w.iter_mut().zip(&flat.flat) {
                w.energy += *flat * share;
            }
        }
        let rho = -lost * delta / h;
        let mut velocity = vec![Dual::<Y>::zero(); moved.stages.len()];
        let mut along = Dual64::from(0.0);
        if directed > 0.0 {
            for (i, w) in w.iter().enumerate() {
                velocity[i] = sharp[i] * (rho / w.energy.dot(&sharp[i]));
                let weight = h * weights[i];
                gain += weight * w.entropy.dot(&velocity[i]);
                along += weight * flat.flat[i].dot(&velocity[i]);
            }
        }
        let square = flat.square - along;
        if (gain.re < 0.0 || is_reversible) && square.re != 0.0 {
            for (w, flat) in w.iter_mut().zip(&flat.flat) {
                w.entropy += *flat * (gain / square);
            }
        }
        let gain = if is_reversible || gain.re < 0.0 { Dual64::from(0.0) } else { gain };
        Ok(Heat { velocity, gain })
    }

    /// The fraction of what is lost that becomes heat.
    fn transient(&self, w: &[AtStage<Y>]) -> Result<Dual64, Unlinearised> {
        let Self { around, moved, direction, .. } = self;
        let system = around.system;
        let mut stages = Vec::new();
        let mut means = [Dual::<Y>::zero(); 2];
        for (i, (stage, w)) in moved.stages.iter().zip(w).enumerate() {
            let g = system.metric_at(&stage.place);
            let motion = reversible(system, &g, w).map_err(|_| Unlinearised::Singular)?;
            let friction = stage.displacement * moved.size.recip() - motion;
            let map = around.map(direction, Some(i));
            let inverse = map[0].inverse().ok_or(Unlinearised::Singular)?;
            let to_middle = |v: &Dual<Y>| {
                let (re, eps) = (real::<Y>(v), Vector::<Y::Manifold>::from_index(|c| v[c].eps));
                let there = inverse * re;
                dual::<Y>(&there, &(inverse * (eps - map[1] * there)))
            };
            let parts = [to_middle(&motion), to_middle(&friction)];
            for (mean, part) in means.iter_mut().zip(&parts) {
                *mean += *part * Dual64::from(around.root.tableau.weights[i]);
            }
            stages.push((map, parts));
        }
        let start = around.map(direction, None);
        let mut sums = [Dual64::from(0.0); 2];
        for (i, ((map, parts), w)) in stages.iter().zip(w).enumerate() {
            for ((sum, part), mean) in sums.iter_mut().zip(parts).zip(&means) {
                let varied = *part - *mean;
                let [here, before] = [map, &start].map(|map| applied::<Y>(map, &varied));
                let paired = w.energy.dot(&here) - self.energy.dot(&before);
                *sum += magnitude(paired) * around.root.tableau.weights[i];
            }
        }
        let all = sums[0] + sums[1];
        Ok(if all.re > 0.0 { sums[1] / all } else { Dual64::from(0.0) })
    }
}
